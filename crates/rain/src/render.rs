//! A prepared frame of rain: streaks in chunks, and the medium of single scattering. It draws strips of the picture.
//!
//! A long exposure is drawn in [parts](crate::streaks::exposure_parts); the streaks of all parts are drawn together.

use bansho_base::{
    frame::MetadataEntry,
    image::Rect,
    math,
    phenomenon::{
        Prepared,
        strip::{DepthInterval, Strip, View},
        surroundings::{Publication, Surroundings},
    },
    world::sky::Sky,
};
use fearless_simd::{Level, Simd, dispatch};

use crate::{
    Rain,
    aovs::write_aovs,
    billboards::{Billboards, StochasticSimplification},
    drops::{shutter_state::ShutterState, size_distribution::DropSizeDistribution},
    lighting::{
        LightCaches,
        drop_lighting::{DropLighting, PreparedLight},
        extinction::{ExtinctionEfficiency, extinction, visibility},
        lamp_shadows::LampShadows,
        single_scattering::SingleScattering,
        sky::SkyOnDrops,
    },
    parameters::Method,
    streaks::{
        bin::StreakChunk,
        exposure_parts::streak_parts,
        project::{DropSelection, PerDropRegion, StreakProjection},
        rasterize::{
            PackedStreak,
            tile::{TILE_COLUMNS, TILE_ROWS, TileBuffer},
        },
        splashes::Splashes,
    },
    textured_billboards::TexturedBillboards,
};

/// Culling threshold as a fraction of display white: a hundred overlapping streaks below it stay below one 8-bit code.
const CULLING_FRACTION: f64 = 1.0 / (255.0 * 128.0);

/// A frame that is ready to be drawn in strips.
pub(crate) struct PreparedRain<'a> {
    view: &'a View,
    level: Level,
    /// Chunks of streaks, nearest first.
    chunks: Vec<StreakChunk>,
    /// Maximum distance of a streak, m.
    streaks_end: f64,
    /// The paper's billboards.
    textured: Option<TexturedBillboards<'a>>,
    single_scattering: Option<SingleScattering<'a>>,
    metadata: Vec<MetadataEntry>,
}

impl<'a> PreparedRain<'a> {
    /// The rain of a view. Light that was computed for earlier frames comes from `light_caches`.
    pub(crate) fn new(
        rain: &'a Rain,
        light_caches: &LightCaches,
        view: &'a View,
        surroundings: &'a Surroundings,
    ) -> Self {
        let extinction = rain.extinction(view.shutter.middle());
        let Publication { lights, shadow_casters, .. } = &surroundings.others;
        // The paper ignores what is between a lamp and the rain.
        let shadows = match rain.parameters.method {
            Method::Textures => LampShadows::default(),
            Method::Billboards | Method::Drops => light_caches.lamp_shadows.of_lights(lights, shadow_casters),
        };
        let scattering = &rain.optics.scattering;
        let lighting = DropLighting { scattering, lights, shadows: &shadows, extinction: extinction.all };
        let sky_lighting = light_caches.skies.for_view(&rain.optics.phase_function, view, surroundings.sky);
        let shutter_state = rain.shutter_state(view, surroundings);
        let mut textured = None;
        let mut streaks = Streaks::default();
        let parts = streak_parts(view);
        if rain.parameters.method == Method::Textures {
            textured = rain.textures.as_ref().map(|textures| {
                let (rate, gain) = (rain.rate(view.shutter.middle()), rain.parameters.opacity_gain);
                TexturedBillboards::new(
                    textures,
                    rate,
                    gain,
                    &shutter_state,
                    lights,
                    view,
                    culling_radiance(rain, view),
                )
            });
        }
        if let [_] = parts[..] {
            streaks.add_part(rain, &shutter_state, &lighting, &sky_lighting.coarse, view);
        } else {
            let share = 1.0 / parts.len() as f64;
            for part in &parts {
                let shutter_state = rain.shutter_state(part, surroundings).into_part(parts.len());
                streaks.add_part(rain, &shutter_state, &lighting, &sky_lighting.coarse, part);
            }
            streaks.drops *= share;
            streaks.billboards *= share;
        }
        if let Some(textured) = &textured {
            streaks.billboards += textured.count() as f64;
            streaks.drops += textured.drop_count() as f64;
        }
        let end = if rain.parameters.airlight_distance > 0.0 { rain.near_reach() } else { 0.0 };
        let unlit = DropLighting { lights: &[], ..lighting };
        // The paper only dims what is far away: dark rain up to the horizon would hide the sky.
        let (lighting, sky_lighting, farthest) = match rain.parameters.method {
            Method::Textures => {
                (&unlit, light_caches.skies.for_view(&rain.optics.phase_function, view, Sky::DARK), end)
            }
            Method::Billboards | Method::Drops => (&lighting, sky_lighting.clone(), rain.reach(surroundings)),
        };
        let single_scattering = SingleScattering::new(
            &shutter_state,
            lighting,
            sky_lighting,
            view,
            extinction,
            end,
            farthest,
            &light_caches.lamp_scattering,
        );
        let metadata = metadata(rain, view, streaks.drops, streaks.billboards);
        Self {
            view,
            level: bansho_base::math::simd::level(),
            chunks: streaks.chunks,
            streaks_end: rain.streaks_end(),
            textured,
            single_scattering,
            metadata,
        }
    }
}

