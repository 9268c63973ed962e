//! The part of `--stats` about phenomena: preroll, first frame and median of the others.

use std::fmt::Write;

use bansho::{
    Stage,
    base::host::{
        plural::counted,
        printable::printable_excerpt,
        stage_times::{PartTimes, StageTimes},
    },
};
use serde_json::{Value, json};

/// The stages that have parts.
const STAGES: [Stage; 3] = [Stage::Advance, Stage::Prepare, Stage::Draw];

/// The times of a phenomenon, of compositing, or of all together.
struct Row {
    /// Name of the phenomenon; `None` for compositing.
    phenomenon: Option<String>,
    is_mirrored: bool,
    /// Of the first frame, in which caches are filled, s, in the order of [`STAGES`]. Its steps are the preroll.
    first: [f64; 3],
    /// Medians over the other frames, s.
    median: [f64; 3],
    /// Sums over all frames, s.
    sum: [f64; 3],
}

impl Row {
    fn label(&self) -> String {
        let name = self.phenomenon.as_deref().map_or("compositing".into(), printable_excerpt);
        if self.is_mirrored { format!("{name}, mirrored") } else { name.into_owned() }
    }

    fn write(label: &str, first: [f64; 3], median: Option<[f64; 3]>, table: &mut String) {
        let [preroll, prepare, draw] = first.map(|seconds| 1e3 * seconds);
        // Writing to a string cannot fail.
        let _ = write!(table, "\n{label:24} {preroll:9.1} {prepare:9.2} {draw:9.2}");
        if let Some(median) = median {
            let [advance, prepare, draw] = median.map(|seconds| 1e3 * seconds);
            let _ = write!(table, "   {advance:9.2} {prepare:9.2} {draw:9.2}");
        }
    }
}

/// The table, which begins with a new line; empty if nothing was drawn.
pub(super) fn table(times: &StageTimes) -> String {
    let (rows, frames) = (rows(times), times.frames());
    if rows.is_empty() {
        return String::new();
    }
    let others = frames.len() - 1;
    let mut table = format!("\n\n{:24}       first frame            ", "thread ms");
    if others > 0 {
        let _ = write!(table, "  median of {}", counted(others, "other frame"));
    }
    let _ = write!(table, "\n{:24} {:>9} {:>9} {:>9}", "", "preroll", "prepare", "draw");
    if others > 0 {
        let _ = write!(table, "   {:>9} {:>9} {:>9}", "advance", "prepare", "draw");
    }
    for row in &rows {
        Row::write(&row.label(), row.first, (others > 0).then_some(row.median), &mut table);
    }
    let elapsed = STAGES.map(|stage| {
        let each: Vec<f64> = frames.iter().map(|frame| frame[stage as usize]).collect();
        first_and_median(&each)
    });
    let (first, median) = (elapsed.map(|[first, _]| first), elapsed.map(|[_, median]| median));
    Row::write("elapsed ms", first, (others > 0).then_some(median), &mut table);
    table
}

/// The rows as an array.
pub(super) fn json(times: &StageTimes) -> Value {
    let rows = rows(times).into_iter();
    rows.map(|row| {
        json!({
            "phenomenon": row.phenomenon,
            "mirrored": row.is_mirrored,
            "first_frame_ms": milliseconds(row.first),
            "median_ms": milliseconds(row.median),
        })
    })
    .collect()
}

/// The table where frames overlap: means over all `frames`, since first and later ones cannot be told apart. It begins with a new line; empty if nothing was
/// drawn.
pub(super) fn table_of_means(times: &StageTimes, frames: usize) -> String {
    let rows = rows(times);
    if rows.is_empty() {
        return String::new();
    }
    let mut table = format!("\n\n{:24} mean of {}", "processor ms", counted(frames, "frame"));
    let _ = write!(table, "\n{:24} {:>9} {:>9} {:>9}", "", "advance", "prepare", "draw");
    for row in &rows {
        let [advance, prepare, draw] = row.sum.map(|seconds| 1e3 * seconds / frames.max(1) as f64);
        let _ = write!(table, "\n{:24} {advance:9.2} {prepare:9.2} {draw:9.2}", row.label());
    }
    table
}

/// The same rows as an array.
pub(super) fn json_of_means(times: &StageTimes, frames: usize) -> Value {
    let rows = rows(times).into_iter();
    rows.map(|row| {
        let mean = row.sum.map(|seconds| seconds / frames.max(1) as f64);
        json!({ "phenomenon": row.phenomenon, "mirrored": row.is_mirrored, "mean_ms": milliseconds(mean) })
    })
    .collect()
}

/// Times in the order of [`STAGES`], in ms, by the names of the stages.
fn milliseconds(seconds: [f64; 3]) -> Value {
    let [advance, prepare, draw] = seconds.map(|seconds| 1e3 * seconds);
    json!({ "advance": advance, "prepare": prepare, "draw": draw })
}

