//! What fires do: they are as high as Heskestad says, puff as Cetegen and Ahmed say, narrow upward, and lean with the wind.

use bansho_base::{math, math::curve::Interpolation, parameters::animated::Animated};

use super::*;
use crate::particles::{heskestad, parameters::BurnerParameters, render::GasRenderingParameters};

fn fire(heat_release_kw: f64, diameter: f64) -> FlameParticlesParameters {
    FlameParticlesParameters {
        burners: vec![BurnerParameters { heat_release_kw, diameter, ..Default::default() }],
        particles: 2500,
        ..Default::default()
    }
}

/// Height below which all but a fiftieth of the visible gas lies, m.
fn top(simulation: &Simulation) -> f64 {
    let mut heights: Vec<f32> = lit(simulation).iter().map(|index| position(simulation, *index).y).collect();
    heights.sort_by(f32::total_cmp);
    heights.get(heights.len() * 98 / 100).copied().unwrap_or(0.0).into()
}

/// The frequency in Hz, between a third and three times `around`, at which `values`, `seconds` apart, swing most.
fn strongest_frequency(values: &[f64], seconds: f64, around: f64) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let power = |hz: f64| {
        let [mut real, mut imaginary] = [0.0; 2];
        for (index, value) in values.iter().enumerate() {
            let (sine, cosine) = math::sin_cos(std::f64::consts::TAU * hz * seconds * index as f64);
            real += (value - mean) * cosine;
            imaginary += (value - mean) * sine;
        }
        real * real + imaginary * imaginary
    };
    let candidates = (0..200).map(|step| around / 3.0 * math::pow(9.0, f64::from(step) / 199.0));
    candidates.max_by(|a, b| power(*a).total_cmp(&power(*b))).unwrap()
}

#[test]
fn fires_are_as_high_and_puff_as_often_as_measured_ones() {
    for (heat_release_kw, diameter) in [(60.0, 0.3), (6.0, 0.1), (1500.0, 1.2)] {
        let expected = heskestad(heat_release_kw, diameter);
        assert!(expected > diameter);
        let hz = 1.5 / diameter.sqrt();
        let mut simulation = simulation(&fire(heat_release_kw, diameter));
        let (mut tops, mut shining) = (Vec::new(), Vec::new());
        World::default().run(&mut simulation, 8.0 / hz, |simulation, t| {
            if t > 0.0 {
                tops.push(top(simulation));
                shining.push(lit(simulation).len() as f64);
            }
        });
        let mean = tops.iter().sum::<f64>() / tops.len() as f64;
        assert!((0.67..1.33).contains(&(mean / expected)), "{mean} m high, expected {expected}");
        let found = strongest_frequency(&shining, simulation.step_s(), hz);
        assert!((0.67..1.33).contains(&(found / hz)), "puffs at {found} Hz, expected {hz}");
    }
}

#[test]
fn flames_narrow_upward_and_accelerate() {
    let mut simulation = simulation(&fire(60.0, 0.3));
    // Count, speed and squared distance from the middle in the lowest and the highest quarter.
    let mut sums = [[0.0_f32; 3]; 2];
    World::default().run(&mut simulation, 1.2, |simulation, t| {
        for (sum, band) in sums.iter_mut().zip([0.0..0.22, 0.68..9.0]) {
            let inside = |index: &usize| t > 0.0 && band.contains(&position(simulation, *index).y);
            let indices: Vec<usize> = lit(simulation).into_iter().filter(inside).collect();
            let middle =
                indices.iter().map(|index| position(simulation, *index)).sum::<Vec3>() / indices.len().max(1) as f32;
            for index in indices {
                let away = position(simulation, index) - middle;
                sum[0] += 1.0;
                sum[1] += simulation.particles.velocities()[1][index];
                sum[2] += away.x * away.x + away.z * away.z;
            }
        }
    });
    let [[low, low_speed, low_width], [high, high_speed, high_width]] = sums;
    assert!(high_speed / high > 1.5 * low_speed / low, "{} {}", low_speed / low, high_speed / high);
    let widths = [low_width / low, high_width / high].map(f32::sqrt);
    assert!(high < 0.5 * low && widths[1] < 0.95 * widths[0], "{low} {high} particles, {widths:?} m wide");
}

#[test]
fn wind_bends_the_flame_the_more_the_stronger_it_is() {
    let lean = |speed: f64| {
        let wind = WindParameters { velocity: Animated::from([speed, 0.0, 0.0]), ..WindParameters::default() };
        let (mut sum, mut count) = (0.0, 0.0);
        World { wind, ..World::default() }.run(&mut simulation(&fire(60.0, 0.3)), 1.0, |simulation, t| {
            let positions = lit(simulation).into_iter().map(|index| position(simulation, index));
            for position in positions.filter(|position| t > 0.0 && position.y > 0.4) {
                (sum, count) = (sum + position.x, count + 1.0);
            }
        });
        sum / count
    };
    let [left, little, calm, right] = [-3.0, -1.0, 0.0, 3.0].map(lean);
    assert!(left < little - 0.05 && little < calm - 0.03 && right > calm + 0.08, "{left} {little} {calm} {right}");
}

