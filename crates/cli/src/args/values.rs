//! Parsers of option values.

use std::path::PathBuf;

use bansho::{
    AlphaConvention, BitDepth, Rect, View, ViewName,
    job::frames::{self, FrameListError},
    job::{ContactBackground, FlipbookCrop, FramesInFlight, StreakFormat},
    rain::{DropCountLaw, OpacityLaw, VelocityLaw},
    scene::picture::LARGEST_SIDE,
};
use clap::builder::{PossibleValuesParser, TypedValueParser};

/// `--frames`
#[derive(Clone, Debug)]
pub(crate) struct Frames(pub(crate) Vec<i64>);

/// Number of frames of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChunkLength {
    /// As the measured cost of a frame suggests.
    Auto,
    /// This many.
    Frames(u64),
}

pub(super) fn parse_frames(text: &str) -> Result<Frames, FrameListError> {
    frames::parse(text).map(Frames)
}

/// A value that does not have the required form.
#[derive(Debug, thiserror::Error)]
pub(super) enum ValueError {
    #[error("allowed: WIDTHxHEIGHT such as 1920x1080, 1 to {LARGEST_SIDE} on a side")]
    Size,
    #[error("allowed: auto, or a number of frames of at least 1")]
    Chunk,
    #[error("allowed: COLUMNSxROWS such as 8x8, up to 4096 frames in all")]
    Grid,
    #[error("allowed: x,y,width,height in whole pixels from the top left corner, such as 640,0,320,180")]
    Crop,
    #[error("allowed: a whole number from 0 to {}", u64::MAX)]
    Seed,
    #[error("allowed: a number of seconds, such as 4 or 2.5")]
    Seconds,
    #[error("allowed: numbers separated by commas, such as 1,5,10")]
    Numbers,
    #[error("allowed: a number of seconds, such as 0.02 or 1/30")]
    Exposure,
    #[error("allowed: three numbers separated by commas, such as 0,1,-0.5")]
    Vector,
    #[error("allowed: a number of bytes with a unit, such as 512MiB, 8GiB or 500MB")]
    Bytes,
    #[error("the folder does not exist; allowed: an existing folder")]
    Folder,
}

/// Numbers separated by commas.
#[derive(Clone, Debug)]
pub(crate) struct Numbers(pub(crate) Vec<f64>);

/// Two whole numbers between 1 and `max`.
fn pair(text: &str, max: usize) -> Option<[usize; 2]> {
    let (first, second) = text.split_once(['x', 'X'])?;
    let sides = [first.parse().ok()?, second.parse().ok()?];
    sides.iter().all(|side| (1..=max).contains(side)).then_some(sides)
}

pub(super) fn parse_size(text: &str) -> Result<[usize; 2], ValueError> {
    pair(text, LARGEST_SIDE as usize).ok_or(ValueError::Size)
}

/// `auto`, or a number of frames.
pub(super) fn parse_frames_in_flight(text: &str) -> Result<FramesInFlight, ValueError> {
    match parse_chunk(text)? {
        ChunkLength::Auto => Ok(FramesInFlight::Auto),
        ChunkLength::Frames(count) => Ok(FramesInFlight::Count(count as usize)),
    }
}

/// `auto`, or a number of frames.
pub(super) fn parse_chunk(text: &str) -> Result<ChunkLength, ValueError> {
    match text {
        "auto" => Ok(ChunkLength::Auto),
        _ => text
            .parse()
            .ok()
            .filter(|frames| (1..=frames::MAX_FRAMES as u64).contains(frames))
            .map(ChunkLength::Frames)
            .ok_or(ValueError::Chunk),
    }
}

pub(super) fn parse_seed(text: &str) -> Result<u64, ValueError> {
    text.parse().map_err(|_| ValueError::Seed)
}

pub(super) fn parse_grid(text: &str) -> Result<[usize; 2], ValueError> {
    pair(text, 4096).filter(|[columns, rows]| columns * rows <= 4096).ok_or(ValueError::Grid)
}

pub(super) fn parse_crop(text: &str) -> Result<Rect, ValueError> {
    let numbers: Result<Vec<usize>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, width, height]) if width > 0 && height > 0 => Ok(Rect { x, y, width, height }),
        _ => Err(ValueError::Crop),
    }
}

pub(super) fn parse_seconds(text: &str) -> Result<f64, ValueError> {
    text.parse().ok().filter(|seconds: &f64| seconds.is_finite()).ok_or(ValueError::Seconds)
}

/// Finite numbers; `None` if one is not a number.
fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|number| number.trim().parse().ok().filter(|value: &f64| value.is_finite())).collect()
}

pub(super) fn parse_numbers(text: &str) -> Result<Numbers, ValueError> {
    numbers(text).map(Numbers).ok_or(ValueError::Numbers)
}

pub(super) fn parse_vector(text: &str) -> Result<[f64; 3], ValueError> {
    numbers(text).and_then(|numbers| numbers.try_into().ok()).ok_or(ValueError::Vector)
}

/// A time in seconds, or a fraction such as 1/30.
pub(super) fn parse_exposure(text: &str) -> Result<f64, ValueError> {
    let (over, under) = text.split_once('/').unwrap_or((text, "1"));
    match (over.trim().parse::<f64>(), under.trim().parse::<f64>()) {
        (Ok(over), Ok(under)) if (over / under).is_finite() => Ok(over / under),
        _ => Err(ValueError::Exposure),
    }
}

