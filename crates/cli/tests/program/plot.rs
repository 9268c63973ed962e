//! `bansho plot`: its numbers, its files, its errors.

use std::{collections::HashSet, fs};

use bansho::base::assert_measured;

use crate::support::{FLAME, Folder, decode_png};

/// Columns and rows of a figure's table; empty cells are NaN.
struct Csv {
    columns: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Csv {
    fn of(arguments: &[&str]) -> Self {
        let run = Folder::new().succeed(&[&["plot"], arguments, &["-o", "-"]].concat());
        Self::parse(&run.stdout)
    }

    fn parse(text: &str) -> Self {
        assert!(text.starts_with("# bansho:version="), "{text}");
        let mut lines = text.lines().skip(1);
        let columns: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
        let cell = |cell: &str| if cell.is_empty() { f64::NAN } else { cell.parse().unwrap() };
        let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(cell).collect()).collect();
        assert!(rows.iter().all(|row| row.len() == columns.len()));
        Self { columns, rows }
    }

    fn row(&self, abscissa: f64) -> &[f64] {
        self.rows.iter().find(|row| (row[0] - abscissa).abs() < 1e-6).unwrap()
    }

    /// Abscissa of the largest number of a column.
    fn peak(&self, column: usize) -> f64 {
        self.rows.iter().max_by(|a, b| a[column].total_cmp(&b[column])).unwrap()[0]
    }
}

fn near(found: f64, expected: f64, relative: f64) -> bool {
    (found / expected - 1.0).abs() <= relative
}

#[test]
fn black_bodies_are_a_table_of_all_kelvins() {
    let table = Csv::of(&["black-body"]);
    assert_eq!((table.rows.len(), table.columns.len()), (10_000, 8));
    assert_eq!((&table.columns[0][..], &table.columns[7][..]), ("temperature_k", "ln_luminance_cd_per_m2"));
    // Near the white of sRGB.
    assert!(table.row(6500.0)[1..7].iter().all(|value| near(*value, 1.0, 0.05)));
    // 3.02182e7 cd/m^2 and linear sRGB (1.77072, 0.844444, 0.272137) at 3000 K.
    let row = table.row(3000.0);
    assert!((row[7] - 17.22395).abs() < 1e-4, "{row:?}");
    assert!(near(row[1], 1.77072, 1e-3) && near(row[2], 0.844444, 1e-3) && near(row[3], 0.272137, 1e-3), "{row:?}");
    let few = Csv::of(&["black-body", "--from", "1000", "--to", "2000", "--step", "250"]);
    let kelvins: Vec<f64> = few.rows.iter().map(|row| row[0]).collect();
    assert_eq!(kelvins, [1000.0, 1250.0, 1500.0, 1750.0, 2000.0]);
}

/// The texels of a texture that `bansho plot` writes, with all bits of its samples.
fn texture(arguments: &[&str]) -> (usize, usize, Vec<[u32; 3]>) {
    let folder = Folder::new();
    folder.succeed(&[&["plot"], arguments, &["-o", "t.png"]].concat());
    let png = decode_png(&fs::read(folder.path("t.png")).unwrap());
    let sample = |bytes: &[u8]| bytes.iter().fold(0, |value, byte| value << 8 | u32::from(*byte));
    let samples: Vec<u32> = png.bytes.chunks(usize::from(png.bits) / 8).map(sample).collect();
    let texels = samples.chunks(3).map(|texel| [texel[0], texel[1], texel[2]]).collect();
    assert_eq!(png.channels, 3);
    (png.width, png.height, texels)
}

