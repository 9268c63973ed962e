//! The tables `[picture]`, `[plate]` and `[[light]]`.

use bansho_base::{
    color::MAX_EV100,
    math::{self, DVec3},
    parameters::{AssetPath, Auto, Kind, Node, Parameter, ProblemKind, Range, Reader, Value, animated::Animated},
    phenomenon::surroundings::{Emitter, Light},
};

/// Largest side of a picture, pixels.
pub const LARGEST_SIDE: f64 = 16_384.0;

/// Frames a second, as a fraction.
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

    fn to_value(&self) -> Option<Value> {
        Some(match self.seconds {
            1 => Value::Integer(i64::from(self.frames)),
            seconds => Value::Text(format!("{}/{seconds}", self.frames)),
        })
    }
}

bansho_base::parameters! {
    /// The picture: its size, its frames, its exposure.
    pub struct PictureParameters {
        /// Width and height.
        size: [i64; 2] = [1280, 720], limits(Range::new(1.0, LARGEST_SIDE)), unit("pixels");
        /// How many frames the shot has.
        frames: i64 = 240, limits(Range::new(1.0, 10_000_000.0)), unit("frames");
        /// Number of the first frame, at time 0.
        first_frame: i64 = 0, limits(Range::new(-1_000_000.0, 10_000_000.0));
        /// Frames a second, as a number or as a fraction such as "24000/1001".
        fps: FrameRate = FrameRate { frames: 30, seconds: 1 }, unit("1/s");
        /// Exposure value at ISO 100, or "auto": that of the plate; without one chosen once a shot from what the scene holds.
        exposure_ev100: Auto<f64> = Auto::Auto, limits(Range::new(-40.0, 40.0)), unit("EV");
        /// Temperature of the black body whose light is shown as white, as a camera is set: 4000 for a night sky. It changes what is made to
        /// be looked at; EXR files keep the light and name that white. Left out it is 4000 where the sky is a night's, and else the display's, D65.
        white_balance_k: Option<f64> = None, limits(Range::new(1500.0, 25_000.0)), unit("K");
        /// Seed of everything random.
        seed: i64 = 1, limits(Range::new(0.0, 9.0e15));
        /// Pixels drawn beyond every edge; EXR files keep them outside the display window.
        overscan: i64 = 0, limits(Range::new(0.0, 4096.0)), unit("pixels");
    }
}

bansho_base::choice! {
    /// What a plate's depth channel measures.
    pub enum DepthKind {
        /// Distance along the camera's axis.
        Axis = "axis",
        /// Distance from the camera.
        Distance = "distance",
        /// Nearness: 1 / distance along the axis.
        Inverse = "inverse",
    }
}

bansho_base::parameters! {
    /// A picture to lay the phenomena over, and its depth for them to hide behind.
    pub struct PlateParameters {
        /// PNG, JPEG or EXR; `####` stands for the frame number.
        image: Option<AssetPath> = None;
        /// EXR whose `Z` (or only) channel is depth; the image's own `Z` when left out.
        depth: Option<AssetPath> = None;
        /// What the depth measures.
        depth_kind: DepthKind = DepthKind::Axis;
        /// Meters for each unit of the depth channel.
        depth_scale: f64 = 1.0, limits(Range::new(1e-6, 1e6)), unit("m");
        /// Exposure value at ISO 100 with which it was taken, so that its white is 1.2 * 2^EV cd/m^2: 15 in sunshine, 12 under heavy clouds, 4 in
        /// a lit street at night. "auto": as the file records it (Exif, EXR), else assumed.
        exposure_ev100: Auto<f64> = Auto::Auto, limits(Range::new(-MAX_EV100, MAX_EV100)), unit("EV");
    }
}

bansho_base::choice! {
    /// Kind of a light.
    pub enum LightKind {
        /// Shines from a point in all directions.
        Point = "point",
        /// Shines from infinitely far.
        Directional = "directional",
        /// Shines from a point within a cone.
        Spot = "spot",
    }
}

bansho_base::parameters! {
    /// A lamp, the moon or the sun. A scene of rain alone that states neither sky, ground nor light is lit by three street lamps.
    pub struct LightParameters {
        /// How it shines.
        kind: LightKind = LightKind::Point;
        /// Where it stands (point and spot).
        position: Animated<[f64; 3]> = Animated::from([0.0, 3.0, 0.0]), unit("m");
        /// Where it shines to (directional and spot).
        direction: [f64; 3] = [0.0, -1.0, 0.0];
        /// Linear sRGB color; its luminance is scaled to `intensity`.
        color: [f64; 3] = [1.0, 0.9, 0.75], limits(Range::new(0.0, 1.0));
        /// Luminous intensity (candela) of points and spots, illuminance (lux) of directional lights.
        intensity: Animated<f64> = Animated::from(100.0), limits(Range::new(0.0, 1e9)), unit("cd or lx");
        /// Radius of the ball that a point or a spot is.
        radius: f64 = 0.05, limits(Range::new(1e-4, 100.0)), unit("m");
        /// Whether the ball itself is seen.
        visible: bool = false;
        /// Angle from the axis up to which a spot is full; at most `outer_cone_deg`.
        inner_cone_deg: f64 = 15.0, limits(Range::new(0.0, 89.0)), unit("degrees");
        /// Angle from the axis beyond which a spot is dark.
        outer_cone_deg: f64 = 30.0, limits(Range::new(0.1, 90.0)), unit("degrees");
    }
}

impl LightParameters {
    /// Whether it has a direction.
    pub fn is_directed(&self) -> bool {
        self.kind != LightKind::Point
    }

    /// Whether the vector of its direction is not zero.
    pub fn has_valid_direction(&self) -> bool {
        DVec3::from(self.direction).try_normalize().is_some()
    }

    /// Whether it has a position.
    pub fn has_position(&self) -> bool {
        self.kind != LightKind::Directional
    }

    /// The light at time `t`.
    pub fn at(&self, t: f64) -> Light {
        let position = DVec3::from(self.position.at(t));
        let direction = DVec3::from(self.direction).try_normalize().unwrap_or(-DVec3::Y);
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
