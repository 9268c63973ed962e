//! Tasks for a batch system, with a Slurm that is only imitated. `tests/farm` has the real one.

mod templates;

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    process::{Command, Stdio},
};

use serde_json::Value;

use crate::support::{FLAME, Folder, Run, wait_until};

/// Notes its arguments, and gives jobs ascending numbers.
const SBATCH: &str = "#!/bin/sh\necho \"$@\" >>\"$FAKE/sbatch.log\"\ncase \"$*\" in *--test-only*) exit 0;; esac\ngrep -c parsable \"$FAKE/sbatch.log\"\n";
/// Lists jobs, or with `%K` the tasks of arrays.
const SQUEUE: &str =
    "#!/bin/sh\ncase \"$*\" in *%K*) cat \"$FAKE/queue.tasks\";; *) cat \"$FAKE/queue\";; esac 2>/dev/null; exit 0\n";
const SCONTROL: &str = "#!/bin/sh\necho 'MaxArraySize            = 4'\n";
const SCANCEL: &str = "#!/bin/sh\necho \"$@\" >>\"$FAKE/scancel.log\"\n";
/// Runs the program on one machine.
const SRUN: &str = "#!/bin/sh\nshift\nexec \"$@\"\n";

/// A folder with a scene of six frames, and a Slurm that does nothing.
fn folder() -> Folder {
    let folder = Folder::with_scene(FLAME);
    for (name, text) in
        [("sbatch", SBATCH), ("squeue", SQUEUE), ("scontrol", SCONTROL), ("scancel", SCANCEL), ("srun", SRUN)]
    {
        program(&folder, name, text);
    }
    folder
}

fn program(folder: &Folder, name: &str, text: &str) {
    let name = format!("bin/{name}");
    folder.write(&name, text);
    fs::set_permissions(folder.path(&name), fs::Permissions::from_mode(0o755)).unwrap();
}

/// `command` with the imitated Slurm before all else on the path.
fn with_slurm<'a>(folder: &Folder, command: &'a mut Command) -> &'a mut Command {
    let path = format!("{}:{}", folder.path("bin").display(), std::env::var("PATH").unwrap_or_default());
    command.env("PATH", path).env("FAKE", folder.path(""))
}

/// `bansho farm slurm scene.toml --threads 1` with `arguments`.
fn plan(folder: &Folder, arguments: &[&str]) -> Run {
    let line = [&["farm", "slurm", "scene.toml", "--threads", "1"], arguments].concat();
    Run::of(with_slurm(folder, &mut folder.command(&line)).output().unwrap())
}

fn read(folder: &Folder, name: &str) -> String {
    fs::read_to_string(folder.path(name)).unwrap_or_default()
}

/// Runs a batch script, as Slurm would.
fn batch(folder: &Folder, script: &str, task: usize) -> Run {
    let mut shell = Command::new("sh");
    shell.arg(folder.path(&format!("out/scene/scene.farm/{script}"))).env("SLURM_ARRAY_TASK_ID", task.to_string());
    Run::of(with_slurm(folder, &mut shell).current_dir("/").stdin(Stdio::null()).output().unwrap())
}

/// `bansho farm status` on a machine without Slurm.
fn status(folder: &Folder) -> (Option<i32>, Value) {
    json_of(folder.command(&["farm", "status", "scene.toml", "--json"]).env("PATH", folder.path("empty")))
}

/// `bansho farm status` on a machine whose `squeue` lists `tasks`.
fn asked_status(folder: &Folder, tasks: &str) -> Value {
    folder.write("queue.tasks", tasks);
    json_of(with_slurm(folder, &mut folder.command(&["farm", "status", "scene.toml", "--json"]))).1
}

fn json_of(command: &mut Command) -> (Option<i32>, Value) {
    let run = Run::of(command.output().unwrap());
    let json = serde_json::from_str(&run.stdout);
    (run.code, json.unwrap_or_else(|error| panic!("{error}: {}{}", run.stdout, run.stderr)))
}

