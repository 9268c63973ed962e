//! `bansho check --paper`, with the scenes of the papers.

use crate::support::Folder;

/// The lines that `bansho check --paper` prints of a scene in `scenes`, but for the first.
fn departures(scene: &str) -> Vec<String> {
    let path = format!("{}/../../scenes/{scene}", env!("CARGO_MANIFEST_DIR"));
    let run = Folder::new().succeed(&["check", "--paper", &path]);
    assert!(run.stdout.lines().next().is_some_and(|line| line.contains(": valid. ")), "{}", run.stdout);
    run.stdout.lines().skip(1).map(|line| line.trim().to_owned()).collect()
}

#[test]
fn literal_scenes_follow_their_papers() {
    let follows = |paper: &str| vec![format!("follows {paper} to the letter, as far as keys tell")];
    assert_eq!(departures("papers/ohshima_itahashi/ohshima_picture_5.toml"), follows("Ohshima & Itahashi"));
    assert_eq!(departures("papers/inagaki/inagaki_figure_8.toml"), follows("Inagaki et al."));
    let rain = departures("papers/yoshida_dobashi_yamamoto/yoshida_figure_7a.toml");
    assert_eq!(rain, follows("Yoshida, Dobashi & Yamamoto"));
    // (2.14) as printed moves all particles.
    let aurora = departures("papers/sekiguchi/sekiguchi_paper_1.toml");
    assert_eq!(
        aurora,
        ["Sekiguchi, eq. (2.14): aurora.0.particles.repulsion_force = \"as_printed\", here \"both_densities\""]
    );
}

#[test]
fn departures_of_other_scenes_are_listed() {
    let rain = departures("papers/yoshida_dobashi_yamamoto/driving_in_rain.toml");
    let expected = [
        "section 5.1: rain.0.method = \"textures\", here \"billboards\"",
        "section 6: rain.0.distance = 5, here 12.0",
        "1/30 s, as in section 4: camera.shutter_s = 0.0333, here none",
    ];
    for line in expected {
        assert!(rain.contains(&format!("Yoshida, Dobashi & Yamamoto, {line}")), "{line}: {rain:#?}");
    }
}

#[test]
fn departures_of_lists_and_of_the_implied_sky_are_listed() {
    let folder = Folder::with_scene(
        "bansho = 2\n[picture]\nsize = [64, 36]\n[[aurora]]\n[[aurora.shapes]]\n[[aurora.shapes]]\ntransition_frames = 140\n\
         [[aurora.shapes]]\ntransition_s = 2.0\n",
    );
    let lines = folder.succeed(&["check", "--paper", "scene.toml"]).stdout;
    for line in [
        "Sekiguchi, eq. (2.27): aurora.0.rendering.attenuation_per_km = a number above 0, here 0.0",
        "Sekiguchi, table 3.2: picture.size = [1280, 720], here [64, 36]",
        "Sekiguchi, nothing but the aurora: sky.kind = \"uniform\" or \"overcast\" or none, here \"night\"",
        "Sekiguchi, table 3.2: aurora.0.shapes.2.transition_s = none, here 2.0",
    ] {
        assert!(lines.contains(&format!("  {line}\n")), "{line}\n{lines}");
    }
    assert!(!lines.contains("shapes.1"), "{lines}");
}
