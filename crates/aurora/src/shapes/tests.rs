//! Whole sequences: splits and merges as the thesis draws them, no jumps, loops that close, random shapes.

use bansho_base::{
    host::assets::MemoryAssets,
    math::{
        DVec2,
        curve::{Curve, Interpolation},
        random::{Key, Purpose},
    },
    parameters::Auto,
};

use super::*;

const EXTENT_KM: f64 = 1000.0;

fn sheet(points: &[[f64; 2]]) -> SheetParameters {
    SheetParameters { points: Some(points.to_vec()), smooth: false, end_taper: 0.0, ..SheetParameters::default() }
}

fn shape(sheets: Vec<SheetParameters>) -> ShapeParameters {
    ShapeParameters { transition_s: Some(4.0), sheets, ..ShapeParameters::default() }
}

/// The shapes, without a transition time of the first one.
fn begun(shapes: &[ShapeParameters]) -> Vec<ShapeParameters> {
    let mut shapes = shapes.to_vec();
    shapes[0].transition_s = None;
    shapes
}

fn straight(from: f64, to: f64, z: f64) -> SheetParameters {
    sheet(&[[from, z], [to, z]])
}

fn in_order(control_points: i64) -> MorphingParameters {
    MorphingParameters {
        correspondence: Correspondence::DrawingOrder,
        control_points: Auto::Set(control_points),
        ..MorphingParameters::default()
    }
}

fn sequence(shapes: &[ShapeParameters], motion: &MorphingParameters) -> Sequence {
    Sequence::new(&begun(shapes), motion, EXTENT_KM, &MemoryAssets::default(), None).unwrap()
}

fn points(shape: &Shape) -> Vec<Vec<[f64; 2]>> {
    shape.sheets.iter().map(|sheet| sheet.points.iter().map(|point| point.to_array()).collect()).collect()
}

/// Maximum distance from a point of one shape to the other, in both directions.
fn apart(a: &Shape, b: &Shape) -> f64 {
    let one_way = |from: &Shape, to: &Shape| {
        let near = NearestSegmentGrid::new(to, 30.0);
        let all = from.sheets.iter().flat_map(|sheet| &sheet.points);
        all.map(|&point| near.distance(point).unwrap_or(f64::INFINITY)).fold(0.0, f64::max)
    };
    one_way(a, b).max(one_way(b, a))
}

fn assert_no_jump(sequence: &Sequence) {
    for &arrival in sequence.arrivals() {
        let at = sequence.at(arrival);
        for near in [arrival - 1e-6, arrival + 1e-6] {
            assert!(apart(&at, &sequence.at(near)) < 1e-3, "at {arrival} s");
        }
    }
}

/// Figs. 2.4 and 2.6: four points at x = 0, 30, 60, 90; the middle segment opens from 45 toward 30 and 60.
#[test]
fn in_drawing_order_a_split_segment_shrinks_to_its_ends() {
    let mut split = shape(vec![straight(0.0, 90.0, 0.0)]);
    split.split = vec![SplitParameters { segment: Some(2), ..SplitParameters::default() }];
    let sequence = sequence(&[shape(vec![straight(0.0, 90.0, 0.0)]), split], &in_order(4));
    assert_eq!(points(&sequence.at(0.0)), [[[0.0, 0.0], [30.0, 0.0], [60.0, 0.0], [90.0, 0.0]]]);
    // Half way, by smoothstep: the new points are half way from 45 to 30 and 60.
    assert_eq!(
        points(&sequence.at(2.0)),
        [[[0.0, 0.0], [30.0, 0.0], [37.5, 0.0]], [[52.5, 0.0], [60.0, 0.0], [90.0, 0.0]]]
    );
    assert_eq!(points(&sequence.at(4.0)), [[[0.0, 0.0], [30.0, 0.0]], [[60.0, 0.0], [90.0, 0.0]]]);
    assert_no_jump(&sequence);
}

