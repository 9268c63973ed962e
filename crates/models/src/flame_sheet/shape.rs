//! What of the chain does not change with time, as tables.

use bansho_base::{
    curve::Curve,
    random::Key,
};

use super::{
    chain,
    lanes::{LANES, Lanes, greatest, hold, least},
    parameters::{ColourParameters, ShapeParameters, TextureParameters},
    tables::CurveTable,
};
use crate::fault::{FaultKind, ParameterFault};

/// Pieces of height for which the reach of the flame is known.
const REACH_BINS: usize = 128;

/// Curves of eqs. (4) to (12) as tables.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    initial_speed: f32,
    edge_speed: f32,
    /// A and D over w.
    widths: CurveTable<2>,
    /// F over the place in the fringe.
    falling: CurveTable<1>,
    /// H over u'.
    across: CurveTable<1>,
    /// V and the glow over w, at the places of a table.
    height_samples: Vec<[f32; 2]>,
    /// A and D over w, at the places of a table.
    width_samples: Vec<[f32; 2]>,
    /// Greatest x' at which there may be flame, over y.
    reach: Box<[f32; REACH_BINS]>,
}

/// A curve with the point (0, 0) that the paper demands added, unless the artist gave it.
pub(crate) fn from_origin(curve: &Curve, key: &'static str) -> Result<Curve, ParameterFault> {
    let mut points = curve.points().to_vec();
    match points.first() {
        Some([x, y]) if *x <= 0.0 && *y != 0.0 => {
            return Err(ParameterFault { key, kind: FaultKind::NotZeroAtOrigin { value: *y } });
        }
        Some([x, _]) if *x > 0.0 => points.insert(0, [0.0, 0.0]),
        _ => {}
    }
    Ok(Curve::new(points, curve.interpolation()).unwrap_or_else(|_| curve.clone()))
}

fn check_widths(samples: &[[f32; 2]]) -> Result<(), ParameterFault> {
    const SLACK: f32 = 1e-6;
    let widest = samples.iter().enumerate().max_by(|a, b| (a.1[0] + a.1[1]).total_cmp(&(b.1[0] + b.1[1])));
    match widest {
        Some((i, [core, fringe])) if core + fringe > 1.0 + SLACK => Err(ParameterFault {
            key: "shape.fringe_width",
            kind: FaultKind::WiderThanSheet {
                at: i as f64 / (samples.len() - 1) as f64,
                sum: f64::from(core + fringe),
            },
        }),
        _ => Ok(()),
    }
}

/// Both curves at the places of a table.
fn samples(first: &Curve, second: &Curve) -> Vec<[f32; 2]> {
    let count = super::tables::SEGMENTS + 1;
    let rows = [first, second].map(|curve| curve.sample_table(count, 0.0, 1.0));
    rows[0].iter().zip(&rows[1]).map(|(a, b)| [*a, *b]).collect()
}

/// Where sixteen points lie in the flame.
pub(crate) struct Place {
    /// Texture coordinate u.
    pub(crate) u: Lanes,
    /// Height w of the slowed rise.
    pub(crate) w: Lanes,
    /// u' of eq. (16).
    pub(crate) across: Lanes,
    /// Threshold L, eq. (4).
    pub(crate) threshold: Lanes,
    /// Brightness and soot at that height.
    pub(crate) glow: Lanes,
    /// Share of the pixel that lies inside; 0 outside.
    pub(crate) coverage: Lanes,
}

impl Shape {
    /// Tables for these curves.
    ///
    /// # Errors
    /// A curve that must begin at the origin does not, or core and fringe together are wider than the sheet.
    pub(crate) fn new(shape: &ShapeParameters, texture: &TextureParameters, colour: &ColourParameters) -> Result<Self, ParameterFault> {
        let fringe = from_origin(&shape.fringe_width, "shape.fringe_width")?;
        let width_samples = samples(&shape.core_width, &fringe);
        check_widths(&width_samples)?;
        let mut result = Self {
            initial_speed: shape.initial_speed as f32,
            edge_speed: shape.edge_speed as f32,
            widths: CurveTable::from_samples(|i| width_samples[i]),
            falling: CurveTable::new(|place| [1.0 - shape.slowing.eval(place)]),
            across: CurveTable::new(|across| [texture.threshold_across.eval(across)]),
            height_samples: samples(&texture.threshold, &colour.glow),
            width_samples,
            reach: Box::new([1.0; REACH_BINS]),
        };
        result.reach = result.find_reach();
        Ok(result)
    }

    /// The time-dependent edges beside the threshold and the glow, over w: E left, E right, V, glow; eq. (15).
    pub(crate) fn heights(&self, flutter_left: &[f32], flutter_right: &[f32]) -> CurveTable<4> {
        CurveTable::from_samples(|i| {
            let [core, fringe] = self.width_samples[i];
            let [vertical, glow] = self.height_samples[i];
            let edge = |flutter: f32| chain::fluttering_edge(core, fringe, flutter);
            [edge(flutter_left[i]), edge(flutter_right[i]), vertical, glow]
        })
    }

