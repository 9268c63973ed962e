//! Values of options that are more than a word or a number.

use bansho::{
    BitDepth, Rect, View,
    job::BackendChoice,
    render::{
        frames::{self, FrameSpecError},
        scene::picture::LARGEST_SIDE,
    },
};
use clap::builder::{PossibleValuesParser, TypedValueParser};

/// `--frames`
#[derive(Clone, Debug)]
pub(crate) struct Frames(pub(crate) Vec<i64>);

pub(super) fn parse_frames(text: &str) -> Result<Frames, FrameSpecError> {
    frames::parse(text).map(Frames)
}

/// A value that is not of its form.
#[derive(Debug, thiserror::Error)]
pub(super) enum ValueError {
    #[error("allowed: WIDTHxHEIGHT such as 1920x1080, 1 to {LARGEST_SIDE} on a side")]
    Size,
    #[error("allowed: COLUMNSxROWS such as 8x8, up to 4096 frames in all")]
    Grid,
    #[error("allowed: x,y,width,height in whole pixels from the top left corner, such as 640,0,320,180")]
    Crop,
    #[error("allowed: a number of seconds, such as 4 or 2.5")]
    Seconds,
}

/// Two whole numbers between 1 and `most`.
fn pair(text: &str, most: usize) -> Option<[usize; 2]> {
    let (first, second) = text.split_once(['x', 'X'])?;
    let side = |text: &str| text.parse().ok().filter(|side| (1..=most).contains(side));
    Some([side(first)?, side(second)?])
}

pub(super) fn parse_size(text: &str) -> Result<[usize; 2], ValueError> {
    pair(text, LARGEST_SIDE as usize).ok_or(ValueError::Size)
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

pub(super) fn view_parser() -> impl TypedValueParser<Value = View> {
    PossibleValuesParser::new(View::NAMES).try_map(|name| View::from_name(&name))
}

pub(super) fn backend_parser() -> impl TypedValueParser<Value = BackendChoice> {
    let names = BackendChoice::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| BackendChoice::from_name(&name).unwrap_or_default())
}

pub(super) fn bits_parser() -> impl TypedValueParser<Value = BitDepth> {
    let names = BitDepth::CHOICES.iter().map(|choice| choice.name);
    PossibleValuesParser::new(names).map(|name| BitDepth::from_name(&name).unwrap_or_default())
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
    fn grids_are_bounded_in_all() {
        assert_eq!(parse_grid("8x4").unwrap(), [8, 4]);
        assert!(parse_grid("64x64").is_ok() && parse_grid("65x64").is_err() && parse_grid("0x4").is_err());
    }

    #[test]
    fn crops_have_four_numbers_and_some_pixels() {
        assert_eq!(parse_crop("1, 2,3,4").unwrap(), Rect { x: 1, y: 2, width: 3, height: 4 });
        for bad in ["1,2,3", "1,2,0,4", "1,2,3,4,5", "-1,2,3,4", "a,b,c,d", ""] {
            assert!(parse_crop(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn seconds_are_finite() {
        assert_eq!(parse_seconds("2.5").unwrap(), 2.5);
        assert!(parse_seconds("inf").is_err() && parse_seconds("NaN").is_err() && parse_seconds("two").is_err());
    }
}
