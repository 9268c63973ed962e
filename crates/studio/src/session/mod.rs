//! An open document with its file, its player and the playback time. No widgets.
//!
//! Per frame of the window: [`Session::poll_player`] handles the player's events, the panels edit the document, and
//! [`Session::advance_time`] advances the playback and requests the next picture.

pub(crate) mod selection;
pub(crate) mod settings_store;
pub(crate) mod status;

use std::{
    borrow::Cow,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use bansho_example_scenes::plates;

use bansho::{
    Assets, Plan,
    base::{
        camera::CameraParameters,
        parameters::{Parameters, Value},
    },
    scene::{Segment, ValuePath, edit::EditError, operation::Operation},
};

use crate::{
    document::{Document, PhenomenonId, Revision, descriptors::named_files, keyframes},
    player::{Event, FrameRequest, FrameTiming, Picture, Player, PreviewScale, Transport},
    scenes::examples::BundledAssets,
};
use status::{FrameRate, PanickedFrames};

use web_time::Instant;

/// Creates the asset source for a scene in a folder. For a scene without a file, bundled and added files take precedence over it.
pub type AssetsForFolder = fn(&Path) -> Arc<dyn Assets>;

/// Longest wait for a picture within a frame of the window; not noticed while dragging.
const MAX_WAIT: Duration = Duration::from_millis(40);

/// Key of the camera's table.
const CAMERA: &str = "camera";

/// A document that is open, with its player.
pub struct Session {
    /// The scene.
    pub document: Document,
    /// Its file, if it has one.
    pub path: Option<PathBuf>,
    /// The playback.
    pub transport: Transport,
    /// Whether dragging in the viewport sets keyframes.
    pub recording: bool,
    /// Number of documents opened so far.
    pub opened: u64,
    /// Whether pictures may be simulated with fewer particles than the scene has.
    pub draft: bool,
    /// The phenomenon whose stages are shown.
    pub stages: Option<PhenomenonId>,
    /// Whether to autosave at once.
    pub autosave_now: bool,
    /// Whether files of the scene are on their way. No picture is requested before they have arrived.
    pub awaits_files: bool,
    player: Box<dyn Player>,
    assets_for_folder: AssetsForFolder,
    bundle: BundledAssets,
    assets: Arc<dyn Assets>,
    preview_scale: PreviewScale,
    picture: Option<Picture>,
    /// Serial number of the last picture, those of stages included.
    serial: u64,
    /// Pictures of the stages, each with its serial number.
    stage_pictures: Vec<(Picture, u64)>,
    last_request: Option<LastRequest>,
    /// Frames that panicked; they are not drawn again.
    panicked_frames: PanickedFrames,
    notice: Option<String>,
    frame_rate: FrameRate,
    /// A time to seek to once the scene is checked, s.
    seek_s: Option<f64>,
}

/// What a request depends on. A new one is sent only if this differs from the last request.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LastRequest {
    revision: Revision,
    number: Option<i64>,
    within: [usize; 2],
    draft: bool,
    stages: Option<PhenomenonId>,
}

impl Session {
    /// Opens `document` from the file `path`.
    pub fn new(
        document: Document,
        path: Option<PathBuf>,
        player: Box<dyn Player>,
        assets_for_folder: AssetsForFolder,
    ) -> Self {
        let bundle = BundledAssets::default();
        Self {
            assets: assets(&bundle, path.as_deref(), assets_for_folder),
            bundle,
            document,
            path,
            transport: Transport::default(),
            recording: false,
            opened: 0,
            draft: true,
            stages: None,
            autosave_now: false,
            awaits_files: false,
            stage_pictures: Vec::new(),
            player,
            assets_for_folder,
            preview_scale: PreviewScale::default(),
            picture: None,
            serial: 0,
            last_request: None,
            panicked_frames: PanickedFrames::default(),
            notice: None,
            frame_rate: FrameRate::default(),
            seek_s: None,
        }
    }

