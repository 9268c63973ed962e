//! Rendering: brightness, position, and agreement of all rendering methods.

mod agreement;
mod threads;

use std::sync::Arc;

use bansho_base::{
    camera::{CameraParameters, Lens},
    color,
    host::{assets::MemoryAssets, observer::Unobserved},
    math::{
        self, DVec2, DVec3,
        curve::{Curve, Interpolation},
        random::Key,
    },
    parameters::animated::Animated,
    phenomenon::{
        Phenomenon,
        strip::{Shutter, View},
    },
};

use super::{
    BlurParameters, RenderingParameters, Sampling, TrackModel,
    prepared::{ChartBuilder, PreparedAurora},
};
use crate::{
    Aurora, AuroraParameters, AuroraRun, ParticleParameters, SpectrumShape,
    physics::{
        atmosphere::{LEVELS, atmosphere, level_altitude_km},
        emission::{EMITTERS, Emission, LineSet, PHOTONS_PER_KILORAYLEIGH, PerEmitter, SpectralEmitter},
        extinction::AttenuationByDistance,
        precipitation::energy_grid::ARC,
    },
    render::{
        aovs::{brightnesses, measured_lines},
        bin::{
            EmitterWeights, SourceBuilder, Sources, nearest_node,
            source_bins::{FieldLineSource, REACH, SortedSources},
        },
        integrate::{column_buffer::ColumnBuffer, emission_profile::EmissionProfiles},
        project::{
            chart::{BLOCK_COLUMNS, Chart, Coverage, PixelBatch},
            field_lines::{EARTH_RADIUS_KM, FieldLines},
        },
        single_collisions::{
            blur::BlurredImage, collision_block::COLLISION_BLOCK_COLUMNS, collision_pass::CollisionRenderer,
        },
    },
    shapes::{ShapeParameters, SheetParameters},
    simulate::afterglow::AfterglowCell,
};

const ENERGY_EV: f64 = 5000.0;
const STEP: f64 = 0.01;
const GREEN: EmitterWeights = [1.0, 0.0, 0.0];
const RED: EmitterWeights = [0.0, 1.0, 0.0];
/// All altitudes of red light on the soft chart.
const SOFT: EmitterWeights = [1.0; 3];
const PROMPT: EmitterWeights = [0.0, 0.0, 1.0];
const PROMPT_AND_GREEN: EmitterWeights = [1.0, 0.0, 1.0];

fn emission() -> Emission {
    Emission::new(atmosphere(), ARC)
}

fn view(lens: Lens, target: [f64; 3], size: [usize; 2]) -> View {
    let camera = CameraParameters {
        lens,
        position: [0.0; 3].into(),
        target: target.into(),
        vertical_fov_deg: 60.0.into(),
        ..CameraParameters::default()
    };
    View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, size, 0)
}

fn field(dip_deg: f64) -> FieldLines {
    FieldLines::new(dip_deg, 0.0, DVec3::ZERO)
}

fn sources(
    cells: &[AfterglowCell<1>],
    shares: EmitterWeights,
    spread_km: f64,
    field: &FieldLines,
) -> Vec<FieldLineSource> {
    SourceBuilder {
        field,
        reach: spread_km as f32 * REACH,
        weight: 1.0,
        instant: 0,
        attenuation: AttenuationByDistance::default(),
    }
    .cells(cells, [shares])
}

/// Minimum standard deviation of sources, km.
fn spread_of(sources: &[FieldLineSource]) -> f64 {
    f64::from(sources.iter().fold(f32::INFINITY, |least, source| least.min(source.reach)) / REACH)
}

fn draw(
    sources: &[FieldLineSource],
    view: &View,
    field: &FieldLines,
    profiles: &EmissionProfiles,
    step: f64,
) -> ColumnBuffer {
    let chart = Chart::new(&Coverage::of_view(view, field), step, step);
    let sorted_sources = SortedSources::new(sources, &chart, BLOCK_COLUMNS, field, spread_of(sources));
    ColumnBuffer::zeros(chart).integrate(field, profiles, &sorted_sources)
}

