//! Sinks, as the program uses them.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use bansho_base::{
    color::AlphaConvention,
    frame::{DisplayEncoding, DisplayImage, DisplayPixels},
};
use bansho_media::{
    MediaError,
    files::naming::OutputPattern,
    film::ffmpeg::{VideoOptions, WebmCodec},
    format::{OutputKind, PictureFormat},
    output::{
        frame_file::existing_fingerprint,
        sink::{FinishedPicture, FrameSlot, Sink, SinkOptions},
    },
};

#[test]
fn films_refuse_light_that_they_cannot_name() {
    let folder = tempfile::tempdir().unwrap();
    for (name, taken) in [("a.gif", false), ("a.apng", true)] {
        let pattern = OutputPattern::parse(&folder.path().join(name), 2).unwrap();
        let sink = Sink::open(pattern, SinkOptions::new([4, 3], [30, 1], 2)).unwrap();
        let raw = DisplayImage { encoding: DisplayEncoding::LinearAcescg, ..picture(4, 3, 0) };
        let written = sink.write(FrameSlot { index: 0, number: 0 }, FinishedPicture::Display(&raw, &[0; 32]));
        assert_eq!(written.is_ok(), taken, "{name}: {written:?}");
        assert!(taken || matches!(written, Err(MediaError::NotSrgb { .. })));
    }
}

/// Smooth colors with a soft alpha that move a little each frame.
fn picture(width: usize, height: usize, frame: usize) -> DisplayImage {
    let pixel = |i: usize| {
        let (x, y) = (i % width, i / width);
        [(255 * x / width) as u8, (200 * y / height) as u8, (40 + frame * 10) as u8, (255 - 200 * y / height) as u8]
    };
    let pixels = DisplayPixels::Eight((0..width * height).map(pixel).collect());
    DisplayImage {
        width,
        height,
        opaque: false,
        alpha: AlphaConvention::Linear,
        encoding: DisplayEncoding::Srgb,
        pixels,
    }
}

fn open(folder: &Path, name: &str, frames: usize, options: impl FnOnce(&mut SinkOptions)) -> Result<Sink, MediaError> {
    let pattern = OutputPattern::parse(&folder.join(name), frames).unwrap();
    let mut chosen = SinkOptions::new([65, 67], [24000, 1001], frames);
    options(&mut chosen);
    Sink::open(pattern, chosen)
}

fn write(sink: &Sink, index: usize) -> Result<(), MediaError> {
    let slot = FrameSlot { index, number: index as i64 + 1001 };
    sink.write(slot, FinishedPicture::Display(&picture(65, 67, index), &[index as u8; 32]))
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_sequence_is_written_from_many_threads_and_found_again() {
    let folder = tempfile::tempdir().unwrap();
    let sink = open(folder.path(), "new/f.png", 6, |_| {}).unwrap();
    std::thread::scope(|scope| {
        for thread in 0..3 {
            let sink = &sink;
            scope.spawn(move || (thread..6).rev().step_by(3).for_each(|index| write(sink, index).unwrap()));
        }
        for index in 0..6 {
            write(&sink, index).unwrap();
        }
    });
    for index in 0..6 {
        assert_eq!(existing_fingerprint(&sink.path(index + 1001), sink.kind()), Some([index as u8; 32]));
    }
    sink.finish().unwrap();
    assert_eq!(names(&folder.path().join("new")).len(), 6);
}

#[test]
fn a_film_that_is_not_finished_leaves_nothing() {
    for name in ["a.apng", "a.gif"] {
        let folder = tempfile::tempdir().unwrap();
        let sink = open(folder.path(), name, 3, |_| {}).unwrap();
        write(&sink, 0).unwrap();
        drop(sink);
        assert!(names(folder.path()).is_empty(), "{name}");
        let sink = open(folder.path(), name, 3, |_| {}).unwrap();
        write(&sink, 0).unwrap();
        assert!(matches!(sink.finish(), Err(MediaError::FramesMissing { got: 1, expected: 3, .. })));
        assert!(names(folder.path()).is_empty(), "{name}");
    }
}

#[test]
fn films_take_frames_out_of_order_and_are_the_same_bytes() {
    for name in ["a.apng", "a.gif"] {
        let folder = tempfile::tempdir().unwrap();
        let film = |order: &[usize]| {
            let sink = open(folder.path(), name, order.len(), |_| {}).unwrap();
            order.iter().for_each(|index| write(&sink, *index).unwrap());
            sink.finish().unwrap();
            fs::read(folder.path().join(name)).unwrap()
        };
        assert!(film(&[0, 1, 2, 3]) == film(&[3, 1, 0, 2]), "{name}");
        assert_eq!(names(folder.path()), [name]);
    }
}

#[test]
fn pictures_of_the_wrong_kind_or_size_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let sink = open(folder.path(), "a.####.exr", 2, |_| {}).unwrap();
    assert_eq!(sink.picture_format(), PictureFormat::Frame);
    assert!(matches!(write(&sink, 0), Err(MediaError::WrongPicture { expected: PictureFormat::Frame, .. })));
    let sink = open(folder.path(), "a.gif", 2, |options| options.size = [64, 67]).unwrap();
    assert_eq!(sink.picture_format(), PictureFormat::OpaqueDisplay);
    assert!(matches!(write(&sink, 0), Err(MediaError::Size { width: 65, .. })));
    assert!(matches!(open(folder.path(), "a.gif", 2, |o| o.size = [0, 1]), Err(MediaError::Size { .. })));
    assert!(matches!(open(folder.path(), "a.apng", 2, |o| o.fps = [0, 1]), Err(MediaError::FrameRate { .. })));
}

