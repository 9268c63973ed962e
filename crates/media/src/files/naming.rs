//! Names of output files, with frame numbers: `frame.####.exr`, `frame.%04d.exr`, `film.mp4`.

use std::path::{Path, PathBuf};

use crate::format::{OutputKind, extensions};

/// Why a name cannot be used for output.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NamingError {
    /// There is no dot, or nothing after the last one.
    #[error("{path}: has no extension; allowed: {}", extensions(OutputKind::ALL), path = .path.display())]
    NoExtension {
        /// The name.
        path: PathBuf,
    },
    /// No output format has this extension.
    #[error("{path}: `.{extension}` is not supported; allowed: {}", extensions(OutputKind::ALL), path = .path.display())]
    UnknownExtension {
        /// The name.
        path: PathBuf,
        /// Its extension.
        extension: String,
    },
    /// Another extension than the only one that is possible.
    #[error("{path}: `.{extension}` is not supported here; allowed: .{allowed}", path = .path.display())]
    OtherExtension {
        /// The name.
        path: PathBuf,
        /// Its extension.
        extension: String,
        /// The possible one.
        allowed: &'static str,
    },
    /// More than one placeholder for the frame number.
    #[error("{path}: more than one placeholder for the frame number; use one run of # or one %04d", path = .path.display())]
    TwoPlaceholders {
        /// The name.
        path: PathBuf,
    },
    /// A percent sign that begins no placeholder.
    #[error("{path}: `%` must begin %d or %04d; write %% for a literal percent sign, %# for a literal #", path = .path.display())]
    BadPercent {
        /// The name.
        path: PathBuf,
    },
    /// A placeholder with too many digits.
    #[error("{path}: a frame number of {digits} digits; allowed: up to {MAX_DIGITS}", path = .path.display())]
    ManyDigits {
        /// The name.
        path: PathBuf,
        /// Its number of digits.
        digits: usize,
    },
    /// A placeholder for the frame number in the name of a film.
    #[error("{path}: a .{extension} file contains all frames, so its name must not have a frame number", path = .path.display())]
    NumberedFilm {
        /// The name.
        path: PathBuf,
        /// Its extension.
        extension: &'static str,
    },
    /// A name that is not Unicode.
    #[error("{path}: is not a Unicode name", path = .path.display())]
    NotUnicode {
        /// The name.
        path: PathBuf,
    },
}

/// Largest width of a placeholder.
const MAX_DIGITS: usize = 20;

/// A file name with at most one placeholder for the frame number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FrameTemplate {
    prefix: String,
    /// Smallest number of digits; `None` without a placeholder.
    digits: Option<usize>,
    suffix: String,
}

/// Why a name with placeholders cannot be parsed.
pub(crate) enum TemplateError {
    TwoPlaceholders,
    BadPercent,
    ManyDigits(usize),
}

impl FrameTemplate {
    /// Parses runs of `#` and, with `printf`, `%d`, `%04d`, `%%` and `%#` for a literal `#`; a single `#` before a digit is then literal, too, since
    /// `shot#12` is the twelfth shot rather than `shot112`.
    pub(crate) fn parse(name: &str, printf: bool) -> Result<Self, TemplateError> {
        let mut template = Self { prefix: String::new(), digits: None, suffix: String::new() };
        let mut rest = name;
        while let Some(first) = rest.chars().next() {
            let (placeholder, length) = match first {
                '#' if printf && is_literal_hash(rest) => {
                    template.push_literal('#');
                    (None, 1)
                }
                '#' => {
                    let run = rest.len() - rest.trim_start_matches('#').len();
                    if run > MAX_DIGITS {
                        return Err(TemplateError::ManyDigits(run));
                    }
                    (Some(run), run)
                }
                '%' if printf && rest.starts_with("%%") => {
                    template.push_literal('%');
                    (None, 2)
                }
                '%' if printf && rest.starts_with("%#") => {
                    template.push_literal('#');
                    (None, 2)
                }
                '%' if printf => {
                    let (digits, length) = printf_digits(rest).ok_or(TemplateError::BadPercent)?;
                    (Some(digits), length)
                }
                other => {
                    template.push_literal(other);
                    (None, other.len_utf8())
                }
            };
            // A second one would be ambiguous, as to which of them is the frame.
            if placeholder.is_some() && template.digits.replace(placeholder.unwrap_or(0)).is_some() {
                return Err(TemplateError::TwoPlaceholders);
            }
            rest = &rest[length..];
        }
        Ok(template)
    }

