//! What shines: particles for light that leaves at once, the afterglow's cells for green and red.

use bansho_base::{
    math::{self, MulAdd, simd::LANES},
    parameters::Auto,
};

use super::source_bins::{REACH, Source};
use crate::{
    physics::{
        emission::{Emission, Emitter, red_line_levels::RED_HEIGHTS},
        precipitation::energy_grid::{LOWEST_EV, NODES, node_energy_ev, node_of},
    },
    render::{
        Blur, DrawingParameters, Sampling,
        project::field_lines::{FieldLines, Foot},
    },
    simulate::{
        AuroraParticles,
        afterglow::{Afterglow, GlowCell},
    },
};
use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

/// Sources that a task of the thread pool makes.
const TASK: usize = 4096;
/// Spread of a particle beside the distance to its neighbours: none is seen by itself.
const SPREAD_PER_SPACING: f64 = 1.2;
/// Afterglow without particles that is fainter than this share of a typical cell is not seen.
const FAINTEST: f32 = 2e-4;
/// The same beside single collisions, whose noise hides more: what is left out is a hundredth of what stays behind.
const FAINTEST_FALLING: f32 = 1e-2;
/// Keys of a particle's falls are so far apart from instant to instant.
const PER_INSTANT: u32 = 0x9e37_79b9;
/// 1000 W, the power of one mW/m^2 on one km^2.
const PER_UNIT: f32 = 1e-3;

/// What an aurora shines with at a moment, or on average.
#[derive(Default)]
pub(crate) struct Sources {
    /// Light with fine detail: particles and the green map.
    pub(crate) sharp: Vec<Source>,
    /// The red map, by height in place of emitters.
    pub(crate) soft: Vec<Source>,
    /// Standard deviations of both, km.
    pub(crate) spread_km: [f64; 2],
}

/// Shares of green, red and prompt light; on the soft chart, of red light of three heights.
pub(crate) type Shares = [f32; 3];
const GREEN: [Shares; 1] = [[1.0, 0.0, 0.0]];
const RED: [Shares; RED_HEIGHTS] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// How electrons become sources.
pub(crate) struct Maker<'a> {
    pub(crate) field: &'a FieldLines,
    pub(crate) reach: f32,
    /// Part of the power that each of several instants has.
    pub(crate) share: f32,
    /// Which of them it is, so that a particle has falls of its own at each.
    pub(crate) instant: u32,
}

impl Maker<'_> {
    #[inline(always)]
    fn make(&self, foot: Foot, powers_w: [f32; 3], node: f32, key: u32) -> Source {
        let scale = self.share * PER_UNIT * foot.upright;
        let [green, red, prompt] = powers_w;
        let power = [green * scale, red * scale, prompt * scale];
        Source { across: foot.across, reach: self.reach, node, power, key }
    }

    /// What the falls of a particle or cell of that number go by.
    #[inline(always)]
    fn key(&self, number: u32) -> u32 {
        number.wrapping_add(self.instant.wrapping_mul(PER_INSTANT))
    }

    /// A source for each of the cells, which gives these shares of the light of each height.
    pub(crate) fn cells<const HEIGHTS: usize>(
        &self,
        cells: &[GlowCell<HEIGHTS>],
        shares: [Shares; HEIGHTS],
    ) -> Vec<Source> {
        let level = Level::new();
        let mut sources = vec![Source::default(); cells.len()];
        sources.par_chunks_mut(TASK).zip(cells.par_chunks(TASK)).for_each(|(sources, cells)| {
            dispatch!(level, _simd => self.fill_from_cells(sources, cells, shares));
        });
        sources
    }

    #[inline(always)]
    fn fill_from_cells<const HEIGHTS: usize>(
        &self,
        sources: &mut [Source],
        cells: &[GlowCell<HEIGHTS>],
        shares: [Shares; HEIGHTS],
    ) {
        for (source, cell) in sources.iter_mut().zip(cells) {
            let [east, south] = cell.position_km;
            let mut powers = [0.0; 3];
            for (shares, power) in shares.iter().zip(cell.powers_w) {
                for (sum, share) in powers.iter_mut().zip(shares) {
                    *sum += share * power;
                }
            }
            *source = self.make(self.field.foot(east, south), powers, node_of(cell.energy_ev), self.key(!cell.number));
        }
    }

    /// Particles as they are `later` seconds after their step, with the green light of each.
    fn particles(&self, particles: &AuroraParticles, green_w: &[f32], later: f32) -> Vec<Source> {
        let level = Level::new();
        let mut sources = vec![Source::default(); particles.len()];
        sources.par_chunks_mut(TASK).enumerate().for_each(|(task, sources)| {
            dispatch!(level, _simd => self.fill_from_particles(sources, particles, green_w, task * TASK, later));
        });
        sources
    }

    #[inline(always)]
    fn fill_from_particles(
        &self,
        sources: &mut [Source],
        particles: &AuroraParticles,
        green_w: &[f32],
        first: usize,
        later: f32,
    ) {
        let ([xs, zs], [us, ws]) = (&particles.positions, &particles.velocities);
        for (number, sources) in sources.chunks_mut(LANES).enumerate() {
            let (first, count) = (first + number * LANES, sources.len());
            let mut places = [[0.0; LANES]; 2];
            let mut energies = [LOWEST_EV as f32; LANES];
            for i in 0..count {
                places[0][i] = us[first + i].fma(later, xs[first + i]);
                places[1][i] = ws[first + i].fma(later, zs[first + i]);
                energies[i] = particles.energies_ev[first + i];
            }
            let mut feet = [[0.0; LANES]; 3];
            let mut nodes = [0.0; LANES];
            for i in 0..LANES {
                let Foot { across: [x, y], upright } = self.field.foot(places[0][i], places[1][i]);
                (feet[0][i], feet[1][i], feet[2][i]) = (x, y, upright);
                nodes[i] = node_of(energies[i]);
            }
            for (i, source) in sources.iter_mut().enumerate() {
                let foot = Foot { across: [feet[0][i], feet[1][i]], upright: feet[2][i] };
                let powers = [green_w[first + i], 0.0, particles.powers_w[first + i]];
                let key = self.key(particles.ids[first + i] as u32);
                *source = self.make(foot, powers, nodes[i], key);
            }
        }
    }
}

