//! An open document with its file, its player and the playback time. No widgets.
//!
//! Per frame of the window: [`Session::poll_player`] takes in the player's events, the panels edit the document, and
//! [`Session::advance_time`] advances the playback and requests the next picture.

pub(crate) mod selection;
pub(crate) mod settings_store;
pub(crate) mod status;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use bansho::{
    Assets, Plan,
    base::{
        camera::CameraParameters,
        parameters::{Parameters, Value},
    },
    scene::{Segment, ValuePath, edit::EditError, operation::Operation},
};

use crate::{
    document::{Document, Revision, keyframes},
    editors::aurora::document::{AuroraDrawing, ShapeEditError},
    player::{Event, FrameRequest, FrameTiming, Picture, Player, PreviewScale, Transport},
    scenes::examples::Bundle,
};
use status::{FrameRate, PanickedFrames};

use web_time::Instant;

/// Makes the asset source for a scene in a folder. A scene without a file looks in the bundled and the added files first.
pub type AssetsForFolder = fn(&Path) -> Arc<dyn Assets>;

/// Longest wait for a picture within a frame of the window; not noticed while dragging.
const MAX_WAIT: Duration = Duration::from_millis(40);

/// The table of the camera.
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
    /// The flame sheet whose stages are shown.
    pub stages: Option<usize>,
    /// Whether to autosave at once.
    pub autosave_now: bool,
    player: Box<dyn Player>,
    assets_for_folder: AssetsForFolder,
    bundle: Bundle,
    assets: Arc<dyn Assets>,
    preview_scale: PreviewScale,
    picture: Option<Picture>,
    drawn: u64,
    /// Pictures of the stages, each with its serial number.
    stage_pictures: Vec<(Picture, u64)>,
    last_request: Option<LastRequest>,
    /// Frames that panicked; they are not drawn again.
    panicked_frames: PanickedFrames,
    notice: Option<String>,
    frame_rate: FrameRate,
    /// A time to seek to once the scene is checked, s.
    seek: Option<f64>,
}

/// The last request.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LastRequest {
    revision: Revision,
    number: Option<i64>,
    within: [usize; 2],
    draft: bool,
    stages: Option<usize>,
}

