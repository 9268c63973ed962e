//! Invalid input: one error for each problem, with its position and what is allowed, the right exit code, and no output.

use std::process::Stdio;

use crate::support::{FLAME, Folder, Run, wait_until};

/// Renders an invalid scene and returns the messages.
fn refused(scene: &str, code: i32) -> String {
    let folder = Folder::with_scene(scene);
    let run = folder.run(&["render", "scene.toml"]);
    assert_eq!((run.code, run.errors()), (Some(code), 1), "{}", run.stderr);
    assert_eq!(folder.names(), ["scene.toml"], "nothing may be written");
    assert!(!folder.path("out").exists(), "not even a folder");
    assert_eq!(folder.run(&["check", "scene.toml"]).code, Some(code));
    run.stderr
}

fn with_line(table: &str, line: &str) -> String {
    FLAME.replace(&format!("{table}\n"), &format!("{table}\n{line}\n"))
}

/// Checks that an error contains all `parts`.
fn says(error: &str, parts: &[&str]) {
    for part in parts {
        assert!(error.contains(part), "`{part}` is not in: {error}");
    }
}

#[test]
fn an_unknown_key_names_the_nearest() {
    let error = refused(&with_line("[picture]", "exposre_ev100 = 3"), 3);
    says(&error, &["error: scene.toml:4:1: ", "`exposre_ev100`", "did you mean `exposure_ev100`?", "size, frames"]);
}

#[test]
fn an_unknown_table_names_the_nearest() {
    says(&refused(&FLAME.replace("flame_sheet", "flame_sheat"), 3), &["scene.toml:12:", "flame_sheat", "flame_sheet"]);
}

#[test]
fn a_wrong_type_says_what_is_wanted() {
    let error = refused(&FLAME.replace("frames = 6", "frames = \"six\""), 3);
    says(&error, &["scene.toml:5:10: picture.frames: ", "found a string", "1 to 10000000"]);
}

#[test]
fn a_value_out_of_range_says_the_range() {
    let error = refused(&with_line("[[flame_sheet]]", "height = -3.0"), 3);
    says(&error, &["scene.toml:13:10: flame_sheet.0.height: -3 is out of range; allowed: ", " m"]);
}

#[test]
fn a_missing_plate_is_named() {
    let error = refused(&format!("{FLAME}[plate]\nimage = \"plates/gone.png\"\n"), 3);
    says(&error, &["scene.toml:15:9: plate.image: ", "plates/gone.png", "no such file"]);
}

#[test]
fn a_camera_that_looks_nowhere_is_refused() {
    let error = refused(&FLAME.replace("target = [0.0, 0.8, 0.0]", "target = [0.0, 0.8, 3.0]"), 3);
    says(&error, &["scene.toml:10:10: camera.target: ", "equals the camera's position", "allowed: "]);
}

