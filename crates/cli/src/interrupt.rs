//! SIGINT and SIGTERM. The first signal cancels the job, and ends the program if that takes too long; the second ends it immediately.
//!
//! Jobs check [`is_requested`] for every strip of a picture and every step of a simulation. Reading, parsing, checking and writing do not, and
//! a step may be long: if the job has not stopped after [`GRACE_PERIOD`], the program is ended, and unfinished files are removed.

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

use bansho::media::files::atomic;
use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag, low_level,
};

/// Time for a job to stop after the first signal.
const GRACE_PERIOD: Duration = Duration::from_millis(600);
/// Time for removing files and printing the message, since a terminal or a disk may not respond.
const CLEANUP_TIMEOUT: Duration = Duration::from_millis(200);
/// Interval at which the flag is polled.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Number of the received signal; 0 before.
static SIGNAL: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);

type PrintMessage = Box<dyn Fn() + Send>;

/// Prints the message of a forced exit. `None` while there is no job, so that the program is ended without a grace period.
static FORCED_EXIT_MESSAGE: Mutex<Option<PrintMessage>> = Mutex::new(None);

/// Installs the signal handlers. If the program is ended by signal `n`, its exit code is `128 + n`.
pub(crate) fn install_handlers() -> io::Result<()> {
    let was_signaled = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // The order matters: the shutdown must check the flag before this signal sets it.
        flag::register_conditional_shutdown(signal, 128 + signal, was_signaled.clone())?;
        flag::register(signal, was_signaled.clone())?;
        flag::register_usize(signal, SIGNAL.clone(), signal as usize)?;
    }
    // A file that would be larger than allowed (`ulimit -f`) is an error of writing it rather than the end of the program.
    #[cfg(unix)]
    flag::register(signal_hook::consts::SIGXFSZ, Arc::default())?;
    thread::Builder::new().name("signals".into()).spawn(watch).map(drop)
}

/// From now on, a job has a grace period to stop after a signal. `print_message` is called if it does not stop in time.
pub(crate) fn set_grace_period(print_message: impl Fn() + Send + 'static) {
    *FORCED_EXIT_MESSAGE.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(print_message));
}

/// Waits for a signal, then for the job, and ends the program.
fn watch() {
    while !is_requested() {
        thread::sleep(POLL_INTERVAL);
    }
    let print_message = FORCED_EXIT_MESSAGE.lock().unwrap_or_else(PoisonError::into_inner).take();
    if print_message.is_some() {
        thread::sleep(GRACE_PERIOD);
    }
    let (done, wait) = mpsc::channel();
    // On another thread: both may block, on a disk that does not respond, on a pipe that nobody reads.
    let cleanup = thread::Builder::new().spawn(move || {
        atomic::abandon_all();
        print_message.iter().for_each(|print_message| print_message());
        // Fails only after the timeout.
        let _ = done.send(());
    });
    if cleanup.is_ok() {
        let _ = wait.recv_timeout(CLEANUP_TIMEOUT);
    }
    low_level::exit(i32::from(exit_code()));
}

/// Whether a signal requested the program to stop.
pub(crate) fn is_requested() -> bool {
    SIGNAL.load(Ordering::Relaxed) != 0
}

/// The exit code for the received signal.
pub(crate) fn exit_code() -> u8 {
    match SIGNAL.load(Ordering::Relaxed) {
        0 => 128 + SIGINT as u8,
        signal => 128 + signal as u8,
    }
}