    /// Opens another document in place of this one.
    pub fn open(&mut self, document: Document, path: Option<PathBuf>) {
        self.assets = assets(&self.bundle, path.as_deref(), self.assets_for_folder);
        (self.document, self.path) = (document, path);
        (self.picture, self.last_request, self.panicked_frames, self.notice) =
            (None, None, PanickedFrames::default(), None);
        (self.stages, self.stage_pictures, self.preview_scale) = (None, Vec::new(), PreviewScale::default());
        (self.transport, self.seek_s, self.frame_rate) = (Transport::default(), None, FrameRate::default());
        self.opened += 1;
    }

    /// Reads all assets again, after one was replaced.
    pub fn reload_assets(&mut self) {
        self.assets = assets(&self.bundle, self.path.as_deref(), self.assets_for_folder);
        // The new files may not cause the panic.
        self.retry();
    }

    /// Forgets which frames panicked, so that they are drawn again.
    pub fn retry(&mut self) {
        (self.last_request, self.panicked_frames) = (None, PanickedFrames::default());
    }

    /// Adds a file by its content, as in a web page, which has no folders.
    pub fn add_file(&mut self, name: &str, bytes: Vec<u8>) {
        self.player.add_file(name, &bytes);
        self.bundle.add_file(name, bytes);
        self.reload_assets();
    }

    /// The last picture, with its serial number.
    pub fn picture(&self) -> Option<(&Picture, u64)> {
        self.picture.as_ref().map(|picture| (picture, self.serial))
    }

    /// The last picture of a stage of the phenomenon whose stages are shown, with its serial number.
    pub fn stage(&self, stage: usize) -> Option<(&Picture, u64)> {
        self.stage_pictures.get(stage).map(|(picture, serial)| (picture, *serial))
    }

    /// The last valid plan.
    pub fn plan(&self) -> Option<&Arc<Plan>> {
        self.document.plan()
    }

    /// Whether the player is working on a picture.
    pub fn is_busy(&self) -> bool {
        self.player.is_busy()
    }

    /// Frames per second while playing.
    pub fn frames_per_s(&self) -> Option<f64> {
        self.frame_rate.frames_per_s().filter(|_| self.transport.is_playing())
    }

    /// The message in the status line.
    pub fn notice(&self) -> Option<&str> {
        self.notice.as_deref()
    }

    /// Sets or clears the message in the status line.
    pub fn set_notice(&mut self, notice: Option<String>) {
        self.notice = notice;
    }

    /// Whether the current frame panicked.
    pub fn has_panicked(&self) -> bool {
        self.panicked_frames.contains(self.document.revision(), self.transport.number())
    }

    /// Applies `operations`; an error is shown in the status line.
    pub fn edit(&mut self, label: &str, operations: &[Operation]) {
        match self.document.edit(label, operations) {
            Ok(()) => self.notice = None,
            Err(EditError::Syntax(reason)) => {
                self.notice = Some(format!("the text is not TOML; correct it or undo first: {reason}"));
            }
            Err(error) => self.notice = Some(error.to_string()),
        }
    }

    /// Seeks to the frame at `time`, s. It seeks again once the scene is checked, since an edit may make the shot longer.
    pub fn go_to_time(&mut self, time: f64) {
        self.seek_s = (!self.document.is_checked()).then_some(time);
        self.seek_now(time);
    }

    fn seek_now(&mut self, time: f64) {
        let first = *self.transport.frames().start();
        self.transport.go_to(first + (time / self.transport.frame_s()).round() as i64);
    }

    /// The source of the scene's plates, meshes and drawings.
    pub fn assets(&self) -> &Arc<dyn Assets> {
        &self.assets
    }

    /// Sets the value at `path`. If it is keyframed, or may be while recording, sets a keyframe at the current time.
    pub fn set(&mut self, label: &str, path: &ValuePath, value: Value) {
        self.set_all(label, [(path.clone(), value)]);
    }

