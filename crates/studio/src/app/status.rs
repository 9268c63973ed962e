//! The status line.

use eframe::egui::{ProgressBar, Ui};

use super::files::Files;
use crate::{
    app::widgets::icon::{self, Icon},
    session::Session,
};

/// Shows the status line.
pub(super) fn status_ui(ui: &mut Ui, session: &mut Session, files: &mut Files) {
    ui.horizontal(|ui| {
        if session.is_busy() {
            ui.spinner();
        }
        if let Some((picture, _)) = session.picture() {
            let ([width, height], [whole_width, whole_height]) = (picture.size, picture.scene_size);
            let preview = if picture.size == picture.scene_size { "" } else { "preview " };
            ui.label(format!("{preview}{width} × {height} of {whole_width} × {whole_height}"));
            ui.weak(format!("{:.0} ms", 1000.0 * (picture.draw_s + picture.advance_s)));
            if picture.draft {
                ui.weak("draft").on_hover_text("Simulated with fewer particles than the scene has; see Draft above");
            }
            if !picture.exact && ui.link("live state").on_hover_text(LIVE_STATE_HELP).clicked() {
                session.redraw_exact();
            }
        }
        if let Some(rate) = session.frames_per_s() {
            ui.weak(format!("{rate:.0} pictures/s"));
        }
        if let Some([done, total]) = files.progress() {
            render_progress_ui(ui, files, done, total);
        }
        if session.has_panicked() && ui.button("Retry").on_hover_text(RETRY_HELP).clicked() {
            session.set_notice(None);
            session.retry();
        }
        if let Some(notice) = session.notice() {
            let notice = notice.to_owned();
            ui.colored_label(ui.visuals().warn_fg_color, &notice);
            if icon::button_ui(ui, Icon::Cross, "Dismiss").clicked() {
                session.set_notice(None);
            }
        }
    });
}

/// The progress of rendering, and a button to stop it.
fn render_progress_ui(ui: &mut Ui, files: &mut Files, done: usize, total: usize) {
    let text = if total == 0 { "rendering…".to_owned() } else { format!("rendering: {done} of {total}") };
    ui.label(text);
    let fraction = done as f32 / total.max(1) as f32;
    ui.add(ProgressBar::new(fraction).desired_width(90.0).desired_height(8.0));
    if icon::button_ui(ui, Icon::Cross, "Stop rendering").clicked() {
        files.stop_rendering();
    }
}

const LIVE_STATE_HELP: &str = "The simulation continued from its state when the scene changed. \
    Click to simulate the scene from its first frame, as it will be rendered.";

const RETRY_HELP: &str =
    "This frame panicked and is not drawn again automatically; other frames are. Click to draw it once more.";
