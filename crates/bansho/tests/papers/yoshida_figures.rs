//! The pictures of Yoshida, Dobashi and Yamamoto, to the letter and by Bansho's own method: `scenes/papers/yoshida_dobashi_yamamoto`.
//! `docs/src/papers/yoshida_dobashi_yamamoto.md` states the numbers.

use std::{path::PathBuf, sync::Arc};

use bansho::{
    CompiledScene, Plan, PlanOptions, Shot, Unobserved,
    base::{
        assert_measured, color,
        frame::Frame,
        image::Rect,
        math::{self, DVec3},
    },
    media::assets::FileAssets,
};

/// Size of the paper's pictures.
const SIZE: [usize; 2] = [640, 480];

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../scenes/papers/yoshida_dobashi_yamamoto")
}

fn text(scene: &str) -> String {
    std::fs::read_to_string(folder().join(scene)).unwrap_or_else(|error| panic!("{scene}: {error}"))
}

/// A scene with nothing but its rain and its lamps, which themselves are not seen: all light is that of the rain.
fn rain_alone(text: &str) -> String {
    let kept = ["[picture]", "[camera]", "[wind]", "[[light]]", "[[rain]]"];
    let tables = text.split("\n\n").filter(|table| kept.iter().any(|header| table.starts_with(header)));
    let tables: Vec<String> = tables.map(|table| table.replace("visible = true\n", "")).collect();
    format!("bansho = 2\n{}\n[sky]\nkind = \"uniform\"\nluminance = 0.0\n", tables.join("\n"))
}

/// A scene that was built once, from which several parts are drawn.
struct Figure {
    compiled: Arc<CompiledScene>,
}

impl Figure {
    fn new(name: &str, text: &str) -> Self {
        let parsed = Arc::new(bansho::parse_scene(name, text).unwrap_or_else(|error| panic!("{error}")));
        let compiled = CompiledScene::build(parsed, Arc::new(FileAssets::new(folder())), None);
        Self { compiled: Arc::new(compiled.unwrap_or_else(|errors| panic!("{errors}"))) }
    }

    /// The whole scene of a file.
    fn whole(name: &str) -> Self {
        Self::new(name, &text(name))
    }

    fn rain_alone(name: &str) -> Self {
        Self::new(name, &rain_alone(&text(name)))
    }

    fn plan(&self, crop: Option<Rect>) -> Plan {
        let options = PlanOptions { size: Some(SIZE), crop, metadata: true, ..PlanOptions::default() };
        Plan::new(&self.compiled, &options).unwrap()
    }

    /// A part of a frame.
    fn draw(&self, number: i64, crop: Option<Rect>) -> Frame {
        let mut shot = Shot::open(self.compiled.clone(), Arc::new(self.plan(crop)));
        bansho::draw(&mut shot, number, &Unobserved).unwrap()
    }

    /// Where a point is in a frame, pixels.
    fn pixel(&self, number: i64, point: DVec3) -> [f64; 2] {
        self.plan(None).view(number).camera.project(point).unwrap().pixel.to_array()
    }
}

/// Luminance of a pixel of a frame.
fn luminance(frame: &Frame, x: usize, y: usize) -> f64 {
    let [r, g, b, _] = frame.beauty.at(x, y);
    f64::from(color::luminance([r, g, b]))
}

/// Mean luminance of a square of air, 30 pixels wide, 60 pixels before the nearer headlight, divided by that of the square 120 pixels above it.
fn beam_over_air_above(figure: &Figure, number: i64) -> f64 {
    // The headlight on the camera's side drives at 12 m/s.
    let driven = 12.0 * figure.plan(None).view(number).shutter.middle();
    let headlight = DVec3::new(2.16 + driven, 0.62, 0.56);
    let [x, y] = figure.pixel(number, headlight).map(|value| value.round() as usize);
    let frame = figure.draw(number, Some(Rect { x: x + 60 - 15, y: y - 120 - 15, width: 30, height: 150 }));
    let mean = |rows: std::ops::Range<usize>| {
        let values = rows.flat_map(|y| (0..30).map(move |x| (x, y))).map(|(x, y)| luminance(&frame, x, y));
        values.sum::<f64>() / 900.0
    };
    mean(120..150) / mean(0..30)
}

#[test]
fn the_air_in_the_beam_of_figure_6a_is_several_times_as_bright_as_above_it() {
    let figure = Figure::whole("yoshida_figure_6a.toml");
    let [first, middle, last] = [20, 60, 100].map(|number| beam_over_air_above(&figure, number));
    assert_measured!("figure 6a: beam over the air above it in frame 20", first, 11.0, 0.5);
    assert_measured!("figure 6a: beam over the air above it in frame 60", middle, 4.3, 0.05);
    assert_measured!("figure 6a: beam over the air above it in frame 100", last, 3.6, 0.05);
    let ratio = beam_over_air_above(&Figure::whole("driving_in_rain.toml"), 60);
    assert_measured!("figure 6a: beam over the air above it by Bansho's own method", ratio, 90.0, 1.0);
}

