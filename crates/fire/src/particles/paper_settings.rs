//! The particle flame to the letter of Inagaki et al.

use bansho_base::tables::{PaperSetting, PaperSettings};

/// Values of `[[flame_particles]]`.
pub(super) const PAPER: PaperSettings = PaperSettings {
    paper: "Inagaki et al.",
    settings: &[
        PaperSetting::new("gas_model", &["\"euler\""], "(1), section 4.3"),
        PaperSetting::new("fluid.pressure_kernel", &["\"poly6\""], "(12)"),
        PaperSetting::new("fluid.negative_pressure", &["\"allowed\""], "(11)"),
        PaperSetting::new("forces.wind_model", &["\"body_force\""], "(1), section 6"),
        PaperSetting::new("rendering.sprite", &["\"poly6\"", "\"squares\""], "section 5.2, or figure 7"),
        PaperSetting::new("rendering.detail", &["0"], "section 5.2"),
        PaperSetting::new("rendering.heat_haze_model", &["\"poly6\""], "section 5.3"),
    ],
    scene_settings: &[
        PaperSetting::new("picture.view", &["\"neutral\"", "\"raw\""], "displays bytes unchanged"),
        PaperSetting::new("camera.glare", &["0"], "has no glare"),
    ],
};
