//! Rays and folds go on as they were where a shape is reached, whatever the order and direction in which its sheets were drawn.

use bansho_base::{
    math::{approximations, random::Key},
    noise::LANES,
};

use super::*;
use crate::{
    shapes::{Listing, MotionParameters},
    simulate::sheets::{
        arc_length::Along,
        rays::{Places, Rays},
        refined_shape::{Course, Folding},
    },
};
use fearless_simd::Level;

const KEY: Key = Key::new(8, "arrivals");

/// A sheet at that place south.
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

/// What is seen of the sheets at a moment.
struct Seen {
    course: Course,
    /// The logarithm of the rays' brightness at places beside the sheets, some on their left and some on their right.
    rays: Vec<f32>,
}

impl Seen {
    fn new(parameters: &AuroraParameters, sequence: &Sequence, along: &Along, time: f64, places: &[DVec2]) -> Self {
        let folding = Folding::new(parameters, KEY);
        let (shape, bridges) = (sequence.at(time), sequence.bridges(time));
        let course = Course::new((&shape, &bridges), along, &folding, time, 40.0);
        let rays = Rays::new(parameters, KEY);
        let table = rays.table(&course.sheet_lengths(), |sheet, last| course.alongs(sheet, last), time);
        let bright = |place: &DVec2| {
            // While a sheet turns it passes some of them far away.
            let Some(foot) = course.foot(*place) else { return 0.0 };
            let places =
                Places { noises: [table.at(foot.sheet, foot.share); LANES], side: [foot.side.signum() as f32; LANES] };
            approximations::ln(rays.at(Level::new(), &places, time).brightness[0])
        };
        let rays = places.iter().map(bright).collect();
        Self { course, rays }
    }

    /// Farthest that a point of one is from the other, km, both ways.
    fn apart(&self, other: &Self) -> f64 {
        let one_way = |from: &Course, to: &Course| {
            let points = from.shape.sheets.iter().flat_map(|sheet| &sheet.points);
            points.map(|point| to.distance(*point).unwrap_or(f64::INFINITY)).fold(0.0, f64::max)
        };
        one_way(&self.course, &other.course).max(one_way(&other.course, &self.course))
    }
}

/// How control points are known again.
#[derive(Clone, Copy, PartialEq)]
enum Known {
    /// As the sequence says.
    ByNumber,
    /// By their places in the list of sheets, as if these never changed.
    ByPlace,
}

/// The most that folds move, km, and that rays change at fixed places, from just before `arrivals` to just after them.
fn jumps(
    parameters: &AuroraParameters,
    sequence: &Sequence,
    arrivals: &[f64],
    places: &[DVec2],
    known: Known,
) -> [f64; 2] {
    let follow = |along: &Along, time: f64| {
        let shape = sequence.at(time);
        match known {
            Known::ByNumber => along.follow(&shape, &sequence.listing(time)),
            Known::ByPlace => along.follow(&shape, &Listing::alone(&in_turn(&shape))),
        }
    };
    let (mut along, mut time, mut most) = (Along::alone(&sequence.at(0.0)), 0.0, [0.0_f64; 2]);
    if known == Known::ByNumber {
        along = Along::begin(&sequence.at(0.0), &sequence.listing(0.0));
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
            Seen::new(parameters, sequence, &along, time, places)
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

/// Places 9 km to both sides of a sheet along 300 km.
fn beside(south: f64) -> Vec<DVec2> {
    let place =
        |index: i32| DVec2::new(f64::from(index) * 7.0 - 150.0, south + if index % 2 == 0 { 9.0 } else { -9.0 });
    (0..43).map(place).collect()
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
    let places = [beside(8.0), beside(105.0)].concat();
    let [folds, rays] = jumps(&parameters, &sequence, &sequence.arrivals()[1..], &places, Known::ByNumber);
    assert!(folds < 1e-3 && rays < 1e-2, "folds jump by {folds} km, rays by {rays}");
    // What the figures are of a pattern that goes by the list of sheets.
    let [folds, rays] = jumps(&parameters, &sequence, &sequence.arrivals()[1..], &places, Known::ByPlace);
    assert!(folds > 1.0 && rays > 0.3, "{folds} {rays}");
}

/// Two sheets that were drawn toward each other grow together: one of them is passed the other way from then on.
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
    let places: Vec<DVec2> = beside(0.0).into_iter().filter(|place| place.x.abs() > 60.0).collect();
    let [folds, rays] = jumps(&parameters, &sequence, &sequence.arrivals()[1..], &places, Known::ByNumber);
    assert!(rays < 1e-2, "rays jump by {rays}, folds by {folds} km");
    // Where they grow together; a split in the very place of that join moves the one segment there.
    let [folds, _] = jumps(&parameters, &sequence, &sequence.arrivals()[1..2], &places, Known::ByNumber);
    assert!(folds < 0.2, "folds jump by {folds} km");
}

/// A sheet that turns round by thirds has turned end to end when the loop begins again.
#[test]
fn nothing_jumps_where_a_loop_begins_again() {
    let turned = |rotation_deg: f64| SheetParameters { rotation_deg, ..row(-200.0, 200.0, 0.0) };
    let straight = || vec![turned(0.0), row(-200.0, 200.0, 240.0)];
    let swapped = |degrees: f64| vec![row(200.0, -200.0, 250.0), turned(degrees)];
    let parameters =
        folded(vec![reached(straight()), reached(swapped(60.0)), reached(swapped(120.0)), reached(straight())]);
    let assets = MemoryAssets::default();
    let sequence =
        Sequence::new(&parameters.shapes, &MotionParameters::default(), parameters.extent_km, &assets, Some(9.0))
            .unwrap();
    let places = [beside(0.0), beside(240.0)].concat();
    let [folds, rays] = jumps(&parameters, &sequence, &[3.0, 6.0, 9.0, 12.0, 18.0], &places, Known::ByNumber);
    // A segment that is whole pieces long but for rounding has one more or less a moment later: 50 m in the line through a fold.
    assert!(folds < 0.1 && rays < 1e-2, "folds jump by {folds} km, rays by {rays}");
}
