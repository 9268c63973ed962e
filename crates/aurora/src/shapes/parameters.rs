//! Parameters of the shapes, and the default shapes.

use bansho_base::{
    math::curve::{Curve, Interpolation},
    parameters::{AssetPath, Auto, CurveLimits, Length, Range},
};

use super::form::Form;

/// Frame duration of the thesis, s (table 3.2: 0.0333 s); parameters in `_frames` are in this unit.
pub const FRAME_S: f64 = 1.0 / 30.0;

/// Frames from shape to shape (table 3.2).
const TRANSITION_FRAMES: f64 = 140.0;

/// Time from shape to shape unless a shape says otherwise, s.
pub(super) const TRANSITION_S: f64 = TRANSITION_FRAMES * FRAME_S;

const KM: Range = Range::new(-20_000.0, 20_000.0);
const DEGREES: Range = Range::new(-3600.0, 3600.0);

/// A constant factor of 1.
fn unit_curve() -> Curve {
    Curve::new(vec![[0.0, 1.0]], Interpolation::Monotone).expect("one finite point is a curve")
}

bansho_base::choice! {
    /// Which sheet and which control point of a shape becomes which of the next.
    pub enum Correspondence {
        /// By position: sheets are matched with the minimum total motion, points along them by arc length and distance, whatever their drawing
        /// direction. Sheets that split or merge are drawn as they are afterward.
        Automatic = "automatic",
        /// As in the thesis: the first sheet becomes the first, its first point the first. A shape has as many sheets as the one before: a sheet that
        /// splits is drawn just before it splits, and sheets that merge are drawn separately.
        DrawingOrder = "drawing_order",
    }
}

bansho_base::choice! {
    /// Spacing of the control points along a stroke.
    pub enum Spacing {
        /// Equal arc lengths.
        ArcLength = "arc_length",
        /// Uniform over the recorded points, eq. (2.1) with i (m - 1) / (n - 1): closer together where the stroke was drawn slowly.
        Recorded = "recorded",
        /// Eq. (2.1) as it is printed, with i m / n: the last of n control points is a part 1 / n of the recorded points before the end of the stroke.
        AsPrinted = "as_printed",
    }
}

bansho_base::parameters! {
    /// One sheet of the aurora, seen from above, x east and z south of the observer's zenith: a stroke (`points`), the paths of an SVG file
    /// (`svg_file`), or a named form.
    pub struct SheetParameters {
        /// Points [east, south] of the stroke.
        points: Option<Vec<[f64; 2]>> = None, limits(Length { min: 0, max: 100_000, item: KM }), unit("km");
        /// An SVG file whose paths are the strokes. Its view box is fitted to the drawn square.
        svg_file: Option<AssetPath> = None;
        /// Id of the path of the SVG file; all of its paths if it is not given.
        svg_path_id: Option<String> = None;
        /// A named form; an arc if neither `points` nor `svg_file` is given.
        form: Option<Form> = None;
        /// Length of the form along the sheet; `"auto"` is 0.6 of the drawn square.
        length_km: Auto<f64> = Auto::Auto, limits(Range::new(1.0, 20_000.0)), unit("km");
        /// Bend of the form; `"auto"` is the value that is typical of the form.
        bend_deg: Auto<f64> = Auto::Auto, limits(Range::new(-1440.0, 1440.0)), unit("degrees");
        /// Number of waves or folds of the form; `"auto"` is the value that is typical of the form.
        wave_count: Auto<i64> = Auto::Auto, limits(Range::new(1.0, 40.0));
        /// Number of parallel copies of the sheet.
        copies: i64 = 1, limits(Range::new(1.0, 32.0));
        /// Distance between the copies, toward the south.
        spacing_km: f64 = 60.0, limits(Range::new(-2000.0, 2000.0)), unit("km");
        /// Position of the origin of points and drawings, or of the center of a form: [east, south].
        position_km: [f64; 2] = [0.0, 0.0], limits(KM), unit("km");
        /// Rotation from east toward south.
        rotation_deg: f64 = 0.0, limits(DEGREES), unit("degrees");
        /// Scale factor.
        scale: f64 = 1.0, limits(Range::new(0.001, 1000.0));
        /// Exchanges north and south before the rotation.
        mirror: bool = false;
        /// Draws a smooth line through the points of a sketch; strokes of 256 points or more are used unchanged.
        smooth: bool = true;
        /// Factor of the aurora's flux along the sheet, by fraction of its length.
        flux_factor: Curve = unit_curve(), limits(CurveLimits::unit_to(0.0, 100.0));
        /// Fraction of the sheet's length over which its flux rises from 0, at both ends; at 0 the flux begins at once, as in the thesis.
        end_taper: f64 = 0.3, limits(Range::new(0.0, 0.5));
        /// Factor of the aurora's energy along the sheet, by fraction of its length.
        energy_factor: Curve = unit_curve(), limits(CurveLimits::unit_to(0.05, 20.0));
    }
}

