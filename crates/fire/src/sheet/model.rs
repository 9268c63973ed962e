//! A flame sheet: built once from its parameters, immutable.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    camera::{Camera, upright_quad::right_facing},
    host::{assets::Picture, constructions, once::get_or_compute},
    math::{self, DVec2, DVec3, random::Key},
    parameters::{ParameterError, ParameterErrorKind},
};

use super::{
    animate::{
        clock::Clock,
        warp::{FlameWaves, WarpState, WindLean},
    },
    eddies::Eddies,
    parameters::{
        ColorParameters, Facing, FlameSheetParameters, InstanceParameters, SheetMethod, TextureKind, TextureParameters,
    },
    soot_field::{self, SootFieldTables},
    tables::{color_ramp::ColorRamp, shape_tables::ShapeTables},
    texture::{FilterCache, FractalLayers, PaperSum, PeriodicLayer, TextureSource, paper_layer, picture_texels},
};

/// Fraction of full gas flow below which nothing is drawn: such a flame is less than a hundredth of its height.
const MIN_FLOW: f64 = 1e-5;

/// A flame sheet with all its instances, ready to be drawn at any time.
#[derive(Clone, Debug)]
pub struct FlameSheet {
    pub(super) name: String,
    pub(super) parameters: FlameSheetParameters,
    pub(super) clock: Clock,
    /// Computed when the sheet is first drawn: a scene may contain thousands of sheets, and each is constructed to check its parameters.
    pub(super) tables: OnceLock<Arc<Tables>>,
    /// Filtered textures of recent frames.
    pub(super) filter_cache: FilterCache,
    pub(super) flames: Vec<FlameInstance>,
}

impl FlameSheet {
    /// The flame sheet `name` of a scene; in a seamless loop it repeats every `loop_s` seconds.
    ///
    /// # Errors
    /// The parameters contradict each other, although each is within its bounds.
    pub fn new(
        parameters: FlameSheetParameters,
        name: &str,
        seed: u64,
        loop_s: Option<f64>,
    ) -> Result<Self, ParameterError> {
        Self::with_picture(parameters, name, seed, loop_s, None)
    }

    /// The same with the picture of `texture.file`, which `texture.kind = "picture"` needs.
    ///
    /// # Errors
    /// As those of [`new`](Self::new), or there is no picture although the texture is one.
    pub fn with_picture(
        parameters: FlameSheetParameters,
        name: &str,
        seed: u64,
        loop_s: Option<f64>,
        picture: Option<&Picture>,
    ) -> Result<Self, ParameterError> {
        if let Some(seconds) = loop_s.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
            return Err(ParameterError { key: "loop", kind: ParameterErrorKind::LoopLength { seconds } });
        }
        constructions::count("flame_sheet");
        let clock = Clock::new(parameters.speed.clone(), loop_s);
        ShapeTables::check(&parameters.shape)?;
        ColorRamp::check(&parameters.texture)?;
        soot_field::check(&parameters)?;
        let common_texture = common_texture(&parameters.texture, picture, &clock)?;
        let flames = flames(&parameters, name, seed, common_texture.as_ref(), &clock);
        Ok(Self {
            name: name.to_owned(),
            parameters,
            clock,
            tables: OnceLock::new(),
            filter_cache: FilterCache::new(flames.len()),
            flames,
        })
    }

    /// Its parameters.
    pub fn parameters(&self) -> &FlameSheetParameters {
        &self.parameters
    }

    /// E(w, t) of eq. (15), left and right, at time `t` in s of the first instance, over the height w.
    pub fn edges(&self, t: f64) -> impl Fn(f64) -> [f64; 2] + use<> {
        let no_wind = WindLean { across: 0.0, toward: 0.0 };
        let warp = self.flames.first().map(|flame| {
            let time = self.flame_time(flame, t);
            WarpState::new(&self.parameters, self.shape(), &flame.waves, &self.clock, time, no_wind)
        });
        move |w| warp.as_ref().map_or([0.0; 2], |warp| warp.edges.at(w as f32).map(f64::from))
    }

    pub(super) fn tables(&self) -> &Tables {
        let FlameSheetParameters { shape, texture, color, stage, .. } = &self.parameters;
        let has_soot_field = self.parameters.method == SheetMethod::SootField;
        let tables: &Arc<Tables> = get_or_compute(&self.tables, || {
            Arc::new(Tables {
                shape: Box::new(ShapeTables::new(shape, texture, color, |y| self.eddy_reach(y))),
                ramp: Box::new(ColorRamp::new(texture, color, *stage)),
                soot_field: has_soot_field.then(|| Box::new(SootFieldTables::new(&self.parameters.soot_field, color))),
            })
        });
        tables
    }

    /// Takes the tables of `previous`, if its parameters give the same: a program changes position, flow and luminance far more often than shape and colors.
    pub(super) fn share_tables(&mut self, previous: &Self) {
        let (own, other) = (&self.parameters, &previous.parameters);
        let is_same_color =
            ColorParameters { luminance: own.color.luminance.clone(), ..other.color.clone() } == own.color;
        // The proportions of the sheet determine how far its eddies reach.
        if (&own.shape, &own.texture, own.stage) == (&other.shape, &other.texture, other.stage)
            && (own.width, own.height) == (other.width, other.height)
            && (own.method, &own.soot_field) == (other.method, &other.soot_field)
            && is_same_color
        {
            self.tables.clone_from(&previous.tables);
        }
    }

    /// Largest displacement by the eddies at height `y`, which is the same for all flames, in sheet widths and heights.
    fn eddy_reach(&self, y: f32) -> [f32; 2] {
        let eddies = self.flames.first().and_then(|flame| flame.eddies.as_ref());
        eddies.map_or([0.0; 2], |eddies| eddies.reach(y))
    }

    /// The mapping to flame coordinates and the threshold: tables that do not change with time.
    pub(crate) fn shape(&self) -> &ShapeTables {
        &self.tables().shape
    }

    /// The table from T1 to light.
    pub(crate) fn ramp(&self) -> &ColorRamp {
        &self.tables().ramp
    }

    /// Tables of the soot field; `None` for other methods.
    pub(crate) fn soot_field(&self) -> Option<&SootFieldTables> {
        self.tables().soot_field.as_deref()
    }
}

