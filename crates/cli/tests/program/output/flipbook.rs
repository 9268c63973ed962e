//! Flipbooks for game engines.

use crate::support::{FLAME, Folder, decode_png, read_exr};

fn description(folder: &Folder, file: &str) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(folder.path(file)).unwrap()).unwrap()
}

/// The pixels of a sheet as they are seen: what is transparent has no color.
fn visible(pixels: &[u8]) -> Vec<[u8; 4]> {
    let seen = |pixel: &[u8; 4]| if pixel[3] == 0 { [0; 4] } else { *pixel };
    pixels.as_chunks().0.iter().map(seen).collect()
}

#[test]
fn sheets_of_data_do_not_claim_to_be_colors() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["flipbook", "scene.toml", "--grid", "2x1", "--size", "48x64", "--out", "fire.png"]);
    let files = folder.files(".");
    let has = |file: &str, word: &str| files[file].windows(word.len()).any(|part| part == word.as_bytes());
    for word in ["sRGB", "gAMA", "cHRM"] {
        assert!(has("fire_color.png", word) && !has("fire_motion.png", word) && !has("fire_alpha.png", word), "{word}");
    }
    folder.succeed(&["flipbook", "scene.toml", "--grid", "2x1", "--size", "48x64", "--out", "light.exr"]);
    let files = folder.files(".");
    let has = |file: &str, word: &str| files[file].windows(word.len()).any(|part| part == word.as_bytes());
    for word in ["chromaticities", "lin_ap1_scene", "adoptedNeutral"] {
        assert!(has("light_color.exr", word) && !has("light_motion.exr", word), "{word}");
    }
    assert!(has("light_motion.exr", "colorInteropID\0string\0\x04\0\0\0data"));
}

#[test]
fn a_flipbook_holds_the_very_frames_and_says_where() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["flipbook", "scene.toml", "--grid", "3x2", "--size", "48x64", "--out", "game/fire.png"]);
    // Flipbooks have no glare, unless the scene states it.
    folder.succeed(&["render", "scene.toml", "--alpha", "linear", "--set", "camera.glare=0", "--out", "f/f.png"]);
    let files = folder.files("game");
    let names: Vec<&str> = files.keys().map(String::as_str).collect();
    assert_eq!(names, ["fire.json", "fire_alpha.png", "fire_color.png", "fire_motion.png"]);
    let about = description(&folder, "game/fire.json");
    let color = decode_png(&files["fire_color.png"]);
    let alpha = decode_png(&files["fire_alpha.png"]);
    assert_eq!((color.width, color.height, color.channels), (144, 128, 4));
    for (index, frame) in about["frames"].as_array().unwrap().iter().enumerate() {
        let place = ["x", "y", "width", "height"].map(|key| frame[key].as_u64().unwrap() as usize);
        let drawn = decode_png(&folder.files("f")[&format!("f.{index:04}.png")]);
        assert!(visible(&color.part(place)) == visible(&drawn.bytes), "frame {index}");
        // Beside what is seen, transparent pixels have colors, which samplers mix in.
        let part = color.part(place);
        let colored = part.chunks_exact(4).filter(|pixel| pixel[3] == 0 && pixel[..3] != [0; 3]).count();
        assert!(colored > 50, "frame {index}: {colored}");
        let alphas: Vec<u8> = drawn.bytes.chunks_exact(4).map(|pixel| pixel[3]).collect();
        let grey: Vec<u8> = alpha.part(place).chunks_exact(3).map(|pixel| pixel[0]).collect();
        assert!(alphas == grey, "frame {index}");
    }
    assert_eq!((about["fps"].as_f64(), about["loop"].as_bool()), (Some(30.0), Some(false)));
}

