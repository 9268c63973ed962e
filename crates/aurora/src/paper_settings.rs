//! The aurora to the letter of Sekiguchi's thesis.

use bansho_base::tables::{PaperSetting, PaperSettings};

/// Values of `[[aurora]]`.
pub(crate) const PAPER: PaperSettings = PaperSettings {
    paper: "Sekiguchi",
    settings: &[
        PaperSetting::new("morphing.correspondence", &["\"drawing_order\""], "section 2.2.1"),
        PaperSetting::new("morphing.control_point_spacing", &["\"recorded\""], "eq. (2.1)"),
        PaperSetting::new("morphing.gap_light", &["\"full\""], "section 2.2.1"),
        PaperSetting::new("field.solver", &["\"gauss_seidel\""], "eq. (2.6)"),
        PaperSetting::new("field.cells", &["256"], "table 3.2"),
        PaperSetting::new("field.charge", &["\"uniform\""], "eq. (2.2)"),
        PaperSetting::new("particles.smoothing_length_cells", &["1"], "section 2.5.1"),
        PaperSetting::new("particles.neighbor_search", &["\"three_by_three_cells\""], "section 2.5.1"),
        PaperSetting::new("particles.friction_per_s", &["0"], "eq. (2.19)"),
        PaperSetting::new("particles.fade_s", &["0"], "section 2.3.4"),
        PaperSetting::new("particles.power_distribution", &["\"equal\"", "\"equal_share\""], "section 2.4.2"),
        PaperSetting::new("particles.relocation.scale_counts", &["false"], "table 3.3"),
        PaperSetting::new("rays.contrast", &["0"], "section 2.3.2"),
        PaperSetting::new("folds.amplitude_km", &["0"], "section 2.2.1"),
        PaperSetting::new("swirls.displacement_km", &["0"], "section 2.2.1"),
        PaperSetting::new("diffuse.fraction", &["0"], "section 2.2.3"),
        PaperSetting::new("energy_ev", &["10000"], "section 2.4.1"),
        PaperSetting::new("spectrum", &["\"monoenergetic\""], "section 2.4.1"),
        PaperSetting::new("afterglow", &["false"], "section 2.4.2"),
        PaperSetting::new("dip_deg", &["90"], "section 2.2"),
        PaperSetting::new("rendering.sampling", &["\"single_photons\""], "sections 2.4.1 and 2.4.2"),
        PaperSetting::new("rendering.energy_deposition", &["\"hard_sphere\""], "eq. (2.22)"),
        PaperSetting::new("rendering.color_matching", &["\"table_2_1\""], "table 2.1"),
        PaperSetting::new("rendering.blur_space", &["\"screen\""], "eq. (2.28)"),
    ],
    scene_settings: &[
        PaperSetting::new("picture.view", &["\"neutral\"", "\"raw\""], "colors as they are"),
        PaperSetting::new("picture.white_balance_k", &["6504"], "white of sRGB, eq. (2.30)"),
        PaperSetting::new("camera.glare", &["0"], "no glare"),
    ],
};