/// Angle from the vertical, degrees, along which the light of a picture varies least: that of its streaks. To the right at the top is positive.
fn lean_deg(frame: &Frame) -> f64 {
    let [width, height] = [frame.beauty.width(), frame.beauty.height()];
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let dx = luminance(frame, x + 1, y) - luminance(frame, x - 1, y);
            let dy = luminance(frame, x, y + 1) - luminance(frame, x, y - 1);
            (xx, xy, yy) = (xx + dx * dx, xy + dx * dy, yy + dy * dy);
        }
    }
    // The axis of the largest gradient is across the streaks.
    (0.5 * math::atan2(2.0 * xy, xx - yy)).to_degrees()
}

fn metadata(frame: &Frame, name: &str) -> f64 {
    let entries = frame.metadata.iter().flat_map(|phenomenon| &phenomenon.entries);
    entries.into_iter().find(|entry| entry.name == name).unwrap().value
}

#[test]
fn streaks_of_figure_6b_are_vertical_and_banshos_own_lean() {
    // Verticals meet below the picture, since the camera looks down.
    let upper_right = Some(Rect { x: 400, y: 0, width: 240, height: 160 });
    let lean = |name: &str, crop: Option<Rect>| lean_deg(&Figure::rain_alone(name).draw(60, crop));
    assert_measured!("figure 6b: lean to the letter, degrees", lean("yoshida_figure_6b.toml", upper_right), 6.0, 0.5);
    assert_measured!(
        "figure 6b: lean by Bansho's own method, degrees",
        lean("driving_toward_camera.toml", upper_right),
        45.0,
        0.5
    );
    let whole = Figure::rain_alone("yoshida_figure_6b.toml").draw(60, None);
    assert_measured!("figure 6b: billboards", metadata(&whole, "billboards_in_view"), 885.0, 0.0);
    let side = Figure::rain_alone("yoshida_figure_6a.toml").draw(60, None);
    assert_measured!("billboards of figure 6a", metadata(&side, "billboards_in_view"), 904.0, 0.0);
    // The drops of the textures, not the sum of no streaks, -0.
    assert_measured!("drops of figure 6a", metadata(&side, "drops_in_view"), 29_263.0, 0.0);
}

#[test]
fn the_scene_of_all_rates_has_as_many_billboards_as_its_page_states() {
    let frame = Figure::rain_alone("yoshida_rates.toml").draw(100, None);
    assert_measured!("section 6: setting: rate, mm/h", metadata(&frame, "rain_rate"), 20.0, 0.0);
    assert_measured!("section 6: setting: billboards", metadata(&frame, "billboards_in_view"), 642.0, 0.0);
}

/// Mean light of the rain below a lamp, in rings 20 pixels wide at distances of 30, 60 and 170 pixels from it, over four frames: the first two divided by
/// the last.
fn light_near_the_lamp(name: &str, lamp: DVec3) -> [f64; 2] {
    const DISTANCES: [f64; 3] = [30.0, 60.0, 170.0];
    let figure = Figure::rain_alone(name);
    let [x, y] = figure.pixel(0, lamp);
    let crop = Rect { x: x as usize - 180, y: y as usize, width: 360, height: 180 };
    let (mut sums, mut counts) = ([0.0; 3], [0.0; 3]);
    for number in [20, 50, 80, 110] {
        let frame = figure.draw(number, Some(crop));
        for row in 0..crop.height {
            for column in 0..crop.width {
                let offset = [(crop.x + column) as f64 + 0.5 - x, (crop.y + row) as f64 + 0.5 - y];
                let distance = math::hypot(offset[0], offset[1]);
                for (ring, at) in DISTANCES.into_iter().enumerate() {
                    if (distance - at).abs() <= 10.0 && offset[1] > 0.0 {
                        sums[ring] += luminance(&frame, column, row);
                        counts[ring] += 1.0;
                    }
                }
            }
        }
    }
    let [near, middle, far] = std::array::from_fn(|ring| sums[ring] / counts[ring]);
    [near / far, middle / far]
}

#[test]
fn light_of_figure_7a_falls_away_from_the_lamp() {
    let [near, middle] = light_near_the_lamp("yoshida_figure_7a.toml", DVec3::new(0.0, 3.2, 0.0));
    assert_measured!("figure 7a: 30 over 170 pixels to the letter", near, 2.9, 0.05);
    assert_measured!("60 over 170 pixels to the letter", middle, 3.1, 0.05);
    let [near, _] = light_near_the_lamp("lamp_post_afar.toml", DVec3::new(0.0, 5.33, 0.0));
    assert_measured!("figure 7a: 30 over 170 pixels by Bansho's own method", near, 12.2, 0.05);
}

#[test]
fn light_of_figure_7b_falls_away_from_the_lamp() {
    let [near, middle] = light_near_the_lamp("yoshida_figure_7b.toml", DVec3::new(0.0, 3.2, 0.0));
    assert_measured!("figure 7b: 30 over 170 pixels to the letter", near, 1.4, 0.05);
    assert_measured!("60 over 170 pixels to the letter", middle, 2.1, 0.05);
    let [near, _] = light_near_the_lamp("lamp_post_near.toml", DVec3::new(0.0, 5.33, 0.0));
    assert_measured!("figure 7b: 30 over 170 pixels by Bansho's own method", near, 14.0, 0.05);
}
