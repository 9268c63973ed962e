//! Parameters of the flame sheet. Symbols and equation numbers are those of Ohshima and Itahashi.

use bansho_base::{
    math::curve::{Curve, Interpolation},
    parameters::{AssetPath, Auto, CurveLimits, Length, Range, animated::Animated},
};

use crate::sparks::SparkParameters;

const FRACTION: Range = Range::new(0.0, 1.0);
const KELVIN: Range = Range::new(600.0, 4000.0);

/// A default curve; its points are literals below.
fn curve(points: &[[f64; 2]]) -> Curve {
    Curve::new(points.to_vec(), Interpolation::Monotone).expect("default points ascend")
}

bansho_base::choice! {
    /// The texture that represents the gas.
    pub enum TextureKind {
        /// Layers of warped gradient noise that rise at different speeds; no visible repetition.
        Fractal = "fractal",
        /// The paper's sum of cosines, eq. (20), halved so that it lies in [0, 1]; repeats every 0.483 sheet heights.
        OhshimaItahashi = "ohshima_itahashi",
        /// The same sum, evaluated at every pixel instead of looked up in a filtered table, as in the paper: slower, and not antialiased.
        OhshimaItahashiExact = "ohshima_itahashi_exact",
        /// A picture, section 3.1 of the paper: the gray levels of `file`, which repeats across and up.
        Picture = "picture",
    }
}

bansho_base::choice! {
    /// How the sharpened texture T2 becomes color.
    pub enum Coloring {
        /// T2 determines temperature and density of the soot; its light follows from Planck's law.
        BlackBody = "black_body",
        /// The curves `red`, `green` and `blue`, eq. (7).
        RgbCurves = "rgb_curves",
    }
}

bansho_base::choice! {
    /// Stage of the computation that is shown. All stages but `flame` show the flat texture square (u, w), as the paper's pictures 1 to 4.
    pub enum SheetStage {
        /// The finished flame.
        Flame = "flame",
        /// The texture T0 (picture 1).
        FlameTexture = "texture",
        /// T1, after the threshold (picture 2).
        Thresholded = "thresholded",
        /// T2, after sharpening (picture 3).
        Sharpened = "sharpened",
        /// After coloring, before the mapping to the shape of the flame (picture 4).
        Colored = "colored",
    }
}

bansho_base::choice! {
    /// How flame and smoke are computed.
    pub enum SheetMethod {
        /// A scrolling texture, thresholded, colored and mapped, eqs. (1) to (20); `smoke` adds a second sheet.
        FlameTexture = "texture",
        /// One field of soot temperature and density that a fractal field stirs, with the parameters `soot_field`: hot soot is flame, cool soot smoke (picture 9).
        SootField = "soot_field",
    }
}

bansho_base::choice! {
    /// Direction that a sheet faces.
    pub enum Facing {
        /// Toward the camera, by rotation about the vertical.
        Camera = "camera",
        /// Fixed, as given by `yaw_deg`.
        Fixed = "fixed",
    }
}