/// Radiance below which the light of a streak is culled, cd/m^2.
fn culling_radiance(rain: &Rain, view: &View) -> f32 {
    let white = view.white_luminance.filter(|_| rain.parameters.culling);
    white.map_or(0.0, |white| (white * CULLING_FRACTION) as f32)
}

/// Metadata of a frame.
fn metadata(rain: &Rain, view: &View, drops: f64, billboards: f64) -> Vec<MetadataEntry> {
    let t = view.shutter.middle();
    let sizes = DropSizeDistribution::marshall_palmer(rain.rate(t));
    let entries = [
        ("rain_rate", "mm/h", rain.rate(t)),
        ("drops_in_view", "", drops.round()),
        ("billboards_in_view", "", billboards.round()),
        ("extinction", "1/m", extinction(&sizes, ExtinctionEfficiency::Geometric, DropSizeDistribution::ALL)),
        ("visibility", "m", visibility(&sizes)),
    ];
    entries.map(|(name, unit, value)| MetadataEntry { name, unit, value }).into()
}

/// The streaks of a frame.
#[derive(Default)]
struct Streaks {
    chunks: Vec<StreakChunk>,
    /// Number of drops and of billboards that they stand for.
    drops: f64,
    billboards: f64,
}

impl Streaks {
    /// Adds the streaks of one part of the exposure.
    fn add_part(
        &mut self,
        rain: &Rain,
        shutter_state: &ShutterState,
        lighting: &DropLighting,
        sky: &SkyOnDrops,
        view: &View,
    ) {
        let prepared_lights = lighting.prepare_lights(shutter_state.cameras.middle().position);
        let frame = FrameInputs { rain, shutter_state, lighting, prepared_lights: &prepared_lights, sky, view };
        let bounds = shutter_state.around_camera(1.1 * shutter_state.distance);
        let mut chunks = match rain.parameters.method {
            Method::Drops => frame.projection(DropSelection::All).drop_chunks(&[bounds]),
            Method::Billboards => {
                let region = PerDropRegion::new(shutter_state, lighting.lights);
                let mut chunks = frame.projection(DropSelection::PerDrop(&region)).drop_chunks(region.spheres());
                let projection = frame.projection(DropSelection::Billboard(&region));
                let billboard_chunks =
                    Billboards::new(projection, culling_radiance(rain, view), frame.simplification()).chunks(bounds);
                self.billboards += billboard_chunks.iter().map(|chunk| chunk.cell_count as f64).sum::<f64>();
                chunks.extend(billboard_chunks);
                chunks
            }
            Method::Textures => Vec::new(),
        };
        chunks.extend(frame.splashes());
        self.drops += chunks.iter().map(|chunk| chunk.drop_count).sum::<f64>();
        self.chunks.extend(chunks);
    }
}

/// The inputs of a part of a frame.
struct FrameInputs<'a> {
    rain: &'a Rain,
    shutter_state: &'a ShutterState,
    lighting: &'a DropLighting<'a>,
    prepared_lights: &'a [PreparedLight],
    sky: &'a SkyOnDrops,
    view: &'a View,
}

impl<'a> FrameInputs<'a> {
    /// The projection of the selected drops.
    fn projection(&self, selection: DropSelection<'a>) -> StreakProjection<'a> {
        StreakProjection {
            level: bansho_base::math::simd::level(),
            shutter_state: self.shutter_state,
            lighting: self.lighting,
            lights: self.prepared_lights,
            sky: self.bright_sky(),
            oscillation: self.rain.parameters.oscillation,
            selection,
        }
    }

    /// Radiance of drops under the sky; `None` if it is dark.
    fn bright_sky(&self) -> Option<&'a SkyOnDrops> {
        self.sky.radiance.iter().flatten().any(|value| *value > 0.0).then_some(self.sky)
    }

