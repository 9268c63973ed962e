//! Orientation and exposure value of a photograph from its Exif data, and what is wrong with them.

use bansho_base::{color::ev100_of_camera, host::assets::PictureRemark, image::Image, math};
use exif::{Exif, In, Reader, Tag, Value};

/// What is used of an Exif block.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ExifData {
    /// The orientation.
    pub(crate) orientation: Orientation,
    /// Exposure value at ISO 100.
    pub(crate) ev100: Option<f64>,
    /// What is wrong with it.
    pub(crate) remarks: Vec<PictureRemark>,
}

/// Reads an Exif block that begins with its TIFF header, or with `Exif` and two zeros. Nothing outside the block is read, whatever it points to.
pub(crate) fn read(block: &[u8]) -> ExifData {
    let block = block.strip_prefix(b"Exif\0\0").unwrap_or(block);
    let mut damage = None;
    let exif = Reader::new().continue_on_error(true).read_raw(block.to_vec());
    let exif =
        exif.or_else(|error| error.distill_partial_result(|errors| damage = errors.first().map(ToString::to_string)));
    let mut data = ExifData::default();
    match exif {
        Ok(exif) => {
            data.remarks.extend(damage.map(|reason| damaged(block, reason)));
            data.ev100 = ev100(&exif);
            data.set_orientation(orientation_tag(&exif));
        }
        Err(error) => data.remarks.push(damaged(block, error.to_string())),
    }
    data
}

fn damaged(block: &[u8], reason: String) -> PictureRemark {
    PictureRemark::Exif { at: first_fault(block), reason }
}

impl ExifData {
    /// Sets the orientation from the value of its tag, if there is one.
    pub(crate) fn set_orientation(&mut self, tag: Option<u32>) {
        let Some(value) = tag else { return };
        match Orientation::from_tag(value) {
            Some(orientation) => self.orientation = orientation,
            // Written where the orientation is unknown.
            None if value == 0 => {}
            None => self.remarks.push(PictureRemark::Orientation(value)),
        }
    }
}

fn orientation_tag(exif: &Exif) -> Option<u32> {
    exif.get_field(Tag::Orientation, In::PRIMARY)?.value.get_uint(0)
}

/// From exposure time, f-number and sensitivity; `None` if one is missing. Time and f-number may be in APEX units instead (CIPA DC-008, annex C).
fn ev100(exif: &Exif) -> Option<f64> {
    let time =
        number(exif, Tag::ExposureTime).or_else(|| number(exif, Tag::ShutterSpeedValue).map(|tv| math::exp2(-tv)));
    let f_number =
        number(exif, Tag::FNumber).or_else(|| number(exif, Tag::ApertureValue).map(|av| math::exp2(0.5 * av)));
    ev100_of_camera(f_number?, time?, sensitivity(exif)?)
}

/// Largest value of `PhotographicSensitivity`; it means that the sensitivity is in another tag.
const SENSITIVITY_OVERFLOW: f64 = 65_535.0;

fn sensitivity(exif: &Exif) -> Option<f64> {
    let photographic = number(exif, Tag::PhotographicSensitivity).filter(|value| *value < SENSITIVITY_OVERFLOW);
    let others = [Tag::RecommendedExposureIndex, Tag::StandardOutputSensitivity, Tag::ISOSpeed];
    photographic.or_else(|| others.into_iter().find_map(|tag| number(exif, tag)))
}

/// The first value of a tag of the primary image, not of its thumbnail. It must be positive unless it is in APEX units.
fn number(exif: &Exif, tag: Tag) -> Option<f64> {
    let value = match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(values) => values.first()?.to_f64(),
        Value::SRational(values) => values.first()?.to_f64(),
        value => f64::from(value.get_uint(0)?),
    };
    let is_apex = matches!(tag, Tag::ShutterSpeedValue | Tag::ApertureValue);
    (value.is_finite() && (is_apex || value > 0.0)).then_some(value)
}