/// Cells of one mW/m^2 over a wide square.
fn slab() -> Vec<AfterglowCell<1>> {
    const SIDE: i32 = 200;
    const KM: f32 = 5.0;
    let place = |index: i32| (index as f32 - 0.5 * SIDE as f32) * KM;
    let cell = |index: i32| AfterglowCell {
        cell_index: index as u32,
        position_km: [place(index % SIDE), place(index / SIDE)],
        powers_w: [1e3 * KM * KM],
        energy_ev: ENERGY_EV as f32,
    };
    (0..SIDE * SIDE).map(cell).collect()
}

/// A waving arc to the north.
fn arc(count: usize) -> Vec<AfterglowCell<1>> {
    let cell = |index: usize| {
        let share = index as f64 / count as f64;
        let south = -150.0 + 25.0 * math::sin(9.0 * share) + 3.0 * math::sin(index as f64 * 1.7);
        let energy_ev = (ENERGY_EV * (1.0 + 0.2 * math::sin(30.0 * share))) as f32;
        let position_km = [(share * 300.0 - 150.0) as f32, south as f32];
        AfterglowCell { cell_index: index as u32, position_km, powers_w: [1e5], energy_ev }
    };
    (0..count).map(cell).collect()
}

fn colatitude_and_longitude(field: &FieldLines, direction: DVec3) -> [f32; 2] {
    let [along, x, y] = field.field_frame_components(direction);
    [math::atan2(math::hypot(x, y), along) as f32, math::atan2(y, x) as f32]
}

#[test]
fn an_even_sheet_overhead_shows_its_column() {
    let (emission, view) = (emission(), view(Lens::Fisheye, [0.0, 1.0, 0.0], [64, 64]));
    let profiles = EmissionProfiles::new(&emission, &AttenuationByDistance::default());
    for (shares, emitters) in [(GREEN, 0..1), (RED, 1..2), (PROMPT, 2..4)] {
        for dip_deg in [90.0, 77.0, -60.0] {
            let field = field(dip_deg);
            let picture = draw(&sources(&slab(), shares, 5.0, &field), &view, &field, &profiles, STEP);
            let column = emission.column(ENERGY_EV).kilorayleigh;
            for slant_deg in [0.0, 8.0, 30.0, 50.0] {
                let (sin, cos) = math::sin_cos(f64::to_radians(slant_deg));
                // Oblique lines of sight are longer, less so over a round Earth: van Rhijn for 120 or 250 km.
                let altitude = if shares == RED { 250.0 } else { 120.0 };
                let share = EARTH_RADIUS_KM / (EARTH_RADIUS_KM + altitude) * sin;
                let longer = 1.0 / math::sqrt(1.0 - share * share);
                let [colatitude, longitude] = colatitude_and_longitude(&field, DVec3::new(sin * 0.8, cos, -sin * 0.6));
                let light = picture.sampler().light(longitude, colatitude);
                for emitter in emitters.clone() {
                    let ratio = f64::from(light[emitter]) / (column[emitter] * longer);
                    assert!((ratio - 1.0).abs() < 0.02, "{emitter} dip {dip_deg} slant {slant_deg}: {ratio}");
                }
            }
        }
    }
}

/// An observer above the center of the drawn square, and a dome that looks up or down.
fn at_altitude(altitude_km: f64, dip_deg: f64, looks_up: bool) -> (View, FieldLines) {
    let position = [0.0, 1e3 * altitude_km, 0.0];
    let target = [0.0, if looks_up { 2e6 * altitude_km } else { 0.0 }, 0.0];
    let camera = CameraParameters {
        lens: Lens::Fisheye,
        position: position.into(),
        target: target.into(),
        ..CameraParameters::default()
    };
    let view = View::new(camera, Shutter { open: 0.0, close: 0.0 }, 0.0, [128, 128], 0);
    (view, FieldLines::new(dip_deg, 0.0, DVec3::from(position)))
}

