//! The aurora.

use bansho::aurora::{
    SpectrumShape,
    physics::{
        atmosphere::{LEVEL_SPACING, LEVELS, atmosphere, level_altitude_km},
        emission::{Emission, PHOTONS_PER_KILORAYLEIGH, SpectralEmitter},
    },
};

use crate::support::{Folder, read_exr};

/// A small aurora that settles soon.
const AURORA: &str = "\
bansho = 2
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
    folder.write("text.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 10 10\"><text>arc</text></svg>");
    for (file, expected) in [
        ("empty.svg", "contains no strokes (allowed"),
        ("text.svg", "contains no strokes, only text (allowed"),
        ("words.svg", "it is not an SVG"),
        ("gone.svg", "no such file"),
    ] {
        folder.write("scene.toml", &format!("{AURORA}[[aurora.shapes]]\nsheets = [{{ svg_file = \"{file}\" }}]\n"));
        let run = folder.run(&["check", "scene.toml"]);
        assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
        assert!(run.stderr.contains("scene.toml:12:24: aurora.0.shapes.0.sheets.0.svg_file"), "{}", run.stderr);
        assert!(run.stderr.contains(expected), "{}", run.stderr);
    }
}

#[test]
fn single_photons_in_sunlight_are_a_located_error() {
    let rendering = "rendering = { sampling = \"single_photons\", energy_deposition = \"hard_sphere\" }\n";
    let folder = Folder::with_scene(&format!("{AURORA}sunlit_above_km = 200.0\n{rendering}"));
    let run = folder.run(&["check", "scene.toml"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
    assert!(run.stderr.contains("scene.toml:11:19: aurora.0.sunlit_above_km"), "{}", run.stderr);
    assert!(run.stderr.contains("have no sunlight; allowed: `sampling = \"single_collisions\"`"), "{}", run.stderr);
}

#[test]
fn check_and_render_tell_where_sheets_pass_through_each_other() {
    let folder = Folder::new();
    let sheets = "sheets = [{ form = \"arc\" }, { form = \"arc\", position_km = [0, 90] }]\n";
    let shapes = format!("[[aurora.shapes]]\n{sheets}[[aurora.shapes]]\n{sheets}");
    folder.write("apart.toml", &format!("{AURORA}{shapes}"));
    folder.write("scene.toml", &format!("{AURORA}{shapes}link = [{{ from = 1, to = 2 }}]\n"));
    let apart = folder.run(&["check", "apart.toml"]);
    assert_eq!((apart.code, apart.stderr.as_str()), (Some(0), ""));
    let told = "warning: scene.toml:13:1: aurora: its sheets pass through each other on the way to shape 2";
    for arguments in [&["check", "scene.toml"][..], &["render", "scene.toml", "--frames", "0", "--out", "f.####.png"]] {
        let run = folder.run(arguments);
        assert_eq!(run.code, Some(0), "{}", run.stderr);
        assert!(run.stderr.lines().any(|line| line.starts_with(told)), "{arguments:?}: {}", run.stderr);
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
    // Within a bend of a sheet the potential may be lower than on it.
    let straight = AURORA.replace("particles", "swirls = { displacement_km = 0.0 }\nparticles");
    let folder = Folder::with_scene(&straight);
    folder.succeed(&["render", "scene.toml", "--frames", "2", "--aovs", "--out", "f.exr"]);
    let picture = read_exr(&folder.path("f.exr"));
    let values = |ending: &str| {
        let channel = picture.channels.iter().find(|(name, _)| name.ends_with(&format!("{ending}.V")));
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
    let [fainter_red, first_positive] = ["636", "first_positive"].map(|line| greatest(&format!("kilorayleigh_{line}")));
    assert!((red / fainter_red - 2.997).abs() < 0.01, "{red} kR at 630.0 nm, {fainter_red} kR at 636.4 nm");
    assert!((deep_red / first_positive - 0.021_44).abs() < 1e-4, "{deep_red} kR of {first_positive} kR");
    // Counts are integers. The scattered charges cause the potential, which is negative, with its minimum at the particles.
    for count in ["scatter_count", "particle_count"] {
        assert!(greatest(count) >= 1.0 && values(count).iter().all(|count| count.fract() == 0.0), "{count}");
    }
    let (potential, scattered) = (values("potential"), values("scatter_count"));
    let (lowest, _) = (0..potential.len()).map(|i| (i, potential[i])).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    assert!(potential.iter().all(|value| *value <= 0.0) && potential[lowest] < 0.0 && scattered[lowest] > 0.0);
    let noise = values("potential_noise");
    assert!(noise.iter().any(|value| *value > 0.0) && noise.iter().any(|value| *value < 0.0));
}

/// The limits of what is observed, read from what the program prints.
#[test]
fn the_calibration_is_printed_and_within_what_is_observed() {
    let run = Folder::new().succeed(&["calibrate"]);
    let rows: Vec<Vec<f64>> = run
        .stdout
        .lines()
        .skip(1)
        .map_while(|line| line.split_whitespace().map(|word| word.parse().ok()).collect::<Option<Vec<f64>>>())
        .collect();
    let at = |kev: f64| rows.iter().find(|row| row[0] == kev).unwrap_or_else(|| panic!("{}", run.stdout));
    // keV, deposited km, peaks of 557.7, 630.0 and 427.8 km, R of 427.8 per mW/m^2, green and red beside that, red above 200 km.
    for (kev, peak_km, blue) in
        [(1.0, 158.35, 250.0), (3.0, 122.23, 294.0), (10.0, 104.68, 307.0), (30.0, 95.194, 304.0)]
    {
        assert!((at(kev)[1] - peak_km).abs() < 4.0, "{kev} keV: {} km", at(kev)[1]);
        assert!((at(kev)[5] / blue - 1.0).abs() < 0.25, "{kev} keV: {} R", at(kev)[5]);
    }
    for kev in [3.0, 5.0, 10.0] {
        assert!((100.0..=120.0).contains(&at(kev)[2]), "{kev} keV: green at {} km", at(kev)[2]);
    }
    let hard: Vec<&Vec<f64>> = rows.iter().filter(|row| row[0] >= 1.0).collect();
    assert!(hard.len() >= 6 && hard.iter().all(|row| (2.5..=7.0).contains(&row[6])), "{}", run.stdout);
    assert!(hard.windows(2).all(|pair| pair[1][6] < pair[0][6] && pair[1][7] < pair[0][7]), "{}", run.stdout);
    assert!(at(1.0)[7] > 2.0 && at(10.0)[7] < 0.5 && rows.iter().all(|row| row[8] >= 0.5), "{}", run.stdout);
    let claimed = |spectrum: &str| {
        run.stdout.contains(&format!("\"{spectrum}\"\n"))
            && run.stdout.contains(&format!("holds  {spectrum}: I(557.7)/I(427.8) at 10 keV"))
    };
    assert!(["gaussian", "monoenergetic", "maxwellian"].into_iter().all(claimed), "{}", run.stdout);
    assert!(run.stdout.contains("I(391.4)/I(427.8)") && !run.stdout.contains("FAILS"), "{}", run.stdout);
}

/// A straight, even, thin sheet through the zenith, of upright field lines: how bright it is, all across, is known.
const EVEN: &str = "\
bansho = 2
[picture]
size = [64, 64]
frames = 1
[camera]
position = [0.0, 0.0, 0.0]
target = [0.0, 100.0, 0.0]
vertical_fov_deg = 30.0
[[aurora]]
flux_mw_per_m2 = 40.0
energy_ev = 5000.0
thickness_km = 4.0
dip_deg = 90.0
particles = { count = 20_000 }
diffuse = { fraction = 0.0 }
rays = { contrast = 0.0, energy_variation = 0.0 }
folds = { amplitude_km = 0.0 }
swirls = { displacement_km = 0.0 }
shapes = [{ sheets = [{ points = [[-290.0, 0.0], [290.0, 0.0]] }] }]
";

#[test]
fn a_sheet_at_the_zenith_has_the_kilorayleighs_of_its_column() {
    let folder = Folder::with_scene(EVEN);
    folder.succeed(&["render", "scene.toml", "--aovs", "--out", "f.exr"]);
    let picture = read_exr(&folder.path("f.exr"));
    let emission = Emission::new(atmosphere(), SpectrumShape::Gaussian.spectrum());
    // An altitude z contributes flux x thickness x emission / z, integrated over the directions across the sheet by the tangent of their angle.
    let tangents = bansho::base::math::tan(f64::to_radians(15.0)) / 32.0;
    for (line, emitter, photons) in [
        ("557", SpectralEmitter::OxygenGreen, 1.0),
        ("427", SpectralEmitter::NitrogenIon, 1.0),
        ("391", SpectralEmitter::NitrogenIon, 3.28),
    ] {
        let at = |level: usize| {
            let altitude_km = level_altitude_km(level);
            emission.at(5000.0, altitude_km)[emitter.index()] * photons / altitude_km
        };
        let expected = 40.0 * 4.0 * (0..LEVELS).map(at).sum::<f64>() * LEVEL_SPACING / PHOTONS_PER_KILORAYLEIGH;
        let (_, values) =
            picture.channels.iter().find(|(name, _)| name.ends_with(&format!("kilorayleigh_{line}.V"))).unwrap();
        let column = |x: usize| (0..64).map(|y| f64::from(values[64 * y + x])).sum::<f64>() * tangents / expected;
        let mean = |columns: std::ops::Range<usize>| columns.clone().map(column).sum::<f64>() / columns.len() as f64;
        for side in [8..24, 40..56] {
            let ratio = mean(side.clone());
            assert!((ratio - 1.0).abs() < 0.04, "{line}, columns {side:?}: {ratio} of the column");
        }
        // Within three degrees of the magnetic zenith lines of sight run along the field, and bins of distance span many km of altitude.
        assert!((mean(24..40) - 1.0).abs() < 0.15, "{line}: {} of the column at the magnetic zenith", mean(24..40));
    }
}

#[test]
fn a_loop_of_an_aurora_with_snapshots_gives_the_same_bytes() {
    let folder = Folder::with_scene(&AURORA.replace("frames = 6", "frames = 40"));
    let options = ["render", "scene.toml", "--loop", "1.0"];
    folder.succeed(&[&options[..], &["--out", "all/f.####.png"]].concat());
    let whole = folder.files("all");
    assert_eq!(whole.len(), 30, "{:?}", whole.keys());
    for range in ["0-11", "12-29"] {
        let out = ["--frames", range, "--snapshots", "states", "--out", "parts/f.####.png"];
        folder.succeed(&[&options[..], &out].concat());
    }
    let (parts, states) = (folder.files("parts"), folder.files("states"));
    assert!(!states.is_empty());
    for (name, bytes) in &whole {
        assert!(parts[name] == *bytes, "{name}");
    }
    assert!(whole["f.0000.png"] != whole["f.0015.png"]);
}
