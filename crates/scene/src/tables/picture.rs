//! The tables `[picture]` and `[plate]`.

use bansho_base::{
    color::{self, MAX_EV100, ViewName},
    parameters::{AssetPath, Auto, Kind, Length, Node, Parameter, ProblemKind, Range, Reader, Value},
};

use crate::text::path::ValuePath;

/// Largest side of a picture, pixels.
pub const LARGEST_SIDE: f64 = 16_384.0;

/// Frames per second, as a fraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FrameRate {
    /// Frames.
    pub frames: u32,
    /// The seconds that these frames take.
    pub seconds: u32,
}

impl FrameRate {
    /// Length of a frame, s.
    pub fn frame_s(&self) -> f64 {
        f64::from(self.seconds) / f64::from(self.frames)
    }
}

fn parse_fraction(text: &str) -> Option<FrameRate> {
    let (frames, seconds) = text.split_once('/')?;
    Some(FrameRate { frames: frames.trim().parse().ok()?, seconds: seconds.trim().parse().ok()? })
}

/// Largest difference from n 1000 / 1001 of a decimal that means that rate: 23.98 is as usual as 23.976.
const NTSC_TOLERANCE: f64 = 0.01;

/// The rate that a decimal means. Those of NTSC, n 1000 / 1001, are written with two or three decimal places: 23.98, 29.97, 59.94. Other rates
/// have three: none in use needs more.
fn decimal(number: f64) -> FrameRate {
    let thousandths = (number * 1000.0).round() as u32;
    let nominal = (number * 1.001).round();
    if thousandths.is_multiple_of(1000) {
        FrameRate { frames: thousandths / 1000, seconds: 1 }
    } else if nominal >= 1.0 && (number - nominal / 1.001).abs() <= NTSC_TOLERANCE {
        FrameRate { frames: nominal as u32 * 1000, seconds: 1001 }
    } else {
        FrameRate { frames: thousandths, seconds: 1000 }
    }
}

/// What a user should know about the frame rate in the text of a scene: that a decimal is taken as a fraction of 1001.
#[must_use]
pub fn frame_rate_remark(text: &str) -> Option<String> {
    let root = crate::parse_values(text).ok()?;
    let Value::Number(number) = ValuePath::root().key("picture").key("fps").find(&root)?.value else { return None };
    let rate = (0.0..=1e6).contains(&number).then(|| decimal(number))?;
    let taken = format!("{number} frames per second are taken as \"{}/{}\"", rate.frames, rate.seconds);
    (rate.seconds == 1001).then_some(taken)
}

impl Parameter for FrameRate {
    type Limits = ();

    fn kind(_: &()) -> Kind {
        Kind::Rational { min: 0.1, max: 1000.0 }
    }

    fn read(node: &Node, limits: &(), unit: &'static str, reader: &mut Reader) -> Option<Self> {
        let rate = match &node.value {
            Value::Text(text) => parse_fraction(text),
            value => match value.as_number() {
                Some(number) if (0.0..=1e6).contains(&number) => Some(decimal(number)),
                Some(value) => {
                    reader.report(node, ProblemKind::OutOfRange { value, min: 0.1, max: 1000.0, unit });
                    return None;
                }
                None => None,
            },
        };
        let Some(rate) = rate else {
            reader.wrong_type(node, &Self::kind(limits));
            return None;
        };
        let value = f64::from(rate.frames) / f64::from(rate.seconds);
        if (0.1..=1000.0).contains(&value) {
            Some(rate)
        } else {
            reader.report(node, ProblemKind::OutOfRange { value, min: 0.1, max: 1000.0, unit });
            None
        }
    }

    fn check(&self, _limits: &(), unit: &'static str, reader: &mut Reader) {
        let value = f64::from(self.frames) / f64::from(self.seconds);
        if !(0.1..=1000.0).contains(&value) {
            reader.report_value(ProblemKind::OutOfRange { value, min: 0.1, max: 1000.0, unit });
        }
    }

    fn to_value(&self) -> Option<Value> {
        Some(match self.seconds {
            1 => Value::Integer(i64::from(self.frames)),
            seconds => Value::Text(format!("{}/{seconds}", self.frames)),
        })
    }
}

