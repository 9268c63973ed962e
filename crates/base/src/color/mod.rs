//! From spectra to color to display.
//!
//! 1. [`spectrum`]: a spectrum becomes CIE 1931 XYZ; [`blackbody`] tabulates black bodies.
//! 2. [`space`]: XYZ (D65) and linear sRGB enter the working space, ACEScg, by Bradford adaptation D65 -> D60, and leave it
//!    by the inverse. Emitted light is absolute: [`luminance`] is in cd/m^2. Negative components are colors outside AP1 and are kept.
//! 3. [`exposure`]: `exposed = luminance * exposure_scale(ev100)`, so that 1.0 is display white.
//! 4. [`View`]: exposed ACEScg to display pixels. First the camera's [`WhiteBalance`] if it has one, then the transform of the view: `display::camera_response` (the
//!    default), [`display::tone`] and [`display::gamut`] (only the views `neutral` and `standard`), or `display::agx`; then sRGB encoding ([`display::transfer`]),
//!    [`display::alpha`] and dither ([`display::quantize`]). `raw` only clamps. All other views are invertible on the whole sRGB cube
//!    ([`View::to_scene`]), so a plate in an empty scene is unchanged.
//! 5. [`LinearTransform`]: instead of the view, exposed ACEScg to half or single floats in a linear [`ColorSpace`], for programs that blend light.

pub mod blackbody;
pub mod display;
pub mod exposure;
pub mod pixel_formats;
pub mod space;
pub mod spectrum;
pub mod white_balance;

pub use blackbody::{BlackBody, black_body};
pub use display::{
    alpha::{AlphaConvention, AlphaMode},
    quantize::{BitDepth, DisplayCode},
    transfer::{VALUES_OF_CODES, decode_srgb, decode_srgb8, encode_srgb},
    view::{View, ViewName},
};
pub use exposure::{MAX_EV100, ev100_of_camera, ev100_of_white_luminance, exposure_scale, white_luminance};
pub use pixel_formats::{ColorSpace, LinearTransform};
pub use space::{
    ACESCG_FROM_SRGB, ACESCG_FROM_XYZ, LUMINANCE_WEIGHTS, Matrix3, SRGB_FROM_ACESCG, SRGB_FROM_XYZ, XYZ_FROM_ACESCG,
    XYZ_FROM_SRGB, acescg_from_srgb, acescg_from_xyz, luminance, srgb_from_acescg, xyz_from_acescg,
};
pub use spectrum::{LUMINOUS_EFFICACY_LM_PER_W, line_xyz, planck_radiance_per_nm, xyz_of_spectrum};
pub use white_balance::WhiteBalance;