/// Figs. 2.5 and 2.7: ends at x = 30 and 60 grow toward 45, where the two new points become one.
#[test]
fn in_drawing_order_a_merge_grows_to_the_middle() {
    let sheets = || vec![straight(0.0, 30.0, 0.0), straight(60.0, 90.0, 0.0)];
    let mut merge = shape(sheets());
    merge.merge = vec![MergeParameters::default()];
    let sequence = sequence(&[shape(sheets()), merge], &in_order(4));
    let half = points(&sequence.at(2.0));
    assert_eq!((half[0][4], half[1][0]), ([37.5, 0.0], [52.5, 0.0]));
    let last = points(&sequence.at(4.0));
    assert_eq!((last.len(), last[0].len(), last[0][4]), (1, 9, [45.0, 0.0]));
    assert_no_jump(&sequence);
}

#[test]
fn automatic_splits_and_merges_need_only_source_and_target() {
    let one = shape(vec![straight(-200.0, 200.0, 0.0)]);
    let mut two = shape(vec![straight(220.0, 40.0, 30.0), straight(-220.0, -40.0, -30.0)]);
    two.split = vec![SplitParameters::default()];
    let mut again = shape(vec![sheet(&[[-200.0, 10.0], [0.0, 20.0], [200.0, 0.0]])]);
    again.merge = vec![MergeParameters::default()];
    let sequence = sequence(&[one, two, again], &MorphingParameters::default());
    assert_no_jump(&sequence);
    // The gap opens and closes gradually.
    let gap = |t: f64| {
        let shape = sequence.at(t);
        let ends = shape.sheets.iter().flat_map(|sheet| [sheet.points[0], sheet.points[sheet.points.len() - 1]]);
        let inner: Vec<DVec2> = ends.filter(|end| end.x.abs() < 100.0).collect();
        inner[0].distance(inner[1])
    };
    let opening: Vec<f64> = [0.1, 1.0, 2.0, 3.0, 4.0].map(gap).to_vec();
    assert!(opening.is_sorted() && opening[0] < 5.0, "{opening:?}");
    assert!((opening[4] - 100.0).abs() < 1e-9);
    let closing: Vec<f64> = [4.0, 5.0, 6.0, 7.0, 7.9].map(gap).to_vec();
    assert!(closing.iter().rev().is_sorted() && closing[4] < 5.0, "{closing:?}");
    let last = sequence.at(8.0);
    bansho_base::assert_measured!(
        "future work: in-between targets: sheets at last",
        last.sheets.len() as f64,
        1.0,
        0.0
    );
    assert_eq!(last.crossings(), 0);
    assert!((last.length() - 401.0).abs() < 1.0);
}

#[test]
fn sheets_have_the_order_in_which_they_were_drawn() {
    let first = shape(vec![straight(-200.0, 200.0, 0.0), straight(-200.0, 200.0, 100.0)]);
    let second = shape(vec![straight(200.0, -200.0, 110.0), straight(-200.0, 200.0, 10.0)]);
    let sequence = sequence(&[first, second], &MorphingParameters::default());
    let last = points(&sequence.at(4.0));
    assert_eq!((last[0][0], last[1][0]), ([200.0, 110.0], [-200.0, 10.0]));
    let half = sequence.at(2.0);
    // Each on its own half of the way: at 5 or at 105 km.
    let off = |point: &DVec2| {
        let rest = (point.y - 5.0).rem_euclid(100.0);
        rest.min(100.0 - rest)
    };
    assert!(half.sheets.iter().all(|sheet| sheet.points.iter().all(|point| off(point) < 1e-9)));
}

#[test]
fn flux_and_energy_travel_with_the_sheet() {
    let curve = |from: f64, to: f64| Curve::new(vec![[0.0, from], [1.0, to]], Interpolation::Linear).unwrap();
    let bright = SheetParameters {
        flux_factor: curve(0.0, 2.0),
        energy_factor: curve(1.0, 3.0),
        ..straight(-200.0, 200.0, 0.0)
    };
    let dim = |from: f64, to: f64| SheetParameters { flux_factor: curve(0.5, 0.5), ..straight(from, to, 0.0) };
    let mut split = shape(vec![dim(-220.0, -20.0), dim(20.0, 220.0)]);
    split.split = vec![SplitParameters::default()];
    let sequence = sequence(&[shape(vec![bright]), split], &MorphingParameters::default());
    let first = sequence.at(0.0);
    let flux = &first.sheets[0].flux;
    assert_eq!((flux[0], flux[flux.len() - 1]), (0.0, 2.0));
    // Just before the split opens, its new ends have the flux of the middle of the sheet.
    let open = sequence.at(1e-9);
    let [left, right] = [&open.sheets[0], &open.sheets[1]];
    assert!((left.flux[left.flux.len() - 1] - 1.0).abs() < 1e-6 && (right.energy[0] - 2.0).abs() < 1e-6);
    assert!(sequence.at(4.0).sheets.iter().all(|sheet| sheet.flux.iter().all(|flux| *flux == 0.5)));
}

