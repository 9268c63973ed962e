//! The kinds of the tables that are fields of a scene, for the registry of a program.

use super::picture::{PictureParameters, PlateParameters};
use bansho_base::{
    camera::CameraParameters,
    parameters::Parameters,
    tables::{TableCount, TableKind},
    world::{air::Air, wind::WindParameters},
};

/// Name of the layer of the plate.
pub const PLATE_LAYER: &str = "plate";

/// Name of the layer of the camera's glare.
pub const GLARE_LAYER: &str = "glare";

/// `[picture]`.
pub const PICTURE: TableKind = TableKind {
    first_keys: &["size", "frames", "fps"],
    ..TableKind::field("picture", TableCount::One, PictureParameters::table)
};

/// `[camera]`.
pub const CAMERA: TableKind = TableKind {
    first_keys: &["position", "target", "vertical_fov_deg"],
    layer: Some(GLARE_LAYER),
    ..TableKind::field("camera", TableCount::One, CameraParameters::table)
};

/// `[plate]`.
pub const PLATE: TableKind =
    TableKind { layer: Some(PLATE_LAYER), ..TableKind::field("plate", TableCount::Optional, PlateParameters::table) };

/// `[wind]`.
pub const WIND: TableKind =
    TableKind { first_keys: &["velocity", "gust"], ..TableKind::field("wind", TableCount::One, WindParameters::table) };

/// `[air]`.
pub const AIR: TableKind = TableKind::field("air", TableCount::One, Air::table);
