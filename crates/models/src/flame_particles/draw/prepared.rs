//! One frame of the gas, ready to draw.

use std::sync::OnceLock;

use bansho_base::{
    canvas::{DepthInterval, Strip, View},
    image::Rect,
    math::DVec3,
    observer::{Cancelled, Observer, check},
    phenomenon::{Deflection, Prepared},
    surroundings::Surroundings,
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use crate::{
    blue_flame,
    sparks::{Fire, Streak},
};

use super::{
    detail::{Detail, Scale},
    gas::Gas,
    grid::Grid,
    haze::Haze,
    kernel::Profile,
    layers::Layers,
    look::{LookParameters, Sprite as Choice},
    measure::Motion,
    resolve::{BLUE, Extents, GLOW, HEAT, Layer, MATTER, PLANES, Resolve, TAU},
    splat::{COARSE, Sheet, Sprite, splat},
    sprite::{Seen, seen},
    squares::Squares,
};

/// The gas of one frame.
pub struct PreparedGas<'a> {
    gas: Gas<'a>,
    look: &'a LookParameters,
    view: &'a View,
    level: Level,
    layers: Layers,
    matter: Matter,
    sparks: Vec<Streak>,
    haze: OnceLock<Option<Haze>>,
}

/// Particles that one task takes.
pub(crate) const AT_ONCE: usize = 2048;

/// What is drawn of the particles.
enum Matter {
    /// Nothing that the view could see.
    Nothing,
    /// Sums of sprites.
    Sums(Box<Sums>),
    /// Squares.
    Squares(Squares),
}

struct Sums {
    grid: Grid,
    extents: Extents,
    weights: Vec<[f32; 4]>,
    detail: Option<Detail>,
    scattered: Vec<[f32; 3]>,
    motion: OnceLock<Option<Motion>>,
}

/// Whether a particle adds anything to the picture's light or shade.
fn shows(gas: &Gas, look: &LookParameters, index: usize) -> bool {
    match look.sprite {
        Choice::Integral => gas.absorption(index, look) > 0.0 || gas.is_blue(index, look),
        Choice::Poly6 | Choice::Squares => true,
    }
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

/// The layers of the gas as a view sees them.
fn layers(gas: &Gas, look: &LookParameters, view: &View) -> Layers {
    /// Thickness of a layer in support radii.
    const THICKNESS: f64 = 1.6;
    let t = view.shutter.middle();
    let of = |index: usize| {
        let depth = view.camera.depth(gas.place(index, t));
        (depth, if shows(gas, look, index) { gas.volume(index) } else { 0.0 })
    };
    let depths: Vec<(f64, f64)> = (0..gas.particles.len()).into_par_iter().with_min_len(AT_ONCE).map(of).collect();
    Layers::new(depths.into_iter().filter(|(depth, _)| *depth > 0.0), THICKNESS * mean_radius(gas))
}

/// Mean support radius, m; does not depend on the view, so that layers stand still.
fn mean_radius(gas: &Gas) -> f64 {
    let radii = &gas.particles.support_radius;
    let sum: f64 = radii.iter().map(|radius| f64::from(*radius)).sum();
    if radii.is_empty() { 0.0 } else { sum / radii.len() as f64 }
}

/// The stretches of depth that the gas and its sparks fill.
pub fn depth_intervals(gas: &Gas, look: &LookParameters, view: &View) -> Vec<DepthInterval> {
    if gas.particles.is_empty() && look.sparks.rate <= 0.0 {
        return Vec::new();
    }
    let layers = layers(gas, look, view);
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
        let layers = layers(&gas, look, view);
        let matter = match look.sprite {
            Choice::Squares => Matter::Squares(Squares::new(&gas, look, view)),
            _ => match sums(&gas, look, view, &layers, surroundings) {
                Some(sums) => Matter::Sums(Box::new(sums)),
                None => Matter::Nothing,
            },
        };
        check(observer)?;
        let mut sparks = fire(&gas, look, view).streaks(view, surroundings.wind);
        sparks.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        Ok(Self { gas, look, view, level: Level::new(), layers, matter, sparks, haze: OnceLock::new() })
    }

    /// The layers that lie in a slice, nearest first.
    fn layers_in<'b>(&'b self, slice: &'b DepthInterval) -> impl Iterator<Item = Layer> + 'b {
        let thickness = self.layers.thickness;
        let layer = move |index| Layer { index, depth: self.layers.centre(index), thickness };
        (0..self.layers.count).map(layer).filter(|layer| slice.contains(layer.depth))
    }

    fn resolve<'b>(&'b self, sums: &'b Sums) -> Resolve<'b> {
        Resolve {
            grid: &sums.grid,
            camera: &self.view.camera,
            origin: self.gas.particles.origin,
            detail: sums.detail.as_ref(),
            hides_itself: self.look.sprite == Choice::Integral,
            blue: blue_flame::colour(),
            scattered: &sums.scattered,
            weights: &sums.weights,
        }
    }
}

