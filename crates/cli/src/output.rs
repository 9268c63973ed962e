//! Text for stdout and stderr.

use std::io::{self, Write};

use bansho::base::host::printable;

/// Writes `text` to stdout. A pipe that its reader has closed (`bansho schema | head`) is not an error.
pub(crate) fn print(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    ignore_broken_pipe(stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()))
}

/// The result of writing to stdout, without the error of a pipe that its reader has closed.
pub(crate) fn ignore_broken_pipe(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        Err(error) => Err(io::Error::new(error.kind(), format!("standard output: {error}"))),
        Ok(()) => Ok(()),
    }
}

/// Prints a message on stderr in one line, as `error: ...` or `warning: ...`. Control characters are escaped, since the message may contain file
/// names and values of scenes.
pub(crate) fn print_message(kind: &str, message: &str) {
    print_error_lines(&format!("{kind}: {}", printable::printable_excerpt(message)));
}

/// Writes lines to stderr. A failure is ignored, since there is no other stream to report it on.
pub(crate) fn print_error_lines(lines: &str) {
    let _ = writeln!(io::stderr().lock(), "{lines}");
}