#[test]
fn black_bodies_are_a_texture_with_a_texel_for_each_row() {
    let range = ["black-body", "--from", "500", "--to", "10000", "--step", "100"];
    let table = Csv::of(&range);
    let [linear, srgb] = ["linear", "srgb"].map(|encoding| texture(&[&range[..], &["--texture", encoding]].concat()));
    assert_eq!((linear.0, linear.1, linear.2.len()), (96, 1, table.rows.len()));
    assert_eq!((srgb.0, srgb.1), (96, 1));
    let mut colored = 0;
    let mut largest = 0.0_f64;
    for ((row, linear), srgb) in table.rows.iter().zip(&linear.2).zip(&srgb.2) {
        let brightest = row[1..4].iter().fold(0.0, |a: f64, b| a.max(*b));
        for c in 0..3 {
            // 1e-6 cd/m^2.
            let value = if row[7] < -13.8155 { 0.0 } else { (row[1 + c] / brightest).max(0.0) };
            assert!((f64::from(linear[c]) / 65_535.0 - value).abs() < 1e-5, "{row:?}: {linear:?}");
            let encoded = if value < 0.003_130_8 {
                12.92 * value
            } else {
                1.055 * bansho::base::math::pow(value, 1.0 / 2.4) - 0.055
            };
            largest = largest.max((f64::from(srgb[c]) - 255.0 * encoded).abs());
            colored += usize::from(linear[c] == 65_535);
        }
    }
    assert_measured!("figure 1: difference from the table, codes", largest, 0.0, 0.6);
    // 600 K has 2e-7 cd/m^2; from 700 K on each color has one full channel.
    assert_eq!((linear.2[1], colored), ([0; 3], 94));
}

#[test]
fn poly6_is_normalized_and_its_textures_are_figures_2_and_3() {
    let table = Csv::of(&["kernel"]);
    // 315/(64 pi), and 9/(2 pi) through the center.
    assert_measured!("equation (2): W(0) d^3", table.row(0.0)[1], 1.566_681, 2e-6);
    assert_measured!("equation (6): line integral through the center", table.row(0.0)[3], 1.432_394, 2e-6);
    let shell = |row: &Vec<f64>| 4.0 * std::f64::consts::PI * row[0] * row[0] * row[1] / 200.0;
    let mass: f64 = table.rows.iter().map(shell).sum();
    assert_measured!("equation (2) & equation (4) & equation (5): integral over space", mass, 1.0, 1e-4);
    // W' = -6 * 315/(64 pi) * r (1 - r^2)^2 at 0.5.
    assert_measured!("equation (7): W' d^4 at d/2", table.row(0.5)[2], -2.643_774, 3e-6);
    let (width, height, density) = texture(&["kernel", "--texture", "density", "--size", "33"]);
    assert_eq!((width, height), (33, 33));
    let (_, _, deflection) = texture(&["kernel", "--texture", "deflection", "--size", "33"]);
    // Eight texels to the right and five up of the center, of 16.5 in d.
    let (x, y) = (8.0 / 16.5, 5.0 / 16.5);
    let s: f64 = 1.0 - x * x - y * y;
    let at = |column: usize, row: usize| row * 33 + column;
    assert_eq!((density[at(16, 16)], density[at(0, 16)], density[at(0, 0)]), ([255; 3], [0; 3], [0; 3]));
    assert_measured!("figure 2: code of the center", f64::from(density[at(16, 16)][0]), 255.0, 0.0);
    assert_measured!("figure 3: code of the center", f64::from(deflection[at(16, 16)][0]), 128.0, 0.0);
    assert_eq!(density[at(24, 11)], [(255.0 * s * s * s).round() as u32; 3]);
    // The largest gradient is 16/25 sqrt(1/5).
    let toward = |offset: f64| (127.5 + 127.5 * offset * s * s / (0.64 * 0.2_f64.sqrt())).round() as u32;
    assert_eq!(deflection[at(24, 11)], [toward(x), toward(y), 128]);
    assert_eq!(deflection[at(8, 21)], [toward(-x), toward(-y), 128]);
    assert_eq!((deflection[at(16, 16)], deflection[at(0, 0)]), ([128; 3], [128; 3]));
}

const GAS: &str = "bansho = 2
[picture]
size = [160, 90]
frames = 2
[camera]
position = [0.0, 0.5, 3.0]
target = [0.0, 0.5, 0.0]
[[flame_particles]]
particles = 500
gas_model = \"euler\"
";

