//! Text for stdout and stderr.

use std::io::{self, Write};

use bansho::base::host::printable;

/// Writes `text` to stdout. A reader that has seen enough (`bansho schema | head`) is no error.
pub(crate) fn to_stdout(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    heard(stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()))
}

/// What writing to stdout came to: nobody is missed who stopped to read.
pub(crate) fn heard(written: io::Result<()>) -> io::Result<()> {
    match written {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(io::Error::new(error.kind(), format!("standard output: {error}"))),
        Ok(()) => Ok(()),
    }
}

/// Tells the user one thing in one line, as `error: ...` or `warning: ...`: names of files and values of scenes in it may hold anything.
pub(crate) fn tell(what: &str, message: &str) {
    to_stderr(&format!("{what}: {}", printable::printable_excerpt(message)));
}

/// Writes lines to stderr; where that fails, nobody is left to be told.
pub(crate) fn to_stderr(lines: &str) {
    let _ = writeln!(io::stderr().lock(), "{lines}");
}
