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
fn even() -> Curve {
    Curve::new(vec![[0.0, 1.0]], Interpolation::Monotone).expect("one finite point is a curve")
}

bansho_base::choice! {
    /// Which point of a shape becomes which of the next.
    pub enum Correspondence {
        /// By place: sheets pair so that all move least, and points along them by length and nearness, whichever way they were drawn. The drawing shows the sheets after their splits and merges.
        Automatic = "automatic",
        /// As in the thesis: the first sheet drawn becomes the first, its first point the first. The drawing shows the sheets just before they split and after they were joined up: as many as the shape before.
        DrawingOrder = "drawing_order",
    }
}

bansho_base::choice! {
    /// How control points lie on a stroke.
    pub enum Spacing {
        /// At equal distances.
        ArcLength = "arc_length",
        /// Evenly over the recorded points, eq. (2.1): close together where the hand was slow.
        Recorded = "recorded",
    }
}

bansho_base::parameters! {
    /// One sheet of the aurora, seen from above, x east and z south of the point under the observer's zenith: a stroke (`points`), the paths of an SVG file (`svg_file`), or a named form.
    pub struct SheetParameters {
        /// Points [east, south] of the stroke.
        points: Option<Vec<[f64; 2]>> = None, limits(Length { min: 0, max: 100_000, item: KM }), unit("km");
        /// An SVG file whose paths are the strokes. Its view box is fitted to the drawn square.
        svg_file: Option<AssetPath> = None;
        /// The id of the one path of the SVG file that is meant; all of them where it is not given.
        svg_path_id: Option<String> = None;
        /// A named form; an arc where neither `points` nor `svg_file` is given.
        form: Option<Form> = None;
        /// Length of the form along the sheet; `"auto"` is 0.6 of the drawn square.
        length_km: Auto<f64> = Auto::Auto, limits(Range::new(1.0, 20_000.0)), unit("km");
        /// How far the form bends; `"auto"` is what looks like its name.
        bend_deg: Auto<f64> = Auto::Auto, limits(Range::new(-1440.0, 1440.0)), unit("degrees");
        /// How many waves or folds the form has; `"auto"` is what looks like its name.
        wave_count: Auto<i64> = Auto::Auto, limits(Range::new(1.0, 40.0));
        /// How many such sheets lie side by side.
        copies: i64 = 1, limits(Range::new(1.0, 32.0));
        /// How far apart they lie, toward the south.
        spacing_km: f64 = 60.0, limits(Range::new(-2000.0, 2000.0)), unit("km");
        /// Where the origin of points and drawing, or the middle of a form, comes to lie: [east, south].
        position_km: [f64; 2] = [0.0, 0.0], limits(KM), unit("km");
        /// Turn from east toward south.
        rotation_deg: f64 = 0.0, limits(DEGREES), unit("degrees");
        /// Size beside that given.
        scale: f64 = 1.0, limits(Range::new(0.001, 1000.0));
        /// Exchanges north and south before it is turned.
        mirror: bool = false;
        /// Draws a smooth line through the points of a sketch; strokes of 256 points and more are taken as they are.
        smooth: bool = true;
        /// Flux along the sheet as a factor of the aurora's, over the share of its length.
        flux_factor: Curve = even(), limits(CurveLimits::unit_to(0.0, 100.0));
        /// Share of the sheet's length over which its flux rises from nothing, at both ends; 0 lets it begin at once, as in the thesis.
        end_taper: f64 = 0.3, limits(Range::new(0.0, 0.5));
        /// Energy along the sheet as a factor of the aurora's, over the share of its length.
        energy_factor: Curve = even(), limits(CurveLimits::unit_to(0.05, 20.0));
    }
}

bansho_base::parameters! {
    /// A sheet of the shape before that splits on the way to this one.
    pub struct SplitParameters {
        /// The sheet, counted from 1.
        sheet: i64 = 1, limits(Range::new(1.0, 1000.0));
        /// The segment between two control points that opens, counted from 1.
        segment: Option<i64> = None, limits(Range::new(1.0, 100_000.0));
        /// Or the share of the sheet's length where it opens; the middle where neither is given.
        length_fraction: Option<f64> = None, limits(Range::new(0.0, 1.0));
    }
}

