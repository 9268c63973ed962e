//! Which flags the library's errors and notes are about: it speaks of what was asked for, only the program knows by which flags.

use std::{error::Error, io};

use bansho::{
    SceneError,
    base::{
        host::assets::{AssetError, AssetProblem},
        parameters::{Problem, ProblemKind},
    },
    job::{Channels, Conflict, JobError, ListKind, Note, SheetKind, StreaksError},
    media::{MediaError, assets::limits::TEXT_BYTES, files::input::InputError},
};

/// An error as the user of the program reads it.
pub(crate) fn error(error: &JobError) -> String {
    match error {
        JobError::Unreadable { path, source: InputError::Io(source), near: None }
            if source.kind() == io::ErrorKind::NotFound =>
        {
            format!("{error}; `bansho new {}` writes a new scene", path.display())
        }
        JobError::Conflict(Conflict::Unmarked { .. }) | JobError::Media(MediaError::NotMadeByBansho { .. }) => {
            format!("{error}, or --overwrite to replace what is there")
        }
        JobError::FramesLost { .. } => format!("{error}; --frames asks for them again"),
        JobError::Cancelled => format!("{error}, and --resume goes on from there"),
        JobError::ParticlesCancelled => format!("{error}, and --frames asks for the others"),
        _ => after(of_error(error), &error.to_string()),
    }
}

/// What a flag could do about the faults of a scene.
pub(crate) fn for_scene(error: &SceneError) -> Option<&'static str> {
    let needs_memory = |problem: &Problem| match asset_problem(&problem.kind) {
        Some(AssetProblem::Memory { .. }) => true,
        // Texts have a limit of their own.
        Some(AssetProblem::FileSize { limit, .. }) => *limit > TEXT_BYTES,
        _ => false,
    };
    let hint = "--max-asset-memory allows the files of a scene to take more";
    error.problems.iter().any(needs_memory).then_some(hint)
}

/// What is wrong with a file, where that is the fault.
fn asset_problem(kind: &ProblemKind) -> Option<&AssetProblem> {
    let mut error: Option<&(dyn Error + 'static)> = Some(kind);
    while let Some(found) = error {
        if let Some(AssetError { problem, .. }) = found.downcast_ref() {
            return Some(problem);
        }
        error = found.source();
    }
    None
}

/// A note as the user of the program reads it.
pub(crate) fn note(note: &Note) -> String {
    after(of_note(note), &note.to_string())
}

/// `message`, headed by the flag that it is about.
fn after(flag: Option<&str>, message: &str) -> String {
    flag.map_or_else(|| message.to_owned(), |flag| format!("{flag}: {message}"))
}

fn of_error(error: &JobError) -> Option<&'static str> {
    match error {
        JobError::Edit { .. } => Some("--set"),
        JobError::Conflict(Conflict::NoChannels { what: Channels::Layers, .. }) => Some("--layers"),
        JobError::Conflict(Conflict::NoChannels { what: Channels::Aovs, .. }) => Some("--aovs"),
        JobError::Conflict(Conflict::NoFigures { .. }) => Some("--metadata"),
        JobError::Conflict(Conflict::RawAlpha) => Some("--alpha"),
        JobError::Conflict(Conflict::FewFrames { .. }) => Some("--contact-sheet"),
        JobError::Conflict(Conflict::Tiles { of, .. } | Conflict::SheetSize { of, .. }) => Some(match of {
            SheetKind::Contact => "--contact-sheet",
            SheetKind::Flipbook => "--grid",
        }),
        JobError::Conflict(Conflict::Memory { channels: 0, .. }) => Some("--size"),
        JobError::Streaks(fault) => of_streaks(fault),
        _ => None,
    }
}

fn of_streaks(fault: &StreaksError) -> Option<&'static str> {
    Some(match fault {
        StreaksError::Empty(list) | StreaksError::Value { list, .. } | StreaksError::Order { list, .. } => match list {
            ListKind::Rates => "--rates",
            ListKind::Diameters => "--diameters",
        },
        StreaksError::Exposure(_) => "--exposure-time",
        StreaksError::Size(_) => "--size",
        StreaksError::Edge(_) | StreaksError::Drops { .. } => "--cube-size",
        StreaksError::Variants(_) => "--variants",
        StreaksError::Light => "--light-direction",
        StreaksError::Velocity(_) => "--terminal-velocity",
        _ => return None,
    })
}

fn of_note(note: &Note) -> Option<&'static str> {
    Some(match note {
        Note::BitsUnused { .. } => "--bits",
        Note::TransparentUnused => "--transparent",
        Note::AlphaUnused => "--alpha",
        Note::ViewUnused => "--view",
        Note::ResumeUnused { .. } | Note::ResumeSheet => "--resume",
        Note::SnapshotsUnused => "--snapshots",
        _ => return None,
    })
}