#[test]
fn loops_close_whether_the_sequence_returns_or_not() {
    let shapes = [straight(-200.0, 200.0, 0.0), straight(-200.0, 200.0, 80.0), straight(-150.0, 250.0, 20.0)];
    let mut shapes: Vec<ShapeParameters> = shapes.map(|sheet| shape(vec![sheet])).to_vec();
    let looped = |shapes: &[ShapeParameters]| {
        Sequence::new(&begun(shapes), &MorphingParameters::default(), EXTENT_KM, &MemoryAssets::default(), Some(6.0))
            .unwrap()
    };
    let there_and_back = looped(&shapes);
    shapes.push(shapes[0].clone());
    let round = looped(&shapes);
    for sequence in [&there_and_back, &round] {
        let speed = |t: f64| {
            let h = 1e-5;
            let at = |t: f64| sequence.at(t).sheets[0].points[5];
            (at(t + h) - at(t)) / h
        };
        assert!(apart(&sequence.at(0.0), &sequence.at(6.0)) < 1e-6);
        assert!(apart(&sequence.at(1.3), &sequence.at(7.3)) < 1e-6);
        assert!(speed(6.0 - 2e-5).distance(speed(6.0)) < 0.01, "{} {}", speed(6.0 - 2e-5), speed(6.0));
    }
    // Half way round it is at the middle shape or at the last one.
    assert!((there_and_back.at(3.0).sheets[0].points[0].y - 20.0).abs() < 1e-9);
    assert!((round.at(2.0).sheets[0].points[0].y - 80.0).abs() < 1e-9);
    let error =
        Sequence::new(&begun(&shapes), &MorphingParameters::default(), EXTENT_KM, &MemoryAssets::default(), Some(0.0));
    assert_eq!(error.unwrap_err().to_string(), "loop: a loop of 0 s is too short; allowed: more than 0 s");
}

fn random_shape(key: Key, case: u64, step: u32, sheets: usize) -> ShapeParameters {
    let sheet = |row: usize| {
        let random = |purpose: &str| key.uniforms(case, 16 * step + row as u32, Purpose::named(purpose)).map(f64::from);
        let [form, length, bend, mirror] = random("form");
        let [x, turn, points, _] = random("place");
        let choice = Form::CHOICES[(form * Form::CHOICES.len() as f64) as usize].name;
        SheetParameters {
            form: Form::from_name(choice),
            length_km: Auto::Set(120.0 + 250.0 * length),
            bend_deg: if bend < 0.5 { Auto::Auto } else { Auto::Set(120.0 * (bend - 0.5)) },
            wave_count: if points < 0.7 { Auto::Auto } else { Auto::Set(1 + (points * 4.0) as i64) },
            mirror: mirror < 0.5,
            position_km: [200.0 * (x - 0.5), 200.0 * row as f64 - 300.0],
            rotation_deg: 30.0 * (turn - 0.5),
            ..SheetParameters::default()
        }
    };
    shape((0..sheets).map(sheet).collect())
}

