//! A folder to run the program in, and readers of its output.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

/// A small picture of a flame.
pub(crate) const FLAME: &str = "\
bansho = 2

[picture]
size = [48, 64]   # small
frames = 6
seed = 7

[camera]
position = [0.0, 0.8, 3.0]
target = [0.0, 0.8, 0.0]

[[flame_sheet]]
name = \"left log\"
";

pub(crate) struct Folder {
    folder: tempfile::TempDir,
}

impl Folder {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// A folder that contains `scene.toml`.
    pub(crate) fn with_scene(text: &str) -> Self {
        let folder = Self::new();
        folder.write("scene.toml", text);
        folder
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bansho"));
        command.args(arguments).current_dir(self.folder.path()).stdin(Stdio::null());
        command
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Run {
        Run::of(self.command(arguments).output().unwrap())
    }

    /// Runs the program, which must succeed.
    pub(crate) fn succeed(&self, arguments: &[&str]) -> Run {
        let run = self.run(arguments);
        assert_eq!(run.code, Some(0), "{arguments:?}: {}", run.stderr);
        run
    }

    /// Paths of all files in it and in its folders.
    pub(crate) fn names(&self) -> Vec<String> {
        names(self.folder.path())
    }

    /// Contents of the files of a folder in it.
    pub(crate) fn files(&self, folder: &str) -> BTreeMap<String, Vec<u8>> {
        let folder = self.path(folder);
        names(&folder).into_iter().map(|name| (name.clone(), contents(&folder.join(&name)))).collect()
    }
}

/// Contents of a file; of a link that leads nowhere, where it leads.
fn contents(path: &Path) -> Vec<u8> {
    fs::read(path).unwrap_or_else(|_| fs::read_link(path).unwrap().into_os_string().into_encoded_bytes())
}

fn names(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    let Ok(entries) = fs::read_dir(folder) else { return found };
    for entry in entries.map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        found.extend(names(&entry.path()).into_iter().map(|inner| format!("{name}/{inner}")));
        if !entry.path().is_dir() {
            found.push(name);
        }
    }
    found.sort();
    found
}

pub(crate) struct Run {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Run {
    pub(crate) fn of(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    pub(crate) fn errors(&self) -> usize {
        self.stderr.lines().filter(|line| line.starts_with("error: ")).count()
    }
}

/// Waits until `done` returns true, for at most a minute, so that a program that hangs does not hang the tests.
pub(crate) fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !done() {
        assert!(begun.elapsed() < Duration::from_secs(60), "waited a minute for {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A PNG's width and its RGBA or RGB rows.
pub(crate) struct Png {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) channels: usize,
    pub(crate) bytes: Vec<u8>,
    pub(crate) bits: u8,
}

pub(crate) fn decode_png(bytes: &[u8]) -> Png {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    Png {
        width: info.width as usize,
        height: info.height as usize,
        channels: info.color_type.samples(),
        bits: info.bit_depth as u8,
        bytes: pixels,
    }
}

impl Png {
    /// The bytes of a rectangle, row by row.
    pub(crate) fn part(&self, [x, y, width, height]: [usize; 4]) -> Vec<u8> {
        let pixel = self.channels * usize::from(self.bits) / 8;
        let row = |row: usize| &self.bytes[(row * self.width + x) * pixel..][..width * pixel];
        (y..y + height).flat_map(|y| row(y).to_vec()).collect()
    }

    pub(crate) fn has_light(&self) -> bool {
        self.bytes.iter().any(|&byte| byte > 40) && self.bytes.contains(&0)
    }
}

/// All channels of an EXR by name, and its data window.
pub(crate) struct Exr {
    pub(crate) size: [usize; 2],
    pub(crate) origin: [i32; 2],
    pub(crate) channels: BTreeMap<String, Vec<f32>>,
}

pub(crate) fn read_exr(path: &Path) -> Exr {
    let image = exr::prelude::read_first_flat_layer_from_file(path).unwrap();
    let layer = image.layer_data;
    let channel = |channel: &exr::prelude::AnyChannel<exr::prelude::FlatSamples>| {
        (channel.name.to_string(), channel.sample_data.values_as_f32().collect())
    };
    Exr {
        size: [layer.size.0, layer.size.1],
        origin: [layer.attributes.layer_position.0, layer.attributes.layer_position.1],
        channels: layer.channel_data.list.iter().map(channel).collect(),
    }
}
