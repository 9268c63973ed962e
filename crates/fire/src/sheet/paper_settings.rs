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
            "(20), or a table of values by section 3.1",
        ),
        PaperSetting::new("texture.thinning", &["0"], "(5)"),
        PaperSetting::new("color.kind", &["\"rgb_curves\""], "(7)"),
        PaperSetting::new("color.base_blue", &["0"], "(7)"),
        PaperSetting::new("color.glow", &["[[0, 1], [1, 1]]"], "(7)"),
        PaperSetting::new("shape.convergence", &["1"], "(16)"),
        PaperSetting::new("shape.eddies", &["0"], "(9) to (18)"),
        PaperSetting::new("shape.sway", &["0"], "(10)"),
        PaperSetting::new("shape.flicker", &["0"], "(9)"),
        PaperSetting::new("shape.fuel_outline", &["[[0, 0], [1, 0]]"], "(4)"),
    ],
    scene_settings: &[
        PaperSetting::new("picture.view", &["\"neutral\"", "\"raw\""], "displays colors as they are"),
        PaperSetting::new("camera.glare", &["0"], "has no glare"),
    ],
};
