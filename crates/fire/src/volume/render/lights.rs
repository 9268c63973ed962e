//! Light that the fire casts on other objects: point lights along its height.

use bansho_base::{
    color,
    host::parallel::prelude::*,
    math::{self, DVec3},
    phenomenon::surroundings::{Emitter, Light},
};

use crate::volume::{fuel::soot_profile, parameters::VolumeLightParameters, simulate::Simulation};

/// Emission of a layer of cells.
#[derive(Clone, Copy, Debug, Default)]
struct Layer {
    /// Luminous intensity without self-absorption, cd, ACEScg.
    intensity: [f64; 3],
    /// Power times position, and times the square of the distance from the axis of the grid.
    moment: DVec3,
    radial_moment: f64,
    /// Absorption coefficient times volume, m^2.
    absorption_area: f64,
}

impl Layer {
    fn power(&self) -> f64 {
        self.intensity.iter().sum::<f64>().max(0.0)
    }

    fn add(&mut self, other: &Self, weight: f64) {
        (0..3).for_each(|c| self.intensity[c] += weight * other.intensity[c]);
        self.moment += other.moment * weight;
        self.radial_moment += weight * other.radial_moment;
        self.absorption_area += weight * other.absorption_area;
    }
}

/// Point lights of segments of equal power along the height of the fire. Soot of volume V, absorption coefficient k and temperature T emits `V k B(T)` in every
/// direction; a segment absorbs as a slab of its optical depth does.
pub(crate) fn point_lights(simulation: &Simulation, absorption: f64, parameters: &VolumeLightParameters) -> Vec<Light> {
    if parameters.scale <= 0.0 {
        return Vec::new();
    }
    let layers = layers(simulation, absorption);
    let total: f64 = layers.iter().map(Layer::power).sum();
    if total.is_nan() || total <= 0.0 {
        return Vec::new();
    }
    let count = parameters.count.max(1) as usize;
    let edges = |index: usize| total * index as f64 / count as f64;
    (0..count).filter_map(|index| segment_light(&layers, [edges(index), edges(index + 1)], parameters.scale)).collect()
}

fn layers(simulation: &Simulation, absorption: f64) -> Vec<Layer> {
    let grid = simulation.flow.grid;
    let origin = DVec3::from(simulation.shared.parameters.position);
    let volume = grid.spacing * grid.spacing * grid.spacing;
    let [mixtures, deficits] = &simulation.flow.contents.quantities;
    let mixture = simulation.mixture;
    let table = color::black_body();
    let layers = (0..grid.size[1]).into_par_iter().map(|y| {
        let mut layer = Layer::default();
        for (z, row) in grid.rows(y) {
            for x in simulation.active.row(y, z) {
                let fraction = mixtures[row + x];
                let soot = soot_profile(fraction / mixture.stoichiometric);
                if soot <= 0.0 {
                    continue;
                }
                let area = absorption * f64::from(soot) * volume;
                let radiance = table.radiance(mixture.temperature_k(fraction, deficits[row + x])).map(f64::from);
                let position = grid.center([x, y, z]);
                let intensity = radiance.map(|value| value * area);
                let power: f64 = intensity.iter().sum();
                (0..3).for_each(|c| layer.intensity[c] += intensity[c]);
                layer.moment += (position + origin) * power;
                let center = 0.5 * (grid.origin + grid.far_corner());
                let (x, z) = (position.x - center.x, position.z - center.z);
                layer.radial_moment += (x * x + z * z) * power;
                layer.absorption_area += area;
            }
        }
        layer
    });
    layers.collect()
}

/// The light of the layers between two values of cumulative power.
fn segment_light(layers: &[Layer], [from, to]: [f64; 2], scale: f64) -> Option<Light> {
    let mut sum = Layer::default();
    let mut cumulative = 0.0;
    for layer in layers {
        let next = cumulative + layer.power();
        let overlap = next.min(to) - cumulative.max(from);
        if overlap > 0.0 {
            sum.add(layer, overlap / layer.power());
        }
        cumulative = next;
    }
    let power = sum.power();
    if power <= 0.0 {
        return None;
    }
    let radius = math::sqrt(sum.radial_moment / power).max(1e-3);
    let tau = sum.absorption_area / (4.0 * std::f64::consts::PI * radius * radius);
    let escape = if tau > 1e-6 { -math::exp_m1(-tau) / tau } else { 1.0 };
    Some(Light {
        emitter: Emitter::Point { position: sum.moment / power, radius },
        intensity: sum.intensity.map(|value| (value * scale * escape) as f32),
    })
}