bansho_base::parameters! {
    /// Outline of the flame and motion of its gas, eqs. (9) to (18).
    pub struct SheetShapeParameters {
        /// k, eq. (9): initial speed of the gas. At 0 it starts from rest and accelerates, at 1 its speed is constant.
        initial_speed: f64 = 0.7, limits(FRACTION);
        /// h, eq. (11): speed at the edge, where it is lowest, as a fraction of the speed on the axis.
        edge_speed: f64 = 0.55, limits(Range::new(0.02, 1.0));
        /// A(w), eq. (11): half width of the core, which rises at uniform speed, as a function of height; 1 is the edge of the sheet.
        core_width: Curve = curve(&[[0.0, 0.6], [0.3, 0.5], [0.6, 0.35], [1.0, 0.15]]),
            limits(CurveLimits::unit_to(0.01, 1.0));
        /// D(w), eq. (11): width of the fringe, which flutters, as a function of height; it starts at (0, 0). A + D must not exceed 1.
        fringe_width: Curve = curve(&[[0.0, 0.0], [0.1, 0.25], [0.4, 0.35], [1.0, 0.4]]), limits(CurveLimits::default());
        /// 1 - F, eq. (11): decrease of speed across the fringe, from 0 at its inner edge to 1 at its outer edge.
        slowing: Curve = curve(&[[0.0, 0.0], [0.5, 0.4], [1.0, 1.0]]), limits(CurveLimits::default().rising());
        /// Strength of P, eq. (15): how far the edge moves into the fringe. At 0 it stays at the outer edge.
        flutter: f64 = 0.3, limits(FRACTION);
        /// P, eq. (15), along one wave of the edge, instead of a random one: 1 is the outer edge of the fringe, 0 the inner. It repeats, so that its ends should
        /// agree; on the left it is half a wave later. `flutter` is its strength, and `flutter_waves` the number of its waves.
        flutter_curve: Option<Curve> = None, limits(CurveLimits::default());
        /// B(x), height of what burns as a function of x, in sheet heights. It hides the flame below; it is itself not drawn.
        fuel_outline: Curve = curve(&[[0.0, 0.0], [1.0, 0.0]]), limits(CurveLimits::default());
        /// How much the columns of the texture follow the outline: at 1 they are squeezed and spread with it, eq. (16), and meet where it closes; at 0 they
        /// are parallel, and the outline cuts through them.
        convergence: f64 = 0.3, limits(FRACTION);
        /// Strength of the eddies that roll along the edges and carry the gas sideways; at 0 there are none, at 1 they turn by about a third of a turn.
        eddies: f64 = 0.55, limits(Range::new(0.0, 2.0));
        /// Distance from one eddy to the next along an edge, in sheet widths. With the speed of the eddies it gives the frequency at which the flame puffs.
        eddy_size: f64 = 0.45, limits(Range::new(0.05, 10.0));
        /// Speed at which the eddies rise, relative to that of the gas.
        eddy_speed: f64 = 0.4, limits(Range::new(0.01, 2.0));
        /// Height at which the eddies have grown to their full strength, in sheet heights.
        eddy_height: f64 = 0.4, limits(Range::new(0.01, 2.0));
        /// Waves of the edge per sheet height.
        flutter_waves: f64 = 1.1, limits(Range::new(0.1, 20.0)), unit("1/height");
        /// Sideways amplitude of the tip, in sheet widths.
        sway: f64 = 0.05, limits(FRACTION);
        /// Frequency of the sideways motion.
        sway_hz: f64 = 0.7, limits(Range::new(0.01, 20.0)), unit("Hz");
        /// Amplitude of the variation of the flame's height, as a fraction of the height.
        flicker: f64 = 0.08, limits(Range::new(0.0, 0.5));
        /// Frequency of the variation in height. Real fires puff at about 1.5 / sqrt(width in m) Hz.
        flicker_hz: f64 = 2.0, limits(Range::new(0.01, 40.0)), unit("Hz");
    }
}