/// Tables that depend on the parameters alone.
#[derive(Clone, Debug)]
pub(super) struct Tables {
    pub(super) shape: Box<ShapeTables>,
    pub(super) ramp: Box<ColorRamp>,
    /// Only for that method.
    pub(super) soot_field: Option<Box<SootFieldTables>>,
}

/// One instance of a flame: its placement, fluctuations and texture.
#[derive(Clone, Debug)]
pub(crate) struct FlameInstance {
    pub(crate) placement: InstanceParameters,
    pub(crate) key: Key,
    pub(crate) waves: FlameWaves,
    pub(crate) texture_source: TextureSource,
    pub(crate) eddies: Option<Eddies>,
}

impl FlameInstance {
    /// Texels per sheet height of its texture. Eddies squeeze those of a texture, and theirs may be finer.
    pub(crate) fn texels_up(&self) -> f64 {
        const SQUEEZED: f64 = 1.5;
        let texels_up = self.texture_source.texels_up();
        self.eddies.as_ref().map_or(texels_up, |eddies| SQUEEZED * texels_up.max(eddies.texels_up()))
    }
}

impl FlameSheet {
    /// Center of a flame's base at `t`, m.
    pub(crate) fn base(&self, flame: &FlameInstance, t: f64) -> DVec3 {
        DVec3::from(self.parameters.position.at(self.clock.time(t))) + DVec3::from(flame.placement.position)
    }

    /// Motion of the flames' bases between two times, m; a jump by step keys is none.
    pub(crate) fn base_displacement(&self, from: f64, to: f64) -> DVec3 {
        DVec3::from(self.parameters.position.displacement(self.clock.time(from), self.clock.time(to)))
    }

    /// A flame's own time, with its phase.
    pub(crate) fn flame_time(&self, flame: &FlameInstance, t: f64) -> f64 {
        t + self.parameters.phase_s + flame.placement.phase_s
    }

    /// Width and height of a flame's sheet, m.
    pub(crate) fn sheet_size(&self, flame: &FlameInstance) -> DVec2 {
        DVec2::new(self.parameters.width, self.parameters.height) * flame.placement.scale
    }

    /// Mean speed of the rising gas, m/s.
    pub(crate) fn rise_speed(&self, flame: &FlameInstance, t: f64) -> f64 {
        // The texture passes over a height in 1/s seconds, whatever the acceleration.
        self.clock.speed(t) * self.sheet_size(flame).y
    }