#[test]
fn an_array_draws_the_bytes_of_one_process_and_is_not_submitted_again() {
    let (folder, alone) = (folder(), Folder::with_scene(FLAME));
    let options = ["--chunk", "2", "--film", "film.apng", "--contact-sheet", "4", "--submit"];
    let planned = plan(&folder, &options);
    assert_eq!(planned.code, Some(0), "{}", planned.stderr);
    assert!(planned.stdout.contains("check 1\nframes 2\nfinish 3\n"), "{}", planned.stdout);
    let submitted = read(&folder, "sbatch.log");
    assert!(submitted.contains("--dependency=afterok:2 --kill-on-invalid-dep=yes finish.sbatch"), "{submitted}");
    let (code, before) = status(&folder);
    assert_eq!((code, &before["complete"], &before["finish"]["state"]), (Some(1), &false.into(), &"waiting".into()));
    assert_eq!(batch(&folder, "finish.sbatch", 0).code, Some(1), "frames are missing");
    assert_eq!(status(&folder).1["finish"]["state"], "failed");
    assert_eq!(batch(&folder, "check.sbatch", 0).code, Some(0));
    for task in 0..3 {
        let run = batch(&folder, "frames.sbatch", task);
        assert_eq!(run.code, Some(0), "{}", run.stderr);
    }
    let finish = batch(&folder, "finish.sbatch", 0);
    assert_eq!(finish.code, Some(0), "{}", finish.stderr);
    let (code, after) = status(&folder);
    assert_eq!((code, &after["complete"], &after["frames"]["whole"]), (Some(0), &true.into(), &6.into()));
    alone.succeed(&["render", "scene.toml"]);
    let frames = |folder: &Folder| -> Vec<_> {
        folder.files("out/scene").into_iter().filter(|(name, _)| name.starts_with("scene.0")).collect()
    };
    assert!(frames(&folder) == frames(&alone));
    assert!(folder.path("film.apng").exists() && folder.path("out/scene/scene.sheet.png").exists());
    let again = plan(&folder, &options);
    assert_eq!((again.code, again.stdout.as_str()), (Some(0), "all frames are whole\n"));
    assert_eq!(read(&folder, "sbatch.log").matches("parsable").count(), 3);
}

#[test]
fn a_killed_task_is_lost_where_slurm_can_be_asked() {
    let folder = folder();
    plan(&folder, &["--chunk", "2", "--submit"]);
    // Killed: its journal has no last line.
    let journal = "out/scene/scene.farm/journal/task-1.0.jsonl";
    batch(&folder, "frames.sbatch", 1);
    let text = read(&folder, journal);
    folder.write(journal, &text[..text.rfind("{\"event\":\"end\"").unwrap()]);
    // Of the first task, whose frames were drawn to measure them, one is missing, too.
    for number in ["0000", "0003"] {
        fs::remove_file(folder.path(&format!("out/scene/scene.{number}.png"))).unwrap();
    }
    let states = |found: &Value| -> Vec<String> {
        found["tasks"].as_array().unwrap().iter().map(|task| task["state"].as_str().unwrap().to_owned()).collect()
    };
    let blind = status(&folder).1;
    assert_eq!(
        (states(&blind), &blind["asked"]),
        (["waiting", "running", "waiting"].map(str::to_owned).to_vec(), &false.into())
    );
    let asked = asked_status(&folder, "2 0 RUNNING\n2 2 PENDING\n3 N/A PENDING\n77 1 RUNNING\n");
    assert_eq!(
        (states(&asked), &asked["asked"]),
        (["running", "lost", "waiting"].map(str::to_owned).to_vec(), &true.into())
    );
    assert_eq!((&asked["running"], &asked["finish"]["state"]), (&1.into(), &"waiting".into()));
    assert_eq!(asked_status(&folder, "77 1 RUNNING\n")["finish"]["state"], "lost");
    let text = Run::of(with_slurm(&folder, &mut folder.command(&["farm", "status", "scene.toml"])).output().unwrap());
    assert!(
        text.stdout.contains("lost: started on") && text.stdout.contains("neither ended nor queued"),
        "{}",
        text.stdout
    );
    assert!(text.stdout.contains("last job: not queued"), "{}", text.stdout);
}

