//! Text for stdout and stderr.

use std::{
    borrow::Cow,
    io::{self, Write},
    path::Path,
};

use bansho::base::host::printable;
use serde_json::Value;

/// Writes `text` to stdout. A pipe that its reader has closed (`bansho schema | head`) is not an error.
pub(crate) fn print(text: &str) -> io::Result<()> {
    ignore_broken_pipe(write(text))
}

/// Writes `text` to stdout. A pipe that its reader has closed is an error.
pub(crate) fn print_all(text: &str) -> io::Result<()> {
    write(text).map_err(of_stdout)
}

fn write(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush())
}

/// The error with the stream that it is about.
fn of_stdout(error: io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("standard output: {error}"))
}

/// The result of writing to stdout, without the error of a pipe that its reader has closed.
pub(crate) fn ignore_broken_pipe(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result.map_err(of_stdout),
    }
}

/// A value as JSON in one line, in which no string can steer a terminal: JSON itself escapes only some of the characters that do.
pub(crate) fn json_text(value: &Value) -> String {
    let text = value.to_string();
    let shown = printable::printable(&text);
    if matches!(shown, Cow::Borrowed(_)) {
        return text;
    }
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match printable::printable(letter.encode_utf8(&mut [0; 4])) {
            Cow::Borrowed(plain) => escaped.push_str(plain),
            // All of these have four hexadecimal digits.
            Cow::Owned(_) => escaped.push_str(&format!("\\u{:04x}", u32::from(letter))),
        }
    }
    escaped
}

/// A path as one word of a command that the user can repeat in a shell. Control characters are escaped, so that a path with any cannot be repeated.
pub(crate) fn shell_word(path: &Path) -> String {
    let shown = path.display().to_string();
    // Otherwise it would be an option.
    let shown = if shown.starts_with('-') { format!("./{shown}") } else { shown };
    let word = printable::printable(&shown);
    // Letters that no shell takes for anything else.
    if !word.is_empty() && word.chars().all(|letter| letter.is_alphanumeric() || "._-/+,:@=".contains(letter)) {
        return word.into_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// Prints a message on stderr in one line, as `error: ...` or `warning: ...`. Control characters are escaped, since the message may contain file
/// names and values of scenes.
pub(crate) fn print_message(kind: &str, message: &str) {
    print_error_lines(&format!("{kind}: {}", printable::printable_excerpt(message)));
}

/// Passes on what another program said, line by line, with control characters escaped.
pub(crate) fn print_foreign_lines(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    text.trim_end().lines().for_each(|line| print_error_lines(&printable::printable_excerpt(line)));
}

/// Writes lines to stderr. A failure is ignored, since there is no other stream to report it on.
pub(crate) fn print_error_lines(lines: &str) {
    let _ = writeln!(io::stderr().lock(), "{lines}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_has_no_characters_that_steer_a_terminal_and_says_the_same() {
        let value = serde_json::json!({ "na\u{202e}me": "a\u{9b}2J\u{1b}[2J\n\u{7f}火\u{2066}" });
        let text = json_text(&value);
        assert!(!text.chars().any(|letter| letter.is_control() || "\u{202e}\u{2066}".contains(letter)), "{text}");
        assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), value);
    }

    #[test]
    fn a_command_that_is_recommended_can_be_repeated() {
        for (path, word) in [
            ("fire.toml", "fire.toml"),
            ("a#b.toml", "'a#b.toml'"),
            ("#b.toml", "'#b.toml'"),
            ("my scene.toml", "'my scene.toml'"),
            ("it's.toml", r"'it'\''s.toml'"),
            ("-x.toml", "./-x.toml"),
            ("50%.toml", "'50%.toml'"),
            ("$(ls).toml", "'$(ls).toml'"),
            ("火.toml", "火.toml"),
        ] {
            assert_eq!(shell_word(Path::new(path)), word);
        }
    }
}
