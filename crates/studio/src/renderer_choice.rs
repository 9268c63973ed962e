//! The renderer of the window: eframe with a GPU if there is one, else the software rasterizer, which is much faster than a software
//! Vulkan driver.

use bansho_egui_software::{
    App,
    window::{self, AppCreator, WindowError},
};
use eframe::{
    egui::{self, ViewportBuilder},
    wgpu::PollType,
};

/// The renderer of the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RendererChoice {
    /// A GPU if there is one.
    #[default]
    Auto,
    /// By eframe, with any driver of a GPU that there is.
    Gpu,
    /// By the software rasterizer.
    Software,
}

impl RendererChoice {
    /// The names that [`named`](Self::named) knows.
    pub const NAMES: &str = "auto, gpu, software";

    /// The renderer called `name`.
    ///
    /// # Errors
    /// There is none; the error is a message.
    pub fn named(name: &str) -> Result<Self, String> {
        match name {
            "auto" => Ok(Self::Auto),
            "gpu" => Ok(Self::Gpu),
            "software" => Ok(Self::Software),
            _ => Err(format!("error: --painter is one of {}, not `{name}`", Self::NAMES)),
        }
    }

    /// Runs the application that `build` creates in a window until it closes.
    ///
    /// # Errors
    /// The window cannot be opened, or the application cannot be created.
    pub fn show(self, viewport: ViewportBuilder, build: AppCreator) -> Result<(), Box<dyn std::error::Error>> {
        match self {
            // Only eframe's window supports screen readers.
            Self::Auto if cfg!(feature = "accessibility") || has_gpu() => run_with_gpu(viewport, build),
            Self::Gpu => run_with_gpu(viewport, build),
            Self::Auto | Self::Software => Ok(window::run(viewport, build).map_err(with_hint)?),
        }
    }
}

/// Whether any adapter is not a CPU.
fn has_gpu() -> bool {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    adapters.iter().any(|adapter| adapter.get_info().device_type != wgpu::DeviceType::Cpu)
}

fn run_with_gpu(viewport: ViewportBuilder, build: AppCreator) -> Result<(), Box<dyn std::error::Error>> {
    // Dithering would add noise to the picture.
    let options = eframe::NativeOptions { viewport, dithering: false, ..eframe::NativeOptions::default() };
    let title = options.viewport.title.clone().unwrap_or_default();
    let ended = eframe::run_native(
        &title,
        options,
        Box::new(|creation| {
            let app = build(&creation.egui_ctx)?;
            Ok(Box::new(GpuApp(app)))
        }),
    );
    Ok(ended.map_err(|error| format!("{error}; `--painter software` needs no GPU"))?)
}

/// The error, and what to do where there is no display.
fn with_hint(error: WindowError) -> Box<dyn std::error::Error> {
    match error {
        WindowError::Events(_) => {
            format!("{error}; start the studio from a desktop session, or draw without a window: bansho render SCENE")
                .into()
        }
        _ => error.into(),
    }
}

/// An application that eframe runs, painted by a GPU.
struct GpuApp(Box<dyn App>);

impl eframe::App for GpuApp {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        self.0.ui(ui, &mut || {
            if let Some(state) = frame.wgpu_render_state() {
                // A lost device is reported at its next use.
                let _ = state.device.poll(PollType::wait_indefinitely());
            }
        });
    }

    fn on_exit(&mut self) {
        self.0.on_exit();
    }
}
