//! Auroral shapes in scene files: the five scenes of the thesis move as it describes, and errors are reported at their sheet and point.

use std::sync::Arc;

use bansho::KINDS;
use bansho_aurora::{
    AuroraParameters,
    shapes::{FRAME_S, NearestSegmentGrid, Sequence, Shape},
    simulate::AuroraSimulation,
};
use bansho_base::{
    geometry::strokes::{Drawing, Stroke},
    host::{assets::MemoryAssets, observer::Unobserved},
    math::DVec2,
    parameters::{Parameters, Reader},
};
use bansho_render::PlanOptions;
use bansho_scene::Scene;

use crate::support::Planned;

fn assets() -> MemoryAssets {
    let stroke =
        |id: &str, points: [[f64; 2]; 2]| Stroke { id: Some(id.into()), points: points.map(DVec2::from).to_vec() };
    let strokes = vec![stroke("left", [[10.0, 50.0], [40.0, 50.0]]), stroke("right", [[60.0, 50.0], [90.0, 50.0]])];
    let mut assets = MemoryAssets::default();
    assets.insert_drawing(
        "shapes.svg",
        Drawing { strokes, min: DVec2::ZERO, max: DVec2::splat(100.0), remarks: Vec::new() },
    );
    assets
}

/// How the shapes of a scene's aurora move.
fn sequence_of(text: &str) -> Sequence {
    let scene = Scene::parse("test.toml", text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    let aurora = AuroraParameters::read_table(&scene.instances[0].parameters.canonical(), &mut Reader::new(), &[]);
    Sequence::new(&aurora.shapes, &aurora.morphing, aurora.extent_km, &assets(), None).unwrap()
}

fn fault(text: &str) -> String {
    match bansho::compile_scene("test.toml", &format!("bansho = 2\n[[aurora]]\n{text}"), Arc::new(assets())) {
        Ok(_) => panic!("accepted: {text}"),
        Err(error) => error.to_string(),
    }
}

const SCENES: [&str; 5] = [
    include_str!("../../../../scenes/sekiguchi_1.toml"),
    include_str!("../../../../scenes/sekiguchi_2.toml"),
    include_str!("../../../../scenes/sekiguchi_3.toml"),
    include_str!("../../../../scenes/sekiguchi_4.toml"),
    include_str!("../../../../scenes/sekiguchi_5.toml"),
];

fn sequence(scene: usize) -> Sequence {
    sequence_of(SCENES[scene - 1])
}

/// Greatest distance of any control point of one shape from the other.
fn farthest(from: &Shape, to: &Shape) -> f64 {
    let near = NearestSegmentGrid::new(to, 50.0);
    let points = from.sheets.iter().flat_map(|sheet| &sheet.points);
    points.map(|&point| near.distance(point).unwrap_or(50.0)).fold(0.0, f64::max)
}

#[test]
fn the_scenes_of_the_thesis_move_without_a_jump_and_without_crossing() {
    for scene in 1..=5 {
        let sequence = sequence(scene);
        let frames = (sequence.duration() / FRAME_S).round() as usize;
        assert_eq!(frames, [280, 280, 280, 560, 420][scene - 1]);
        let mut before = sequence.at(0.0);
        for frame in 1..=frames {
            let now = sequence.at(frame as f64 * FRAME_S);
            assert_eq!(now.crossings(), 0, "scene {scene}, frame {frame}");
            let jump = farthest(&now, &before).max(farthest(&before, &now));
            assert!(jump < 3.5, "scene {scene}, frame {frame}: {jump} km");
            let longer = (now.length() / before.length() - 1.0).abs();
            assert!(longer < 0.02, "scene {scene}, frame {frame}: {longer}");
            before = now;
        }
    }
}

#[test]
fn the_scenes_have_as_many_sheets_as_the_thesis_tells() {
    let sheets = |scene: usize| {
        let sequence = sequence(scene);
        sequence.arrivals().iter().map(|&time| sequence.at(time).sheets.len()).collect::<Vec<_>>()
    };
    assert_eq!(sheets(1), [1, 1, 1]);
    assert_eq!(sheets(2), [1, 1, 2]);
    assert_eq!(sheets(3), [3, 3, 2]);
    assert_eq!(sheets(4), [1, 1, 1, 3, 2]);
    assert_eq!(sheets(5), [6, 6, 6, 6]);
}

/// Scene 1's fold must stay open: the gap between its two limbs, 60 km from its bend, is far from any sheet.
#[test]
fn the_fold_of_scene_1_leaves_a_gap() {
    let sequence = sequence(1);
    let last = NearestSegmentGrid::new(&sequence.at(sequence.duration()), 60.0);
    assert!(last.distance(DVec2::new(95.0, -213.0)).is_none_or(|distance| distance > 45.0));
}

/// The simulation of a scene of the thesis with a tenth of its particles.
fn simulation(scene: usize) -> AuroraSimulation {
    let text = SCENES[scene - 1];
    assert!(text.contains("count = 120_000"));
    let text = text.replace("count = 120_000", "count = 12_000");
    let parsed = Scene::parse("test.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    let aurora = AuroraParameters::read_table(&parsed.instances[0].parameters.canonical(), &mut Reader::new(), &[]);
    AuroraSimulation::new(aurora, sequence_of(&text), "aurora", 1)
}

fn step_to(simulation: &mut AuroraSimulation, frame: f64) {
    while simulation.time() < (frame - 0.5) * FRAME_S {
        simulation.step();
    }
}

/// The fraction of the particles, and of their power, within circles: centers and radii, km.
fn fractions_within(simulation: &AuroraSimulation, circles: &[([f64; 2], f64)]) -> Vec<[f64; 2]> {
    let particles = simulation.particles();
    let (count, power) = (particles.len() as f64, particles.power_w());
    let within = |(middle, radius): &([f64; 2], f64)| {
        let inside = |index: &usize| particles.position(*index).distance(DVec2::from(*middle)) < *radius;
        let inside: Vec<usize> = (0..particles.len()).filter(inside).collect();
        let own: f64 = inside.iter().map(|index| f64::from(particles.powers_w[*index])).sum();
        [inside.len() as f64 / count, own / power]
    };
    circles.iter().map(within).collect()
}

/// The thesis shows a black circle within the fold of scene 1, and open bends in scene 2: nothing may be drawn across them.
#[test]
fn no_particle_is_in_the_black_circle_and_the_inner_bends() {
    // Circles as wide as they fit between the limbs, but for L_thr and a cell of the field on each side.
    for (scene, first, places) in [
        (1, 280, vec![([95.0, -213.0], 45.0)]),
        (2, 140, vec![([52.0, -131.0], 6.5), ([-52.0, -169.0], 6.5)]),
        (2, 280, vec![([58.0, -130.0], 8.0), ([-58.0, -170.0], 8.0)]),
    ] {
        let wide = places.iter().map(|(middle, radius)| (*middle, 2.0 * radius));
        let places = [&places[..], &wide.collect::<Vec<_>>()].concat();
        let mut simulation = simulation(scene);
        // From the arrival on, as long as the shape stays; the S moves on at once.
        let moments = if first == 140 { 1 } else { 6 };
        for moment in 0..moments {
            let frame = first + 9 * moment;
            step_to(&mut simulation, f64::from(frame));
            let shares = fractions_within(&simulation, &places);
            let (within, around) = shares.split_at(places.len() / 2);
            assert!(within.iter().flatten().all(|share| *share == 0.0), "scene {scene}, frame {frame}: {within:?}");
            // Rays make quiet stretches, so that the power there varies more than the number.
            let are_around = around.iter().all(|[count, power]| *count > 1e-2 && *power > 2e-3);
            assert!(are_around, "scene {scene}, frame {frame}: {around:?}");
        }
    }
}

/// The particle density in the emptiest interval of the sheets, relative to the mean. An interval is a fiftieth of the length of all sheets.
fn min_interval_density(simulation: &AuroraSimulation, shape: &Shape) -> f64 {
    /// Number of bins of an interval. Consecutive intervals are shifted by one bin.
    const BINS: usize = 4;
    let lengths: Vec<f64> =
        shape.sheets.iter().map(|sheet| sheet.points.windows(2).map(|pair| pair[0].distance(pair[1])).sum()).collect();
    let total: f64 = lengths.iter().sum();
    let bins = |length: &f64| ((50 * BINS) as f64 * length / total).round() as usize;
    let mut counts: Vec<Vec<f64>> = lengths.iter().map(|length| vec![0.0; bins(length)]).collect();
    let particles = simulation.particles();
    let mut living = 0.0;
    for index in (0..particles.len()).filter(|index| !particles.dying[*index]) {
        living += 1.0;
        // A bridge across a gap is a separate sheet, after those of the shape.
        let Some(bins) = counts.get_mut(particles.sheets[index] as usize) else { continue };
        let last = bins.len() - 1;
        bins[((f64::from(particles.arc_fractions[index]) * (last + 1) as f64) as usize).min(last)] += 1.0;
    }
    let intervals = counts.iter().zip(&lengths).flat_map(|(counts, length)| {
        let due = living * BINS as f64 * length / (total * counts.len() as f64);
        counts.windows(BINS).map(move |interval| interval.iter().sum::<f64>() / due)
    });
    intervals.fold(f64::INFINITY, f64::min)
}

#[test]
#[ignore = "statistics of half a minute or more: .ci/long runs them"]
fn every_interval_of_the_thesis_scenes_has_its_share_of_particles_on_arrival() {
    for scene in 1..=5 {
        let sequence = sequence(scene);
        let mut simulation = simulation(scene);
        for &arrival in &sequence.arrivals()[1..] {
            step_to(&mut simulation, arrival / FRAME_S);
            let least = min_interval_density(&simulation, &sequence.at(simulation.time()));
            assert!(least >= 0.5, "scene {scene}, {arrival} s: an interval has {least} of its share");
        }
    }
}

#[test]
fn faults_stand_at_their_sheet_and_point() {
    for (text, expected) in [
        (
            "[[aurora.shapes]]\nsheets = [{ points = [[0, 0]] }]\n",
            "test.toml:4:22: aurora.0.shapes.0.sheets.0.points (shape 1, sheet 1): sheet 1 has 1 point; allowed",
        ),
        ("[[aurora.shapes]]\nsheets = [{ points = [] }]\n", "sheet 1 has 0 points; allowed: at least 2"),
        (
            "[[aurora.shapes]]\nsheets = [{ points = [[0, 0], [100, 0], [500, 0]] }]\n",
            "test.toml:4:41: aurora.0.shapes.0.sheets.0.points.2 (shape 1, sheet 1, point 3): sheet 1, point 3 lies at (500.0, 0.0) km",
        ),
        (
            "[[aurora.shapes]]\nsheets = [{ smooth = false, points = [[0, 0], [100, 0], [100, 50], [50, 50], [50, -50]] }]\n",
            "points.3 (shape 1, sheet 1, point 4): sheet 1 crosses itself: after point 4 it meets the segment after point 1",
        ),
        (
            "[[aurora.shapes]]\nsheets = [{ points = [[0, 0], [9, 0]] }, { points = [[5, -5], [5, 5]] }]\n",
            "sheets.1.points.0 (shape 1, sheet 2, point 1): sheet 2 meets sheet 1: after point 1 and after point 1",
        ),
        (
            "[[aurora.shapes]]\nsheets = [{ points = [[0, 0], [9, 0]] }, { points = [[9, 0], [9, 5]] }]\n",
            "sheet 2 meets sheet 1",
        ),
        (
            "[[aurora.shapes]]\n[[aurora.shapes]]\nsheets = [{}, { position_km = [0, 90] }]\n",
            "test.toml:5:10: aurora.0.shapes.1.sheets (shape 2): has 2 sheets, but 1 is expected after the previous shape",
        ),
        (
            "[[aurora.shapes]]\n[[aurora.shapes]]\nsplit = [{ segment = 99 }]\n",
            "aurora.0.shapes.1.split.0 (shape 2, split 1): sheet 1 has no segment 99; allowed: 1 to 95",
        ),
        (
            "[[aurora.shapes]]\nsheets = [{}, { position_km = [0, 90] }]\n[[aurora.shapes]]\nmerge = [{ ends = [0.5, 0] }]\n",
            "the point at 0.5 of sheet 1 is not an end",
        ),
        ("[[aurora.shapes]]\nsplit = [{}]\n", "aurora.0.shapes.0.split (shape 1): the first shape has no previous one"),
        (
            "[[aurora.shapes]]\nsheets = [{ svg_file = \"shapes.svg\", svg_path_id = \"middle\" }]\n",
            "test.toml:4:52: aurora.0.shapes.0.sheets.0.svg_path_id (shape 1, sheet 1): shapes.svg: has no stroke with the id `middle`",
        ),
        (
            "[[aurora.shapes]]\nsheets = [{ svg_path_id = \"left\" }]\n",
            "sheets.0.svg_path_id (shape 1, sheet 1): names a path of an SVG file, but no file",
        ),
        (
            "[[aurora.shapes]]\nsheets = [{ points = [[-200, -290], [-100, -200], [0, -299], [100, -299], [200, -200]] }]\n",
            "after point 3 the smooth line of sheet 1 passes",
        ),
        (
            "[[aurora.shapes]]\nsheets = [{ form = \"arc\" }]\n[[aurora.shapes]]\nlink = [{ to = 5 }]\nsheets = [{ form = \"arc\" }]\n",
            "shapes.1.link.0 (shape 2, link 1): there is no sheet 5 in this shape; allowed: 1 to 1",
        ),
        ("[[aurora.shapes]]\nsheets = [{ svg_file = \"gone.svg\" }]\n", "gone.svg: no such file"),
        (
            "[[aurora.shapes]]\ntransition_s = 3\n[[aurora.shapes]]\n",
            "test.toml:4:16: aurora.0.shapes.0.transition_s (shape 1): the first shape has no transition",
        ),
        (
            "[[aurora.shapes]]\n[[aurora.shapes]]\nlink = [{ from_length_fraction = 0.5 }]\n",
            "test.toml:5:9: aurora.0.shapes.1.link.0 (shape 2, link 1): `from_length_fraction` needs `to_length_fraction`",
        ),
        (
            "[[aurora.shapes]]\n[[aurora.shapes]]\nmerge = [{ sheets = [1, 2.5] }]\n",
            "test.toml:5:25: aurora.0.shapes.1.merge.0.sheets (shape 2, merge 1): expected a whole number from 1 to 1000, found a number",
        ),
        (
            "[[aurora.shapes]]\nsheets = [{ svg_file = \"shapes.svg\", form = \"arc\" }]\n",
            "has more than one of `points`, `svg_file` and `form`",
        ),
        ("[[aurora.shapes]]\nsheets = [{ form = \"arcc\" }]\n", "unknown value `arcc`, did you mean `arc`?"),
        (
            "[[aurora.shapes]]\ntransition_s = 3\ntransition_frames = 3\n",
            "has both `transition_s` and `transition_frames`",
        ),
        ("energy_ev = 0\n", "test.toml:3:13: aurora.0.energy_ev: 0 is out of range; allowed: 100 to 100000 eV"),
        ("energy_ev = 1e6\n", "test.toml:3:13: aurora.0.energy_ev: 1000000 is out of range; allowed: 100 to 100000 eV"),
        (
            "[[aurora.shapes]]\nsheets = [{ form = \"arc\", energy_factor = [[0, 1], [1, 0]] }]\n",
            "test.toml:4:56: aurora.0.shapes.0.sheets.0.energy_factor.1 (shape 1, sheet 1, energy_factor 2): 0 is out of range; allowed: 0.05 to 20",
        ),
        (
            "energy_ev = 10000\n[[aurora.shapes]]\nsheets = [{}, { position_km = [0, 90], energy_factor = [[0, 1], [0.5, 1], [1, 20]] }]\n",
            "test.toml:5:75: aurora.0.shapes.0.sheets.1.energy_factor.2 (shape 1, sheet 2, energy_factor 3): at 1 of its length, sheet 2 has electrons of 200000 eV",
        ),
        (
            "energy_ev = 500\n[[aurora.shapes]]\nsheets = [{ energy_factor = [[0.5, 0.1]] }]\n",
            "at 0.5 of its length, sheet 1 has electrons of 50 eV (`energy_ev` times the factor here); allowed: 100 to 100000 eV",
        ),
    ] {
        let shown = fault(text);
        assert!(shown.contains(expected), "{text}\nexpected: {expected}\nshown: {shown}");
    }
}

#[test]
fn sheets_that_would_pass_through_each_other_are_told() {
    let remarks = |link: &str| {
        let sheets = "sheets = [{ form = \"arc\" }, { form = \"arc\", position_km = [0, 90] }]\n";
        let text = format!("bansho = 2\n[[aurora]]\n[[aurora.shapes]]\n{sheets}[[aurora.shapes]]\n{sheets}{link}");
        let assets = Arc::new(assets());
        let scene = Scene::parse("test.toml", &text, KINDS).unwrap_or_else(|error| panic!("{error}"));
        Planned::new(scene, &PlanOptions::default(), assets).remarks()
    };
    assert_eq!(remarks(""), []);
    let told = remarks("link = [{ from = 1, to = 2 }]\n");
    let [(name, remark)] = &told[..] else { panic!("{told:?}") };
    assert_eq!((name.as_str(), remark.key.as_deref()), ("aurora", Some("shapes.1")));
    assert!(remark.message.starts_with("its sheets pass through each other on the way to shape 2;"), "{remark}");
    assert!(told[0].1.to_string().contains("on the way to shape 2; another"), "{}", told[0].1);
}

#[test]
fn three_lines_make_an_aurora() {
    for text in ["bansho = 2\n[[aurora]]\n", "bansho = 2\n[[aurora]]\nshapes = [{ sheets = [{ form = \"fold\" }] }]\n"]
    {
        let sequence = sequence_of(text);
        // Half the side of the drawn square and more.
        let length = sequence.at(1.0).length();
        assert!(length > 300.0, "{length} km: {text}");
        let lit = lit_fraction(text);
        assert!(lit > 0.03, "{lit} of the picture is lit: {text}");
    }
}

/// The fraction of the pixels of a scene's first picture that are brighter than a twentieth of white.
fn lit_fraction(text: &str) -> f64 {
    let assets = Arc::new(assets());
    let scene = Scene::parse("test.toml", text, KINDS).unwrap_or_else(|error| panic!("{error}"));
    let options = PlanOptions { size: Some([96, 54]), ..PlanOptions::default() };
    let mut shot = Planned::new(scene, &options, assets).open();
    let frame = bansho::draw(&mut shot, 0, &Unobserved).unwrap();
    let light: Vec<f32> = frame.beauty.pixels().iter().map(|pixel| pixel[1]).collect();
    light.iter().filter(|value| **value > 0.05).count() as f64 / light.len() as f64
}

#[test]
fn a_camera_looks_up_where_all_is_in_the_sky_unless_it_is_told() {
    let camera = |text: &str| {
        let scene = Scene::parse("test.toml", text, KINDS).unwrap_or_else(|error| panic!("{error}"));
        let camera = scene.camera.at(0.0, [160, 90]);
        (camera.position, -camera.world_from_camera.z_axis)
    };
    let (place, up) = camera("bansho = 2\n[[aurora]]\n");
    assert!(place.y == 1.7 && (0.4..0.6).contains(&up.y) && up.z < -0.8, "{place} {up}");
    let (_, zenith) = camera("bansho = 2\n[camera]\nlens = \"fisheye\"\n[[aurora]]\n");
    assert!(zenith.y > 0.999, "{zenith}");
    for text in [
        "bansho = 2\n[camera]\ntarget = [0.0, 0.9, 0.0]\n[[aurora]]\n",
        "bansho = 2\n[[aurora]]\n[[flame_sheet]]\n",
        "bansho = 2\n",
    ] {
        assert!(camera(text).0.y == 1.2, "{text}");
    }
}

#[test]
fn a_drawing_is_fitted_to_the_square() {
    let text =
        "bansho = 2\n[[aurora]]\nshapes = [{ sheets = [{ svg_file = \"shapes.svg\", svg_path_id = \"right\" }] }]\n";
    let shape = sequence_of(text).at(0.0);
    let points = &shape.sheets[0].points;
    assert_eq!((points[0], points[points.len() - 1]), (DVec2::new(60.0, 0.0), DVec2::new(240.0, 0.0)));
    let all = "bansho = 2\n[[aurora]]\nshapes = [{ sheets = [{ svg_file = \"shapes.svg\" }] }]\n";
    assert_eq!(sequence_of(all).at(0.0).sheets.len(), 2);
}
