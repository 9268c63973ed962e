//! The flame sheet to the letter of Ohshima and Itahashi.

use bansho_base::tables::{PaperSetting, PaperSettings};

/// Values of `[[flame_sheet]]`. The curves V, H, C, R, G, B, A, D, F and P are free.
pub(super) const PAPER: PaperSettings = PaperSettings {
    paper: "Ohshima & Itahashi",
    settings: &[
        PaperSetting::new("method", &["\"texture\""], "section 3"),
        PaperSetting::new(
            "texture.kind",
            &["\"ohshima_itahashi_exact\"", "\"ohshima_itahashi\"", "\"picture\""],
            "eq. (20) or section 3.1",
        ),
        PaperSetting::new("texture.thinning", &["0"], "eq. (5)"),
        PaperSetting::new("color.kind", &["\"rgb_curves\""], "eq. (7)"),
        PaperSetting::new("color.base_blue", &["0"], "eq. (7)"),
        PaperSetting::new("color.glow", &["[[0, 1], [1, 1]]"], "eq. (7)"),
        PaperSetting::new("shape.convergence", &["1"], "eq. (16)"),
        PaperSetting::new("shape.eddies", &["0"], "eqs. (9) to (18)"),
        PaperSetting::new("shape.sway", &["0"], "eq. (10)"),
        PaperSetting::new("shape.flicker", &["0"], "eq. (9)"),
        PaperSetting::new("shape.fuel_outline", &["[[0, 0], [1, 0]]"], "eq. (4)"),
    ],
    scene_settings: &[
        PaperSetting::new("picture.view", &["\"neutral\"", "\"raw\""], "colors as they are"),
        PaperSetting::new("camera.glare", &["0"], "no glare"),
    ],
};
