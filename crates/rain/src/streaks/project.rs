//! Projection of drops into streaks: which drops of which cells are visible, and how each is lit.

use bansho_base::{
    host::parallel::prelude::*,
    math::{
        DVec3,
        random::Purpose,
        simd::{LANES, Real},
    },
    phenomenon::surroundings::Light,
};
use fearless_simd::{Level, dispatch};

use super::{
    bin::{StreakChunk, StreakChunkBuilder},
    oscillation::Oscillation,
    project_lanes::{DropPaths, StreakBatch},
    rasterize::StreakSegment,
};
use crate::{
    drops::{
        cell_drops::{CellDrops, DropBatch},
        classes::DropClassState,
        lattice::{CELL_SIZE, LatticeCell},
        shutter_state::{ShutterState, Sphere, VisibleCell},
    },
    lanes::{LaneArray, Vec3Lanes, ZERO_LANES, smoothstep},
    lighting::{
        drop_lighting::{DropLighting, PreparedLight},
        sky::SkyOnDrops,
    },
    shutter_cameras::ShutterCameras,
};

const OSCILLATION: Purpose = Purpose::named("rain drop oscillation");
/// Number of chunks of all cells, and bounds on the number of cells in each.
const CHUNK_COUNT: usize = 64;
const CELLS_PER_CHUNK: [usize; 2] = [8, 256];
/// Projects drops into lit streaks.
#[derive(Clone, Copy)]
pub(crate) struct StreakProjection<'a> {
    pub(crate) level: Level,
    pub(crate) shutter_state: &'a ShutterState,
    pub(crate) lighting: &'a DropLighting<'a>,
    /// The same lights, prepared for SIMD.
    pub(crate) lights: &'a [PreparedLight],
    /// Radiance of drops under the sky; `None` for a dark sky.
    pub(crate) sky: Option<&'a SkyOnDrops>,
    /// Amplitude of the brightness of streaks as drops oscillate.
    pub(crate) oscillation: f64,
    /// Weights of the drops.
    pub(crate) selection: DropSelection<'a>,
}

impl VisibleStreaks {
    /// Whether any drop may be seen.
    #[inline(always)]
    pub(crate) fn any(&self) -> bool {
        self.streaks.any_visible() || self.streaks.any_pieces()
    }

    /// Whether the drop of a lane is seen, whole or in pieces.
    pub(crate) fn is_seen(&self, i: usize, cameras: &ShutterCameras) -> bool {
        let count = self.streaks.pieces[i] as usize;
        self.streaks.visible[i] != 0 || count > 0 && self.paths.pieces(i, count, cameras).streaks.any_visible()
    }
}

