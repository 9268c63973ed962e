//! `bansho check`

use std::{collections::BTreeSet, path::Path};

use bansho::{
    Scene,
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
        match describe(path, &args.inputs, args.paper) {
            Ok(line) => print(&line)?,
            Err(error) => {
                exit::print_job_error(&error);
                last_error = Some(error);
            }
        }
    }
    last_error.map_or(Ok(()), |error| Err(ReportedError::Job(error).into()))
}

/// Checks a scene and returns its description, with its departures from papers if they are asked for.
fn describe(path: &Path, inputs: &InputArgs, papers: bool) -> Result<String, JobError> {
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
    let departures = if papers { describe_departures(plan.scene()) } else { String::new() };
    Ok(format!(
        "{}: valid. {width} x {height}, {numbers} at {rate} fps, EV100 {:.1}: {names}\n{departures}",
        printable(&scene.name),
        plan.exposure_ev100
    ))
}

/// What does not follow the papers of a scene's phenomena, a line each.
fn describe_departures(scene: &Scene) -> String {
    let of_papers: BTreeSet<&str> =
        scene.instances.iter().filter_map(|instance| instance.kind.paper).map(|paper| paper.paper).collect();
    let departures = scene.paper_departures();
    if of_papers.is_empty() {
        return "  no phenomenon with a paper\n".to_owned();
    }
    if departures.is_empty() {
        let papers: Vec<&str> = of_papers.into_iter().collect();
        return format!("  follows {} to the letter, as far as keys tell\n", papers.join(" and "));
    }
    departures.iter().map(|departure| format!("  {}\n", printable_excerpt(&departure.to_string()))).collect()
}