bansho_base::parameters! {
    /// Two ends of sheets of the shape before that grow together on the way to this one.
    pub struct MergeParameters {
        /// The two sheets, counted from 1.
        sheets: [i64; 2] = [1, 2], limits(Range::new(1.0, 1000.0));
        /// Which end of each: 0 its start, 1 its end; `"auto"` takes the two that are nearest to each other.
        ends: Auto<[f64; 2]> = Auto::Auto, limits(Range::new(0.0, 1.0));
    }
}

bansho_base::parameters! {
    /// A sheet of the shape before that becomes the sheet told, where it would become another by place; or a point on it that arrives where told.
    pub struct LinkParameters {
        /// The sheet of the shape before, counted from 1.
        from: i64 = 1, limits(Range::new(1.0, 1000.0));
        /// The sheet of this shape that it becomes, counted from 1.
        to: i64 = 1, limits(Range::new(1.0, 1000.0));
        /// Share of the first one's length at which a point leaves; where that sheet splits, the part that is meant.
        from_length_fraction: Option<f64> = None, limits(Range::new(0.0, 1.0));
        /// Share of the second one's length at which that point arrives; the whole sheet is linked where it is not given. Ends of sheets go to ends.
        to_length_fraction: Option<f64> = None, limits(Range::new(0.0, 1.0));
    }
}

bansho_base::parameters! {
    /// The aurora's shape at a moment: its sheets, and what splits or merges on the way there.
    pub struct ShapeParameters {
        /// Time since the shape before was left; 4.667 s (140 frames of the thesis) where nothing is said. The first shape is there at the beginning.
        transition_s: Option<f64> = None, limits(Range::new(0.01, 1e5)), unit("s");
        /// The same in frames of 1/30 s.
        transition_frames: Option<f64> = None, limits(Range::new(1.0, 1e6));
        /// How long it stays as it is.
        hold_s: f64 = 0.0, limits(Range::new(0.0, 1e5)), unit("s");
        /// Its sheets; one arc where the list is empty.
        sheets: Vec<SheetParameters> = Vec::new(), limits(Length { min: 0, max: 64, item: () });
        /// Sheets of the shape before that split on the way.
        split: Vec<SplitParameters> = Vec::new(), limits(Length { min: 0, max: 64, item: () });
        /// Ends of sheets of the shape before that merge on the way.
        merge: Vec<MergeParameters> = Vec::new(), limits(Length { min: 0, max: 64, item: () });
        /// Sheets of the shape before, and points on them, that go where told rather than by place.
        link: Vec<LinkParameters> = Vec::new(), limits(Length { min: 0, max: 256, item: () });
    }
}

bansho_base::parameters! {
    /// How one shape becomes the next.
    pub struct MorphingParameters {
        /// Which point becomes which.
        correspondence: Correspondence = Correspondence::Automatic;
        /// Control points n of a sheet. `"auto"` is 32 in drawing order, as in the thesis, and 96 by place, so that folds that grow stay round.
        control_points: Auto<i64> = Auto::Auto, limits(Range::new(4.0, 512.0));
        /// How they lie on a drawn stroke.
        control_point_spacing: Spacing = Spacing::ArcLength;
        /// Frames of 1/30 s from one in-between shape to the next; the thesis takes 5 to 10.
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
    let curtain = |stroke: &[[f64; 2]; 8]| SheetParameters {
        points: Some(stroke.iter().map(|point| point.map(|km| km * scale)).collect()),
        ..SheetParameters::default()
    };
    let shape = |strokes: &[[[f64; 2]; 8]; 2]| ShapeParameters {
        transition_s: Some(20.0),
        sheets: strokes.iter().map(curtain).collect(),
        ..ShapeParameters::default()
    };
    vec![ShapeParameters { transition_s: None, ..shape(&DEFAULT_FIRST) }, shape(&DEFAULT_SECOND), shape(&DEFAULT_FIRST)]
}