    /// Sets several values in one undo step.
    pub fn set_all(&mut self, label: &str, values: impl IntoIterator<Item = (ValuePath, Value)>) {
        let mut operations = Vec::new();
        for (path, value) in values {
            let node = path.find(self.document.values());
            let is_keyed = node.is_some_and(|node| keyframes::is_keyed(&node.value));
            operations.push(if is_keyed || (self.recording && keyframes::animatable(&path)) {
                self.keyframe_operation(&path, value)
            } else {
                Operation::Set { path, value }
            });
        }
        self.edit_keeping_view(label, operations);
    }

    /// Sets a keyframe of `value` at `path` at the current time.
    pub fn set_keyframe(&mut self, path: &ValuePath, value: Value) {
        let operation = self.keyframe_operation(path, value);
        self.edit_keeping_view("key", vec![operation]);
    }

    /// The value at `path` that the scene derives where the text does not state it, and that may differ from the parameter's default: a
    /// camera without a target may look up at the sky.
    pub fn implied_value(&self, path: &ValuePath) -> Option<Value> {
        let [Segment::Key(root), Segment::Key(key)] = path.segments() else { return None };
        let camera = &self.plan().filter(|_| root == CAMERA)?.scene().camera;
        camera.to_table().get(key).map(|node| node.value.clone())
    }

    /// Applies `operations`, and states derived camera values that they would change: the camera's default orientation depends on
    /// whether its position or target is stated.
    fn edit_keeping_view(&mut self, label: &str, operations: Vec<Operation>) {
        let camera = ValuePath::root().key(CAMERA);
        let [position, target, field] = ["position", "target", "vertical_fov_deg"].map(|key| camera.key(key));
        let stated = [&position, &target].map(|path| path.find(self.document.values()).is_some());
        let changes_view = operations.iter().any(|operation| [&position, &target].contains(&operation.path()));
        let defaults = CameraParameters::default().to_table();
        let mut all = Vec::new();
        if changes_view && stated == [false; 2] {
            for (path, key) in [(position, "position"), (target, "target"), (field, "vertical_fov_deg")] {
                let stated = path.find(self.document.values()).is_some();
                let derived =
                    self.implied_value(&path).filter(|value| defaults.get(key).is_none_or(|node| node.value != *value));
                all.extend(derived.filter(|_| !stated).map(|value| Operation::Set { path, value }));
            }
        }
        all.extend(operations);
        self.edit(label, &all);
    }

    /// The operation that sets a keyframe at `path` at the current time.
    pub fn keyframe_operation(&self, path: &ValuePath, value: Value) -> Operation {
        Operation::SetKeyframe { path: path.clone(), time: self.transport.time_s(), value }
    }

    /// [`poll_player`](Self::poll_player), then [`advance_time`](Self::advance_time).
    pub fn update(&mut self, now: f64, viewport: [usize; 2], dragging: bool) -> Option<f64> {
        self.poll_player(now, dragging);
        self.advance_time(now, viewport, dragging)
    }

    /// Handles the player's events. While `dragging`, low latency is preferred over large pictures.
    pub fn poll_player(&mut self, now: f64, dragging: bool) {
        for event in self.player.poll() {
            self.handle_event(event, now, dragging);
        }
        if !self.transport.is_playing() {
            self.frame_rate = FrameRate::default();
        }
    }

    /// Advances the playback and requests a picture for a viewport of `viewport` pixels. Returns how long the window may sleep, s.
    pub fn advance_time(&mut self, now: f64, viewport: [usize; 2], dragging: bool) -> Option<f64> {
        let interactive = dragging || self.transport.is_playing();
        let shown = self.picture.as_ref().is_some_and(|picture| picture.number == self.transport.number());
        self.transport.tick(now, shown || self.has_panicked());
        self.request(viewport, interactive);
        if self.player.needs_polling() {
            return Some(0.0);
        }
        self.transport.sleep_s(now).filter(|_| !self.is_busy())
    }

