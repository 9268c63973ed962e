//! The files of a flipbook.

use std::path::{Path, PathBuf};

use bansho_base::{
    color::{AlphaConvention, View},
    frame::{DisplayEncoding, DisplayImage, DisplayPixels, Frame, FrameHeader},
    host::observer::{Observer, Stage, StageGuard, check},
    image::{Image, Rect},
};
use bansho_media::{
    MediaError, exr,
    files::{atomic, overwrite_policy::OverwritePolicy, provenance},
    format::OutputKind,
    imageops::{
        bleed::bleed_colors,
        sprite_sheet::{SheetLayout, tile, tile_display},
    },
    png::{self, PngEffort},
};
use bansho_render::{
    Plan,
    display::{BitDepth, display},
};

use super::{
    FlipbookSummary,
    lights::{self, FlameLight},
    motion::{self, MotionField},
};
use crate::job::{checks::finished_files::FinishedFiles, error::JobError};

use rayon::prelude::*;
use serde_json::{Value, json};

/// One frame of a flipbook.
pub(crate) struct Tile {
    header: FrameHeader,
    color: Color,
    motion: MotionField,
}

/// The colors of a frame in the form that the format needs.
enum Color {
    Display(DisplayImage),
    Linear(Image<4>),
}

impl Tile {
    /// Whether a phenomenon of the frame has a motion AOV.
    pub(crate) fn has_motion(&self) -> bool {
        self.motion.has_aov
    }

    fn display(&self) -> Option<&DisplayImage> {
        if let Color::Display(picture) = &self.color { Some(picture) } else { None }
    }

    fn linear(&self) -> Option<&Image<4>> {
        if let Color::Linear(picture) = &self.color { Some(picture) } else { None }
    }
}

/// All frames of a flipbook, in order.
pub(crate) struct DrawnFrames<'a> {
    pub(crate) numbers: &'a [i64],
    pub(crate) tiles: &'a [Tile],
    /// The point lights of each frame.
    pub(crate) lights: &'a [Vec<FlameLight>],
}

/// The names and the format of a flipbook's files.
pub(crate) struct Files {
    /// `DIR/NAME`
    pub(crate) base: PathBuf,
    pub(crate) kind: OutputKind,
    pub(crate) view: View,
    pub(crate) bits: BitDepth,
    /// Convention of the straight alpha of PNG sheets.
    pub(crate) alpha: AlphaConvention,
    /// Whether the lights are also written as glTF.
    pub(crate) gltf: bool,
    /// Which existing files may be overwritten.
    pub(crate) overwrite: OverwritePolicy,
}

impl Files {
    fn is_linear(&self) -> bool {
        self.kind.is_scene_linear()
    }

    /// Whether sheets contain light that is too dark for 8 bits.
    pub(crate) fn is_exact(&self) -> bool {
        self.is_linear() || self.bits == BitDepth::Sixteen
    }

    fn path(&self, suffix: &str) -> PathBuf {
        let mut name = self.base.clone().into_os_string();
        name.push(suffix);
        name.into()
    }

    fn sheet_path(&self, sheet: &str) -> PathBuf {
        self.path(&format!("_{sheet}.{}", self.kind.extension()))
    }

