//! Streak textures of rain by themselves: pictures of opacity, and an index with every drop.

mod fault;
mod files;
mod index;

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering},
};

use bansho_base::host::observer::check;
use bansho_media::{
    MediaError,
    files::overwrite_policy::{InputFiles, OverwritePolicy},
};
use bansho_rain::{
    billboards::texture::StreakCube,
    drops::{
        size_distribution::{DropSizeDistribution, SizeBin},
        terminal_velocity::{FallAir, TerminalVelocity, VelocityLaw, fixed_point_velocity},
    },
    lighting::drop_phase_function::DropPhaseFunction,
};
use bansho_render::display::BitDepth;

use self::{
    files::{Lit, Writer},
    index::Entry,
};
use super::{
    error::JobError,
    observer::{FrameDone, JobObserver, Outline},
};
use crate::job::{
    checks::overwrite,
    render::{finished_files::Finished, output},
};

use rayon::prelude::*;

pub use fault::{ListKind, StreaksError};

bansho_base::choice! {
    /// What streak textures are written as.
    pub enum StreakFormat {
        /// Gray PNG, linear, with a scale; with a light, color PNG beside it.
        Png = "png",
        /// EXR: opacity as 32-bit float; with a light, radiance in R, G, B.
        Exr = "exr",
    }
}

/// Streak textures that are wanted. Begin with [`Streaks::default`]: the paper's 24.
#[derive(Clone, Debug, PartialEq)]
pub struct Streaks {
    /// Rain rates R, mm/h, ascending from 0.
    pub rates: Vec<f64>,
    /// Drop diameters D, mm, ascending.
    pub diameters: Vec<f64>,
    /// The cube of air, its texture and exposure; its `fall` is made of [`law`](Self::law).
    pub cube: StreakCube,
    /// Where terminal velocities come from.
    pub law: VelocityLaw,
    /// Textures of other drops for each rate and diameter.
    pub variants: u32,
    /// Where drops come from.
    pub seed: u64,
    /// Vector toward a light: right, up, toward the viewer.
    pub light: Option<[f64; 3]>,
    /// What files are written.
    pub format: StreakFormat,
    /// Bits of each channel of PNG files.
    pub bits: BitDepth,
    /// The folder; `out/streaks` when left out.
    pub out: Option<PathBuf>,
    /// Whether files that Bansho did not make may be written over.
    pub overwrite: bool,
}

impl Default for Streaks {
    fn default() -> Self {
        Self {
            rates: vec![1.0, 5.0, 10.0, 20.0],
            diameters: vec![1.0, 1.2, 1.4, 1.6, 1.8, 2.0],
            cube: StreakCube::default(),
            law: VelocityLaw::default(),
            variants: 1,
            seed: 1,
            light: None,
            format: StreakFormat::default(),
            bits: BitDepth::Sixteen,
            out: None,
            overwrite: false,
        }
    }
}

/// One texture of many.
struct Texture<'a> {
    rate: f64,
    sizes: &'a DropSizeDistribution,
    bin: SizeBin,
    variant: u32,
}

impl Streaks {
    /// Checks everything, and that the folder can be written. Writes nothing.
    ///
    /// # Errors
    /// The first thing that makes no sense or stands in the way.
    pub fn prepare(&self) -> Result<PreparedStreaks, JobError> {
        fault::check(self)?;
        let air = FallAir::default();
        if self.law == VelocityLaw::RigidSphere {
            // Where the drops of a bin have diameters of their own, its ends stand for them.
            let bins = SizeBin::around(&self.diameters);
            let ends = bins.iter().filter(|_| self.cube.spread).flat_map(|bin| bin.range_mm);
            for diameter_mm in self.diameters.iter().copied().chain(ends) {
                fixed_point_velocity(diameter_mm, &air).map_err(StreaksError::Velocity)?;
            }
        }
        let cube = StreakCube { terminal_velocity: TerminalVelocity { law: self.law, air }, ..self.cube };
        let light = self.light.map(|toward| Lit::new(toward, &DropPhaseFunction::new()));
        let folder = self.out.clone().unwrap_or_else(|| PathBuf::from("out").join("streaks"));
        let overwrite = OverwritePolicy::new(InputFiles::default(), self.overwrite);
        let writer = Writer { folder, format: self.format, bits: self.bits, light, overwrite, streaks: self.clone() };
        output::check_writable(&writer.index_path())?;
        let prepared = PreparedStreaks { streaks: self.clone(), cube, writer };
        overwrite::check(&prepared.writer.overwrite, prepared.files())?;
        Ok(prepared)
    }
}

