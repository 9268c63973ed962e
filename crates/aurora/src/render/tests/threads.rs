//! Pictures do not depend on the number of threads.

use super::*;

#[test]
fn pictures_do_not_depend_on_the_number_of_threads() {
    let (profiles, view, field) = (
        EmissionProfiles::new(&emission(), &AttenuationByDistance::default()),
        view(Lens::Fisheye, [0.0, 1.0, 0.0], [200, 200]),
        field(77.0),
    );
    let sources = sources(&arc(3000), GREEN, 0.5, &field);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| draw(&sources, &view, &field, &profiles, STEP).light)
    };
    let one = with(1);
    assert!(one.iter().flatten().any(|light| *light > 0.0) && one == with(5));
}

#[test]
fn single_collisions_do_not_depend_on_the_number_of_threads() {
    let (view, field) = (view(Lens::Perspective, [0.0, 60.0, -110.0], [320, 180]), field(77.0));
    let drawing = RenderingParameters::default();
    let collisions = CollisionRenderer::new(
        &emission(),
        &drawing,
        &AttenuationByDistance::default(),
        nearest_node(6.0 * ENERGY_EV),
        Key::new(5, "aurora"),
    );
    let sources = sources(&arc(3000), PROMPT_AND_GREEN, 0.5, &field);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let chart = Chart::new(&Coverage::of_view(&view, &field), 0.25 * STEP, 0.25 * STEP);
            let sorted_sources =
                SortedSources::new(&sources, &chart, COLLISION_BLOCK_COLUMNS, &field, spread_of(&sources));
            collisions.draw(ColumnBuffer::zeros(chart), &field, &sorted_sources, 3).light
        })
    };
    let one = with(1);
    assert!(one.iter().flatten().any(|light| *light > 0.0) && one == with(3));
}
