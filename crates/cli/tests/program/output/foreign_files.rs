//! Files and links that stand where a command would write, under names that the user does not choose.
#![cfg(unix)]

use std::{fs, os::unix::fs::symlink};

use crate::support::{FLAME, Folder, Run};

const FARM_FILES: [&str; 8] =
    ["plan.json", "token", "jobs", "submit.sh", "check.sbatch", "snapshots.sbatch", "frames.sbatch", "finish.sbatch"];

/// Runs a command that must fail with one error that says `reason`, and leave all as it is.
fn refused(folder: &Folder, arguments: &[&str], reason: &str) -> Run {
    let before = folder.files("");
    let run = folder.run(arguments);
    assert!(run.code == Some(1) || run.code == Some(2), "{arguments:?}: {}", run.stderr);
    assert_eq!(run.errors(), 1, "{arguments:?}: {}", run.stderr);
    assert!(run.stderr.contains(reason), "{arguments:?}: {}", run.stderr);
    assert!(folder.files("") == before, "{arguments:?}: files have changed");
    run
}

#[test]
fn the_farm_replaces_neither_links_nor_files_of_others() {
    let folder = Folder::with_scene(FLAME);
    fs::create_dir_all(folder.path("out/a.farm")).unwrap();
    let plan = ["farm", "slurm", "scene.toml", "--threads", "1", "-o", "out/a.####.png"];
    for file in FARM_FILES {
        let path = folder.path(&format!("out/a.farm/{file}"));
        for target in ["../../scene.toml", "../../gone"] {
            symlink(target, &path).unwrap();
            for more in [&[][..], &["--overwrite"]] {
                refused(&folder, &[&plan, more].concat(), "is a link; allowed: no file, or one that Bansho made");
            }
            fs::remove_file(&path).unwrap();
        }
        fs::write(&path, "somebody's own work").unwrap();
        refused(&folder, &plan, "already exists and was not made by Bansho");
        fs::remove_file(&path).unwrap();
    }
    folder.succeed(&plan);
    // The plan that was just written may be replaced.
    folder.succeed(&plan);
    fs::write(folder.path("out/a.farm/token"), "somebody's own work").unwrap();
    folder.succeed(&[&plan[..], &["--overwrite"]].concat());
}

#[test]
fn a_plan_that_was_edited_is_not_obeyed() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["farm", "slurm", "scene.toml", "--threads", "1", "-o", "out/a.####.png"]);
    let plan = folder.path("out/a.farm/plan.json");
    let text = fs::read_to_string(&plan).unwrap();
    let edited = text.replace("--out=out/a.####.png", "--out=elsewhere/a.####.png");
    assert_ne!(edited, text);
    fs::write(&plan, edited).unwrap();
    refused(
        &folder,
        &["farm", "status", "scene.toml", "-o", "out/a.####.png"],
        "the plan of tasks was changed after it was written",
    );
}

#[test]
fn templates_and_tokens_of_templates_replace_nothing_else() {
    let folder = Folder::with_scene(FLAME);
    let template = ["farm", "openjd", "scene.toml", "-o", "shot.yaml"];
    symlink("scene.toml", folder.path("shot.yaml")).unwrap();
    refused(&folder, &template, "shot.yaml: is a file that the scene is read from");
    fs::remove_file(folder.path("shot.yaml")).unwrap();
    folder.write("shot.yaml", "specificationVersion: jobtemplate-2023-09\n");
    refused(&folder, &template, "shot.yaml: already exists and was not made by Bansho");
    fs::remove_file(folder.path("shot.yaml")).unwrap();
    folder.succeed(&template);
    folder.succeed(&template);
    let text = fs::read_to_string(folder.path("shot.yaml")).unwrap();
    let value = |name: &str| {
        let rest = text.split(&format!("--{name}=")).nth(1).unwrap();
        format!("--{name}={}", rest.split('"').next().unwrap())
    };
    let options = ["token", "made-by", "arithmetic"].map(value);
    let mut check = vec!["farm", "check", "-o", "out/a.####.png", "--leave-token"];
    check.extend(options.iter().map(String::as_str));
    fs::create_dir_all(folder.path("out/a.farm")).unwrap();
    symlink("../../scene.toml", folder.path("out/a.farm/template")).unwrap();
    refused(&folder, &check, "out/a.farm/template: is a link");
    fs::remove_file(folder.path("out/a.farm/template")).unwrap();
    folder.succeed(&check);
    folder.succeed(&check);
}

#[test]
fn manual_pages_replace_only_manual_pages() {
    let folder = Folder::with_scene(FLAME);
    let man = ["man", "pages"];
    folder.succeed(&man);
    folder.succeed(&man);
    assert!(folder.path("pages/bansho.1").exists() && folder.path("pages/bansho-farm-slurm.1").exists());
    for make in [
        (|folder: &Folder| fs::write(folder.path("pages/bansho-render.1"), ".TH OTHER 1\n").unwrap()) as fn(&Folder),
        |folder| symlink("../scene.toml", folder.path("pages/bansho-render.1")).unwrap(),
    ] {
        fs::remove_file(folder.path("pages/bansho-render.1")).unwrap();
        make(&folder);
        refused(&folder, &man, "pages/bansho-render.1: already exists and was not made by Bansho");
    }
}