#[test]
fn the_last_job_makes_the_flipbook_of_the_command() {
    let (folder, alone) = (folder(), Folder::with_scene(FLAME));
    let options = ["--seed", "5", "--chunk", "6", "--flipbook", "game/a.png", "--flipbook-grid", "2x2"];
    let planned = plan(&folder, &options);
    assert_eq!(planned.code, Some(0), "{}", planned.stderr);
    batch(&folder, "frames.sbatch", 0);
    assert_eq!(status(&folder).0, Some(1));
    let finish = batch(&folder, "finish.sbatch", 0);
    assert_eq!(finish.code, Some(0), "{}", finish.stderr);
    let alone_line = ["flipbook", "scene.toml", "--seed", "5", "--grid", "2x2", "-o", "game/a.png"];
    alone.succeed(&alone_line);
    assert!(folder.files("game").len() == 4 && folder.files("game") == alone.files("game"));
    assert_eq!(status(&folder).0, Some(0));
    assert_eq!(plan(&folder, &options).stdout, "all frames are whole\n");
    fs::remove_file(folder.path("game/a_motion.png")).unwrap();
    let (code, found) = status(&folder);
    assert_eq!((code, found["unmade"].as_array().unwrap().len()), (Some(1), 1));
    // Without a plan, and with another cell size.
    let finish = [
        "farm",
        "finish",
        "scene.toml",
        "--seed",
        "5",
        "--flipbook",
        "b/a.exr",
        "--flipbook-grid",
        "2x1",
        "--flipbook-size",
        "24x32",
    ];
    folder.succeed(&finish);
    alone.succeed(&["flipbook", "scene.toml", "--seed", "5", "--grid", "2x1", "--size", "24x32", "-o", "b/a.exr"]);
    assert!(folder.files("b").len() == 3 && folder.files("b") == alone.files("b"));
    for (options, words) in [
        (&["--flipbook", "a.png"][..], "--flipbook-grid"),
        (&["--flipbook", "a.gif", "--flipbook-grid", "2x2"], "NAME.png or NAME.exr"),
        (&["--film", "a.png"], "not a film format"),
        (&["--size", "16384x64", "--contact-sheet", "4"], "allowed: up to"),
    ] {
        let refused = plan(&folder, options);
        assert_eq!(refused.code, Some(2), "{options:?}: {}", refused.stderr);
        assert!(refused.stderr.contains(words), "{options:?}: {}", refused.stderr);
    }
}

#[test]
fn only_what_is_missing_is_submitted_again() {
    let folder = folder();
    plan(&folder, &["--chunk", "2", "--submit"]);
    for task in 0..3 {
        batch(&folder, "frames.sbatch", task);
    }
    fs::remove_file(folder.path("out/scene/scene.0003.png")).unwrap();
    let again = plan(&folder, &["--submit"]);
    assert!(again.stdout.starts_with("1 frame in 1 task of up to 2 frames"), "{}{}", again.stdout, again.stderr);
    assert!(read(&folder, "out/scene/scene.farm/frames.sbatch").contains("#SBATCH --array=1\n"));
    let run = batch(&folder, "frames.sbatch", 1);
    assert!(run.stderr.contains("1 frame in") && run.stderr.contains("1 was kept"), "{}", run.stderr);
}