#[test]
fn an_output_that_cannot_be_written_is_refused_before_the_first_frame() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    let error = open(folder.path(), "file/a.####.png", 2, |_| {}).err().unwrap();
    assert!(matches!(error, MediaError::NotAFolder { .. }), "{error}");
    fs::create_dir(folder.path().join("b.gif")).unwrap();
    assert!(matches!(open(folder.path(), "b.gif", 2, |_| {}), Err(MediaError::IsFolder { .. })));
}

#[test]
fn without_ffmpeg_the_error_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let missing = |options: &mut SinkOptions| options.video.program = PathBuf::from("no-such-program-as-this");
    let error = open(folder.path(), "a.mp4", 2, missing).err().unwrap().to_string();
    for part in ["a.mp4", "no-such-program-as-this", "apt install ffmpeg", "brew", ".apng", ".gif", ".png", ".exr"] {
        assert!(error.contains(part), "{error}");
    }
    assert!(names(folder.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn what_the_program_says_last_stands_in_the_error() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("ffmpeg");
    fs::write(&program, "#!/bin/sh\necho 'Unknown encoder libx264' >&2\nexit 7\n").unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let sink = open(folder.path(), "a.mp4", 1, |options| options.video.program = program).unwrap();
    // The pipe may or may not break before the first frame is written.
    let error = write(&sink, 0).and_then(|()| sink.finish()).unwrap_err().to_string();
    assert!(error.contains("Unknown encoder libx264") && error.contains('7'), "{error}");
    assert_eq!(names(folder.path()), ["ffmpeg"]);
}

#[cfg(unix)]
#[test]
fn a_program_that_complains_has_failed_though_its_status_is_good() {
    use std::os::unix::fs::PermissionsExt;
    for (complaint, is_full) in [("t.part: No space left on device", true), ("Error closing file", false)] {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("ffmpeg");
        fs::write(&program, format!("#!/bin/sh\ncat >/dev/null\necho '{complaint}' >&2\nexit 0\n")).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        let sink = open(folder.path(), "a.mp4", 1, |options| options.video.program = program).unwrap();
        let error = write(&sink, 0).and_then(|()| sink.finish()).unwrap_err();
        assert_eq!(matches!(error, MediaError::DiskFull { .. }), is_full, "{error}");
        assert!(is_full || error.to_string().contains(complaint), "{error}");
        assert_eq!(names(folder.path()), ["ffmpeg"]);
    }
}

/// Properties of the first stream, by ffprobe.
fn probe(path: &Path) -> String {
    let entries = "stream=codec_name,width,height,pix_fmt,color_range,color_space,color_transfer,color_primaries,\
                   r_frame_rate,nb_read_frames:stream_tags=alpha_mode";
    let arguments = ["-v", "error", "-count_frames", "-show_entries", entries, "-of", "default=noprint_wrappers=1"];
    let output = Command::new("ffprobe").args(arguments).arg(path).output().unwrap();
    String::from_utf8(output.stdout).unwrap().to_lowercase()
}

/// The pixels of the first frame, as RGBA.
fn first_frame(path: &Path, decoder: &[&str]) -> Vec<[u8; 4]> {
    let mut command = Command::new("ffmpeg");
    command.args(["-v", "error"]).args(decoder).arg("-i").arg(path).args(["-frames:v", "1", "-f", "rawvideo"]);
    let convert = "scale=in_color_matrix=bt709:flags=accurate_rnd+full_chroma_int,format=rgba";
    let output = command.args(["-vf", convert, "-"]).output().unwrap();
    output.stdout.as_chunks().0.to_vec()
}

#[test]
#[ignore = "needs ffmpeg"]
fn films_carry_their_frames_colors_and_tags() {
    let folder = tempfile::tempdir().unwrap();
    let vp9: &[&str] = &["-c:v", "libvpx-vp9"];
    let cases: [(&str, WebmCodec, &str, usize, &[&str]); 4] = [
        ("a.mp4", WebmCodec::Vp9, "h264", 66, &[]),
        ("a.mov", WebmCodec::Vp9, "prores", 65, &[]),
        ("a.webm", WebmCodec::Vp9, "vp9", 66, vp9),
        ("b.webm", WebmCodec::Av1, "av1", 66, &[]),
    ];
    for (name, webm, codec, width, decoder) in cases {
        let sink = open(folder.path(), name, 5, |o| o.video = VideoOptions { webm, ..o.video.clone() }).unwrap();
        [1, 0, 2, 4, 3].into_iter().for_each(|index| write(&sink, index).unwrap());
        let has_alpha = sink.picture_format() == PictureFormat::Display;
        sink.finish().unwrap();
        let path = folder.path().join(name);
        let said = probe(&path);
        let colors = ["color_space=bt709", "color_transfer=iec61966-2-1", "color_primaries=bt709", "color_range=tv"];
        for part in colors.iter().chain(&["nb_read_frames=5", "24000/1001", &format!("codec_name={codec}")]) {
            assert!(said.contains(part), "{name}: no {part} in\n{said}");
        }
        check_colors(name, &first_frame(&path, decoder), width, has_alpha);
    }
    assert_eq!(names(folder.path()), ["a.mov", "a.mp4", "a.webm", "b.webm"]);
}

fn check_colors(name: &str, found: &[[u8; 4]], width: usize, has_alpha: bool) {
    let original = picture(65, 67, 0);
    let expected = if has_alpha { original } else { bansho_media::imageops::flatten::over_black(&original) };
    let DisplayPixels::Eight(expected) = expected.pixels else { unreachable!() };
    let mut worst = 0;
    for (i, wanted) in expected.iter().enumerate() {
        let pixel = found[i / 65 * width + i % 65];
        worst = pixel.iter().zip(wanted).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0).max(worst);
    }
    // With a wrong matrix, saturated red differs by more than 20 codes.
    assert!(worst <= 12, "{name}: wrong by {worst} codes");
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_film_that_is_dropped_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let sink = open(folder.path(), "a.mp4", 50, |_| {}).unwrap();
    (0..3).for_each(|index| write(&sink, index).unwrap());
    drop(sink);
    assert!(names(folder.path()).is_empty());
}

