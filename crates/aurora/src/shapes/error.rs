//! Errors in drawn shapes, with sheet and point.

use bansho_base::host::{assets::AssetError, plural::counted};

/// An invalid shape, and the key of the parameter at fault.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {kind}")]
pub struct ShapeError {
    /// The parameter within the aurora's table, as in `shapes.1.sheets.0.points.7` (counting from 0).
    pub key: String,
    /// What is wrong.
    pub kind: ShapeErrorKind,
}

impl ShapeError {
    /// An error at a key of shape `index`, such as `merge.0`.
    pub(super) fn in_shape(index: usize, key: &str, kind: ShapeErrorKind) -> Self {
        Self { key: format!("shapes.{index}.{key}"), kind }
    }
}

/// Reasons why a shape is invalid. Sheets, points and segments are counted from 1 here, as in messages.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShapeErrorKind {
    /// Fewer than two distinct points.
    #[error("sheet {sheet} has {}; allowed: at least 2 distinct points", counted(*.found, "point"))]
    TooFewPoints {
        /// The sheet.
        sheet: usize,
        /// Number of distinct points.
        found: usize,
    },
    /// A point outside the drawn square.
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
    /// A smooth line that leaves the square between points that are inside.
    #[error(
        "after point {point} the smooth line of sheet {sheet} passes ({x:.1}, {z:.1}) km, outside the drawn square; allowed: -{half} to {half} km east and south (see `extent_km`), or `smooth = false`"
    )]
    BendsOutside {
        /// The sheet.
        sheet: usize,
        /// The last point before.
        point: usize,
        /// East, km.
        x: f64,
        /// South, km.
        z: f64,
        /// Half the square's side, km.
        half: f64,
    },
    /// A sheet that intersects itself.
    #[error(
        "sheet {sheet} crosses itself: after point {point} it meets the segment after point {earlier}; a sheet may turn back, but must keep a gap"
    )]
    CrossesItself {
        /// The sheet.
        sheet: usize,
        /// Point before the crossing.
        point: usize,
        /// First point of the segment that is crossed.
        earlier: usize,
    },
    /// A sheet that intersects another.
    #[error(
        "sheet {sheet} meets sheet {other}: after point {point} and after point {other_point}; sheets neither cross nor branch"
    )]
    CrossesSheet {
        /// The sheet.
        sheet: usize,
        /// Its point before the crossing.
        point: usize,
        /// The other sheet.
        other: usize,
        /// Its point before the crossing.
        other_point: usize,
    },
    /// The wrong number of sheets.
    #[error(
        "has {}, but {expected} after the previous shape; allowed: that number, or `split` and `merge` for the difference",
        counted(*.found, "sheet"), expected = are_expected(*.expected)
    )]
    Unmatched {
        /// Number of sheets drawn.
        found: usize,
        /// Number of sheets after the splits and merges of the previous shape.
        expected: usize,
    },
    /// The wrong number of sheets in drawing order.
    #[error(
        "has {}, but with `correspondence = \"drawing_order\"` each of the {} of the previous shape must be drawn again as one stroke: \
         a splitting sheet includes its gap, and merging sheets are drawn separately; allowed: {expected}, or `correspondence = \"automatic\"`, where splits and merges \
         change the number",
        counted(*.found, "sheet"), counted(*.expected, "sheet")
    )]
    UnmatchedInOrder {
        /// Number of sheets drawn.
        found: usize,
        /// Number of sheets of the previous shape.
        expected: usize,
    },
    /// Too many sheets.
    #[error("has {}; allowed: up to {max}", counted(*.found, "sheet"))]
    TooManySheets {
        /// Number of sheets drawn.
        found: usize,
        /// Maximum number.
        max: usize,
    },
    /// Too many control points.
    #[error(
        "all shapes up to this one have {found} control points together; allowed: up to {max} (fewer shapes or sheets, or a lower `control_points`)"
    )]
    TooManyPoints {
        /// Control points of all shapes so far.
        found: usize,
        /// Maximum number.
        max: usize,
    },
    /// A split, merge or link of the first shape, which has no previous one.
    #[error(
        "the first shape has no previous one; `split`, `merge` and `link` belong to the shape at the end of the transition"
    )]
    ChangeBeforeFirstShape,
    /// A sheet that the previous shape does not have.
    #[error("there is no sheet {sheet} in the previous shape; allowed: 1 to {count}")]
    NoSuchSheet {
        /// The requested sheet.
        sheet: i64,
        /// Number of sheets.
        count: usize,
    },
    /// A link to a sheet that the shape does not have.
    #[error("there is no sheet {sheet} in this shape; allowed: 1 to {count}")]
    NoSuchTarget {
        /// The requested sheet.
        sheet: i64,
        /// Number of sheets.
        count: usize,
    },
    /// A segment that the sheet does not have.
    #[error("sheet {sheet} has no segment {segment}; allowed: 1 to {count}")]
    NoSuchSegment {
        /// The sheet.
        sheet: usize,
        /// The requested segment.
        segment: i64,
        /// Number of segments.
        count: usize,
    },
    /// A split at both a segment and a fraction of the length.
    #[error("has both `segment` and `length_fraction`; allowed: one of them")]
    SegmentAndPosition,
    /// Two splits of one segment.
    #[error("segment {segment} of sheet {sheet} is split already; allowed: one split per segment")]
    SplitTwice {
        /// The sheet.
        sheet: usize,
        /// The segment.
        segment: usize,
    },
    /// A merge of a point within a sheet.
    #[error(
        "the point at {length_fraction} of sheet {sheet} is not an end, and sheets never branch; allowed: 0 (its start) or 1 (its end)"
    )]
    NotAnEnd {
        /// The sheet.
        sheet: usize,
        /// Fraction of its length.
        length_fraction: f64,
    },
    /// Two merges of one end.
    #[error("the {} of sheet {sheet} is merged already; allowed: one merge per end", if *.is_end { "end" } else { "start" })]
    MergedTwice {
        /// The sheet.
        sheet: usize,
        /// Whether it is its end, else its start.
        is_end: bool,
    },
    /// Merges that close a sheet into a ring.
    #[error("this merge would close sheet {sheet} into a ring; allowed: sheets with two ends")]
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
    /// A link with a position of arrival, but without a point.
    #[error("`to_length_fraction` needs `from_length_fraction`")]
    ArrivalWithoutPoint,
    /// A link with a point of a sheet that does not split, but without its position of arrival.
    #[error("`from_length_fraction` needs `to_length_fraction`, unless the sheet splits there")]
    PointWithoutArrival,
    /// Linked points that exchange their order.
    #[error("two links of a sheet cross; allowed: points in the order of the sheet")]
    LinksCross,
    /// A link with correspondence by drawing order.
    #[error("links have no effect in drawing order; allowed: with `correspondence = \"automatic\"`")]
    LinkInOrder,
    /// A sheet with more than one of points, SVG file and form.
    #[error("sheet {sheet} has more than one of `points`, `svg_file` and `form`; allowed: one of them")]
    SeveralSources {
        /// The sheet.
        sheet: usize,
    },
    /// An SVG path without an SVG file.
    #[error("names a path of an SVG file, but no file; allowed: together with `svg_file`")]
    StrokeWithoutFile,
    /// A transition time in both seconds and frames.
    #[error("has both `transition_s` and `transition_frames`; allowed: one of them")]
    SecondsAndFrames,
    /// A transition time of the first shape.
    #[error("the first shape has no transition; allowed: in later shapes (`hold_s` sets how long the first is held)")]
    TimeBeforeFirstShape,
    /// Electrons of an energy outside the tables.
    #[error(
        "at {length_fraction} of its length, sheet {sheet} has electrons of {energy_ev:.0} eV (`energy_ev` times the factor here); allowed: 100 to 100000 eV"
    )]
    EnergyOutside {
        /// The entry of the shape's list of sheets.
        sheet: usize,
        /// Fraction of its length.
        length_fraction: f64,
        /// The energy, eV.
        energy_ev: f64,
    },
    /// More pairs of neighboring particles than memory and time allow.
    #[error(
        "each of {count} particles would have about {neighbors:.0} neighbors; allowed: about {max:.0} for so many particles (a smaller value, or a \
         smaller `count`)"
    )]
    TooManyNeighbors {
        /// Number of particles.
        count: i64,
        /// Estimated mean number of neighbors.
        neighbors: f64,
        /// Maximum number of neighbors.
        max: f64,
    },
    /// The thesis's color table with more lines than it has.
    #[error(
        "table 2.1 has the five lines of the thesis only; allowed: `\"cie_1931\"`, or `energy_deposition = \"hard_sphere\"`, which emits these five"
    )]
    LinesOutsideTable21,
    /// Single photons are drawn by the rules of the thesis, which are those of its hard spheres.
    #[error(
        "single photons are drawn by the rules of the thesis; allowed: `\"single_collisions\"`, or `energy_deposition = \"hard_sphere\"`"
    )]
    PhotonsWithoutSpheres,
    /// Single photons by the rules of the thesis, which has no sunlight.
    #[error(
        "the rules of the thesis for single photons have no sunlight; allowed: `sampling = \"single_collisions\"`, or no `sunlit_above_km`"
    )]
    PhotonsInSunlight,
    /// A loop whose length is not a positive number.
    #[error("a loop of {seconds} s is too short; allowed: more than 0 s")]
    LoopLength {
        /// Requested length, s.
        seconds: f64,
    },
    /// An animated value that differs between the start and the end of the loop.
    #[error(
        "the loop of {seconds} s is not seamless: the value differs between its beginning and its end; allowed: the same value at 0 s and at {seconds} s"
    )]
    LoopJumps {
        /// Length of the loop, s.
        seconds: f64,
    },
    /// An asset that cannot be loaded.
    #[error("{0}")]
    Asset(#[from] AssetError),
}

/// "n are expected" with the verb in agreement.
fn are_expected(count: usize) -> String {
    if count == 1 { "1 is expected".to_owned() } else { format!("{count} are expected") }
}