#[test]
fn an_even_sheet_shows_an_observer_within_or_above_it_the_column_in_front() {
    let emission = emission();
    let profiles = EmissionProfiles::new(&emission, &AttenuationByDistance::default());
    let profile = emission.profile(ENERGY_EV);
    let whole: f64 = profile.iter().map(|light| light[0]).sum();
    let kilorayleigh_per_level = emission.column(ENERGY_EV).kilorayleigh[0] / whole;
    let positions =
        [130.0, 150.0, 250.0, 400.0, 500.0].into_iter().flat_map(|altitude| [(altitude, false), (altitude, true)]);
    for ((altitude_km, looks_up), dip_deg) in
        positions.flat_map(|position| [90.0, 77.0, -60.0].map(|dip| (position, dip)))
    {
        let (view, field) = at_altitude(altitude_km, dip_deg, looks_up);
        let picture = draw(&sources(&slab(), PROMPT_AND_GREEN, 5.0, &field), &view, &field, &profiles, STEP);
        let up = if looks_up { 1.0 } else { -1.0 };
        for slant_deg in [0.0, 8.0, 30.0] {
            let (sin, cos) = math::sin_cos(f64::to_radians(slant_deg));
            // The integral along the line of sight, which begins at the observer, by levels of 1 km over a round Earth.
            let path = |level: usize| {
                let share = (EARTH_RADIUS_KM + altitude_km) / (EARTH_RADIUS_KM + level_altitude_km(level)) * sin;
                1.0 / math::sqrt(1.0 - share * share)
            };
            // A level stands for half a kilometer on both sides.
            let in_front = |level: usize| ((level_altitude_km(level) - altitude_km) * up + 0.5).clamp(0.0, 1.0);
            let light_of = |level: usize| {
                profile[level][0] * in_front(level) * if in_front(level) > 0.0 { path(level) } else { 0.0 }
            };
            let expected = (0..LEVELS).map(light_of).sum::<f64>() * kilorayleigh_per_level;
            let [colatitude, longitude] = colatitude_and_longitude(&field, DVec3::new(sin * 0.8, up * cos, -sin * 0.6));
            let found = f64::from(picture.sampler().light(longitude, colatitude)[0]);
            assert!(
                (found - expected).abs() <= 0.05 * expected + 3e-4 * kilorayleigh_per_level * whole,
                "{altitude_km} km, dip {dip_deg}, {slant_deg} degrees from {}: {found} instead of {expected} kR",
                if looks_up { "zenith" } else { "nadir" }
            );
        }
    }
}

#[test]
fn the_earth_hides_what_is_behind_its_limb() {
    let profiles = EmissionProfiles::new(&emission(), &AttenuationByDistance::default());
    let (view, field) = at_altitude(150.0, 90.0, false);
    let light_of = |south_km: f32| -> f32 {
        let cell =
            AfterglowCell { cell_index: 0, position_km: [0.0, south_km], powers_w: [1e9], energy_ev: ENERGY_EV as f32 };
        let picture = draw(&sources(&[cell], GREEN, 5.0, &field), &view, &field, &profiles, 0.002);
        picture.light.iter().map(|light| light[0]).sum()
    };
    // A point at the altitude z is hidden beyond acos(R / (R + h)) + acos(R / (R + z)): one at 110 km beyond 2467 km along the ground, one at
    // 400 km, which is above nearly all green light, beyond 3560 km.
    let (seen, tops, hidden) = (light_of(2200.0), light_of(2750.0), light_of(3700.0));
    assert!(seen > 0.0 && tops > 0.0 && tops < 0.2 * seen && hidden < 1e-3 * seen, "{seen} {tops} {hidden}");
}

