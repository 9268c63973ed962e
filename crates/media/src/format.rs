//! The formats of output files. A new format begins here; the compiler then points to every decision that it needs.

/// Defines [`OutputKind`], with [`OutputKind::ALL`] and the extensions from one list.
macro_rules! output_kinds {
    ($($(#[doc = $doc:literal])* $Kind:ident = $extension:literal,)*) => {
        /// Output formats, by extension.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum OutputKind {
            $($(#[doc = $doc])* $Kind,)*
        }

        impl OutputKind {
            /// Every kind.
            pub const ALL: &'static [Self] = &[$(Self::$Kind),*];

            /// Its extension, without the dot.
            pub fn extension(self) -> &'static str {
                match self { $(Self::$Kind => $extension,)* }
            }
        }
    };
}

output_kinds! {
    /// One PNG for each frame: display pixels.
    Png = "png",
    /// One OpenEXR for each frame: scene-linear.
    Exr = "exr",
    /// Animated PNG.
    Apng = "apng",
    /// Animated GIF.
    Gif = "gif",
    /// H.264 in MP4, by ffmpeg.
    Mp4 = "mp4",
    /// ProRes 4444 in QuickTime, by ffmpeg.
    Mov = "mov",
    /// VP9 or AV1 in WebM, by ffmpeg.
    Webm = "webm",
}

impl OutputKind {
    /// The format with this extension, case-insensitive.
    pub fn from_extension(extension: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.extension().eq_ignore_ascii_case(extension))
    }

    /// Whether every frame is a file of its own.
    pub fn is_sequence(self) -> bool {
        match self {
            Self::Png | Self::Exr => true,
            Self::Apng | Self::Gif | Self::Mp4 | Self::Mov | Self::Webm => false,
        }
    }

    /// Whether it holds scene-linear pixels, and with them depth, layers, AOVs and overscan.
    pub fn is_scene_linear(self) -> bool {
        match self {
            Self::Exr => true,
            Self::Png | Self::Apng | Self::Gif | Self::Mp4 | Self::Mov | Self::Webm => false,
        }
    }

    /// Whether it has straight alpha by default.
    pub fn has_straight_alpha(self) -> bool {
        match self {
            Self::Png | Self::Apng | Self::Mov | Self::Webm => true,
            // EXR is premultiplied; a GIF is composited over black by default.
            Self::Exr | Self::Gif | Self::Mp4 => false,
        }
    }

    /// Whether display pixels of 16 bits make a difference.
    pub fn takes_sixteen_bits(self) -> bool {
        match self {
            Self::Png | Self::Apng | Self::Mov | Self::Webm => true,
            Self::Exr | Self::Gif | Self::Mp4 => false,
        }
    }

    /// Whether a file can say that its codes are linear light in ACEScg.
    pub fn takes_linear_acescg(self) -> bool {
        match self {
            Self::Png | Self::Exr | Self::Apng => true,
            // GIF has no color information, and films name their primaries by numbers of ITU-T H.273, which has none for AP1.
            Self::Gif | Self::Mp4 | Self::Mov | Self::Webm => false,
        }
    }

    /// Whether it is made by the program `ffmpeg`.
    pub fn needs_ffmpeg(self) -> bool {
        match self {
            Self::Mp4 | Self::Mov | Self::Webm => true,
            Self::Png | Self::Exr | Self::Apng | Self::Gif => false,
        }
    }
}

/// The pixel data that a format takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PictureFormat {
    /// Scene-linear frames.
    #[error("a scene-linear frame")]
    Frame,
    /// Display pixels, with alpha unless a plate fills the picture.
    #[error("display pixels")]
    Display,
    /// Display pixels without alpha: composited over black, or over a plate. The sink composites pixels with alpha over black.
    #[error("opaque display pixels")]
    OpaqueDisplay,
}

/// The extensions of `kinds` for error messages: `.png, .exr`.
pub(crate) fn extensions<'a>(kinds: impl IntoIterator<Item = &'a OutputKind>) -> String {
    let dotted: Vec<String> = kinds.into_iter().map(|kind| format!(".{}", kind.extension())).collect();
    dotted.join(", ")
}

/// The extensions of the formats that need no `ffmpeg`, for error messages: `.png, .exr, .apng or .gif`.
pub(crate) fn extensions_without_ffmpeg() -> String {
    let list = extensions(OutputKind::ALL.iter().filter(|kind| !kind.needs_ffmpeg()));
    match list.rsplit_once(", ") {
        Some((others, last)) => format!("{others} or {last}"),
        None => list,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_extensions_read_as_text() {
        assert_eq!(extensions(OutputKind::ALL), ".png, .exr, .apng, .gif, .mp4, .mov, .webm");
        assert_eq!(extensions_without_ffmpeg(), ".png, .exr, .apng or .gif");
        assert_eq!(
            (OutputKind::from_extension("PNG"), OutputKind::from_extension("tiff")),
            (Some(OutputKind::Png), None)
        );
    }
}
