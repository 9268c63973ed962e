//! The grid: how fine it must be, and how much space a flame needs.

use bansho_base::{
    host::memory,
    math::{self, DVec3},
    parameters::Auto,
    world::{air::Air, gravity::STANDARD_GRAVITY},
};
use bansho_fluid::{Flow, Grid};

use crate::{
    particles::heskestad,
    volume::{
        error::{VolumeError, VolumeErrorKind},
        parameters::{FlameVolumeParameters, GridQuality},
        simulate::burners::VolumeBurner,
    },
};

/// Most cells of a flame.
const MAX_CELLS: f64 = 200e6;
/// Memory of a cell, bytes: the flow's fields, and what drawing takes.
pub(crate) const BYTES_PER_CELL: f64 = Flow::BYTES_PER_CELL + 24.0;

/// Lengths of a fire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FireSize {
    /// Heat release rate of all burners, kW.
    pub(crate) heat_release_kw: f64,
    /// Diameter of a disk of the area of all burners, m.
    pub(crate) diameter: f64,
    /// Expected mean height, m.
    pub(crate) height: f64,
    /// Characteristic diameter `(Q / (rho c_p T sqrt(g)))^(2/5)`, m.
    pub(crate) characteristic_diameter: f64,
}

impl FireSize {
    pub(crate) fn new(burners: &[VolumeBurner]) -> Self {
        let heat_release_kw: f64 = burners.iter().map(|burner| burner.heat_release_kw * burner.largest_flow).sum();
        let area: f64 = burners.iter().map(|burner| burner.area_m2).sum();
        let diameter = math::sqrt(4.0 * area / std::f64::consts::PI);
        let air = Air::default();
        let power_scale = air.density() * 1.005 * air.temperature_k * math::sqrt(STANDARD_GRAVITY);
        let characteristic_diameter = math::pow(heat_release_kw.max(1e-3) / power_scale, 0.4);
        let height = heskestad(heat_release_kw, diameter).max(0.6 * diameter).max(0.8 * characteristic_diameter);
        Self { heat_release_kw, diameter, height, characteristic_diameter }
    }
}

/// Side of a cell, m.
fn spacing(parameters: &FlameVolumeParameters, burners: &[VolumeBurner], size: &FireSize) -> f64 {
    let cells = match parameters.quality {
        GridQuality::Preview => 9.0,
        GridQuality::Standard => 14.0,
        GridQuality::Final => 24.0,
    };
    match parameters.resolution {
        Auto::Set(resolution) => 1.0 / resolution,
        Auto::Auto => {
            let largest = burners.iter().map(|burner| burner.diameter).fold(0.0, f64::max);
            // A small burner with a tall flame is resolved by the width of its flame.
            size.characteristic_diameter.min(largest.max(0.4 * size.characteristic_diameter)) / cells
        }
    }
}

/// The grid on which a flame begins, of twice the spacing of its final grid.
pub(crate) fn coarse_grid(
    parameters: &FlameVolumeParameters,
    burners: &[VolumeBurner],
    size: &FireSize,
) -> Result<Grid, VolumeError> {
    let [low, high] = corners(parameters, burners, size)?;
    let spacing = spacing(parameters, burners, size);
    let cells_at =
        |spacing: f64| (high - low).to_array().map(|side| (side / spacing).ceil().max(4.0)).iter().product::<f64>();
    let cells = cells_at(spacing);
    if cells > MAX_CELLS || !memory::can_allocate(cells * BYTES_PER_CELL) {
        let mut limit = spacing;
        while cells_at(limit) > MAX_CELLS || !memory::can_allocate(cells_at(limit) * BYTES_PER_CELL) {
            limit *= 1.05;
        }
        let kind = VolumeErrorKind::TooManyCells {
            resolution: 1.0 / spacing,
            cells: cells * 1e-6,
            gib: cells * BYTES_PER_CELL / f64::from(1 << 30),
            limit: 1.0 / limit,
        };
        return Err(VolumeError { key: "resolution".into(), kind });
    }
    // The flame begins on a grid of twice the spacing.
    let coarse = 2.0 * spacing;
    let sides = (high - low).to_array().map(|side| (side / coarse).ceil() as usize);
    let mut grid = Grid::new(sides, coarse, low);
    // What rounding up adds to the sides is added on both of them.
    for axis in [0, 2] {
        grid.origin[axis] -= 0.5 * ((grid.size[axis] - sides[axis].min(grid.size[axis])) as f64) * coarse;
    }
    Ok(grid)
}

/// Corners of the domain relative to the flame's position.
fn corners(
    parameters: &FlameVolumeParameters,
    burners: &[VolumeBurner],
    size: &FireSize,
) -> Result<[DVec3; 2], VolumeError> {
    if let (Auto::Set(min), Auto::Set(max)) = (parameters.domain_min, parameters.domain_max)
        && DVec3::from(min).cmpge(DVec3::from(max)).any()
    {
        return Err(VolumeError { key: "domain_max".into(), kind: VolumeErrorKind::EmptyDomain { min, max } });
    }
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (index, burner) in burners.iter().enumerate() {
        let [first, last] = burner.extent();
        (low, high) = (low.min(first), high.max(last));
        for (corner, limit, is_beyond) in
            [("domain_min", parameters.domain_min, first), ("domain_max", parameters.domain_max, last)]
        {
            let Auto::Set(limit) = limit else { continue };
            let excess =
                if corner == "domain_min" { DVec3::from(limit) - is_beyond } else { is_beyond - DVec3::from(limit) };
            if excess.max_element() > 1e-6 {
                let kind = VolumeErrorKind::OutsideDomain { position: is_beyond.into(), corner, limit };
                let is_placed = burner.is_placed;
                return Err(VolumeError {
                    key: if is_placed { format!("burners.{index}.position") } else { corner.into() },
                    kind,
                });
            }
        }
    }
    // Air is drawn in from the sides; a flame necks above its burner and widens in the plume. Wind bends it.
    let margin = 0.45 * size.height + 0.35 * size.diameter;
    let above = 1.7 * size.height + 0.5 * size.diameter;
    let below = if parameters.floor { 0.0 } else { 0.25 * size.diameter + 0.1 * size.height };
    low -= DVec3::new(margin, below, margin);
    high += DVec3::new(margin, above, margin);
    if let Auto::Set(corner) = parameters.domain_min {
        low = DVec3::from(corner);
    }
    if let Auto::Set(corner) = parameters.domain_max {
        high = DVec3::from(corner);
    }
    Ok([low, high])
}