    fn push_literal(&mut self, letter: char) {
        if self.digits.is_some() { self.suffix.push(letter) } else { self.prefix.push(letter) }
    }

    /// The name for frame `number`, padded with zeros as by `printf`, whose width includes the sign: -3 is `-003`.
    pub(crate) fn name(&self, number: i64) -> String {
        let Some(width) = self.digits else { return self.prefix.clone() };
        format!("{}{number:0width$}{}", self.prefix, self.suffix)
    }

    /// The name for frame `number` with the sign beside the padded digits: -3 is `-0003`.
    pub(crate) fn name_with_full_digits(&self, number: i64) -> String {
        let Some(digits) = self.digits else { return self.prefix.clone() };
        let sign = if number < 0 { "-" } else { "" };
        format!("{}{sign}{:0digits$}{}", self.prefix, number.unsigned_abs(), self.suffix)
    }
}

/// A placeholder for the frame number that other programs know, in the name of a file: `%04d` and `%d` (Nuke, ffmpeg), `$F4` and `$F` (Houdini), `@@@@` (shake,
/// RV), `<frame>`, `<f4>` (Katana, Maya) or `{frame}`; and its number of digits.
pub(crate) fn other_placeholder(name: &str) -> Option<(&str, usize)> {
    for (start, _) in name.char_indices() {
        let rest = &name[start..];
        let placeholder = printf_digits(rest)
            .or_else(|| houdini_digits(rest))
            .or_else(|| {
                // A single `@` is rather part of a name, as in `icon@2x`.
                let run = rest.len() - rest.trim_start_matches('@').len();
                (run > 1 && run <= MAX_DIGITS).then_some((run, run))
            })
            .or_else(|| enclosed_digits(rest, '<', '>'))
            .or_else(|| enclosed_digits(rest, '{', '}'));
        if let Some((digits, length)) = placeholder {
            return Some((&rest[..length], digits.max(1)));
        }
    }
    None
}

/// `$F` or `$F4` at the start of `text`: its width in digits, and the length of the placeholder.
fn houdini_digits(text: &str) -> Option<(usize, usize)> {
    let after = text.strip_prefix("$F")?;
    let stated = &after[..after.len() - after.trim_start_matches(|letter: char| letter.is_ascii_digit()).len()];
    let digits = if stated.is_empty() { 1 } else { stated_digits(stated)? };
    Some((digits, 2 + stated.len()))
}

/// `<frame>` or `<f4>`, with these brackets, at the start of `text`: its width in digits, and the length of the placeholder.
fn enclosed_digits(text: &str, open: char, close: char) -> Option<(usize, usize)> {
    const UNSTATED_DIGITS: usize = 4;
    let inner = text.strip_prefix(open)?.split(close).next().filter(|inner| inner.len() + 2 <= text.len())?;
    let stated = inner.strip_prefix("frame").or_else(|| inner.strip_prefix('f'))?;
    let digits = if stated.is_empty() { UNSTATED_DIGITS } else { stated_digits(stated)? };
    Some((digits, inner.len() + 2))
}

/// A number of digits that a placeholder may have.
fn stated_digits(number: &str) -> Option<usize> {
    number.parse().ok().filter(|digits| (1..=MAX_DIGITS).contains(digits))
}

/// Whether `text` begins with a single `#` before a digit.
fn is_literal_hash(text: &str) -> bool {
    text.strip_prefix('#').is_some_and(|rest| rest.starts_with(|letter: char| letter.is_ascii_digit()))
}

