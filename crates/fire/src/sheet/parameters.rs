//! Parameters of the flame sheet. Symbols and equation numbers are those of Ohshima and Itahashi.

use bansho_base::{
    math::curve::{Curve, Interpolation},
    parameters::{Auto, CurveLimits, Length, Range, animated::Animated},
};

use crate::sparks::SparkParameters;

const FRACTION: Range = Range::new(0.0, 1.0);
const KELVIN: Range = Range::new(600.0, 4000.0);

/// A default curve; its points are literals below.
fn curve(points: &[[f64; 2]]) -> Curve {
    Curve::new(points.to_vec(), Interpolation::Monotone).expect("default points ascend")
}

bansho_base::choice! {
    /// The texture that stands for the gas.
    pub enum TextureKind {
        /// Layers of warped gradient noise that rise at different speeds; never visibly repeats.
        Fractal = "fractal",
        /// The paper's sum of cosines, eq. (20), halved so that it lies in [0, 1]; repeats every 0.483 sheet heights.
        OhshimaItahashi = "ohshima_itahashi",
    }
}

bansho_base::choice! {
    /// How the sharpened texture T2 becomes color.
    pub enum Coloring {
        /// T2 gives temperature and density of glowing soot, Planck's law gives the light.
        BlackBody = "black_body",
        /// The curves `red`, `green` and `blue`, eq. (7).
        RgbCurves = "rgb_curves",
    }
}

bansho_base::choice! {
    /// Which stage of the chain is shown; all but the flame show the flat texture square (u, w) as the paper's pictures 1 to 4.
    pub enum Stage {
        /// The finished flame.
        Flame = "flame",
        /// The texture T0 (picture 1).
        Texture = "texture",
        /// After the threshold, T1 (picture 2).
        Thresholded = "thresholded",
        /// After sharpening, T2 (picture 3).
        Sharpened = "sharpened",
        /// Colored, before it is mapped to the flame's shape (picture 4).
        Colored = "colored",
    }
}

bansho_base::choice! {
    /// Which way a sheet looks.
    pub enum Facing {
        /// Turned about the vertical to face the camera.
        Camera = "camera",
        /// As `yaw_deg` says.
        Fixed = "fixed",
    }
}

bansho_base::parameters! {
    /// The outline of the flame and how its gas moves, eqs. (9) to (18).
    pub struct ShapeParameters {
        /// k, eq. (9): 0 starts slowly and accelerates much, 1 rises at one speed.
        initial_speed: f64 = 0.7, limits(FRACTION);
        /// h, eq. (11): slowest speed, at the edge, as a share of the fastest, on the axis.
        edge_speed: f64 = 0.55, limits(Range::new(0.02, 1.0));
        /// A(w), eq. (11): half width of the core that rises evenly, over height; 1 is the edge of the sheet.
        core_width: Curve = curve(&[[0.0, 0.26], [0.1, 0.44], [0.22, 0.54], [0.5, 0.38], [1.0, 0.12]]),
            limits(CurveLimits::unit_to(0.01, 1.0));
        /// D(w), eq. (11): width of the fringe that flutters, over height; begins at (0, 0). A + D must stay within 1.
        fringe_width: Curve = curve(&[[0.0, 0.0], [0.3, 0.22], [0.6, 0.42], [1.0, 0.4]]), limits(CurveLimits::default());
        /// 1 - F, eq. (11): how the gas slows across the fringe, from 0 at its inner edge to 1 at its outer one.
        slowing: Curve = curve(&[[0.0, 0.0], [0.5, 0.4], [1.0, 1.0]]), limits(CurveLimits::default().rising());
        /// Strength of P, eq. (15): how far the edge swings into the fringe; 0 leaves it still at its outer edge.
        flutter: f64 = 0.6, limits(FRACTION);
        /// Swings of the edge in a sheet height.
        flutter_waves: f64 = 1.1, limits(Range::new(0.1, 20.0)), unit("1/height");
        /// How far the tip wanders sideways, in sheet widths.
        sway: f64 = 0.05, limits(FRACTION);
        /// How often it wanders to and fro.
        sway_hz: f64 = 0.7, limits(Range::new(0.01, 20.0)), unit("Hz");
        /// How much the whole flame grows and shrinks, as a share of its height.
        flicker: f64 = 0.08, limits(Range::new(0.0, 0.5));
        /// How often it does; fires puff at about 1.5 / sqrt(width in m) Hz.
        flicker_hz: f64 = 2.0, limits(Range::new(0.01, 40.0)), unit("Hz");
    }
}