#[test]
fn tiles_are_joined_to_the_bytes_of_whole_pictures() {
    let (folder, alone) = (folder(), Folder::with_scene(FLAME));
    let planned = plan(&folder, &["-o", "out/scene/scene.####.exr", "--aovs", "--chunk", "6", "--tiles", "2x2"]);
    assert_eq!(planned.code, Some(0), "{}", planned.stderr);
    for task in 0..4 {
        let run = batch(&folder, "frames.sbatch", task);
        assert_eq!(run.code, Some(0), "{}", run.stderr);
    }
    let whole =
        || -> Vec<_> { folder.files("out/scene").into_keys().filter(|name| name.starts_with("scene.0")).collect() };
    assert!(whole().is_empty(), "tiles are not frames");
    let finish = batch(&folder, "finish.sbatch", 0);
    assert_eq!(finish.code, Some(0), "{}", finish.stderr);
    alone.succeed(&["render", "scene.toml", "-o", "out/scene/scene.####.exr", "--aovs"]);
    assert_eq!(whole().len(), 6);
    for name in whole() {
        assert!(folder.files("out/scene")[&name] == alone.files("out/scene")[&name], "{name}");
    }
    let status = folder.succeed(&["farm", "status", "scene.toml", "-o", "out/scene/scene.####.exr"]);
    assert!(status.stdout.starts_with("frames: 6 whole, 0 missing"), "{}", status.stdout);
}

#[test]
fn finished_frames_become_a_film_without_a_plan() {
    let folder = folder();
    folder.succeed(&["render", "scene.toml", "--frames", "0-4"]);
    let missing = folder.run(&["farm", "finish", "scene.toml", "--film", "a.apng"]);
    assert_eq!((missing.code, missing.errors()), (Some(1), 1));
    assert!(missing.stderr.contains("frames 5 are missing"), "{}", missing.stderr);
    folder.succeed(&["farm", "finish", "scene.toml", "--film", "a.apng", "--frames", "0-4", "--contact-sheet", "3"]);
    assert!(folder.path("a.apng").exists() && folder.path("out/scene/scene.sheet.png").exists());
}

#[test]
fn a_missing_slurm_and_its_own_words_are_told_before_anything_is_drawn() {
    let folder = folder();
    let empty = folder.path("empty");
    let mut command = folder.command(&["farm", "slurm", "scene.toml", "--submit"]);
    let missing = Run::of(command.env("PATH", empty).output().unwrap());
    assert_eq!((missing.code, missing.errors()), (Some(2), 1));
    assert!(missing.stderr.contains("there is no `sbatch` on the path"), "{}", missing.stderr);
    program(&folder, "sbatch", "#!/bin/sh\necho 'sbatch: error: invalid partition specified: nowhere' >&2\nexit 1\n");
    let refused = plan(&folder, &["--partition", "nowhere", "--submit"]);
    assert_eq!(
        (refused.code, refused.stderr.as_str()),
        (Some(1), "sbatch: error: invalid partition specified: nowhere\n")
    );
    assert!(!folder.path("out").exists());
}

#[test]
fn jobs_before_one_that_is_refused_are_canceled() {
    let folder = folder();
    let refuses_array = format!("{SBATCH}case \"$*\" in *frames.sbatch) exit 1;; esac\n");
    program(&folder, "sbatch", &refuses_array);
    let refused = plan(&folder, &["--submit"]);
    assert_eq!(refused.code, Some(1), "{}", refused.stderr);
    assert_eq!(read(&folder, "scancel.log"), "1\n");
    assert!(!folder.path("out/scene/scene.farm/jobs").exists());
}

#[test]
fn a_shot_whose_jobs_are_queued_is_not_planned_again() {
    let folder = folder();
    assert_eq!(plan(&folder, &["--submit"]).code, Some(0));
    folder.write("queue", "2\n2\n77\n");
    for submit in [&["--submit"][..], &[]] {
        let refused = plan(&folder, submit);
        assert_eq!(refused.code, Some(2));
        assert!(refused.stderr.contains("jobs 2 of this shot are queued or running"), "{}", refused.stderr);
    }
}

#[test]
fn arrays_are_no_larger_than_the_cluster_allows() {
    let folder = folder();
    let refused = plan(&folder, &["--chunk", "1"]);
    assert_eq!(refused.code, Some(2));
    assert!(refused.stderr.contains("6 tasks; allowed: up to 4 (chunks of at least 2 frames)"), "{}", refused.stderr);
    let automatic = plan(&folder, &["--task-minutes", "1"]);
    assert_eq!(automatic.code, Some(0), "{}", automatic.stderr);
}