bansho_base::parameters! {
    /// Size, frames and exposure of the picture.
    pub struct PictureParameters {
        /// Width and height.
        size: [i64; 2] = [1280, 720], limits(Range::new(1.0, LARGEST_SIDE)), unit("pixels");
        /// Number of frames of the shot.
        frames: i64 = 240, limits(Range::new(1.0, 10_000_000.0)), unit("frames");
        /// Number of the first frame, at time 0.
        first_frame: i64 = 0, limits(Range::new(-1_000_000.0, 10_000_000.0));
        /// Frames per second, as a number or as a fraction such as "24000/1001". A decimal within 0.01 of n * 1000/1001, such as 23.98 or 29.97, is taken as
        /// that fraction.
        fps: FrameRate = FrameRate { frames: 30, seconds: 1 }, unit("1/s");
        /// Exposure value at ISO 100, or "auto": that of the plate; without a plate, measured once for the shot from the luminance of the scene.
        exposure_ev100: Auto<f64> = Auto::Auto, limits(Range::new(-40.0, 40.0)), unit("EV");
        /// F-number of the camera. With `exposure_time_s` and `iso` it states the exposure in place of `exposure_ev100`: log2(100 f_number^2 / (exposure_time_s iso))
        /// (ISO 2720). Depth of field is not drawn.
        f_number: Option<f64> = None, limits(Range::new(0.1, 1000.0));
        /// Exposure time that, with `f_number` and `iso`, states the exposure. Motion is blurred over `shutter_s` of `[camera]`.
        exposure_time_s: Option<f64> = None, limits(Range::new(1e-7, 1e6)), unit("s");
        /// Sensitivity of the camera (ISO), with `f_number` and `exposure_time_s`.
        iso: Option<f64> = None, limits(Range::new(1.0, 1e7));
        /// View transform of display formats, where the program's user chooses none. A plate that is made for display goes through its inverse, so that its
        /// pixels return unchanged.
        view: ViewName = ViewName::Display;
        /// White balance: temperature of the black body whose light is displayed as white, such as 4000 for a night sky. It only changes display
        /// formats; EXR files contain the unbalanced light, and state the white in their header. The default is 4000 for a night sky, else the
        /// white of the display, D65.
        white_balance_k: Option<f64> = None, limits(Range::new(1500.0, 25_000.0)), unit("K");
        /// Seed of all random numbers.
        seed: i64 = 1, limits(Range::new(0.0, 9.0e15));
        /// Pixels drawn beyond every edge; EXR files contain them outside the display window.
        overscan: i64 = 0, limits(Range::new(0.0, 4096.0)), unit("pixels");
    }
}

