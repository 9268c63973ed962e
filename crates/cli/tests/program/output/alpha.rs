//! Straight alpha as other programs blend it, beside the light that was there: the same scene over a plate of that background.

use std::process::{Command, Stdio};

use crate::support::{Folder, Png, decode_png};

/// A flame whose colors are all within the display's range, so that the truth over any background is known.
const FIRE: &str = "\
bansho = 2
[picture]
size = [160, 120]
exposure_ev100 = 11.5
[camera]
position = [0.0, 0.7, 2.6]
target = [0.0, 0.7, 0.0]
[[flame_sheet]]
";

/// Rays and their faint surroundings: most of their light is dark, and was lost where encoded values are blended. The sheets are straight and without diffuse light:
/// the more of the picture shines, the larger is the mean error over gray.
const AURORA: &str = "\
bansho = 2
[picture]
size = [160, 120]
exposure_ev100 = -7.5
white_balance_k = 4000
[camera]
position = [0.0, 1.7, 0.0]
target = [0.0, 34.0, -60.0]
vertical_fov_deg = 66.0
[[aurora]]
particles = { count = 20000 }
swirls = { displacement_km = 0.0 }
diffuse = { fraction = 0.0 }
";

/// Frames that are drawn; more than one for films.
const FRAMES: &str = "3-5";

/// A folder with `scene.toml`, and `over_black.toml` and `over_gray.toml`, which lay the same over a plate.
fn folder(text: &str) -> Folder {
    let folder = Folder::with_scene(text);
    for (name, code) in [("black", 0_u8), ("gray", 128)] {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 160, 120);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().unwrap().write_image_data(&vec![code; 160 * 120 * 3]).unwrap();
        std::fs::write(folder.path(&format!("{name}.png")), bytes).unwrap();
        folder.write(&format!("over_{name}.toml"), &format!("{text}[plate]\nimage = \"{name}.png\"\n"));
    }
    folder
}

