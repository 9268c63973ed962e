//! A shot that continues with another scene, and what is rebuilt for it.

use std::sync::Arc;

use bansho::{Assets, CompiledScene, MemoryAssets, Plan, PlanOptions, Shot, Unobserved, parse_scene};

fn build(text: &str, assets: &Arc<dyn Assets>, previous: Option<&CompiledScene>) -> Arc<CompiledScene> {
    let scene = Arc::new(parse_scene("scene", text).unwrap());
    Arc::new(CompiledScene::build(scene, assets.clone(), previous).unwrap())
}

fn plan(compiled: &Arc<CompiledScene>) -> Arc<Plan> {
    Arc::new(Plan::new(compiled, &PlanOptions::default()).unwrap())
}

#[test]
fn only_what_changed_is_built_anew() {
    let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
    let text = "bansho = 2\n[wind]\n[sky]\n[[flame_sheet]]\n[[flame_sheet]]\nname = \"second\"\nheight = 1.0\n";
    let addresses = |compiled: &CompiledScene| -> Vec<usize> {
        compiled.phenomena().map(|phenomenon| Arc::as_ptr(phenomenon).cast::<()>().addr()).collect()
    };
    let first = build(text, &assets, None);
    let windy = build(&text.replace("[wind]", "[wind]\nvelocity = [1, 0, 0]"), &assets, Some(&first));
    assert_eq!(addresses(&windy), addresses(&first), "wind is not theirs");
    let taller = build(&text.replace("height = 1.0", "height = 2.0"), &assets, Some(&windy));
    let ([a, b, c], [d, e, f]) =
        (addresses(&first)[..].try_into().unwrap(), addresses(&taller)[..].try_into().unwrap());
    assert_eq!([a, c], [d, f]);
    assert_ne!(b, e);
    let alone = "bansho = 2\n[sky]\n[[flame_sheet]]\nname = \"second\"\nheight = 2.0\n";
    let alone = build(alone, &assets, Some(&taller));
    assert_eq!(addresses(&alone), [e, f]);
    let elsewhere: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
    let other = build(text, &elsewhere, Some(&first));
    assert_ne!(addresses(&other), addresses(&first), "other assets may hold other files");
}

#[test]
fn gas_burns_on_when_its_flame_is_changed_also_where_it_would_burn_in_longer() {
    let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
    let text = "bansho = 2\n[[flame_particles]]\nparticles = 60\n[[flame_particles.burners]]\nheight = 0.8\n";
    let short = build(text, &assets, None);
    let mut shot = Shot::open(short.clone(), plan(&short));
    shot.advance(3, &Unobserved).unwrap();
    let gas = shot.particles();
    let tall = build(&text.replace("0.8", "1.2"), &assets, Some(&short));
    let preroll =
        |compiled: &CompiledScene| compiled.phenomena().next().unwrap().info().stepping.unwrap().preroll_steps();
    assert!(preroll(&tall) > preroll(&short));
    shot.replan(tall.clone(), plan(&tall));
    assert_eq!(shot.particles(), gas);
    assert!(!shot.is_exact() && shot.particles().positions.len() > 30);
    // Where steps are of another length its state is of no use.
    let finer = build(&text.replace("particles = 60", "particles = 60\nstep_s = 0.01"), &assets, Some(&tall));
    shot.replan(finer.clone(), plan(&finer));
    assert!(shot.is_exact() && shot.particles().positions.is_empty());
}

/// The light of all pixels at frame `number`.
fn light(shot: &mut Shot, number: i64) -> Vec<f32> {
    let frame = bansho::draw(shot, number, &Unobserved).unwrap();
    frame.beauty.pixels().iter().flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

fn difference(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum()
}

#[test]
fn a_wind_that_is_edited_during_playback_does_not_jump_and_what_is_drawn_again_is_exact() {
    let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
    let text = "bansho = 2\n[picture]\nsize = [48, 64]\nfps = 60\n[wind]\nvelocity = [0.5, 0, 0]\ngust = 0.8\n[[flame_sheet]]\n";
    let before = build(text, &assets, None);
    let after = build(&text.replace("0.5", "0.6"), &assets, Some(&before));
    let mut shot = Shot::open(before.clone(), plan(&before));
    let played = [3600, 3601].map(|number| light(&mut shot, number));
    shot.replan(after.clone(), plan(&after));
    let next = light(&mut shot, 3602);
    assert!(!shot.is_exact());
    let usual = difference(&played[0], &played[1]);
    let edited = difference(&played[1], &next);
    assert!(edited < 1.5 * usual, "{edited} after {usual}");
    // The scene itself has had another wind for a minute, which has carried other gusts there.
    let mut exact = Shot::open(after.clone(), plan(&after));
    let expected = light(&mut exact, 3602);
    assert!(difference(&expected, &next) > 1.5 * usual);
    assert_eq!(light(&mut shot, 3602), expected, "a frame that is drawn again is that of a render");
}