/// The text of a plan with `old` replaced, and with the digest of what it says then.
fn signed_again(text: &str, old: &str, new: &str) -> String {
    let edited = text.replace(old, new);
    let (start, _) = edited.split_once(",\n  \"digest\"").expect("a digest at the end");
    format!("{start},\n  \"digest\": \"{}\"\n}}\n", blake3::hash(start.as_bytes()).to_hex())
}

#[test]
fn tasks_of_another_scene_folder_or_plan_refuse() {
    let folder = folder();
    plan(&folder, &["--chunk", "2"]);
    folder.write("scene.toml", &FLAME.replace("seed = 7", "seed = 8"));
    let changed = batch(&folder, "frames.sbatch", 1);
    assert_eq!(changed.code, Some(1));
    assert!(changed.stderr.contains("frames of two scenes would be mixed"), "{}", changed.stderr);
    let (_, found) = status(&folder);
    assert_eq!(found["finish"]["by"][0][0], "task-1");
    assert!(found["frames"]["stale"].as_u64().unwrap() > 0, "{found}");
    folder.write("scene.toml", FLAME);
    let plan_file = "out/scene/scene.farm/plan.json";
    let text = read(&folder, plan_file);
    let version = format!("Bansho {}", env!("CARGO_PKG_VERSION"));
    folder.write(plan_file, &signed_again(&text, &version, "Bansho 0.0.1"));
    let other = batch(&folder, "frames.sbatch", 1);
    assert!(other.stderr.contains(&format!("this machine runs {version}")), "{}", other.stderr);
    let arithmetic = serde_json::from_str::<Value>(&text).unwrap()["arithmetic"].as_str().unwrap().to_owned();
    folder.write(plan_file, &signed_again(&text, &arithmetic, "00"));
    let other = batch(&folder, "frames.sbatch", 1);
    assert!(other.stderr.contains("this machine does not reproduce the bytes"), "{}", other.stderr);
    folder.write(plan_file, "{");
    let other = batch(&folder, "frames.sbatch", 1);
    assert_eq!((other.code, other.errors()), (Some(1), 1));
}

#[test]
fn a_signal_to_the_batch_shell_stops_the_task_and_keeps_its_frames() {
    let folder = Folder::with_scene(&FLAME.replace("frames = 6", "frames = 3000").replace("[48, 64]", "[480, 640]"));
    let planned = folder.run(&["farm", "slurm", "scene.toml", "--chunk", "3000", "--threads", "1"]);
    assert_eq!(planned.code, Some(0), "{}", planned.stderr);
    let script = folder.path("out/scene/scene.farm/frames.sbatch");
    let mut shell = Command::new("sh");
    let child = shell
        .arg(script)
        .env("SLURM_ARRAY_TASK_ID", "0")
        .stdin(Stdio::null())
        .stderr(Stdio::piped())
        .stdout(Stdio::piped());
    let child = child.spawn().unwrap();
    let is_there = |number: u32| folder.path(&format!("out/scene/scene.{number:04}.png")).exists();
    wait_until("the second frame", || is_there(2));
    let killed = Command::new("kill").arg("-TERM").arg(child.id().to_string()).status().unwrap();
    assert!(killed.success());
    let run = Run::of(child.wait_with_output().unwrap());
    assert_eq!(run.code, Some(143), "{}", run.stderr);
    let journal = read(&folder, "out/scene/scene.farm/journal/task-0.0.jsonl");
    let end: Value = serde_json::from_str(journal.lines().last().unwrap()).unwrap();
    assert_eq!((&end["event"], &end["code"]), (&"end".into(), &143.into()));
    let hidden = fs::read_dir(folder.path("out/scene")).unwrap().flatten();
    assert!(hidden.into_iter().all(|entry| entry.path().extension() != Some("part".as_ref())));
}

