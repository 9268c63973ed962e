//! Pictures do not depend on how they are drawn.

use bansho::base::color::decode_srgb8;

use crate::support::{FLAME, Folder, decode_png, read_exr};

#[test]
fn one_thread_and_many_give_the_same_bytes() {
    let folder = Folder::with_scene(FLAME);
    for extension in ["png", "exr"] {
        for threads in ["1", "2", "5"] {
            let out = format!("{extension}{threads}/f.{extension}");
            let layers: &[&str] = if extension == "exr" { &["--layers", "--aovs"] } else { &[] };
            folder.succeed(&[&["render", "scene.toml", "--threads", threads, "--out", &out], layers].concat());
        }
        let one = folder.files(&format!("{extension}1"));
        assert_eq!(one.len(), 6);
        for threads in [2, 5] {
            assert!(one == folder.files(&format!("{extension}{threads}")), "{extension}, {threads} threads");
        }
    }
    assert!(decode_png(&folder.files("png1")["f.0003.png"]).has_light());
}

#[test]
fn films_are_the_same_bytes_too() {
    let folder = Folder::with_scene(FLAME);
    for extension in ["apng", "gif"] {
        for threads in ["1", "4"] {
            let out = format!("{threads}.{extension}");
            folder.succeed(&["render", "scene.toml", "--threads", threads, "--out", &out]);
        }
        let files = folder.files("");
        assert!(files[&format!("1.{extension}")] == files[&format!("4.{extension}")], "{extension}");
    }
}

#[test]
fn a_crop_is_the_same_part_of_the_whole() {
    let folder = Folder::with_scene(FLAME);
    let crop = ["--frames", "3", "--crop", "9,20,30,31"];
    for bits in ["8", "16"] {
        folder.succeed(&["render", "scene.toml", "--frames", "3", "--bits", bits, "--out", "whole.png"]);
        folder.succeed(&[&["render", "scene.toml", "--bits", bits, "--out", "part.png"], &crop[..]].concat());
        let files = folder.files("");
        let (whole, part) = (decode_png(&files["whole.png"]), decode_png(&files["part.png"]));
        assert_eq!((part.width, part.height, part.bits), (30, 31, bits.parse().unwrap()));
        assert!(part.has_light());
        assert!(whole.part([9, 20, 30, 31]) == part.bytes, "{bits} bits");
    }
}

#[test]
fn a_crop_of_layers_and_measures_is_the_same_part_too() {
    let folder = Folder::with_scene(FLAME);
    let options = ["--layers", "--aovs", "--frames", "3"];
    folder.succeed(&[&["render", "scene.toml", "--out", "whole.exr"], &options[..]].concat());
    folder.succeed(&[&["render", "scene.toml", "--out", "part.exr", "--crop", "9,20,30,31"], &options[..]].concat());
    let (whole, part) = (read_exr(&folder.path("whole.exr")), read_exr(&folder.path("part.exr")));
    assert_eq!((part.size, part.origin, whole.origin), ([30, 31], [9, 20], [0, 0]));
    assert!(part.channels.contains_key("left log.temperature_k.V"), "{:?}", part.channels.keys());
    for (name, values) in &part.channels {
        for (index, value) in values.iter().enumerate() {
            let there = whole.channels[name][(20 + index / 30) * 48 + 9 + index % 30];
            assert!(there.to_bits() == value.to_bits(), "{name} at {index}: {there} and {value}");
        }
    }
}

/// Whether the opaque pixels `shown` are the pixels `frame` with straight alpha over black, within the precision of 8 bits.
fn is_over_black(shown: &[u8], frame: &[u8]) -> bool {
    let over = |(shown, frame): (&[u8], &[u8])| {
        let alpha = f32::from(frame[3]) / 255.0;
        (0..3).all(|channel| (decode_srgb8(shown[channel]) - alpha * decode_srgb8(frame[channel])).abs() < 0.012)
    };
    shown.len() / 3 == frame.len() / 4 && shown.chunks(3).zip(frame.chunks(4)).all(over)
}