bansho_base::parameters! {
    /// The texture and how it is cut and sharpened, eqs. (4) to (6) and (20).
    pub struct TextureParameters {
        /// Which texture.
        kind: TextureKind = TextureKind::Fractal;
        /// Octaves of the paper's texture, a number that it does not give.
        octaves: i64 = 5, limits(Range::new(1.0, 6.0));
        /// Width of the fractal's tongues, 1 for about three across the flame.
        tongue_width: f64 = 1.0, limits(Range::new(0.1, 10.0));
        /// Length of the fractal's tongues, 1 for about half the flame's height.
        tongue_length: f64 = 1.0, limits(Range::new(0.1, 10.0));
        /// Contrast of the texture: 1 as it is, toward 0 an even gas, as in a still candle.
        contrast: f64 = 1.0, limits(FRACTION);
        /// V(w), eq. (4): threshold over height.
        threshold: Curve = curve(&[[0.0, 0.0], [0.25, 0.08], [0.6, 0.42], [0.85, 0.75], [1.0, 1.0]]),
            limits(CurveLimits::default().rising());
        /// H(u), eq. (4): threshold over the distance from the axis, 0 on the axis to 1 at both edges.
        threshold_across: Curve = curve(&[[0.0, 0.0], [0.5, 0.1], [0.82, 0.45], [1.0, 1.0]]), limits(CurveLimits::default().rising());
        /// C(s), eq. (6): begins at (0, 0), peaks below s = 1 and falls after, so that the core is not flat.
        sharpen: Curve = curve(&[[0.0, 0.0], [0.06, 0.22], [0.16, 0.48], [0.4, 0.82], [0.7, 1.0], [1.0, 0.86]]),
            limits(CurveLimits::default());
    }
}

bansho_base::parameters! {
    /// From the sharpened texture T2 to light, eq. (7) and beyond.
    pub struct ColorParameters {
        /// Which coloring.
        kind: Coloring = Coloring::BlackBody;
        /// Luminance of the brightest color.
        luminance: Animated<f64> = Animated::from(12_000.0), limits(Range::new(0.0, 1e7)), unit("cd/m^2");
        /// R(s), eq. (7), as a display shows it (sRGB-encoded); for `kind = "rgb_curves"`.
        red: Curve = curve(&[[0.0, 0.0], [0.25, 0.75], [0.5, 1.0], [1.0, 1.0]]), limits(CurveLimits::default());
        /// G(s), eq. (7), as a display shows it; for `kind = "rgb_curves"`.
        green: Curve = curve(&[[0.0, 0.0], [0.25, 0.12], [0.6, 0.62], [1.0, 0.98]]), limits(CurveLimits::default());
        /// B(s), eq. (7), as a display shows it; for `kind = "rgb_curves"`.
        blue: Curve = curve(&[[0.0, 0.0], [0.4, 0.02], [0.75, 0.2], [1.0, 0.72]]), limits(CurveLimits::default());
        /// Temperature of the soot where T2 is nearly 0: tips and edges.
        edge_temperature_k: f64 = 1100.0, limits(KELVIN), unit("K");
        /// Temperature of the soot where T2 is 1.
        core_temperature_k: f64 = 1950.0, limits(KELVIN), unit("K");
        /// How much the soot has cooled at the tip, as a share of its temperature; for `kind = "black_body"`.
        cooling: f64 = 0.17, limits(Range::new(0.0, 0.6));
        /// Optical depth of the soot where T2 is 1: how much the flame hides what is behind it.
        soot_optical_depth: f64 = 0.35, limits(Range::new(0.0, 20.0));
        /// Brightness and soot over height w, from the dark zone at the base.
        glow: Curve = curve(&[[0.0, 0.0], [0.1, 0.12], [0.3, 1.0], [1.0, 1.0]]), limits(CurveLimits::default());
        /// Luminance of the blue light at the base, as a share of `luminance`.
        base_blue: f64 = 0.0, limits(FRACTION);
    }
}