/// Weights of drops: near drops are drawn one by one, others on billboards.
#[derive(Clone, Copy)]
pub(crate) enum DropSelection<'a> {
    /// All drops.
    All,
    /// The drops that are drawn one by one.
    PerDrop(&'a PerDropRegion),
    /// The drops on billboards.
    Billboard(&'a PerDropRegion),
}

/// Streaks of sixteen drops, and how they were weighted.
pub(crate) struct VisibleStreaks {
    /// Weights of the drops, 0 to 1: presence, and what the selection and the distance from the camera leave of it.
    pub(crate) weights: LaneArray,
    /// Paths, clipped at the ground.
    pub(crate) paths: DropPaths,
    pub(crate) streaks: StreakBatch,
}

impl DropSelection<'_> {
    /// The streaks of drops in the picture, without light. Drops that a solid shelters are not visible.
    #[inline(always)]
    pub(crate) fn visible_streaks(&self, shutter_state: &ShutterState, drops: &DropBatch) -> VisibleStreaks {
        let [xs, ys, zs] = &drops.positions;
        let selected = self.weights(&drops.positions);
        let half = 0.5 * shutter_state.cameras.exposure_time as f32;
        let mut weights = ZERO_LANES;
        let mut paths = DropPaths {
            from: drops.positions,
            to: drops.positions,
            diameter_mm: [drops.diameter_mm; LANES],
            gain: ZERO_LANES,
        };
        for i in 0..LANES {
            let distance = (xs[i] * xs[i] + ys[i] * ys[i] + zs[i] * zs[i]).sqrt();
            weights[i] = drops.presence[i] * shutter_state.streak_weight(distance) * selected[i];
            paths.gain[i] = weights[i] * drops.opacity_factor;
        }
        for axis in 0..3 {
            for i in 0..LANES {
                let travel = half * drops.velocities[axis][i];
                paths.from[axis][i] -= travel;
                paths.to[axis][i] += travel;
            }
        }
        if let Some([open, close]) = &drops.bends {
            for (side, axis) in [(0, 0), (1, 2)] {
                for i in 0..LANES {
                    paths.from[axis][i] += open[side][i];
                    paths.to[axis][i] += close[side][i];
                }
            }
        }
        let eye = shutter_state.cameras.middle().position;
        paths.clip_at_ground((shutter_state.ground - eye.y) as f32);
        let mut streaks = paths.streaks(&shutter_state.cameras);
        // After the projection, since few drops are in the picture and the test of each is a search through solids.
        if shutter_state.has_occluders() {
            for i in 0..LANES {
                let [position, velocity] = [&drops.positions, &drops.velocities].map(|vectors| vector(vectors, i));
                let is_seen = streaks.visible[i] != 0 || streaks.pieces[i] > 0;
                if is_seen && shutter_state.is_sheltered(eye + position, velocity) {
                    (streaks.visible[i], streaks.pieces[i]) = (0, 0);
                }
            }
        }
        VisibleStreaks { weights, paths, streaks }
    }

    /// Weights of drops at positions relative to the camera.
    #[inline(always)]
    fn weights(&self, positions: &Vec3Lanes) -> LaneArray {
        let mut weights = [1.0; LANES];
        match self {
            Self::All => {}
            Self::PerDrop(region) => weights = region.weights(positions),
            Self::Billboard(region) => {
                let per_drop = region.weights(positions);
                for i in 0..LANES {
                    weights[i] -= per_drop[i];
                }
            }
        }
        weights
    }
}

