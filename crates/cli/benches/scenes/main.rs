//! The time of a frame of every scene of `scenes/`, by stage and phenomenon, in steady state: with a still camera, and while it pans by one degree a
//! second. Frames are drawn to memory and converted for display; nothing is written.
//!
//! ```text
//! cargo bench -p bansho-cli --bench scenes -- [SCENE...] [--frames N] [--size WxH] [--dome-size N] [--threads N] [--json FILE]
//!                                         [--check FILE] [--record FILE]
//! ```
//!
//! Times are the CPU time of the threads that report them, so that other programs on the machine hardly disturb them; with one thread (the default)
//! that is all of it. Each is the median over the frames after the first. `--check` compares the ratios of the scenes with those of a file,
//! `--record` writes it.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a program of its own")]

mod arguments;
mod clock;
mod measure;
mod pan;
mod ratios;
mod report;

use std::{fs, path::Path, process::ExitCode};

use arguments::Arguments;
use measure::SceneTimes;

fn main() -> ExitCode {
    let arguments = match Arguments::parse(std::env::args().skip(1)) {
        Ok(Some(arguments)) => arguments,
        // `cargo bench` also gives all benchmarks the options of criterion.
        Ok(None) => return ExitCode::SUCCESS,
        Err(message) => return fail(&message),
    };
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => fail(&message),
    }
}

fn fail(message: &str) -> ExitCode {
    eprintln!("error: {message}");
    ExitCode::FAILURE
}

/// Measures, reports, records and checks. Whether the check passed.
fn run(arguments: &Arguments) -> Result<bool, String> {
    let pool = clock::pinned_pool(arguments.threads)?;
    let (mut scenes, mut kernel) = (Vec::new(), Vec::new());
    for path in arguments.scene_files()? {
        let (times, kernel_ms) = pool.install(|| {
            let kernel_ms = clock::reference_kernel_ms();
            measure::scene(&path, arguments).map(|times| (times, kernel_ms))
        })?;
        print!("{}", report::table(&times));
        scenes.push(times);
        kernel.push(kernel_ms);
    }
    let kernel_ms = measure::median(&kernel);
    println!("reference kernel {kernel_ms:.2} ms");
    let json = report::json(arguments, kernel_ms, &scenes);
    write(&arguments.json_file(), &format!("{json:#}\n"))?;
    finish(arguments, kernel_ms, &scenes)
}

fn finish(arguments: &Arguments, kernel_ms: f64, scenes: &[SceneTimes]) -> Result<bool, String> {
    let ratios = ratios::of(scenes, kernel_ms);
    if let Some(file) = &arguments.record {
        write(file, &ratios::text(&ratios, arguments))?;
    }
    let Some(file) = &arguments.check else { return Ok(true) };
    let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let failures = ratios::failures(&ratios, &ratios::parse(&text)?);
    failures.iter().for_each(|failure| println!("FAIL  {failure}"));
    if failures.is_empty() {
        println!("ok    no scene takes more than {} times its part of the time", ratios::CEILING);
    }
    Ok(failures.is_empty())
}

fn write(file: &Path, text: &str) -> Result<(), String> {
    fs::write(file, text).map_err(|error| format!("{}: {error}", file.display()))
}
