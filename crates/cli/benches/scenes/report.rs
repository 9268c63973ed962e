//! The results for people and for programs.

use std::fmt::Write;

use bansho::Stage;
use serde_json::{Value, json};

use crate::{
    arguments::Arguments,
    measure::{FrameTimes, PartMedian, SceneTimes},
};

const STAGES: [Stage; 3] = [Stage::Advance, Stage::Prepare, Stage::Draw];

/// The table of a scene: one row for each phenomenon, its times with a still camera and with a moving one.
pub(crate) fn table(times: &SceneTimes) -> String {
    let SceneTimes { name, size: [width, height], compile_ms, plan_ms, preroll_ms, first_frame_ms, still, pan } = times;
    let mut table = format!(
        "\n{name} {width}x{height}: compile {compile_ms:.1} ms, plan {plan_ms:.1} ms, preroll {preroll_ms:.1} ms, first frame {first_frame_ms:.1} ms\n"
    );
    // Writing to a string cannot fail.
    let _ = writeln!(table, "  {:26}{:>27}   {:>27}", "ms a frame", "still camera", "panning camera");
    let columns = format!("{:>9}{:>9}{:>9}", "advance", "prepare", "draw");
    let _ = writeln!(table, "  {:26}{columns}   {columns}", "");
    for (label, phenomenon, is_mirrored) in rows(still) {
        let cells = |frame: &FrameTimes| {
            let cell = |stage| format!("{:9.2}", part(frame, stage, phenomenon, is_mirrored));
            STAGES.map(cell).concat()
        };
        let _ = writeln!(table, "  {label:26}{}   {}", cells(still), cells(pan));
    }
    let _ = writeln!(table, "  {:26}{:27.2}   {:27.2}", "view", still.view_ms, pan.view_ms);
    let _ = writeln!(table, "  {:26}{:27.2}   {:27.2}", "total", still.total_ms, pan.total_ms);
    table
}

/// Labels, names and reflections, each once; compositing last.
fn rows(frame: &FrameTimes) -> Vec<(String, Option<&str>, bool)> {
    let mut rows = Vec::new();
    for PartMedian { phenomenon, is_mirrored, .. } in &frame.parts {
        let name = phenomenon.as_deref().unwrap_or("compositing");
        let label = if *is_mirrored { format!("{name}, mirrored") } else { name.to_owned() };
        let row = (label, phenomenon.as_deref(), *is_mirrored);
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    rows.sort_by_key(|(_, phenomenon, is_mirrored)| (phenomenon.is_none(), *is_mirrored));
    rows
}

fn part(frame: &FrameTimes, stage: Stage, phenomenon: Option<&str>, is_mirrored: bool) -> f64 {
    let is_it = |part: &&PartMedian| {
        (part.stage, part.phenomenon.as_deref(), part.is_mirrored) == (stage, phenomenon, is_mirrored)
    };
    frame.parts.iter().find(is_it).map_or(0.0, |part| part.ms)
}

/// All numbers.
pub(crate) fn json(arguments: &Arguments, kernel_ms: f64, scenes: &[SceneTimes]) -> Value {
    let scenes: Vec<Value> = scenes.iter().map(scene_json).collect();
    json!({
        "threads": arguments.threads,
        "frames": arguments.frames,
        "reference_kernel_ms": kernel_ms,
        "scenes": scenes,
    })
}

fn scene_json(times: &SceneTimes) -> Value {
    json!({
        "scene": times.name,
        "size": times.size,
        "compile_ms": times.compile_ms,
        "plan_ms": times.plan_ms,
        "preroll_ms": times.preroll_ms,
        "first_frame_ms": times.first_frame_ms,
        "still": frame_json(&times.still),
        "pan": frame_json(&times.pan),
    })
}

fn frame_json(frame: &FrameTimes) -> Value {
    let part = |part: &PartMedian| {
        let PartMedian { stage, phenomenon, is_mirrored, ms } = part;
        json!({ "stage": stage.name(), "phenomenon": phenomenon, "mirrored": is_mirrored, "ms": ms })
    };
    let parts: Vec<Value> = frame.parts.iter().map(part).collect();
    json!({ "total_ms": frame.total_ms, "view_ms": frame.view_ms, "parts": parts })
}
