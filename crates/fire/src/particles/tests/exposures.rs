//! The states from which a long exposure is drawn.

use bansho_base::phenomenon::{Stepped, Stepping, strip::Shutter};

use super::*;
use crate::particles::{FlameParticles, FlameParticlesRun};

fn flame() -> FlameParticlesRun {
    let parameters = FlameParticlesParameters { particles: 900, ..Default::default() };
    let flame = FlameParticles::new(parameters, "flame", 1, None, &MemoryAssets::default()).unwrap();
    FlameParticlesRun::new(Arc::new(flame))
}

/// Steps a flame to where an exposure is drawn, announced or not.
fn step_to(flame: &mut FlameParticlesRun, shutter: Shutter, announced: bool) {
    if announced {
        flame.begin_exposure(shutter);
    }
    let preroll = flame.simulation.constants().preroll;
    let stepping = Stepping { step: flame.simulation.step_s(), preroll, crossfade: 0.0 };
    let (wind, air) = (Wind::new(WindParameters::default(), 1, None), Air::default());
    let surroundings = Surroundings { air: &air, ..Surroundings::from_wind(&wind) };
    let taken = ((flame.time + preroll) / stepping.step).round() as u64;
    for step in taken..stepping.steps_until(flame.time_for(shutter)) {
        flame.step(stepping.time_after(step), &surroundings);
    }
}

#[test]
fn a_long_exposure_has_a_state_for_every_step_and_each_part_of_it_once() {
    let mut flame = flame();
    let first = -flame.simulation.constants().preroll + 0.3;
    let shutter = |open: f64, duration: f64| Shutter { open, close: open + duration };
    // One after another, overlapping ones too.
    for shutter in [shutter(first, 0.2), shutter(first + 0.043, 0.2), shutter(first + 0.3, 0.05)] {
        step_to(&mut flame, shutter, true);
        assert!(flame.keeps_states_for(shutter));
        let states = flame.states(shutter);
        let steps = shutter.duration() / flame.simulation.step_s();
        assert!((states.len() as f64 - steps).abs() < 2.0, "{} states for {steps} steps", states.len());
        assert_eq!((states[0].shutter.open, states[states.len() - 1].shutter.close), (shutter.open, shutter.close));
        for (state, next) in states.iter().zip(&states[1..]) {
            assert_eq!(state.shutter.close, next.shutter.open);
        }
        for state in &states {
            let since = state.shutter.open - state.gas.time;
            assert!((-1e-9..flame.simulation.step_s()).contains(&since), "{since} s after its state");
        }
    }
    let instant = shutter(flame.time, flame.simulation.step_s());
    assert_eq!((flame.states(instant).len(), flame.time_for(instant)), (1, instant.middle()));
}

#[test]
fn a_restored_flame_has_the_states_of_its_exposure_and_one_that_lacks_them_says_so() {
    let mut original = flame();
    let open = -original.simulation.constants().preroll + 0.3;
    let shutter = Shutter { open, close: open + 0.1 };
    step_to(&mut original, shutter, true);
    let mut restored = flame();
    restored.restore(&original.snapshot()).unwrap();
    let seen = |flame: &FlameParticlesRun| -> Vec<(f64, Vec<f32>)> {
        flame.states(shutter).iter().map(|state| (state.gas.time, state.gas.particles.position[1].clone())).collect()
    };
    assert!(restored.keeps_states_for(shutter) && seen(&original).len() > 10);
    assert_eq!(seen(&original), seen(&restored));
    let truncated = original.snapshot();
    assert!(flame().restore(&truncated[..truncated.len() - 1]).is_err());
    let mut unannounced = flame();
    step_to(&mut unannounced, shutter, false);
    assert!(!unannounced.keeps_states_for(shutter), "it must start again");
}