impl StreakProjection<'_> {
    /// The streaks of all cells that may be visible within some spheres, drop by drop.
    pub(crate) fn drop_chunks(&self, within: &[Sphere]) -> Vec<StreakChunk> {
        self.cell_chunks(
            within,
            0.5 * CELL_SIZE,
            |class, visible, builder| dispatch!(self.level, _simd => self.add_cell(class, visible.cell, builder)),
        )
    }

    /// The streaks of all cells that may be visible within some spheres, nearest cells first. `add` adds those of one
    /// cell, up to `half_width` (m) horizontally from its center.
    pub(crate) fn cell_chunks(
        &self,
        within: &[Sphere],
        half_width: f64,
        add: impl Fn(&DropClassState, &VisibleCell, &mut StreakChunkBuilder) + Sync,
    ) -> Vec<StreakChunk> {
        let cameras = &self.shutter_state.cameras;
        map_cell_chunks(self.shutter_state, within, half_width, |cells| {
            let mut builder = StreakChunkBuilder::new(cameras);
            for (visible, class) in cells {
                builder.add_cell(|builder| add(class, visible, builder));
            }
            builder.build()
        })
    }

    /// Adds the streaks of a cell, drop by drop.
    #[inline(always)]
    fn add_cell(&self, class: &DropClassState, cell: LatticeCell, builder: &mut StreakChunkBuilder) {
        let drops = CellDrops::new(self.shutter_state, class, cell);
        for first in (0..drops.count()).step_by(LANES) {
            self.add_drops(&drops.batch(first), 0.0, builder);
        }
    }

    /// Adds the streaks of visible drops. Those with a peak opacity below `min_peak` are not lit by lamps and fires.
    #[inline(always)]
    pub(crate) fn add_drops(&self, drops: &DropBatch, min_peak: f32, builder: &mut StreakChunkBuilder) {
        let VisibleStreaks { paths, streaks, .. } = self.selection.visible_streaks(self.shutter_state, drops);
        self.add_paths(&paths, &streaks, &drops.positions, min_peak, builder);
    }

    /// Lights and adds the visible `streaks` of the paths of drops, which are at some positions at the middle of the exposure.
    #[inline(always)]
    pub(crate) fn add_paths(
        &self,
        paths: &DropPaths,
        streaks: &StreakBatch,
        positions: &Vec3Lanes,
        min_peak: f32,
        builder: &mut StreakChunkBuilder,
    ) {
        if streaks.any_visible() {
            self.add_streaks(streaks, positions, &paths.diameter_mm, None, min_peak, builder);
        }
        if streaks.any_pieces() {
            for i in (0..LANES).filter(|i| streaks.pieces[*i] > 0) {
                let pieces = paths.pieces(i, streaks.pieces[i] as usize, &self.shutter_state.cameras);
                let drop = PiecesOf { position: [0, 1, 2].map(|axis| positions[axis][i]), count: pieces.count };
                let diameters_mm = [paths.diameter_mm[i]; LANES];
                self.add_streaks(&pieces.streaks, &pieces.positions, &diameters_mm, Some(drop), min_peak, builder);
            }
        }
    }

    /// Lights and adds the visible streaks of drops at some positions, or of the pieces of the path of one drop.
    #[inline(always)]
    fn add_streaks(
        &self,
        streaks: &StreakBatch,
        positions: &Vec3Lanes,
        diameters_mm: &LaneArray,
        pieces_of: Option<PiecesOf>,
        min_peak: f32,
        builder: &mut StreakChunkBuilder,
    ) {
        let mut lit = ZERO_LANES;
        for i in 0..LANES {
            // As weights of 0 and 1: the light of all sixteen drops is computed without a branch.
            let is_lit = (streaks.peak[i] >= min_peak) & (streaks.visible[i] != 0);
            lit[i] = if is_lit { 1.0 } else { 0.0 };
        }
        let mut radiance = [[0.0; 3]; LANES];
        for light in self.lights {
            self.lighting.add(light, positions, &lit, &mut radiance);
        }
        for i in 0..LANES {
            if streaks.visible[i] == 0 {
                continue;
            }
            let mut segment = streaks.segment(i, diameters_mm[i], radiance[i]);
            let sky = self.sky.map_or([0.0; 3], |sky| sky.tiles.at(&sky.radiance, segment.center));
            if self.oscillation > 0.0 {
                let whole = PiecesOf { position: [0, 1, 2].map(|axis| positions[axis][i]), count: 1 };
                let (drop, piece) = pieces_of.map_or((whole, 0), |drop| (drop, i));
                self.add_speckled(&segment, sky, drop, piece, builder);
                continue;
            }
            if self.sky.is_some() {
                segment.shading.add_light(sky);
            }
            builder.add(&segment, streaks.extent(i));
        }
    }

    /// Adds a streak whose drop oscillates, one of the pieces of its path: in the light of lamps and fires its parts are brighter and darker. The sky lights
    /// a drop from all sides, so its shape changes little there.
    fn add_speckled(
        &self,
        segment: &StreakSegment,
        sky: [f32; 3],
        drop: PiecesOf,
        piece: usize,
        builder: &mut StreakChunkBuilder,
    ) {
        let exposure = self.shutter_state.cameras.exposure_time / drop.count as f64;
        // The position identifies a drop: its phases are then the same for all pieces of its path.
        let words = drop.position.map(f32::to_bits);
        let id = u64::from(words[0]) << 32 | u64::from(words[1]);
        let phases = self.shutter_state.key.uniforms(id, words[2], OSCILLATION);
        let oscillation = Oscillation::new(segment.diameter_mm.into(), self.oscillation, [phases[0], phases[1]]);
        let count = oscillation.piece_count(exposure, segment.length());
        for index in 0..count {
            let [from, to] = [index, index + 1].map(|step| exposure * (piece as f64 + step as f64 / count as f64));
            let brightness = oscillation.mean_brightness(from, to) as f32;
            let mut part = segment.piece(index, count);
            part.shading.light = segment.shading.light.map(|light| light * brightness);
            part.shading.add_light(sky);
            let extent = part.extent();
            builder.add(&part, extent);
        }
    }
}

/// A drop whose path is cut into pieces.
#[derive(Clone, Copy)]
struct PiecesOf {
    /// At the middle of the exposure, relative to the camera, m.
    position: [f32; 3],
    count: usize,
}

