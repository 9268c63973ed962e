//! The application that a window runs.

/// An application, as `eframe::App` is one, that a [`window`](crate::window) runs until it closes.
pub trait App {
    /// Builds the user interface of one frame. `wait_until_presented` blocks until the previous frame is on the screen.
    fn ui(&mut self, ui: &mut egui::Ui, wait_until_presented: &mut dyn FnMut());

    /// Called once when the window closes.
    fn on_exit(&mut self);
}