    /// All files, the JSON last.
    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        let sheets: &[&str] = if self.is_linear() { &["color", "motion"] } else { &["color", "alpha", "motion"] };
        let lights = self.gltf.then(|| self.path(".gltf"));
        sheets.iter().map(|sheet| self.sheet_path(sheet)).chain(lights).chain([self.path(".json")]).collect()
    }

    /// The tile of a frame.
    pub(crate) fn tile(&self, frame: &Frame, observer: &dyn Observer) -> Tile {
        Tile { motion: MotionField::of_frame(frame), header: frame.header.clone(), color: self.color(frame, observer) }
    }

    fn color(&self, frame: &Frame, observer: &dyn Observer) -> Color {
        if self.is_linear() {
            return Color::Linear(frame.beauty.clone());
        }
        let _stage = StageGuard::begin(observer, Stage::View);
        Color::Display(display(frame, &self.view, self.bits, self.alpha))
    }

    /// Lays out the tiles and writes every file.
    pub(crate) fn write(
        &self,
        plan: &Plan,
        sheet: &SheetLayout,
        drawn: &DrawnFrames,
        observer: &dyn Observer,
    ) -> Result<FlipbookSummary, JobError> {
        let _stage = StageGuard::begin(observer, Stage::Write);
        let (finished, tiles) = (FinishedFiles::default(), drawn.tiles);
        let motion = tiles.iter().map(|tile| &tile.motion.pixels);
        let scale = if self.is_linear() { 1.0 } else { motion::scale(motion) };
        check(observer).map_err(|_| JobError::Cancelled)?;
        if self.is_linear() {
            self.write_linear(sheet, tiles, &finished)?;
        } else {
            self.write_display(sheet, tiles, scale, &finished)?;
        }
        if self.gltf {
            let bytes = lights::encode_gltf(drawn.lights, plan.fps().frame_s(), plan.loop_s().is_some());
            self.write_file(self.path(".gltf"), &bytes, &finished)?;
        }
        let text = format!("{:#}\n", self.description(plan, sheet, drawn, scale));
        self.write_file(self.path(".json"), text.as_bytes(), &finished)?;
        match finished.removed_or_changed() {
            files if files.is_empty() => Ok(FlipbookSummary { frames: tiles.len(), files: self.paths() }),
            files => Err(JobError::FilesLost { files }),
        }
    }

    /// Writes one of the files, atomically.
    fn write_file(&self, path: PathBuf, bytes: &[u8], finished: &FinishedFiles) -> Result<(), JobError> {
        atomic::write_bytes(&path, bytes, &self.overwrite)?;
        finished.record(path);
        Ok(())
    }

    fn write_linear(&self, sheet: &SheetLayout, tiles: &[Tile], finished: &FinishedFiles) -> Result<(), JobError> {
        let header = FrameHeader { display_size: sheet.size(), data_origin: [0, 0], ..tiles[0].header.clone() };
        let colors: Vec<Image<4>> = tiles.iter().filter_map(|tile| tile.linear().cloned()).collect();
        let motion: Vec<Image<2>> = tiles.iter().map(|tile| tile.motion.pixels.clone()).collect();
        let motion = tile(&motion, sheet.columns, 0, [0.0; 2])?;
        let [width, height] = sheet.size();
        let pixels = motion.pixels().iter().map(|&[x, y]| [x, y, 0.0, 1.0]).collect();
        let motion =
            Image::from_pixels(width, height, pixels).unwrap_or_else(|| Image::filled(width, height, [0.0; 4]));
        let color = tile(&colors, sheet.columns, 0, [0.0; 4])?;
        let encode_color: fn(&Frame, &Path) -> Result<Vec<u8>, MediaError> = exr::encode;
        for (sheet, beauty, encode) in [("color", color, encode_color), ("motion", motion, exr::encode_data)] {
            let path = self.sheet_path(sheet);
            let header = FrameHeader { fingerprint: fingerprint(tiles, sheet), ..header.clone() };
            let content = Rect::from_size(beauty.width(), beauty.height());
            let frame = Frame {
                header,
                beauty,
                depth: None,
                channels: Vec::new(),
                opaque: false,
                content,
                metadata: Vec::new(),
            };
            let bytes = encode(&frame, &path)?;
            self.write_file(path, &bytes, finished)?;
        }
        Ok(())
    }

    fn write_display(
        &self,
        sheet: &SheetLayout,
        tiles: &[Tile],
        scale: f32,
        finished: &FinishedFiles,
    ) -> Result<(), JobError> {
        let mut colors: Vec<DisplayImage> = tiles.iter().filter_map(|tile| tile.display().cloned()).collect();
        // Each tile for itself, so that no color comes from another frame.
        colors.par_iter_mut().for_each(bleed_colors);
        let color = tile_display(&colors, sheet.columns, 0, [0; 4])?;
        let encoding = DisplayEncoding::Data;
        let alpha = DisplayImage { opaque: true, encoding, pixels: alpha_as_gray(&color.pixels), ..color };
        let motion = tiles.iter().map(|tile| DisplayImage {
            width: tile.motion.pixels.width(),
            height: tile.motion.pixels.height(),
            opaque: true,
            alpha: self.alpha,
            encoding,
            pixels: DisplayPixels::Sixteen(
                tile.motion.pixels.pixels().iter().map(|&motion| motion::encode(motion, scale)).collect(),
            ),
        });
        let motion = tile_display(&motion.collect::<Vec<_>>(), sheet.columns, 0, [0; 4])?;
        for (sheet, picture) in [("color", &color), ("alpha", &alpha), ("motion", &motion)] {
            let path = self.sheet_path(sheet);
            let bytes = png::encode(picture, &fingerprint(tiles, sheet), PngEffort::Fast, &path)?;
            self.write_file(path, &bytes, finished)?;
        }
        Ok(())
    }

    fn description(&self, plan: &Plan, sheet: &SheetLayout, drawn: &DrawnFrames, scale: f32) -> Value {
        let fps = plan.fps();
        let color = match self.is_linear() {
            true => {
                json!({
                    "file": name(&self.sheet_path("color")),
                    "space": "ACEScg",
                    "alpha": "premultiplied",
                    "alpha_convention": "linear",
                    "exposure_ev100": plan.exposure_ev100,
                })
            }
            false => json!({
                "file": name(&self.sheet_path("color")),
                "space": if self.view == View::RAW { "ACEScg" } else { "sRGB" },
                "alpha": "straight",
                "alpha_convention": self.alpha.name(),
            }),
        };
        let ([width, height], crop) = (plan.size(), plan.window());
        let mut description = json!({
            "format": 1,
            "program": provenance::PROGRAM,
            "size": sheet.size(),
            "grid": [sheet.columns, sheet.rows()],
            "tile": sheet.cell,
            "picture": [width, height],
            "crop": { "x": crop.x, "y": crop.y, "width": crop.width, "height": crop.height },
            "padding": {
                "left": crop.x, "top": crop.y, "right": width - crop.right(), "bottom": height - crop.bottom(),
            },
            "frame_count": sheet.count,
            "fps": f64::from(fps.frames) / f64::from(fps.seconds),
            "duration_s": sheet.count as f64 * fps.frame_s(),
            "loop": plan.loop_s().is_some(),
            "color": color,
        });
        if !self.is_linear() {
            description["alpha"] = json!({ "file": name(&self.sheet_path("alpha")), "space": "linear" });
        }
        description["blend"] = self.blend();
        description["motion"] = self.motion(scale);
        description["lights"] = lights::meaning();
        if self.gltf {
            description["lights"]["file"] = json!(name(&self.path(".gltf")));
        }
        let mut frames = Vec::with_capacity(drawn.numbers.len());
        for (index, &number) in drawn.numbers.iter().enumerate() {
            let rect = sheet.cell_rect(index);
            let time_s = index as f64 * fps.frame_s();
            frames.push(json!({
                "number": number, "time_s": time_s, "x": rect.x, "y": rect.y, "width": rect.width, "height": rect.height,
                "lights": lights::describe(plan, number, &drawn.lights[index]),
            }));
        }
        description["frames"] = frames.into();
        description
    }

    /// How an engine draws the color sheet: over the background, or added to it.
    fn blend(&self) -> Value {
        if self.is_linear() {
            return json!({
                "blended_values": "linear",
                "mode": "premultiplied alpha",
                "factors": ["one", "one_minus_source_alpha"],
                "additive": { "mode": "additive", "factors": ["one", "one"] },
            });
        }
        let meaning = "adds the light and hides nothing: right for flames and auroras without smoke";
        let (values, sampled, additive) = match self.alpha {
            AlphaConvention::Linear => (
                "linear",
                match self.view == View::RAW {
                    true => "linear texture; the target is linear or an sRGB render target",
                    false => "sRGB texture, decoded when it is sampled; the target is linear or an sRGB render target",
                },
                json!({
                    "mode": "additive, color times alpha",
                    "factors": ["source_alpha", "one"],
                    "meaning": meaning,
                }),
            ),
            // The sum of encoded values is not the encoded sum of light. `screen` is much closer to it, and never exceeds 1.
            AlphaConvention::Encoded => (
                "sRGB-encoded",
                "texture without sRGB decoding; the target is not decoded either",
                json!({
                    "mode": "screen, color premultiplied by alpha",
                    "factors": ["one", "one_minus_source_color"],
                    "meaning": meaning,
                }),
            ),
        };
        json!({
            "blended_values": values,
            "sampling": sampled,
            "mode": "straight alpha",
            "factors": ["source_alpha", "one_minus_source_alpha"],
            "additive": additive,
        })
    }

    fn motion(&self, scale: f32) -> Value {
        let file = name(&self.sheet_path("motion"));
        let meaning = "pixels of a tile to the next frame: red to the right, green down";
        if self.is_linear() {
            return json!({ "file": file, "space": "linear", "meaning": meaning });
        }
        json!({
            "file": file, "space": "linear", "meaning": meaning, "bits": 16,
            "zero_code": motion::ZERO_CODE, "largest_code": u16::MAX, "scale_pixels": scale,
            "formula": "pixels = (code - zero_code) / (largest_code - zero_code) * scale_pixels",
        })
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Alpha as a gray picture.
fn alpha_as_gray(pixels: &DisplayPixels) -> DisplayPixels {
    match pixels {
        DisplayPixels::Eight(pixels) => {
            DisplayPixels::Eight(pixels.iter().map(|&[.., a]| [a, a, a, u8::MAX]).collect())
        }
        DisplayPixels::Sixteen(pixels) => {
            DisplayPixels::Sixteen(pixels.iter().map(|&[.., a]| [a, a, a, u16::MAX]).collect())
        }
    }
}

/// The fingerprint of a sheet, which differs from those of frames and of other sheets.
fn fingerprint(tiles: &[Tile], sheet: &str) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    tiles.iter().for_each(|tile| {
        hasher.update(&tile.header.fingerprint);
    });
    *hasher.update(sheet.as_bytes()).finalize().as_bytes()
}