bansho_base::parameters! {
    /// Texture, threshold and sharpening, eqs. (4) to (6) and (20).
    pub struct TextureParameters {
        /// Kind of texture.
        kind: TextureKind = TextureKind::Fractal;
        /// The picture of `kind = "picture"`: gray levels from 0 to 1 (the codes of a PNG or JPEG as fractions of the largest, the numbers of an EXR file), which
        /// are best distributed uniformly. It is resampled to 256 x 512 values.
        file: Option<AssetPath> = None;
        /// Width and height that the picture covers before it repeats, in sheet widths and heights.
        picture_size: [f64; 2] = [1.0, 1.0], limits(Range::new(0.05, 20.0));
        /// Whether the two layers of the fractal texture are flames one behind the other, each with its own threshold and tongues, whose soot adds; else they
        /// are mixed into one.
        overlap: bool = true;
        /// Number of octaves of the paper's texture. The paper does not state it.
        octaves: i64 = 5, limits(Range::new(1.0, 6.0));
        /// Width of the tongues of the fractal texture; at 1 there are about three across the flame.
        tongue_width: f64 = 1.0, limits(Range::new(0.1, 10.0));
        /// Length of the tongues of the fractal texture; at 1 about half the flame's height.
        tongue_length: f64 = 1.0, limits(Range::new(0.1, 10.0));
        /// Contrast of the texture. At 0 the gas is uniform, as in the flame of a candle in still air; 1 leaves the texture unchanged.
        contrast: f64 = 1.0, limits(FRACTION);
        /// How much the soot thins where the threshold L is high, toward the tips and the sides: T1 is multiplied by 1 - thinning L, so that edges are soft
        /// there. At 0 all edges are alike.
        thinning: f64 = 0.6, limits(FRACTION);
        /// V(w), eq. (4): threshold as a function of height.
        threshold: Curve = curve(&[[0.0, 1.0], [0.05, 0.6], [0.15, 0.25], [0.3, 0.25], [0.6, 0.55], [0.85, 0.85], [1.0, 1.0]]),
            limits(CurveLimits::default());
        /// H(u), eq. (4): threshold as a function of the distance from the axis, from 0 on the axis to 1 at both edges.
        threshold_across: Curve = curve(&[[0.0, 0.0], [0.5, 0.1], [0.82, 0.45], [1.0, 1.0]]), limits(CurveLimits::default().rising());
        /// C(s), eq. (6): sharpening. It starts at (0, 0). A maximum below s = 1 keeps the core from being uniform.
        sharpen: Curve = curve(&[[0.0, 0.0], [0.02, 0.18], [0.07, 0.44], [0.16, 0.68], [0.36, 0.97], [0.6, 1.0], [1.0, 0.93]]),
            limits(CurveLimits::default());
    }
    paper: kind, octaves, file, picture_size;
}

bansho_base::parameters! {
    /// Light from the sharpened texture T2, eq. (7) and extensions.
    pub struct ColorParameters {
        /// Method of coloring.
        kind: Coloring = Coloring::BlackBody;
        /// Luminance of the brightest color.
        luminance: Animated<f64> = Animated::from(12_000.0), limits(Range::new(0.0, 1e7)), unit("cd/m^2");
        /// R(s), eq. (7), sRGB-encoded; for `kind = "rgb_curves"`.
        red: Curve = curve(&[[0.0, 0.0], [0.25, 0.75], [0.5, 1.0], [1.0, 1.0]]), limits(CurveLimits::default());
        /// G(s), eq. (7), sRGB-encoded; for `kind = "rgb_curves"`.
        green: Curve = curve(&[[0.0, 0.0], [0.25, 0.12], [0.6, 0.62], [1.0, 0.98]]), limits(CurveLimits::default());
        /// B(s), eq. (7), sRGB-encoded; for `kind = "rgb_curves"`.
        blue: Curve = curve(&[[0.0, 0.0], [0.4, 0.02], [0.75, 0.2], [1.0, 0.72]]), limits(CurveLimits::default());
        /// Temperature of the soot where T2 is close to 0, at tips and edges.
        edge_temperature_k: f64 = 1100.0, limits(KELVIN), unit("K");
        /// Temperature of the soot where T2 is 1.
        core_temperature_k: f64 = 1950.0, limits(KELVIN), unit("K");
        /// Decrease of the soot temperature toward the tip, as a fraction of the temperature; for `kind = "black_body"`.
        cooling: f64 = 0.17, limits(Range::new(0.0, 0.6));
        /// Optical depth of the soot where T2 is 1. It determines how much light from behind the flame absorbs.
        soot_optical_depth: f64 = 0.35, limits(Range::new(0.0, 20.0));
        /// Factor of brightness and soot as a function of height w; low in the dark zone at the base.
        glow: Curve = curve(&[[0.0, 0.0], [0.08, 0.25], [0.2, 0.85], [0.35, 1.0], [1.0, 1.0]]), limits(CurveLimits::default());
        /// Luminance of the blue light at the base, as a fraction of `luminance`.
        base_blue: f64 = 0.0, limits(FRACTION);
    }
    paper: kind, red, green, blue;
}

