//! `--stats`: the time spent in each stage, and in each phenomenon.

mod parts;

use std::{
    fmt::Write,
    fs,
    sync::OnceLock,
    time::{Duration, Instant},
};

use bansho::{
    Stage, StagePart,
    base::{
        host::{plural::counted, stage_times::StageTimes},
        math::simd::VectorLevel,
    },
};
use serde_json::{Value, json};

/// Measures the time of each stage and of its parts.
pub(crate) struct Stats {
    since: Instant,
    times: StageTimes,
    estimated_memory_mib: OnceLock<u64>,
}

impl Stats {
    pub(crate) fn new() -> Self {
        Self { since: Instant::now(), times: StageTimes::default(), estimated_memory_mib: OnceLock::new() }
    }

    pub(crate) fn begin(&self, stage: Stage) {
        self.times.begin(stage, self.now());
    }

    pub(crate) fn end(&self, stage: Stage) {
        self.times.end(stage, self.now());
    }

    pub(crate) fn begin_part(&self, part: StagePart) {
        self.times.begin_part(part, self.now());
    }

    pub(crate) fn end_part(&self, part: StagePart) {
        self.times.end_part(part, self.now());
    }

    /// The memory that the job was expected to take, bytes.
    pub(crate) fn set_estimated_memory(&self, bytes: f64) {
        self.estimated_memory_mib.get_or_init(|| (bytes / f64::from(1 << 20)).round() as u64);
    }

    fn now(&self) -> Duration {
        self.since.elapsed()
    }

    /// The statistics of `frames` drawn by `threads` threads until now.
    pub(crate) fn report(&self, frames: usize, threads: usize) -> StatsReport<'_> {
        let elapsed_s = self.now().as_secs_f64();
        StatsReport {
            times: &self.times,
            frames,
            threads,
            elapsed_s,
            cpu_s: cpu_seconds(),
            peak_memory_mib: peak_mebibytes(),
            estimated_memory_mib: self.estimated_memory_mib.get().copied(),
        }
    }
}

/// The statistics of a job that is done.
pub(crate) struct StatsReport<'a> {
    times: &'a StageTimes,
    frames: usize,
    threads: usize,
    elapsed_s: f64,
    /// CPU time of the process on all cores, s; `None` where there is no `/proc`.
    cpu_s: Option<f64>,
    /// Peak memory of the process, MiB; `None` where there is no `/proc`.
    peak_memory_mib: Option<u64>,
    /// What was expected before the job; `None` if nothing was.
    estimated_memory_mib: Option<u64>,
}

impl StatsReport<'_> {
    /// The tables of all stages and, if frames were drawn, of all phenomena.
    pub(crate) fn tables(&self) -> String {
        let Self { frames, threads, elapsed_s, .. } = *self;
        let mut table = String::from("stage     seconds   ms a frame\n");
        for (name, seconds) in self.stages().chain([("elapsed", elapsed_s)]) {
            // Writing to a string cannot fail.
            let _ = writeln!(table, "{name:8} {seconds:8.3} {:12.2}", 1e3 * seconds / frames.max(1) as f64);
        }
        let _ = write!(
            table,
            "{}, {:.1} a second, {}",
            counted(frames, "frame"),
            frames as f64 / elapsed_s,
            counted(threads, "thread")
        );
        if let Some(seconds) = self.cpu_s {
            let _ = write!(table, ", {:.0} % busy", 100.0 * seconds / (elapsed_s * threads.max(1) as f64));
        }
        if let Some(mebibytes) = self.peak_memory_mib {
            let _ = write!(table, ", peak memory {mebibytes} MiB");
        }
        if let Some(mebibytes) = self.estimated_memory_mib {
            let _ = write!(table, " (estimated: {mebibytes})");
        }
        let _ = write!(table, ", {}", VectorLevel::selected());
        table + &parts::table(self.times)
    }

    /// The same numbers for programs.
    pub(crate) fn json(&self) -> Value {
        let stages: serde_json::Map<String, Value> =
            self.stages().map(|(name, seconds)| (name.to_owned(), json!(seconds))).collect();
        json!({
            "event": "stats",
            "frames": self.frames,
            "threads": self.threads,
            "vector_level": VectorLevel::selected().name(),
            "elapsed_s": self.elapsed_s,
            "cpu_s": self.cpu_s,
            "peak_memory_mib": self.peak_memory_mib,
            "estimated_memory_mib": self.estimated_memory_mib,
            "stages_s": stages,
            "parts": parts::json(self.times),
        })
    }

    fn stages(&self) -> impl Iterator<Item = (&'static str, f64)> {
        Stage::ALL.into_iter().map(|stage| (stage.name(), self.times.seconds(stage)))
    }
}

/// Time of all threads of this process on a core, s; `None` where there is no `/proc`.
pub(crate) fn cpu_seconds() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is a name in parentheses. User and system time are the 14th and 15th, in hundredths of a second.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let (user, system) = (fields.get(14 - 3)?.parse::<f64>().ok()?, fields.get(15 - 3)?.parse::<f64>().ok()?);
    Some((user + system) / 100.0)
}

fn peak_mebibytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? / 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_names_every_stage() {
        let stats = Stats::new();
        let table = stats.report(3, 2).tables();
        assert!(Stage::ALL.iter().all(|stage| table.contains(stage.name())), "{table}");
        assert!(table.contains("3 frames") && table.contains("2 threads"), "{table}");
        let table = stats.report(1, 1).tables();
        assert!(table.contains("1 frame,") && table.contains("1 thread") && !table.contains("1 threads"), "{table}");
    }

    #[test]
    fn the_event_has_the_seconds_of_every_stage() {
        let event = Stats::new().report(3, 2).json();
        assert_eq!((&event["event"], &event["frames"], &event["threads"]), (&json!("stats"), &json!(3), &json!(2)));
        assert!(Stage::ALL.iter().all(|stage| event["stages_s"][stage.name()] == json!(0.0)), "{event}");
    }
}