/// Random forms in four rows, one of which splits and two of which merge; some of them intersect and are rejected.
#[test]
fn random_sequences_stay_finite_and_inside() {
    let key = Key::new(6, "sequences");
    let mut made = 0;
    for case in 0..60 {
        let mut shapes: Vec<ShapeParameters> = (0..4).map(|step| random_shape(key, case, step, 4)).collect();
        shapes[2].split =
            vec![SplitParameters { sheet: 1, length_fraction: Some((case % 11) as f64 / 10.0), segment: None }];
        shapes[2].merge = vec![MergeParameters { sheets: [3, 4], ..MergeParameters::default() }];
        let motion =
            MorphingParameters { control_points: Auto::Set(8 + (case % 40) as i64), ..MorphingParameters::default() };
        let loop_s = (case % 3 == 0).then_some(7.0);
        let Ok(sequence) = Sequence::new(&begun(&shapes), &motion, EXTENT_KM, &MemoryAssets::default(), loop_s) else {
            continue;
        };
        made += 1;
        for step in 0..40 {
            let shape = sequence.at(f64::from(step) * 0.37 - 1.0);
            for sheet in &shape.sheets {
                assert!(sheet.points.len() >= 2 && sheet.flux.len() == sheet.points.len());
                assert!(sheet.points.iter().all(|point| point.abs().max_element() <= EXTENT_KM / 2.0), "case {case}");
            }
            let segments = SheetSampler::new(&shape);
            assert!(
                segments
                    .sample(0.3)
                    .is_some_and(|sample| sample.point.is_finite() && (0.0..=1.0).contains(&sample.fraction))
            );
        }
        if loop_s.is_none() {
            assert_no_jump(&sequence);
        }
    }
    assert!(made > 20, "only {made}");
}

/// A scribble of 10,000 recorded points is refused at its first crossing, a long spiral accepted.
#[test]
fn long_strokes_are_checked() {
    let turn = |index: usize, radius: f64| {
        let (sin, cos) = bansho_base::math::sin_cos(index as f64 * 0.05);
        [radius * cos, radius * sin]
    };
    let spiral: Vec<[f64; 2]> = (0..10_000).map(|index| turn(index, 20.0 + index as f64 * 0.04)).collect();
    let smooth = sequence(&[shape(vec![sheet(&spiral)])], &MorphingParameters::default());
    assert!(smooth.at(0.0).length() > 1000.0);
    let crossed: Vec<[f64; 2]> =
        (0..10_000).map(|index| turn(index, 300.0 - (index as f64 - 5000.0).abs() * 0.04)).collect();
    let error = Sequence::new(
        &begun(&[shape(vec![sheet(&crossed)])]),
        &MorphingParameters::default(),
        EXTENT_KM,
        &MemoryAssets::default(),
        None,
    );
    assert!(matches!(error.unwrap_err().kind, ShapeErrorKind::CrossesItself { sheet: 1, .. }));
}

/// A sheet that returns to its first position with another flux does not close the sequence: the flux is reached, and a loop runs back
/// and forth without a jump.
#[test]
fn a_shape_that_returns_with_another_flux_is_another() {
    let flux = |value: f64| Curve::new(vec![[0.0, value]], Interpolation::Linear).unwrap();
    let bright = SheetParameters { flux_factor: flux(3.0), energy_factor: flux(2.0), ..straight(-200.0, 200.0, 0.0) };
    let shapes = [straight(-200.0, 200.0, 0.0), straight(-200.0, 200.0, 50.0), bright].map(|sheet| shape(vec![sheet]));
    for motion in [in_order(9), MorphingParameters::default()] {
        let once = sequence(&shapes, &motion);
        let last = &once.at(once.duration()).sheets[0];
        assert!(last.flux.iter().all(|flux| *flux == 3.0) && last.energy.iter().all(|energy| *energy == 2.0));
        let turn = Sequence::new(&begun(&shapes), &motion, EXTENT_KM, &MemoryAssets::default(), Some(9.0)).unwrap();
        let [before, after] = [8.999, 9.001].map(|t| turn.at(t).sheets[0].flux[4]);
        assert!((before - after).abs() < 0.01, "{before} {after}");
    }
    // Other parameters for the same flux close it.
    let same = SheetParameters {
        flux_factor: Curve::new(vec![[0.0, 1.0], [1.0, 1.0]], Interpolation::Linear).unwrap(),
        ..straight(-200.0, 200.0, 0.0)
    };
    let shapes = [shapes[0].clone(), shapes[1].clone(), shape(vec![same])];
    let turn = Sequence::new(&begun(&shapes), &in_order(9), EXTENT_KM, &MemoryAssets::default(), Some(8.0)).unwrap();
    assert!((turn.at(4.0).sheets[0].points[0].y - 50.0).abs() < 1e-6, "round, not there and back");
}

