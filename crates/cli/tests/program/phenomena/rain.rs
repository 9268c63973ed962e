//! Rain.

use std::fs;

use serde_json::Value;

use crate::support::{Folder, decode_png, read_exr};

const PICTURE: &str = "bansho = 2\n[picture]\nsize = [96, 54]\nframes = 2\n";
const LAMP: &str = "[[light]]\nkind = \"point\"\nposition = [0.3, 2.0, -3.0]\nintensity = 400.0\n";

fn scene(tables: &str) -> Folder {
    Folder::with_scene(&format!("{PICTURE}{tables}"))
}

/// A gray picture that changes from pixel to pixel.
fn write_plate(folder: &Folder, size: [u32; 2]) {
    let file = fs::File::create(folder.path("plate.png")).unwrap();
    let mut encoder = png::Encoder::new(file, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    let bytes: Vec<u8> = (0..3 * size[0] * size[1]).map(|index| (index * 7919 % 251) as u8).collect();
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

#[test]
fn no_rain_is_exactly_the_plate() {
    let rain = "[wind]\nvelocity = [5, 0, 0]\n[[rain]]\nrate_mm_per_h = 0.0\n";
    let folder = scene(&format!("[plate]\nimage = \"plate.png\"\n{LAMP}{rain}"));
    write_plate(&folder, [96, 54]);
    folder.succeed(&["render", "scene.toml", "--frames", "1", "--out", "f.png"]);
    let files = folder.files("");
    let (plate, drawn) = (decode_png(&files["plate.png"]), decode_png(&files["f.png"]));
    let colors: Vec<u8> = drawn.bytes.chunks_exact(drawn.channels).flat_map(|pixel| pixel[..3].to_vec()).collect();
    assert!(plate.bytes == colors);
    folder.succeed(&["render", "scene.toml", "--frames", "1", "--set", "rain.0.rate_mm_per_h=50", "--out", "f.png"]);
    assert!(decode_png(&folder.files("")["f.png"]).bytes != drawn.bytes, "rain does show");
}

#[test]
fn the_strongest_rain_and_wind_at_any_shutter_give_sensible_pictures() {
    let folder = scene(&format!(
        "[sky]\nluminance = 50.0\n[wind]\nvelocity = [40, 0, 0]\ngust = 1.0\n{LAMP}[[rain]]\nrate_mm_per_h = 300.0\n"
    ));
    for method in ["billboards", "drops"] {
        for shutter in ["1.0", "0.00001"] {
            let set = [&format!("rain.0.method=\"{method}\""), &format!("camera.shutter_s={shutter}")];
            folder.succeed(&[
                "render",
                "scene.toml",
                "--frames",
                "1",
                "--set",
                set[0],
                "--set",
                set[1],
                "--out",
                "f.exr",
                "--layers",
                "--aovs",
            ]);
            let exr = read_exr(&folder.path("f.exr"));
            let values = || exr.channels.iter().filter(|(name, _)| *name != "Z").flat_map(|(_, values)| values);
            assert!(values().all(|value| value.is_finite()), "{method} {shutter}");
            let opacity = &exr.channels["rain.streak_opacity.V"];
            let mean = opacity.iter().sum::<f32>() / opacity.len() as f32;
            assert!((0.001..0.5).contains(&mean), "{method} {shutter}: mean opacity {mean}");
        }
    }
}

#[test]
fn twice_the_fire_is_twice_the_light_on_the_rain_beside_it() {
    let fire = "[picture]\nsize = [160, 90]\nexposure_ev100 = 8.0\n[camera]\nposition = [0, 1, 3.6]\ntarget = [0, 0.8, 0]\n\
                [[flame_sheet]]\nname = \"fire\"\ncolor = { luminance = 12000.0 }\n[[rain]]\nrate_mm_per_h = 60.0\nsimplification_codes = 0.0\n";
    let folder = Folder::with_scene(&format!("bansho = 2\n{fire}"));
    let rain = |luminance: &str| {
        let set = format!("flame_sheet.fire.color.luminance={luminance}");
        folder.succeed(&["render", "scene.toml", "--frames", "20", "--layers", "--set", &set, "--out", "f.exr"]);
        read_exr(&folder.path("f.exr")).channels["rain.R"].clone()
    };
    let (once, twice) = (rain("12000"), rain("24000"));
    let beside = (0..once.len()).filter(|index| !(40..120).contains(&(index % 160)));
    let sums = beside.fold([0.0; 2], |[a, b], index| [a + f64::from(once[index]), b + f64::from(twice[index])]);
    assert!(sums[0] > 0.0 && (sums[1] / sums[0] - 2.0).abs() < 0.01, "{sums:?}");
}

#[test]
fn rain_that_nothing_lights_is_drawn_with_a_warning() {
    // A sky that is stated, so that there is no other.
    let folder = scene("[sky]\nluminance = 0\nvisible = false\n[[rain]]\nname = \"night\"\n");
    let run = folder.succeed(&["render", "scene.toml", "--frames", "0", "--out", "f.png"]);
    assert!(run.stderr.contains(": night: nothing lights it, so it is drawn black"), "{}", run.stderr);
    assert!(decode_png(&folder.files("")["f.png"]).bytes.chunks_exact(4).all(|pixel| pixel[..3] == [0; 3]));
    let lit = scene(&format!("{LAMP}[[rain]]\n")).succeed(&["render", "scene.toml", "--frames", "0", "--out", "f.png"]);
    assert!(!lit.stderr.contains("nothing lights it"), "{}", lit.stderr);
}

#[test]
fn metadata_describes_the_rain() {
    let folder = scene(&format!("{LAMP}[[rain]]\nrate_mm_per_h = 20.0\n"));
    folder.succeed(&["render", "scene.toml", "--frames", "1", "--metadata", "--out", "f.png"]);
    let about: Value = serde_json::from_slice(&fs::read(folder.path("f.json")).unwrap()).unwrap();
    let value = |name: &str| about["phenomena"]["rain"][name]["value"].as_f64().unwrap_or_else(|| panic!("{about:#}"));
    assert_eq!(value("rain_rate"), 20.0);
    assert!((value("extinction") - 1.20367e-3).abs() < 1e-8 && (value("visibility") - 1625.0).abs() < 1.0);
    assert!(value("drops_in_view") > 1000.0 && value("billboards_in_view") > 100.0, "{about:#}");
}

#[test]
fn nonsense_is_located() {
    for (line, parts) in [
        ("rate_mm_per_h = -1.0", ["scene.toml:6:17: rain.0.rate_mm_per_h: -1", "allowed: 0 to 300 mm/h"]),
        ("diameters_mm = [1.0, -2.0]", ["rain.0.diameters_mm", "-2"]),
        ("diameters_mm = [1.0, 2.0, 1.5]", ["rain.0.diameters_mm", "1.5"]),
        ("diameters_mm = []", ["rain.0.diameters_mm", "1 to 12"]),
        ("method = \"streaks\"", ["rain.0.method", "billboards, drops, textures"]),
        ("distance = 0.0", ["rain.0.distance: 0", "allowed: 1 to 40 m"]),
    ] {
        let run = scene(&format!("[[rain]]\n{line}\n")).run(&["render", "scene.toml"]);
        assert_eq!((run.code, run.errors()), (Some(3), 1), "{line}: {}", run.stderr);
        assert!(parts.iter().all(|part| run.stderr.contains(part)), "{line}: {}", run.stderr);
    }
}

#[test]
fn a_depth_of_another_size_than_its_plate_is_resampled_and_told() {
    let folder = scene(&format!("{LAMP}[[rain]]\n"));
    folder.succeed(&["render", "scene.toml", "--frames", "0", "--out", "depth.exr"]);
    write_plate(&folder, [64, 36]);
    folder.write(
        "laid.toml",
        &format!("{PICTURE}[plate]\nimage = \"plate.png\"\ndepth = \"depth.exr\"\n{LAMP}[[rain]]\n"),
    );
    for command in ["render laid.toml --frames 0 --out f.png", "check laid.toml"] {
        let run = folder.succeed(&command.split(' ').collect::<Vec<_>>());
        let told = "laid.toml:5:1: plate: `depth` has 96 x 54 pixels and the image 64 x 36: the nearest depth value is used for each pixel";
        assert!(run.stderr.contains(told), "{}", run.stderr);
    }
}
