//! `--stats`: the time spent in each stage, and in each phenomenon. With one frame at a time it is elapsed time, so that the stages add up to the time that a
//! user waits. With several frames in flight it is processor time: stages overlap then, and a thread that waits for its stage works on others meanwhile, whose
//! time the elapsed time of that stage would include.

mod parts;

use std::{
    fmt::Write,
    fs,
    sync::{
        OnceLock,
        atomic::{AtomicUsize, Ordering},
    },
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
    /// By the clock.
    times: StageTimes,
    /// Processor time of the threads that report the stages.
    processor_times: StageTimes,
    frames_in_flight: AtomicUsize,
    estimated_memory_mib: OnceLock<u64>,
}

impl Stats {
    pub(crate) fn new() -> Self {
        Self {
            since: Instant::now(),
            times: StageTimes::default(),
            processor_times: StageTimes::default(),
            frames_in_flight: AtomicUsize::new(1),
            estimated_memory_mib: OnceLock::new(),
        }
    }

    pub(crate) fn begin(&self, stage: Stage) {
        self.times.begin(stage, self.now());
        self.processor_times.begin(stage, self.thread_time());
    }

    pub(crate) fn end(&self, stage: Stage) {
        self.times.end(stage, self.now());
        self.processor_times.end(stage, self.thread_time());
    }

    pub(crate) fn begin_part(&self, part: StagePart) {
        self.times.begin_part(part, self.now());
        self.processor_times.begin_part(part, self.thread_time());
    }

    pub(crate) fn end_part(&self, part: StagePart) {
        self.times.end_part(part, self.now());
        self.processor_times.end_part(part, self.thread_time());
    }

    /// How many frames the job draws at once.
    pub(crate) fn set_frames_in_flight(&self, count: usize) {
        self.frames_in_flight.store(count, Ordering::Relaxed);
    }

    /// The memory that the job was expected to take, bytes.
    pub(crate) fn set_estimated_memory(&self, bytes: f64) {
        self.estimated_memory_mib.get_or_init(|| (bytes / f64::from(1 << 20)).round() as u64);
    }

    fn now(&self) -> Duration {
        self.since.elapsed()
    }

    /// Processor time of this thread; elapsed time on systems that do not state it.
    fn thread_time(&self) -> Duration {
        #[cfg(unix)]
        {
            let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
            Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
        }
        #[cfg(not(unix))]
        self.now()
    }

