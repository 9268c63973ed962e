//! Command line arguments.

use std::{ffi::OsString, path::PathBuf};

use bansho_studio::renderer_choice::RendererChoice;

use super::USAGE;

/// The parsed arguments.
#[derive(Debug, PartialEq)]
pub(super) struct Arguments {
    pub(super) renderer: RendererChoice,
    pub(super) mode: Mode,
}

/// The mode of the program.
#[derive(Debug, PartialEq)]
pub(super) enum Mode {
    Help,
    Scene(Option<PathBuf>),
}

impl Arguments {
    /// Reads the program's arguments.
    ///
    /// # Errors
    /// The message for invalid arguments.
    pub(super) fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Self, String> {
        let mut renderer = RendererChoice::default();
        let mut rest = Vec::new();
        let mut arguments = arguments.into_iter();
        while let Some(argument) = arguments.next() {
            let text = argument.to_string_lossy();
            match text.strip_prefix("--painter") {
                Some("") => {
                    let name = arguments
                        .next()
                        .ok_or_else(|| format!("error: --painter needs one of {}", RendererChoice::NAMES))?;
                    renderer = RendererChoice::named(&name.to_string_lossy())?;
                }
                Some(value) if value.starts_with('=') => renderer = RendererChoice::named(&value[1..])?,
                _ => rest.push(argument),
            }
        }
        let mode = match rest.as_slice() {
            [] => Mode::Scene(None),
            [option] if option == "--help" => Mode::Help,
            [option, ..] if option.to_string_lossy().starts_with("--") => {
                return Err(format!("error: {} means nothing here\n{USAGE}", option.to_string_lossy()));
            }
            [scene] => Mode::Scene(Some(scene.into())),
            _ => return Err(USAGE.to_owned()),
        };
        Ok(Self { renderer, mode })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(arguments: &[&str]) -> Result<Arguments, String> {
        Arguments::parse(arguments.iter().map(OsString::from))
    }

    #[test]
    fn the_renderer_may_be_named_at_any_position() {
        let scene = Mode::Scene(Some("a.toml".into()));
        assert_eq!(parsed(&["a.toml"]), Ok(Arguments { renderer: RendererChoice::Auto, mode: scene }));
        for arguments in [["--painter", "software", "a.toml"], ["a.toml", "--painter", "software"]] {
            assert_eq!(parsed(&arguments).unwrap().renderer, RendererChoice::Software);
        }
        let help = parsed(&["--help", "--painter=gpu"]).unwrap();
        assert_eq!(help, Arguments { renderer: RendererChoice::Gpu, mode: Mode::Help });
    }

    #[test]
    fn invalid_arguments_are_one_error() {
        let expected = "error: --painter is one of auto, gpu, software, not `pencil`";
        assert_eq!(parsed(&["--painter", "pencil"]).unwrap_err(), expected);
        assert_eq!(parsed(&["--painter"]).unwrap_err(), "error: --painter needs one of auto, gpu, software");
        assert!(parsed(&["--pencil"]).unwrap_err().starts_with("error: --pencil means nothing here\n"));
        assert_eq!(parsed(&["a.toml", "b.toml"]).unwrap_err(), USAGE);
    }
}