/// How rows and columns are turned for display (Exif tag 0x0112, TIFF 6.0 tag 274): a value of the tag, by what has to be done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Orientation {
    /// 1: nothing.
    #[default]
    Upright,
    /// 2: mirrored left to right.
    Mirrored,
    /// 3: turned by half a turn.
    Turned180,
    /// 4: mirrored top to bottom.
    Flipped,
    /// 5: rows become columns.
    Transposed,
    /// 6: turned clockwise by a quarter turn.
    Turned90,
    /// 7: rows become columns, mirrored in both directions.
    Transverse,
    /// 8: turned counterclockwise by a quarter turn.
    Turned270,
}

impl Orientation {
    /// The orientation of a value of the tag; `None` for a value without meaning.
    pub(crate) fn from_tag(value: u32) -> Option<Self> {
        Some(match value {
            1 => Self::Upright,
            2 => Self::Mirrored,
            3 => Self::Turned180,
            4 => Self::Flipped,
            5 => Self::Transposed,
            6 => Self::Turned90,
            7 => Self::Transverse,
            8 => Self::Turned270,
            _ => return None,
        })
    }

    fn swaps_sides(self) -> bool {
        matches!(self, Self::Transposed | Self::Turned90 | Self::Transverse | Self::Turned270)
    }

    /// The stored pixel that is shown at (x, y), in a stored picture of `width` x `height` pixels.
    fn source(self, [x, y]: [usize; 2], [width, height]: [usize; 2]) -> [usize; 2] {
        let (right, bottom) = (width - 1, height - 1);
        match self {
            Self::Upright => [x, y],
            Self::Mirrored => [right - x, y],
            Self::Turned180 => [right - x, bottom - y],
            Self::Flipped => [x, bottom - y],
            Self::Transposed => [y, x],
            Self::Turned90 => [y, bottom - x],
            Self::Transverse => [right - y, bottom - x],
            Self::Turned270 => [right - y, x],
        }
    }

    /// The picture as it is shown.
    pub(crate) fn apply<const N: usize>(self, image: Image<N>) -> Image<N> {
        let size = [image.width(), image.height()];
        if self == Self::Upright || size.contains(&0) {
            return image;
        }
        let [width, height] = if self.swaps_sides() { [size[1], size[0]] } else { size };
        let mut turned = Image::filled(width, height, [0.0; N]);
        for y in 0..height {
            for (x, pixel) in turned.row_mut(y).iter_mut().enumerate() {
                let [column, row] = self.source([x, y], size);
                *pixel = image.at(column, row);
            }
        }
        turned
    }
}

/// Directories that are followed: an image has at most six.
const MAX_DIRECTORIES: usize = 32;
/// Bytes of an entry of a directory.
const ENTRY: usize = 12;
/// Tags whose value is the position of another directory: Exif, GPS and interoperability.
const DIRECTORY_TAGS: [usize; 3] = [0x8769, 0x8825, 0xa005];

/// Position of the first thing in a block that points outside it or has no meaning, since the reader of Exif data does not say where that is (TIFF 6.0, section
/// 2). The block begins with its TIFF header. `None` if nothing is found.
fn first_fault(block: &[u8]) -> Option<usize> {
    let directories = match block {
        [b'I', b'I', ..] => ExifDirectories { block, number: |bytes| bytes.iter().rev().fold(0, join) },
        [b'M', b'M', ..] => ExifDirectories { block, number: |bytes| bytes.iter().fold(0, join) },
        _ => return Some(0),
    };
    // The version of TIFF.
    if directories.number(2, 2) != Some(42) {
        return Some(2);
    }
    directories.first_fault().err()
}

fn join(number: usize, byte: &u8) -> usize {
    number << 8 | usize::from(*byte)
}

/// The directories of an Exif block.
struct ExifDirectories<'a> {
    block: &'a [u8],
    /// Reads a number in the byte order.
    number: fn(&[u8]) -> usize,
}