    /// Rise, profile and slowed rise, eqs. (9) to (12).
    #[inline(always)]
    fn slowed_rise(&self, distance: &Lanes, y: &Lanes) -> Lanes {
        let mut rise = [0.0; LANES];
        for i in 0..LANES {
            rise[i] = chain::rise(y[i], self.initial_speed);
        }
        let [core, fringe] = self.widths.sample(&rise);
        let mut furthest = -1.0;
        for i in 0..LANES {
            furthest = greatest(distance[i] - core[i], furthest);
        }
        if furthest <= 0.0 {
            return rise;
        }
        let mut place = [0.0; LANES];
        for i in 0..LANES {
            place[i] = chain::fringe_place(distance[i], core[i], fringe[i]);
        }
        let [falling] = self.falling.sample(&place);
        let mut slowed = [0.0; LANES];
        for i in 0..LANES {
            slowed[i] = chain::slowed_rise(rise[i], chain::speed_profile(falling[i], self.edge_speed));
        }
        slowed
    }

    /// The whole mapping, eqs. (9) to (18), and the threshold, eq. (4), for points of the unit square.
    ///
    /// `pixel` is the size of a pixel in x' and in y, over which edges are softened. `None` where all lie outside.
    #[inline(always)]
    pub(crate) fn place(&self, x: &Lanes, y: &Lanes, heights: &CurveTable<4>, pixel: [f32; 2]) -> Option<Place> {
        let (mut distance, mut inside_y) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            distance[i] = chain::axis_distance(x[i]);
            inside_y[i] = hold(y[i], 0.0, 1.0);
        }
        if self.out_of_reach(&distance, y) {
            return None;
        }
        let w = self.slowed_rise(&distance, &inside_y);
        let [left, right, vertical, glow] = heights.sample(&w);
        let per_pixel = [1.0 / pixel[0], 1.0 / pixel[1]];
        let mut place = Place { u: w, w, across: w, threshold: w, glow, coverage: w };
        for i in 0..LANES {
            let edge = if x[i] < 0.5 { left[i] } else { right[i] };
            place.across[i] = chain::across(distance[i], edge);
            place.u[i] = chain::texture_u(least(place.across[i], 1.0), x[i]);
            let side = hold((edge - distance[i]).mul_add(per_pixel[0], 0.5), 0.0, 1.0);
            let bottom = hold(y[i].mul_add(per_pixel[1], 0.5), 0.0, 1.0);
            let top = hold((1.0 - w[i]).mul_add(per_pixel[1], 0.5), 0.0, 1.0);
            place.coverage[i] = side * bottom * top;
        }
        let [horizontal] = self.across.sample(&place.across);
        for i in 0..LANES {
            place.threshold[i] = chain::threshold(vertical[i], horizontal[i]);
        }
        Some(place)
    }

    /// The threshold, eq. (4), over the flat texture square.
    #[inline(always)]
    pub(crate) fn flat_threshold(&self, u: &Lanes, w: &Lanes, heights: &CurveTable<4>) -> Lanes {
        let [_, _, vertical, _] = heights.sample(w);
        let mut distance = [0.0; LANES];
        for i in 0..LANES {
            distance[i] = chain::axis_distance(u[i]);
        }
        let [horizontal] = self.across.sample(&distance);
        let mut threshold = [0.0; LANES];
        for i in 0..LANES {
            threshold[i] = chain::threshold(vertical[i], horizontal[i]);
        }
        threshold
    }

    /// Whether no point of a batch, along a row or nearly, can lie in the flame.
    #[inline(always)]
    fn out_of_reach(&self, distance: &Lanes, y: &Lanes) -> bool {
        let (mut low, mut high, mut nearest) = (y[0], y[0], distance[0]);
        for i in 1..LANES {
            low = least(y[i], low);
            high = greatest(y[i], high);
            nearest = least(distance[i], nearest);
        }
        if !(high > -0.1 && low < 1.1) {
            return true;
        }
        let bin = |y: f32| hold(y * REACH_BINS as f32, 0.0, (REACH_BINS - 1) as f32) as usize;
        let mut within = false;
        for reach in &self.reach[bin(low)..=bin(high)] {
            within |= nearest <= *reach;
        }
        !within
    }

    /// For each piece of height the greatest x' with w <= 1 and within the fringe, with a margin for soft edges.
    fn find_reach(&self) -> Box<[f32; REACH_BINS]> {
        const STEPS: usize = 256;
        const MARGIN: f32 = 0.03;
        let widest_above = self.widest_above();
        let mut reach = Box::new([0.0_f32; REACH_BINS]);
        for edge in 0..=REACH_BINS {
            let y = edge as f32 / REACH_BINS as f32;
            let mut far = 0.0_f32;
            for step in 0..STEPS / LANES {
                let distance: Lanes = std::array::from_fn(|i| (step * LANES + i + 1) as f32 / STEPS as f32);
                let w = self.slowed_rise(&distance, &[y; LANES]);
                for i in 0..LANES {
                    let row = ((w[i] * (widest_above.len() - 1) as f32) as usize).min(widest_above.len() - 1);
                    if w[i] <= 1.05 && distance[i] <= widest_above[row] + MARGIN {
                        far = far.max(distance[i] + MARGIN);
                    }
                }
            }
            for bin in [edge.saturating_sub(1), edge.min(REACH_BINS - 1)] {
                reach[bin] = reach[bin].max(far);
            }
        }
        reach
    }

    /// Greatest A + D at each sampled height or above it.
    fn widest_above(&self) -> Vec<f32> {
        let mut widest: Vec<f32> = self.width_samples.iter().map(|[core, fringe]| core + fringe).collect();
        for i in (0..widest.len() - 1).rev() {
            widest[i] = widest[i].max(widest[i + 1]);
        }
        widest
    }
}

/// The random key of one flame among the instances of a sheet.
pub(crate) fn instance_key(seed: u64, name: &str, variation: i64, index: usize) -> Key {
    Key::new(seed, &format!("{name}/{variation}/{index}"))
}