impl PictureParameters {
    /// Keys that together state the exposure by the settings of a camera.
    pub(crate) const CAMERA_SETTINGS: [&'static str; 3] = ["f_number", "exposure_time_s", "iso"];

    /// The exposure value of the settings of a camera, if all are stated.
    pub(crate) fn ev100_of_camera(&self) -> Option<f64> {
        color::ev100_of_camera(self.f_number?, self.exposure_time_s?, self.iso?)
    }
}

bansho_base::choice! {
    /// What the depth channel of a plate measures.
    pub enum DepthKind {
        /// Distance along the camera's axis.
        Axis = "axis",
        /// Distance from the camera.
        Distance = "distance",
        /// Inverse depth: 1 / distance along the axis.
        Inverse = "inverse",
    }
}

bansho_base::choice! {
    /// What is seen where the depth of a plate is infinite.
    pub enum PlateSky {
        /// The image, as it is.
        Plate = "plate",
        /// The sky of the scene.
        Scene = "scene",
    }
}

bansho_base::choice! {
    /// The values that the alpha of a plate blends.
    pub enum PlateAlpha {
        /// Linear light in an EXR, or as the mark `bansho:alpha` of a PNG says; else encoded values.
        Auto = "auto",
        /// Encoded values, as browsers and image editors blend them.
        Encoded = "encoded",
        /// Linear light, as compositors and game engines blend it.
        Linear = "linear",
    }
}

/// Bounds of a known depth: pixels and meters.
const KNOWN_DEPTH: Range = Range::new(0.0, 1e6);

bansho_base::parameters! {
    /// A picture over which the phenomena are composited, and its depth, which hides what is behind it.
    pub struct PlateParameters {
        /// PNG, JPEG, EXR, WebP or TIFF; `####` is replaced by the frame number.
        image: Option<AssetPath> = None;
        /// The layer of an EXR that is shown, such as "ViewLayer.Combined". The default is the one that renderers write for this use.
        image_layer: Option<String> = None;
        /// The values that the alpha of the image blends, where it is not in an EXR.
        alpha: PlateAlpha = PlateAlpha::Auto;
        /// Depth of the image: EXR, PNG, PFM, TIFF or NPY. The default is the depth in the image itself, if it is an EXR that has one.
        depth: Option<AssetPath> = None;
        /// The layer or channel of an EXR that is its depth, such as "RenderLayer.Depth.Z". The default is the one that renderers write for this use.
        depth_layer: Option<String> = None;
        /// What the depth measures.
        depth_kind: DepthKind = DepthKind::Axis;
        /// Meters for each unit of the depth; for integers, each code: 0.001 for millimeters. An inverse depth is 1 / (`depth_shift` + value / `depth_scale`). The
        /// default is 1; but where neither scale nor shift of an inverse depth nor `depth_known` is stated, both are found from the ground plane of `[ground]`, if
        /// the scene has one: at least a tenth of the plate below the horizon must be ground.
        depth_scale: Option<f64> = None, limits(Range::new(1e-6, 1e6)), unit("m");
        /// Inverse distance where an inverse depth is 0. The default is 0, or found with the scale.
        depth_shift: Option<f64> = None, limits(Range::new(-1e6, 1e6)), unit("1/m");
        /// Points whose distance along the camera's axis is known, as [x, y, meters], in pixels of the image from its upper left corner. From two or more of them,
        /// scale and shift of an inverse depth are found by least squares.
        depth_known: Vec<[f64; 3]> = Vec::new(), limits(Length { min: 0, max: 1000, item: KNOWN_DEPTH });
        /// What is seen where the depth is infinite (or 0): the image's own sky, or the sky of the scene in its place. The plate needs a depth.
        sky: PlateSky = PlateSky::Plate;
        /// Diffuse color of what the image shows: an EXR of linear values, or PNG, JPEG, WebP or TIFF in sRGB, from 0 to 1. With it, the fires and lamps that are drawn
        /// light what the plate shows. The plate needs a depth.
        albedo: Option<AssetPath> = None;
        /// Normals of what the image shows: an EXR with the channels X, Y and Z (or R, G and B) from -1 to 1, as the camera sees them: to the right, up, and toward the
        /// viewer. The default, also where they are 0, is the normal of the depth.
        normal: Option<AssetPath> = None;
        /// Exposure value at ISO 100 with which it was taken, so that its white is 1.2 * 2^EV cd/m^2: 15 in sunshine, 12 under heavy clouds, 4 in
        /// a lit street at night. "auto": that of the file (Exif, EXR), else an assumed value.
        exposure_ev100: Auto<f64> = Auto::Auto, limits(Range::new(-MAX_EV100, MAX_EV100)), unit("EV");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(value: Value) -> Option<[u32; 2]> {
        let node = Node { value, span: 0..1 };
        FrameRate::read(&node, &(), "", &mut Reader::new()).map(|rate| [rate.frames, rate.seconds])
    }

    #[test]
    fn decimals_near_a_rate_of_ntsc_are_that_rate() {
        for n in [24, 30, 48, 60, 72, 90, 96, 100, 120, 144, 240, 480_u32] {
            let exact = f64::from(n) / 1.001;
            for number in [exact, (exact * 1e3).round() / 1e3, (exact * 1e2).round() / 1e2, (exact * 1e3).floor() / 1e3]
            {
                assert_eq!(read(Value::Number(number)), Some([n * 1000, 1001]), "{number}");
            }
        }
        let others = [
            (24.0, [24, 1]),
            (12.5, [25, 2]),
            (59.9, [599, 10]),
            (23.9, [239, 10]),
            (24.99, [2499, 100]),
            (15.625, [125, 8]),
        ];
        for (number, [frames, seconds]) in others {
            let [found_frames, found_seconds] = read(Value::Number(number)).unwrap();
            assert_eq!(found_frames * seconds, frames * found_seconds, "{number}");
        }
        assert_eq!(read(Value::Integer(60)), Some([60, 1]));
        assert_eq!(read(Value::Text("2997/125".into())), Some([2997, 125]), "what is stated exactly stays");
    }

    #[test]
    fn what_a_decimal_is_taken_as_is_told() {
        let told = |fps: &str| frame_rate_remark(&format!("bansho = 2\n[picture]\nfps = {fps}\n"));
        assert_eq!(told("23.98").unwrap(), "23.98 frames per second are taken as \"24000/1001\"");
        assert_eq!(["24", "24.0", "12.5", "\"24000/1001\"", "1e99"].map(told), [const { None }; 5]);
        assert_eq!(frame_rate_remark("bansho = 2\n"), None);
    }
}
