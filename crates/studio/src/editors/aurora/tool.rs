//! The tools of the aurora editor.

/// What a drag or a click does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum DrawTool {
    #[default]
    Draw,
    Move,
    Smooth,
    Erase,
    Split,
    Merge,
    Link,
    Brightness,
    Energy,
}

impl DrawTool {
    /// All, in the order of the tool bar.
    pub(super) const ALL: [Self; 9] = [
        Self::Draw,
        Self::Move,
        Self::Smooth,
        Self::Erase,
        Self::Split,
        Self::Merge,
        Self::Link,
        Self::Brightness,
        Self::Energy,
    ];

    /// Its name and what it does.
    pub(super) fn name_and_help(self) -> (&'static str, &'static str) {
        match self {
            Self::Draw => ("Draw", "Drag on the right to draw the yellow sheet; click a sheet to draw that one next"),
            Self::Move => ("Move", "Drag points of the sheets on the right"),
            Self::Smooth => ("Smooth", "Brush over a sheet on the right to smooth it"),
            Self::Erase => (
                "Erase",
                "Brush away points of the sheets on the right; a sheet without two points is removed from all shapes",
            ),
            Self::Split => ("Split", "Click a sheet of the source where it shall split in the transition"),
            Self::Merge => ("Merge", "Click two ends of the source that shall merge in the transition"),
            Self::Link => (
                "Link",
                "Drag from a sheet of the source to the sheet on the right that it shall become, or on the right one point along \
                 its sheet to where it shall arrive; click a linked point to unlink it",
            ),
            Self::Brightness => {
                ("Brightness", "Brush along a sheet on the right to brighten it; with Shift to darken it")
            }
            Self::Energy => (
                "Ray energy",
                "Brush along a sheet on the right for more energy, which reaches lower; with Shift for less",
            ),
        }
    }
}