/// A file system of 64 KiB, unmounted when dropped.
struct TinyDisk(tempfile::TempDir);

impl TinyDisk {
    fn mount() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mount = Command::new("mount").args(["-t", "tmpfs", "-o", "size=64k", "tmpfs"]).arg(folder.path()).status();
        assert!(mount.unwrap().success(), "mounting needs root");
        Self(folder)
    }
}

impl Drop for TinyDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.0.path()).status();
    }
}

#[test]
#[ignore = "needs root, to mount a small file system"]
fn a_full_disk_is_said_and_leaves_whole_frames_only() {
    let disk = TinyDisk::mount();
    let noise =
        |i: usize| ((i as u32).wrapping_mul(0x9E37_79B9) ^ (i as u32 >> 3).wrapping_mul(0x85EB_CA6B)).to_le_bytes();
    let pixels = DisplayPixels::Eight((0..65 * 67).map(noise).collect());
    let image = DisplayImage {
        width: 65,
        height: 67,
        opaque: false,
        alpha: AlphaConvention::Linear,
        encoding: DisplayEncoding::Srgb,
        pixels,
    };
    for name in ["f.png", "f.apng", "f.gif"] {
        let sink = open(disk.0.path(), name, 40, |_| {}).unwrap();
        let write =
            |index| sink.write(FrameSlot { index, number: index as i64 }, FinishedPicture::Display(&image, &[1; 32]));
        let failed = (0..40).find_map(|index| write(index).err()).or_else(|| sink.finish().err());
        assert!(matches!(failed, Some(MediaError::DiskFull { .. })), "{name}: {failed:?}");
        let left = names(disk.0.path());
        assert!(left.iter().all(|name| name.ends_with(".png")), "{left:?}");
        for name in left {
            let path = disk.0.path().join(name);
            assert_eq!(existing_fingerprint(&path, OutputKind::Png), Some([1; 32]), "{}", path.display());
            fs::remove_file(path).unwrap();
        }
    }
}