/// Maps all cells that may be visible within some spheres, nearest cells first and a chunk of cells at a time. Drops are
/// drawn up to `half_width` (m) horizontally from the center of their cell.
pub(crate) fn map_cell_chunks<T: Send>(
    shutter_state: &ShutterState,
    within: &[Sphere],
    half_width: f64,
    map: impl Fn(&[(VisibleCell, &DropClassState)]) -> T + Sync,
) -> Vec<T> {
    let classes = shutter_state.classes.par_iter().filter(|class| class.fraction > 0.0);
    let of_class =
        |class| unique_cells(shutter_state, class, within, half_width).into_iter().map(move |cell| (cell, class));
    let lists: Vec<Vec<_>> = classes.map(|class| of_class(class).collect()).collect();
    let mut cells = lists.concat();
    // A stable sort of lists in the order of the classes: equal distances keep one order with any number of threads.
    cells.sort_by(|(a, _), (b, _)| a.distance.total_cmp(&b.distance));
    let [min, max] = CELLS_PER_CHUNK;
    // The number of chunks depends on the number of cells only, so that the order of compositing is the same on all machines.
    cells.par_chunks((cells.len() / CHUNK_COUNT).clamp(min, max)).map(&map).collect()
}

/// The cells of a class that may be visible within any of some spheres, each once.
fn unique_cells(
    shutter_state: &ShutterState,
    class: &DropClassState,
    within: &[Sphere],
    half_width: f64,
) -> Vec<VisibleCell> {
    if let [sphere] = within {
        return shutter_state.visible_cells(class, *sphere, half_width);
    }
    let mut cells: Vec<_> =
        within.iter().flat_map(|sphere| shutter_state.visible_cells(class, *sphere, half_width)).collect();
    cells.sort_by_key(|visible| visible.cell);
    cells.dedup_by_key(|visible| visible.cell);
    cells
}

/// The vector of one lane.
pub(crate) fn vector(vectors: &Vec3Lanes, i: usize) -> DVec3 {
    DVec3::new(vectors[0][i].into(), vectors[1][i].into(), vectors[2][i].into())
}

/// Radius around the camera within which drops are drawn one by one, m: at this distance a cubic meter cannot be
/// treated as flat.
pub(super) const CAMERA_RADIUS: f64 = 1.0;
/// The same around a lamp, m: a cubic meter is lit too unevenly there.
pub(super) const LAMP_RADIUS: f64 = 1.3;
/// Width of the transition to billboards, m.
const FADE_WIDTH: f64 = 0.2;

/// The region around the camera and around lamps in which drops are drawn one by one, beside billboards.
pub(crate) struct PerDropRegion {
    spheres: Vec<Sphere>,
    /// The same spheres relative to the camera.
    from_camera: Vec<SphereF32>,
}

/// A sphere in single precision, relative to the camera.
struct SphereF32 {
    /// m.
    center: [f32; 3],
    /// m.
    radius: f32,
}

impl PerDropRegion {
    pub(crate) fn new(shutter_state: &ShutterState, lights: &[Light]) -> Self {
        let eye = shutter_state.cameras.middle().position;
        let radius = LAMP_RADIUS + FADE_WIDTH;
        let mut spheres = vec![shutter_state.around_camera(CAMERA_RADIUS + FADE_WIDTH)];
        for center in lights.iter().filter_map(|light| light.emitter.position()) {
            if (center - eye).length() < 1.1 * shutter_state.distance + radius {
                spheres.push(Sphere { center, radius });
            }
        }
        let from_camera = spheres.iter().map(|sphere| SphereF32 {
            center: (sphere.center - eye).as_vec3().to_array(),
            radius: sphere.radius as f32,
        });
        Self { from_camera: from_camera.collect(), spheres }
    }

    /// Spheres outside of which no drop is drawn one by one.
    pub(crate) fn spheres(&self) -> &[Sphere] {
        &self.spheres
    }

    /// Weights of drops at positions relative to the camera, 0 to 1.
    #[inline(always)]
    pub(super) fn weights(&self, [xs, ys, zs]: &Vec3Lanes) -> LaneArray {
        let mut weights = ZERO_LANES;
        for &SphereF32 { center: [x, y, z], radius } in &self.from_camera {
            for i in 0..LANES {
                let offset = [xs[i] - x, ys[i] - y, zs[i] - z];
                let distance = (offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]).sqrt();
                weights[i] = smoothstep((radius - distance) * (1.0 / FADE_WIDTH) as f32).simd_max(weights[i]);
            }
        }
        weights
    }
}
