//! Streak textures of rain (`bansho streaks`): pictures of opacity, and an index with every drop.

mod check;
mod files;
mod index;

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering},
};

use bansho_base::{host::observer, image::Image};
use bansho_media::{
    MediaError,
    files::overwrite_policy::{InputFiles, OverwritePolicy},
};
use bansho_rain::{
    VelocityLaw,
    billboards::texture::{FallingDrop, StreakCube},
    drops::{
        size_distribution::{DropSizeDistribution, SizeBin},
        terminal_velocity::{FallAir, TerminalVelocity, fixed_point_velocity},
    },
    lighting::drop_phase_function::DropPhaseFunction,
};
use bansho_render::display::BitDepth;

use self::{
    files::{DistantLight, TextureWriter},
    index::Entry,
};
use super::{
    checks::{finished_files::FinishedFiles, outputs},
    error::{JobError, StreaksError},
    observer::{FrameDone, JobObserver, JobStarted},
};

use rayon::prelude::*;

bansho_base::choice! {
    /// File format of streak textures.
    pub enum StreakFormat {
        /// Gray PNG, linear, with a scale; if there is a light, also a color PNG.
        Png = "png",
        /// EXR: opacity as 32-bit float; if there is a light, radiance in R, G, B.
        Exr = "exr",
    }
}

/// A set of streak textures. [`Streaks::default`] is the 24 textures of the paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Streaks {
    /// Rain rates R, mm/h, ascending from 0.
    pub rates: Vec<f64>,
    /// Drop diameters D, mm, ascending.
    pub diameters: Vec<f64>,
    /// The cube of air, its texture and exposure; its `terminal_velocity` is replaced by [`law`](Self::law).
    pub cube: StreakCube,
    /// The law of terminal velocity.
    pub law: VelocityLaw,
    /// Number of textures with different drops for each rate and diameter.
    pub variants: u32,
    /// Seed of the positions of the drops.
    pub seed: u64,
    /// Vector toward a distant light, if there is one: right, up, toward the viewer.
    pub light: Option<[f64; 3]>,
    /// Amplitude of the brightness of lit streaks as their drops oscillate, 0 to 1; needs a light.
    pub oscillation: f64,
    /// File format.
    pub format: StreakFormat,
    /// Bits of each channel of PNG files.
    pub bits: BitDepth,
    /// The output folder; `None` is `out/streaks`.
    pub out: Option<PathBuf>,
    /// Whether files that Bansho did not make may be overwritten.
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
            oscillation: 0.0,
            format: StreakFormat::default(),
            bits: BitDepth::Sixteen,
            out: None,
            overwrite: false,
        }
    }
}

/// One texture of the set.
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
    /// The first parameter that is out of range, or the first file that cannot be written.
    pub fn prepare(&self) -> Result<PreparedStreaks, JobError> {
        check::check(self)?;
        let air = FallAir::default();
        if self.law == VelocityLaw::RigidSphere {
            // If each drop has its own diameter within its bin, the ends of the bin are checked too.
            let bins = SizeBin::around(&self.diameters);
            let ends = bins.iter().filter(|_| self.cube.spread).flat_map(|bin| bin.range_mm);
            for diameter_mm in self.diameters.iter().copied().chain(ends) {
                fixed_point_velocity(diameter_mm, &air).map_err(StreaksError::Velocity)?;
            }
        }
        let cube = StreakCube { terminal_velocity: TerminalVelocity { law: self.law, air }, ..self.cube };
        let light = self.light.map(|toward| DistantLight::new(toward, &DropPhaseFunction::new())).transpose()?;
        let folder = self.out.clone().unwrap_or_else(|| PathBuf::from("out").join("streaks"));
        let overwrite = OverwritePolicy::new(InputFiles::default(), self.overwrite);
        let writer =
            TextureWriter { folder, format: self.format, bits: self.bits, light, overwrite, streaks: self.clone() };
        outputs::check_writable(&writer.index_path())?;
        let prepared = PreparedStreaks { streaks: self.clone(), cube, writer };
        outputs::check_overwriting(&prepared.writer.overwrite, prepared.files())?;
        Ok(prepared)
    }
}

/// Checked streak textures, ready to run.
pub struct PreparedStreaks {
    streaks: Streaks,
    cube: StreakCube,
    writer: TextureWriter,
}

/// Number of drops that are drawn between two checks for cancellation.
const DROPS_PER_CHECK: usize = 2048;

impl PreparedStreaks {
    /// Number of textures.
    pub fn texture_count(&self) -> usize {
        self.streaks.rates.len() * self.streaks.diameters.len() * self.streaks.variants as usize
    }