#[test]
fn a_contact_sheet_holds_the_very_frames() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--alpha", "linear", "--out", "f/f.png"]);
    folder.succeed(&["render", "scene.toml", "--contact-sheet", "3", "--frames", "2-4"]);
    assert_eq!(folder.files("out/scene").keys().collect::<Vec<_>>(), ["scene.sheet.png"]);
    let sheet = decode_png(&folder.files("out/scene")["scene.sheet.png"]);
    assert_eq!((sheet.width, sheet.height), (2 * 48 + 2, 2 * 64 + 2));
    assert_eq!(sheet.channels, 3, "programs that leave alpha out show the same");
    assert_eq!(sheet.part([48, 0, 2, 1]), [38; 6], "what lies between is no black picture");
    for (index, [x, y]) in [[0, 0], [50, 0], [0, 66]].into_iter().enumerate() {
        let frame = decode_png(&folder.files("f")[&format!("f.{:04}.png", 2 + index)]);
        assert!(frame.channels == 4 && is_over_black(&sheet.part([x, y, 48, 64]), &frame.bytes), "frame {index}");
    }
}

#[test]
fn a_contact_sheet_holds_the_frames_that_are_listed() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--alpha", "linear", "--out", "f/f.png"]);
    folder.succeed(&["render", "scene.toml", "--contact-sheet", "2", "--frames", "1-5x2", "--out", "sheet.png"]);
    let sheet = decode_png(&std::fs::read(folder.path("sheet.png")).unwrap());
    for (x, frame) in [(0, "f.0001.png"), (50, "f.0003.png")] {
        assert!(is_over_black(&sheet.part([x, 0, 48, 64]), &decode_png(&folder.files("f")[frame]).bytes), "{frame}");
    }
}

#[test]
fn frames_of_a_contact_sheet_bear_their_numbers_and_lie_over_what_is_asked_for() {
    let folder = Folder::with_scene(FLAME);
    let sheet = |options: &[&str]| {
        let sheet = ["render", "scene.toml", "--contact-sheet", "2", "--size", "60x80", "--out", "sheet.png"];
        let sheet = [&sheet[..], &["--set", "camera.glare=0"]].concat();
        folder.succeed(&[&sheet[..], options].concat());
        decode_png(&std::fs::read(folder.path("sheet.png")).unwrap())
    };
    let black = sheet(&[]);
    // A digit is white on black; below it the first column is empty in either.
    assert_eq!((black.part([3, 1, 1, 1]), black.part([0, 0, 1, 1])), (vec![255; 3], vec![0; 3]));
    assert!(black.part([0, 0, 7, 9]) != black.part([62, 0, 7, 9]), "0 and 1");
    let board = sheet(&["--contact-background", "checkerboard"]);
    assert!(black.part([0, 0, 7, 9]) == board.part([0, 0, 7, 9]));
    assert_eq!((black.part([0, 78, 1, 1]), board.part([0, 78, 1, 1])), (vec![0; 3], vec![96; 3]));
    assert_eq!(board.part([8, 78, 1, 1]), [64; 3]);
    let misused = folder.run(&["render", "scene.toml", "--contact-background", "checkerboard"]);
    assert_eq!(misused.code, Some(2), "{}", misused.stderr);
}

#[test]
fn any_frame_alone_is_the_same_as_among_all() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["render", "scene.toml", "--out", "all/f.####.png"]);
    folder.succeed(&["render", "scene.toml", "--out", "some/f.%04d.png", "--frames", "5,1-3x2"]);
    let (all, some) = (folder.files("all"), folder.files("some"));
    assert_eq!(some.keys().collect::<Vec<_>>(), ["f.0001.png", "f.0003.png", "f.0005.png"]);
    assert!(some.iter().all(|(name, bytes)| all[name] == *bytes));
}