#[test]
fn a_ray_is_seen_where_every_lens_puts_it() {
    let profiles = EmissionProfiles::new(&emission(), &AttenuationByDistance::default());
    let field = field(77.0);
    let cell =
        AfterglowCell { cell_index: 0, position_km: [40.0, -90.0], powers_w: [1e6], energy_ev: ENERGY_EV as f32 };
    let sources = sources(&[cell], PROMPT, 0.4, &field);
    let [x, y] = sources[0].across.map(f64::from);
    let line = field.meridian([x, y].map(|value| value / math::hypot(x, y))).line(math::hypot(x, y));
    let targets = [
        (Lens::Perspective, [20.0, 60.0, -40.0]),
        (Lens::Fisheye, [0.0, 1.0, 0.0]),
        (Lens::Panorama, [0.0, 0.0, -1.0]),
    ];
    for (lens, target) in targets {
        let view = view(lens, target, [640, 480]);
        let views = [view.clone(), view.mirrored(0.0)];
        let mut shown = 0;
        for view in views {
            let picture = draw(&sources, &view, &field, &profiles, 1.0 / view.camera.focal_pixels);
            for altitude_km in [108.0, 120.0, 150.0] {
                let along = field.along * line.position_at_altitude(altitude_km);
                let point = field.across[0] * x + field.across[1] * y + along;
                let Some(seen) = view.camera.project(point * 1e3) else { continue };
                shown += 1;
                let light = |offset: DVec2| {
                    let pixel = seen.pixel + offset;
                    let batch = PixelBatch::new(&view.camera, &field, pixel.x as usize, pixel.y as usize);
                    picture.sampler().light(batch.longitude[0], batch.colatitude[0])[2]
                };
                // Across the ray on the picture.
                let further = view.camera.project((point + field.along * 5.0) * 1e3).unwrap().pixel - seen.pixel;
                let across = DVec2::new(-further.y, further.x).normalize() * 6.0;
                let beside = light(across).max(light(-across));
                assert!(
                    light(DVec2::ZERO) > 4.0 * beside.max(1e-6),
                    "{lens:?} {altitude_km}: {} {beside}",
                    light(DVec2::ZERO)
                );
            }
        }
        // Three altitudes; the mirror image of all but the panorama looks down.
        assert_eq!(shown, if lens == Lens::Panorama { 6 } else { 3 }, "{lens:?}");
    }
}

fn difference(a: &[PerEmitter<f32>], b: &[PerEmitter<f32>]) -> f64 {
    let sum = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>();
    let apart = sum(&mut a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| f64::from((a - b).abs())));
    apart / sum(&mut b.as_flattened().iter().map(|value| f64::from(*value)))
}

/// A run of an aurora with these parameters, at its initial state.
fn run(parameters: AuroraParameters) -> AuroraRun {
    AuroraRun::new(Arc::new(Aurora::new(parameters, "aurora", 1, None, &MemoryAssets::default()).unwrap()))
}

#[test]
fn every_measured_line_is_there_and_named_by_its_wavelength() {
    let lines = measured_lines().map(|line| line.wavelength_nm.floor().to_string());
    let names = lines.chain(["first_positive".to_owned()]).map(|line| format!("kilorayleigh_{line}"));
    let parameters = AuroraParameters {
        particles: ParticleParameters { count: 100, ..ParticleParameters::default() },
        ..AuroraParameters::default()
    };
    let aurora = Aurora::new(parameters, "aurora", 1, None, &MemoryAssets::default()).unwrap();
    let measured: Vec<_> =
        aurora.info().aovs.iter().map(|aov| aov.name).filter(|name| name.starts_with("kilo")).collect();
    assert_eq!(names.collect::<Vec<_>>(), measured);
    assert_eq!(measured.len(), brightnesses(LineSet::Observed).count());
    let [green, red, fainter_red, _, _, band, all_bands] = brightnesses(LineSet::Observed).collect::<Vec<_>>()[..]
    else {
        panic!()
    };
    assert_eq!(
        (green, red, fainter_red.0),
        ((SpectralEmitter::OxygenGreen, 1.0), (SpectralEmitter::OxygenRed, 1.0), red.0)
    );
    assert!((fainter_red.1 * 2.997 - 1.0).abs() < 1e-12, "{fainter_red:?}");
    assert_eq!((all_bands, band.0), ((SpectralEmitter::Nitrogen, 1.0), SpectralEmitter::Nitrogen));
}

