//! What is to be made when all frames are whole: a film and a contact sheet of them, and a flipbook.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::job::{Flipbook, FlipbookCrop, Job};

/// What is made at the end. Relative paths are those of the current folder of whoever asked for it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Products {
    /// The film of the frames.
    pub film: Option<PathBuf>,
    /// Number of frames of the contact sheet.
    pub contact_sheet: Option<usize>,
    /// The flipbook.
    pub flipbook: Option<FlipbookRequest>,
}

/// The flipbook of a shot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlipbookRequest {
    /// `DIR/NAME.png` or `DIR/NAME.exr` for `NAME_color.png` and so on.
    pub path: PathBuf,
    /// Columns and rows of the sheet.
    pub grid: [usize; 2],
    /// Size of the whole picture in a cell, pixels; `None` crops the pictures to what is lit, and chooses their size.
    pub tile: Option<[usize; 2]>,
}

impl FlipbookRequest {
    /// The flipbook of the shot of `job`, from its first frame on, at a path relative to `folder`.
    ///
    /// It draws its frames itself. Those of the shot have another size, and no room for what is lit to be cropped and enlarged; in a loop they have another
    /// rate; and they lack the lights, and mostly the motion, that a flipbook has beside its pictures.
    pub fn flipbook(&self, job: &Job, folder: &Path) -> Flipbook {
        Flipbook {
            tile: self.tile,
            crop: if self.tile.is_some() { FlipbookCrop::None } else { FlipbookCrop::Auto },
            first_frame: job.frames.as_deref().and_then(|frames| frames.iter().min()).copied(),
            seed: job.seed,
            loop_s: job.loop_s,
            view: job.view,
            bits: job.bits,
            alpha: job.alpha,
            out: Some(folder.join(&self.path)),
            overwrite: job.overwrite,
            ..Flipbook::new(job.scene.clone(), self.grid)
        }
    }

    /// Number of its frames.
    pub fn frame_count(&self) -> usize {
        self.grid[0].saturating_mul(self.grid[1])
    }
}