/// `name` as a pattern for this name: no sign in it is taken for a placeholder.
pub fn literal_pattern(name: &str) -> String {
    name.replace('%', "%%").replace('#', "%#")
}

/// `%d`, `%4d` or `%04d` at the start of `text`: its width in digits, and the length of the placeholder.
fn printf_digits(text: &str) -> Option<(usize, usize)> {
    let inner = text.strip_prefix('%')?;
    let width = &inner[..inner.find('d')?];
    // `+4` would be parsed as a number.
    let digits = if width.is_empty() { 1 } else { width.parse().ok().filter(|_| !width.starts_with('+'))? };
    (digits <= MAX_DIGITS).then_some((digits, width.len() + 2))
}

/// Default name of the sequence of pictures of a scene with the file stem `stem`.
pub fn default_sequence(stem: &str) -> String {
    format!("{}.####.png", literal_pattern(stem))
}

/// Name of the picture of frame `number` in [`default_sequence`].
pub fn default_picture(stem: &str, number: i64) -> String {
    let (prefix, suffix) = (format!("{stem}."), ".png".to_owned());
    FrameTemplate { prefix, digits: Some(4), suffix }.name(number)
}

/// A path whose file name may contain the frame number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NumberedPath {
    folder: PathBuf,
    template: FrameTemplate,
}

impl NumberedPath {
    /// Parses a name of files with this extension (without the dot), such as `gas.####.ply`. `count` is the number of files: unless it is 1,
    /// `gas.ply` becomes `gas.####.ply`.
    ///
    /// # Errors
    /// Another extension, two placeholders, or a percent sign that begins none.
    pub fn parse(path: &Path, extension: &'static str, count: usize) -> Result<Self, NamingError> {
        let name = file_name(path)?;
        let stated = extension_of(path, name)?;
        if !stated.eq_ignore_ascii_case(extension) {
            let path = path.to_path_buf();
            return Err(NamingError::OtherExtension { path, extension: stated.to_owned(), allowed: extension });
        }
        let mut numbered = Self::read(path, name)?;
        if count != 1 {
            numbered.insert_placeholder();
        }
        Ok(numbered)
    }

    fn read(path: &Path, name: &str) -> Result<Self, NamingError> {
        let template = FrameTemplate::parse(name, true).map_err(|error| {
            let path = path.to_path_buf();
            match error {
                TemplateError::TwoPlaceholders => NamingError::TwoPlaceholders { path },
                TemplateError::BadPercent => NamingError::BadPercent { path },
                TemplateError::ManyDigits(digits) => NamingError::ManyDigits { path, digits },
            }
        })?;
        Ok(Self { folder: path.parent().map(Path::to_path_buf).unwrap_or_default(), template })
    }

    /// Inserts a placeholder before the extension if there is none.
    fn insert_placeholder(&mut self) {
        let template = &mut self.template;
        if template.digits.is_none() {
            let dot = template.prefix.rfind('.').unwrap_or(template.prefix.len());
            template.suffix = template.prefix.split_off(dot);
            template.prefix.push('.');
            template.digits = Some(4);
        }
    }

    /// Whether the name contains the frame number.
    pub fn is_numbered(&self) -> bool {
        self.template.digits.is_some()
    }

    /// What stands before the frame number, and before the first dot.
    fn stem(&self) -> &str {
        self.template.prefix.split('.').next().unwrap_or_default()
    }

    /// The path with a `#` for each digit of the frame number.
    pub fn template_path(&self) -> PathBuf {
        let FrameTemplate { prefix, digits, suffix } = &self.template;
        self.folder.join(format!("{prefix}{}{suffix}", "#".repeat(digits.unwrap_or(0))))
    }

    /// The file for frame `number`.
    pub fn path(&self, number: i64) -> PathBuf {
        self.folder.join(self.template.name(number))
    }
}