#[test]
fn auto_exposure_knows_the_flux_and_energy_of_sheets() {
    let luminance = |flux: f64, energy: f64| {
        let even = |value: f64| Curve::new(vec![[0.0, value]], Interpolation::Linear).unwrap();
        let sheet =
            SheetParameters { flux_factor: even(flux), energy_factor: even(energy), ..SheetParameters::default() };
        let parameters = AuroraParameters {
            particles: ParticleParameters { count: 100, ..ParticleParameters::default() },
            shapes: vec![ShapeParameters { sheets: vec![sheet], ..ShapeParameters::default() }],
            ..AuroraParameters::default()
        };
        Aurora::new(parameters, "aurora", 1, None, &MemoryAssets::default()).unwrap().luminance()
    };
    let plain = luminance(1.0, 1.0);
    assert!((luminance(8.0, 1.0) / plain - 8.0).abs() < 1e-9);
    let emission = emission();
    let column = |energy_ev| f64::from(color::luminance(emission.column_color(energy_ev).map(|value| value as f32)));
    assert!((luminance(1.0, 0.2) / plain / (column(1000.0) / column(5000.0)) - 1.0).abs() < 1e-6);
}

/// Standard deviation in pixels, from left to right, of the violet light of a lone field line to the north where it is
/// 110 km high, blurred in the picture.
fn blurred_width(north_km: f32, radii: &BlurParameters) -> f64 {
    let (profiles, view, field) = (
        EmissionProfiles::new(&emission(), &AttenuationByDistance::default()),
        view(Lens::Perspective, [0.0, 40.0, -60.0], [320, 240]),
        field(77.0),
    );
    let cell =
        AfterglowCell { cell_index: 0, position_km: [0.0, -north_km], powers_w: [1e6], energy_ev: ENERGY_EV as f32 };
    let sources = sources(&[cell], PROMPT, 0.01, &field);
    let pixel = 1.0 / view.camera.focal_pixels;
    let picture = draw(&sources, &view, &field, &profiles, pixel);
    let dark = ColumnBuffer::zeros(Chart::new(&Coverage::of_view(&view, &field), 16.0 * pixel, 4.0 * pixel));
    let blurred = BlurredImage::new(&view, &field, &[picture.sampler(), dark.sampler()], radii);
    let row: Vec<f64> = (0..240)
        .map(|y| (0..320).step_by(16).flat_map(|x| blurred.batch(x, y)).map(|light| f64::from(light[2])).collect())
        .max_by(|a: &Vec<f64>, b: &Vec<f64>| a.iter().sum::<f64>().total_cmp(&b.iter().sum()))
        .unwrap_or_default();
    let places = || row.iter().zip(0..).map(|(light, x)| (light, f64::from(x)));
    let whole: f64 = row.iter().sum();
    let middle = places().map(|(light, x)| light * x).sum::<f64>() / whole;
    math::sqrt(places().map(|(light, x)| light * (x - middle) * (x - middle)).sum::<f64>() / whole)
}

#[test]
fn the_blur_of_the_thesis_is_as_wide_near_and_far() {
    let radii = BlurParameters { violet_px: 2.5, ..BlurParameters::default() };
    for north_km in [60.0, 120.0, 250.0] {
        let width = blurred_width(north_km, &radii);
        println!("{north_km} km");
        bansho_base::assert_measured!("equation (2.28): width, pixels", width, 2.5, 0.25);
    }
}

/// A straight, uniform arc from west to east at a distance to the north.
fn even_arc(north_km: f64, energy_ev: f32) -> Vec<AfterglowCell<1>> {
    let place = |index: i32| [(4.0 * f64::from(index)) as f32, -north_km as f32];
    let cell = |index: i32| AfterglowCell {
        cell_index: (index + 100) as u32,
        position_km: place(index),
        powers_w: [1e6],
        energy_ev,
    };
    (-100..=100).map(cell).collect()
}