/// Sums all sprites in their layers.
fn sums(gas: &Gas, look: &LookParameters, view: &View, layers: &Layers, surroundings: &Surroundings) -> Option<Sums> {
    let shown = seen(gas, view, |index| shows(gas, look, index));
    let detail = scale(gas, look, view, &shown).and_then(|scale| Detail::new(gas, look, &scale));
    let opacity = mean_density(gas).map_or(0.0, |density| look.opacity / density);
    let since = view.shutter.middle() - gas.time;
    let sprite = |seen: &Seen| {
        let (layer, split) = layers.place(seen.depth);
        let index = seen.index;
        let mut values = match look.sprite {
            Choice::Poly6 => paper_values(gas, index, opacity),
            _ => values(gas, look, index, seen.ellipse.peak),
        };
        if let Some(detail) = &detail {
            let matter = detail.matter(gas, index, since);
            (0..3).for_each(|axis| values[MATTER + axis] = values[TAU] * matter[axis]);
        }
        Sprite { ellipse: seen.ellipse, layer, split, values }
    };
    let sprites: Vec<Sprite<PLANES>> = shown.par_iter().with_min_len(AT_ONCE).map(sprite).collect();
    let profile = if look.sprite == Choice::Poly6 { Profile::POLY6 } else { Profile::LINE };
    let grid = splat(&Sheet { profile, least_radius: COARSE, layers: layers.count, window: view.window }, &sprites)?;
    let extents = Extents::new(&grid, layers.count);
    let scattered = (0..layers.count).map(|layer| scattered(gas, look, view, layers.centre(layer), surroundings));
    Some(Sums {
        extents,
        weights: grid.cells.weights(),
        grid,
        detail,
        scattered: scattered.collect(),
        motion: OnceLock::new(),
    })
}

/// What a ray through the middle of a particle's sprite sees.
fn values(gas: &Gas, look: &LookParameters, index: usize, peak: f32) -> [f32; PLANES] {
    let length = gas.volume(index) * f64::from(peak);
    let tau = length * gas.absorption(index, look);
    let glow = tau * gas.luminance(index);
    let mut values = [0.0; PLANES];
    values[TAU] = tau as f32;
    values[GLOW] = glow as f32;
    values[HEAT] = (glow * f64::from(gas.particles.temperature[index])) as f32;
    values[BLUE] = (length * gas.blue(index, look)) as f32;
    values
}

/// The paper's sprite (section 5.2): opacity by density, colour by temperature.
fn paper_values(gas: &Gas, index: usize, opacity_per_density: f64) -> [f32; PLANES] {
    let opacity = opacity_per_density * f64::from(gas.particles.density[index]);
    let glow = opacity * gas.luminance(index);
    let mut values = [0.0; PLANES];
    values[TAU] = opacity as f32;
    values[GLOW] = glow as f32;
    values[HEAT] = (glow * f64::from(gas.particles.temperature[index])) as f32;
    values
}

fn mean_density(gas: &Gas) -> Option<f64> {
    let densities = &gas.particles.density;
    let sum: f64 = densities.iter().map(|density| f64::from(*density)).sum();
    (sum > 0.0).then(|| sum / densities.len() as f64)
}

/// Means that set the scale of detail, by light.
fn scale(gas: &Gas, look: &LookParameters, view: &View, shown: &[Seen]) -> Option<Scale> {
    if look.sprite != Choice::Integral {
        return None;
    }
    let own = |seen: &Seen| {
        let absorption = gas.absorption(seen.index, look);
        let weight = absorption * gas.volume(seen.index) * gas.luminance(seen.index);
        let radius = f64::from(gas.particles.support_radius[seen.index]);
        [weight, weight * radius, weight * absorption, weight * f64::from(seen.scale)]
    };
    let add = |sums: [f64; 4], own: [f64; 4]| [0, 1, 2, 3].map(|i| sums[i] + own[i]);
    // Sums of whole tasks, added in order, are the same however many threads there are.
    let of_task = |task: &[Seen]| task.iter().map(own).fold([0.0; 4], add);
    let of_tasks: Vec<[f64; 4]> = shown.par_chunks(AT_ONCE).map(of_task).collect();
    let [total, radius, absorption, pixels] = of_tasks.into_iter().fold([0.0; 4], add);
    (total > 0.0).then(|| Scale {
        radius: radius / total,
        absorption: absorption / total,
        pixels_per_metre: pixels / total,
        time: view.shutter.middle(),
        open: view.shutter.duration(),
        sway: camera_sway(gas, view),
    })
}

/// How far what stands still at the flame moves before the camera while the shutter is open, m in the world.
fn camera_sway(gas: &Gas, view: &View) -> [f64; 3] {
    let place = gas.particles.origin;
    let (opened, closed) = (view.camera_at(view.shutter.open), view.camera_at(view.shutter.close));
    let local = closed.to_camera(place) - opened.to_camera(place);
    (view.camera.orientation * local).to_array().map(|value| -value)
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
        let sparks = self.sparks.iter().filter(|spark| slice.contains(spark.depth));
        sparks.fold(gas, |all, spark| all.union(&spark.bounds(self.view.size)))
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
                    let motion = sums.motion.get_or_init(|| Motion::new(&self.gas, self.look, self.view));
                    resolve.measure_layer(&layer, &sums.extents, motion.as_ref(), rect, &mut row, strip);
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

    fn deflection(&self) -> Option<Deflection<'_>> {
        let haze = self.haze()?;
        let depth = self.layers.centre(self.layers.count - 1) + 0.5 * self.layers.thickness;
        Some(Deflection { depth, rect: haze.rect, angle: &haze.angle })
    }
}

impl PreparedGas<'_> {
    fn haze(&self) -> Option<&Haze> {
        self.haze.get_or_init(|| Haze::new(&self.gas, self.look, self.view)).as_ref()
    }

    fn measure_deflection(&self, slice: &DepthInterval, strip: &mut Strip) {
        // Once, however many slices the layers fall into.
        if let Some(haze) = self.haze().filter(|_| slice.contains(self.layers.centre(self.layers.count - 1))) {
            haze.measure(strip);
        }
    }
}