/// A number of bytes: decimal units (kB, MB, GB, TB) or binary ones (KiB, MiB, GiB, TiB).
pub(super) fn parse_bytes(text: &str) -> Result<u64, ValueError> {
    const UNITS: [(&str, u64); 9] = [
        ("KiB", 1 << 10),
        ("MiB", 1 << 20),
        ("GiB", 1 << 30),
        ("TiB", 1 << 40),
        ("kB", 1_000),
        ("MB", 1_000_000),
        ("GB", 1_000_000_000),
        ("TB", 1_000_000_000_000),
        ("B", 1),
    ];
    // A byte alone is last: every unit ends in B.
    for (unit, bytes) in UNITS {
        if let Some(Ok(count)) = text.strip_suffix(unit).map(|count| count.trim_end().parse::<u64>()) {
            return count.checked_mul(bytes).ok_or(ValueError::Bytes);
        }
    }
    Err(ValueError::Bytes)
}

pub(super) fn parse_folder(text: &str) -> Result<PathBuf, ValueError> {
    let path = PathBuf::from(text);
    if path.is_dir() { Ok(path) } else { Err(ValueError::Folder) }
}

pub(super) fn velocity_parser() -> impl TypedValueParser<Value = VelocityLaw> {
    let names = VelocityLaw::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| VelocityLaw::from_name(&name).unwrap_or_default())
}

pub(super) fn drop_count_parser() -> impl TypedValueParser<Value = DropCountLaw> {
    let names = DropCountLaw::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| DropCountLaw::from_name(&name).unwrap_or_default())
}

pub(super) fn opacity_parser() -> impl TypedValueParser<Value = OpacityLaw> {
    let names = OpacityLaw::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| OpacityLaw::from_name(&name).unwrap_or_default())
}

pub(super) fn streak_format_parser() -> impl TypedValueParser<Value = StreakFormat> {
    let names = StreakFormat::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| StreakFormat::from_name(&name).unwrap_or_default())
}

pub(super) fn view_parser() -> impl TypedValueParser<Value = View> {
    let names = ViewName::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| ViewName::from_name(&name).unwrap_or_default().into())
}

pub(super) fn contact_background_parser() -> impl TypedValueParser<Value = ContactBackground> {
    let names = ContactBackground::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| ContactBackground::from_name(&name).unwrap_or_default())
}

pub(super) fn flipbook_crop_parser() -> impl TypedValueParser<Value = FlipbookCrop> {
    let names = FlipbookCrop::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| FlipbookCrop::from_name(&name).unwrap_or_default())
}

pub(super) fn bits_parser() -> impl TypedValueParser<Value = BitDepth> {
    let names = BitDepth::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| BitDepth::from_name(&name).unwrap_or_default())
}

pub(super) fn alpha_parser() -> impl TypedValueParser<Value = AlphaConvention> {
    let names = AlphaConvention::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| AlphaConvention::from_name(&name).unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_two_sides_in_range() {
        assert_eq!(parse_size("1920x1080").unwrap(), [1920, 1080]);
        for bad in ["0x5", "5x0", "1000000000x1", "5", "5x", "x5", "-1x5", "5x5x5", "5.5x4", ""] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn bytes_have_a_unit_and_do_not_overflow() {
        assert_eq!(
            ["2GiB", "512 MiB", "500MB", "7B"].map(|text| parse_bytes(text).unwrap()),
            [2 << 30, 512 << 20, 500_000_000, 7]
        );
        for bad in ["", "2", "GiB", "-1GiB", "1.5GiB", "2gib", "99999999TiB", "2 GiB 3"] {
            assert!(parse_bytes(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn grids_are_bounded_in_all() {
        assert_eq!(parse_grid("8x4").unwrap(), [8, 4]);
        assert!(parse_grid("64x64").is_ok() && parse_grid("65x64").is_err() && parse_grid("0x4").is_err());
    }

    #[test]
    fn chunks_are_a_number_of_frames_or_automatic() {
        assert_eq!(parse_chunk("auto").unwrap(), ChunkLength::Auto);
        assert_eq!(parse_chunk("12").unwrap(), ChunkLength::Frames(12));
        assert!(["0", "-1", "", "Auto", "1.5", "99999999999"].iter().all(|bad| parse_chunk(bad).is_err()));
    }

    #[test]
    fn crops_have_four_numbers_and_some_pixels() {
        assert_eq!(parse_crop("1, 2,3,4").unwrap(), Rect { x: 1, y: 2, width: 3, height: 4 });
        for bad in ["1,2,3", "1,2,0,4", "1,2,3,4,5", "-1,2,3,4", "a,b,c,d", ""] {
            assert!(parse_crop(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn lists_vectors_and_exposures_are_numbers() {
        assert_eq!(parse_numbers("1, 2.5,-3").unwrap().0, [1.0, 2.5, -3.0]);
        assert_eq!(parse_vector("0,0.5,-1").unwrap(), [0.0, 0.5, -1.0]);
        assert_eq!((parse_exposure("1/50").unwrap(), parse_exposure("0.25").unwrap()), (0.02, 0.25));
        for bad in ["", "1,", "a", "1;2", "nan", "1,inf"] {
            assert!(parse_numbers(bad).is_err(), "{bad}");
        }
        assert!(parse_vector("1,2").is_err() && parse_vector("1,2,3,4").is_err());
        assert!(["1/0", "1/", "/30", "fast", "1/2/3"].iter().all(|bad| parse_exposure(bad).is_err()));
    }

    #[test]
    fn seconds_are_finite() {
        assert_eq!(parse_seconds("2.5").unwrap(), 2.5);
        assert!(parse_seconds("inf").is_err() && parse_seconds("NaN").is_err() && parse_seconds("two").is_err());
    }
}
