//! Rain to the letter of Yoshida, Dobashi and Yamamoto.

use bansho_base::tables::{PaperSetting, PaperSettings};

/// Values of `[[rain]]`.
pub(crate) const PAPER: PaperSettings = PaperSettings {
    paper: "Yoshida, Dobashi & Yamamoto",
    settings: &[
        PaperSetting::new("method", &["\"textures\""], "section 5.1"),
        PaperSetting::new("texture_rates_mm_per_h", &["[1, 5, 10, 20]"], "section 6"),
        PaperSetting::new("diameters_mm", &["[1.0, 1.2, 1.4, 1.6, 1.8, 2.0]"], "section 6"),
        PaperSetting::new("terminal_velocity", &["\"rigid_sphere\""], "eqs. (2) to (4)"),
        PaperSetting::new("opacity", &["\"paper\""], "section 4"),
        PaperSetting::new("distance", &["5"], "section 6"),
        PaperSetting::new("culling", &["true"], "section 5.2"),
    ],
    scene_settings: &[
        PaperSetting::new("picture.view", &["\"neutral\"", "\"raw\""], "colors as they are"),
        PaperSetting::new("camera.glare", &["0"], "no glare"),
        PaperSetting::new("camera.shutter_s", &["0.0333"], "1/30 s, as in section 4"),
    ],
};