#[test]
fn gas_is_spawned_where_a_moving_burner_is_and_stays_behind_it() {
    let across = vec![(0.0, [-1.0, 0.0, 0.0]), (0.5, [-1.0, 0.0, 0.0]), (1.0, [1.0, 0.0, 0.0])];
    let mut moved = fire(60.0, 0.3);
    moved.burners[0].position = Animated::keyed(across, Interpolation::Linear).unwrap();
    let mut simulation = simulation(&moved);
    let mut spawned = 0;
    World::default().run(&mut simulation, 1.0, |simulation, t| {
        let burner = (4.0 * t - 3.0).clamp(-1.0, 1.0) as f32;
        let particles = &simulation.particles;
        let new = (0..particles.len()).filter(|index| particles.age[*index] <= 2.01 * simulation.step_s() as f32);
        for index in new {
            spawned += 1;
            let aside = (position(simulation, index).x - burner).abs();
            assert!(aside < 0.3, "spawned {aside} m from the middle at {t}");
        }
    });
    assert!(spawned > 1000);
    let behind = lit(&simulation).iter().map(|index| position(&simulation, *index).x).fold(f32::INFINITY, f32::min);
    assert!(behind < 0.5, "what it left burns on where it was left: {behind}");
    let [low, high] = simulation.constants().domain;
    assert!(low.x < -2.0 && high.x > 2.0, "there is room at both ends of its way");
}

#[test]
fn gas_stands_on_its_burner_after_a_step_of_any_length() {
    for step_s in [1.0 / 120.0, 1.0 / 30.0] {
        let mut simulation = simulation(&FlameParticlesParameters { step_s, ..fire(60.0, 0.3) });
        World::default().run_steps(&mut simulation, -20, 0, |_, _| {});
        let particles = &simulation.particles;
        let youngest = particles.age.iter().copied().fold(f32::INFINITY, f32::min);
        let lowest = (0..particles.len()).map(|index| position(&simulation, index).y).fold(f32::INFINITY, f32::min);
        let step = step_s as f32;
        assert!(youngest < 0.1 * step && lowest < 0.1 * step, "{youngest} s old, {lowest} m high, steps of {step} s");
    }
}

/// Light that gas of a kind sends, and that times its height.
fn light_by_height(simulation: &Simulation, of: impl Fn(&Gas, usize) -> f64) -> [f64; 2] {
    let buffers = BufferPool::default();
    let gas = gas(simulation, &buffers);
    let mut sums = [0.0; 2];
    for index in 0..gas.particles.len() {
        let light = of(&gas, index) * gas.volume(index);
        sums[0] += light;
        sums[1] += light * f64::from(position(simulation, index).y);
    }
    sums
}

#[test]
fn blue_light_stands_at_the_base_and_yellow_light_above_it() {
    let (parameters, rendering) = (fire(60.0, 0.3), GasRenderingParameters::default());
    let mut simulation = simulation(&parameters);
    let (mut blue, mut yellow, mut high) = ([0.0; 2], [0.0; 2], 0.0);
    World::default().run(&mut simulation, 1.0, |simulation, t| {
        if t > 0.0 {
            let blue_light = |gas: &Gas, index| gas.blue_luminance(index, &rendering);
            let add = |sum: &mut [f64; 2], more: [f64; 2]| (0..2).for_each(|i| sum[i] += more[i]);
            add(&mut blue, light_by_height(simulation, blue_light));
            add(
                &mut yellow,
                light_by_height(simulation, |gas, index| gas.absorption(index, &rendering) * gas.luminance(index)),
            );
            let above =
                |gas: &Gas, index| if position(simulation, index).y > 0.4 { blue_light(gas, index) } else { 0.0 };
            high += light_by_height(simulation, above)[0];
        }
    });
    let [blue_height, yellow_height] = [blue, yellow].map(|[light, moment]| moment / light);
    let height = heskestad(60.0, 0.3);
    assert!(
        blue_height < 0.15 * height && yellow_height > 0.25 * height,
        "{blue_height} {yellow_height} of {height} m"
    );
    assert!(high < 0.01 * blue[0], "{high} of {} shines blue high up", blue[0]);
    assert!(blue[0] < 0.2 * yellow[0], "the light of a sooty fire is yellow: {} {}", blue[0], yellow[0]);
}

