//! Faults of drawn shapes, each at its sheet and point.

use bansho_base::host::{assets::AssetError, plural::counted};

/// Shapes from which no aurora can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {kind}")]
pub struct ShapeError {
    /// The parameter within the aurora's table, as in `shapes.1.sheets.0.points.7` (counting from 0).
    pub key: String,
    /// What is wrong.
    pub kind: ShapeErrorKind,
}

/// What can be wrong with shapes. Sheets, points and segments count from 1 here, as a person counts.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeErrorKind {
    /// Nothing that could be a line.
    #[error("sheet {sheet} has {}; allowed: at least 2, at different places", counted(*.found, "point"))]
    TooFewPoints {
        /// The sheet.
        sheet: usize,
        /// How many different points it has.
        found: usize,
    },
    /// A point beyond the square that is drawn on.
    #[error(
        "sheet {sheet}, point {point} lies at ({x:.1}, {z:.1}) km, outside the drawn square; allowed: -{half} to {half} km east and south (see `extent_km`)"
    )]
    Outside {
        /// The sheet.
        sheet: usize,
        /// The point.
        point: usize,
        /// East, km.
        x: f64,
        /// South, km.
        z: f64,
        /// Half the square's side, km.
        half: f64,
    },
    /// A smooth line that leaves the square between points that lie in it.
    #[error(
        "after point {point} the smooth line of sheet {sheet} passes ({x:.1}, {z:.1}) km, outside the drawn square; allowed: -{half} to {half} km east and south (see `extent_km`), or `smooth = false`"
    )]
    BendsOutside {
        /// The sheet.
        sheet: usize,
        /// The point before.
        point: usize,
        /// East, km.
        x: f64,
        /// South, km.
        z: f64,
        /// Half the square's side, km.
        half: f64,
    },
    /// A sheet that meets itself.
    #[error(
        "sheet {sheet} crosses itself: after point {point} it meets its part after point {earlier}; a sheet may bend back, but needs a gap"
    )]
    CrossesItself {
        /// The sheet.
        sheet: usize,
        /// Point before the crossing.
        point: usize,
        /// Point before it where the crossed part begins.
        earlier: usize,
    },
    /// A sheet that meets another.
    #[error(
        "sheet {sheet} meets sheet {other}: after point {point} and after point {other_point}; sheets neither cross nor branch"
    )]
    CrossesSheet {
        /// The sheet.
        sheet: usize,
        /// Its point before the crossing.
        point: usize,
        /// The sheet that it crosses.
        other: usize,
        /// That one's point before the crossing.
        other_point: usize,
    },
    /// Sheets that come from nowhere or go nowhere.
    #[error(
        "has {}, but {expected} from the shape before; allowed: as many as come, or `split` and `merge` that make up the difference",
        counted(*.found, "sheet"), expected = come(*.expected)
    )]
    Unmatched {
        /// Sheets drawn.
        found: usize,
        /// Sheets that the shape before becomes.
        expected: usize,
    },
    /// More sheets than can be followed.
    #[error("has {}; allowed: up to {most}", counted(*.found, "sheet"))]
    TooManySheets {
        /// Sheets drawn.
        found: usize,
        /// Most allowed.
        most: usize,
    },
    /// More control points than can be followed.
    #[error(
        "all shapes up to this one have {found} control points together; allowed: up to {most} (fewer shapes or sheets, or a lower `control_points`)"
    )]
    TooManyPoints {
        /// Control points of all shapes so far.
        found: usize,
        /// Most allowed.
        most: usize,
    },
    /// The first shape comes from nothing.
    #[error(
        "the first shape has none before it; `split`, `merge` and `link` stand at the shape that the change leads to"
    )]
    ChangeBeforeFirstShape,
    /// A sheet that is not there.
    #[error("there is no sheet {sheet} in the shape before; allowed: 1 to {count}")]
    NoSuchSheet {
        /// The sheet asked for.
        sheet: i64,
        /// Sheets that there are.
        count: usize,
    },
    /// A link to a sheet that is not there.
    #[error("there is no sheet {sheet} in this shape; allowed: 1 to {count}")]
    NoSuchTarget {
        /// The sheet asked for.
        sheet: i64,
        /// Sheets that there are.
        count: usize,
    },
    /// A segment that is not there.
    #[error("sheet {sheet} has no segment {segment}; allowed: 1 to {count}")]
    NoSuchSegment {
        /// The sheet.
        sheet: usize,
        /// The segment asked for.
        segment: i64,
        /// Segments that there are.
        count: usize,
    },
    /// A split said in two ways.
    #[error("says both `segment` and `length_fraction`; allowed: one of them")]
    SegmentAndPosition,
    /// Two splits of one segment.
    #[error("segment {segment} of sheet {sheet} is split already; allowed: one split a segment")]
    SplitTwice {
        /// The sheet.
        sheet: usize,
        /// The segment.
        segment: usize,
    },
    /// A merge of a point within a sheet.
    #[error(
        "the point at {at} of sheet {sheet} is not an end, and sheets never branch; allowed: 0 (its start) or 1 (its end)"
    )]
    NotAnEnd {
        /// The sheet.
        sheet: usize,
        /// Fraction of its length.
        at: f64,
    },
    /// Two merges of one end.
    #[error("the {} of sheet {sheet} is merged already; allowed: one merge an end", if *.is_end { "end" } else { "start" })]
    MergedTwice {
        /// The sheet.
        sheet: usize,
        /// Its end rather than its start.
        is_end: bool,
    },
    /// Merges that leave no end.
    #[error("this merge would close sheet {sheet} to a ring; allowed: sheets with two ends")]
    Ring {
        /// The sheet.
        sheet: usize,
    },
    /// Links of one sheet to two, or of two to one.
    #[error("sheet {sheet} is linked to another sheet already; allowed: one sheet each")]
    LinkedTwice {
        /// The sheet of this shape.
        sheet: usize,
    },
    /// A link that says where a point arrives and not where it leaves.
    #[error("says `to_length_fraction`, but not which point does; allowed: together with `from_length_fraction`")]
    ArrivalWithoutPoint,
    /// A link that says where a point leaves and not where it arrives, of a sheet that is all one.
    #[error(
        "says `from_length_fraction`, but not where that point arrives; allowed: together with `to_length_fraction`, or alone where the sheet splits"
    )]
    PointWithoutArrival,
    /// Linked points that change their order.
    #[error("two linked points of a sheet would pass each other; allowed: points in the order of the sheet")]
    LinksCross,
    /// A link where nothing goes by position.
    #[error("sheets and points go in drawing order here; allowed with `correspondence = \"automatic\"`")]
    LinkInOrder,
    /// A sheet that is said in several ways.
    #[error("sheet {sheet} says more than one of `points`, `svg_file` and `form`; allowed: one of them")]
    SeveralSources {
        /// The sheet.
        sheet: usize,
    },
    /// A path of an SVG file that is not named.
    #[error("names a path of an SVG file, but no file; allowed: together with `svg_file`")]
    StrokeWithoutFile,
    /// A time that is said in two ways.
    #[error("says both `transition_s` and `transition_frames`; allowed: one of them")]
    SecondsAndFrames,
    /// A time before the first shape.
    #[error(
        "the first shape is there at the beginning; allowed: at the shapes after it, and `hold_s` here says how long it stays"
    )]
    TimeBeforeFirstShape,
    /// Electrons of an energy that the tables of the air do not hold.
    #[error(
        "at {at} of its length sheet {sheet} has electrons of {energy_ev:.0} eV, the aurora's `energy_ev` times this factor; allowed: 100 to 100000 eV"
    )]
    EnergyOutside {
        /// The entry of the shape's list of sheets.
        sheet: usize,
        /// Fraction of its length.
        at: f64,
        /// The energy, eV.
        energy_ev: f64,
    },
    /// A loop that is no length of time.
    #[error("a loop of {seconds} s; allowed: more than 0")]
    LoopLength {
        /// The length asked for, s.
        seconds: f64,
    },
    /// A keyed value that does not end as it begins.
    #[error(
        "the loop of {seconds} s jumps: its first and its last moment differ; allowed: the same value at 0 s and at {seconds} s"
    )]
    LoopJumps {
        /// Length of the loop, s.
        seconds: f64,
    },
    /// A drawing that cannot be had.
    #[error("{0}")]
    Asset(#[from] AssetError),
}

/// How many sheets come from the shape before.
fn come(count: usize) -> String {
    if count == 1 { "1 comes".to_owned() } else { format!("{count} come") }
}
