//! What the drawing must get right: brightness, place, and the same for every way of drawing.

use bansho_base::{
    camera::{CameraParameters, Lens},
    canvas::{Shutter, View},
    math::{self, DVec2, DVec3},
    random::Key,
};

use super::{
    chart::{Chart, Coverage},
    collisions::Collisions,
    footprint::{Footprint, REACH, Source},
    geometry::{EARTH_RADIUS_KM, FieldLines},
    meridians::Meridians,
    prepared::Batch,
    profile::Profiles,
    sources::{Kind, Maker, nearest_node},
};
use crate::aurora::{
    afterglow::GlowCell,
    atmosphere::atmosphere,
    light::{Emission, PerEmitter},
    precipitation::spectrum::ARC,
};

const ENERGY_EV: f64 = 5000.0;
const STEP: f64 = 0.01;

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

fn sources(cells: &[GlowCell], kind: Kind, spread_km: f64, field: &FieldLines) -> Vec<Source> {
    Maker { field, kind, reach: spread_km as f32 * REACH, share: 1.0 }.cells(cells)
}

fn draw(sources: &[Source], view: &View, field: &FieldLines, profiles: &Profiles, step: f64) -> Meridians {
    let chart = Chart::new(&Coverage::of_view(view, field), step, step);
    let footprint = Footprint::new(sources, &chart, step);
    Meridians::new(chart, field, profiles, &footprint)
}

/// Cells of one mW/m^2 over a wide square.
fn slab() -> Vec<GlowCell> {
    const SIDE: i32 = 200;
    const KM: f32 = 5.0;
    let place = |index: i32| (index as f32 - 0.5 * SIDE as f32) * KM;
    let cell = |index: i32| GlowCell {
        position_km: [place(index % SIDE), place(index / SIDE)],
        power_w: 1e3 * KM * KM,
        energy_ev: ENERGY_EV as f32,
    };
    (0..SIDE * SIDE).map(cell).collect()
}

/// A waving arc to the north.
fn arc(count: usize) -> Vec<GlowCell> {
    let cell = |index: usize| {
        let share = index as f64 / count as f64;
        let south = -150.0 + 25.0 * math::sin(9.0 * share) + 3.0 * math::sin(index as f64 * 1.7);
        let energy_ev = (ENERGY_EV * (1.0 + 0.2 * math::sin(30.0 * share))) as f32;
        GlowCell { position_km: [(share * 300.0 - 150.0) as f32, south as f32], power_w: 1e5, energy_ev }
    };
    (0..count).map(cell).collect()
}

fn colatitude_and_longitude(field: &FieldLines, direction: DVec3) -> [f32; 2] {
    let [along, x, y] = field.turned(direction);
    [math::atan2(math::hypot(x, y), along) as f32, math::atan2(y, x) as f32]
}

