//! The files of a flipbook.

use std::path::{Path, PathBuf};

use bansho_base::{
    color::{AlphaConvention, View},
    frame::{DisplayImage, DisplayPixels, Frame, FrameHeader},
    host::observer::{Observer, Stage, StageGuard, check},
    image::{Image, Rect},
};
use bansho_media::{
    exr,
    files::{atomic, overwrite_policy::OverwritePolicy, provenance},
    format::OutputKind,
    imageops::sprite_sheet::{SheetLayout, tile, tile_display},
    png::{self, PngEffort},
};
use bansho_render::{
    Plan,
    display::{BitDepth, display},
};

use super::{
    FlipbookSummary,
    motion::{self, Color, Tile},
};
use crate::job::{error::JobError, render::finished_files::Finished};

use serde_json::{Value, json};

/// Where a flipbook goes and what its sheets are.
pub(crate) struct Files {
    /// `DIR/NAME`
    pub(crate) base: PathBuf,
    pub(crate) kind: OutputKind,
    pub(crate) view: View,
    pub(crate) bits: BitDepth,
    /// What the straight alpha of PNG sheets is made for.
    pub(crate) alpha: AlphaConvention,
    /// Which files that are there may be written over.
    pub(crate) overwrite: OverwritePolicy,
}

impl Files {
    fn is_linear(&self) -> bool {
        self.kind.is_scene_linear()
    }

    /// Whether sheets hold light that 8 bits do not.
    pub(crate) fn is_exact(&self) -> bool {
        self.is_linear() || self.bits == BitDepth::Sixteen
    }

    fn path(&self, ending: &str) -> PathBuf {
        let mut name = self.base.clone().into_os_string();
        name.push(ending);
        name.into()
    }

    fn sheet_path(&self, what: &str) -> PathBuf {
        self.path(&format!("_{what}.{}", self.kind.extension()))
    }

    /// All files, the JSON last.
    pub(crate) fn paths(&self) -> Vec<PathBuf> {
        let sheets: &[&str] = if self.is_linear() { &["color", "motion"] } else { &["color", "alpha", "motion"] };
        sheets.iter().map(|what| self.sheet_path(what)).chain([self.path(".json")]).collect()
    }

    /// What color sheets keep of a frame.
    pub(crate) fn color(&self, frame: &Frame, observer: &dyn Observer) -> Color {
        if self.is_linear() {
            return Color::Linear(frame.beauty.clone());
        }
        let _stage = StageGuard::begin(observer, Stage::View);
        Color::Shown(display(frame, &self.view, self.bits, self.alpha))
    }

    /// Lays out the tiles and writes every file.
    pub(crate) fn write(
        &self,
        plan: &Plan,
        sheet: &SheetLayout,
        numbers: &[i64],
        tiles: &[Tile],
        observer: &dyn Observer,
    ) -> Result<FlipbookSummary, JobError> {
        let _stage = StageGuard::begin(observer, Stage::Write);
        let finished = Finished::default();
        let scale = if self.is_linear() { 1.0 } else { motion::scale(tiles) };
        check(observer).map_err(|_| JobError::Cancelled)?;
        if self.is_linear() {
            self.write_linear(sheet, tiles, &finished)?;
        } else {
            self.write_shown(sheet, tiles, scale, &finished)?;
        }
        let text = format!("{:#}\n", self.description(plan, sheet, numbers, scale));
        self.keep(self.path(".json"), text.as_bytes(), &finished)?;
        match finished.lost() {
            files if files.is_empty() => Ok(FlipbookSummary { files: self.paths() }),
            files => Err(JobError::FilesLost { files }),
        }
    }

    /// Writes one of the files.
    fn keep(&self, path: PathBuf, bytes: &[u8], finished: &Finished) -> Result<(), JobError> {
        atomic::write_bytes_with(&path, bytes, &self.overwrite)?;
        finished.note(path);
        Ok(())
    }

    fn write_linear(&self, sheet: &SheetLayout, tiles: &[Tile], finished: &Finished) -> Result<(), JobError> {
        let header = FrameHeader { display_size: sheet.size(), data_origin: [0, 0], ..tiles[0].header.clone() };
        let colors: Vec<Image<4>> = tiles.iter().filter_map(|tile| tile.linear().cloned()).collect();
        let motion: Vec<Image<2>> = tiles.iter().map(|tile| tile.motion.clone()).collect();
        let motion = tile(&motion, sheet.columns, 0, [0.0; 2])?;
        let [width, height] = sheet.size();
        let pixels = motion.pixels().iter().map(|&[x, y]| [x, y, 0.0, 1.0]).collect();
        let motion =
            Image::from_pixels(width, height, pixels).unwrap_or_else(|| Image::filled(width, height, [0.0; 4]));
        for (what, beauty) in [("color", tile(&colors, sheet.columns, 0, [0.0; 4])?), ("motion", motion)] {
            let path = self.sheet_path(what);
            let header = FrameHeader { fingerprint: fingerprint(tiles, what), ..header.clone() };
            let content = Rect::from_size(beauty.width(), beauty.height());
            let frame = Frame {
                header,
                beauty,
                depth: None,
                channels: Vec::new(),
                opaque: false,
                content,
                figures: Vec::new(),
            };
            let bytes = exr::encode(&frame, &path)?;
            self.keep(path, &bytes, finished)?;
        }
        Ok(())
    }

