//! `bansho plot`: figures of what the models compute.
//!
//! [`figure`] describes a figure as plain data; [`black_body`], [`kernel`], [`rain`], [`beam`], [`aurora`], [`parameters`], [`transfer_curves`], [`flame_shape`],
//! [`flame_statistics`] and [`metadata`] make one from the library's own functions. [`texture`] has pictures without axes. [`draw`] lays a figure out on a
//! [`canvas`], which writes SVG ([`svg`]) or pixels ([`raster`]); [`csv`] writes its table.

pub(crate) mod aurora;
pub(crate) mod beam;
pub(crate) mod black_body;
mod canvas;
pub(crate) mod csv;
pub(crate) mod draw;
pub(crate) mod figure;
pub(crate) mod flame_shape;
pub(crate) mod flame_statistics;
mod font;
pub(crate) mod kernel;
pub(crate) mod metadata;
pub(crate) mod parameters;
pub(crate) mod rain;
mod raster;
mod svg;
pub(crate) mod texture;
mod ticks;
pub(crate) mod transfer_curves;

use std::path::PathBuf;

use bansho::job::ErrorCategory;

/// Why a figure cannot be made as asked for.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PlotError {
    /// A range without numbers.
    #[error("{option}: {from} to {to} {unit} is an empty range; allowed: a start below its end")]
    EmptyRange {
        /// The option of its start.
        option: &'static str,
        from: f64,
        to: f64,
        unit: &'static str,
    },
    /// A cone that ends before it begins to.
    #[error(
        "--inner-cone-deg: {inner} degrees is wider than --outer-cone-deg ({outer}); allowed: up to --outer-cone-deg"
    )]
    Cones { inner: f64, outer: f64 },
    /// More rows than a table may have.
    #[error("{option}: the table would have {rows} rows; allowed: up to {most}")]
    Rows {
        /// The option that decides how many.
        option: &'static str,
        rows: f64,
        most: f64,
    },
    /// The name of the output is not that of a format.
    #[error("{}: the extension selects the format; allowed: .svg, .png or .csv, or `-` for CSV on standard output", path.display())]
    Extension { path: PathBuf },
    /// The name of a texture is not that of a PNG.
    #[error("{}: a picture without axes is a PNG; allowed: .png", path.display())]
    TextureExtension { path: PathBuf },
    /// A figure with more panels than a picture has room for.
    #[error("{}: {panels} panels do not fit into a PNG; allowed: fewer, or .svg", path.display())]
    Panels { path: PathBuf, panels: usize },
    /// A scene without a phenomenon that has such curves.
    #[error("{scene}: has no {kind}; allowed: a scene with one")]
    NoPhenomenon { scene: String, kind: &'static str },
    /// A scene in which no hot gas refracts light.
    #[error(
        "{scene}: frame {frame} has no gas that refracts light; allowed: a scene of flame_particles whose `rendering.heat_haze_gain` is above 0"
    )]
    NoDeflection { scene: String, frame: i64 },
    /// Frames without a lit pixel.
    #[error(
        "{scene}: none of {frames} frames has a lit pixel; allowed: a scene with a flame, whose `exposure_ev100` shows it"
    )]
    NoFlame { scene: String, frames: usize },
    /// A scene in which no phenomenon has that name.
    #[error("--name: {scene} has no {kind} `{name}`{hint}; allowed: {allowed}")]
    NoSuchName { scene: String, kind: &'static str, name: String, hint: String, allowed: String },
    /// A file that is not what `render --metadata` writes.
    #[error("{}: {problem}; allowed: a JSON file that `bansho render --metadata` wrote", path.display())]
    NotMetadata { path: PathBuf, problem: String },
    /// Metadata without a number.
    #[error("{}: none of these files states a number of a phenomenon; allowed: metadata of a scene whose phenomena report some", path.display())]
    NoNumbers { path: PathBuf },
}

impl PlotError {
    /// Whose fault it is, for exit codes.
    pub(crate) fn category(&self) -> ErrorCategory {
        match self {
            Self::NoPhenomenon { .. } | Self::NoDeflection { .. } | Self::NoFlame { .. } => ErrorCategory::Scene,
            Self::NotMetadata { .. } | Self::NoNumbers { .. } => ErrorCategory::Work,
            _ => ErrorCategory::Usage,
        }
    }
}

/// A hint at the name that was probably meant.
fn did_you_mean(name: &Option<String>) -> String {
    name.as_ref().map(|name| format!(", did you mean `{name}`?")).unwrap_or_default()
}