#[test]
fn frames_are_cropped_to_what_is_lit_and_fill_the_sheet() {
    // A small flame to the left of the middle of a wide picture.
    let small = FLAME
        .replace("[48, 64]", "[320, 180]")
        .replace("[[flame_sheet]]", "[[flame_sheet]]\nwidth = 0.2\nheight = 0.5\nposition = [-0.6, 0.6, 0.0]");
    let folder = Folder::with_scene(&small);
    folder.succeed(&["flipbook", "scene.toml", "--grid", "3x2", "--out", "fire.png"]);
    let about = description(&folder, "fire.json");
    let numbers = |of: &serde_json::Value, keys: &[&str]| -> Vec<usize> {
        keys.iter().map(|key| of[key].as_u64().unwrap() as usize).collect()
    };
    let picture: Vec<usize> =
        about["picture"].as_array().unwrap().iter().map(|side| side.as_u64().unwrap() as usize).collect();
    let crop = numbers(&about["crop"], &["x", "y", "width", "height"]);
    let [x, y, width, height] = crop[..] else { panic!("{about}") };
    assert_eq!(about["tile"], serde_json::json!([width, height]));
    assert_eq!(picture, [640, 360], "twice the scene's size at most");
    assert!(width % 2 == 0 && height % 2 == 0 && 4 * width < picture[0] && x + width < picture[0] / 2, "{about}");
    let padding = numbers(&about["padding"], &["left", "top", "right", "bottom"]);
    assert_eq!(padding, [x, y, picture[0] - x - width, picture[1] - y - height]);
    // Each tile is that very part of the picture, and outside it there is nothing.
    let render = ["render", "scene.toml", "--alpha", "linear", "--set", "camera.glare=0", "--size", "640x360"];
    folder.succeed(&[&render[..], &["--out", "f/f.png"]].concat());
    let sheet = decode_png(&std::fs::read(folder.path("fire_color.png")).unwrap());
    for (index, frame) in about["frames"].as_array().unwrap().iter().enumerate() {
        let place: Vec<usize> = numbers(frame, &["x", "y", "width", "height"]);
        let drawn = decode_png(&folder.files("f")[&format!("f.{index:04}.png")]);
        let tile = sheet.part([place[0], place[1], width, height]);
        assert!(visible(&tile) == visible(&drawn.part([x, y, width, height])), "frame {index}");
        let lit = |part: Vec<u8>| part.chunks(4).filter(|pixel| pixel[3] > 0).count();
        assert_eq!(lit(drawn.part([x, y, width, height])), lit(drawn.bytes.clone()), "frame {index}");
    }
    // Without a crop tiles show all of the picture.
    folder.succeed(&["flipbook", "scene.toml", "--grid", "3x2", "--crop", "none", "--out", "all.png"]);
    let all = description(&folder, "all.json");
    assert_eq!((&all["tile"], &all["picture"]), (&serde_json::json!([320, 180]), &serde_json::json!([320, 180])));
    assert_eq!(numbers(&all["padding"], &["left", "top", "right", "bottom"]), [0; 4]);
    // If the picture is cropped, `--size` is the size of the whole picture.
    folder.succeed(&[
        "flipbook",
        "scene.toml",
        "--grid",
        "3x2",
        "--size",
        "320x180",
        "--crop",
        "auto",
        "--out",
        "own.png",
    ]);
    let own = description(&folder, "own.json");
    assert_eq!(own["picture"], serde_json::json!([320, 180]));
    assert!(own["tile"][0].as_u64().unwrap() < 100, "{own}");
}

#[test]
fn motion_is_told_in_pixels_around_a_middle() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["flipbook", "scene.toml", "--grid", "2x1", "--size", "48x64"]);
    let about = description(&folder, "out/scene/scene.json");
    let scale = about["motion"]["scale_pixels"].as_f64().unwrap();
    assert!(scale > 0.05 && scale < 64.0, "a flame rises by some pixels a frame, not {scale}");
    let motion = decode_png(&folder.files("out/scene")["scene_motion.png"]);
    assert_eq!((motion.bits, motion.channels), (16, 3));
    let code = |pixel: &[u8], at: usize| i32::from(u16::from_be_bytes([pixel[at], pixel[at + 1]])) - 32_768;
    let up: Vec<i32> = motion.bytes.chunks_exact(6).map(|pixel| code(pixel, 2)).collect();
    assert_eq!(up.iter().map(|code| code.abs()).max(), Some(32_767), "the scale is the largest motion");
    assert!(up.contains(&0), "where nothing is, nothing moves");
    assert!(up.iter().map(|&code| i64::from(code)).sum::<i64>() < 0, "fire rises, and y grows downward");
}