/// Sheets that are linked to exchange their positions cross in the transition to the second shape; others do not.
#[test]
fn sheets_that_exchange_places_are_known_to_cross() {
    assert_eq!(linked(vec![]).unwrap().crossing(), None);
    assert_eq!(linked(vec![link(1, 2, None)]).unwrap().crossing(), Some(1));
}

/// Crossings are tested during transitions, however long shapes are held.
#[test]
fn sheets_that_cross_are_known_to_however_long_shapes_stay() {
    let sheets = vec![straight(-200.0, 200.0, 0.0), straight(-200.0, 200.0, 50.0)];
    for hold_s in [300.0, 600.0, 1e5] {
        let first = ShapeParameters { hold_s, ..shape(sheets.clone()) };
        let second = ShapeParameters { link: vec![link(1, 2, None)], hold_s, ..shape(sheets.clone()) };
        let stays = [first.clone(), ShapeParameters { link: vec![], ..second.clone() }];
        let motion = MorphingParameters { control_points: Auto::Set(11), ..MorphingParameters::default() };
        assert_eq!(sequence(&[first, second], &motion).crossing(), Some(1), "held {hold_s} s");
        assert_eq!(sequence(&stays, &motion).crossing(), None);
    }
}

/// In drawing order the last shape is drawn before its split: after the split it does not equal the first shape.
#[test]
fn a_loop_in_drawing_order_does_not_end_where_a_sheet_has_split() {
    let [one, other] = [0.0, 80.0].map(|z| shape(vec![straight(0.0, 90.0, z)]));
    let mut split = one.clone();
    split.split = vec![SplitParameters { segment: Some(2), ..SplitParameters::default() }];
    let [merged, parted] = [0.0, 80.0].map(|z| shape(vec![straight(0.0, 30.0, z), straight(60.0, 90.0, z)]));
    let mut merge = merged.clone();
    merge.merge = vec![MergeParameters::default()];
    for shapes in [vec![one.clone(), other.clone(), split], vec![merged, parted, merge]] {
        let looped =
            Sequence::new(&begun(&shapes), &in_order(4), EXTENT_KM, &MemoryAssets::default(), Some(9.0)).unwrap();
        for time in [9.0, 4.5] {
            assert!(apart(&looped.at(time - 1e-6), &looped.at(time + 1e-6)) < 1e-3, "at {time} s");
        }
        assert!(apart(&looped.at(0.0), &looped.at(9.0)) < 1e-3);
    }
    // Without it the loop goes round: at half of its time it is at the other shape.
    let round = [one.clone(), other, one];
    let looped = Sequence::new(&begun(&round), &in_order(4), EXTENT_KM, &MemoryAssets::default(), Some(8.0)).unwrap();
    assert!((looped.at(4.0).sheets[0].points[0].y - 80.0).abs() < 1e-6);
}

#[test]
fn more_control_points_than_can_be_held_are_refused() {
    let row =
        |index: usize| SheetParameters { copies: 32, spacing_km: 1.0, ..straight(-200.0, 200.0, 33.0 * index as f64) };
    let full = shape((0..8).map(row).collect());
    let motion = MorphingParameters { control_points: Auto::Set(512), ..MorphingParameters::default() };
    let error = Sequence::new(&begun(&vec![full; 32]), &motion, EXTENT_KM, &MemoryAssets::default(), None).unwrap_err();
    assert_eq!(error.key, "shapes.30.sheets");
    assert_eq!(error.kind, ShapeErrorKind::TooManyPoints { found: 31 * 256 * 512, max: 4_000_000 });
}

/// Two sheets that do not move, with links to the second shape.
fn linked(link: Vec<LinkParameters>) -> Result<Sequence, ShapeError> {
    let sheets = vec![straight(-200.0, 200.0, 0.0), straight(-200.0, 200.0, 50.0)];
    let shapes = [shape(sheets.clone()), ShapeParameters { link, ..shape(sheets) }];
    let motion = MorphingParameters { control_points: Auto::Set(11), ..MorphingParameters::default() };
    Sequence::new(&begun(&shapes), &motion, EXTENT_KM, &MemoryAssets::default(), None)
}