    /// The statistics of `frames` drawn by `threads` threads until now.
    pub(crate) fn report(&self, frames: usize, threads: usize) -> StatsReport<'_> {
        let elapsed_s = self.now().as_secs_f64();
        StatsReport {
            times: &self.times,
            processor_times: &self.processor_times,
            frames_in_flight: self.frames_in_flight.load(Ordering::Relaxed).clamp(1, frames.max(1)),
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
    processor_times: &'a StageTimes,
    frames_in_flight: usize,
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
        let measured = if self.frames_overlap() { "processor time of stages" } else { "times by the clock" };
        let in_flight = counted(self.frames_in_flight, "frame");
        let mut table = format!("stage     seconds   ms a frame   ({in_flight} in flight: {measured})\n");
        for (name, seconds) in self.stages().into_iter().chain([("elapsed", elapsed_s)]) {
            // Writing to a string cannot fail.
            let _ = writeln!(table, "{name:8} {seconds:8.3} {:12.2}", 1e3 * seconds / frames.max(1) as f64);
        }
        let _ = write!(
            table,
            "{}, {:.1} a second by the clock, {}",
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
        table
            + &if self.frames_overlap() {
                parts::table_of_means(self.processor_times, frames)
            } else {
                parts::table(self.times)
            }
    }

    /// Whether stages of several frames overlap.
    fn frames_overlap(&self) -> bool {
        self.frames_in_flight > 1
    }

    /// The same numbers for programs.
    pub(crate) fn json(&self) -> Value {
        let stages: serde_json::Map<String, Value> =
            self.stages().into_iter().map(|(name, seconds)| (name.to_owned(), json!(seconds))).collect();
        // Of the threads that report the stages; parts of a stage that other threads take on are left out.
        let stages_cpu: serde_json::Map<String, Value> = Stage::ALL
            .into_iter()
            .map(|stage| (stage.name().to_owned(), json!(self.processor_times.seconds(stage))))
            .collect();
        let parts = if self.frames_overlap() {
            parts::json_of_means(self.processor_times, self.frames)
        } else {
            parts::json(self.times)
        };
        json!({
            "event": "stats",
            "frames": self.frames,
            "frames_in_flight": self.frames_in_flight,
            "threads": self.threads,
            "vector_level": VectorLevel::selected().name(),
            "elapsed_s": self.elapsed_s,
            "cpu_s": self.cpu_s,
            "peak_memory_mib": self.peak_memory_mib,
            "estimated_memory_mib": self.estimated_memory_mib,
            "stages_s": stages,
            "stages_cpu_s": stages_cpu,
            "parts": parts,
        })
    }

    /// Seconds of all stages. If frames overlap, `other` is the processor time that no thread reports to a stage: parts of a stage that other threads take on, and
    /// what is between the stages.
    fn stages(&self) -> Vec<(&'static str, f64)> {
        let times = if self.frames_overlap() { self.processor_times } else { self.times };
        let mut stages: Vec<(&str, f64)> =
            Stage::ALL.into_iter().map(|stage| (stage.name(), times.seconds(stage))).collect();
        if self.frames_overlap()
            && let Some(process) = self.cpu_s
        {
            let reported: f64 = stages.iter().map(|(_, seconds)| seconds).sum();
            stages.push(("other", (process - reported).max(0.0)));
        }
        stages
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

    /// Busy until the thread has worked for some time.
    fn work(stats: &Stats, milliseconds: u64) {
        let until = stats.thread_time() + Duration::from_millis(milliseconds);
        while stats.thread_time() < until {
            std::hint::black_box(0);
        }
    }

    #[test]
    fn a_stage_that_waits_takes_time_by_the_clock_and_with_several_frames_in_flight_none() {
        let stats = Stats::new();
        stats.begin(Stage::Advance);
        std::thread::sleep(Duration::from_millis(300));
        stats.end(Stage::Advance);
        stats.begin(Stage::Draw);
        work(&stats, 40);
        stats.end(Stage::Draw);
        let one = stats.report(2, 2).json();
        assert_eq!(one["frames_in_flight"], json!(1));
        assert!(one["stages_s"]["advance"].as_f64().unwrap() >= 0.3 && one["stages_s"]["other"].is_null(), "{one}");
        let table = stats.report(2, 2).tables();
        assert!(table.contains("(1 frame in flight: times by the clock)"), "{table}");
        stats.set_frames_in_flight(9);
        let two = stats.report(2, 2).json();
        // Two frames are never more than two in flight.
        assert_eq!(two["frames_in_flight"], json!(2));
        if cfg!(unix) {
            assert!(two["stages_s"]["advance"].as_f64().unwrap() < 0.1, "{two}");
        }
        assert!(two["stages_s"]["draw"].as_f64().unwrap() >= 0.04, "{two}");
        let table = stats.report(2, 2).tables();
        assert!(table.contains("(2 frames in flight: processor time of stages)"), "{table}");
        assert!(table.contains("a second by the clock, 2 threads"), "{table}");
    }

    #[test]
    fn the_event_has_the_seconds_of_every_stage() {
        let event = Stats::new().report(3, 2).json();
        assert_eq!((&event["event"], &event["frames"], &event["threads"]), (&json!("stats"), &json!(3), &json!(2)));
        assert!(Stage::ALL.iter().all(|stage| event["stages_s"][stage.name()] == json!(0.0)), "{event}");
    }
}