bansho_base::parameters! {
    /// A sheet of the previous shape that splits in the transition to this one.
    pub struct SplitParameters {
        /// The sheet, counted from 1.
        sheet: i64 = 1, limits(Range::new(1.0, 1000.0));
        /// The segment between two control points at which the sheet opens, counted from 1.
        segment: Option<i64> = None, limits(Range::new(1.0, 100_000.0));
        /// Or the fraction of the sheet's length at which it opens; the middle if neither is given.
        length_fraction: Option<f64> = None, limits(Range::new(0.0, 1.0));
    }
    paper: segment;
}

bansho_base::parameters! {
    /// Two ends of sheets of the previous shape that merge in the transition to this one.
    pub struct MergeParameters {
        /// The two sheets, counted from 1.
        sheets: [i64; 2] = [1, 2], limits(Range::new(1.0, 1000.0));
        /// The end of each sheet: 0 for its start, 1 for its end; `"auto"` selects the nearest pair of ends.
        ends: Auto<[f64; 2]> = Auto::Auto, limits(Range::new(0.0, 1.0));
    }
}

bansho_base::parameters! {
    /// A sheet of the previous shape that becomes the given sheet instead of the one matched by position, or a point on it that arrives at the given
    /// position.
    pub struct LinkParameters {
        /// The sheet of the previous shape, counted from 1.
        from: i64 = 1, limits(Range::new(1.0, 1000.0));
        /// The sheet of this shape that it becomes, counted from 1.
        to: i64 = 1, limits(Range::new(1.0, 1000.0));
        /// Fraction of the first sheet's length at which the linked point starts; if that sheet splits, the point selects one of its strands.
        from_length_fraction: Option<f64> = None, limits(Range::new(0.0, 1.0));
        /// Fraction of the second sheet's length at which that point arrives; without it the whole sheet is linked. Ends of sheets always become
        /// ends.
        to_length_fraction: Option<f64> = None, limits(Range::new(0.0, 1.0));
    }
}

bansho_base::parameters! {
    /// A key shape of the aurora: its sheets, and their splits and merges in the transition from the previous shape.
    pub struct ShapeParameters {
        /// Duration of the transition from the previous shape; 4.667 s (140 frames of the thesis) by default. The first shape exists from the
        /// beginning.
        transition_s: Option<f64> = None, limits(Range::new(0.01, 1e5)), unit("s");
        /// The same in frames of 1/30 s.
        transition_frames: Option<f64> = None, limits(Range::new(1.0, 1e6));
        /// Time for which the shape is held.
        hold_s: f64 = 0.0, limits(Range::new(0.0, 1e5)), unit("s");
        /// Its sheets; one arc if the list is empty.
        sheets: Vec<SheetParameters> = Vec::new(), limits(Length { min: 0, max: 64, item: () });
        /// Sheets of the previous shape that split in the transition.
        split: Vec<SplitParameters> = Vec::new(), limits(Length { min: 0, max: 64, item: () });
        /// Ends of sheets of the previous shape that merge in the transition.
        merge: Vec<MergeParameters> = Vec::new(), limits(Length { min: 0, max: 64, item: () });
        /// Sheets of the previous shape, and points on them, with a given target instead of the one matched by position.
        link: Vec<LinkParameters> = Vec::new(), limits(Length { min: 0, max: 256, item: () });
    }
    paper: transition_frames;
}