#[test]
fn films_streams_and_other_outputs_are_refused() {
    let folder = folder();
    for (arguments, words) in [
        (&["-o", "a.mp4"][..], "one file holds all frames"),
        (&["--tiles", "100x1"], "at most one for each pixel"),
        (&["--tiles", "2x2", "--crop", "0,0,4,4"], "cannot be used with"),
        (&["--chunk", "0"], "auto, or a number of frames"),
        (&["--frames", "5-1"], "ends before it begins"),
        (&["--partition", "a\nb"], "control characters"),
    ] {
        let refused = plan(&folder, arguments);
        assert_eq!(refused.code, Some(2), "{arguments:?}: {}", refused.stderr);
        assert!(refused.stderr.contains(words), "{arguments:?}: {}", refused.stderr);
    }
    let stdin = folder.run(&["farm", "slurm", "-"]);
    assert_eq!((stdin.code, stdin.errors()), (Some(2), 1));
    let none = folder.run(&["farm", "status", "scene.toml", "-o", "elsewhere/a.####.png"]);
    assert_eq!((none.code, none.errors()), (Some(2), 1), "{}", none.stderr);
}

/// A simulated scene of nine frames, small enough for tests.
const SIMULATED: &str =
    "bansho = 2\n[picture]\nsize = [24, 32]\nframes = 9\n[[flame_particles]]\nparticles = 60\npreroll_s = 0.05\n";

#[test]
fn snapshots_are_made_without_drawing_as_far_as_frames_are_missing() {
    let (folder, alone) = (folder(), Folder::with_scene(SIMULATED));
    folder.write("scene.toml", SIMULATED);
    let planned = plan(&folder, &["--chunk", "3", "--submit"]);
    assert_eq!(planned.code, Some(0), "{}", planned.stderr);
    assert!(planned.stdout.contains("snapshots 2\n"), "{}", planned.stdout);
    let drawn = || folder.files("out/scene").into_keys().filter(|name| name.starts_with("scene.0")).count();
    let probed = drawn();
    let states = || folder.files("out/scene/scene.farm/states").into_keys().collect::<Vec<_>>();
    let snapshots = batch(&folder, "snapshots.sbatch", 0);
    assert_eq!(snapshots.code, Some(0), "{}", snapshots.stderr);
    assert_eq!(states(), ["state.0.bansho", "state.3.bansho", "state.6.bansho"]);
    assert_eq!(drawn(), probed, "nothing is drawn");
    for task in 0..3 {
        assert_eq!(batch(&folder, "frames.sbatch", task).code, Some(0));
    }
    alone.succeed(&["render", "scene.toml"]);
    let frames = |folder: &Folder| -> Vec<_> {
        folder.files("out/scene").into_iter().filter(|(name, _)| name.starts_with("scene.0")).collect()
    };
    assert!(frames(&folder) == frames(&alone));
    // Only the second chunk has a frame to draw: snapshots up to its beginning, and no frame is drawn again.
    fs::remove_dir_all(folder.path("out/scene/scene.farm/states")).unwrap();
    fs::remove_file(folder.path("out/scene/scene.0004.png")).unwrap();
    let again = plan(&folder, &["--submit"]);
    assert!(again.stdout.contains("1 frame in 1 task"), "{}{}", again.stdout, again.stderr);
    assert!(read(&folder, "out/scene/scene.farm/snapshots.sbatch").contains(" snapshots --last=3 "));
    let before = fs::metadata(folder.path("out/scene/scene.0006.png")).unwrap().modified().unwrap();
    assert_eq!(batch(&folder, "snapshots.sbatch", 0).code, Some(0));
    assert_eq!(states(), ["state.0.bansho", "state.3.bansho"]);
    let run = batch(&folder, "frames.sbatch", 1);
    assert!(run.stderr.contains("1 frame in") && run.stderr.contains("2 were kept"), "{}", run.stderr);
    assert_eq!(fs::metadata(folder.path("out/scene/scene.0006.png")).unwrap().modified().unwrap(), before);
    assert!(frames(&folder) == frames(&alone));
    // Of another scene, none are made.
    folder.write("scene.toml", &SIMULATED.replace("60", "61"));
    let changed = batch(&folder, "snapshots.sbatch", 0);
    assert!(changed.stderr.contains("frames of two scenes would be mixed"), "{}", changed.stderr);
}
