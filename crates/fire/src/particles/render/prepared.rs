//! One frame of the gas, ready to draw.

use std::sync::OnceLock;

use bansho_base::{
    host::{
        observer::{Cancelled, Observer, check},
        once::get_or_make,
    },
    image::Rect,
    math::DVec3,
    phenomenon::{
        Deflection, Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::Surroundings,
    },
};

use super::{
    aovs::{Motion, bounds},
    deflection::{self, Haze},
    depth_layers::Layers,
    gas::Gas,
    gas_statistics::{Survey, shows},
};
use crate::{
    blue_flame,
    particles::{
        look_parameters::{LookParameters, SpriteStyle},
        paper::squares::Squares,
        render::{
            project::sprite::{Kind, Seen, seen},
            resolve::{
                detail::Detail,
                resolve_gas::{BLUE, Extents, GLOW, HEAT, Layer, MATTER, PATH, PLANES, Resolve, TAU},
                spline,
                strain::Strain,
                upsample::Across,
            },
            splat::{
                accumulate::{COARSE, Sheet, Splat, Sprite, splat},
                grid::Grid,
                kernel::Profile,
            },
        },
    },
    sparks::{Fire, Streak},
};
use fearless_simd::{Level, dispatch};

/// The gas of one frame.
pub struct PreparedGas<'a> {
    gas: Gas<'a>,
    look: &'a LookParameters,
    view: &'a View,
    level: Level,
    layers: Layers,
    matter: Matter<'a>,
    sparks: Vec<Streak>,
    /// Made where it is measured or bends what lies behind.
    haze: OnceLock<Option<Haze>>,
}

/// Particles that one task takes.
pub(crate) const PARTICLES_OF_TASK: usize = 2048;

/// What is drawn of the particles.
enum Matter<'a> {
    /// Nothing that the view could see.
    Nothing,
    /// Gas that other parts of the picture show.
    Elsewhere,
    /// Sums of sprites.
    Sums(Box<Sums<'a>>),
    /// Squares.
    Squares(Squares),
}

struct Sums<'a> {
    grid: Grid<'a>,
    extents: Extents,
    weights: Vec<[f32; 4]>,
    across: Across,
    detail: Option<(Detail, Strain)>,
    scattered: Vec<[f32; 3]>,
    /// Where it is measured, and anything glows.
    motion: Option<Motion<'a>>,
    temperatures: [f32; 2],
}

/// The fire whose sparks fly.
fn fire<'a>(gas: &Gas, look: &'a LookParameters, view: &View) -> Fire<'a> {
    Fire {
        parameters: &look.sparks,
        key: gas.key,
        now: view.shutter.middle(),
        loop_s: None,
        base: gas.base,
        size: gas.size,
        scale: 1.0,
        wind_response: 1.0,
    }
}

/// The stretches of depth that the gas and its sparks fill.
pub fn depth_intervals(gas: &Gas, look: &LookParameters, view: &View) -> Vec<DepthInterval> {
    if gas.particles.is_empty() && look.sparks.rate <= 0.0 {
        return Vec::new();
    }
    let layers = Survey::new(gas, look, view).layers(gas);
    let mut intervals: Vec<DepthInterval> = layers.intervals().collect();
    if look.sparks.rate > 0.0 {
        let middle = layers.centre(layers.count / 2);
        let reach = look.sparks.swirl + 0.5 * layers.thickness * layers.count as f64;
        intervals.push(DepthInterval { near: (middle - reach).max(0.0), far: middle + reach });
    }
    intervals
}

impl<'a> PreparedGas<'a> {
    /// Prepares the gas for `view`.
    ///
    /// # Errors
    /// The observer asked to stop.
    pub fn new(
        gas: Gas<'a>,
        look: &'a LookParameters,
        view: &'a View,
        surroundings: &Surroundings,
        observer: &dyn Observer,
    ) -> Result<Self, Cancelled> {
        check(observer)?;
        let survey = Survey::new(&gas, look, view);
        let layers = survey.layers(&gas);
        let matter = match look.sprite {
            SpriteStyle::Squares => Matter::Squares(Squares::new(&gas, look, view)),
            _ => sums(&gas, look, view, &survey, surroundings),
        };
        check(observer)?;
        let mut sparks = fire(&gas, look, view).streaks(view, surroundings.wind);
        sparks.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        let prepared = Self { gas, look, view, level: Level::new(), layers, matter, sparks, haze: OnceLock::new() };
        if view.measured {
            prepared.haze();
        }
        Ok(prepared)
    }

