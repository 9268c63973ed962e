//! What a window shows, whoever paints it.

use eframe::{egui, wgpu::PollType};

/// Shown in a window until that closes.
pub trait Program {
    /// Shows one frame and takes in what hands did. `settle` waits until what was shown last is on the screen.
    fn show(&mut self, ui: &mut egui::Ui, settle: &mut dyn FnMut());

    /// The window closes.
    fn end(&mut self);
}

/// One that eframe runs, painted by a GPU.
pub struct ByGpu(pub Box<dyn Program>);

impl eframe::App for ByGpu {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let mut settle = || {
            if let Some(state) = frame.wgpu_render_state() {
                // A lost device is told where it is used next.
                let _ = state.device.poll(PollType::wait_indefinitely());
            }
        };
        self.0.show(ui, &mut settle);
    }

    fn on_exit(&mut self) {
        self.0.end();
    }
}
