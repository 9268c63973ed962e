//! A native window and its event loop. It repaints only when egui or the system requests it.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use egui::{self, ViewportCommand, ViewportEvent, ViewportId, ViewportInfo};
use egui_winit::{ActionRequested, State};
use winit::{
    application::ApplicationHandler,
    error::{EventLoopError, OsError},
    event::{DeviceEvent, DeviceId, StartCause, WindowEvent},
    event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy},
    raw_window_handle::{HasDisplayHandle, RawDisplayHandle},
    window::{Window, WindowId},
};

use super::{Painter, surface::WindowSurface};

/// Shortest time between two frames.
const MIN_FRAME_INTERVAL: Duration = Duration::from_millis(8);

/// Largest texture side that is reported to egui, texels.
const MAX_TEXTURE_SIDE: usize = 8192;

/// An application, as `eframe::App` is one, that [`run`] runs until it closes.
pub trait App {
    /// Builds the user interface of one frame. `wait_until_presented` blocks until the previous frame is on the screen.
    fn ui(&mut self, ui: &mut egui::Ui, wait_until_presented: &mut dyn FnMut());

    /// Called once when the window closes.
    fn on_exit(&mut self);
}

/// Creates the application once the egui context can request repaints.
pub type AppCreator = Box<dyn FnOnce(&egui::Context) -> Result<Box<dyn App>, Box<dyn std::error::Error + Send + Sync>>>;

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// There is no display server.
    #[error("no window: {0}")]
    Events(#[from] EventLoopError),
    /// The system does not open a window.
    #[error("no window: {0}")]
    Open(#[from] OsError),
    /// The system offers no pixel buffer.
    #[error("the window cannot be painted: {0}")]
    WindowSurface(#[from] softbuffer::SoftBufferError),
    /// The application cannot be built.
    #[error(transparent)]
    App(#[from] Box<dyn std::error::Error + Send + Sync>),
}

/// Runs the application that `build` creates in a window, until it closes.
///
/// # Errors
/// No window can be opened, or the application cannot be built.
pub fn run(viewport: egui::ViewportBuilder, build: AppCreator) -> Result<(), WindowError> {
    let events = EventLoop::<RepaintRequest>::with_user_event().build()?;
    let ctx = egui::Context::default();
    ctx.set_embed_viewports(false);
    ctx.options_mut(|options| options.max_passes = std::num::NonZeroUsize::MIN.saturating_add(1));
    request_repaints_with(&ctx, events.create_proxy());
    let mut runner = Runner { ctx, viewport, build: Some(build), open: None, next_repaint: None, failed: None };
    events.run_app(&mut runner)?;
    runner.failed.map_or(Ok(()), Err)
}

/// A requested repaint.
#[derive(Debug)]
struct RepaintRequest {
    /// When it is due.
    at: Instant,
    /// Number of passes of egui at the request.
    pass_nr: u64,
}

fn request_repaints_with(ctx: &egui::Context, proxy: EventLoopProxy<RepaintRequest>) {
    let proxy = std::sync::Mutex::new(proxy);
    ctx.set_request_repaint_callback(move |info| {
        if info.viewport_id == ViewportId::ROOT
            && let Ok(proxy) = proxy.lock()
        {
            let at = Instant::now().checked_add(info.delay);
            // The event loop may have ended; a time beyond the range of `Instant` never comes.
            let _ = at.map(|at| proxy.send_event(RepaintRequest { at, pass_nr: info.current_cumulative_pass_nr }));
        }
    });
}

/// The state of the event loop.
struct Runner {
    ctx: egui::Context,
    viewport: egui::ViewportBuilder,
    build: Option<AppCreator>,
    open: Option<OpenWindow>,
    /// When the next frame is due.
    next_repaint: Option<Instant>,
    failed: Option<WindowError>,
}

/// The window while it is open.
struct OpenWindow {
    app: Box<dyn App>,
    window: Arc<Window>,
    state: State,
    info: ViewportInfo,
    painter: Painter,
    window_surface: WindowSurface,
    /// Pending requests to cut, copy and paste.
    actions: Vec<ActionRequested>,
    /// Start of the last frame.
    last: Instant,
    /// Whether nothing was painted yet.
    first: bool,
    /// Whether the system paces frames and keeps the content of the window, as Wayland does.
    vsync: bool,
}

impl Runner {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), WindowError> {
        let Some(build) = self.build.take() else { return Ok(()) };
        // Hidden until the first frame is painted.
        let mut viewport = self.viewport.clone().with_visible(false);
        viewport.inner_size = viewport.inner_size.map(|size| size.min(largest_monitor(events)));
        let window = Arc::new(egui_winit::create_window(&self.ctx, events, &viewport)?);
        let window_surface = WindowSurface::new(events.owned_display_handle(), window.clone())?;
        let scale = Some(window.scale_factor() as f32);
        let state = State::new(
            self.ctx.clone(),
            ViewportId::ROOT,
            events,
            scale,
            events.system_theme(),
            Some(MAX_TEXTURE_SIDE),
        );
        let mut info = ViewportInfo::default();
        egui_winit::update_viewport_info(&mut info, &self.ctx, &window, true);
        let app = build(&self.ctx)?;
        let vsync = events.display_handle().is_ok_and(|handle| matches!(handle.as_raw(), RawDisplayHandle::Wayland(_)));
        let last = Instant::now().checked_sub(MIN_FRAME_INTERVAL).unwrap_or_else(Instant::now);
        let (painter, actions) = (Painter::default(), Vec::new());
        self.open =
            Some(OpenWindow { app, window, state, info, painter, window_surface, actions, last, first: true, vsync });
        self.next_repaint = Some(Instant::now());
        Ok(())
    }

    fn schedule(&mut self, at: Instant) {
        self.next_repaint = Some(self.next_repaint.map_or(at, |next_repaint| next_repaint.min(at)));
    }

    /// Paints a frame if one is due, and sets the time to sleep until the next.
    fn paint_if_due(&mut self, events: &ActiveEventLoop) {
        let Some(open) = &mut self.open else { return };
        let soonest = open.last + MIN_FRAME_INTERVAL;
        if self.next_repaint.is_some_and(|next_repaint| next_repaint.max(soonest) <= Instant::now()) {
            self.next_repaint = None;
            if open.vsync && !open.first {
                open.window.request_redraw();
            } else {
                self.frame(events, false);
            }
        }
        let soonest = self.open.as_ref().map(|open| open.last + MIN_FRAME_INTERVAL);
        events.set_control_flow(match self.next_repaint {
            Some(next_repaint) => {
                ControlFlow::WaitUntil(soonest.map_or(next_repaint, |soonest| next_repaint.max(soonest)))
            }
            None => ControlFlow::Wait,
        });
    }

    /// Paints a frame. `content_lost` says whether the system has lost the content of the window.
    fn frame(&mut self, events: &ActiveEventLoop, content_lost: bool) {
        let Some(open) = &mut self.open else { return };
        match open.frame(&self.ctx, events, content_lost) {
            Ok(AfterFrame::Close) => self.close(events),
            Ok(AfterFrame::Repaint) => self.schedule(Instant::now()),
            Ok(AfterFrame::Sleep) => {}
            Err(error) => {
                self.failed = Some(error);
                self.close(events);
            }
        }
    }

    fn close(&mut self, events: &ActiveEventLoop) {
        if let Some(mut open) = self.open.take() {
            self.ctx.on_exit();
            open.app.on_exit();
        }
        events.exit();
    }
}

/// What to do after a frame.
enum AfterFrame {
    Sleep,
    Repaint,
    Close,
}

impl OpenWindow {
    fn frame(
        &mut self,
        ctx: &egui::Context,
        events: &ActiveEventLoop,
        content_lost: bool,
    ) -> Result<AfterFrame, WindowError> {
        self.last = Instant::now();
        egui_winit::update_viewport_info(&mut self.info, ctx, &self.window, false);
        let mut input = self.state.take_egui_input(&self.window);
        input.viewports.insert(ViewportId::ROOT, self.info.clone());
        let closing = input.viewport().close_requested();
        let Self { app, window_surface, .. } = self;
        let mut output = ctx.run_ui(input, |ui| app.ui(ui, &mut || window_surface.wait_until_presented()));
        self.info.events.clear();
        self.state.handle_platform_output_with_event_loop(&self.window, events, output.platform_output);
        let primitives = ctx.tessellate(std::mem::take(&mut output.shapes), output.pixels_per_point);
        self.painter.set_textures(&mut output.textures_delta);
        let size: [u32; 2] = self.window.inner_size().into();
        let changed = self.painter.paint(&primitives, output.pixels_per_point, size);
        self.painter.free_textures(&mut output.textures_delta);
        self.window.pre_present_notify();
        if content_lost {
            self.window_surface.invalidate();
        }
        self.window_surface.present(&self.painter, &changed, size)?;
        if std::mem::take(&mut self.first) {
            self.window.set_visible(true);
        }
        let mut commands = Vec::new();
        for (_, viewport) in output.viewport_output {
            commands.extend(viewport.commands);
        }
        if closing && !commands.contains(&ViewportCommand::CancelClose) {
            return Ok(AfterFrame::Close);
        }
        egui_winit::process_viewport_commands(ctx, &mut self.info, commands, &self.window, &mut self.actions);
        self.run_actions();
        let again = !self.info.events.is_empty() || !self.state.egui_input().events.is_empty();
        Ok(if again { AfterFrame::Repaint } else { AfterFrame::Sleep })
    }

    /// Turns cut, copy and paste requests into input events of the next frame.
    fn run_actions(&mut self) {
        for action in self.actions.drain(..) {
            let event = match action {
                ActionRequested::Cut => egui::Event::Cut,
                ActionRequested::Copy => egui::Event::Copy,
                ActionRequested::Paste => match self.state.clipboard_text() {
                    Some(text) if !text.is_empty() => egui::Event::Paste(text.replace("\r\n", "\n")),
                    _ => continue,
                },
                // Screenshots are not supported.
                ActionRequested::Screenshot(_) | ActionRequested::PaintWhileHidden => continue,
            };
            self.state.egui_input_mut().events.push(event);
        }
    }
}

/// Size of the largest monitor, points. Some systems do not open larger windows.
fn largest_monitor(events: &ActiveEventLoop) -> egui::Vec2 {
    let mut largest = egui::Vec2::ZERO;
    for monitor in events.available_monitors() {
        let size = monitor.size().to_logical::<f32>(monitor.scale_factor());
        largest = largest.max(egui::vec2(size.width, size.height));
    }
    if largest == egui::Vec2::ZERO { egui::Vec2::INFINITY } else { largest }
}

impl ApplicationHandler<RepaintRequest> for Runner {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if let Err(error) = self.open(events) {
            self.failed = Some(error);
            events.exit();
        }
    }

    fn new_events(&mut self, events: &ActiveEventLoop, _cause: StartCause) {
        self.paint_if_due(events);
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        self.paint_if_due(events);
    }

    fn user_event(&mut self, _events: &ActiveEventLoop, RepaintRequest { at, pass_nr }: RepaintRequest) {
        // Requests made before the last frames are satisfied by them.
        let passes = self.ctx.cumulative_pass_nr_for(ViewportId::ROOT);
        if passes == pass_nr || passes == pass_nr + 1 {
            self.schedule(at);
        }
    }

    fn device_event(&mut self, _events: &ActiveEventLoop, _device: DeviceId, event: DeviceEvent) {
        if let (DeviceEvent::MouseMotion { delta }, Some(open)) = (event, &mut self.open)
            && open.state.on_mouse_motion(delta)
        {
            self.schedule(Instant::now());
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _window: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        match &event {
            WindowEvent::RedrawRequested => {
                // Where the system does not pace frames, a redraw request means that the content was lost.
                let content_lost = !open.vsync;
                self.frame(events, content_lost);
                return;
            }
            WindowEvent::CloseRequested => {
                open.info.events.push(ViewportEvent::Close);
                self.schedule(Instant::now());
                return;
            }
            WindowEvent::Occluded(occluded) => open.info.occluded = Some(*occluded),
            _ => {}
        }
        if open.state.on_window_event(&open.window, &event).repaint {
            self.schedule(Instant::now());
        }
    }

    fn exiting(&mut self, events: &ActiveEventLoop) {
        // Some systems end programs without closing their windows first.
        self.close(events);
    }
}