bansho_base::parameters! {
    /// Smoke above the flame: a second sheet with the same texture and a soft threshold.
    pub struct SmokeParameters {
        /// Maximum optical depth; 0 for no smoke.
        optical_depth: f64 = 0.0, limits(Range::new(0.0, 20.0));
        /// Single-scattering albedo: fraction of the attenuated light that is scattered instead of absorbed.
        albedo: f64 = 0.55, limits(FRACTION);
        /// Tint of the scattered light, linear red, green and blue.
        color: [f64; 3] = [0.95, 0.97, 1.0], limits(FRACTION);
        /// Height of the smoke in flame heights.
        height: f64 = 3.0, limits(Range::new(0.1, 50.0));
        /// Width of the smoke at its top in flame widths.
        width: f64 = 2.0, limits(Range::new(0.1, 50.0));
        /// Height at which it starts, in flame heights above the base.
        base_height: f64 = 0.45, limits(Range::new(0.0, 10.0));
        /// Scroll speed relative to that of the flame.
        speed: f64 = 0.35, limits(Range::new(0.0, 10.0));
        /// Factor of the flame's own light that illuminates the smoke from below.
        fire_light: f64 = 1.0, limits(Range::new(0.0, 100.0));
    }
}

bansho_base::parameters! {
    /// Flame and smoke as one plume of soot, whose temperature and density a fractal field stirs (section 5 and picture 9 of the paper); for
    /// `method = "soot_field"`. The soot glows at up to `color.core_temperature_k`.
    pub struct SootFieldParameters {
        /// Optical depth of the soot through the axis at the base of the plume.
        optical_depth: f64 = 2.5, limits(Range::new(0.0, 100.0));
        /// Half width of the plume at its base, in sheet widths: where its density is 1/e of that on the axis.
        base_half_width: f64 = 0.09, limits(Range::new(0.005, 0.5));
        /// Growth of the half width with height, in sheet widths per sheet height.
        spread: f64 = 0.2, limits(FRACTION);
        /// Exponent of the dilution: the optical depth on the axis falls as the half width to the power of minus this.
        dilution: f64 = 0.3, limits(Range::new(0.0, 2.0));
        /// Height up to which the soot burns and stays hot, in sheet heights. Above it the excess temperature falls as in a buoyant plume, as the height to
        /// the power -5/3.
        flame_height: f64 = 0.28, limits(Range::new(0.01, 2.0));
        /// How much faster than the density the excess temperature falls toward the edge; at 1 equally fast, at 0 not at all.
        edge_cooling: f64 = 0.7, limits(Range::new(0.0, 4.0));
        /// Temperature of the surrounding air, to which the soot cools.
        ambient_temperature_k: f64 = 290.0, limits(Range::new(100.0, 600.0)), unit("K");
        /// Displacement by the fractal field, in sheet widths (root mean square of each component); 0 for an undisturbed plume.
        stir: f64 = 0.12, limits(FRACTION);
        /// Height at which the displacement reaches `stir`, in sheet heights; it starts from 0 at the base.
        stir_height: f64 = 0.25, limits(Range::new(0.01, 2.0));
        /// Size of the largest eddies, in sheet widths.
        eddy_size: f64 = 0.3, limits(Range::new(0.02, 5.0));
        /// Number of octaves of the fractal field.
        octaves: i64 = 5, limits(Range::new(1.0, 5.0));
        /// Amplitude of each octave relative to that of the previous one, whose eddies are twice as large; at 0.5 displacements are proportional to the size
        /// of the eddies.
        gain: f64 = 0.58, limits(FRACTION);
        /// Single-scattering albedo of the soot: fraction of the attenuated light that it scatters instead of absorbing it.
        albedo: f64 = 0.25, limits(FRACTION);
        /// Factor of the flame's own light that the smoke scatters.
        fire_light: f64 = 1.0, limits(Range::new(0.0, 100.0));
    }
}