    /// Every file that will be written.
    fn files(&self) -> Vec<PathBuf> {
        let distributions = self.drop_size_distributions();
        let textures = self.textures(&distributions);
        let pictures = textures.iter().flat_map(|texture| self.writer.files(&self.writer.name(texture)));
        pictures.chain([self.writer.index_path()]).collect()
    }

    /// One distribution for each rain rate.
    fn drop_size_distributions(&self) -> Vec<DropSizeDistribution> {
        self.streaks.rates.iter().map(|&rate| DropSizeDistribution::marshall_palmer(rate)).collect()
    }

    /// Draws and writes all textures in the caller's rayon pool, then the index, whose path is returned.
    ///
    /// An existing index is removed first, so that an index always describes the files beside it.
    ///
    /// # Errors
    /// The observer canceled the job, or a file cannot be written; finished textures are kept. Or finished textures were removed or changed
    /// before the job ended.
    pub fn run(&self, observer: &dyn JobObserver) -> Result<PathBuf, JobError> {
        let index = self.writer.index_path();
        observer.started(&JobStarted { frames: self.texture_count(), kept: 0, size: [self.cube.size; 2] });
        self.remove_index(&index)?;
        let distributions = self.drop_size_distributions();
        let done = AtomicUsize::new(0);
        let finished = FinishedFiles::default();
        let entries: Vec<Entry> = self
            .textures(&distributions)
            .par_iter()
            .enumerate()
            .map(|(number, texture)| {
                let entry = self.write_texture(texture, observer)?;
                self.writer.files(&entry.file).for_each(|file| finished.record(file));
                let drawn = done.fetch_add(1, Ordering::Relaxed) + 1;
                let path = Some(self.writer.folder.join(&entry.file));
                observer.frame_done(&FrameDone { number: number as i64, path, drawn });
                Ok(entry)
            })
            .collect::<Result<_, JobError>>()?;
        check_cancelled(observer)?;
        let text =
            format!("{:#}\n", index::describe(&self.streaks, &self.cube, &self.writer, &distributions, &entries));
        self.writer.write_file(&index, text.as_bytes())?;
        finished.record(index.clone());
        match finished.removed_or_changed() {
            files if files.is_empty() => Ok(index),
            files => Err(JobError::FilesLost { files }),
        }
    }

    /// Removes the index of an earlier run, which would be wrong if this run is canceled.
    fn remove_index(&self, index: &Path) -> Result<(), JobError> {
        if self.writer.overwrite.check(index).is_err() {
            return Err(MediaError::NotMadeByBansho { path: index.to_path_buf() }.into());
        }
        match fs::remove_file(index) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(MediaError::from_io(index, error).into()),
            _ => Ok(()),
        }
    }

    fn textures<'a>(&self, distributions: &'a [DropSizeDistribution]) -> Vec<Texture<'a>> {
        let bins = SizeBin::around(&self.streaks.diameters);
        let mut textures = Vec::with_capacity(self.texture_count());
        for (&rate, sizes) in self.streaks.rates.iter().zip(distributions) {
            for &bin in &bins {
                textures.extend((0..self.streaks.variants).map(|variant| Texture { rate, sizes, bin, variant }));
            }
        }
        textures
    }

    fn write_texture(&self, texture: &Texture, observer: &dyn JobObserver) -> Result<Entry, JobError> {
        let drops = self
            .cube
            .drops(texture.sizes, &texture.bin, self.streaks.seed, texture.variant)
            .map_err(StreaksError::from)?;
        let mut image = self.cube.draw(&[]).map_err(StreaksError::from)?;
        for drops in drops.chunks(DROPS_PER_CHECK) {
            check_cancelled(observer)?;
            self.cube.draw_over(drops, &mut image).map_err(StreaksError::from)?;
        }
        check_cancelled(observer)?;
        let speckled = (self.streaks.oscillation > 0.0).then(|| self.speckled(&drops)).transpose()?;
        let file = self.writer.name(texture);
        let written = self.writer.write(&file, &image, speckled.as_ref())?;
        Ok(Entry::new(texture, &self.cube, file, drops, &image, written))
    }

    /// The brightness of oscillating drops.
    fn speckled(&self, drops: &[FallingDrop]) -> Result<Image<1>, StreaksError> {
        let mut brightness = self.cube.draw(&[])?;
        self.cube.draw_speckled_over(drops, self.streaks.oscillation, self.streaks.seed, &mut brightness)?;
        Ok(brightness)
    }
}

fn check_cancelled(observer: &dyn JobObserver) -> Result<(), JobError> {
    observer::check(observer).map_err(|_| JobError::StreaksCancelled)
}