    /// Waits up to 40 ms for the picture if the last one took less, so that an edit and its picture appear in the same frame of the
    /// window. While playing it does not wait: rendering and painting overlap then.
    pub fn wait_for_picture(&mut self, now: f64, dragging: bool) {
        let began = Instant::now();
        let quick =
            self.picture.as_ref().is_some_and(|picture| picture.draw_s + picture.advance_s < MAX_WAIT.as_secs_f64());
        while quick && !self.transport.is_playing() && self.is_busy() {
            let Some(remaining) = MAX_WAIT.checked_sub(began.elapsed()) else { return };
            self.player.wait(remaining);
            self.poll_player(now, dragging);
        }
    }

    fn request(&mut self, viewport: [usize; 2], interactive: bool) {
        let scale = if interactive { self.preview_scale.scale() } else { 1.0 };
        let number = self.plan().map(|_| self.transport.number());
        let next = LastRequest {
            revision: self.document.revision(),
            number,
            within: viewport.map(|side| ((side as f64 * scale).round() as usize).max(1)),
            draft: self.draft,
            stages: self.stages.filter(|_| !interactive || self.is_quick()),
        };
        let is_same = self.last_request.is_some_and(|last| {
            // While interactive, a frame is not drawn again only because its size changed.
            last == LastRequest { within: if interactive { last.within } else { next.within }, ..next }
        });
        if is_same || self.awaits_files || self.has_panicked() {
            return;
        }
        self.last_request = Some(next);
        self.send(next, false);
    }

    /// Whether the scene is drawn fast enough to draw the stages too.
    fn is_quick(&self) -> bool {
        /// Longest time of a picture, s.
        const QUICK_S: f64 = 0.05;
        self.picture.as_ref().is_none_or(|picture| picture.draw_s + picture.advance_s < QUICK_S)
    }

    /// Draws the current frame again, simulated from the scene's first frame, at the viewport's full size.
    pub fn redraw_exact(&mut self) {
        if let Some(last_request) = self.last_request {
            self.send(last_request, true);
        }
    }

    fn send(&mut self, inputs: LastRequest, exact: bool) {
        let request = self.request_for(inputs, exact);
        self.player.request(request);
    }

    /// The request for the full-quality frame `number`, for another player than this session's.
    pub fn full_quality_request(&self, number: i64) -> FrameRequest {
        let revision = self.document.revision();
        let inputs = LastRequest { revision, number: Some(number), within: [1; 2], draft: false, stages: None };
        FrameRequest { full_quality: true, ..self.request_for(inputs, true) }
    }