#[test]
fn every_frame_states_the_light_of_its_flame() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["flipbook", "scene.toml", "--grid", "3x2", "--size", "48x64", "--out", "fire.png"]);
    let about = description(&folder, "fire.json");
    assert!(about["lights"]["intensity_cd"].is_string(), "{about}");
    let sheet = decode_png(&std::fs::read(folder.path("fire_alpha.png")).unwrap());
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
    };
    let mut intensities = Vec::new();
    for frame in about["frames"].as_array().unwrap() {
        let [light] = &frame["lights"].as_array().unwrap()[..] else { panic!("{frame}") };
        assert_eq!(light["phenomenon"], "left log");
        let (color, pixel) = (numbers(&light["color"]), numbers(&light["tile_pixel"]));
        assert!(color[0] == 1.0 && color[0] > color[1] && color[1] > color[2] && color[2] >= 0.0, "{light}");
        let [intensity, candela] = ["intensity_cd", "luminous_intensity_cd"].map(|key| light[key].as_f64().unwrap());
        let luminance = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
        assert!((candela / (intensity * luminance) - 1.0).abs() < 1e-3 && candela > 0.0, "{light}");
        assert!(light["radius_m"].as_f64().unwrap() > 0.0);
        // It is among the tongues of the flame.
        let [x, y] = [pixel[0] as usize, pixel[1] as usize];
        let [left, top] = ["x", "y"].map(|key| frame[key].as_u64().unwrap() as usize);
        let around = sheet.part([left + x - 6, top + y - 6, 13, 13]);
        assert!(around.iter().filter(|alpha| **alpha > 100).count() > 3 * 10, "{light}");
        intensities.push(intensity);
    }
    let [least, most] = [f64::min, f64::max].map(|choose| intensities.iter().copied().reduce(choose).unwrap());
    assert!(most > 1.001 * least, "the light flickers: {intensities:?}");
    assert!(!folder.path("fire.gltf").exists());
    // The same as glTF; in a loop the first frame comes again at the end.
    let looped = ["flipbook", "scene.toml", "--grid", "3x2", "--loop", "1.5", "--gltf", "--out", "loop.png"];
    folder.succeed(&looped);
    let (about, gltf) = (description(&folder, "loop.json"), description(&folder, "loop.gltf"));
    assert_eq!(about["lights"]["file"], "loop.gltf");
    assert_eq!(gltf["nodes"][0]["name"], "left log");
    assert_eq!(gltf["animations"][0]["channels"].as_array().unwrap().len(), 3);
    let counts: Vec<u64> =
        gltf["accessors"].as_array().unwrap().iter().map(|accessor| accessor["count"].as_u64().unwrap()).collect();
    assert_eq!(counts, [7; 4]);
    assert_eq!(gltf["accessors"][0]["max"], serde_json::json!([1.5]));
    let first = &about["frames"][0]["lights"][0];
    let place = numbers(&gltf["nodes"][0]["translation"]);
    assert!(numbers(&first["position_m"]).iter().zip(&place).all(|(a, b)| (a - b).abs() < 1e-5), "{place:?}");
    // It may be written again, as it bears the mark.
    folder.succeed(&looped);
    // The scene has no other phenomenon that shines.
    let rain = "bansho = 2\n[picture]\nsize = [48, 32]\n[[rain]]\n[[light]]\nposition = [0.0, 2.0, 0.0]\n";
    folder.write("rain.toml", rain);
    folder.succeed(&["flipbook", "rain.toml", "--grid", "2x1", "--size", "48x32", "--out", "rain.png"]);
    let about = description(&folder, "rain.json");
    assert!(about["frames"].as_array().unwrap().iter().all(|frame| frame["lights"] == serde_json::json!([])));
}

#[test]
fn a_loop_fills_the_sheet_with_one_period() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&[
        "flipbook",
        "scene.toml",
        "--grid",
        "4x2",
        "--loop",
        "1.5",
        "--crop",
        "none",
        "--out",
        "fire.exr",
    ]);
    let about = description(&folder, "fire.json");
    assert_eq!((about["frame_count"].as_u64(), about["loop"].as_bool()), (Some(8), Some(true)));
    assert!((about["fps"].as_f64().unwrap() - 8.0 / 1.5).abs() < 1e-9);
    assert!((about["duration_s"].as_f64().unwrap() - 1.5).abs() < 1e-9);
    let color = read_exr(&folder.path("fire_color.exr"));
    assert_eq!(color.size, [4 * 48, 2 * 64]);
    assert!(color.channels["R"].iter().any(|&light| light > 0.1));
    assert_eq!(read_exr(&folder.path("fire_motion.exr")).size, color.size);
}

#[test]
fn a_sheet_has_the_scenes_proportions_and_the_usual_size() {
    let folder = Folder::with_scene(&FLAME.replace("48, 64", "1280, 720"));
    folder.succeed(&[
        "flipbook",
        "scene.toml",
        "--grid",
        "16x16",
        "--out",
        "fire.png",
        "--set",
        "flame_sheet.enabled=false",
    ]);
    assert_eq!(description(&folder, "fire.json")["size"], serde_json::json!([2048, 1152]));
}

#[test]
fn bad_flipbooks_are_refused_and_write_nothing() {
    let folder = Folder::with_scene(FLAME);
    for (arguments, part) in [
        (&["--grid", "0x4"][..], "COLUMNSxROWS"),
        (&["--grid", "8x8", "--size", "4000x4000"], "16384"),
        (&["--grid", "2x2", "--out", "a.mp4"], "NAME.png or NAME.exr"),
        (&["--grid", "2x2", "--out", "a.####.png"], "NAME.png or NAME.exr"),
        (&["--grid", "2x2", "--loop", "0"], "allowed: 0.01 to 3600 s"),
        (&[], "--grid"),
    ] {
        let run = folder.run(&[&["flipbook", "scene.toml"], arguments].concat());
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{arguments:?}: {}", run.stderr);
        assert!(run.stderr.contains(part), "{}", run.stderr);
        assert_eq!(folder.names(), ["scene.toml"]);
    }
}
