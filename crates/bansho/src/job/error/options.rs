//! Options that are invalid, or contradict each other or the scene.

use std::path::PathBuf;

use bansho_base::host::plural::counted;

/// Channels in addition to those of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ChannelKind {
    /// One picture of each phenomenon.
    #[error("layers")]
    Layers,
    /// Temperature, motion and other measured quantities.
    #[error("AOVs")]
    Aovs,
}

/// Sheets of many frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SheetKind {
    /// Thumbnails in the order of the frames.
    Contact,
    /// The tiles of a flipbook.
    Flipbook,
}

/// Why the options of a job are refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionError {
    /// Layers or AOVs in a format that has no channels for them.
    #[error("{path}: this format has no channels for {channels}; allowed: .exr", path = .path.display())]
    ChannelsUnsupported {
        /// Which channels.
        channels: ChannelKind,
        /// The output.
        path: PathBuf,
    },
    /// Metadata of a video or a sheet, which contains many frames.
    #[error(
        "metadata is written beside the picture of each frame, and {path} contains many frames; allowed: .png or .exr with one file per frame",
        path = .path.display()
    )]
    MetadataUnsupported {
        /// The output.
        path: PathBuf,
    },
    /// The pictures need more memory than there is.
    #[error(
        "{} x {} pixels{} would take {required_gib:.1} GiB; allowed: up to {} x {}",
        .size[0], .size[1], with_channels(*.channels), .max_size[0], .max_size[1]
    )]
    OutOfMemory {
        /// Width and height that would be drawn.
        size: [usize; 2],
        /// Channels of layers and AOVs in addition to the picture.
        channels: usize,
        /// Memory that the job would need, GiB.
        required_gib: f64,
        /// Largest width and height in the same proportions for which there is enough memory.
        max_size: [usize; 2],
    },
    /// More frames at once than there is memory for.
    #[error("{count} frames in flight would take {required_gib:.1} GiB; allowed: auto, or 1 to {max}")]
    FramesInFlight {
        /// How many were requested.
        count: usize,
        /// Memory that the job would need, GiB.
        required_gib: f64,
        /// How many there is memory for.
        max: usize,
    },
    /// An output is one of the files that the scene is read from.
    #[error("{path}: is a file that the scene is read from; allowed: any other name", path = .path.display())]
    OutputIsInput {
        /// The output.
        path: PathBuf,
    },
    /// An output exists and was not made by Bansho.
    #[error(
        "{path}{} not made by Bansho; allowed: another name",
        and_others(*.others), path = .path.display()
    )]
    NotMadeByBansho {
        /// The first such file.
        path: PathBuf,
        /// How many others there are.
        others: usize,
    },
    /// The format cannot hold a sheet of tiles.
    #[error("{path}: a contact sheet or flipbook needs a still picture format; allowed: {allowed}", path = .path.display())]
    SheetFormat {
        /// The output.
        path: PathBuf,
        /// Allowed extensions.
        allowed: &'static str,
    },
    /// A sheet without tiles, or with too many.
    #[error("a sheet of {tiles} tiles; allowed: 1 to {max}")]
    TileCount {
        /// Which sheet.
        sheet: SheetKind,
        /// Requested number of tiles.
        tiles: usize,
        /// Maximum number of tiles.
        max: usize,
    },
    /// A sheet with more tiles than there are frames in the list.
    #[error(
        "a sheet of {tiles} tiles for {frames} frames; allowed: 1 to {frames} tiles, or a single start frame, from which consecutive frames are taken"
    )]
    TooFewFrames {
        /// Requested number of tiles.
        tiles: usize,
        /// Number of frames in the list.
        frames: usize,
    },
    /// A sheet larger than pictures may be.
    #[error(
        "the sheet would have {width} x {height} pixels; allowed: up to {max} on a side, so choose smaller or fewer tiles"
    )]
    SheetSize {
        /// Which sheet.
        sheet: SheetKind,
        /// Its width.
        width: usize,
        /// Its height.
        height: usize,
        /// Largest side.
        max: usize,
    },
    /// Encoded alpha for a view that does not encode.
    #[error("the view `raw` applies no encoding, so its alpha is linear; allowed: linear, or another view")]
    RawAlpha,
    /// Linear light in a format that only has colors for display.
    #[error(
        "the view `raw` is linear light in ACEScg, which {path} cannot record; allowed: .exr, .png or .apng, or another view",
        path = .path.display()
    )]
    RawFormat {
        /// The output.
        path: PathBuf,
    },
    /// The list of frames is empty.
    #[error("no frame is selected; allowed: at least one")]
    NoFrames,
    /// A simulation of a scene without particles.
    #[error("this scene has no particles to export; allowed: a scene with flame_particles, aurora or rain")]
    NoParticles,
    /// An interval of zero frames between snapshots.
    #[error("snapshots every {0} frames; allowed: 1 or more")]
    SnapshotInterval(u64),
    /// A flipbook's loop is too short or too long.
    #[error("a flipbook loop of {0} s; allowed: 0.01 to 3600 s")]
    LoopLength(f64),
}

fn and_others(others: usize) -> String {
    match others {
        0 => ": already exists and was".to_owned(),
        _ => format!(" and {}: already exist and were", counted(others, "other file")),
    }
}

fn with_channels(channels: usize) -> String {
    if channels == 0 { String::new() } else { format!(" with {}", counted(channels, "more channel")) }
}