impl ExifDirectories<'_> {
    fn number(&self, at: usize, bytes: usize) -> Option<usize> {
        self.block.get(at..at.checked_add(bytes)?).map(self.number)
    }

    /// The first fault as an error.
    fn first_fault(&self) -> Result<(), usize> {
        // Positions of directories, and of what names them.
        let mut pending = vec![(self.number(4, 4).ok_or(4_usize)?, 4)];
        // Bounded, because directories may name each other in a circle.
        for _ in 0..MAX_DIRECTORIES {
            let Some((directory, named_at)) = pending.pop() else { return Ok(()) };
            let count = self.number(directory, 2).ok_or(named_at)?;
            for entry in (0..count).map(|index| directory + 2 + ENTRY * index) {
                pending.extend(self.entry(entry)?.map(|position| (position, entry + 8)));
            }
            let next_at = directory + 2 + ENTRY * count;
            // Some writers leave it out behind the last directory.
            let next = self.number(next_at, 4).unwrap_or(0);
            pending.extend((next != 0).then_some((next, next_at)));
        }
        Ok(())
    }

    /// The directory that the entry at this position names, if it does.
    fn entry(&self, at: usize) -> Result<Option<usize>, usize> {
        let (tag, kind) = (self.number(at, 2).ok_or(at)?, self.number(at + 2, 2).ok_or(at)?);
        let (count, value) = (self.number(at + 4, 4).ok_or(at)?, self.number(at + 8, 4).ok_or(at)?);
        // Bytes of a value by its type: integers of 1, 2 and 4 bytes, single floats and directories, then fractions and doubles.
        let bytes = match kind {
            1 | 2 | 6 | 7 => 1,
            3 | 8 => 2,
            4 | 9 | 11 | 13 => 4,
            5 | 10 | 12 => 8,
            _ => return Err(at + 2),
        };
        let length = count.saturating_mul(bytes);
        // Up to four bytes stand in the entry itself; more are elsewhere, and the entry has their position.
        if length > 4 && value.saturating_add(length) > self.block.len() {
            return Err(at + 8);
        }
        Ok(DIRECTORY_TAGS.contains(&tag).then_some(value))
    }
}

#[cfg(test)]
mod tests {
    use exif::{Field, Rational, SRational, experimental::Writer};

    use super::*;

    fn block(fields: &[(Tag, Value)]) -> Vec<u8> {
        let fields: Vec<Field> =
            fields.iter().map(|(tag, value)| Field { tag: *tag, ifd_num: In::PRIMARY, value: value.clone() }).collect();
        let mut writer = Writer::new();
        fields.iter().for_each(|field| writer.push_field(field));
        let mut bytes = std::io::Cursor::new(Vec::new());
        writer.write(&mut bytes, false).unwrap();
        bytes.into_inner()
    }

    fn rational(num: u32, denom: u32) -> Value {
        Value::Rational(vec![Rational { num, denom }])
    }