#[test]
fn far_and_near_arcs_are_smooth_up_and_down() {
    let (field, view) = (field(77.0), view(Lens::Perspective, [0.0, 24.0, -60.0], [1280, 720]));
    for (energy_ev, spectrum, lower_edge) in
        [(350.0, SpectrumShape::Maxwellian, 0.02), (5000.0, SpectrumShape::Gaussian, 0.08)]
    {
        let parameters = AuroraParameters {
            energy_ev: Animated::from(energy_ev),
            spectrum,
            particles: ParticleParameters { count: 100, ..ParticleParameters::default() },
            ..AuroraParameters::default()
        };
        let run = run(parameters);
        for north_km in [100.0, 250.0, 640.0, 1100.0] {
            let cells = even_arc(north_km, energy_ev as f32);
            let spread_km = [6.0, 15.0];
            let of = |shares, spread_km| sources(&cells, shares, spread_km, &field);
            let sharp = [of(GREEN, 6.0), of(PROMPT, 6.0)].concat();
            let sources = Sources { sharp, soft: of(SOFT, 15.0), spread_km, ..Sources::default() };
            let charts =
                ChartBuilder { inputs: run.render_inputs(), field: &field, coverage: Coverage::of_view(&view, &field) };
            let charts = [charts.sharp(&sources), charts.soft(&sources)];
            let column: Vec<PerEmitter<f32>> = (0..600)
                .map(|row| {
                    let PixelBatch { longitude, colatitude, .. } = PixelBatch::new(&view.camera, &field, 640, row);
                    let [sharp, soft] =
                        [0, 1].map(|chart: usize| charts[chart].sampler().light(longitude[0], colatitude[0]));
                    std::array::from_fn(|i| sharp[i] + soft[i])
                })
                .collect();
            for emitter in EMITTERS {
                let light = |row: usize| column[row][emitter.index()];
                let most = (0..600).map(light).fold(0.0, f32::max);
                let bend = |row: usize| (light(row - 1) + light(row + 1) - 2.0 * light(row)).abs() / most;
                let worst = (1..599).max_by(|a, b| bend(*a).total_cmp(&bend(*b))).unwrap();
                // Lower edges are a few pixels high in the distance; red light has none.
                let bound = if emitter == SpectralEmitter::OxygenRed { 0.01 } else { lower_edge };
                assert!(
                    bend(worst) < bound,
                    "{energy_ev} eV, {north_km} km, {emitter:?}, row {worst}: {}",
                    bend(worst)
                );
            }
        }
    }
}

#[test]
fn a_frame_leaves_its_memory_to_the_next_without_light() {
    let view = view(Lens::Perspective, [0.0, 24.0, -60.0], [160, 90]);
    let run = run(AuroraParameters::default());
    let inputs = run.render_inputs();
    let field = inputs.field_lines(view.camera.position);
    let coverage = Coverage::of_view(&view, &field);
    let chart = || Chart::new(&coverage, coverage.pixel, coverage.pixel);
    let memory = inputs.chart_memory;
    let mut first = memory.zeros(chart());
    let address = first.light.as_ptr();
    memory.recycle(&mut first);
    for _ in 0..2 {
        drop(PreparedAurora::new(inputs, &view, &Unobserved).unwrap());
        let mut left = memory.zeros(chart());
        assert_eq!(left.light.as_ptr(), address, "the frame used it");
        assert!(left.light.iter().flatten().all(|value| *value == 0.0));
        memory.recycle(&mut left);
    }
}

#[test]
fn few_particles_are_as_smooth_and_as_bright_as_many() {
    let (profiles, view, field) = (
        EmissionProfiles::new(&emission(), &AttenuationByDistance::default()),
        view(Lens::Perspective, [0.0, 60.0, -110.0], [160, 90]),
        field(77.0),
    );
    let picture = |count: usize| {
        let mut cells = arc(count);
        cells.iter_mut().for_each(|cell| cell.powers_w[0] *= 16_000.0 / count as f32);
        draw(&sources(&cells, GREEN, 1.5, &field), &view, &field, &profiles, STEP).light
    };
    let apart = difference(&picture(2000), &picture(16_000));
    assert!(apart < 0.1, "{apart}");
}

