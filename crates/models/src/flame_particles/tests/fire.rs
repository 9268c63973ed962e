//! What fires do: they are as high as Heskestad says, puff as Cetegen and Ahmed say, narrow upward, and lean with the wind.

use bansho_base::{animation::Animated, curve::Interpolation, math};

use super::*;
use crate::flame_particles::{heskestad, parameters::BurnerParameters};

fn fire(heat_release_kw: f64, diameter: f64) -> FlameParticlesParameters {
    FlameParticlesParameters {
        burners: vec![BurnerParameters { heat_release_kw, diameter, ..Default::default() }],
        particles: 2500,
        ..Default::default()
    }
}

/// Height below which all but a fiftieth of the visible gas lies, m.
fn top(simulation: &Simulation) -> f64 {
    let mut heights: Vec<f32> = lit(simulation).iter().map(|index| place(simulation, *index).y).collect();
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
            let inside = |index: &usize| t > 0.0 && band.contains(&place(simulation, *index).y);
            let indices: Vec<usize> = lit(simulation).into_iter().filter(inside).collect();
            let middle =
                indices.iter().map(|index| place(simulation, *index)).sum::<Vec3>() / indices.len().max(1) as f32;
            for index in indices {
                let away = place(simulation, index) - middle;
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
            let places = lit(simulation).into_iter().map(|index| place(simulation, index));
            for place in places.filter(|place| t > 0.0 && place.y > 0.4) {
                (sum, count) = (sum + place.x, count + 1.0);
            }
        });
        sum / count
    };
    let [left, little, calm, right] = [-3.0, -1.0, 0.0, 3.0].map(lean);
    assert!(left < little - 0.05 && little < calm - 0.03 && right > calm + 0.08, "{left} {little} {calm} {right}");
}

#[test]
fn gas_is_born_where_a_moving_burner_is_and_stays_behind_it() {
    let across = vec![(0.0, [-1.0, 0.0, 0.0]), (0.5, [-1.0, 0.0, 0.0]), (1.0, [1.0, 0.0, 0.0])];
    let mut moved = fire(60.0, 0.3);
    moved.burners[0].position = Animated::keyed(across, Interpolation::Linear).unwrap();
    let mut simulation = simulation(&moved);
    let mut births = 0;
    World::default().run(&mut simulation, 1.0, |simulation, t| {
        let burner = (4.0 * t - 3.0).clamp(-1.0, 1.0) as f32;
        let particles = &simulation.particles;
        let newborn = (0..particles.len()).filter(|index| particles.age[*index] <= 2.01 * simulation.step_s() as f32);
        for index in newborn {
            births += 1;
            let aside = (place(simulation, index).x - burner).abs();
            assert!(aside < 0.3, "born {aside} m from the middle at {t}");
        }
    });
    assert!(births > 1000);
    let behind = lit(&simulation).iter().map(|index| place(&simulation, *index).x).fold(f32::INFINITY, f32::min);
    assert!(behind < 0.5, "what it left burns on where it was left: {behind}");
    let [low, high] = simulation.design.domain;
    assert!(low.x < -2.0 && high.x > 2.0, "there is room at both ends of its way");
}
