//! Orientation and exposure value of a photograph from its Exif data.

mod structure;

use bansho_base::{color::ev100_of_camera, host::assets::PictureRemark, math};
use exif::{Exif, In, Reader, Tag, Value};

use super::orientation::Orientation;

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
    PictureRemark::Exif { at: structure::first_fault(block), reason }
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
    let value = |tag| number(exif, tag);
    let time = value(Tag::ExposureTime).or_else(|| value(Tag::ShutterSpeedValue).map(|speed| math::exp2(-speed)));
    let f_number = value(Tag::FNumber).or_else(|| value(Tag::ApertureValue).map(|value| math::exp2(0.5 * value)));
    ev100_of_camera(f_number?, time?, sensitivity(exif)?)
}

/// Largest value of `PhotographicSensitivity`; it means that the sensitivity is in another tag.
const SENSITIVITY_OVERFLOW: f64 = 65_535.0;

fn sensitivity(exif: &Exif) -> Option<f64> {
    let photographic = number(exif, Tag::PhotographicSensitivity).filter(|value| *value < SENSITIVITY_OVERFLOW);
    let others = [Tag::RecommendedExposureIndex, Tag::StandardOutputSensitivity, Tag::ISOSpeed];
    photographic.or_else(|| others.into_iter().find_map(|tag| number(exif, tag)))
}

/// The first value of a tag of the primary image. It must be positive unless it is in APEX units.
fn number(exif: &Exif, tag: Tag) -> Option<f64> {
    let value = match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(values) => values.first()?.to_f64(),
        Value::SRational(values) => values.first()?.to_f64(),
        value => f64::from(value.get_uint(0)?),
    };
    let is_apex = matches!(tag, Tag::ShutterSpeedValue | Tag::ApertureValue);
    (value.is_finite() && (is_apex || value > 0.0)).then_some(value)
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
        assert!(found.remarks[0].to_string().contains(&format!("damaged at their byte {} (", entry + 8)), "{found:?}");
    }
}