/// Half the thickness of a thin sheet, km, and the spread of its sources.
const THIN_KM: f64 = 1.5;
const THIN_SPREAD_KM: f64 = 0.35;
/// Distance of its sources, km.
const THIN_CELL_KM: f64 = 0.15;

/// Positions of its sources across a thin sheet, km.
fn across_thin() -> impl Iterator<Item = f64> {
    let count = (THIN_KM / THIN_CELL_KM) as i32;
    (-count..=count).map(|index| THIN_CELL_KM * f64::from(index))
}

/// An even, thin sheet of 1 mW/m^2 from west to east through the magnetic zenith, straight up.
fn thin_sheet() -> Vec<AfterglowCell<1>> {
    let power_w = (1e3 * THIN_CELL_KM * THIN_CELL_KM) as f32;
    let cell = |east: f64, south: f64| AfterglowCell {
        cell_index: (east as f32).to_bits().rotate_left(16) ^ (south as f32).to_bits(),
        position_km: [east as f32, south as f32],
        powers_w: [power_w],
        energy_ev: ENERGY_EV as f32,
    };
    (-300..=300)
        .flat_map(|index| across_thin().map(move |south| cell(THIN_CELL_KM * f64::from(index), south)))
        .collect()
}

/// Brightness of an emitter along a line of sight, kR: the integral over the path.
fn thin_light(emission: &Emission, emitter: usize, [colatitude, longitude]: [f64; 2]) -> f64 {
    const STEP_KM: f64 = 0.25;
    let reach = THIN_SPREAD_KM * f64::from(REACH);
    let flux = |south: f64| -> f64 {
        let patch = |place: f64| {
            let away = (south - place) / reach;
            let shape = (1.0 - away * away).max(0.0);
            15.0 / 16.0 / reach * shape * shape * THIN_CELL_KM
        };
        across_thin().map(patch).sum()
    };
    let (sin, cos) = math::sin_cos(colatitude);
    (320..1600)
        .map(|step| {
            let way = STEP_KM * (f64::from(step) + 0.5);
            let light = emission.at(ENERGY_EV, way * cos)[emitter] * 1e3 / PHOTONS_PER_KILORAYLEIGH;
            flux(way * sin * math::sin(longitude)) * light * STEP_KM
        })
        .sum()
}

#[test]
fn a_thin_sheet_is_as_bright_about_the_magnetic_zenith_as_its_light_comes_to() {
    let (emission, field, view) = (emission(), field(90.0), view(Lens::Perspective, [0.0, 1.0, 1e-3], [320, 320]));
    let profiles = EmissionProfiles::new(&emission, &AttenuationByDistance::default());
    for (shares, emitter) in [(GREEN, 0), (PROMPT, 2)] {
        let sources = sources(&thin_sheet(), shares, THIN_SPREAD_KM, &field);
        // Rows of a pixel of an ordinary picture.
        let picture = draw(&sources, &view, &field, &profiles, 1.67e-3);
        let brightest = thin_light(&emission, emitter, [4e-3, 0.0]);
        for longitude_deg in [0.0, 15.0, 45.0, 90.0] {
            for quarter in 1..=16 {
                let place = [0.25 * f64::from(quarter), longitude_deg].map(f64::to_radians);
                let expected = thin_light(&emission, emitter, place);
                let found = f64::from(picture.sampler().light(place[1] as f32, place[0] as f32)[emitter]);
                // On its sides, where it is dim, it is a little wider.
                let bound = (0.1 * expected).max(0.025 * brightest);
                assert!(
                    (found - expected).abs() < bound,
                    "{emitter} {longitude_deg} {quarter}: {found} for {expected}"
                );
            }
        }
    }
}