/// Streak textures that can be made, as far as can be known without doing so.
pub struct PreparedStreaks {
    streaks: Streaks,
    cube: StreakCube,
    writer: Writer,
}

/// Drops that are drawn between two looks at the observer.
const DROPS_AT_ONCE: usize = 2048;

impl PreparedStreaks {
    /// How many textures there will be.
    pub fn texture_count(&self) -> usize {
        self.streaks.rates.len() * self.streaks.diameters.len() * self.streaks.variants as usize
    }

    /// Every file that will be written.
    fn files(&self) -> Vec<PathBuf> {
        let rains: Vec<DropSizeDistribution> = self.rains();
        let textures = self.textures(&rains);
        let pictures = textures.iter().flat_map(|texture| self.writer.files(&self.writer.name(texture)));
        pictures.chain([self.writer.index_path()]).collect()
    }

    fn rains(&self) -> Vec<DropSizeDistribution> {
        self.streaks.rates.iter().map(|&rate| DropSizeDistribution::marshall_palmer(rate)).collect()
    }

    /// Draws and writes all textures in the caller's rayon pool, the index last. Gives the path of the index.
    ///
    /// An index that is there from before is removed first, so that whatever index there is describes the files beside it.
    ///
    /// # Errors
    /// The observer asked to stop, or a file cannot be written. Textures that were finished stay, whole. Textures that were finished and are
    /// there no longer when all are.
    pub fn run(&self, observer: &dyn JobObserver) -> Result<PathBuf, JobError> {
        let index = self.writer.index_path();
        observer.started(&Outline { total: self.texture_count(), kept: 0, size: [self.cube.size; 2] });
        self.remove(&index)?;
        let rains = self.rains();
        let done = AtomicUsize::new(0);
        let finished = Finished::default();
        let entries: Vec<Entry> = self
            .textures(&rains)
            .par_iter()
            .enumerate()
            .map(|(number, texture)| {
                let entry = self.make(texture, observer)?;
                self.writer.files(&entry.file).for_each(|file| finished.note(file));
                let drawn = done.fetch_add(1, Ordering::Relaxed) + 1;
                let path = Some(self.writer.folder.join(&entry.file));
                observer.frame_done(&FrameDone { number: number as i64, path, drawn });
                Ok(entry)
            })
            .collect::<Result<_, JobError>>()?;
        check(observer).map_err(|_| JobError::StreaksCancelled)?;
        let text = format!("{:#}\n", index::describe(&self.streaks, &self.cube, &self.writer, &rains, &entries));
        self.writer.keep(&index, text.as_bytes())?;
        finished.note(index.clone());
        match finished.lost() {
            files if files.is_empty() => Ok(index),
            files => Err(JobError::FilesLost { files }),
        }
    }

    /// Removes the index of another run, which a run that is stopped would make wrong.
    fn remove(&self, index: &Path) -> Result<(), JobError> {
        if self.writer.overwrite.check(index).is_err() {
            return Err(MediaError::NotMadeByBansho { path: index.to_path_buf() }.into());
        }
        match fs::remove_file(index) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(MediaError::from_io(index, error).into()),
            _ => Ok(()),
        }
    }

    fn textures<'a>(&self, rains: &'a [DropSizeDistribution]) -> Vec<Texture<'a>> {
        let bins = SizeBin::around(&self.streaks.diameters);
        let mut textures = Vec::with_capacity(self.texture_count());
        for (&rate, sizes) in self.streaks.rates.iter().zip(rains) {
            for &bin in &bins {
                textures.extend((0..self.streaks.variants).map(|variant| Texture { rate, sizes, bin, variant }));
            }
        }
        textures
    }

    fn make(&self, texture: &Texture, observer: &dyn JobObserver) -> Result<Entry, JobError> {
        let drops = self.cube.drops(texture.sizes, &texture.bin, self.streaks.seed, texture.variant);
        let mut image = self.cube.draw(&[]);
        for drops in drops.chunks(DROPS_AT_ONCE) {
            check(observer).map_err(|_| JobError::StreaksCancelled)?;
            self.cube.draw_over(drops, &mut image);
        }
        check(observer).map_err(|_| JobError::StreaksCancelled)?;
        let file = self.writer.name(texture);
        let written = self.writer.write(&file, &image)?;
        Ok(Entry::new(texture, &self.cube, file, drops, &image, written))
    }
}
