//! Rays and folds are continuous when a shape is reached, whatever the order and direction in which its sheets were drawn.

use bansho_base::{
    math::{approximations, random::Key},
    noise::LANES,
};

use super::*;
use crate::{
    shapes::{ControlPointIds, MorphingParameters},
    simulate::sheets::{
        arc_length::ArcLengthMap,
        rays::{PatternInputs, RayPattern},
        refined_shape::{FoldModel, RefinedShape},
    },
};

const KEY: Key = Key::new(8, "arrivals");

/// A sheet at that position south.
fn row(from: f64, to: f64, south: f64) -> SheetParameters {
    SheetParameters { smooth: false, ..line([from, south], [to, south]) }
}

fn folded(shapes: Vec<ShapeParameters>) -> AuroraParameters {
    let folds = FoldParameters { amplitude_km: 6.0, ..FoldParameters::default() };
    AuroraParameters { shapes, folds, ..small() }
}

fn reached(sheets: Vec<SheetParameters>) -> ShapeParameters {
    ShapeParameters { sheets, ..ShapeParameters::default() }
}

/// The sheets and their rays at one time.
struct Seen {
    refined: RefinedShape,
    /// The logarithm of the rays' brightness at positions beside the sheets, some on their left and some on their right.
    rays: Vec<f32>,
}

impl Seen {
    fn new(
        parameters: &AuroraParameters,
        sequence: &Sequence,
        along: &ArcLengthMap,
        time: f64,
        positions: &[DVec2],
    ) -> Self {
        let folds = FoldModel::new(parameters, KEY);
        let (shape, bridges) = (sequence.at(time), sequence.bridges(time));
        let refined = RefinedShape::new(&shape, &bridges, along, &folds, time, 40.0);
        let rays = RayPattern::new(parameters, KEY);
        let table = rays.table(&refined.sheet_lengths(), |sheet, last| refined.arc_coordinates(sheet, last), time);
        let bright = |position: &DVec2| {
            // While a sheet turns it passes some of them far away.
            let Some(projection) = refined.project(*position) else { return 0.0 };
            let positions = PatternInputs {
                noises: [table.at(projection.sheet, projection.fraction); LANES],
                side: [projection.side.signum() as f32; LANES],
            };
            approximations::ln(rays.at(bansho_base::math::simd::level(), &positions, time).brightness[0])
        };
        let rays = positions.iter().map(bright).collect();
        Self { refined, rays }
    }

    /// Maximum distance of a point of one from the other, km, in both directions.
    fn apart(&self, other: &Self) -> f64 {
        let one_way = |from: &RefinedShape, to: &RefinedShape| {
            let points = from.shape.sheets.iter().flat_map(|sheet| &sheet.points);
            points.map(|point| to.distance(*point).unwrap_or(f64::INFINITY)).fold(0.0, f64::max)
        };
        one_way(&self.refined, &other.refined).max(one_way(&other.refined, &self.refined))
    }
}

/// How control points are identified between shapes.
#[derive(Clone, Copy, PartialEq)]
enum Known {
    /// By the ids of the sequence.
    ByNumber,
    /// By their positions in the list of sheets, as if it never changed.
    ByPosition,
}

/// Maximum motion of folds, km, and maximum change of rays at fixed positions, from just before `arrivals` to just after them.
fn jumps(
    parameters: &AuroraParameters,
    sequence: &Sequence,
    arrivals: &[f64],
    positions: &[DVec2],
    known: Known,
) -> [f64; 2] {
    let follow = |along: &ArcLengthMap, time: f64| {
        let shape = sequence.at(time);
        match known {
            Known::ByNumber => along.transfer(&shape, &sequence.control_point_ids(time)),
            Known::ByPosition => along.transfer(&shape, &ControlPointIds::alone(&in_turn(&shape))),
        }
    };
    let (mut along, mut time, mut most) = (ArcLengthMap::alone(&sequence.at(0.0)), 0.0, [0.0_f64; 2]);
    if known == Known::ByNumber {
        along = ArcLengthMap::from_lengths(&sequence.at(0.0), &sequence.control_point_ids(0.0));
    }
    for arrival in arrivals {
        while time < arrival - 0.04 {
            time += 0.03;
            along = follow(&along, time);
            along.relax(0.03);
        }
        let [before, after] = [-1e-6, 1e-6].map(|offset| {
            time = arrival + offset;
            along = follow(&along, time);
            Seen::new(parameters, sequence, &along, time, positions)
        });
        let rays = before.rays.iter().zip(&after.rays).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max);
        most = [most[0].max(before.apart(&after)), most[1].max(rays)];
    }
    most
}

