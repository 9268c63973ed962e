//! Adds the names of command-line options to messages of the library, which does not know them.

use std::{error::Error, io};

use crate::output::shell_word;
use bansho::{
    SceneError,
    base::{
        host::assets::{AssetError, AssetProblem},
        parameters::{Problem, ProblemKind},
    },
    job::{ChannelKind, JobError, OptionError, SheetKind, StreakList, StreaksError, Warning},
    media::{MediaError, files::input::InputError, limits::TEXT_BYTES},
};

/// The message of an error.
pub(crate) fn error_message(error: &JobError) -> String {
    match error {
        JobError::Frame { number, source } => format!("frame {number}: {}", error_message(source)),
        JobError::Unreadable { path, source: InputError::Io(source), suggestion: None }
            if source.kind() == io::ErrorKind::NotFound =>
        {
            format!("{error}; `bansho new {}` writes a new scene", shell_word(path))
        }
        JobError::Option(OptionError::NotMadeByBansho { .. }) | JobError::Media(MediaError::NotMadeByBansho { .. }) => {
            format!("{error}, or --overwrite to replace it")
        }
        JobError::FramesLost { .. } => format!("{error}; --frames draws them again"),
        JobError::Cancelled => format!("{error}, and --resume continues from there"),
        JobError::ParticlesCancelled => format!("{error}, and --frames selects the others"),
        _ => with_flag(flag_of_error(error), &error.to_string()),
    }
}

/// A hint which option may solve the problems of a scene.
pub(crate) fn hint_for_scene(error: &SceneError) -> Option<&'static str> {
    let hint = "--max-asset-memory raises the limit for the files of a scene";
    error.problems.iter().any(needs_memory).then_some(hint)
}

/// Whether a file is refused because of the limit of `--max-asset-memory`.
fn needs_memory(problem: &Problem) -> bool {
    match asset_problem(&problem.kind) {
        Some(AssetProblem::Memory { .. }) => true,
        // Text files have a fixed limit.
        Some(AssetProblem::FileSize { limit, .. }) => *limit > TEXT_BYTES,
        _ => false,
    }
}

/// The problem with an asset, if that is the cause.
fn asset_problem(kind: &ProblemKind) -> Option<&AssetProblem> {
    let mut error: Option<&(dyn Error + 'static)> = Some(kind);
    while let Some(cause) = error {
        if let Some(AssetError { problem, .. }) = cause.downcast_ref() {
            return Some(problem);
        }
        error = cause.source();
    }
    None
}

/// The message of a warning.
pub(crate) fn warning_message(warning: &Warning) -> String {
    with_flag(flag_of_warning(warning), &warning.to_string())
}

/// `message` after the option that it is about, if there is one.
fn with_flag(flag: Option<&str>, message: &str) -> String {
    flag.map_or_else(|| message.to_owned(), |flag| format!("{flag}: {message}"))
}

fn flag_of_error(error: &JobError) -> Option<&'static str> {
    match error {
        JobError::Edit { .. } => Some("--set"),
        JobError::Option(OptionError::ChannelsUnsupported { channels: ChannelKind::Layers, .. }) => Some("--layers"),
        JobError::Option(OptionError::ChannelsUnsupported { channels: ChannelKind::Aovs, .. }) => Some("--aovs"),
        JobError::Option(OptionError::MetadataUnsupported { .. }) => Some("--metadata"),
        JobError::Option(OptionError::RawAlpha) => Some("--alpha"),
        JobError::Option(OptionError::RawFormat { .. }) => Some("--view"),
        JobError::Option(OptionError::TooFewFrames { .. }) => Some("--contact-sheet"),
        JobError::Option(OptionError::TileCount { sheet, .. } | OptionError::SheetSize { sheet, .. }) => {
            Some(match sheet {
                SheetKind::Contact => "--contact-sheet",
                SheetKind::Flipbook => "--grid",
            })
        }
        JobError::Option(OptionError::OutOfMemory { channels: 0, .. }) => Some("--size"),
        JobError::Option(OptionError::FramesInFlight { .. }) => Some("--frames-in-flight"),
        JobError::Streaks(error) => flag_of_streaks_error(error),
        _ => None,
    }
}

fn flag_of_streaks_error(error: &StreaksError) -> Option<&'static str> {
    Some(match error {
        StreaksError::EmptyList(list)
        | StreaksError::ValueOutOfRange { list, .. }
        | StreaksError::NotAscending { list, .. } => match list {
            StreakList::RainRates => "--rates",
            StreakList::DropDiameters => "--diameters",
        },
        StreaksError::Exposure(_) => "--exposure-time",
        StreaksError::TextureSize(_) => "--size",
        StreaksError::CubeSize(_) | StreaksError::TooManyDrops { .. } => "--cube-size",
        StreaksError::Variants(_) => "--variants",
        StreaksError::LightDirection => "--light-direction",
        StreaksError::Oscillation(_) | StreaksError::OscillationWithoutLight | StreaksError::OscillationOfLines => {
            "--oscillation"
        }
        StreaksError::Velocity(_) => "--terminal-velocity",
        _ => return None,
    })
}

fn flag_of_warning(warning: &Warning) -> Option<&'static str> {
    Some(match warning {
        Warning::BitsUnused { .. } => "--bits",
        Warning::TransparentUnused => "--transparent",
        Warning::AlphaUnused => "--alpha",
        Warning::ViewUnused => "--view",
        Warning::ResumeUnused { .. } | Warning::ResumeSheet => "--resume",
        Warning::SnapshotsUnused => "--snapshots",
        _ => return None,
    })
}