/// What looks like a frame number in an output path and is part of its name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LiteralPart {
    /// A single `#` before a digit.
    #[error("a single # before a digit is part of the name; ## or %d is the frame number")]
    Hash,
    /// A placeholder in the name of a folder.
    #[error("placeholders in the folder `{folder}` are taken literally; only the file name may contain a frame number")]
    Folder {
        /// The name of the folder.
        folder: String,
    },
}

/// The output path of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputPattern {
    numbered: NumberedPath,
    kind: OutputKind,
}

impl OutputPattern {
    /// Parses an output path. `frame_count` is the number of frames of the job: unless it is 1, `name.png` becomes `name.####.png`. Only the
    /// file name may contain a placeholder.
    ///
    /// # Errors
    /// No extension or an unsupported one, two placeholders, a percent sign that begins none, a placeholder in the name of a film.
    pub fn parse(path: &Path, frame_count: usize) -> Result<Self, NamingError> {
        let name = file_name(path)?;
        let kind = kind_of(path, name)?;
        let mut numbered = NumberedPath::read(path, name)?;
        if numbered.is_numbered() && !kind.is_sequence() {
            return Err(NamingError::NumberedFilm { path: path.to_path_buf(), extension: kind.extension() });
        }
        if kind.is_sequence() && frame_count != 1 {
            numbered.insert_placeholder();
        }
        Ok(Self { numbered, kind })
    }

    /// What stands before the frame number, and before the first dot.
    pub fn stem(&self) -> &str {
        self.numbered.stem()
    }

    /// What in `path` looks like a frame number and is none, if anything does.
    pub fn literal_part(path: &Path) -> Option<LiteralPart> {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        // The first of two signs has a meaning for the second.
        let pairs = name.as_bytes().windows(2).enumerate();
        let mut starts = pairs
            .filter(|(start, pair)| pair[0] == b'#' && (*start == 0 || !b"#%".contains(&name.as_bytes()[start - 1])));
        if starts.any(|(start, _)| is_literal_hash(&name[start..])) {
            return Some(LiteralPart::Hash);
        }
        for folder in path.parent()? {
            let folder = folder.to_string_lossy().into_owned();
            let mut percent_signs = folder.match_indices('%');
            if folder.contains("##") || percent_signs.any(|(at, _)| printf_digits(&folder[at..]).is_some()) {
                return Some(LiteralPart::Folder { folder });
            }
        }
        None
    }

    /// The format.
    pub fn kind(&self) -> OutputKind {
        self.kind
    }

    /// Whether the name contains the frame number.
    pub fn is_numbered(&self) -> bool {
        self.numbered.is_numbered()
    }

    /// The path with a `#` for each digit of the frame number.
    pub fn template_path(&self) -> PathBuf {
        self.numbered.template_path()
    }

    /// The file of frame `number`; the same for all frames of a film.
    pub fn path(&self, number: i64) -> PathBuf {
        self.numbered.path(number)
    }
}

fn file_name(path: &Path) -> Result<&str, NamingError> {
    let name = path.file_name().ok_or_else(|| NamingError::NoExtension { path: path.to_path_buf() })?;
    name.to_str().ok_or_else(|| NamingError::NotUnicode { path: path.to_path_buf() })
}

fn extension_of<'a>(path: &Path, name: &'a str) -> Result<&'a str, NamingError> {
    match name.rsplit_once('.') {
        Some((stem, extension)) if !stem.is_empty() && !extension.is_empty() => Ok(extension),
        _ => Err(NamingError::NoExtension { path: path.to_path_buf() }),
    }
}

