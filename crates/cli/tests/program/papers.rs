//! The pages of the papers: `bansho check --paper` with their scenes, and the commands of their tables.

use std::{collections::BTreeSet, fs};

use crate::support::{Folder, Run};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// The lines that `bansho check --paper` prints of a scene in `scenes`, but for the first.
fn departures(scene: &str) -> Vec<String> {
    let path = format!("{ROOT}/scenes/{scene}");
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

/// The commands `bansho SUBCOMMAND ...` in the tables under the heading `Everything numbered`, without the program's name.
fn commands(subcommand: &str) -> BTreeSet<String> {
    let pages = fs::read_dir(format!("{ROOT}/docs/src/papers")).unwrap();
    let of_page = |page: String| -> Vec<String> {
        let (_, tables) = page.split_once("## Everything numbered").unwrap();
        let code =
            tables.lines().filter(|line| line.starts_with('|')).flat_map(|line| line.split('`').skip(1).step_by(2));
        code.filter_map(|code| code.strip_prefix("bansho ")).map(str::to_owned).collect()
    };
    let commands = pages.flat_map(|page| of_page(fs::read_to_string(page.unwrap().path()).unwrap()));
    let commands: BTreeSet<String> = commands.filter(|command| command.split(' ').next() == Some(subcommand)).collect();
    assert!(!commands.is_empty(), "{subcommand}");
    commands
}

/// Runs a command of a page with further arguments. Scenes are those of the repository.
fn succeed(folder: &Folder, command: &str, further: &[&str]) -> Run {
    let arguments: Vec<String> =
        command.split(' ').map(|word| word.replace("scenes/", &format!("{ROOT}/scenes/"))).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).chain(further.iter().copied()).collect();
    folder.succeed(&arguments)
}

#[test]
fn figures_and_textures_of_the_papers_are_drawn_by_the_commands_of_their_tables() {
    let mut written = 0;
    for command in commands("plot").into_iter().chain(commands("streaks")) {
        let folder = Folder::new();
        // Few frames, and not a large picture.
        let small: &[&str] =
            if command.starts_with("plot flame-statistics") { &["--frames", "2", "--height", "32"] } else { &[] };
        succeed(&folder, &command, small);
        assert!(!folder.names().is_empty(), "`bansho {command}` wrote nothing");
        written += 1;
    }
    assert!(written >= 8, "{written}");
}

/// The first frame of each, drawn small; the commands draw up to 561 frames.
#[test]
fn frames_of_the_papers_are_drawn_by_the_commands_of_their_tables() {
    let mut with_statistics = 0;
    for command in commands("render") {
        let folder = Folder::new();
        let mut words: Vec<&str> = command.split(' ').collect();
        if let Some(frames) = words.iter().position(|word| *word == "--frames") {
            words.drain(frames..frames + 2);
        }
        let small = ["--frames", "0-0", "--size", "64x36", "--set", "aurora.particles.count=1000"];
        let run = succeed(&folder, &words.join(" "), &small);
        assert_eq!(folder.names().iter().filter(|name| name.ends_with(".png")).count(), 1, "{:?}", folder.names());
        // Processor time is what the rows of figures 3.9 to 3.13 state.
        if words.contains(&"--stats") {
            with_statistics += 1;
            assert!(run.stderr.contains("draw") && run.stderr.contains("threads"), "{}", run.stderr);
        }
    }
    assert_eq!(with_statistics, 5, "scenes 1 to 5");
}