bansho_base::parameters! {
    /// Light of the flame on other objects. It follows the flame's emission over time.
    pub struct FlameLightParameters {
        /// Factor of that light; 0 for none.
        scale: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Number of point lights along the flame.
        count: i64 = 2, limits(Range::new(1.0, 3.0));
    }
}

bansho_base::parameters! {
    /// An instance of the flame.
    pub struct InstanceParameters {
        /// Position of its base relative to `position` of the flame.
        position: [f64; 3] = [0.0, 0.0, 0.0], unit("m");
        /// Size relative to `width` and `height` of the flame.
        scale: f64 = 1.0, limits(Range::new(0.01, 100.0));
        /// Time offset: how far it is ahead.
        phase_s: f64 = 0.0, unit("s");
        /// Rotation about the vertical for `facing = "fixed"`, added to that of the flame.
        yaw_deg: f64 = 0.0, limits(Range::new(-3600.0, 3600.0)), unit("degrees");
    }
}

bansho_base::parameters! {
    /// A small, near flame on an upright sheet (Ohshima & Itahashi): candle, torch, hearth, campfire.
    pub struct FlameSheetParameters {
        /// Position of the center of its base.
        position: Animated<[f64; 3]> = Animated::from([0.0, 0.0, 0.0]), unit("m");
        /// Width of the sheet.
        width: f64 = 1.4, limits(Range::new(0.001, 1000.0)), unit("m");
        /// Height of the sheet.
        height: f64 = 1.6, limits(Range::new(0.001, 1000.0)), unit("m");
        /// Direction that the sheet faces.
        facing: Facing = Facing::Camera;
        /// Rotation about the vertical for `facing = "fixed"`; at 0 it faces +z.
        yaw_deg: f64 = 0.0, limits(Range::new(-3600.0, 3600.0)), unit("degrees");
        /// Scroll speed s, eq. (1), in sheet heights per second.
        speed: Animated<f64> = Animated::from(1.1), limits(Range::new(0.0, 100.0)), unit("1/s");
        /// Gas flow as a fraction of full flow: the height of the flame is proportional to its power of 2/5 (Heskestad 1983), and fewer sparks and less smoke
        /// rise. At 0 it is out.
        flow: Animated<f64> = Animated::from(1.0), limits(FRACTION);
        /// Time offset: how far it is ahead.
        phase_s: f64 = 0.0, unit("s");
        /// Number that selects other random numbers for an otherwise equal flame.
        variation: i64 = 0, limits(Range::new(0.0, 1e6));
        /// Response to the wind: 0 for none, 1 for gas that drifts with the wind.
        wind_response: f64 = 1.0, limits(Range::new(0.0, 10.0));
        /// How flame and smoke are computed. `"soot_field"` does not use `texture`, and of `shape` only `initial_speed`, sway and flicker.
        method: SheetMethod = SheetMethod::FlameTexture;
        /// Outline and motion.
        shape: SheetShapeParameters = SheetShapeParameters::default();
        /// Texture, threshold and sharpening.
        texture: TextureParameters = TextureParameters::default();
        /// Color and soot.
        color: ColorParameters = ColorParameters::default();
        /// Sparks.
        sparks: SparkParameters = SparkParameters::default();
        /// Smoke.
        smoke: SmokeParameters = SmokeParameters::default();
        /// Flame and smoke as one field, for `method = "soot_field"`.
        soot_field: SootFieldParameters = SootFieldParameters::default();
        /// Light on other objects.
        light: FlameLightParameters = FlameLightParameters::default();
        /// Instances of the flame; an empty list is one instance at `position`.
        instances: Vec<InstanceParameters> = Vec::new(), limits(Length { min: 0, max: 1000, item: () });
        /// Number of time samples that are averaged over the exposure; `"auto"` depends on the scroll in pixels.
        time_samples: Auto<i64> = Auto::Auto, limits(Range::new(1.0, 64.0));
        /// Stage of the computation that is shown.
        stage: SheetStage = SheetStage::Flame;
    }
    paper: stage;
}
