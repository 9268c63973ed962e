//! Paths that cannot be written, and full disks.

use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
    process::Command,
};

#[cfg(unix)]
use crate::support::Run;
use crate::support::{FLAME, Folder, decode_png};

#[test]
fn a_file_in_the_way_of_a_folder_is_an_error() {
    let folder = Folder::with_scene(FLAME);
    let run = folder.run(&["render", "scene.toml", "--out", "scene.toml/deep/f.png"]);
    assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
    assert!(run.stderr.contains("a part of this path is a file, not a folder"), "{}", run.stderr);
    assert_eq!(folder.names(), ["scene.toml"]);
}

#[test]
fn a_folder_in_the_way_of_a_file_is_an_error() {
    let folder = Folder::with_scene(FLAME);
    fs::create_dir(folder.path("film.gif")).unwrap();
    let run = folder.run(&["render", "scene.toml", "--out", "film.gif"]);
    assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
    assert!(run.stderr.contains("film.gif: is a folder"), "{}", run.stderr);
}

#[cfg(unix)]
fn is_root() -> bool {
    let id = Command::new("id").arg("-u").output().unwrap();
    id.stdout == b"0\n"
}

/// The error for a user without permission to write into `locked`. Root may write anywhere, so the test changes the user first.
#[cfg(unix)]
fn run_as_a_user(folder: &Folder) -> Run {
    use std::os::unix::{fs::PermissionsExt, process::CommandExt};
    let mode = |path: PathBuf, mode: u32| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    fs::create_dir(folder.path("locked")).unwrap();
    mode(folder.path("locked"), 0o555);
    mode(folder.path(""), 0o755);
    let arguments = ["render", "scene.toml", "--out", "locked/deep/f.png"];
    let run = if is_root() {
        const NOBODY: u32 = 65_534;
        let program = folder.path("program");
        fs::copy(env!("CARGO_BIN_EXE_bansho"), &program).unwrap();
        let mut command = Command::new(program);
        Run::of(command.args(arguments).current_dir(folder.path("")).uid(NOBODY).gid(NOBODY).output().unwrap())
    } else {
        folder.run(&arguments)
    };
    mode(folder.path("locked"), 0o755);
    run
}

#[cfg(unix)]
#[test]
fn a_folder_that_may_not_be_written_is_an_error_before_anything_is_drawn() {
    let folder = Folder::with_scene(FLAME);
    let run = run_as_a_user(&folder);
    assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
    assert!(run.stderr.contains("no permission to write there"), "{}", run.stderr);
    assert!(folder.files("locked").is_empty() && !folder.path("locked/deep").exists());
}

/// Rain that sets in after half a second, so that the files of later frames are larger.
const GROWING_RAIN: &str = "\
bansho = 2
[picture]
size = [192, 144]
frames = 24
[sky]
[[rain]]
rate_mm_per_h = { keys = [[0.0, 0.0], [0.45, 0.0], [0.55, 200.0]] }
";

#[test]
fn a_frame_that_cannot_be_written_stops_the_shot_with_its_number_and_leaves_those_before() {
    let folder = Folder::with_scene(GROWING_RAIN);
    folder.succeed(&["render", "scene.toml", "--out", "whole/f.png"]);
    let whole = folder.files("whole");
    // As many kibibytes as the first frames need and the others exceed.
    let kibibytes = whole["f.0000.png"].len().div_ceil(1024);
    let failing = whole.values().position(|file| file.len() > 1024 * kibibytes).unwrap();
    assert!((8..20).contains(&failing), "{failing}");
    for in_flight in ["1", "4"] {
        let line = format!(
            "ulimit -f {kibibytes}; exec {} render scene.toml --threads 4 --frames-in-flight {in_flight} --out {in_flight}/f.png",
            env!("CARGO_BIN_EXE_bansho")
        );
        let run = Run::of(Command::new("bash").args(["-c", &line]).current_dir(folder.path("")).output().unwrap());
        assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
        let expected = format!("error: frame {failing}: {in_flight}/f.{failing:04}.png: the file would be larger than");
        assert!(run.stderr.contains(&expected), "{}", run.stderr);
        assert_eq!(run.stderr.matches("frame ").count(), 1, "{}", run.stderr);
        let files = folder.files(in_flight);
        assert!(files.iter().eq(whole.iter().take(failing)), "{in_flight} in flight: {:?}", files.keys());
    }
}

/// A disk of its own with room for a few frames, until it is dropped.
struct SmallDisk(PathBuf);