    /// The layers that lie in a slice, nearest first.
    fn layers_in<'b>(&'b self, slice: &'b DepthInterval) -> impl Iterator<Item = Layer> + 'b {
        let thickness = self.layers.thickness;
        let layer = move |index| Layer { index, depth: self.layers.centre(index), thickness };
        (0..self.layers.count).map(layer).filter(|layer| slice.contains(layer.depth))
    }

    fn resolve<'b>(&'b self, sums: &'b Sums<'_>) -> Resolve<'b> {
        Resolve {
            grid: &sums.grid,
            camera: &self.view.camera,
            origin: self.gas.particles.origin,
            detail: sums.detail.as_ref().map(|(detail, strain)| (detail, strain)),
            hides_itself: self.look.sprite == SpriteStyle::Integral,
            blue: blue_flame::colour(),
            scattered: &sums.scattered,
            weights: &sums.weights,
            across: &sums.across,
            temperatures: sums.temperatures,
        }
    }
}

/// Sums all sprites in their layers.
fn sums<'a>(
    gas: &Gas<'a>,
    look: &LookParameters,
    view: &View,
    survey: &Survey,
    surroundings: &Surroundings,
) -> Matter<'a> {
    let layers = survey.layers(gas);
    let detail = survey.scale(gas, view).and_then(|scale| Detail::new(gas, look, &scale));
    let shining = Shining {
        gas,
        look,
        layers: &layers,
        opacity: mean_density(gas).map_or(0.0, |density| look.opacity / density),
        detail: detail.as_ref(),
        since: view.shutter.middle() - gas.time,
    };
    let sprites = seen(gas, view, &shining);
    let profile = if look.sprite == SpriteStyle::Poly6 { Profile::POLY6 } else { Profile::LINE };
    let grid = match splat(
        &Sheet { profile, least_radius: COARSE, layers: layers.count, picture: view.size, window: view.window },
        &sprites,
        gas.memory,
    ) {
        Splat::Sums(grid) => grid,
        Splat::Elsewhere => return Matter::Elsewhere,
        Splat::Nothing => return Matter::Nothing,
    };
    let extents = Extents::new(&grid, layers.count);
    let strained = |detail: Detail| {
        let strain = Strain::new(&grid, &extents, layers.count, detail.cell_pixels);
        (detail, strain)
    };
    let detail = detail.map(strained);
    let scattered = (0..layers.count).map(|layer| scattered(gas, look, view, layers.centre(layer), surroundings));
    Matter::Sums(Box::new(Sums {
        extents,
        weights: spline::weights(&grid.cells),
        across: Across::new(&grid, view.size[0], &spline::weights(&grid.cells)),
        grid,
        detail,
        scattered: scattered.collect(),
        motion: if view.measured { Motion::new(gas, look, view) } else { None },
        temperatures: bounds(gas.particles.temperature.iter().copied()),
    }))
}

/// The gas that shows, as sprites of its light and shade.
struct Shining<'a> {
    gas: &'a Gas<'a>,
    look: &'a LookParameters,
    layers: &'a Layers,
    /// Opacity of a poly6 sprite beside the gas's density.
    opacity: f64,
    detail: Option<&'a Detail>,
    /// Time from the particles' state, s.
    since: f64,
}

impl Kind for Shining<'_> {
    type Record = Sprite<PLANES>;

    #[inline(always)]
    fn wants(&self, index: usize) -> bool {
        shows(self.gas, self.look, index)
    }

    #[inline(always)]
    fn record(&self, seen: &Seen) -> Sprite<PLANES> {
        let (layer, split) = self.layers.place(seen.depth);
        let mut values = match self.look.sprite {
            SpriteStyle::Poly6 => self.paper_values(seen.index),
            _ => self.values(seen),
        };
        if let Some(detail) = self.detail {
            let matter = detail.matter(self.gas, seen.index, self.since);
            for axis in 0..3 {
                values[MATTER + axis] = values[TAU] * matter[axis];
            }
        }
        Sprite { ellipse: seen.ellipse, layer, split, values }
    }
}

impl Shining<'_> {
    /// What a ray through the middle of a particle's sprite sees.
    #[inline(always)]
    fn values(&self, seen: &Seen) -> [f32; PLANES] {
        let (gas, index) = (self.gas, seen.index);
        let length = gas.volume(index) * f64::from(seen.ellipse.peak);
        let tau = length * gas.absorption(index, self.look);
        let mut values = self.glowing(index, tau);
        values[BLUE] = (length * gas.blue(index, self.look)) as f32;
        values[PATH] = deflection::path(gas, self.look, seen);
        values
    }

    /// The paper's sprite (section 5.2): opacity by density, colour by temperature.
    #[inline(always)]
    fn paper_values(&self, index: usize) -> [f32; PLANES] {
        self.glowing(index, self.opacity * f64::from(self.gas.particles.density[index]))
    }

    /// Optical depth, and what shines with it.
    #[inline(always)]
    fn glowing(&self, index: usize, tau: f64) -> [f32; PLANES] {
        let glow = tau * self.gas.luminance(index);
        let mut values = [0.0; PLANES];
        values[TAU] = tau as f32;
        values[GLOW] = glow as f32;
        values[HEAT] = (glow * f64::from(self.gas.particles.temperature[index])) as f32;
        values
    }
}