fn kind_of(path: &Path, name: &str) -> Result<OutputKind, NamingError> {
    let extension = extension_of(path, name)?;
    OutputKind::from_extension(extension)
        .ok_or_else(|| NamingError::UnknownExtension { path: path.to_path_buf(), extension: extension.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_picture_is_called_as_the_pattern_of_all_says() {
        let pattern = OutputPattern::parse(Path::new(&default_sequence("fire")), 2).unwrap();
        for number in [-12_345, -5, 0, 7, 12_345] {
            assert_eq!(pattern.path(number), Path::new(&default_picture("fire", number)));
        }
    }

    fn name(pattern: &str, frames: usize, number: i64) -> String {
        OutputPattern::parse(Path::new(pattern), frames).unwrap().path(number).display().to_string()
    }

    #[test]
    fn particles_are_numbered_like_frames_and_have_an_extension_of_their_own() {
        let name = |name: &str, count| NumberedPath::parse(Path::new(name), "ply", count).map(|path| path.path(7));
        assert_eq!(name("a/gas.ply", 9), Ok("a/gas.0007.ply".into()));
        assert_eq!((name("gas.ply", 1), name("gas.##.PLY", 1)), (Ok("gas.ply".into()), Ok("gas.07.PLY".into())));
        assert!(matches!(name("gas.obj", 1), Err(NamingError::OtherExtension { allowed: "ply", .. })));
        assert!(matches!(name("gas", 1), Err(NamingError::NoExtension { .. })));
    }

    fn error(pattern: &str) -> NamingError {
        OutputPattern::parse(Path::new(pattern), 2).unwrap_err()
    }

    #[test]
    fn hashes_and_printf_give_the_same_names() {
        for pattern in ["out/frame.####.exr", "out/frame.%04d.exr"] {
            assert_eq!(name(pattern, 9, 7), "out/frame.0007.exr");
            assert_eq!(name(pattern, 9, 12345), "out/frame.12345.exr");
            // As printf("%04d", -3), whose width includes the sign.
            assert_eq!(name(pattern, 9, -3), "out/frame.-003.exr");
            assert_eq!(name(pattern, 9, -12_345), "out/frame.-12345.exr");
        }
        assert_eq!(name("#.png", 9, 12), "12.png");
        assert_eq!(name("f%d.png", 9, 5), "f5.png");
        assert_eq!(name("f.######.PNG", 1, 5), "f.000005.PNG");
    }

    #[test]
    fn the_placeholders_of_other_programs_are_known() {
        for (name, placeholder, digits) in [
            ("p.%04d.png", "%04d", 4),
            ("p.%d.png", "%d", 1),
            ("p.$F4.exr", "$F4", 4),
            ("p.$F.exr", "$F", 1),
            ("p.@@@@.exr", "@@@@", 4),
            ("p.<frame>.png", "<frame>", 4),
            ("p.<f4>.png", "<f4>", 4),
            ("p_{frame}.png", "{frame}", 4),
        ] {
            assert_eq!(other_placeholder(name), Some((placeholder, digits)), "{name}");
        }
        for plain in
            ["p.####.png", "50%.png", "a@b.png", "$HOME.png", "<x>.png", "ünï<.png", "%.png", "f.png", "{}.png"]
        {
            assert_eq!(other_placeholder(plain), None, "{plain}");
        }
    }

    #[test]
    fn all_files_have_a_name_too() {
        let all = |pattern: &str, frames| OutputPattern::parse(Path::new(pattern), frames).unwrap().template_path();
        for (pattern, frames, expected) in
            [("a/f.%03d.png", 9, "a/f.###.png"), ("f.exr", 2, "f.####.exr"), ("f.exr", 1, "f.exr")]
        {
            assert_eq!(all(pattern, frames), Path::new(expected));
        }
    }

    #[test]
    fn names_that_come_from_a_scene_are_literal() {
        for stem in ["a#b", "50%", "sh#t", "#", "##.##", "100%d", "%%", "%#", "take####", "s#1", "a.%04d"] {
            let sequence = default_sequence(stem);
            assert_eq!(name(&sequence, 2, 7), format!("{stem}.0007.png"));
            assert_eq!(name(&sequence, 1, 7), format!("{stem}.0007.png"));
            assert_eq!(name(&format!("{}.sheet.png", literal_pattern(stem)), 1, 7), format!("{stem}.sheet.png"));
        }
    }

    #[test]
    fn a_single_hash_before_a_digit_is_literal() {
        use LiteralPart::{Folder, Hash};
        let literal = |path: &str| OutputPattern::literal_part(Path::new(path));
        for (path, first, part) in [
            ("shot#12.png", "shot#12.png", Some(Hash)),
            ("#1.png", "#1.png", Some(Hash)),
            ("shot#12.####.png", "shot#12.0003.png", Some(Hash)),
            ("shot##12.png", "shot0312.png", None),
            ("shot%#12.png", "shot#12.png", None),
            ("shot.#.png", "shot.3.png", None),
            ("a#b.png", "a3b.png", None),
            ("take####/a.png", "take####/a.png", Some(Folder { folder: "take####".into() })),
            ("take%04d/a.png", "take%04d/a.png", Some(Folder { folder: "take%04d".into() })),
            ("c#/50%/a.png", "c#/50%/a.png", None),
        ] {
            assert_eq!((name(path, 1, 3), literal(path)), (first.to_owned(), part), "{path}");
        }
        assert_eq!(name("shot#12.png", 2, 3), "shot#12.0003.png");
    }

    #[test]
    fn the_stem_is_what_stands_before_the_number() {
        for (path, stem) in
            [("a/fire.####.exr", "fire"), ("fire_%04d.png", "fire_"), ("50%%.#.png", "50%"), ("a%#b.v2.png", "a#b")]
        {
            assert_eq!(OutputPattern::parse(Path::new(path), 2).unwrap().stem(), stem, "{path}");
        }
        assert_eq!(OutputPattern::parse(Path::new("####.png"), 2).unwrap().stem(), "");
    }

    #[test]
    fn the_smallest_frame_number_has_a_name() {
        assert_eq!(name("####.png", 2, i64::MIN), "-9223372036854775808.png");
    }

    #[test]
    fn a_doubled_percent_sign_is_itself() {
        assert_eq!(name("100%%.%03d.png", 2, 5), "100%.005.png");
        assert_eq!(name("100%%.png", 1, 5), "100%.png");
    }

    #[test]
    fn a_lone_name_gets_a_number_only_for_several_frames() {
        assert_eq!(name("a/fire.png", 240, 3), "a/fire.0003.png");
        assert_eq!(name("a/fire.v2.exr", 2, 3), "a/fire.v2.0003.exr");
        assert_eq!(name("a/fire.png", 1, 3), "a/fire.png");
        assert_eq!(name("a/fire.mp4", 240, 3), "a/fire.mp4");
    }

    #[test]
    fn signs_in_folder_names_are_left_alone() {
        assert_eq!(name("c#/50%/a.#.png", 2, 4), "c#/50%/a.4.png");
    }

    #[test]
    fn unusable_names_are_refused_with_the_reason() {
        assert!(matches!(error("a.##.#.png"), NamingError::TwoPlaceholders { .. }));
        assert!(matches!(error("a.##.%03d.png"), NamingError::TwoPlaceholders { .. }));
        assert!(matches!(error("a.%s.png"), NamingError::BadPercent { .. }));
        assert!(matches!(error("a.%099d.png"), NamingError::BadPercent { .. }));
        assert!(matches!(error("a.%-4d.png"), NamingError::BadPercent { .. }));
        assert!(matches!(error(&format!("{}.png", "#".repeat(21))), NamingError::ManyDigits { digits: 21, .. }));
        // More digits than the standard library can format.
        assert!(matches!(error(&format!("{}.png", "#".repeat(100_000))), NamingError::ManyDigits { .. }));
        assert_eq!(name(&format!("{}.png", "#".repeat(20)), 2, 1), "00000000000000000001.png");
        assert!(matches!(error("film.####.mp4"), NamingError::NumberedFilm { .. }));
        for bare in ["frame", ".png", "frame.", "..", "/", ""] {
            assert!(matches!(error(bare), NamingError::NoExtension { .. }), "{bare}");
        }
        let text = error("frame.tiff").to_string();
        for extension in OutputKind::ALL.iter().map(|kind| kind.extension()) {
            assert!(text.contains(&format!(".{extension}")), "{text}");
        }
    }
}
