//! The commands of everyday work on Bansho: `cargo xtask`, an alias of `.cargo/config.toml`. Each prints the commands that it runs.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it reports to the terminal")]

use std::{
    env,
    path::{self, Path, PathBuf},
    process::{Command, ExitCode, Stdio},
};

const HELP: &str = "\
usage: cargo xtask COMMAND

check                 clippy of the whole workspace, and names that were given up
test CRATE [NAME]     the tests of a crate, such as `fire`, whose names contain NAME
bless [TEST]          rewrite what a test compares with: pictures (the default), small_frames or scene_reference
ratio [NAME]          measure the pairs of .ci/ratios.txt whose names contain NAME, fast way and naive implementation
look SCENE [FRAME]    render a frame (0 by default) of a scene, a file or a name in scenes/, and print the path of the PNG file
fmt                   format all code
docs                  the documentation of all crates, without a warning
book                  the book with its figures, and its links
ci                    everything that CI checks, in about 80 minutes on two slow cores
long                  the same with full counts: hours";

/// Options of criterion by which the ratios of CI are measured.
const QUICK: [&str; 6] = ["--sample-size", "10", "--warm-up-time", "0.5", "--measurement-time", "2"];

/// The tests that `BANSHO_BLESS` makes rewrite what they compare with.
const BLESSED: [&str; 3] = ["pictures", "small_frames", "scene_reference"];

/// An error is a message for the terminal.
type Result<T = ()> = std::result::Result<T, String>;

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match run_command(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn run_command(arguments: &[&str]) -> Result {
    match *arguments {
        [] | ["help" | "--help" | "-h"] => {
            println!("{HELP}");
            Ok(())
        }
        ["check"] => {
            run(cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
            run(command(".ci/banned_names", &[]))
        }
        ["test", name, ref filters @ ..] => test(name, filters),
        ["bless"] => bless("pictures"),
        ["bless", test] => bless(test),
        ["ratio"] => ratio(""),
        ["ratio", name] => ratio(name),
        ["look", scene] => look(scene, "0"),
        ["look", scene, frame] => look(scene, frame),
        ["fmt"] => run(cargo(&["fmt", "--all"])),
        ["docs"] => {
            let mut doc = cargo(&["doc", "--no-deps", "--workspace"]);
            doc.env("RUSTDOCFLAGS", "-D warnings");
            run(doc)
        }
        ["book"] => run(command("bash", &["-c", "set -euo pipefail; source .ci/steps; book"])),
        ["ci"] => run(command("bash", &[".ci/run"])),
        ["long"] => run(command("bash", &[".ci/long"])),
        _ => Err(format!("error: `cargo xtask {}` means nothing here\n\n{HELP}", arguments.join(" "))),
    }
}

/// Runs the tests of a crate, called as its folder or as its package, whose names contain one of `filters`.
fn test(name: &str, filters: &[&str]) -> Result {
    let name = name.replace('_', "-");
    let package = if name.starts_with("bansho") { name } else { format!("bansho-{name}") };
    run(cargo(&[&["test", "-p", &package, "--"], filters].concat()))
}

fn bless(test: &str) -> Result {
    if !BLESSED.contains(&test) {
        return Err(format!("error: nothing can be blessed in `{test}`; allowed: {}", BLESSED.join(", ")));
    }
    // The scene reference is one of the tests of scenes.
    let binary: &[&str] = if test == "scene_reference" { &["scenes", test] } else { &[test] };
    let mut tests = cargo(&[&["test", "-p", "bansho", "--test"], binary].concat());
    tests.env("BANSHO_BLESS", "1");
    run(tests)?;
    run(command("git", &["status", "--short"]))
}

/// Measures the pairs of `.ci/ratios.txt` whose names contain `name`, with the few samples that CI takes, and holds their ratios.
fn ratio(name: &str) -> Result {
    let ratios = ".ci/ratios.py";
    let benchmarks = output(command("python3", &[ratios, "--select", ".ci/ratios.txt", name]), Stdio::piped())?;
    run(cargo(&[&["bench", "--bench", "*", "--", "--noplot", benchmarks.trim()], &QUICK[..]].concat()))?;
    let criterion = target_folder().join("criterion");
    run(command("python3", &[ratios, &criterion.to_string_lossy(), ".ci/ratios.txt", name]))
}

/// Renders a frame of a scene, which is a file or has a name in `scenes/`, and prints the path of the PNG file.
fn look(scene: &str, frame: &str) -> Result {
    let given = path::absolute(scene).map_err(|error| format!("error: {scene}: {error}"))?;
    let file = if given.exists() { given } else { root().join("scenes").join(format!("{scene}.toml")) };
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    let picture = root().join("out/look").join(format!("{name}.{frame}.png"));
    let mut render = cargo(&["run", "--quiet", "--release", "-p", "bansho-cli", "--", "render"]);
    render.arg(&file).arg(format!("--frames={frame}")).arg("-o").arg(&picture);
    run(render)?;
    println!("{}", picture.display());
    Ok(())
}

/// The root of the workspace, in which all commands run.
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("this crate is in a folder of the workspace")
}

/// The folder in which cargo builds.
fn target_folder() -> PathBuf {
    root().join(env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()))
}

fn cargo(arguments: &[&str]) -> Command {
    command(&env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned()), arguments)
}

fn command(program: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(root());
    command
}

/// Prints a command and runs it.
///
/// # Errors
/// It cannot be started, or fails.
fn run(command: Command) -> Result {
    output(command, Stdio::inherit()).map(drop)
}

/// As [`run`]; what the command prints goes to `stdout`. Returns it where that is a pipe.
fn output(mut command: Command, stdout: Stdio) -> Result<String> {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let shown: Vec<String> = words.map(|word| word.to_string_lossy().into_owned()).collect();
    let shown = shown.join(" ");
    eprintln!("{shown}");
    let output = command.stdin(Stdio::inherit()).stderr(Stdio::inherit()).stdout(stdout).output();
    let output = output.map_err(|error| format!("error: cannot start {}: {error}", command.get_program().display()))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(format!("error: {shown}: {}", output.status))
    }
}