    #[test]
    fn time_aperture_and_sensitivity_give_the_exposure() {
        let iso = (Tag::PhotographicSensitivity, Value::Short(vec![400]));
        let plain = block(&[(Tag::ExposureTime, rational(1, 250)), (Tag::FNumber, rational(40, 10)), iso.clone()]);
        // log2(16 * 250) - 2.
        assert!((read(&plain).ev100.unwrap() - 9.9658).abs() < 1e-3);
        let speed = Value::SRational(vec![SRational { num: 8, denom: 1 }]);
        let apex = block(&[(Tag::ShutterSpeedValue, speed), (Tag::ApertureValue, rational(4, 1)), iso]);
        assert!((read(&apex).ev100.unwrap() - 10.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_left_out_damaged_or_no_number_is_no_exposure() {
        let time = (Tag::ExposureTime, rational(1, 250));
        let f_number = (Tag::FNumber, rational(4, 1));
        let iso = (Tag::PhotographicSensitivity, Value::Short(vec![100]));
        let whole = block(&[time.clone(), f_number.clone(), iso.clone()]);
        assert_eq!(read(&block(&[time, iso.clone()])).ev100, None);
        assert_eq!(read(&block(&[(Tag::ExposureTime, rational(1, 0)), f_number, iso])).ev100, None);
        for end in 0..whole.len() {
            // Truncated anywhere, it gives an exposure or none. What is wrong begins before its end.
            let found = read(&whole[..end]);
            let PictureRemark::Exif { at: Some(at), .. } = &found.remarks[0] else { panic!("{end}: {found:?}") };
            assert!(*at <= end.max(4), "{end}: {at}");
        }
        let none = read(b"no Exif at all");
        assert!(none.ev100.is_none() && matches!(none.remarks[..], [PictureRemark::Exif { at: Some(0), .. }]));
    }

    #[test]
    fn the_orientation_is_found_and_one_without_meaning_is_told() {
        for tag in 1..=8_u16 {
            let found = read(&block(&[(Tag::Orientation, Value::Short(vec![tag]))]));
            assert_eq!((Some(found.orientation), found.remarks.len()), (Orientation::from_tag(tag.into()), 0));
        }
        for (tag, remarks) in [(0, vec![]), (9, vec![PictureRemark::Orientation(9)])] {
            let found = read(&block(&[(Tag::Orientation, Value::Short(vec![tag]))]));
            assert_eq!((found.orientation, found.remarks), (Orientation::Upright, remarks));
        }
    }

    #[test]
    fn what_points_outside_its_block_is_told_and_the_rest_is_used() {
        let orientation = (Tag::Orientation, Value::Short(vec![6]));
        let mut bad = block(&[orientation, (Tag::ImageDescription, Value::Ascii(vec![vec![b'x'; 30]]))]);
        // The offset of the description, the entry 0x010e of the first directory.
        let entry = bad.windows(2).position(|pair| pair == [0x01, 0x0e]).unwrap();
        bad[entry + 8..entry + 12].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff]);
        let found = read(&bad);
        assert_eq!(found.orientation, Orientation::Turned90);
        let [PictureRemark::Exif { at, .. }] = &found.remarks[..] else { panic!("{found:?}") };
        assert_eq!(*at, Some(entry + 8));
        assert!(
            found.remarks[0].to_string().contains(&format!("damaged at byte {} of the Exif block (", entry + 8)),
            "{found:?}"
        );
    }

    #[test]
    fn each_value_of_the_tag_shows_the_rows_and_columns_that_the_standard_says() {
        // Exif 2.32, 4.6.4: what the stored row 0 and column 0 are on the display. Stored: 0 1 2 / 3 4 5.
        let shown = [
            (1, [3, 2], [0, 1, 2, 3, 4, 5]),
            (2, [3, 2], [2, 1, 0, 5, 4, 3]),
            (3, [3, 2], [5, 4, 3, 2, 1, 0]),
            (4, [3, 2], [3, 4, 5, 0, 1, 2]),
            (5, [2, 3], [0, 3, 1, 4, 2, 5]),
            (6, [2, 3], [3, 0, 4, 1, 5, 2]),
            (7, [2, 3], [5, 2, 4, 1, 3, 0]),
            (8, [2, 3], [2, 5, 1, 4, 0, 3]),
        ];
        for (tag, size, values) in shown {
            let stored = Image::from_pixels(3, 2, (0..6_u8).map(|v| [f32::from(v)]).collect()).unwrap();
            let turned = Orientation::from_tag(tag).unwrap().apply(stored);
            assert_eq!([turned.width(), turned.height()], size, "{tag}");
            let found: Vec<i32> = turned.pixels().iter().map(|[v]| *v as i32).collect();
            assert_eq!(found, values, "{tag}");
        }
        assert_eq!([0, 9, u32::MAX].map(Orientation::from_tag), [None; 3]);
    }
}