fn link(from: i64, to: i64, point: Option<[f64; 2]>) -> LinkParameters {
    LinkParameters {
        from,
        to,
        from_length_fraction: point.map(|point| point[0]),
        to_length_fraction: point.map(|point| point[1]),
    }
}

#[test]
fn linked_sheets_become_what_they_are_linked_to() {
    let [straight, exchanged] =
        [vec![], vec![link(1, 2, None)]].map(|links| linked(links).unwrap().control_point_paths(0));
    assert!(straight.iter().flatten().all(|[from, to]| from.distance(*to) < 1e-6));
    assert!(
        exchanged.iter().flatten().all(|[from, to]| (from.y - to.y).abs() > 49.9),
        "the other goes where one is left"
    );
}

#[test]
fn linked_points_arrive_where_they_are_linked_to() {
    let ways = linked(vec![link(1, 1, Some([0.3, 0.5])), link(1, 1, Some([0.8, 0.9]))]).unwrap().control_point_paths(0);
    let arrives = |from: f64| ways[0].iter().find(|way| (way[0].x - from).abs() < 1e-6).map(|way| way[1].x);
    for (from, to) in [(-200.0, -200.0), (-80.0, 0.0), (120.0, 160.0), (200.0, 200.0)] {
        assert!(arrives(from).is_some_and(|x| (x - to).abs() < 1e-6), "{from}: {:?}", arrives(from));
    }
    assert!(ways[1].iter().all(|[from, to]| from.distance(*to) < 1e-6), "the other stays");
    let turned =
        linked(vec![link(1, 1, Some([0.3, 0.7])), link(1, 1, Some([0.8, 0.2]))]).unwrap().control_point_paths(0);
    assert!((turned[0][0][1].x - 200.0).abs() < 1e-6, "points that arrive in the other order turn the sheet round");
}

#[test]
fn impossible_links_are_refused() {
    let refused = |links: &[LinkParameters]| linked(links.to_vec()).unwrap_err();
    let missing = refused(&[link(1, 3, None)]);
    assert_eq!(
        (missing.key.as_str(), missing.kind),
        ("shapes.1.link.0", ShapeErrorKind::NoSuchTarget { sheet: 3, count: 2 })
    );
    let twice = refused(&[link(1, 2, None), link(2, 2, None)]);
    assert_eq!((twice.key.as_str(), twice.kind), ("shapes.1.link.1", ShapeErrorKind::LinkedTwice { sheet: 2 }));
    let half = LinkParameters { to_length_fraction: Some(0.5), ..LinkParameters::default() };
    assert_eq!(refused(&[half]).kind, ShapeErrorKind::ArrivalWithoutPoint);
    let nowhere = refused(&[link(1, 1, None), LinkParameters { from_length_fraction: Some(0.5), ..link(2, 2, None) }]);
    assert_eq!((nowhere.key.as_str(), nowhere.kind), ("shapes.1.link.1", ShapeErrorKind::PointWithoutArrival));
    let passing = [[0.2, 0.3], [0.5, 0.8], [0.8, 0.6]].map(|point| link(1, 1, Some(point)));
    assert_eq!(refused(&passing).kind, ShapeErrorKind::LinksCross);
    let first =
        [ShapeParameters { link: vec![link(1, 1, None)], transition_s: None, ..shape(vec![straight(0.0, 9.0, 0.0)]) }];
    let error =
        Sequence::new(&first, &MorphingParameters::default(), EXTENT_KM, &MemoryAssets::default(), None).unwrap_err();
    assert_eq!(error.kind, ShapeErrorKind::ChangeBeforeFirstShape);
}

#[test]
fn the_first_shape_takes_no_time_to_come() {
    for (key, first) in [
        ("shapes.0.transition_s", ShapeParameters { transition_s: Some(2.0), ..ShapeParameters::default() }),
        ("shapes.0.transition_frames", ShapeParameters { transition_frames: Some(2.0), ..ShapeParameters::default() }),
    ] {
        let shapes = [first, ShapeParameters::default()];
        let error = Sequence::new(&shapes, &MorphingParameters::default(), EXTENT_KM, &MemoryAssets::default(), None);
        let error = error.unwrap_err();
        assert_eq!((error.key.as_str(), error.kind), (key, ShapeErrorKind::TimeBeforeFirstShape));
    }
}
