//! Exposure value of a photograph from its Exif data.

use bansho_base::{color::ev100_of_camera, math};
use exif::{Exif, In, Reader, Tag, Value};

/// Exposure value at ISO 100 from an Exif block that begins with its TIFF header; `None` if a tag is missing or the block is damaged.
///
/// From exposure time, f-number and sensitivity. Time and f-number may be in APEX units instead (CIPA DC-008, annex C).
pub(crate) fn exif_ev100(block: &[u8]) -> Option<f64> {
    let exif = Reader::new().continue_on_error(true).read_raw(block.to_vec());
    let exif = exif.or_else(|error| error.distill_partial_result(|_| {})).ok()?;
    let value = |tag| number(&exif, tag);
    let time = value(Tag::ExposureTime).or_else(|| value(Tag::ShutterSpeedValue).map(|speed| math::exp2(-speed)));
    let f_number = value(Tag::FNumber).or_else(|| value(Tag::ApertureValue).map(|value| math::exp2(0.5 * value)));
    ev100_of_camera(f_number?, time?, sensitivity(&exif)?)
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
        assert!((exif_ev100(&plain).unwrap() - 9.9658).abs() < 1e-3);
        let speed = Value::SRational(vec![SRational { num: 8, denom: 1 }]);
        let apex = block(&[(Tag::ShutterSpeedValue, speed), (Tag::ApertureValue, rational(4, 1)), iso]);
        assert!((exif_ev100(&apex).unwrap() - 10.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_left_out_damaged_or_no_number_is_no_exposure() {
        let time = (Tag::ExposureTime, rational(1, 250));
        let f_number = (Tag::FNumber, rational(4, 1));
        let iso = (Tag::PhotographicSensitivity, Value::Short(vec![100]));
        let whole = block(&[time.clone(), f_number.clone(), iso.clone()]);
        assert_eq!(exif_ev100(&block(&[time, iso.clone()])), None);
        assert_eq!(exif_ev100(&block(&[(Tag::ExposureTime, rational(1, 0)), f_number, iso])), None);
        for end in 0..whole.len() {
            // Truncated anywhere, it gives an exposure or none.
            let _ = exif_ev100(&whole[..end]);
        }
        assert_eq!(exif_ev100(b"no Exif at all"), None);
    }
}
