//! Templates of new scenes: one phenomenon, and what it needs to be visible.

/// A template of a new scene.
#[derive(Clone, Copy, Debug)]
pub struct NewScene {
    /// Its name in the menu.
    pub name: &'static str,
    /// The text of the scene.
    pub text: &'static str,
}

/// All templates, in the order of the menu.
pub const NEW_SCENES: [NewScene; 5] = [
    NewScene { name: "Flame sheet", text: FLAME_SHEET },
    NewScene { name: "Particle flame", text: PARTICLE_FLAME },
    NewScene { name: "Rain", text: RAIN },
    NewScene { name: "Aurora", text: AURORA },
    NewScene { name: "Nothing", text: "bansho = 2\n" },
];

/// The template for a studio started without a scene.
pub const FLAME_SHEET: &str = "\
bansho = 2

[[flame_sheet]]
name = \"fire\"
";

const PARTICLE_FLAME: &str = "\
bansho = 2

[[flame_particles]]
name = \"flame\"
";

/// Rain under a street lamp at dusk.
const RAIN: &str = "\
bansho = 2

[picture]
exposure_ev100 = 1.6

[camera]
position = [0.5, 1.5, 5.4]
target = [0.2, 1.8, 0.0]

[sky]
luminance = 0.06
hills_deg = 1.5
trees_deg = 4.5
temperature_k = 9000.0

[[light]]
kind = \"spot\"
visible = true
position = [0.0, 2.9, 0.0]
direction = [0.0, -1.0, 0.0]
color = [1.0, 0.82, 0.55]
intensity = 2500.0
inner_cone_deg = 40.0
outer_cone_deg = 78.0

[[rain]]
name = \"rain\"
rate_mm_per_h = 20.0
distance = 6.0
";

/// A view to the north, where the default shapes are.
const AURORA: &str = "\
bansho = 2

[picture]
exposure_ev100 = -7.3
white_balance_k = 4000.0

[camera]
position = [0.0, 1.7, 0.0]
target = [0.0, 32.0, -57.0]
vertical_fov_deg = 62.0

[sky]
kind = \"night\"
hills_deg = 6.0
hills_form = \"mountains\"
night = { sun_elevation_deg = -14.5, sun_azimuth_deg = 180.0, airglow = 0.3, stars = 0.6, milky_way = 0.5 }

[[aurora]]
name = \"aurora\"
rendering = { color_matching = \"camera\" }
";

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bansho::{
        Assets, CompiledScene, MemoryAssets, Plan, PlanOptions, SceneOptions, Shot, Unobserved, base::color,
        parse_scene,
    };

    use super::*;

    #[test]
    fn every_template_but_the_empty_one_shows_something() {
        for NewScene { name, text } in NEW_SCENES {
            let assets: Arc<dyn Assets> = Arc::new(MemoryAssets::default());
            let quick = text.replace("[[aurora]]", "[[aurora]]\nparticles = { count = 2000 }");
            let scene = Arc::new(parse_scene(name, &quick).unwrap().with_options(&SceneOptions::default()).unwrap());
            let compiled = Arc::new(CompiledScene::build(scene, assets, None).unwrap());
            let plan = Plan::new(&compiled, &PlanOptions { size: Some([96, 54]), ..PlanOptions::default() }).unwrap();
            let mut shot = Shot::open(compiled, Arc::new(plan));
            let frame = bansho::draw(&mut shot, 3, &Unobserved).unwrap();
            let brightest = frame.beauty.pixels().iter().map(|[r, g, b, _]| color::luminance([*r, *g, *b]));
            let brightest = brightest.fold(0.0, f32::max);
            assert_eq!(brightest > 0.3, name != "Nothing", "{name}: {brightest}");
        }
    }
}