#[test]
fn scenes_of_any_name_are_drawn_without_further_options() {
    for stem in ["a#b", "50%", "sh#t", "take####", "my scene", "s#1", "100%d"] {
        let folder = Folder::new();
        let made = folder.succeed(&["new", stem]);
        let name = format!("{stem}.toml");
        assert!(made.stdout.contains(&format!("bansho render '{name}'")), "{}", made.stdout);
        folder.write(&name, FLAME);
        let render = |more: &[&str]| folder.succeed(&[&["render", &name, "--frames", "0-1"], more].concat());
        assert_eq!(render(&[]).stderr.matches("warning").count(), 0);
        render(&["--contact-sheet", "2"]);
        folder.succeed(&["flipbook", &name, "--grid", "1x2", "--size", "16x16"]);
        let names = folder.names();
        for file in ["0000.png", "0001.png", "sheet.png"] {
            let expected = format!("out/{stem}/{stem}.{file}");
            assert!(names.contains(&expected), "{expected}: {names:?}");
        }
        assert!(names.contains(&format!("out/{stem}/{stem}_color.png")), "{names:?}");
    }
}

#[test]
fn what_only_looks_like_a_frame_number_is_told() {
    let folder = Folder::with_scene(FLAME);
    let run = folder.succeed(&["render", "scene.toml", "--frames", "1", "-o", "shot#12.png"]);
    assert!(
        run.stderr.contains("warning: shot#12.png: a single # before a digit is part of the name"),
        "{}",
        run.stderr
    );
    let run = folder.succeed(&["render", "scene.toml", "--frames", "1", "-o", "take####/a.png"]);
    assert!(run.stderr.contains("placeholders in the folder `take####` are taken literally"), "{}", run.stderr);
    assert_eq!(folder.names(), ["scene.toml", "shot#12.png", "take####/a.png"]);
}

#[test]
fn journals_cannot_forge_lines_of_a_status() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["farm", "slurm", "scene.toml", "--threads", "1", "--chunk", "2", "-o", "out/a.####.png"]);
    fs::remove_file(folder.path("out/a.0003.png")).unwrap_or_default();
    let token = fs::read_to_string(folder.path("out/a.farm/token")).unwrap();
    let token = token.lines().last().unwrap();
    let forged = "n\\u001b[2J\\nlast job: done\\u202e\\u009b";
    folder.write(
        "out/a.farm/journal/task-1.0.jsonl",
        &format!(
            "{{\"event\":\"start\",\"node\":\"{forged}\",\"token\":\"{token}\",\"frames\":2,\"kept\":0,\"threads\":1}}\n\
             {{\"event\":\"end\",\"code\":1,\"message\":\"{forged}\",\"seconds\":1.0,\"cpu_seconds\":1.0}}\n"
        ),
    );
    for more in [&[][..], &["--json"]] {
        let run = folder.run(&[&["farm", "status", "scene.toml", "-o", "out/a.####.png"], more].concat());
        assert_eq!(run.code, Some(1), "{}", run.stderr);
        let is_plain = |letter: char| letter == '\n' || !letter.is_control() && letter != '\u{202e}';
        assert!(run.stdout.chars().all(is_plain), "{:?}", run.stdout);
        assert!(!run.stdout.lines().any(|line| line == "last job: done"), "{}", run.stdout);
        assert!(run.stdout.contains("last job: done"), "it is shown, escaped: {}", run.stdout);
    }
}

#[test]
fn a_picture_of_another_program_is_a_frame_that_is_not_whole() {
    let folder = Folder::with_scene(FLAME);
    folder.succeed(&["farm", "slurm", "scene.toml", "--threads", "1", "--chunk", "2", "-o", "out/a.####.png"]);
    folder.write("out/a.0005.png", "a photograph");
    let run = folder.run(&["farm", "status", "scene.toml", "-o", "out/a.####.png"]);
    assert_eq!((run.code, run.errors()), (Some(1), 0), "{}", run.stderr);
    assert!(run.stdout.starts_with("frames: ") && run.stdout.contains("1 damaged"), "{}", run.stdout);
}

#[test]
fn a_file_larger_than_allowed_is_an_error_and_leaves_nothing() {
    let folder = Folder::with_scene(&FLAME.replace("48, 64", "400, 400"));
    for output in ["a.png", "a.exr", "a.apng", "a.gif"] {
        let line =
            format!("ulimit -f 8; exec {} render scene.toml --frames 0 --out {output}", env!("CARGO_BIN_EXE_bansho"));
        let mut shell = std::process::Command::new("bash");
        let run = Run::of(shell.args(["-c", &line]).current_dir(folder.path("")).output().unwrap());
        assert_eq!((run.code, run.errors()), (Some(1), 1), "{output}: {}", run.stderr);
        assert!(run.stderr.contains("the file would be larger than this process may write"), "{}", run.stderr);
        assert_eq!(folder.names(), ["scene.toml"], "{output}");
    }
}