/// One row for each phenomenon, then their reflections, then compositing.
fn rows(times: &StageTimes) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for part in times.parts() {
        let PartTimes { stage, phenomenon, is_mirrored, frames } = part;
        let Some(column) = STAGES.iter().position(|each| *each == stage) else { continue };
        let index = rows.iter().position(|row| (&row.phenomenon, row.is_mirrored) == (&phenomenon, is_mirrored));
        let index = index.unwrap_or_else(|| {
            rows.push(Row { phenomenon, is_mirrored, first: [0.0; 3], median: [0.0; 3], sum: [0.0; 3] });
            rows.len() - 1
        });
        [rows[index].first[column], rows[index].median[column]] = first_and_median(&frames);
        rows[index].sum[column] = frames.iter().sum();
    }
    rows.sort_by_key(|row| (row.phenomenon.is_none(), row.is_mirrored));
    rows
}

/// The first number, and the median of all others; 0 where there are none.
fn first_and_median(numbers: &[f64]) -> [f64; 2] {
    let Some((first, others)) = numbers.split_first() else { return [0.0; 2] };
    let mut sorted = others.to_vec();
    sorted.sort_by(f64::total_cmp);
    // Of an even count the median is the mean of the two in the middle; of an odd one both are the same.
    let middle = [sorted.len() / 2, sorted.len().saturating_sub(1) / 2];
    let [upper, lower] = middle.map(|index| sorted.get(index).copied().unwrap_or(0.0));
    [*first, 0.5 * (upper + lower)]
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use bansho::StagePart;

    use super::*;

    const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    /// Frames whose rain takes 9, 1, 2 and 3 ms to draw.
    fn times() -> StageTimes {
        let (times, mut now) = (StageTimes::default(), 0);
        for draw in [9, 1, 2, 3] {
            times.begin(Stage::Advance, ms(now));
            times.end(Stage::Advance, ms(now + 1));
            for (stage, duration, is_mirrored) in [(Stage::Prepare, 4, true), (Stage::Draw, draw, false)] {
                let part = StagePart { stage, phenomenon: Some("rain"), is_mirrored };
                times.begin(stage, ms(now + 10));
                times.begin_part(part, ms(now + 10));
                times.end_part(part, ms(now + 10 + duration));
                times.end(stage, ms(now + 30));
            }
            now += 100;
        }
        times
    }

    #[test]
    fn the_first_frame_is_apart_from_the_median_of_the_others() {
        assert_eq!(first_and_median(&[]), [0.0; 2]);
        assert_eq!(first_and_median(&[5.0]), [5.0, 0.0]);
        assert_eq!(first_and_median(&[5.0, 1.0, 9.0]), [5.0, 5.0]);
        assert_eq!(first_and_median(&[5.0, 1.0, 9.0, 2.0]), [5.0, 2.0]);
    }

    #[test]
    fn phenomena_and_their_reflections_have_rows() {
        let table = table(&times());
        let row = |label: &str| -> Vec<String> {
            let line = table.lines().find_map(|line| line.strip_prefix(&format!("{label:24}"))).unwrap();
            line.split_whitespace().map(str::to_owned).collect()
        };
        assert_eq!(row("rain"), ["0.0", "0.00", "9.00", "0.00", "0.00", "2.00"], "{table}");
        assert_eq!(row("rain, mirrored"), ["0.0", "4.00", "0.00", "0.00", "4.00", "0.00"]);
        assert_eq!(row("elapsed ms"), ["1.0", "20.00", "20.00", "1.00", "20.00", "20.00"]);
        assert!(table.contains("median of 3 other frames"), "{table}");
    }

    #[test]
    fn where_frames_overlap_their_mean_is_told() {
        // (9 + 1 + 2 + 3) / 4 and, in the mirror, 4 ms.
        let rows = json_of_means(&times(), 4);
        assert!((rows[0]["mean_ms"]["draw"].as_f64().unwrap() - 3.75).abs() < 1e-9, "{rows}");
        assert!((rows[1]["mean_ms"]["prepare"].as_f64().unwrap() - 4.0).abs() < 1e-9, "{rows}");
        let table = table_of_means(&times(), 4);
        assert!(table.contains("mean of 4 frames") && !table.contains("first frame"), "{table}");
        let rain = table.lines().find(|line| line.starts_with("rain ")).unwrap();
        assert!(rain.ends_with("0.00      0.00      3.75"), "{table}");
    }

    #[test]
    fn programs_read_the_same_numbers() {
        let rows = json(&times());
        assert_eq!((&rows[0]["phenomenon"], &rows[0]["mirrored"]), (&json!("rain"), &json!(false)));
        assert!((rows[0]["first_frame_ms"]["draw"].as_f64().unwrap() - 9.0).abs() < 1e-9);
        assert!((rows[1]["median_ms"]["prepare"].as_f64().unwrap() - 4.0).abs() < 1e-9);
    }
}