    /// Horizontal direction across a flame's sheet.
    pub(crate) fn right(&self, flame: &FlameInstance, camera: &Camera, base: DVec3) -> DVec3 {
        match self.parameters.facing {
            Facing::Camera => right_facing(camera, base),
            Facing::Fixed => {
                let (sin, cos) = math::sin_cos((self.parameters.yaw_deg + flame.placement.yaw_deg).to_radians());
                DVec3::new(cos, 0.0, -sin)
            }
        }
    }

    /// Luminance of the brightest color at `t`, cd/m^2.
    pub(crate) fn luminance_at(&self, t: f64) -> f64 {
        /// Fraction of full flow below which a flame that goes out has too little soot for its full luminance.
        const DARK_FLOW: f64 = 0.2;
        self.parameters.color.luminance.at(self.clock.time(t)) * (self.flow_at(t) / DARK_FLOW).min(1.0)
    }

    /// Gas flow at `t` as a fraction of full flow.
    pub(crate) fn flow_at(&self, t: f64) -> f64 {
        self.parameters.flow.at(self.clock.time(t))
    }

    /// Whether nothing burns at `t`.
    pub(crate) fn is_out(&self, t: f64) -> bool {
        self.flow_at(t) < MIN_FLOW
    }

    /// Height at `t` as a fraction of that at full flow: the power 2/5 of the heat release rate (Heskestad 1983).
    pub(crate) fn height_fraction(&self, t: f64) -> f64 {
        match self.flow_at(t) {
            1.0 => 1.0,
            flow => math::pow(flow.max(MIN_FLOW), 0.4),
        }
    }
}

/// The texture that all instances of a flame have in common; `None` for the fractal, whose layers differ.
fn common_texture(
    texture: &TextureParameters,
    picture: Option<&Picture>,
    clock: &Clock,
) -> Result<Option<TextureSource>, ParameterError> {
    let octaves = texture.octaves as u32;
    let periodic = |layer: PeriodicLayer| Some(TextureSource::Periodic(Arc::new(layer)));
    Ok(match texture.kind {
        TextureKind::Fractal => None,
        TextureKind::OhshimaItahashi => periodic(paper_layer(octaves, clock)),
        TextureKind::OhshimaItahashiExact => Some(TextureSource::Exact(PaperSum::new(octaves, clock))),
        TextureKind::Picture => {
            let kind = ParameterErrorKind::NoFile { other: "`texture.kind` is \"picture\"" };
            let picture = picture.ok_or(ParameterError { key: "texture.file", kind })?;
            periodic(PeriodicLayer::new(&picture_texels(picture), texture.picture_size, clock))
        }
    })
}

/// The flames at all placements.
fn flames(
    parameters: &FlameSheetParameters,
    name: &str,
    seed: u64,
    common_texture: Option<&TextureSource>,
    clock: &Clock,
) -> Vec<FlameInstance> {
    let placements = if parameters.instances.is_empty() {
        vec![InstanceParameters::default()]
    } else {
        parameters.instances.clone()
    };
    let mut flames = Vec::with_capacity(placements.len());
    for (index, placement) in placements.into_iter().enumerate() {
        let key = instance_key(seed, name, parameters.variation, index);
        let texture_source = common_texture.cloned().unwrap_or_else(|| {
            let layers = FractalLayers::new(tongue_size(parameters), 1.0, key, clock);
            TextureSource::Fractal(layers.overlapping(parameters.texture.overlap))
        });
        let waves = FlameWaves::new(&parameters.shape, key, clock);
        let eddies = Eddies::new(parameters, key, clock);
        flames.push(FlameInstance { placement, key, waves, texture_source, eddies });
    }
    flames
}

/// Width and length of the fractal's tongues relative to the default, in sheet widths and heights: their shape in meters does not depend on the aspect ratio
/// of the sheet.
fn tongue_size(parameters: &FlameSheetParameters) -> [f64; 2] {
    /// Width over height of the sheet to which the parameters `tongue_width` and `tongue_length` refer.
    const REFERENCE_ASPECT: f64 = 0.65;
    let aspect = parameters.width / parameters.height / REFERENCE_ASPECT;
    [parameters.texture.tongue_width / aspect.clamp(0.05, 20.0), parameters.texture.tongue_length]
}

/// Key of the random numbers of one instance.
fn instance_key(seed: u64, name: &str, variation: i64, index: usize) -> Key {
    Key::new(seed, &format!("{name}/{variation}/{index}"))
}