#[test]
fn smoke_is_the_soot_that_leaves_the_flame_and_cools_above_it() {
    let smoke = |share: f64| {
        let mut parameters = fire(60.0, 0.3);
        parameters.combustion.smoke_fraction = share;
        parameters.combustion.burnt_gas_lifetime_s = 1.5;
        let mut simulation = simulation(&parameters);
        World::default().run(&mut simulation, 0.0, |_, _| {});
        let particles = &simulation.particles;
        let burnt: Vec<usize> = (0..particles.len()).filter(|index| particles.fuel[*index] == 0.0).collect();
        let mean = |of: &dyn Fn(usize) -> f32| burnt.iter().map(|index| of(*index)).sum::<f32>() / burnt.len() as f32;
        assert!(burnt.len() > 300, "{}", burnt.len());
        let old = |index: &usize| particles.age[*index] > 1.2;
        let coldest = burnt.iter().copied().filter(old).map(|index| particles.temperature[index]).fold(0.0, f32::max);
        (mean(&|index| particles.soot[index]), mean(&|index| position(&simulation, index).y), coldest)
    };
    let ((none, ..), (some, height, hottest)) = (smoke(0.0), smoke(0.3));
    assert_eq!(none, 0.0, "soot burns where none is to be left");
    assert!((some / (0.3 * 1.2e-6) - 1.0).abs() < 1e-3, "three tenths of 1.2 parts in a million: {some}");
    assert!(f64::from(height) > 0.8 * heskestad(60.0, 0.3), "smoke hangs at {height} m");
    assert!(hottest < 800.0, "old smoke does not glow: {hottest} K");
}

/// Gas that the eye sees as one: groups of lit particles closer than the support radius, as lists of their places.
fn bodies(simulation: &Simulation) -> Vec<Vec<Vec3>> {
    let reach = simulation.constants().support_radius;
    let mut left: Vec<Vec3> = lit(simulation).into_iter().map(|index| position(simulation, index)).collect();
    let mut bodies = Vec::new();
    while let Some(first) = left.pop() {
        let (mut body, mut edge) = (vec![first], vec![first]);
        while let Some(position) = edge.pop() {
            let (near, far): (Vec<Vec3>, Vec<Vec3>) = left.iter().partition(|other| other.distance(position) < reach);
            left = far;
            edge.extend(&near);
            body.extend(near);
        }
        bodies.push(body);
    }
    bodies
}

/// How wide a body of gas is in each tenth of a height: standard deviation across; none where hardly anything is.
fn widths(body: &[Vec3], height: f32) -> Vec<Option<f32>> {
    let width = |slab: usize| {
        let inside = |position: &&Vec3| (position.y / height * 10.0) as usize == slab;
        let positions: Vec<&Vec3> = body.iter().filter(inside).collect();
        let count = positions.len() as f32;
        let middle = positions.iter().copied().sum::<Vec3>() / count;
        let square = |position: &&Vec3| (**position - middle).with_y(0.0).length_squared();
        (positions.len() >= 8).then(|| (positions.iter().map(square).sum::<f32>() / count).sqrt())
    };
    (0..12).map(width).collect()
}

#[test]
fn flames_neck_and_shed_pockets_that_burn_out_above_them() {
    let mut simulation = simulation(&fire(60.0, 0.3));
    let height = heskestad(60.0, 0.3) as f32;
    let (mut frames, mut necked, mut shed, mut changes, mut had_pocket) = (0, 0, 0, 0, false);
    World::default().run(&mut simulation, 4.0, |simulation, t| {
        // Thirty pictures a second.
        if t <= 0.0 || (t * 120.0).round() as i64 % 4 != 0 {
            return;
        }
        let mut bodies = bodies(simulation);
        bodies.sort_by_key(|body| std::cmp::Reverse(body.len()));
        let lowest = |body: &[Vec3]| body.iter().map(|position| position.y).fold(f32::INFINITY, f32::min);
        let pocket = bodies[1..].iter().any(|body| body.len() >= 8 && lowest(body) > 0.4 * height);
        // A waist: gas above it is a quarter wider.
        let widths: Vec<f32> = widths(&bodies[0], height).into_iter().flatten().collect();
        let neck = (2..widths.len()).any(|above| widths[1..above].iter().any(|waist| widths[above] > 1.25 * waist));
        frames += 1;
        necked += i32::from(neck);
        shed += i32::from(pocket);
        changes += i32::from(pocket != had_pocket);
        had_pocket = pocket;
    });
    let share = |count: i32| f64::from(count) / f64::from(frames);
    // A steady cone does neither; a cloud of sparks always would.
    assert!((0.2..0.9).contains(&share(necked)), "necked in {} of the pictures", share(necked));
    assert!((0.15..0.85).contains(&share(shed)), "a pocket in {} of the pictures", share(shed));
    assert!(changes >= 15, "pockets come and go: {changes} changes in {frames} pictures");
}
