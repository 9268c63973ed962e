//! `--stats`: the time spent in each stage.

use std::{
    collections::HashMap,
    fmt::Write,
    fs,
    sync::{Mutex, PoisonError},
    thread::{self, ThreadId},
    time::{Duration, Instant},
};

use bansho::{Stage, base::host::plural::counted};

/// Measures the time of each stage. A stage within another one on the same thread pauses the clock of the outer one, so that no time is
/// counted twice.
pub(crate) struct Stats {
    since: Instant,
    clocks: Mutex<Clocks>,
}

#[derive(Default)]
struct Clocks {
    open: HashMap<ThreadId, Vec<(Stage, Instant)>>,
    totals: HashMap<Stage, Duration>,
}

impl Stats {
    pub(crate) fn new() -> Self {
        Self { since: Instant::now(), clocks: Mutex::default() }
    }

    pub(crate) fn begin(&self, stage: Stage) {
        self.with_clocks(|clocks, now| {
            let open = clocks.open.entry(thread::current().id()).or_default();
            if let Some((outer, since)) = open.last_mut() {
                *clocks.totals.entry(*outer).or_default() += now - *since;
            }
            open.push((stage, now));
        });
    }

    pub(crate) fn end(&self, stage: Stage) {
        self.with_clocks(|clocks, now| {
            let open = clocks.open.entry(thread::current().id()).or_default();
            if let Some((_, since)) = open.pop_if(|(begun, _)| *begun == stage) {
                *clocks.totals.entry(stage).or_default() += now - since;
            }
            if let Some((_, since)) = open.last_mut() {
                *since = now;
            }
        });
    }

    fn with_clocks(&self, change: impl FnOnce(&mut Clocks, Instant)) {
        // The sums are valid even if a thread panicked.
        change(&mut self.clocks.lock().unwrap_or_else(PoisonError::into_inner), Instant::now());
    }

    /// The table of all stages, for `frames` drawn by `threads` threads.
    pub(crate) fn table(&self, frames: usize, threads: usize) -> String {
        let wall = self.since.elapsed().as_secs_f64();
        let clocks = self.clocks.lock().unwrap_or_else(PoisonError::into_inner);
        let mut table = String::from("stage     seconds   ms a frame\n");
        for stage in Stage::ALL {
            let seconds = clocks.totals.get(&stage).copied().unwrap_or_default().as_secs_f64();
            // Writing to a string cannot fail.
            let _ = writeln!(table, "{:8} {seconds:8.3} {:12.2}", stage.name(), 1e3 * seconds / frames.max(1) as f64);
        }
        let _ = writeln!(table, "{:8} {wall:8.3} {:12.2}", "elapsed", 1e3 * wall / frames.max(1) as f64);
        let _ = write!(
            table,
            "{}, {:.1} a second, {}",
            counted(frames, "frame"),
            frames as f64 / wall,
            counted(threads, "thread")
        );
        if let Some(seconds) = cpu_seconds() {
            let _ = write!(table, ", {:.0} % busy", 100.0 * seconds / (wall * threads.max(1) as f64));
        }
        if let Some(mebibytes) = peak_mebibytes() {
            let _ = write!(table, ", peak memory {mebibytes} MiB");
        }
        table
    }
}

/// CPU time of this process on all cores, s; `None` where there is no `/proc`.
fn cpu_seconds() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is a name in parentheses. User and system time are the 14th and 15th, in hundredths of a second.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |field: usize| fields.get(field - 3)?.parse::<f64>().ok();
    Some((ticks(14)? + ticks(15)?) / 100.0)
}

/// Peak memory of this process, MiB; `None` where there is no `/proc`.
fn peak_mebibytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? / 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_inside_another_is_not_counted_twice() {
        let stats = Stats::new();
        let begun = Instant::now();
        stats.begin(Stage::Draw);
        stats.begin(Stage::Write);
        thread::sleep(Duration::from_millis(30));
        stats.end(Stage::Write);
        stats.end(Stage::Draw);
        let elapsed = begun.elapsed();
        let clocks = stats.clocks.lock().unwrap();
        let [draw, write] = [Stage::Draw, Stage::Write].map(|stage| clocks.totals[&stage]);
        assert!(write >= Duration::from_millis(30));
        assert!(draw + write <= elapsed, "{draw:?} {write:?} {elapsed:?}");
    }

    #[test]
    fn the_table_names_every_stage() {
        let table = Stats::new().table(3, 2);
        assert!(Stage::ALL.iter().all(|stage| table.contains(stage.name())), "{table}");
        assert!(table.contains("3 frames") && table.contains("2 threads"), "{table}");
        let table = Stats::new().table(1, 1);
        assert!(table.contains("1 frame,") && table.contains("1 thread") && !table.contains("1 threads"), "{table}");
    }
}
