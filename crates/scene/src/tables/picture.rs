//! The tables `[picture]`, `[plate]` and `[[light]]`.

use bansho_base::{
    color::MAX_EV100,
    math::{self, DVec3},
    parameters::{
        AssetPath, Auto, Kind, Length, Node, Parameter, ProblemKind, Range, Reader, Value, animated::Animated,
    },
    phenomenon::surroundings::{Emitter, Light},
};

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

/// Decimal rates have three decimal places: no rate in use needs more.
fn decimal(number: f64) -> FrameRate {
    let thousandths = (number * 1000.0).round() as u32;
    if thousandths.is_multiple_of(1000) {
        FrameRate { frames: thousandths / 1000, seconds: 1 }
    } else {
        FrameRate { frames: thousandths, seconds: 1000 }
    }
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
        /// Frames per second, as a number or as a fraction such as "24000/1001".
        fps: FrameRate = FrameRate { frames: 30, seconds: 1 }, unit("1/s");
        /// Exposure value at ISO 100, or "auto": that of the plate; without a plate, measured once for the shot from the luminance of the scene.
        exposure_ev100: Auto<f64> = Auto::Auto, limits(Range::new(-40.0, 40.0)), unit("EV");
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
        /// Exposure value at ISO 100 with which it was taken, so that its white is 1.2 * 2^EV cd/m^2: 15 in sunshine, 12 under heavy clouds, 4 in
        /// a lit street at night. "auto": that of the file (Exif, EXR), else an assumed value.
        exposure_ev100: Auto<f64> = Auto::Auto, limits(Range::new(-MAX_EV100, MAX_EV100)), unit("EV");
    }
}

bansho_base::choice! {
    /// Kind of light.
    pub enum LightKind {
        /// Emits from a point in all directions.
        Point = "point",
        /// Emits from infinitely far away.
        Directional = "directional",
        /// Emits from a point within a cone.
        Spot = "spot",
    }
}

bansho_base::parameters! {
    /// A lamp, the moon or the sun. A scene with only rain that states neither sky, ground nor light is lit by three street lamps.
    pub struct LightParameters {
        /// Kind of light.
        kind: LightKind = LightKind::Point;
        /// Position (point and spot).
        position: Animated<[f64; 3]> = Animated::from([0.0, 3.0, 0.0]), unit("m");
        /// Direction of the emitted light (directional and spot).
        direction: Animated<[f64; 3]> = Animated::from([0.0, -1.0, 0.0]);
        /// Linear sRGB color; its luminance is scaled to `intensity`.
        color: [f64; 3] = [1.0, 0.9, 0.75], limits(Range::new(0.0, 1.0));
        /// Luminous intensity (candela) of points and spots, illuminance (lux) of directional lights.
        intensity: Animated<f64> = Animated::from(100.0), limits(Range::new(0.0, 1e9)), unit("cd or lx");
        /// Radius of the sphere that emits the light (point and spot).
        radius: f64 = 0.05, limits(Range::new(1e-4, 100.0)), unit("m");
        /// Whether the sphere itself is visible.
        visible: bool = false;
        /// Angle from the axis up to which a spot has full intensity; at most `outer_cone_deg`.
        inner_cone_deg: f64 = 15.0, limits(Range::new(0.0, 89.0)), unit("degrees");
        /// Angle from the axis beyond which a spot has no intensity.
        outer_cone_deg: f64 = 30.0, limits(Range::new(0.1, 90.0)), unit("degrees");
    }
}

impl LightParameters {
    /// Whether it has a direction.
    pub fn is_directed(&self) -> bool {
        self.kind != LightKind::Point
    }

    /// Whether the vector of its direction is not zero at any key.
    pub fn has_valid_direction(&self) -> bool {
        self.direction.values().into_iter().all(|direction| DVec3::from(direction).try_normalize().is_some())
    }

    /// Whether it has a position.
    pub fn has_position(&self) -> bool {
        self.kind != LightKind::Directional
    }

    /// The light at time `t`.
    pub fn at(&self, t: f64) -> Light {
        let position = DVec3::from(self.position.at(t));
        let direction = DVec3::from(self.direction.at(t)).try_normalize().unwrap_or(-DVec3::Y);
        let emitter = match self.kind {
            LightKind::Point => Emitter::Point { position, radius: self.radius },
            LightKind::Directional => Emitter::Directional { toward: -direction },
            LightKind::Spot => Emitter::Spot {
                position,
                axis: direction,
                cos_inner: math::cos(self.inner_cone_deg.min(self.outer_cone_deg).to_radians()),
                cos_outer: math::cos(self.outer_cone_deg.to_radians()),
            },
        };
        let color = bansho_base::color::acescg_from_srgb(self.color.map(|value| value as f32));
        let luminance = bansho_base::color::luminance(color).max(1e-6);
        let scale = self.intensity.at(t) as f32 / luminance;
        Light { emitter, intensity: color.map(|value| value * scale) }
    }
}