#[test]
fn frames_beyond_the_scene_are_drawn_with_a_warning() {
    let folder = Folder::with_scene(FLAME);
    let run = folder.succeed(&["render", "scene.toml", "--frames", "-3-7x5", "--out", "f.png"]);
    let warnings: Vec<&str> = run.stderr.lines().filter(|line| line.starts_with("warning: ")).collect();
    assert_eq!(warnings.len(), 1, "{}", run.stderr);
    assert!(warnings[0].contains("2 frames are outside the scene's range, 0 to 5"), "{}", run.stderr);
    assert_eq!(folder.names(), ["f.-003.png", "f.0002.png", "f.0007.png", "scene.toml"]);
}

#[test]
fn a_loop_comes_back_to_its_beginning() {
    let folder = Folder::with_scene(FLAME);
    let options = ["render", "scene.toml", "--loop", "0.5", "--out"];
    folder.succeed(&[&options[..], &["turn/f.png"]].concat());
    assert_eq!(folder.files("turn").len(), 15);
    let run = folder.succeed(&[&options[..], &["more/f.exr", "--frames", "0,15"]].concat());
    assert!(run.stderr.contains("warning: 1 frame is outside the loop's range, 0 to 14"), "{}", run.stderr);
    let [first, again] = ["0000", "0015"].map(|number| read_exr(&folder.path(&format!("more/f.{number}.exr"))));
    assert!(first.channels == again.channels);
}

#[test]
fn seed_size_and_settings_change_the_picture() {
    let folder = Folder::with_scene(FLAME);
    let draw = |name: &str, options: &[&str]| {
        folder.succeed(&[&["render", "scene.toml", "--frames", "3", "--out", name], options].concat());
        decode_png(&folder.files("")[name])
    };
    let plain = draw("plain.png", &[]);
    let same_seed = draw("same.png", &["--seed", "7"]);
    assert!(plain.bytes == same_seed.bytes);
    assert!(plain.bytes != draw("seed.png", &["--seed", "8"]).bytes);
    assert!(plain.bytes != draw("raw.png", &["--view", "raw"]).bytes);
    assert!(plain.bytes != draw("set.png", &["--set", "flame_sheet.left log.height=0.5"]).bytes);
    let large = draw("large.png", &["--size", "96x32"]);
    assert_eq!((large.width, large.height), (96, 32));
    assert_eq!(draw("deep.png", &["--bits", "16"]).bits, 16);
}

#[test]
fn options_without_effect_are_warned_of() {
    let folder = Folder::with_scene(FLAME);
    for (arguments, warning) in [
        (&["--out", "a.gif", "--bits", "16"][..], "--bits: the number of bits has no effect on .gif"),
        (&["--out", "a.exr", "--frames", "1", "--view", "raw"], "--view: a view has no effect on .exr"),
        (&["--out", "a.gif", "--resume"], "--resume: resuming has no effect on .gif"),
        (&["--contact-sheet", "2", "--resume"], "--resume: resuming has no effect on a sheet"),
        (&["--out", "a.png", "--frames", "1", "--snapshots", "s"], "--snapshots: snapshots have no effect"),
    ] {
        let run = folder.succeed(&[&["render", "scene.toml"], arguments].concat());
        let warnings = run.stderr.lines().filter(|line| line.starts_with("warning: "));
        assert_eq!(warnings.clone().count(), 1, "{}", run.stderr);
        assert!(run.stderr.contains(warning), "{}", run.stderr);
    }
}

#[test]
fn overscan_is_kept_by_exr_and_left_out_of_png() {
    let scene = FLAME.replace("seed = 7", "seed = 7\noverscan = 4");
    let (wide, plain) = (Folder::with_scene(&scene), Folder::with_scene(FLAME));
    for folder in [&wide, &plain] {
        folder.succeed(&["render", "scene.toml", "--frames", "3", "--out", "f.png"]);
    }
    let [wide_png, plain_png] = [&wide, &plain].map(|folder| decode_png(&folder.files("")["f.png"]));
    assert_eq!((wide_png.width, wide_png.height), (48, 64));
    assert!(wide_png.bytes == plain_png.bytes);
    wide.succeed(&["render", "scene.toml", "--frames", "3", "--out", "f.exr"]);
    let frame = read_exr(&wide.path("f.exr"));
    assert_eq!((frame.size, frame.origin), ([56, 72], [-4, -4]));
}