impl Sources {
    /// What shines while the shutter is open.
    pub(crate) fn new(light: &Light, field: &FieldLines, moments: &Moments) -> Self {
        let falling = light.parameters.sampling == Sampling::Collisions;
        let faintest = if falling { FAINTEST_FALLING } else { FAINTEST };
        let glow = light.glow;
        let column = light.emission.column(light.energy_ev);
        let spread = math::hypot(light.spread_km(), moments.smear_km);
        let with = |emitter: Emitter, cell_km: f64| {
            let diffusion = column.spread_km[emitter.index()];
            math::sqrt(spread * spread + diffusion * diffusion + cell_km * cell_km / 6.0)
        };
        let own = [with(Emitter::OxygenGreen, glow.green.cell_km()), with(Emitter::OxygenRed, glow.red.cell_km())];
        let blocks = [glow.green.block(own[0]), glow.red.block(own[1])];
        let ((green_w, green), red) = rayon::join(
            || glow.green.shared_out(light.particles, faintest, blocks[0]),
            || glow.red.bright_blocks(FAINTEST, blocks[1]),
        );
        // What is drawn from the middle of a block is spread as its cells would be.
        let of_block = |own: f64, cell_km: f64, block: usize| {
            math::sqrt(own * own + ((block * block - 1) as f64) * cell_km * cell_km / 12.0)
        };
        let green_spread = of_block(own[0], glow.green.cell_km(), blocks[0]);
        let red_spread = of_block(own[1], glow.red.cell_km(), blocks[1]);
        let maker = |spread: f64, share, instant| Maker { field, reach: spread as f32 * REACH, share, instant };
        let mut sharp = maker(green_spread, 1.0, moments.first).cells(&green, GREEN);
        let share = 1.0 / moments.later.len().max(1) as f32;
        for (later, instant) in moments.later.iter().zip(moments.first..) {
            sharp.extend(maker(spread, share, instant).particles(light.particles, &green_w, *later as f32));
        }
        let soft = maker(red_spread, 1.0, moments.first).cells(&red, RED);
        Self { sharp, soft, spread_km: [spread, red_spread] }
    }
}

impl Sources {
    /// Adds others with a share of their power.
    pub(crate) fn add(&mut self, others: &Self, share: f32) {
        let first = self.sharp.is_empty() && self.soft.is_empty();
        for (own, others) in [(&mut self.sharp, &others.sharp), (&mut self.soft, &others.soft)] {
            let dimmed = |source: &Source| Source { power: source.power.map(|power| share * power), ..*source };
            own.extend(others.iter().map(dimmed));
        }
        for (own, other) in self.spread_km.iter_mut().zip(others.spread_km) {
            *own = if first { other } else { own.min(other) };
        }
    }
}

/// When particles are drawn.
pub(crate) struct Moments {
    /// Instants, s after their step; each has an equal part of the power.
    pub(crate) later: Vec<f64>,
    /// Number of the first of them.
    pub(crate) first: u32,
    /// How far they are spread by their motion from one to the next (standard deviation), km.
    pub(crate) smear_km: f64,
}

/// What an aurora's light is made from.
pub(crate) struct Light<'a> {
    pub(crate) particles: &'a AuroraParticles,
    /// The green and the red map.
    pub(crate) glow: &'a Afterglow,
    pub(crate) emission: &'a Emission,
    pub(crate) parameters: &'a DrawingParameters,
    /// Mean distance of neighbouring particles, km.
    pub(crate) spacing_km: f64,
    /// Energy of the electrons where nothing varies it, eV.
    pub(crate) energy_ev: f64,
    /// Spread of collisions about their field line, km.
    pub(crate) wander_km: f64,
}

impl Light<'_> {
    /// Standard deviation of the light of a particle across the field, km.
    pub(crate) fn spread_km(&self) -> f64 {
        let own = match (self.parameters.blur, self.parameters.spread_km) {
            (Blur::Pixels, _) => 0.0,
            (Blur::Kilometres, Auto::Set(spread)) => spread,
            (Blur::Kilometres, Auto::Auto) => SPREAD_PER_SPACING * self.spacing_km,
        };
        math::hypot(own, self.wander_km).max(1e-3)
    }
}

/// The node of the grid that is nearest to an energy.
pub(crate) fn nearest_node(energy_ev: f64) -> usize {
    let least = |node: &usize| (math::ln(node_energy_ev(*node) / energy_ev.max(1.0))).abs();
    (0..NODES).min_by(|a, b| least(a).total_cmp(&least(b))).unwrap_or(0)
}