bansho_base::parameters! {
    /// Smoke above the flame: a second sheet of the same texture, cut softly.
    pub struct SmokeParameters {
        /// Greatest optical depth; 0 for no smoke.
        optical_depth: f64 = 0.0, limits(Range::new(0.0, 20.0));
        /// Share of the light that it scatters on rather than takes away.
        albedo: f64 = 0.55, limits(FRACTION);
        /// Tint of what it scatters, linear red, green and blue.
        color: [f64; 3] = [0.95, 0.97, 1.0], limits(FRACTION);
        /// Height of the smoke in flame heights.
        height: f64 = 3.0, limits(Range::new(0.1, 50.0));
        /// Width of the smoke at its top in flame widths.
        width: f64 = 2.0, limits(Range::new(0.1, 50.0));
        /// Where it begins, in flame heights above the base.
        base_height: f64 = 0.45, limits(Range::new(0.0, 10.0));
        /// How fast it scrolls beside the flame.
        speed: f64 = 0.35, limits(Range::new(0.0, 10.0));
        /// How much of the fire's own light reaches it from beneath.
        fire_light: f64 = 1.0, limits(Range::new(0.0, 100.0));
    }
}

bansho_base::parameters! {
    /// The light that the flame throws on others; follows what the flame radiates at each moment.
    pub struct LightParameters {
        /// Scale of that light; 0 for none.
        scale: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// How many point lights stand along the flame.
        count: i64 = 2, limits(Range::new(1.0, 3.0));
    }
}

bansho_base::parameters! {
    /// Another flame of the same kind.
    pub struct Instance {
        /// Where its base stands, from `position`.
        position: [f64; 3] = [0.0, 0.0, 0.0], unit("m");
        /// Its size beside the first.
        scale: f64 = 1.0, limits(Range::new(0.01, 100.0));
        /// How far it is ahead in time.
        phase_s: f64 = 0.0, unit("s");
        /// Turn about the vertical where sheets do not face the camera.
        yaw_deg: f64 = 0.0, limits(Range::new(-3600.0, 3600.0)), unit("degrees");
    }
}

bansho_base::parameters! {
    /// A small, near flame on an upright sheet (Ohshima & Itahashi): candle, torch, hearth, campfire.
    pub struct FlameSheetParameters {
        /// Where the middle of its base stands.
        position: Animated<[f64; 3]> = Animated::from([0.0, 0.0, 0.0]), unit("m");
        /// Width of the sheet.
        width: f64 = 1.1, limits(Range::new(0.001, 1000.0)), unit("m");
        /// Height of the sheet.
        height: f64 = 1.7, limits(Range::new(0.001, 1000.0)), unit("m");
        /// Which way it looks.
        facing: Facing = Facing::Camera;
        /// Turn about the vertical for `facing = "fixed"`; at 0 it looks along +z.
        yaw_deg: f64 = 0.0, limits(Range::new(-3600.0, 3600.0)), unit("degrees");
        /// Scroll speed s in sheet heights a second, eq. (1).
        speed: Animated<f64> = Animated::from(1.1), limits(Range::new(0.0, 100.0)), unit("1/s");
        /// How far it is ahead in time.
        phase_s: f64 = 0.0, unit("s");
        /// Another number gives another flame of the same kind.
        variation: i64 = 0, limits(Range::new(0.0, 1e6));
        /// How much the wind bends it; 0 not at all, 1 as the gas would drift.
        wind_response: f64 = 1.0, limits(Range::new(0.0, 10.0));
        /// Outline and motion.
        shape: ShapeParameters = ShapeParameters::default();
        /// Texture, threshold and sharpening.
        texture: TextureParameters = TextureParameters::default();
        /// Color and soot.
        color: ColorParameters = ColorParameters::default();
        /// Sparks.
        sparks: SparkParameters = SparkParameters::default();
        /// Smoke.
        smoke: SmokeParameters = SmokeParameters::default();
        /// Light on others.
        light: LightParameters = LightParameters::default();
        /// Flames at these places; one at `position` where the list is empty.
        instances: Vec<Instance> = Vec::new(), limits(Length { min: 0, max: 1000, item: () });
        /// Moments that are averaged while the shutter is open; `"auto"` follows the scroll in pixels.
        time_samples: Auto<i64> = Auto::Auto, limits(Range::new(1.0, 64.0));
        /// Which stage of the chain is shown.
        stage: Stage = Stage::Flame;
    }
}
