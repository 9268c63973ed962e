//! SIGINT and SIGTERM: the first asks the work to stop, and ends the program if that takes too long; the second ends it at once.
//!
//! Work that draws looks at [`came`] every strip of a picture and every step of a simulation. Reading, parsing, checking and writing
//! do not, and a step may be long: what has not stopped by itself within [`PATIENCE`] is ended, without what it was writing.

use std::{
    io,
    sync::{
        Arc, LazyLock, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
        mpsc,
    },
    thread,
    time::Duration,
};

use bansho::media::files::temporary_files;
use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag, low_level,
};

/// How long work may take to stop by itself after the first signal.
const PATIENCE: Duration = Duration::from_millis(600);
/// How long telling and removing may take before the program is ended regardless: a terminal or a disk may not answer.
const LAST_WORDS: Duration = Duration::from_millis(200);
/// How often a signal is looked for.
const TICK: Duration = Duration::from_millis(20);

/// Number of the signal that came; 0 before.
static SIGNAL: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);

type Tell = Box<dyn Fn() + Send>;

/// What tells the user that the program was ended; nothing while there is no work that could stop by itself.
static TELL: Mutex<Option<Tell>> = Mutex::new(None);

/// Begins to listen, for the whole program. One that is ended by signal `n` has exit code `128 + n`.
pub(crate) fn listen() -> io::Result<()> {
    let came_before = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // The order matters: the shutdown looks at the flag before this signal sets it.
        flag::register_conditional_shutdown(signal, 128 + signal, came_before.clone())?;
        flag::register(signal, came_before.clone())?;
        flag::register_usize(signal, SIGNAL.clone(), signal as usize)?;
    }
    thread::Builder::new().name("signals".into()).spawn(watch).map(drop)
}

/// From now on work may stop by itself; `tell` says that it did not, and was ended.
pub(crate) fn be_patient(tell: impl Fn() + Send + 'static) {
    *TELL.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(tell));
}

/// Waits for a signal, then for the work, and ends the program.
fn watch() {
    while !came() {
        thread::sleep(TICK);
    }
    let tell = TELL.lock().unwrap_or_else(PoisonError::into_inner).take();
    if tell.is_some() {
        thread::sleep(PATIENCE);
    }
    let (done, wait) = mpsc::channel();
    // Both may block: on a pipe that nobody reads, on a disk that does not answer.
    let last_words = move || {
        temporary_files::abandon_all();
        tell.iter().for_each(|tell| tell());
        // Nobody waits any longer where this fails.
        let _ = done.send(());
    };
    if thread::Builder::new().spawn(last_words).is_ok() {
        let _ = wait.recv_timeout(LAST_WORDS);
    }
    low_level::exit(i32::from(exit_code()));
}

/// Whether a signal came.
pub(crate) fn came() -> bool {
    SIGNAL.load(Ordering::Relaxed) != 0
}

/// The exit code for the signal that came.
pub(crate) fn exit_code() -> u8 {
    match SIGNAL.load(Ordering::Relaxed) {
        0 => 128 + SIGINT as u8,
        signal => 128 + signal as u8,
    }
}