bansho_base::choice! {
    /// Light at gaps between sheets that split or merge.
    pub enum GapLight {
        /// The flux fades toward a gap, and light bridges a narrow one, so that sheets come apart and together without hard ends.
        Faded = "faded",
        /// Sheets keep their flux up to the ends, as in the thesis: the gap is as wide as the control points are apart.
        Full = "full",
    }
}

bansho_base::parameters! {
    /// Transition from one shape to the next.
    pub struct MorphingParameters {
        /// Which sheet and which control point of a shape becomes which of the next.
        correspondence: Correspondence = Correspondence::Automatic;
        /// Number n of control points of a sheet. `"auto"` is 32 in drawing order, as in the thesis, and 96 with the automatic correspondence, so
        /// that growing folds stay round.
        control_points: Auto<i64> = Auto::Auto, limits(Range::new(4.0, 512.0));
        /// Spacing of the control points along a drawn stroke.
        control_point_spacing: Spacing = Spacing::ArcLength;
        /// Light at gaps that a split opens or a merge closes.
        gap_light: GapLight = GapLight::Faded;
        /// Frames of 1/30 s from one in-between shape to the next; 5 to 10 in the thesis.
        update_interval_frames: f64 = 6.0, limits(Range::new(1.0, 60.0));
    }
}

impl MorphingParameters {
    /// Control points n of a sheet.
    pub fn point_count(&self) -> usize {
        match (self.control_points, self.correspondence) {
            (Auto::Set(count), _) => count as usize,
            (Auto::Auto, Correspondence::DrawingOrder) => 32,
            (Auto::Auto, Correspondence::Automatic) => 96,
        }
    }
}

/// Side of the square of the default shapes, km.
const DRAWN_EXTENT_KM: f64 = 600.0;

/// Default strokes from west to east, [east, south] in km: two curtains in the north.
const DEFAULT_FIRST: [[[f64; 2]; 8]; 2] = [
    [
        [-290., -250.],
        [-180., -215.],
        [-90., -190.],
        [-20., -200.],
        [40., -225.],
        [110., -215.],
        [190., -180.],
        [290., -190.],
    ],
    [
        [-200., -120.],
        [-130., -95.],
        [-60., -88.],
        [-10., -105.],
        [50., -120.],
        [110., -105.],
        [160., -80.],
        [215., -85.],
    ],
];
/// The same curtains with their waves moved and deepened.
const DEFAULT_SECOND: [[[f64; 2]; 8]; 2] = [
    [
        [-290., -225.],
        [-190., -190.],
        [-110., -205.],
        [-40., -240.],
        [30., -225.],
        [100., -185.],
        [190., -200.],
        [290., -220.],
    ],
    [
        [-215., -95.],
        [-140., -85.],
        [-75., -110.],
        [-20., -125.],
        [45., -100.],
        [100., -80.],
        [155., -100.],
        [210., -115.],
    ],
];

/// Two slowly waving curtains, scaled to a square of that side.
pub(super) fn default_shapes(extent_km: f64) -> Vec<ShapeParameters> {
    let scale = extent_km / DRAWN_EXTENT_KM;
    let mut shapes = Vec::new();
    for (transition_s, strokes) in [(None, &DEFAULT_FIRST), (Some(20.0), &DEFAULT_SECOND), (Some(20.0), &DEFAULT_FIRST)]
    {
        let mut shape = ShapeParameters { transition_s, ..ShapeParameters::default() };
        for stroke in strokes {
            let points = stroke.iter().map(|point| point.map(|km| km * scale)).collect();
            shape.sheets.push(SheetParameters { points: Some(points), ..SheetParameters::default() });
        }
        shapes.push(shape);
    }
    shapes
}