fn mean_density(gas: &Gas) -> Option<f64> {
    let densities = &gas.particles.density;
    let sum: f64 = densities.iter().map(|density| f64::from(*density)).sum();
    (sum > 0.0).then(|| sum / densities.len() as f64)
}

/// What soot at a depth along the line of sight to the flame scatters where it hides everything: light of others, alike in all directions.
fn scattered(gas: &Gas, look: &LookParameters, view: &View, depth: f64, surroundings: &Surroundings) -> [f32; 3] {
    let toward = (gas.particles.origin - view.camera.position).normalize_or(DVec3::NEG_Z);
    let place = view.camera.position + toward * depth;
    let share = (look.smoke_albedo / (4.0 * std::f64::consts::PI)) as f32;
    let mut sum = [0.0; 3];
    for light in &surroundings.others.lights {
        let (illuminance, _) = light.illuminance(place);
        (0..3).for_each(|c| sum[c] += illuminance[c] * share);
    }
    sum
}

impl Prepared for PreparedGas<'_> {
    fn bounds(&self, slice: &DepthInterval) -> Rect {
        let gas = match &self.matter {
            Matter::Sums(sums) if self.layers_in(slice).next().is_some() => sums.grid.covered(),
            Matter::Squares(squares) => squares.bounds(slice),
            _ => Rect::default(),
        };
        // Gas that bends light reaches further than what shines of it.
        let all = self.measured_haze(slice).map_or(gas, |haze| gas.union(&haze.rect));
        let sparks = self.sparks.iter().filter(|spark| slice.contains(spark.depth));
        sparks.fold(all, |all, spark| all.union(&spark.bounds(self.view.size)))
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let mut sparks = self.sparks.iter().filter(|spark| slice.contains(spark.depth)).peekable();
        if let Matter::Sums(sums) = &self.matter {
            let resolve = self.resolve(sums);
            let mut row = resolve.row();
            let rect = sums.grid.covered().intersection(&strip.rect);
            for layer in self.layers_in(slice) {
                while let Some(spark) = sparks.next_if(|spark| spark.depth < layer.depth) {
                    spark.draw(self.view.size, strip);
                }
                if rect.is_empty() {
                    continue;
                }
                dispatch!(self.level, _simd => resolve.draw_layer(&layer, &sums.extents, rect, &mut row, strip));
                if !strip.aovs.is_empty() {
                    resolve.measure_layer(&layer, &sums.extents, sums.motion.as_ref(), rect, &mut row, strip);
                }
            }
        }
        if let Matter::Squares(squares) = &self.matter {
            squares.draw(slice, strip);
        }
        if !strip.aovs.is_empty() {
            self.measure_deflection(slice, strip);
        }
        sparks.for_each(|spark| spark.draw(self.view.size, strip));
    }

    fn may_bend(&self) -> bool {
        self.look.haze_gain > 0.0 && !self.gas.particles.is_empty()
    }

    fn deflection(&self) -> Option<Deflection<'_>> {
        let haze = self.haze()?;
        let depth = self.layers.centre(self.layers.count - 1) + 0.5 * self.layers.thickness;
        Some(Deflection { depth, rect: haze.rect, angle: &haze.angle })
    }
}

impl PreparedGas<'_> {
    /// The haze, summed by all threads; where it is measured, strips find it made.
    fn haze(&self) -> Option<&Haze> {
        let (summed, all) = match &self.matter {
            Matter::Sums(sums) if self.look.sprite == SpriteStyle::Integral => (Some(&sums.grid), false),
            Matter::Elsewhere if self.look.sprite == SpriteStyle::Integral => (None, false),
            _ => (None, true),
        };
        get_or_make(&self.haze, || Haze::new(&self.gas, self.look, self.view, summed, all)).as_ref()
    }

    /// The haze where it is measured in a slice: in one alone, however many the layers fall into.
    fn measured_haze(&self, slice: &DepthInterval) -> Option<&Haze> {
        let is_here = self.view.measured && slice.contains(self.layers.centre(self.layers.count - 1));
        self.haze.get().and_then(Option::as_ref).filter(|_| is_here)
    }

    fn measure_deflection(&self, slice: &DepthInterval, strip: &mut Strip) {
        if let Some(haze) = self.measured_haze(slice) {
            haze.measure(strip);
        }
    }
}
