//! `bansho check`

use std::path::Path;

use bansho::{
    base::host::printable::{printable, printable_excerpt},
    job::{self, JobError},
};

use crate::{
    args::{CheckArgs, InputArgs},
    exit::{self, ReportedError},
    output::{print, print_message},
};

/// Checks all scenes, and prints their errors and warnings.
pub(crate) fn run(args: &CheckArgs) -> anyhow::Result<()> {
    let mut last_error = None;
    for path in &args.scenes {
        match describe(path, &args.inputs) {
            Ok(line) => print(&line)?,
            Err(error) => {
                exit::print_job_error(&error);
                last_error = Some(error);
            }
        }
    }
    last_error.map_or(Ok(()), |error| Err(ReportedError::Job(error).into()))
}

/// Checks a scene and returns its description.
fn describe(path: &Path, inputs: &InputArgs) -> Result<String, JobError> {
    let scene = inputs.read(path, &[])?;
    let (compiled, plan) = job::check_scene(&scene)?;
    for warning in job::remarks(&scene, &compiled, &plan) {
        print_message("warning", &warning.to_string());
    }
    let [width, height] = plan.size();
    let (fps, frames) = (plan.fps(), plan.frames());
    let rate = f64::from(fps.frames) / f64::from(fps.seconds);
    let numbers = match (frames.start, frames.end - 1) {
        (first, last) if first == last => format!("frame {first}"),
        (first, last) => format!("frames {first} to {last}"),
    };
    let drawn = plan.scene().instances.iter().filter(|instance| instance.enabled);
    let names: Vec<&str> = drawn.map(|instance| instance.name.as_str()).collect();
    let names = if names.is_empty() { "no phenomena".to_owned() } else { names.join(", ") };
    let names = printable_excerpt(&names);
    Ok(format!(
        "{}: valid. {width} x {height}, {numbers} at {rate} fps, EV100 {:.1}: {names}\n",
        printable(&scene.name),
        plan.exposure_ev100
    ))
}
