//! `bansho check`

use std::path::Path;

use bansho::{
    base::host::printable::printable,
    job::{self, JobError},
};

use crate::{
    args::{CheckArgs, InputArgs},
    exit::{self, ReportedJobError},
    output::{self, to_stdout},
};

/// Checks every scene and tells all faults of all of them, and what stops nothing but will look other than one may expect.
pub(crate) fn run(args: &CheckArgs) -> anyhow::Result<()> {
    let mut last_fault = None;
    for path in &args.scenes {
        match describe(path, &args.inputs) {
            Ok(line) => to_stdout(&line)?,
            Err(error) => {
                exit::report_job_error(&error);
                last_fault = Some(error);
            }
        }
    }
    last_fault.map_or(Ok(()), |error| Err(ReportedJobError(error).into()))
}

fn describe(path: &Path, inputs: &InputArgs) -> Result<String, JobError> {
    let scene = inputs.read(path, &[])?;
    let (compiled, plan) = job::check_scene(&scene)?;
    for remark in job::remarks(&scene, &compiled, &plan) {
        output::tell("warning", &remark.to_string());
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
    let names = if names.is_empty() { "nothing in it".to_owned() } else { names.join(", ") };
    Ok(format!(
        "{}: right. {width} x {height}, {numbers} at {rate} a second, EV100 {:.1}: {names}\n",
        printable(&scene.name),
        plan.exposure_ev100
    ))
}