    fn splashes(&self) -> Vec<StreakChunk> {
        let splashes = Splashes {
            projection: self.projection(DropSelection::All),
            parameters: &self.rain.parameters.splashes,
            time: self.view.shutter.middle(),
            loop_s: self.rain.classes.loop_s,
        };
        splashes.chunks()
    }

    /// How far billboards are simplified; `None` to draw every drop.
    fn simplification(&self) -> Option<StochasticSimplification> {
        let codes = self.rain.parameters.simplification_codes;
        let white = self.view.white_luminance.filter(|_| codes > 0.0 && !self.view.aovs_requested)?;
        Some(StochasticSimplification { white, max_contribution: codes / 255.0 })
    }
}

impl Prepared for PreparedRain<'_> {
    fn metadata(&self) -> Vec<MetadataEntry> {
        self.metadata.clone()
    }

    fn bounds(&self, slice: &DepthInterval) -> Rect {
        if self.textured.is_none() && rounded_depth(slice.near) >= rounded_depth(slice.far) {
            return Rect::default();
        }
        Rect::from_size(self.view.size[0], self.view.size[1])
    }

    fn draw(&self, slice: &DepthInterval, strip: &mut Strip) {
        let rect = strip.rect;
        if let Some(textured) = &self.textured {
            textured.draw(slice, strip);
        }
        let slice = &DepthInterval { near: rounded_depth(slice.near), far: rounded_depth(slice.far) };
        if slice.near >= slice.far {
            return;
        }
        for tile_row in rect.y / TILE_ROWS..rect.bottom().div_ceil(TILE_ROWS) {
            let tile = tile_row * TILE_ROWS..(tile_row + 1) * TILE_ROWS;
            let rows = Rect { x: rect.x, y: tile.start, width: rect.width, height: TILE_ROWS }.intersection(&rect);
            if slice.near < self.streaks_end {
                dispatch!(self.level, simd => self.draw_streaks(simd, tile_row, slice, rows, strip));
            }
            if let Some(single_scattering) = &self.single_scattering {
                single_scattering.draw(slice, tile, rows, strip);
            }
        }
    }
}

/// The nearest of depths that are a twentieth apart, m. Where other phenomena cut the rain into many thin slices, it is drawn in those that contain such a
/// depth, all others being almost empty. Slices that meet still meet, and opaque surfaces hide rain by their exact depth.
fn rounded_depth(depth: f64) -> f64 {
    /// Logarithm of the ratio of successive depths.
    const STEP: f64 = 0.05;
    if depth > 0.0 && depth.is_finite() { math::exp((math::ln(depth) / STEP).round() * STEP) } else { depth }
}

impl PreparedRain<'_> {
    #[inline(always)]
    fn draw_streaks<S: Simd>(&self, simd: S, tile_row: usize, slice: &DepthInterval, rows: Rect, strip: &mut Strip) {
        let rect = strip.rect;
        let mut aovs = std::mem::take(&mut strip.aovs);
        // Only rain draws into its strip, and its transmittance is the same for all colors.
        if let Some(mut planes) = strip.gray_planes_mut() {
            let (mut buffer, mut streaks) = (TileBuffer::default(), Vec::new());
            for tile_column in rows.x / TILE_COLUMNS..rows.right().div_ceil(TILE_COLUMNS) {
                let origin = [tile_column * TILE_COLUMNS, tile_row * TILE_ROWS];
                let tile_rect = rows.intersection(&Rect { x: origin[0], width: TILE_COLUMNS, ..rows });
                streaks.clear();
                for chunk in &self.chunks {
                    chunk.collect_tile(tile_row, tile_column, slice, &mut streaks);
                }
                if streaks.is_empty() {
                    continue;
                }
                buffer.load(simd, origin, tile_rect, rect, &planes);
                for segment in streaks.iter().map(PackedStreak::unpack) {
                    if aovs.is_empty() {
                        segment.draw(&mut buffer, &mut |_, _| {});
                        continue;
                    }
                    segment.draw(&mut buffer, &mut |[column, row], opacity| {
                        let [x, y] = [origin[0] + column, origin[1] + row];
                        if (tile_rect.x..tile_rect.right()).contains(&x)
                            && (tile_rect.y..tile_rect.bottom()).contains(&y)
                        {
                            let index = (y - rect.y) * rect.width + x - rect.x;
                            write_aovs(&mut aovs, index, opacity, segment.shading.depth, segment.diameter_mm);
                        }
                    });
                }
                buffer.store(simd, tile_rect, rect, &mut planes);
            }
        }
        strip.aovs = aovs;
    }
}