/// The control points of a shape, counted over all sheets in turn.
fn in_turn(shape: &Shape) -> Vec<Vec<usize>> {
    let mut numbers = 0..;
    shape.sheets.iter().map(|sheet| numbers.by_ref().take(sheet.points.len()).collect()).collect()
}

/// Positions 9 km to both sides of a sheet along 300 km.
fn beside(south: f64) -> Vec<DVec2> {
    let position =
        |index: i32| DVec2::new(f64::from(index) * 7.0 - 150.0, south + if index % 2 == 0 { 9.0 } else { -9.0 });
    (0..43).map(position).collect()
}

#[test]
fn nothing_jumps_where_sheets_were_drawn_in_another_order_and_direction() {
    let parameters = folded(vec![
        reached(vec![row(-200.0, 200.0, 0.0), row(-200.0, 200.0, 100.0)]),
        reached(vec![row(200.0, -200.0, 110.0), row(-200.0, 200.0, 10.0)]),
        reached(vec![row(200.0, -200.0, 10.0), row(200.0, -200.0, 100.0)]),
        reached(vec![row(-200.0, 200.0, 100.0), row(-200.0, 200.0, 0.0)]),
    ]);
    let sequence = sequence(&parameters);
    let positions = [beside(8.0), beside(105.0)].concat();
    let [folds, rays] = jumps(&parameters, &sequence, &sequence.arrivals()[1..], &positions, Known::ByNumber);
    assert!(folds < 1e-3 && rays < 1e-2, "folds jump by {folds} km, rays by {rays}");
    // For comparison: the jumps of a pattern whose control points are identified by their positions in the list of sheets.
    let [folds, rays] = jumps(&parameters, &sequence, &sequence.arrivals()[1..], &positions, Known::ByPosition);
    assert!(folds > 1.0 && rays > 0.3, "{folds} {rays}");
}

/// Two sheets that were drawn toward each other merge: one of them is then listed in the opposite direction.
#[test]
fn nothing_jumps_where_a_sheet_joins_one_of_the_other_direction() {
    let mut merge = reached(vec![row(220.0, -220.0, 5.0)]);
    merge.merge = vec![MergeParameters::default()];
    let mut split = reached(vec![row(30.0, 220.0, 0.0), row(-30.0, -220.0, 0.0)]);
    split.split = vec![SplitParameters::default()];
    let parameters = folded(vec![
        reached(vec![row(-220.0, -30.0, 0.0), row(220.0, 30.0, 0.0)]),
        merge,
        reached(vec![row(-220.0, 220.0, 0.0)]),
        split,
    ]);
    let sequence = sequence(&parameters);
    let positions: Vec<DVec2> = beside(0.0).into_iter().filter(|position| position.x.abs() > 60.0).collect();
    let [folds, rays] = jumps(&parameters, &sequence, &sequence.arrivals()[1..], &positions, Known::ByNumber);
    assert!(rays < 1e-2, "rays jump by {rays}, folds by {folds} km");
    // Folds are compared only where the two sheets merge: the later split at the same point moves the one segment there.
    let [folds, _] = jumps(&parameters, &sequence, &sequence.arrivals()[1..2], &positions, Known::ByNumber);
    assert!(folds < 0.2, "folds jump by {folds} km");
}

/// A sheet that rotates by thirds is reversed when the loop begins again.
#[test]
fn nothing_jumps_where_a_loop_begins_again() {
    let turned = |rotation_deg: f64| SheetParameters { rotation_deg, ..row(-200.0, 200.0, 0.0) };
    let straight = || vec![turned(0.0), row(-200.0, 200.0, 240.0)];
    let swapped = |degrees: f64| vec![row(200.0, -200.0, 250.0), turned(degrees)];
    let parameters =
        folded(vec![reached(straight()), reached(swapped(60.0)), reached(swapped(120.0)), reached(straight())]);
    let assets = MemoryAssets::default();
    let sequence =
        Sequence::new(&parameters.shapes, &MorphingParameters::default(), parameters.extent_km, &assets, Some(9.0))
            .unwrap();
    let positions = [beside(0.0), beside(240.0)].concat();
    let [folds, rays] = jumps(&parameters, &sequence, &[3.0, 6.0, 9.0, 12.0, 18.0], &positions, Known::ByNumber);
    // A segment whose length is a whole number of pieces up to rounding may have one piece more or less just after: 50 m in the line through
    // a fold.
    assert!(folds < 0.1 && rays < 1e-2, "folds jump by {folds} km, rays by {rays}");
}
