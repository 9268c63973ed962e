//! How long scenes take in relation to each other, which depends little on the machine: holds what was recorded, so that no scene loses a factor of two
//! unnoticed.

use std::fmt::Write;

use crate::{arguments::Arguments, measure::SceneTimes};

/// How much larger than recorded a ratio may be.
pub(crate) const CEILING: f64 = 2.0;
/// Added to every time, ms, so that frames that take hardly any do not fail.
const SLACK_MS: f64 = 0.5;
/// The row of the geometric mean of all scenes, in relation to the reference kernel.
const ALL: &str = "all scenes";

/// The ratio of a scene: its time with a still and with a moving camera, over the geometric mean of those of all scenes.
#[derive(Debug, PartialEq)]
pub(crate) struct Ratio {
    name: String,
    still: f64,
    pan: f64,
}

/// The ratios of all scenes; first, that of their mean to the reference kernel.
pub(crate) fn of(scenes: &[SceneTimes], kernel_ms: f64) -> Vec<Ratio> {
    let times = |scene: &SceneTimes| [scene.still.total_ms, scene.pan.total_ms].map(|ms| ms + SLACK_MS);
    let logarithms = scenes.iter().flat_map(times).map(bansho::base::math::ln);
    let mean = bansho::base::math::exp(logarithms.sum::<f64>() / (2 * scenes.len().max(1)) as f64);
    let all = Ratio { name: ALL.to_owned(), still: mean / kernel_ms, pan: mean / kernel_ms };
    let each = scenes.iter().map(|scene| {
        let [still, pan] = times(scene).map(|ms| ms / mean);
        Ratio { name: scene.name.clone(), still, pan }
    });
    std::iter::once(all).chain(each).collect()
}

/// The file of these ratios.
pub(crate) fn text(ratios: &[Ratio], arguments: &Arguments) -> String {
    let [width, height] = arguments.size;
    let (dome, frames) = (arguments.dome_size, arguments.frames);
    let mut text = format!(
        "# scene | still camera | panning camera: the time of a frame over the geometric mean of all scenes; for all scenes, that mean over the\n\
         # reference kernel. The check fails above {CEILING} times these numbers. Recorded by\n\
         # cargo bench -p bansho-cli --bench scenes -- --size {width}x{height} --dome-size {dome} --frames {frames} --record .ci/scene_ratios.txt\n\n"
    );
    for Ratio { name, still, pan } in ratios {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name:24} | {still:8.3} | {pan:8.3}");
    }
    text
}

/// The ratios of such a file.
pub(crate) fn parse(text: &str) -> Result<Vec<Ratio>, String> {
    let lines =
        text.lines().map(|line| line.split('#').next().unwrap_or_default().trim()).filter(|line| !line.is_empty());
    let ratio = |line: &str| {
        let mut cells = line.split('|').map(str::trim);
        let (name, still, pan) = (cells.next()?, cells.next()?.parse().ok()?, cells.next()?.parse().ok()?);
        Some(Ratio { name: name.to_owned(), still, pan })
    };
    lines.map(|line| ratio(line).ok_or_else(|| format!("not a line of ratios: {line}"))).collect()
}

/// What is slower than recorded, or missing.
pub(crate) fn failures(measured: &[Ratio], recorded: &[Ratio]) -> Vec<String> {
    let mut failures = Vec::new();
    for Ratio { name, still, pan } in measured {
        let Some(known) = recorded.iter().find(|known| known.name == *name) else {
            failures.push(format!("{name} is not recorded: see the head of the file"));
            continue;
        };
        for (camera, now, before) in [("still", *still, known.still), ("panning", *pan, known.pan)] {
            if now > CEILING * before {
                failures.push(format!("{name}, {camera} camera: {now:.2}, recorded {before:.2}"));
            }
        }
    }
    let is_measured = |known: &Ratio| measured.iter().any(|ratio| ratio.name == known.name);
    failures
        .extend(recorded.iter().filter(|known| !is_measured(known)).map(|known| format!("{} is missing", known.name)));
    failures
}