    /// The bytes of a bundled or added file.
    pub fn bundled_file(&self, name: &str) -> Option<Cow<'_, [u8]>> {
        self.bundle.bytes(name)
    }

    /// Plates of the example scenes that the scene names and that are not here, by the names in the scene. A web page fetches them.
    pub fn missing_plates(&self) -> Vec<String> {
        let names = named_files(self.document.values()).into_iter().map(|reference| reference.file);
        names.filter(|name| plates::path_in_scenes(name).is_some() && !self.bundle.contains(name)).collect()
    }

    /// Added files, by name.
    pub fn added_files(&self) -> &[(String, Arc<[u8]>)] {
        self.bundle.added_files()
    }

    fn request_for(&self, inputs: LastRequest, exact: bool) -> FrameRequest {
        FrameRequest {
            revision: inputs.revision,
            name: self.document.name().to_owned(),
            text: self.document.text().clone(),
            assets: self.assets.clone(),
            number: inputs.number,
            within: inputs.within,
            exact,
            draft: inputs.draft,
            full_quality: false,
            stages: inputs.stages,
        }
    }

    /// Events of a document that was open before are ignored.
    fn handle_event(&mut self, event: Event, now: f64, dragging: bool) {
        if event.revision().is_some_and(|revision| !self.document.includes_revision(revision)) {
            return;
        }
        match event {
            Event::Checked { revision, outcome } => self.apply_check(revision, outcome),
            Event::Drawn(picture) => self.show_picture(picture, now, dragging),
            Event::Stage(stage, picture) => {
                self.serial += 1;
                let stages = &mut self.stage_pictures;
                if let Some(shown) = stages.get_mut(stage) {
                    *shown = (picture, self.serial);
                } else {
                    stages.push((picture, self.serial));
                }
            }
            Event::Failed { revision, reason } if revision == self.document.revision() => self.notice = Some(reason),
            // Full-quality frames are requested from other players.
            Event::Failed { .. } | Event::FullQualityFrame { .. } => {}
            Event::Panicked { revision, number, message } => {
                if revision == self.document.revision() {
                    // A valid scene panics at some frames only.
                    let plan = self.plan().filter(|_| self.document.is_checked());
                    let frame = plan.map(|plan| number.unwrap_or(plan.frames().start));
                    self.panicked_frames.record(revision, frame);
                }
                self.transport.set_playing(false);
                self.notice = Some(self.panic_message(&message));
            }
        }
    }

    /// The message for a phenomenon that panicked with `message`. The work is saved at once.
    pub(super) fn panic_message(&mut self, message: &str) -> String {
        self.autosave_now = true;
        format!("a phenomenon panicked, which is a bug in it: {message}{}", self.save_rescue_copy())
    }

    /// Saves a copy of the scene beside its file after a panic. Returns a sentence about it.
    #[cfg(not(target_arch = "wasm32"))]
    fn save_rescue_copy(&self) -> String {
        let Some(path) = self.path.as_ref().filter(|_| self.document.is_dirty()) else { return String::new() };
        match crate::document::files::save_rescue_copy(self.document.text(), path) {
            Ok(copy) => format!("; the scene was saved as {}", copy.display()),
            Err(error) => format!("; the scene could not be saved beside its file: {error}"),
        }
    }

    /// In a browser, the autosave stores the scene.
    #[cfg(target_arch = "wasm32")]
    fn save_rescue_copy(&self) -> String {
        if self.document.is_dirty() { "; the browser keeps the scene".into() } else { String::new() }
    }

    fn apply_check(&mut self, revision: Revision, outcome: Result<Arc<Plan>, bansho::SceneError>) {
        self.document.set_check_result(revision, outcome);
        if let Some(plan) = self.document.plan() {
            let frames = plan.frames();
            self.transport.set_shot(frames.start..=frames.end - 1, 1.0 / plan.fps().frame_s());
            if let Some(last_request) = self.last_request.as_mut().filter(|last_request| last_request.number.is_none())
            {
                // The number of the scene's first frame is known only now.
                last_request.number = Some(frames.start);
                self.transport.go_to(frames.start);
            }
        }
        if let Some(time) = self.seek_s.take_if(|_| self.document.is_checked()) {
            self.seek_now(time);
        }
    }

    fn show_picture(&mut self, picture: Picture, now: f64, dragging: bool) {
        /// Target time of a preview while dragging, s.
        const DRAG_TARGET_S: f64 = 0.05;
        if dragging || self.transport.is_playing() {
            let target = if dragging { DRAG_TARGET_S } else { self.transport.frame_s() };
            let Picture { size: [width, height], draw_s, advance_s, .. } = picture;
            self.preview_scale.record(FrameTiming { pixels: width * height, draw_s, advance_s }, target);
            self.frame_rate.record_frame(now);
        }
        self.serial += 1;
        self.picture = Some(picture);
    }
}

/// The asset source of a scene in the file `path`.
fn assets(bundle: &BundledAssets, path: Option<&Path>, assets_for_folder: AssetsForFolder) -> Arc<dyn Assets> {
    let files = assets_for_folder(folder(path));
    if path.is_some() { files } else { Arc::new(bundle.clone().overlay_on(files)) }
}

/// The folder that paths in a scene are relative to.
pub(super) fn folder(path: Option<&Path>) -> &Path {
    path.and_then(Path::parent).unwrap_or(Path::new(""))
}