#[test]
fn a_scene_that_is_no_text_is_told_with_its_line() {
    let folder = Folder::new();
    std::fs::write(folder.path("scene.toml"), b"bansho = 2\n# caf\xe9\n").unwrap();
    let run = folder.run(&["check", "scene.toml"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
    says(&run.stderr, &["scene.toml:2: ", "is not valid UTF-8 from this line on", "allowed: "]);
}

#[test]
fn a_plate_that_is_no_picture_is_refused() {
    let scene = format!("{FLAME}[plate]\nimage = \"plate.png\"\n");
    for contents in [&b""[..], b"no picture", b"\x89PNG\r\n\x1a\n"] {
        let folder = Folder::with_scene(&scene);
        std::fs::write(folder.path("plate.png"), contents).unwrap();
        let run = folder.run(&["render", "scene.toml"]);
        assert_eq!((run.code, run.errors()), (Some(3), 1), "{contents:?}: {}", run.stderr);
        says(&run.stderr, &["scene.toml:15:9: plate.image: ", "plate.png", "damaged"]);
        assert_eq!(folder.run(&["check", "scene.toml"]).code, Some(3), "a check finds it too");
        assert_eq!(folder.names(), ["plate.png", "scene.toml"]);
    }
}

#[test]
fn sizes_of_nothing_and_of_a_billion_are_refused() {
    for size in ["0, 64", "48, 1000000000"] {
        let error = refused(&FLAME.replace("48, 64", size), 3);
        says(&error, &["scene.toml:4:", "picture.size: ", "out of range; allowed: 1 to 16384 pixels"]);
    }
}

#[test]
fn a_curve_that_falls_where_it_must_rise_is_refused() {
    let error = refused(&format!("{FLAME}texture = {{ threshold_across = [[0, 0.5], [1, 0.2]] }}\n"), 3);
    says(&error, &["scene.toml:14:", "threshold_across", "decreases between x = 0 and x = 1"]);
}

#[test]
fn keys_that_do_not_ascend_are_refused() {
    let error = refused(&format!("{FLAME}[wind]\nvelocity = {{ keys = [[1, [0, 0, 0]], [0, [1, 0, 0]]] }}\n"), 3);
    says(&error, &["scene.toml:15:", "wind.velocity"]);
}

#[test]
fn text_that_is_no_toml_is_located() {
    says(&refused("bansho = 2\n[picture\n", 3), &["error: scene.toml:2:"]);
}

#[test]
fn any_other_format_is_refused() {
    for format in [1, 99] {
        let found = format!("format {format} cannot be read by this version; allowed: 2");
        says(&refused(&format!("bansho = {format}\n"), 3), &["scene.toml:1:10: ", &found]);
    }
}

#[test]
fn a_scene_that_is_not_there_is_named() {
    let folder = Folder::new();
    let run = folder.run(&["render", "gone.toml"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1));
    says(&run.stderr, &["error: gone.toml: the scene cannot be read", "`bansho new gone.toml` writes a new scene"]);
    folder.write("scenes/fire.toml", FLAME);
    folder.write("scenes/water.toml", FLAME);
    for typed in ["scenes/fre.toml", "scenes/fire", "scenes/Fire.toml"] {
        let run = folder.run(&["check", typed]);
        assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
        says(&run.stderr, &[&format!("error: {typed}: "), "did you mean `scenes/fire.toml`?"]);
    }
    let far = folder.run(&["check", "scenes/zzz.toml"]).stderr;
    assert!(!far.contains("did you mean") && far.contains("bansho new scenes/zzz.toml"), "{far}");
}

#[test]
fn each_fault_has_an_error_of_its_own() {
    let folder = Folder::with_scene("bansho = 2\n[picture]\nsize = [0, 4]\nfps = true\n[wnd]\n");
    let run = folder.run(&["render", "scene.toml"]);
    assert_eq!((run.code, run.errors()), (Some(3), 3), "{}", run.stderr);
    assert_eq!(folder.names(), ["scene.toml"]);
}

/// Options that make no sense: exit code 2, one error, nothing written.
fn misused(arguments: &[&str], parts: &[&str]) {
    let folder = Folder::with_scene(FLAME);
    let run = folder.run(&[&["render", "scene.toml"], arguments].concat());
    assert_eq!((run.code, run.errors()), (Some(2), 1), "{arguments:?}: {}", run.stderr);
    says(&run.stderr, parts);
    assert_eq!(folder.names(), ["scene.toml"], "{arguments:?}");
}

#[test]
fn frames_that_run_backward_are_refused() {
    misused(&["--frames", "9-1"], &["`9-1` ends before it begins", "0-239x10"]);
    misused(&["--frames", "1-9x0"], &["step of zero"]);
    misused(&["--frames", "first"], &["`first` is not a frame"]);
}

#[test]
fn sizes_crops_and_loops_out_of_range_are_refused() {
    misused(&["--size", "0x5"], &["1 to 16384"]);
    misused(&["--size", "1000000000x5"], &["1 to 16384"]);
    misused(&["--crop", "40,0,9,9"], &["extends beyond the picture of 48 x 64 pixels"]);
    misused(&["--crop", "1,2,3"], &["x,y,width,height"]);
    misused(&["--loop", "0"], &["a loop of 0 s; allowed: ", "3600"]);
    misused(&["--loop", "-1"], &["a loop of -1 s; allowed: "]);
    misused(&["--loop", "soon"], &["a number of seconds"]);
    misused(&["--threads", "0"], &["1..=1024"]);
}

#[test]
fn names_that_cannot_be_written_are_refused() {
    misused(&["--out", "a.tiff"], &["a.tiff", ".png, .exr, .apng, .gif, .mp4"]);
    misused(&["--out", "a.##.##.png"], &["more than one placeholder"]);
    misused(&["--out", "frame"], &["no extension"]);
}

#[test]
fn a_seed_below_zero_is_told_what_may_be() {
    misused(&["--seed", "-1"], &["--seed", "allowed: a whole number from 0 to 18446744073709551615"]);
    misused(&["--seed", "soon"], &["--seed", "allowed: a whole number from 0 to"]);
}

#[test]
fn options_that_do_not_go_together_are_refused() {
    misused(&["--layers"], &["--layers", ".exr"]);
    misused(&["--aovs", "--out", "a.mp4"], &["--aovs", ".exr"]);
    misused(&["--contact-sheet", "4", "--out", "a.gif"], &["a.gif", ".png"]);
    misused(&["--contact-sheet", "0"], &["--contact-sheet: a sheet of 0 tiles; allowed: 1 to 4096"]);
    misused(
        &["--contact-sheet", "4", "--frames", "0-8x4"],
        &["--contact-sheet: a sheet of 4 tiles for 3 frames", "allowed: 1 to 3"],
    );
    misused(&["--contact-sheet", "99", "--size", "9000x9000"], &["16384"]);
    misused(&["--snapshot-every", "3"], &["--snapshots"]);
    misused(&["--snapshots", "s", "--snapshot-every", "0"], &["allowed: 1 or more"]);
}

#[test]
fn assignments_at_fault_are_blamed_and_not_the_scene() {
    misused(&["--set", "picture.size"], &["picture.size", "key.path=value"]);
    misused(&["--set", "flame_sheet.7.height=2"], &["flame_sheet.7.height", "left log"]);
    misused(&["--set", "picture.frames=0"], &["scene.toml as changed", "picture.frames", "out of range"]);
    misused(&["--set", "picture.framse=3"], &["did you mean `frames`?"]);
    misused(&["--set", "height=2"], &["--set: height=2: ", "did you mean `flame_sheet.height`?"]);
    // A problem of the scene itself is reported as such, with its line.
    let folder = Folder::with_scene(&FLAME.replace("frames = 6", "frames = 0"));
    let run = folder.run(&["render", "scene.toml", "--set", "wind.gust=0.5"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1));
    says(&run.stderr, &["scene.toml:5:10: picture.frames"]);
    // An assignment can also correct it.
    folder.succeed(&["render", "scene.toml", "--set", "picture.frames=1"]);
}

#[test]
fn words_that_are_no_options_are_refused_with_the_nearest() {
    misused(&["--frmes", "1"], &["--frmes", "--frames"]);
    misused(&["--view", "filmic"], &["display", "agx", "standard", "raw"]);
    misused(&["--bits", "12"], &["8", "16"]);
}

/// The messages for a particle flame with these lines.
fn refused_gas(lines: &str) -> String {
    refused(&format!("bansho = 2\n[picture]\nsize = [32, 18]\n[[flame_particles]]\n{lines}"), 3)
}

#[test]
fn a_burner_outside_the_domain_names_the_corner_that_it_lies_beyond() {
    let error = refused_gas("domain_max = [5, 5, 5]\n[[flame_particles.burners]]\nposition = [0, 90, 0]\n");
    says(&error, &["scene.toml:7:12: ", "burners.0.position", "[0.0, 90.0, 0.0] m", "`domain_max` [5.0, 5.0, 5.0] m"]);
    let error = refused_gas("domain_min = [1, -1, -1]\n[[flame_particles.burners]]\nposition = [0.5, 0, 0]\n");
    says(&error, &["scene.toml:7:12: ", "`domain_min` [1.0, -1.0, -1.0] m"]);
    // Without a stated position, the error is at the corner.
    let error = refused_gas("particles = 500\ndomain_min = [1, -1, -1]\n");
    says(&error, &["scene.toml:6:14: ", "domain_min", "[0.0, 0.0, 0.0] m"]);
}

#[test]
fn gas_that_cannot_be_says_what_can() {
    let inside_out = refused_gas("domain_min = [-9, -9, -9]\ndomain_max = [9, -9.5, 9]\n");
    says(&inside_out, &["flame_particles.0.", "domain_max"]);
    let coarse = refused_gas(
        "particles = 1\ndomain_min = [-0.02, -0.02, -0.02]\ndomain_max = [0.02, 0.02, 0.02]\n[[flame_particles.burners]]\ndiameter = 0.03\n",
    );
    says(&coarse, &["scene.toml:5:13: ", "support radius d", "the domain's 0.0400 m", "more particles"]);
    let many = refused_gas("particles = 900000000\n");
    says(&many, &["scene.toml:5:13: ", "900000000 particles would take 562 GiB; allowed: up to "]);
    for temperature in ["0", "1e6"] {
        let error = refused_gas(&format!("[[flame_particles.burners]]\ntemperature_k = {temperature}\n"));
        says(&error, &["scene.toml:6:17: ", "temperature_k", "is out of range", " K"]);
    }
    // A line of one meter: a mesh without a triangle.
    let line = "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],\
        \"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"mode\":1}]}],\
        \"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":2,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[1,0,0]}],\
        \"bufferViews\":[{\"buffer\":0,\"byteLength\":24}],\
        \"buffers\":[{\"byteLength\":24,\"uri\":\"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAA\"}]}";
    let folder = Folder::with_scene(
        "bansho = 2\n[[flame_particles]]\n[[flame_particles.burners]]\nshape = \"mesh\"\nfile = \"mesh.gltf\"\n",
    );
    folder.write("mesh.gltf", line);
    let run = folder.run(&["check", "scene.toml"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
    says(&run.stderr, &["scene.toml:5:8: ", "mesh.gltf", "no triangles with nonzero area"]);
}

/// Plates `plate.0000.png` and so on, drawn from the scene itself.
fn with_plates(frames: &str) -> Folder {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--frames", frames, "--out", "plate.####.png"]);
    folder.write("laid.toml", &format!("{FLAME}[plate]\nimage = \"plate.####.png\"\n"));
    folder
}

#[test]
fn a_frame_without_its_plate_is_told_before_anything_is_drawn() {
    let folder = with_plates("0-5");
    folder.succeed(&["check", "laid.toml"]);
    std::fs::remove_file(folder.path("plate.0003.png")).unwrap();
    for arguments in
        [&["check", "laid.toml"][..], &["render", "laid.toml"], &["flipbook", "laid.toml", "--grid", "2x3"]]
    {
        let run = folder.run(arguments);
        assert_eq!((run.code, run.errors()), (Some(3), 1), "{arguments:?}: {}", run.stderr);
        says(&run.stderr, &["laid.toml:15:9: plate.image: ", "plate.0003.png: no such file", "plate of frame 3"]);
        assert!(!folder.path("out").exists());
    }
    folder.succeed(&["render", "laid.toml", "--frames", "0-2", "--out", "f.png"]);
    std::fs::remove_file(folder.path("plate.0004.png")).unwrap();
    says(&folder.run(&["check", "laid.toml"]).stderr, &["plate of frame 3, and 2 of the 6 frames have none"]);
}

#[test]
fn a_plate_that_is_damaged_on_the_way_is_told_with_its_line() {
    let folder = with_plates("0-5");
    std::fs::write(folder.path("plate.0002.png"), "no picture").unwrap();
    let run = folder.run(&["render", "laid.toml", "--out", "f.png"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
    says(&run.stderr, &["laid.toml:15:9: plate.image: ", "plate.0002.png: is damaged"]);
}

#[test]
fn a_plate_that_is_damaged_while_frames_are_drawn_is_told_with_the_frame() {
    for in_flight in ["1", "4"] {
        let folder = with_plates("0-199");
        let work = ["--frames", "0-199", "--threads", "4", "--frames-in-flight", in_flight];
        let mut command = folder.command(&[&["render", "laid.toml", "--out", "f/f.png"], &work[..]].concat());
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        wait_until("a frame", || folder.path("f/f.0000.png").exists());
        std::fs::write(folder.path("plate.0190.png"), "no picture").unwrap();
        let run = Run::of(child.wait_with_output().unwrap());
        assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
        says(&run.stderr, &["error: frame 190: laid.toml:15:9: plate.image: ", "plate.0190.png: is damaged"]);
        assert_eq!(run.stderr.matches("frame ").count(), 1, "{}", run.stderr);
        let files = folder.files("f");
        assert!((1..=190).contains(&files.len()), "{}", files.len());
        let in_order = files.keys().enumerate().all(|(index, name)| *name == format!("f.{index:04}.png"));
        assert!(in_order, "{:?}", files.keys());
    }
}

#[test]
fn frames_of_a_plate_are_checked_whole_and_of_one_size_before_anything_is_drawn() {
    let folder = with_plates("0-5");
    let whole = std::fs::read(folder.path("plate.0004.png")).unwrap();
    std::fs::write(folder.path("plate.0004.png"), &whole[..whole.len() - 20]).unwrap();
    for arguments in
        [&["check", "laid.toml"][..], &["render", "laid.toml"], &["flipbook", "laid.toml", "--grid", "2x3"]]
    {
        let run = folder.run(arguments);
        assert_eq!((run.code, run.errors()), (Some(3), 1), "{arguments:?}: {}", run.stderr);
        says(
            &run.stderr,
            &["laid.toml:15:9: plate.image: ", "plate.0004.png: is damaged", "truncated; it is the plate of frame 4"],
        );
        assert!(!folder.path("out").exists());
    }
    folder.succeed(&[
        "render",
        "scene.toml",
        "--frames",
        "4",
        "--size",
        "24x32",
        "--overwrite",
        "--out",
        "plate.0004.png",
    ]);
    let run = folder.run(&["check", "laid.toml"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
    says(&run.stderr, &["frame 4 has 24 x 32 pixels, and that of frame 0 48 x 64; allowed: one size"]);
}

#[test]
fn a_file_that_a_change_names_is_the_one_that_is_missing() {
    let folder = Folder::with_scene(&format!("{FLAME}[plate]\nimage = \"gone.png\"\n"));
    let told = |change: &str| {
        let run = folder.run(&["render", "scene.toml", "--set", change]);
        // A wrong use of the program, or where the change names no file a wrong scene.
        let code = if change.contains("image") || change.contains("mesh") { 2 } else { 3 };
        assert_eq!((run.code, run.errors()), (Some(code), 1), "{}", run.stderr);
        run.stderr
    };
    let wrong = told("plate.image=\"nosuch.png\"");
    assert!(wrong.contains("nosuch.png: no such file") && !wrong.contains("gone.png"), "{wrong}");
    // A change elsewhere leaves the file's own problem.
    let own = told("picture.frames=2");
    says(&own, &["scene.toml:15:9: plate.image: ", "gone.png: no such file"]);
    let folder = Folder::with_scene(&format!("{FLAME}[[obstacle]]\nshape = \"mesh\"\nfile = \"gone.glb\"\n"));
    let run = folder.run(&["render", "scene.toml", "--set", "obstacle.file=\"nosuch.glb\""]);
    assert!(run.stderr.contains("nosuch.glb: no such file") && !run.stderr.contains("gone.glb"), "{}", run.stderr);
}

#[test]
fn whole_numbers_are_written_as_such_everywhere() {
    let error = refused(&FLAME.replace("size = [48, 64]", "size = [48.0, 64]"), 3);
    says(&error, &["picture.size", "expected a whole number", "found a number"]);
}

#[test]
fn what_the_scene_is_read_from_is_never_written_over() {
    let folder = with_plates("0-1");
    let before = folder.files("");
    let refused = |arguments: &[&str], named: &str| {
        let run = folder.run(arguments);
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{arguments:?}: {}", run.stderr);
        says(&run.stderr, &[named, "is a file that the scene is read from; allowed: "]);
        assert!(folder.files("").iter().filter(|(name, _)| before.contains_key(*name)).all(|(n, b)| before[n] == *b));
    };
    refused(&["render", "laid.toml", "--out", "plate.####.png", "--frames", "0-1"], "plate.0000.png");
    // Also where only a frame that is not drawn would lose its plate.
    folder.write("one.toml", &format!("{FLAME}[plate]\nimage = \"plate.0001.png\"\n"));
    refused(&["render", "one.toml", "--out", "plate.png", "--frames", "0-1"], "plate.0001.png");
    refused(&["render", "one.toml", "--out", "plate.0001.png", "--frames", "0"], "plate.0001.png");
    refused(&["render", "one.toml", "--out", "plate.0001.png", "--contact-sheet", "2"], "plate.0001.png");
    #[cfg(unix)]
    {
        let link =
            |target: &str, name: &str| std::os::unix::fs::symlink(folder.path(target), folder.path(name)).unwrap();
        link("plate.0000.png", "linked.png");
        refused(&["render", "laid.toml", "--out", "linked.png", "--frames", "0"], "linked.png");
        link("laid.toml", "film.gif");
        refused(&["render", "laid.toml", "--out", "film.gif", "--frames", "0-1"], "film.gif");
        link("plate.0001.png", "book_color.png");
        refused(&["flipbook", "laid.toml", "--grid", "2x1", "--out", "book.png"], "book_color.png");
    }
    std::fs::create_dir(folder.path("sub")).unwrap();
    refused(&["render", "laid.toml", "--out", "sub/../plate.####.png", "--frames", "0-1"], "plate.0000.png");
    folder.succeed(&["render", "laid.toml", "--out", "other.####.png", "--frames", "0-1"]);
}