impl Session {
    /// Opens `document` from the file `path`.
    pub fn new(
        document: Document,
        path: Option<PathBuf>,
        player: Box<dyn Player>,
        assets_for_folder: AssetsForFolder,
    ) -> Self {
        let bundle = Bundle::default();
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
            stage_pictures: Vec::new(),
            player,
            assets_for_folder,
            preview_scale: PreviewScale::default(),
            picture: None,
            drawn: 0,
            last_request: None,
            panicked_frames: PanickedFrames::default(),
            notice: None,
            frame_rate: FrameRate::default(),
            seek: None,
        }
    }

    /// Opens another document in place of this one.
    pub fn open(&mut self, document: Document, path: Option<PathBuf>) {
        self.assets = assets(&self.bundle, path.as_deref(), self.assets_for_folder);
        (self.document, self.path) = (document, path);
        (self.picture, self.last_request, self.panicked_frames, self.notice) =
            (None, None, PanickedFrames::default(), None);
        (self.stages, self.stage_pictures, self.preview_scale) = (None, Vec::new(), PreviewScale::default());
        (self.transport, self.seek, self.frame_rate) = (Transport::default(), None, FrameRate::default());
        self.opened += 1;
    }

    /// Reads all assets again, after one was replaced.
    pub fn reload_assets(&mut self) {
        self.assets = assets(&self.bundle, self.path.as_deref(), self.assets_for_folder);
        // Another file may not cause the panic.
        self.retry();
    }

    /// Draws frames that panicked again.
    pub fn retry(&mut self) {
        (self.last_request, self.panicked_frames) = (None, PanickedFrames::default());
    }

    /// Adds a file by its bytes, where there is no folder.
    pub fn add_file(&mut self, name: &str, bytes: Vec<u8>) {
        self.player.add_file(name, &bytes);
        self.bundle.add_file(name, bytes);
        self.reload_assets();
    }

    /// The last picture, with its serial number.
    pub fn picture(&self) -> Option<(&Picture, u64)> {
        self.picture.as_ref().map(|picture| (picture, self.drawn))
    }

    /// The last picture of a stage of the selected flame sheet, with its serial number.
    pub fn stage(&self, stage: usize) -> Option<(&Picture, u64)> {
        self.stage_pictures.get(stage).map(|(picture, drawn)| (picture, *drawn))
    }

    /// The last good plan.
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
                self.notice = Some(format!("the text is not TOML; mend it or undo first: {reason}"));
            }
            Err(error) => self.notice = Some(error.to_string()),
        }
    }

    /// Applies `operations` to the shapes of aurora `index`. Returns its shapes.
    ///
    /// # Errors
    /// The resulting shapes are invalid; nothing is changed then.
    pub fn edit_shapes(
        &mut self,
        label: &str,
        operations: &[Operation],
        index: usize,
    ) -> Result<AuroraDrawing, ShapeEditError> {
        let drawing = self.document.edit_shapes(label, operations, index, &self.assets)?;
        self.notice = None;
        Ok(drawing)
    }

    /// Seeks to the frame at `time`, s, again once the scene is checked, since an edit may make the shot longer.
    pub fn go_to_time(&mut self, time: f64) {
        self.seek = (!self.document.is_checked()).then_some(time);
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

    /// Sets the value at `place`. Where it is animated, sets a keyframe at the current time; while recording, wherever keyframes are allowed.
    pub fn set(&mut self, label: &str, place: &ValuePath, value: Value) {
        self.set_all(label, [(place.clone(), value)]);
    }

    /// Sets several values in one undo step.
    pub fn set_all(&mut self, label: &str, values: impl IntoIterator<Item = (ValuePath, Value)>) {
        let keyed =
            |place: &ValuePath| place.find(self.document.values()).is_some_and(|node| keyframes::is_keyed(&node.value));
        let operation = |(place, value): (ValuePath, Value)| {
            if keyed(&place) || (self.recording && keyframes::animatable(&place)) {
                self.keyframe(&place, value)
            } else {
                Operation::Set { path: place, value }
            }
        };
        let operations: Vec<Operation> = values.into_iter().map(operation).collect();
        self.edit_keeping_view(label, operations);
    }

    /// Sets a keyframe of `value` at `place` at the current time.
    pub fn key(&mut self, place: &ValuePath, value: Value) {
        let key = self.keyframe(place, value);
        self.edit_keeping_view("key", vec![key]);
    }

    /// The value at `place` that the scene derives where the text does not state it and it is not the parameter's default: a camera
    /// without a target may look up at the sky.
    pub fn implied_value(&self, place: &ValuePath) -> Option<Value> {
        let [Segment::Key(root), Segment::Key(key)] = place.segments() else { return None };
        let camera = &self.plan().filter(|_| root == CAMERA)?.scene().camera;
        camera.to_table().get(key).map(|node| node.value.clone())
    }

    /// Applies `operations`, and states derived camera values that they would change: the camera's default orientation depends on
    /// whether its position or target is stated.
    fn edit_keeping_view(&mut self, label: &str, operations: Vec<Operation>) {
        let camera = ValuePath::root().key(CAMERA);
        let [position, target, field] = ["position", "target", "vertical_fov_deg"].map(|key| camera.key(key));
        let told = [&position, &target].map(|place| place.find(self.document.values()).is_some());
        let tells = operations.iter().any(|operation| [&position, &target].contains(&operation.path()));
        let usual = CameraParameters::default().to_table();
        let mut all = Vec::new();
        if tells && told == [false; 2] {
            for (place, key) in [(position, "position"), (target, "target"), (field, "vertical_fov_deg")] {
                let stated = place.find(self.document.values()).is_some();
                let present =
                    self.implied_value(&place).filter(|value| usual.get(key).is_none_or(|node| node.value != *value));
                all.extend(present.filter(|_| !stated).map(|value| Operation::Set { path: place, value }));
            }
        }
        all.extend(operations);
        self.edit(label, &all);
    }

    /// The operation that sets a keyframe at `place` at the current time.
    pub fn keyframe(&self, place: &ValuePath, value: Value) -> Operation {
        Operation::SetKeyframe { path: place.clone(), time: self.transport.time_s(), value }
    }

    /// [`poll_player`](Self::poll_player), then [`advance_time`](Self::advance_time).
    pub fn update(&mut self, now: f64, viewport: [usize; 2], dragging: bool) -> Option<f64> {
        self.poll_player(now, dragging);
        self.advance_time(now, viewport, dragging)
    }

    /// Handles the player's events. While `dragging`, latency matters more than size.
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

    /// Waits up to 40 ms for a picture of a scene that is quick to draw, so that the change and its picture appear in the same
    /// frame of the window. While playing it does not wait: rendering and painting overlap then.
    pub fn wait(&mut self, now: f64, dragging: bool) {
        let began = Instant::now();
        let quick =
            self.picture.as_ref().is_some_and(|picture| picture.draw_s + picture.advance_s < MAX_WAIT.as_secs_f64());
        while quick && !self.transport.is_playing() && self.is_busy() {
            let Some(left) = MAX_WAIT.checked_sub(began.elapsed()) else { return };
            self.player.wait(left);
            self.poll_player(now, dragging);
        }
    }

    fn request(&mut self, viewport: [usize; 2], interactive: bool) {
        let scale = if interactive { self.preview_scale.scale() } else { 1.0 };
        let number = self.plan().map(|_| self.transport.number());
        let last_request = LastRequest {
            revision: self.document.revision(),
            number,
            within: viewport.map(|side| ((side as f64 * scale).round() as usize).max(1)),
            draft: self.draft,
            stages: self.stages.filter(|_| !interactive || self.is_quick()),
        };
        // While interactive, a frame is not drawn again for another size.
        let same = |last: LastRequest| {
            last == LastRequest { within: if interactive { last.within } else { last_request.within }, ..last_request }
        };
        if self.last_request.is_some_and(same) || self.has_panicked() {
            return;
        }
        self.last_request = Some(last_request);
        self.send(last_request, false);
    }

    /// Whether the scene is quick enough to draw the stages too.
    fn is_quick(&self) -> bool {
        const QUICK_S: f64 = 0.05;
        self.picture.as_ref().is_none_or(|picture| picture.draw_s + picture.advance_s < QUICK_S)
    }

    /// Draws the current frame again, simulated from the scene's first frame, at the viewport's full size.
    pub fn redraw_exact(&mut self) {
        if let Some(last_request) = self.last_request {
            self.send(last_request, true);
        }
    }

    fn send(&mut self, last_request: LastRequest, exact: bool) {
        let request = self.request_for(last_request, exact);
        self.player.request(request);
    }

    /// The request for the full-quality frame `number`, for a player of its own.
    pub fn full_quality_request(&self, number: i64) -> FrameRequest {
        let revision = self.document.revision();
        let last_request = LastRequest { revision, number: Some(number), within: [1; 2], draft: false, stages: None };
        FrameRequest { full_quality: true, ..self.request_for(last_request, true) }
    }

    /// The bytes of a bundled or added file.
    pub fn bundled_file(&self, name: &str) -> Option<&[u8]> {
        self.bundle.bytes(name)
    }

    /// Added files, by name.
    pub fn added_files(&self) -> &[(String, Arc<[u8]>)] {
        self.bundle.added_files()
    }

    fn request_for(&self, last_request: LastRequest, exact: bool) -> FrameRequest {
        FrameRequest {
            revision: last_request.revision,
            name: self.document.name().to_owned(),
            text: self.document.text().clone(),
            assets: self.assets.clone(),
            number: last_request.number,
            within: last_request.within,
            exact,
            draft: last_request.draft,
            full_quality: false,
            stages: last_request.stages,
        }
    }

    /// Events of a document that was open before are ignored.
    fn handle_event(&mut self, event: Event, now: f64, dragging: bool) {
        if event.revision().is_some_and(|revision| !self.document.includes_revision(revision)) {
            return;
        }
        match event {
            Event::Checked { revision, outcome } => self.checked(revision, outcome),
            Event::Drawn(picture) => self.show(picture, now, dragging),
            Event::Stage(stage, picture) => {
                self.drawn += 1;
                let stages = &mut self.stage_pictures;
                if let Some(own) = stages.get_mut(stage) {
                    *own = (picture, self.drawn);
                } else {
                    stages.push((picture, self.drawn));
                }
            }
            Event::Failed { revision, reason } if revision == self.document.revision() => self.notice = Some(reason),
            // Full-quality frames are requested from other players.
            Event::Failed { .. } | Event::FullQualityFrame { .. } => {}
            Event::Panicked { revision, number, message } => {
                if revision == self.document.revision() {
                    // A scene that was checked panics at some frames only.
                    let checked = self.plan().filter(|_| self.document.is_checked());
                    let frame = checked.map(|plan| number.unwrap_or(plan.frames().start));
                    self.panicked_frames.record(revision, frame);
                }
                self.transport.set_playing(false);
                self.notice = Some(self.panic_message(&message));
            }
        }
    }

    /// The notice for a phenomenon that panicked with `message`; the work is saved at once.
    pub(super) fn panic_message(&mut self, message: &str) -> String {
        self.autosave_now = true;
        format!("a phenomenon panicked, which is a bug in it: {message}{}", self.rescue())
    }

    /// Saves the work beside its file after a panic, and says so.
    #[cfg(not(target_arch = "wasm32"))]
    fn rescue(&self) -> String {
        let Some(path) = self.path.as_ref().filter(|_| self.document.is_dirty()) else { return String::new() };
        match crate::document::files::rescue(self.document.text(), path) {
            Ok(beside) => format!("; the scene was saved as {}", beside.display()),
            Err(error) => format!("; the scene could not be saved beside its file: {error}"),
        }
    }

    /// In a browser, the autosave keeps the work.
    #[cfg(target_arch = "wasm32")]
    fn rescue(&self) -> String {
        if self.document.is_dirty() { "; the browser keeps the scene".into() } else { String::new() }
    }

    fn checked(&mut self, revision: Revision, outcome: Result<Arc<Plan>, bansho::SceneError>) {
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
        if let Some(time) = self.seek.take_if(|_| self.document.is_checked()) {
            self.seek_now(time);
        }
    }

    fn show(&mut self, picture: Picture, now: f64, dragging: bool) {
        /// Target time of a preview while dragging, s.
        const DRAG_TARGET_S: f64 = 0.05;
        if dragging || self.transport.is_playing() {
            let target = if dragging { DRAG_TARGET_S } else { self.transport.frame_s() };
            let Picture { size: [width, height], draw_s, advance_s, .. } = picture;
            self.preview_scale.record(FrameTiming { pixels: width * height, draw_s, advance_s }, target);
            self.frame_rate.record_frame(now);
        }
        self.drawn += 1;
        self.picture = Some(picture);
    }
}

/// The asset source of a scene in `path`.
fn assets(bundle: &Bundle, path: Option<&Path>, assets_for_folder: AssetsForFolder) -> Arc<dyn Assets> {
    let files = assets_for_folder(folder(path));
    if path.is_some() { files } else { Arc::new(bundle.clone().overlay_on(files)) }
}

/// The folder that paths in a scene are relative to.
pub(super) fn folder(path: Option<&Path>) -> &Path {
    path.and_then(Path::parent).unwrap_or(Path::new(""))
}
