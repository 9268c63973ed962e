//! The particle flame to the letter of Inagaki et al.

use bansho_base::tables::{PaperSetting, PaperSettings};

/// Values of `[[flame_particles]]`.
pub(super) const PAPER: PaperSettings = PaperSettings {
    paper: "Inagaki et al.",
    settings: &[
        PaperSetting::new("gas_model", &["\"euler\""], "eq. (1) and section 4.3"),
        PaperSetting::new("fluid.pressure_kernel", &["\"poly6\""], "eq. (12)"),
        PaperSetting::new("fluid.negative_pressure", &["\"allowed\""], "eq. (11)"),
        PaperSetting::new("forces.wind_model", &["\"body_force\""], "eq. (1) and section 6"),
        PaperSetting::new("rendering.sprite", &["\"poly6\"", "\"squares\""], "section 5.2 or figure 7"),
        PaperSetting::new("rendering.detail", &["0"], "section 5.2"),
        PaperSetting::new("rendering.heat_haze_model", &["\"poly6\""], "section 5.3"),
    ],
    scene_settings: &[
        PaperSetting::new("picture.view", &["\"neutral\"", "\"raw\""], "colors as they are"),
        PaperSetting::new("camera.glare", &["0"], "no glare"),
    ],
};