fn scenes() -> [(&'static str, Folder); 2] {
    [("fire", folder(FIRE)), ("aurora", folder(AURORA))]
}

/// The picture over `background`, drawn by Bansho.
fn truth(folder: &Folder, background: &str, number: i64) -> Png {
    let (scene, out) = (format!("over_{background}.toml"), format!("truth_{background}.####.png"));
    if !folder.path(&format!("truth_{background}.{number:04}.png")).exists() {
        folder.succeed(&["render", &scene, "--view", "standard", "--frames", FRAMES, "-o", &out]);
    }
    decode_png(&std::fs::read(folder.path(&format!("truth_{background}.{number:04}.png"))).unwrap())
}

fn render(folder: &Folder, out: &str, more: &[&str]) {
    let usual = ["render", "scene.toml", "--transparent", "--view", "standard", "--frames", FRAMES, "-o", out];
    folder.succeed(&[&usual[..], more].concat());
}

/// Largest and mean difference of colors in codes.
fn difference(a: &Png, b: &Png) -> (u8, f64) {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let rgb = |png: &Png| -> Vec<u8> { png.bytes.chunks(png.channels).flat_map(|pixel| pixel[..3].to_vec()).collect() };
    let differences: Vec<u8> = rgb(a).iter().zip(rgb(b)).map(|(a, b)| a.abs_diff(b)).collect();
    let mean = differences.iter().map(|&d| f64::from(d)).sum::<f64>() / differences.len() as f64;
    (differences.into_iter().max().unwrap_or(0), mean)
}

fn run(program: &str, arguments: &[&str], folder: &Folder) {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(folder.path("")).stdin(Stdio::null());
    let output = command.output().unwrap_or_else(|error| panic!("{program}: {error}"));
    assert!(output.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn read(folder: &Folder, name: &str) -> Png {
    decode_png(&std::fs::read(folder.path(name)).unwrap())
}

/// What Pillow makes of frame `index` of a file over a background.
fn by_pillow(folder: &Folder, file: &str, index: usize, code: u8) -> Png {
    let program = "\
import sys
from PIL import Image
file, index, code = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
image = Image.open(file)
image.seek(index)
image = image.convert('RGBA')
background = Image.new('RGBA', image.size, (code, code, code, 255))
Image.alpha_composite(background, image).convert('RGB').save('pillow.png')
";
    run("python3", &["-c", program, file, &index.to_string(), &code.to_string()], folder);
    read(folder, "pillow.png")
}

#[test]
#[ignore = "needs Pillow"]
fn pillow_blends_png_and_apng_exactly_over_black_and_nearly_over_gray() {
    for (name, folder) in scenes() {
        render(&folder, "f.####.png", &[]);
        render(&folder, "f.apng", &[]);
        render(&folder, "linear.####.png", &["--alpha", "linear"]);
        for (index, number) in (3..6).enumerate() {
            let png = format!("f.{number:04}.png");
            let black = truth(&folder, "black", number);
            assert_eq!(difference(&by_pillow(&folder, &png, 0, 0), &black).0, 0, "{name} {number}");
            assert_eq!(difference(&by_pillow(&folder, "f.apng", index, 0), &black).0, 0, "{name} {number}");
            // Made for linear light, the same picture is wrong here by more than a code in the mean.
            let linear = by_pillow(&folder, &format!("linear.{number:04}.png"), 0, 0);
            assert!(difference(&linear, &black).1 > 1.0, "{name} {number}: {:?}", difference(&linear, &black));

            // What is exact over black cannot be exact over gray too: one alpha serves three colors, and must carry the brightest.
            let over_gray = by_pillow(&folder, &png, 0, 128);
            let (_, mean) = difference(&over_gray, &truth(&folder, "gray", number));
            assert!(mean < 5.0, "{name} {number}: {mean} in the mean over gray");
        }
    }
}

#[test]
#[ignore = "needs chromium"]
fn chromium_blends_as_the_truth_to_a_code() {
    for (name, folder) in scenes() {
        render(&folder, "f.####.png", &[]);
        folder.write("page.html", "<body style='margin:0;background:#000'><img src=f.0003.png style='display:block'>");
        let page = format!("file://{}", folder.path("page.html").display());
        let user = format!("--user-data-dir={}", folder.path("chromium").display());
        let arguments = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--hide-scrollbars",
            "--force-color-profile=srgb",
            "--force-device-scale-factor=1",
            "--window-size=600,400",
            "--screenshot=screen.png",
        ];
        run("chromium", &[&arguments[..], &[&user, &page]].concat(), &folder);
        let screen = read(&folder, "screen.png");
        let bytes = screen.part([0, 0, 160, 120]);
        let shown = Png { width: 160, height: 120, bytes, channels: screen.channels, bits: 8 };
        let (worst, mean) = difference(&shown, &truth(&folder, "black", 3));
        assert!(worst <= 1 && mean < 0.1, "{name}: {worst} at most, {mean} in the mean");
    }
}

/// The first frame of a film or a picture over a color, by the filter `overlay` in RGB.
fn by_overlay(folder: &Folder, file: &str, decoder: &[&str], color: &str) -> Png {
    let background = format!("color={color}:size=160x120,format=gbrp");
    let filter = "[1:v]scale=in_color_matrix=bt709:in_range=tv:flags=accurate_rnd+full_chroma_int+full_chroma_inp,\
                  format=gbrap[front];[0:v][front]overlay=format=gbrp";
    let filter =
        if file.ends_with(".png") { "[1:v]format=gbrap[front];[0:v][front]overlay=format=gbrp" } else { filter };
    let start = ["-y", "-loglevel", "error", "-f", "lavfi", "-i", &background];
    let end = ["-i", file, "-filter_complex", filter, "-frames:v", "1", "-pix_fmt", "rgb24", "overlay.png"];
    run("ffmpeg", &[&start[..], decoder, &end].concat(), folder);
    read(folder, "overlay.png")
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_film_and_a_picture_blend_by_overlay_as_the_truth() {
    for (name, folder) in scenes() {
        render(&folder, "f.####.png", &[]);
        let black = truth(&folder, "black", 3);
        let (worst, mean) = difference(&by_overlay(&folder, "f.0003.png", &[], "black"), &black);
        assert!(worst <= 1 && mean < 0.2, "{name}: {worst} at most, {mean} in the mean");
        for (file, decoder) in [("f.mov", &[][..]), ("f.webm", &["-c:v", "libvpx-vp9"][..])] {
            render(&folder, file, &[]);
            let (worst, mean) = difference(&by_overlay(&folder, file, decoder, "black"), &black);
            assert!(mean <= 2.0, "{name} {file}: {worst} at most, {mean} in the mean");
            let gray = by_overlay(&folder, "f.0003.png", &[], "0x808080");
            let (worst, mean) = difference(&by_overlay(&folder, file, decoder, "0x808080"), &gray);
            assert!(mean <= 2.0, "{name} {file}: {worst} at most, {mean} in the mean over gray beside the picture");
            let probe = Command::new("ffprobe")
                .args(["-v", "error", "-show_entries", "format_tags:stream_tags", "-of", "default=nw=1"])
                .arg(folder.path(file))
                .output()
                .unwrap();
            let said = String::from_utf8(probe.stdout).unwrap().to_lowercase();
            assert!(said.contains("bansho:alpha=encoded"), "{file}: {said}");
        }
    }
}

#[test]
fn files_say_what_their_alpha_is_made_for_and_resuming_heeds_it() {
    let folder = folder(FIRE);
    let says = |file: &str, words: &[u8]| {
        let bytes = std::fs::read(folder.path(file)).unwrap();
        bytes.windows(words.len()).any(|window| window == words)
    };
    let draw = |more: &[&str]| {
        let usual = ["render", "scene.toml", "--frames", "3", "-o", "f.png"];
        folder.succeed(&[&usual[..], more].concat())
    };
    draw(&[]);
    assert!(says("f.png", b"bansho:alpha\0encoded"));
    assert!(
        draw(&["--resume", "--alpha", "linear"]).stderr.contains("1 frame"),
        "another convention is another picture"
    );
    assert!(says("f.png", b"bansho:alpha\0linear"));
    draw(&["--view", "raw"]);
    assert!(says("f.png", b"bansho:alpha\0linear"));
    let refused = folder.run(&["render", "scene.toml", "--view", "raw", "--alpha", "encoded"]);
    assert_eq!(refused.code, Some(2));
    assert!(refused.stderr.contains("--alpha: the view `raw` applies no encoding"), "{}", refused.stderr);
    folder.succeed(&["render", "over_black.toml", "--frames", "3", "-o", "plate.png"]);
    assert!(!says("plate.png", b"bansho:alpha"));
}

#[test]
fn saturated_pixels_of_16_bits_keep_their_alpha() {
    let folder = folder(&FIRE.replace("exposure_ev100 = 11.5", "exposure_ev100 = 6"));
    for alpha in ["linear", "encoded"] {
        let more = ["--bits", "16", "--view", "standard", "--alpha", alpha];
        let usual = ["render", "scene.toml", "--frames", "3", "-o", "f.png"];
        folder.succeed(&[&usual[..], &more].concat());
        let png = read(&folder, "f.png");
        let codes: Vec<u16> = png.bytes.as_chunks().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect();
        let full = codes.as_chunks::<4>().0.iter().filter(|[r, _, _, a]| *r == u16::MAX && *a == u16::MAX).count();
        let lost = codes.as_chunks::<4>().0.iter().filter(|[r, g, b, a]| *a == 0 && r.max(g).max(b) > &0).count();
        assert!(full > 100 && lost == 0, "{alpha}: {full} saturated, {lost} lost");
    }
}