#[test]
fn an_even_sheet_overhead_shows_its_column() {
    let (emission, view) = (emission(), view(Lens::Fisheye, [0.0, 1.0, 0.0], [64, 64]));
    let profiles = Profiles::new(&emission);
    for (kind, emitters) in [(Kind::Green, 0..1), (Kind::Red, 1..2), (Kind::Prompt, 2..4)] {
        for dip_deg in [90.0, 77.0, -60.0] {
            let field = field(dip_deg);
            let picture = draw(&sources(&slab(), kind, 5.0, &field), &view, &field, &profiles, STEP);
            let column = emission.column(ENERGY_EV).kilorayleigh;
            for slant_deg in [0.0, 8.0, 30.0, 50.0] {
                let (sin, cos) = math::sin_cos(f64::to_radians(slant_deg));
                // Longer the way that is slanted, less so over a round Earth: van Rhijn for 120 or 250 km.
                let altitude = if matches!(kind, Kind::Red) { 250.0 } else { 120.0 };
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

#[test]
fn a_ray_is_seen_where_every_lens_puts_it() {
    let profiles = Profiles::new(&emission());
    let field = field(77.0);
    let cell = GlowCell { position_km: [40.0, -90.0], power_w: 1e6, energy_ev: ENERGY_EV as f32 };
    let sources = sources(&[cell], Kind::Prompt, 0.4, &field);
    let [x, y] = sources[0].across.map(f64::from);
    let line = field.meridian([x, y].map(|value| value / math::hypot(x, y))).line(math::hypot(x, y));
    let mut shown = 0;
    let targets = [
        (Lens::Perspective, [20.0, 60.0, -40.0]),
        (Lens::Fisheye, [0.0, 1.0, 0.0]),
        (Lens::Panorama, [0.0, 0.0, -1.0]),
    ];
    for (lens, target) in targets {
        let view = view(lens, target, [640, 480]);
        let views = [view.clone(), view.mirrored(0.0)];
        for view in views {
            let picture = draw(&sources, &view, &field, &profiles, 1.0 / view.camera.focal_pixels);
            for altitude_km in [108.0, 120.0, 150.0] {
                let along = field.along * line.place(altitude_km);
                let point = field.across[0] * x + field.across[1] * y + along;
                let Some(seen) = view.camera.project(point * 1e3) else { continue };
                shown += 1;
                let light = |offset: DVec2| {
                    let pixel = seen.pixel + offset;
                    let batch = Batch::new(&view.camera, &field, pixel.x as usize, pixel.y as usize);
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
    }
    // Three heights by each lens and its mirror image, but for the dome's, which looks down, and the perspective one's.
    assert!(shown >= 9, "{shown}");
}

fn difference(a: &[PerEmitter<f32>], b: &[PerEmitter<f32>]) -> f64 {
    let sum = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>();
    let apart = sum(&mut a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| f64::from((a - b).abs())));
    apart / sum(&mut b.as_flattened().iter().map(|value| f64::from(*value)))
}

#[test]
fn the_mean_of_many_collision_pictures_is_the_profile() {
    let emission = emission();
    let (profiles, view, field) =
        (Profiles::new(&emission), view(Lens::Perspective, [0.0, 60.0, -110.0], [160, 90]), field(77.0));
    let sources = sources(&arc(8000), Kind::Prompt, 1.5, &field);
    // Low rows, since single points are spread over two of them.
    let chart = || Chart::new(&Coverage::of_view(&view, &field), STEP, 0.5 * STEP);
    let footprint = Footprint::new(&sources, &chart(), 0.5 * STEP);
    let expected = Meridians::new(chart(), &field, &profiles, &footprint);
    let collisions = Collisions::new(&emission, 0.002, nearest_node(6.0 * ENERGY_EV), Key::new(5, "aurora"));
    let mut mean = vec![[0.0; 4]; expected.light.len()];
    for step in 0..64 {
        let picture = collisions.draw(chart(), &field, &footprint, step);
        for (sum, light) in mean.iter_mut().zip(&picture.light) {
            *sum = std::array::from_fn(|i| light[i].mul_add(1.0 / 64.0, sum[i]));
        }
    }
    let apart = difference(&mean, &expected.light);
    assert!(apart < 0.03, "{apart}");
}

#[test]
fn pictures_do_not_depend_on_the_number_of_threads() {
    let (profiles, view, field) =
        (Profiles::new(&emission()), view(Lens::Fisheye, [0.0, 1.0, 0.0], [200, 200]), field(77.0));
    let sources = sources(&arc(3000), Kind::Green, 0.5, &field);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| draw(&sources, &view, &field, &profiles, STEP).light)
    };
    assert!(with(1) == with(5));
}

#[test]
fn few_particles_are_as_smooth_and_as_bright_as_many() {
    let (profiles, view, field) =
        (Profiles::new(&emission()), view(Lens::Perspective, [0.0, 60.0, -110.0], [160, 90]), field(77.0));
    let picture = |count: usize| {
        let mut cells = arc(count);
        cells.iter_mut().for_each(|cell| cell.power_w *= 16_000.0 / count as f32);
        draw(&sources(&cells, Kind::Green, 1.5, &field), &view, &field, &profiles, STEP).light
    };
    let apart = difference(&picture(2000), &picture(16_000));
    assert!(apart < 0.1, "{apart}");
}