    fn write_shown(
        &self,
        sheet: &SheetLayout,
        tiles: &[Tile],
        scale: f32,
        finished: &Finished,
    ) -> Result<(), JobError> {
        let shown: Vec<DisplayImage> = tiles.iter().filter_map(|tile| tile.shown().cloned()).collect();
        let color = tile_display(&shown, sheet.columns, 0, [0; 4])?;
        let alpha = DisplayImage { opaque: true, pixels: alpha(&color.pixels), ..color };
        let coded = tiles.iter().map(|tile| DisplayImage {
            width: tile.motion.width(),
            height: tile.motion.height(),
            opaque: true,
            alpha: self.alpha,
            pixels: DisplayPixels::Sixteen(
                tile.motion.pixels().iter().map(|&motion| motion::coded(motion, scale)).collect(),
            ),
        });
        let motion = tile_display(&coded.collect::<Vec<_>>(), sheet.columns, 0, [0; 4])?;
        for (what, picture) in [("color", &color), ("alpha", &alpha), ("motion", &motion)] {
            let path = self.sheet_path(what);
            let bytes = png::encode(picture, &fingerprint(tiles, what), PngEffort::Fast, &path)?;
            self.keep(path, &bytes, finished)?;
        }
        Ok(())
    }

    fn description(&self, plan: &Plan, sheet: &SheetLayout, numbers: &[i64], scale: f32) -> Value {
        let fps = plan.fps();
        let frame = |(index, &number): (usize, &i64)| {
            let place = sheet.cell_rect(index);
            let time_s = index as f64 * fps.frame_s();
            json!({ "number": number, "time_s": time_s, "x": place.x, "y": place.y, "width": place.width, "height": place.height })
        };
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
                "space": "sRGB",
                "alpha": "straight",
                "alpha_convention": self.alpha.name(),
            }),
        };
        let ([width, height], part) = (plan.size(), plan.window());
        let mut description = json!({
            "format": 1,
            "program": provenance::PROGRAM,
            "size": sheet.size(),
            "grid": [sheet.columns, sheet.rows()],
            "tile": sheet.cell,
            "picture": [width, height],
            "crop": { "x": part.x, "y": part.y, "width": part.width, "height": part.height },
            "padding": {
                "left": part.x, "top": part.y, "right": width - part.right(), "bottom": height - part.bottom(),
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
        description["frames"] = numbers.iter().enumerate().map(frame).collect();
        description
    }

    /// How an engine draws the color sheet: covering what is behind, or adding light to it.
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
                "sRGB texture, decoded when it is sampled; the target is linear or an sRGB render target",
                json!({
                    "mode": "additive, color times alpha",
                    "factors": ["source_alpha", "one"],
                    "meaning": meaning,
                }),
            ),
            // Encoded values do not add up as light does; `screen` is far nearer, and never leaves the range.
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
            "zero_code": motion::MIDDLE, "largest_code": u16::MAX, "scale_pixels": scale,
            "formula": "pixels = (code - zero_code) / (largest_code - zero_code) * scale_pixels",
        })
    }
}

impl Tile {
    fn shown(&self) -> Option<&DisplayImage> {
        if let Color::Shown(picture) = &self.color { Some(picture) } else { None }
    }

    fn linear(&self) -> Option<&Image<4>> {
        if let Color::Linear(picture) = &self.color { Some(picture) } else { None }
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Alpha as gray.
fn alpha(pixels: &DisplayPixels) -> DisplayPixels {
    match pixels {
        DisplayPixels::Eight(pixels) => {
            DisplayPixels::Eight(pixels.iter().map(|&[.., a]| [a, a, a, u8::MAX]).collect())
        }
        DisplayPixels::Sixteen(pixels) => {
            DisplayPixels::Sixteen(pixels.iter().map(|&[.., a]| [a, a, a, u16::MAX]).collect())
        }
    }
}

/// A fingerprint that no single frame and no other sheet has.
fn fingerprint(tiles: &[Tile], what: &str) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    tiles.iter().for_each(|tile| {
        hasher.update(&tile.header.fingerprint);
    });
    *hasher.update(what.as_bytes()).finalize().as_bytes()
}