#[test]
fn deflection_is_a_picture_that_points_outward() {
    let folder = Folder::with_scene(GAS);
    let run = folder.succeed(&["plot", "deflection", "scene.toml", "--frame", "1", "-o", "d.png"]);
    let largest = run.stdout.split("largest deflection: ").nth(1).unwrap().split(' ').next().unwrap();
    let largest: f64 = largest.parse().unwrap();
    assert!((1e-5..1e-1).contains(&largest), "{}", run.stdout);
    let png = decode_png(&fs::read(folder.path("d.png")).unwrap());
    assert_eq!((png.width, png.height, png.bits), (160, 90, 8));
    let mean = |columns: std::ops::Range<usize>| {
        let texels = png.bytes.chunks(3).enumerate().filter(|(index, _)| columns.contains(&(index % 160)));
        let reds: Vec<f64> = texels.map(|(_, texel)| f64::from(texel[0])).collect();
        reds.iter().sum::<f64>() / reds.len() as f64
    };
    assert!(mean(0..80) < 127.5 && mean(80..160) > 128.5, "{} {}", mean(0..80), mean(80..160));
    assert!(png.bytes.chunks(3).all(|texel| texel[2] == 128) && png.bytes[0] == 128);
    // At ten times the full scale it is ten times as faint.
    folder.succeed(&["plot", "deflection", "scene.toml", "--frame", "1", "--full-scale", "1", "-o", "faint.png"]);
    let faint = decode_png(&fs::read(folder.path("faint.png")).unwrap());
    assert!(faint.bytes.iter().all(|byte| byte.abs_diff(128) <= 13));
    folder.write("none.toml", &format!("{GAS}rendering.heat_haze_gain = 0.0\n"));
    let run = folder.run(&["plot", "deflection", "none.toml"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
    assert!(run.stderr.contains("none.toml: frame 0 has no gas that refracts light; allowed: "), "{}", run.stderr);
}

#[test]
fn drops_fall_as_gunn_and_kinzer_measured() {
    let table = Csv::of(&["terminal-velocity"]);
    // Between 5.17 m/s at 1.4 mm and 5.65 m/s at 1.6 mm.
    assert!(near(table.row(1.5)[1], 5.41, 1e-6));
    assert_eq!((table.row(2.0)[1], table.row(2.0)[3]), (6.49, 6.49));
    assert!(table.row(5.0)[2] > 1.28 * table.row(5.0)[1], "rigid spheres fall faster");
}

#[test]
fn drop_sizes_are_those_of_marshall_and_palmer() {
    let table = Csv::of(&["drop-sizes", "--rates", "1,20"]);
    assert_eq!(table.columns[2], "n_at_20_mm_per_h_per_m3_mm");
    assert_eq!(table.row(0.0)[1..], [8000.0, 8000.0]);
    assert!(near(table.row(1.0)[1], 132.581, 1e-5) && near(table.row(2.0)[2], 101.092, 1e-5));
}

#[test]
fn streaks_fade_with_the_exposure_time() {
    let table = Csv::of(&["streak-opacity", "--exposure-times", "1/30,1/60"]);
    assert!(near(table.row(1.0)[1], 0.0074442, 1e-4) && near(table.row(1.0)[2], 0.014888, 1e-4));
    let sphere = Csv::of(&["streak-opacity", "--exposure-times", "0.001", "--terminal-velocity", "rigid_sphere"]);
    assert!(near(sphere.row(0.5)[1], 0.24284, 1e-4));
}

#[test]
fn electrons_stop_and_air_glows_at_the_known_altitudes() {
    let table = Csv::of(&["deposition", "--energies-ev", "1000,10000"]);
    // Fang et al. (2010): 158.35 and 104.68 km.
    assert!((table.peak(1) - 158.35).abs() <= 2.0 && (table.peak(2) - 104.68).abs() <= 2.0);
    let emission = Csv::of(&["emission", "--energy-ev", "5000", "--flux-mw-per-m2", "10"]);
    assert_eq!(emission.columns.len(), 8);
    assert_eq!(emission.columns[1], "o_557_7_nm_photons_per_m3_s");
    // Green near 114.8 km as observed, red above 200 km.
    assert!((emission.peak(1) - 114.8).abs() < 5.0 && emission.peak(2) > 200.0);
    let twice = Csv::of(&["emission", "--energy-ev", "5000", "--flux-mw-per-m2", "20"]);
    assert!(near(twice.row(110.0)[1], 2.0 * emission.row(110.0)[1], 1e-6));
}

#[test]
fn low_red_light_is_quenched() {
    let table = Csv::of(&["quenching"]);
    // O(1S) at 90 km: 0.6599; O(1D) at 300 km: 0.5967.
    assert!(near(table.row(90.0)[1], 0.6599, 0.01) && near(table.row(300.0)[2], 0.5967, 0.01));
}

const KEYED: &str = "
[wind]
velocity = { keys = [[0.0, [0.0, 0.0, 0.0]], [0.1, [1.0, 0.0, -2.0]]], interpolation = \"linear\" }
gust = 0.5
";

#[test]
fn keyed_parameters_are_plotted_over_the_shot() {
    let folder = Folder::with_scene(&format!("{FLAME}{KEYED}"));
    let run = folder.succeed(&["plot", "parameters", "scene.toml", "--path", "wind.velocity", "-o", "-"]);
    let table = Csv::parse(&run.stdout);
    assert_eq!(table.columns, ["frame", "time_s", "wind.velocity.x", "wind.velocity.y", "wind.velocity.z"]);
    assert_eq!(table.rows.len(), 7);
    assert_eq!(table.row(3.0)[1..], [0.1, 1.0, 0.0, -2.0]);
    let svg = folder.succeed(&["plot", "parameters", "scene.toml", "--path", "wind.velocity"]);
    assert_eq!(svg.stdout, "out/plots/parameters.svg: written\n");
    let svg = fs::read_to_string(folder.path("out/plots/parameters.svg")).unwrap();
    assert!(svg.contains(">wind.velocity (m/s)<") && svg.contains(">Time (s)<"), "{svg}");
}

#[test]
fn paths_that_mean_nothing_keyed_are_located() {
    let folder = Folder::with_scene(&format!("{FLAME}{KEYED}"));
    for (path, told) in [
        ("wind.velocty", "did you mean `wind.velocity`?"),
        ("wind.gust", "scene.toml:17:8: wind.gust: is not keyed"),
        ("nothing", "keyed in it: wind.velocity"),
    ] {
        let run = folder.run(&["plot", "parameters", "scene.toml", "--path", path]);
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{path}: {}", run.stderr);
        assert!(run.stderr.contains(told), "{path}: {}", run.stderr);
    }
    let run = folder.run(&["plot", "parameters", "scen.toml", "--path", "wind.velocity"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
}

#[test]
fn transfer_curves_are_those_of_the_scene() {
    let scene = FLAME.replace(
        "name = \"left log\"",
        "name = \"left log\"\ncolor.kind = \"rgb_curves\"\ncolor.red = [[0, 0], [1, 0.5]]",
    );
    let folder = Folder::with_scene(&scene);
    let run = folder.succeed(&["plot", "transfer-curves", "scene.toml", "--name", "left log", "-o", "-"]);
    let table = Csv::parse(&run.stdout);
    assert_eq!(table.columns, ["s", "sharpen", "r", "g", "b"]);
    assert_eq!((table.row(0.0)[2], table.row(0.5)[2], table.row(1.0)[2]), (0.0, 0.25, 0.5));
    let run = folder.run(&["plot", "transfer-curves", "scene.toml", "--name", "left lag"]);
    assert_eq!((run.code, run.errors()), (Some(2), 1), "{}", run.stderr);
    assert!(run.stderr.contains("did you mean `left log`?"), "{}", run.stderr);
    let rain = Folder::with_scene("bansho = 2\n[[rain]]\n");
    let run = rain.run(&["plot", "transfer-curves", "scene.toml"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
}

#[test]
fn the_shape_of_a_flame_is_that_of_the_scene() {
    let shape = "shape = { initial_speed = 0.0, edge_speed = 0.2, core_width = [[0, 0.4]], fringe_width = [[0, 0], [0.5, 0.5]], flutter = 0.5 }";
    let folder = Folder::with_scene(&format!("bansho = 2\n[[flame_sheet]]\n{shape}\n"));
    let run = folder.succeed(&["plot", "flame-shape", "scene.toml", "--height", "0.5", "-o", "-"]);
    let table = Csv::parse(&run.stdout);
    assert_eq!(
        &table.columns[..6],
        ["argument", "threshold", "threshold_across", "rise", "core_width", "core_and_fringe_width"]
    );
    // By hand: w = sqrt(y), A + D = 0.9, K from 1 in the core to h at x' = 0.9, and edges from A + D / 2 to A + D.
    let middle = table.row(0.25);
    assert!((middle[3] - 0.5).abs() < 1e-6 && (table.row(0.5)[5] - 0.9).abs() < 1e-6);
    assert!((middle[7] - 1.0).abs() < 1e-6 && (table.row(1.0)[7] - 0.2).abs() < 1e-6);
    for column in [8, 9] {
        let edge = table.row(0.75)[column];
        assert!((0.65 - 1e-3..=0.9 + 1e-3).contains(&edge), "{edge}");
    }
    let run = folder.run(&["plot", "flame-shape", "scene.toml", "--height", "2"]);
    assert_eq!((run.code, run.errors()), (Some(2), 1), "{}", run.stderr);
    let wide = Folder::with_scene("bansho = 2\n[[flame_sheet]]\nshape = { core_width = [[0, 0.9]] }\n");
    let run = wide.run(&["plot", "flame-shape", "scene.toml"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
    assert!(run.stderr.contains("scene.toml:3:9: flame_sheet.0.shape.fringe_width"), "{}", run.stderr);
}

/// Figures 2 to 4, 6 and 7 of Ohshima and Itahashi for picture 5.
#[test]
fn the_curves_of_picture_5_are_those_that_its_page_states() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/papers/ohshima_itahashi/ohshima_picture_5.toml");
    let curves = Csv::of(&["transfer-curves", scene]);
    assert_measured!("figure 3: argument at which C is largest", curves.peak(1), 0.72, 0.005);
    assert_measured!("figure 3: largest C", curves.row(curves.peak(1))[1], 1.0, 0.005);
    assert_measured!("figure 3: C(1)", curves.row(1.0)[1], 0.88, 0.005);
    let [[r, g, b], [last_r, last_g, last_b]] = [0.5, 1.0].map(|s| [2, 3, 4].map(|column| curves.row(s)[column]));
    assert_measured!("figure 4: R(0.5)", r, 1.0, 0.005);
    assert_measured!("figure 4: G(0.5)", g, 0.56, 0.005);
    assert_measured!("figure 4: B(0.5)", b, 0.06, 0.005);
    assert_measured!("figure 4: R(1)", last_r, 1.0, 0.005);
    assert_measured!("figure 4: G(1)", last_g, 0.96, 0.005);
    assert_measured!("figure 4: B(1)", last_b, 0.74, 0.005);
    // Rows are 1/256 apart.
    let shape = Csv::of(&["flame-shape", scene, "--height", "0.5"]);
    let last = |is_before: &dyn Fn(&Vec<f64>) -> bool| shape.rows.iter().rfind(|row| is_before(row)).unwrap()[0];
    assert_measured!("figure 2: w up to which V is 0", last(&|row| row[1] == 0.0), 0.26, 0.005);
    assert_measured!("figure 2: V(1)", shape.row(1.0)[1], 1.0, 1e-6);
    assert_measured!("figure 2: H on the axis", shape.row(0.5)[2], 0.0, 1e-6);
    assert_measured!("figure 2: H at the left edge", shape.row(0.0)[2], 1.0, 1e-6);
    assert_measured!("figure 2: H at the right edge", shape.row(1.0)[2], 1.0, 1e-6);
    assert_measured!("figure 6: x' up to which K is 1", last(&|row| row[7] == 1.0), 0.40, 0.005);
    assert_measured!("figure 6: x' up to which K is above h", last(&|row| row[7] > 0.72 + 1e-6), 0.76, 0.005);
    assert_measured!("figure 6: h", shape.row(1.0)[7], 0.72, 1e-6);
    // P of (15) at both edges.
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for row in &shape.rows {
        let fringe = row[5] - row[4];
        for edge in [row[8], row[9]].into_iter().filter(|_| fringe > 1e-3) {
            let p = (edge - row[4]) / fringe;
            assert!((0.2 - 1e-3..=1.0 + 1e-3).contains(&p), "{p} at {}", row[0]);
            (least, most) = (least.min(p), most.max(p));
        }
    }
    assert_measured!("figure 7: least P", least, 0.2, 1e-3);
    assert_measured!("figure 7: largest P", most, 1.0, 1e-3);
}

#[test]
fn statistics_of_a_flame_are_plotted_and_printed() {
    let flame = "bansho = 2\n[picture]\nsize = [320, 180]\nframes = 60\n[sky]\nluminance = 0.0\n[[flame_sheet]]\n";
    let folder = Folder::with_scene(flame);
    let run = folder.succeed(&["plot", "flame-statistics", "scene.toml", "--frames", "4", "--height", "48", "-o", "-"]);
    let table = Csv::parse(&run.stdout);
    assert_eq!(table.columns, ["frame", "lit_height", "area", "pieces", "pale", "base_width", "edge_redness"]);
    for frame in [0.0, 15.0, 30.0, 45.0] {
        let row = table.row(frame);
        assert!((0.3..=1.0).contains(&row[1]) && (0.02..0.5).contains(&row[2]) && row[3] >= 1.0, "{row:?}");
    }
    let run =
        folder.succeed(&["plot", "flame-statistics", "scene.toml", "--frames", "2", "--height", "48", "-o", "a.svg"]);
    assert!(run.stdout.contains("mean of 2 frames:") && run.stdout.contains("  pieces: "), "{}", run.stdout);
    assert!(std::fs::read_to_string(folder.path("a.svg")).unwrap().contains("Lit area"));
    let dark = Folder::with_scene(&flame.replace("[[flame_sheet]]", "[[flame_sheet]]\nflow = 0.0"));
    let run = dark.run(&["plot", "flame-statistics", "scene.toml", "--frames", "1", "--height", "16"]);
    assert_eq!((run.code, run.errors()), (Some(3), 1), "{}", run.stderr);
    assert!(run.stderr.contains("none of 1 frames has a lit pixel"), "{}", run.stderr);
}

#[test]
fn metadata_are_plotted_over_the_frames() {
    let folder = Folder::new();
    for frame in 0..3 {
        let text = format!(
            "{{\"format\": 1, \"frame\": {frame}, \"phenomena\": {{\"shower\": \
             {{\"rate\": {{\"value\": {frame}.5, \"unit\": \"mm/h\"}}, \"far\": {{\"value\": null, \"unit\": \"m\"}}}}}}}}"
        );
        folder.write(&format!("{frame}.json"), &text);
    }
    let run = folder.succeed(&["plot", "metadata", "2.json", "0.json", "1.json", "-o", "-"]);
    let table = Csv::parse(&run.stdout);
    assert_eq!(table.columns, ["frame", "shower far (m)", "shower rate (mm/h)"]);
    let rates: Vec<f64> = table.rows.iter().map(|row| row[2]).collect();
    assert!(rates == [0.5, 1.5, 2.5] && table.rows.iter().all(|row| row[1].is_nan()));
    folder.succeed(&["plot", "metadata", "0.json", "-o", "one.png"]);
    folder.write("other.json", "{\"frame\": 1}");
    let run = folder.run(&["plot", "metadata", "other.json"]);
    assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
    assert!(run.stderr.contains("other.json: states no `phenomena`; allowed: "), "{}", run.stderr);
    // What it is made from is never replaced.
    let run = folder.run(&["plot", "metadata", "0.json", "-o", "0.json"]);
    assert_eq!(run.code, Some(2), "{}", run.stderr);
    fs::copy(folder.path("0.json"), folder.path("0.csv")).unwrap();
    let run = folder.run(&["plot", "metadata", "0.csv", "-o", "0.csv", "--overwrite"]);
    assert!(run.code == Some(2) && run.stderr.contains("0.csv: is a file that"), "{}", run.stderr);
}

#[test]
fn figures_have_axes_colors_and_the_same_bytes_every_time() {
    let folder = Folder::new();
    for name in [
        "black-body",
        "kernel",
        "drop-sizes",
        "terminal-velocity",
        "streak-opacity",
        "beam",
        "emission",
        "deposition",
        "quenching",
    ] {
        for extension in ["svg", "png", "csv"] {
            let file = format!("{name}.{extension}");
            let made = || {
                folder.succeed(&["plot", name, "-o", &file]);
                fs::read(folder.path(&file)).unwrap()
            };
            assert!(made() == made(), "{file}");
        }
        let png = decode_png(&fs::read(folder.path(&format!("{name}.png"))).unwrap());
        let colors: HashSet<&[u8]> = png.bytes.chunks(png.channels).collect();
        assert!(png.width == 1600 && colors.len() > 50, "{name}: {} x {}", png.width, png.height);
    }
    let svg = |name: &str| fs::read_to_string(folder.path(&format!("{name}.svg"))).unwrap();
    for (name, label) in [
        ("black-body", "Temperature T (K)"),
        ("black-body", "Luminance (cd/m²)"),
        ("kernel", "Distance r/d"),
        ("drop-sizes", "Number density n(D) (m⁻³ mm⁻¹)"),
        ("terminal-velocity", "Terminal velocity v (m/s)"),
        ("streak-opacity", "Drop diameter D (mm)"),
        ("beam", "Illuminance E (lx)"),
        ("beam", "Angle from the axis (°)"),
        ("emission", "Altitude (km)"),
        ("deposition", "Ionization rate q (m⁻³ s⁻¹)"),
        ("quenching", "Radiated fraction"),
    ] {
        assert!(svg(name).contains(&format!(">{label}</text>")), "{name}: {label}");
    }
}

#[test]
fn foreign_files_stay() {
    let folder = Folder::new();
    for name in ["a.svg", "a.csv", "a.png"] {
        folder.write(name, "<svg>by hand</svg>");
        let run = folder.run(&["plot", "quenching", "-o", name]);
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{}", run.stderr);
        assert!(run.stderr.contains("or --overwrite to replace it"), "{}", run.stderr);
        assert_eq!(fs::read_to_string(folder.path(name)).unwrap(), "<svg>by hand</svg>");
        folder.succeed(&["plot", "quenching", "-o", name, "--overwrite"]);
        // Now it is one of ours.
        folder.succeed(&["plot", "terminal-velocity", "-o", name]);
    }
}

#[test]
fn what_cannot_be_plotted_is_one_clear_error() {
    let folder = Folder::new();
    for (arguments, told) in [
        (&["blak-body"][..], "a similar subcommand exists: 'black-body'"),
        (&["black-body", "--from", "0"], "allowed: a number from 1 to 10000 K"),
        (&["black-body", "--to", "1e99"], "allowed: a number from 1 to 10000 K"),
        (&["black-body", "--from", "3000", "--to", "2000"], "--from: 3000 to 2000 K is an empty range"),
        (&["black-body", "--step", "0.01", "--from", "nan"], "allowed: a number"),
        (&["black-body", "--texture", "srgbb"], "a similar value exists: 'srgb'"),
        (&["black-body", "--texture", "srgb", "-o", "a.csv"], "a.csv: a picture without axes is a PNG; allowed: .png"),
        (&["kernel", "--size", "1"], "allowed: a number from 2 to 4096 pixels"),
        (&["kernel", "--texture", "density", "-o", "-"], "allowed: .png"),
        (&["deflection", "no.toml", "--full-scale", "0"], "allowed: a number from 0.000000001 to 10 rad"),
        (&["drop-sizes", "--rates", "5,-1"], "each from 0.01 to 500 mm/h"),
        (&["streak-opacity", "--exposure-times", "1/0"], "each from 0.000001 to 10 s"),
        (&["beam", "--intensity", "-3"], "allowed: a number from 0.001 to 1000000000 cd"),
        (&["beam", "--inner-cone-deg", "40"], "--inner-cone-deg: 40 degrees is wider than --outer-cone-deg (22)"),
        (&["beam", "--rates", "5,-1"], "each from 0 to 500 mm/h"),
        (&["emission", "--energy-ev", "10"], "allowed: a number from 100 to 100000 eV"),
        (&["emission", "--flux-mw-per-m2", "-5"], "allowed: a number from 0.001 to 10000 mW/m^2"),
        (&["emission", "--spectrum", "maxwelian"], "a similar value exists: 'maxwellian'"),
        (&["deposition", "--energies-ev", "1000,1e9"], "each from 100 to 100000 eV"),
        (&["quenching", "-o", "figure.pdf"], "allowed: .svg, .png or .csv"),
    ] {
        let run = folder.run(&[&["plot"], arguments].concat());
        assert_eq!((run.code, run.errors()), (Some(2), 1), "{arguments:?}: {}", run.stderr);
        assert!(run.stderr.contains(told), "{arguments:?}: {}", run.stderr);
    }
    assert_eq!(folder.names(), Vec::<String>::new());
}
