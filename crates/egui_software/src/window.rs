//! A window of the system and its events; nothing happens in it unless something is asked for.

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

use super::{Painter, app::App, surface::Screen};

/// Nothing is painted more often than this, whatever moves.
const LEAST: Duration = Duration::from_millis(8);

/// Pixels that a picture may have a side.
const LARGEST_TEXTURE: usize = 8192;

/// Makes what the window shows, once there is something that wakes it.
pub type Build = Box<dyn FnOnce(&egui::Context) -> Result<Box<dyn App>, Box<dyn std::error::Error + Send + Sync>>>;

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
pub enum WindowError {
    /// The system has no screen for it.
    #[error("no window: {0}")]
    Events(#[from] EventLoopError),
    /// The system does not open it.
    #[error("no window: {0}")]
    Open(#[from] OsError),
    /// It takes no pixels.
    #[error("a window that shows nothing: {0}")]
    Screen(#[from] softbuffer::SoftBufferError),
    /// What it would show cannot be made.
    #[error(transparent)]
    App(#[from] Box<dyn std::error::Error + Send + Sync>),
}

/// Shows what `build` makes in a window until that closes.
///
/// # Errors
/// There is no window, or nothing to show.
pub fn run(viewport: egui::ViewportBuilder, build: Build) -> Result<(), WindowError> {
    let events = EventLoop::<Wake>::with_user_event().build()?;
    let ctx = egui::Context::default();
    ctx.set_embed_viewports(false);
    ctx.options_mut(|options| options.max_passes = std::num::NonZeroUsize::MIN.saturating_add(1));
    wake_by(&ctx, events.create_proxy());
    let mut runner = Runner { ctx, viewport, build: Some(build), shown: None, due: None, failed: None };
    events.run_app(&mut runner)?;
    runner.failed.map_or(Ok(()), Err)
}

/// A frame is wanted at a time, as somebody asked who had seen so many.
#[derive(Debug)]
struct Wake {
    at: Instant,
    seen: u64,
}

fn wake_by(ctx: &egui::Context, proxy: EventLoopProxy<Wake>) {
    let proxy = std::sync::Mutex::new(proxy);
    ctx.set_request_repaint_callback(move |info| {
        if info.viewport_id == ViewportId::ROOT
            && let Ok(proxy) = proxy.lock()
        {
            let at = Instant::now().checked_add(info.delay);
            // Nobody listens any more when the window is closed; what is asked for in centuries is not.
            let _ = at.map(|at| proxy.send_event(Wake { at, seen: info.current_cumulative_pass_nr }));
        }
    });
}

/// The window, before and while it is there.
struct Runner {
    ctx: egui::Context,
    viewport: egui::ViewportBuilder,
    build: Option<Build>,
    shown: Option<Shown>,
    /// When the next frame is wanted.
    due: Option<Instant>,
    failed: Option<WindowError>,
}

/// The window while it is there.
struct Shown {
    app: Box<dyn App>,
    window: Arc<Window>,
    state: State,
    info: ViewportInfo,
    painter: Painter,
    screen: Screen,
    /// Cut, copy and paste that were asked for.
    actions: Vec<ActionRequested>,
    /// When the last frame began.
    last: Instant,
    /// Nothing was painted yet.
    first: bool,
    /// The system says when frames are wanted, and keeps what was shown.
    paced: bool,
}

impl Runner {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<(), WindowError> {
        let Some(build) = self.build.take() else { return Ok(()) };
        // Nobody sees it before something is painted.
        let mut viewport = self.viewport.clone().with_visible(false);
        viewport.inner_size = viewport.inner_size.map(|size| size.min(largest_monitor(events)));
        let window = Arc::new(egui_winit::create_window(&self.ctx, events, &viewport)?);
        let screen = Screen::new(events.owned_display_handle(), window.clone())?;
        let scale = Some(window.scale_factor() as f32);
        let state =
            State::new(self.ctx.clone(), ViewportId::ROOT, events, scale, events.system_theme(), Some(LARGEST_TEXTURE));
        let mut info = ViewportInfo::default();
        egui_winit::update_viewport_info(&mut info, &self.ctx, &window, true);
        let app = build(&self.ctx)?;
        let paced = events.display_handle().is_ok_and(|handle| matches!(handle.as_raw(), RawDisplayHandle::Wayland(_)));
        let last = Instant::now().checked_sub(LEAST).unwrap_or_else(Instant::now);
        let (painter, actions) = (Painter::default(), Vec::new());
        self.shown = Some(Shown { app, window, state, info, painter, screen, actions, last, first: true, paced });
        self.due = Some(Instant::now());
        Ok(())
    }

    fn want(&mut self, at: Instant) {
        self.due = Some(self.due.map_or(at, |due| due.min(at)));
    }

    /// Paints a frame if one is wanted by now, and sleeps until the next.
    fn follow(&mut self, events: &ActiveEventLoop) {
        let Some(shown) = &mut self.shown else { return };
        let soonest = shown.last + LEAST;
        if self.due.is_some_and(|due| due.max(soonest) <= Instant::now()) {
            self.due = None;
            if shown.paced && !shown.first {
                shown.window.request_redraw();
            } else {
                self.frame(events, false);
            }
        }
        let soonest = self.shown.as_ref().map(|shown| shown.last + LEAST);
        events.set_control_flow(match self.due {
            Some(due) => ControlFlow::WaitUntil(soonest.map_or(due, |soonest| due.max(soonest))),
            None => ControlFlow::Wait,
        });
    }

    /// One frame; with `whole`, nothing of the last one is on the screen any more.
    fn frame(&mut self, events: &ActiveEventLoop, whole: bool) {
        let Some(shown) = &mut self.shown else { return };
        match shown.frame(&self.ctx, events, whole) {
            Ok(Next::Close) => self.close(events),
            Ok(Next::Again) => self.want(Instant::now()),
            Ok(Next::Rest) => {}
            Err(error) => {
                self.failed = Some(error);
                self.close(events);
            }
        }
    }

    fn close(&mut self, events: &ActiveEventLoop) {
        if let Some(mut shown) = self.shown.take() {
            self.ctx.on_exit();
            shown.app.on_exit();
        }
        events.exit();
    }
}

/// What follows a frame.
enum Next {
    Rest,
    Again,
    Close,
}

impl Shown {
    fn frame(&mut self, ctx: &egui::Context, events: &ActiveEventLoop, whole: bool) -> Result<Next, WindowError> {
        self.last = Instant::now();
        egui_winit::update_viewport_info(&mut self.info, ctx, &self.window, false);
        let mut input = self.state.take_egui_input(&self.window);
        input.viewports.insert(ViewportId::ROOT, self.info.clone());
        let closing = input.viewport().close_requested();
        let Self { app, screen, .. } = self;
        let mut output = ctx.run_ui(input, |ui| app.ui(ui, &mut || screen.settle()));
        self.info.events.clear();
        self.state.handle_platform_output_with_event_loop(&self.window, events, output.platform_output);
        let primitives = ctx.tessellate(std::mem::take(&mut output.shapes), output.pixels_per_point);
        self.painter.set_textures(&mut output.textures_delta);
        let size: [u32; 2] = self.window.inner_size().into();
        let changed = self.painter.paint(&primitives, output.pixels_per_point, size);
        self.painter.free_textures(&mut output.textures_delta);
        self.window.pre_present_notify();
        if whole {
            self.screen.forget();
        }
        self.screen.show(&self.painter, &changed, size)?;
        if std::mem::take(&mut self.first) {
            self.window.set_visible(true);
        }
        let mut commands = Vec::new();
        for (_, viewport) in output.viewport_output {
            commands.extend(viewport.commands);
        }
        if closing && !commands.contains(&ViewportCommand::CancelClose) {
            return Ok(Next::Close);
        }
        egui_winit::process_viewport_commands(ctx, &mut self.info, commands, &self.window, &mut self.actions);
        self.act();
        let again = !self.info.events.is_empty() || !self.state.egui_input().events.is_empty();
        Ok(if again { Next::Again } else { Next::Rest })
    }

    /// What was asked for becomes input of the next frame.
    fn act(&mut self) {
        for action in self.actions.drain(..) {
            let event = match action {
                ActionRequested::Cut => egui::Event::Cut,
                ActionRequested::Copy => egui::Event::Copy,
                ActionRequested::Paste => match self.state.clipboard_text() {
                    Some(text) if !text.is_empty() => egui::Event::Paste(text.replace("\r\n", "\n")),
                    _ => continue,
                },
                // Nobody asks for pictures of the window.
                ActionRequested::Screenshot(_) | ActionRequested::PaintWhileHidden => continue,
            };
            self.state.egui_input_mut().events.push(event);
        }
    }
}

/// Points of the screen that the largest has; a window that is larger does not open everywhere.
fn largest_monitor(events: &ActiveEventLoop) -> egui::Vec2 {
    let mut largest = egui::Vec2::ZERO;
    for monitor in events.available_monitors() {
        let size = monitor.size().to_logical::<f32>(monitor.scale_factor());
        largest = largest.max(egui::vec2(size.width, size.height));
    }
    if largest == egui::Vec2::ZERO { egui::Vec2::INFINITY } else { largest }
}

impl ApplicationHandler<Wake> for Runner {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if let Err(error) = self.open(events) {
            self.failed = Some(error);
            events.exit();
        }
    }

    fn new_events(&mut self, events: &ActiveEventLoop, _cause: StartCause) {
        self.follow(events);
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        self.follow(events);
    }

    fn user_event(&mut self, _events: &ActiveEventLoop, Wake { at, seen }: Wake) {
        // One that was asked for before the last frames has been painted by now.
        let shown = self.ctx.cumulative_pass_nr_for(ViewportId::ROOT);
        if shown == seen || shown == seen + 1 {
            self.want(at);
        }
    }

    fn device_event(&mut self, _events: &ActiveEventLoop, _device: DeviceId, event: DeviceEvent) {
        if let (DeviceEvent::MouseMotion { delta }, Some(shown)) = (event, &mut self.shown)
            && shown.state.on_mouse_motion(delta)
        {
            self.want(Instant::now());
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _window: WindowId, event: WindowEvent) {
        let Some(shown) = &mut self.shown else { return };
        match &event {
            WindowEvent::RedrawRequested => {
                // Where frames are not asked of the system, it has lost what was there.
                let whole = !shown.paced;
                self.frame(events, whole);
                return;
            }
            WindowEvent::CloseRequested => {
                shown.info.events.push(ViewportEvent::Close);
                self.want(Instant::now());
                return;
            }
            WindowEvent::Occluded(occluded) => shown.info.occluded = Some(*occluded),
            _ => {}
        }
        if shown.state.on_window_event(&shown.window, &event).repaint {
            self.want(Instant::now());
        }
    }

    fn exiting(&mut self, events: &ActiveEventLoop) {
        // Some systems end programs without closing their windows first.
        self.close(events);
    }
}