impl SmallDisk {
    fn mount(at: &Path, kibibytes: usize) -> Self {
        fs::create_dir_all(at).unwrap();
        let arguments = ["-t", "tmpfs", "-o", &format!("size={kibibytes}k"), "tmpfs"];
        let mounted = Command::new("mount").args(arguments).arg(at).status().unwrap();
        assert!(mounted.success(), "a small disk could not be mounted");
        Self(at.to_path_buf())
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let unmounted = Command::new("umount").arg(&self.0).status();
        assert!(unmounted.is_ok_and(|status| status.success()), "{} is still mounted", self.0.display());
    }
}

#[test]
#[ignore = "needs root, to mount a small disk"]
fn a_full_disk_is_an_error_and_leaves_only_whole_frames() {
    let folder = Folder::with_scene(&FLAME.replace("48, 64", "96, 128").replace("frames = 6", "frames = 100"));
    let _disk = SmallDisk::mount(&folder.path("disk"), 64);
    for in_flight in ["4", "1"] {
        folder.files("disk").keys().for_each(|name| fs::remove_file(folder.path("disk").join(name)).unwrap());
        let work = ["--bits", "16", "--threads", "4", "--frames-in-flight", in_flight];
        let run = folder.run(&[&["render", "scene.toml", "--out", "disk/f.png"], &work[..]].concat());
        assert_eq!((run.code, run.errors()), (Some(1), 1), "{}", run.stderr);
        assert!(run.stderr.contains("the disk is full"), "{}", run.stderr);
        // The frames before the one that failed, and no other.
        let files = folder.files("disk");
        assert!((1..100).contains(&files.len()), "{:?}", files.keys());
        assert!(run.stderr.contains(&format!("error: frame {}: ", files.len())), "{}: {}", files.len(), run.stderr);
        for (index, (name, bytes)) in files.iter().enumerate() {
            assert_eq!(*name, format!("f.{index:04}.png"));
            assert_eq!(decode_png(bytes).width, 96, "{name}");
        }
    }
    // What is left of the disk is filled to the last block.
    let filler = folder.path("disk/filler");
    for size in [4096, 1] {
        let mut file = fs::OpenOptions::new().create(true).append(true).open(&filler).unwrap();
        while file.write_all(&vec![0; size]).is_ok() {}
    }
    let new = folder.run(&["new", "disk/fire"]);
    assert_eq!((new.code, new.errors()), (Some(1), 1), "{}", new.stderr);
    assert!(!folder.path("disk/fire.toml").exists(), "half a scene would be in the way of the next");
    fs::remove_file(filler).unwrap();
    let film = folder.run(&["render", "scene.toml", "--out", "disk/film.apng"]);
    assert_eq!((film.code, film.errors()), (Some(1), 1), "{}", film.stderr);
    assert!(!folder.path("disk/film.apng").exists());
}

/// How many frames of a film can be read, as ffprobe counts them.
fn playable_frames(film: &Path) -> usize {
    let arguments = ["-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames", "-of", "csv=p=0"];
    let output = Command::new("ffprobe").args(arguments).arg(film).output().unwrap();
    String::from_utf8(output.stdout).unwrap().trim().trim_end_matches(',').parse().unwrap_or(0)
}

#[test]
#[ignore = "needs root, to mount small disks, and ffmpeg"]
fn a_film_on_a_disk_that_fills_is_whole_or_an_error() {
    const FRAMES: usize = 24;
    let folder = Folder::with_scene(&FLAME.replace("48, 64", "96, 128").replace("frames = 6", "frames = 24"));
    for extension in ["mp4", "mov", "webm"] {
        let spacious = format!("spacious.{extension}");
        folder.succeed(&["render", "scene.toml", "--out", &spacious]);
        let needed = fs::metadata(folder.path(&spacious)).unwrap().len() as usize / 1024;
        // Around the size of the film, where only its end does not fit, and far below it.
        let mut outcomes = [0; 2];
        for kibibytes in
            [needed / 4, needed / 2, needed - 8, needed - 4, needed, needed + 4, needed + 8, 2 * needed + 64]
        {
            let disk = folder.path("disk");
            let _mounted = SmallDisk::mount(&disk, kibibytes.next_multiple_of(4).max(4));
            let name = format!("disk/film.{extension}");
            let run = folder.run(&["render", "scene.toml", "--out", &name]);
            let film = folder.path(&name);
            let is_whole = film.exists() && playable_frames(&film) == FRAMES;
            let context = format!("{extension}, {kibibytes} of {needed} KiB: {}", run.stderr);
            assert_eq!(run.code, Some(if is_whole { 0 } else { 1 }), "{context}");
            assert!(is_whole || run.stderr.contains("the disk is full"), "{context}");
            assert_eq!(film.exists(), is_whole, "{context}");
            outcomes[usize::from(is_whole)] += 1;
        }
        assert!(outcomes[0] >= 3 && outcomes[1] >= 1, "{extension}: {outcomes:?}");
    }
}
