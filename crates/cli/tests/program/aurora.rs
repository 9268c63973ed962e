//! The aurora through the whole program.

use crate::support::{Folder, read_exr};

/// A small aurora that settles soon.
const AURORA: &str = "\
bansho = 1
[picture]
size = [48, 27]
frames = 6
[camera]
target = [0.0, 40.0, -60.0]
vertical_fov_deg = 60.0
[[aurora]]
preroll_s = 0.2
particles = { count = 2000 }
";

#[test]
fn a_drawing_without_strokes_or_that_is_none_is_a_located_error() {
    let folder = Folder::new();
    folder.write("empty.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\"></svg>");
    folder.write("words.svg", "no drawing");
    for (file, expected) in
        [("empty.svg", "holds no strokes"), ("words.svg", "it is no SVG"), ("gone.svg", "no such file")]
    {
        folder.write("scene.toml", &format!("{AURORA}[[aurora.shapes]]\nsheets = [{{ path = \"{file}\" }}]\n"));
        let run = folder.run(&["check", "scene.toml"]);
        assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
        assert!(run.stderr.contains("scene.toml:12:20: aurora.0.shapes.0.sheets.0.path"), "{}", run.stderr);
        assert!(run.stderr.contains(expected), "{}", run.stderr);
    }
}

#[test]
fn a_frame_alone_is_the_same_as_in_its_turn_with_any_number_of_threads() {
    let folder = Folder::with_scene(AURORA);
    folder.succeed(&["render", "scene.toml", "--frames", "0-5", "--threads", "1", "--out", "all/f.####.png"]);
    folder.succeed(&["render", "scene.toml", "--frames", "5", "--threads", "2", "--out", "one/f.####.png"]);
    assert_eq!(folder.files("all")["f.0005.png"], folder.files("one")["f.0005.png"]);
    assert_ne!(folder.files("all")["f.0005.png"], folder.files("all")["f.0001.png"]);
}

#[test]
fn kilorayleighs_and_the_field_come_as_aovs() {
    let folder = Folder::with_scene(AURORA);
    folder.succeed(&["render", "scene.toml", "--frames", "2", "--aovs", "--out", "f.exr"]);
    let picture = read_exr(&folder.path("f.exr"));
    let values = |ending: &str| {
        let channel = picture.channels.iter().find(|(name, _)| name.ends_with(ending));
        let (_, values) = channel.unwrap_or_else(|| panic!("{ending} is missing"));
        assert!(values.iter().all(|value| value.is_finite()), "{ending}");
        values
    };
    let greatest = |ending: &str| values(ending).iter().copied().fold(0.0, f32::max);
    let [green, red, blue, violet, deep_red] =
        ["557", "630", "427", "391", "670"].map(|line| greatest(&format!("kilorayleigh_{line}")));
    assert!(green > 1.0 && green > 2.0 * blue && blue > 0.0, "{green} kR green, {blue} kR blue");
    assert!(red > 0.0 && red < green && deep_red > 0.0, "{red} kR and {deep_red} kR red");
    assert!((violet / blue - 3.28).abs() < 0.01, "{violet} kR violet, {blue} kR blue");
    // Counts are whole; what is scattered makes the potential, which is negative and lowest where they are.
    for count in ["scatter_count", "particle_count"] {
        assert!(greatest(count) >= 1.0 && values(count).iter().all(|count| count.fract() == 0.0), "{count}");
    }
    let (potential, scattered) = (values("potential"), values("scatter_count"));
    let (lowest, _) = (0..potential.len()).map(|i| (i, potential[i])).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    assert!(potential.iter().all(|value| *value <= 0.0) && potential[lowest] < 0.0 && scattered[lowest] > 0.0);
    let noise = values("potential_noise");
    assert!(noise.iter().any(|value| *value > 0.0) && noise.iter().any(|value| *value < 0.0));
}
