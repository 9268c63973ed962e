//! Parameters of the particle flame. Symbols and equation numbers are those of Inagaki et al.

use bansho_base::parameters::{AssetPath, Auto, Length, Range, animated::Animated};
use bansho_sph::KernelShape;

use crate::sparks::SparkParameters;

const FRACTION: Range = Range::new(0.0, 1.0);
const LENGTH: Range = Range::new(1e-3, 1e4);
const KELVIN: Range = Range::new(250.0, 4000.0);

bansho_base::choice! {
    /// Shape of the area that gas comes from.
    pub enum BurnerShape {
        /// A round area that faces along the burner's y axis.
        Disk = "disk",
        /// A point: gas starts within a ball of `diameter`.
        Point = "point",
        /// A strip along the burner's x axis, `length` long and `diameter` wide.
        Line = "line",
        /// The surface of a box of `size`.
        Box = "box",
        /// The surface of the mesh in `file`, a glTF.
        Mesh = "mesh",
    }
}

bansho_base::choice! {
    /// What becomes of the pressure, eq. (11), in gas thinner than rho_0.
    pub enum NegativePressure {
        /// It is 0.
        Clamped = "clamped",
        /// It is negative, as in the paper: thin gas pulls itself into strings.
        Allowed = "allowed",
    }
}

bansho_base::choice! {
    /// What becomes of a particle's temperature.
    pub enum TemperatureLaw {
        /// It heats where it burns, and cools by mixing with air and by radiation.
        Simulated = "simulated",
        /// It stays what it was at birth, as in the paper.
        Constant = "constant",
    }
}

bansho_base::choice! {
    /// How the wind acts.
    pub enum WindForce {
        /// Air that the gas mixes with brings its own momentum: gas takes up the wind's velocity as it mixes.
        Entrainment = "entrainment",
        /// The wind's velocity, times `wind_response`, is a force per volume, as in the paper.
        BodyForce = "body_force",
    }
}

bansho_base::parameters! {
    /// Where burning gas comes from. Its heat release rate and its size say all that is needed.
    pub struct BurnerParameters {
        /// Shape of the area.
        shape: BurnerShape = BurnerShape::Disk;
        /// Where its middle is, from `position` of the flame. Gas leaves a moving burner where it is then, no faster for its motion.
        position: Animated<[f64; 3]> = Animated::from([0.0, 0.0, 0.0]), unit("m");
        /// Turn about x, then y, then z; unturned it blows upward.
        rotation_deg: [f64; 3] = [0.0, 0.0, 0.0], limits(Range::new(-3600.0, 3600.0)), unit("degrees");
        /// Diameter D of a disk or a point, width of a line.
        diameter: f64 = 0.3, limits(LENGTH), unit("m");
        /// Length of a line.
        length: f64 = 1.0, limits(LENGTH), unit("m");
        /// Sides of a box.
        size: [f64; 3] = [0.3, 0.3, 0.3], limits(LENGTH), unit("m");
        /// glTF file of a mesh.
        file: Option<AssetPath> = None;
        /// How many times larger a mesh is than its file says.
        scale: f64 = 1.0, limits(Range::new(1e-4, 1e4));
        /// Heat release rate Q; with the size it gives the flame its height (Heskestad 1983).
        heat_release_kw: f64 = 60.0, limits(Range::new(1e-3, 1e6)), unit("kW");
        /// Height of the flame; `"auto"` is Heskestad's `0.235 Q^(2/5) - 1.02 D`, at least `D / 2`.
        height: Auto<f64> = Auto::Auto, limits(LENGTH), unit("m");
        /// Speed at which gas leaves the burner; `"auto"` follows from its size.
        speed: Auto<f64> = Auto::Auto, limits(Range::new(0.0, 100.0)), unit("m/s");
        /// Temperature of the gas at birth.
        temperature_k: f64 = 1150.0, limits(KELVIN), unit("K");
        /// How much of the gas flows, over time: 0 shuts the burner.
        flow: Animated<f64> = Animated::from(1.0), limits(FRACTION);
    }
}

bansho_base::parameters! {
    /// Smoothed particle hydrodynamics, section 4.
    pub struct FluidParameters {
        /// Support radius d, eq. (2), in mean distances of particles at the burner.
        support_radius: f64 = 2.3, limits(Range::new(1.2, 6.0)), unit("distances");
        /// Density of reference rho_0, eq. (11), as a share of the density at the burner.
        rest_density: f64 = 0.8, limits(Range::new(0.0, 10.0));
        /// Speed of sound, `sqrt(k)` of eq. (11) at the burner's temperature, in speeds of the gas there: how hard it resists being
        /// pressed.
        stiffness: f64 = 1.2, limits(Range::new(0.0, 20.0));
        /// Kernel of the pressure force, eq. (12). The paper's is `"poly6"`, whose gradient vanishes at the center, so that particles clump.
        pressure_kernel: KernelShape = KernelShape::Spiky;
        /// Pressure of thin gas, eq. (11).
        negative_pressure: NegativePressure = NegativePressure::Clamped;
        /// How far neighbors even out their velocities in a hundredth of a second; 0 is the paper's Euler equation, eq. (1).
        viscosity: f64 = 0.12, limits(FRACTION);
        /// How far neighbors even out temperature in a hundredth of a second.
        conduction: f64 = 0.08, limits(FRACTION);
        /// Sub-steps that a step is cut into at most. Gas that would need more keeps its time and gives way more easily.
        max_substeps: i64 = 3, limits(Range::new(1.0, 100.0));
    }
}

bansho_base::parameters! {
    /// What moves the gas beside its own pressure.
    pub struct ForceParameters {
        /// Buoyancy against the air, 1 is physical; 0 in the paper.
        buoyancy: f64 = 1.0, limits(Range::new(0.0, 10.0));
        /// How the wind acts.
        wind_model: WindForce = WindForce::Entrainment;
        /// Scale of the wind's effect; for `wind_model = "body_force"` force per volume and wind speed, in N s/m^4.
        wind_response: f64 = 1.0, limits(Range::new(0.0, 100.0));
        /// Entrainment coefficient: speed at which air enters the gas, as a share of the speed between them; slows, dilutes and cools it.
        entrainment: f64 = 0.12, limits(FRACTION);
        /// How far rising gas that grows faster grows narrower too; 1 keeps its volume.
        plume_contraction: f64 = 0.9, limits(FRACTION);
        /// Strength of the vortex rings that the fire sheds as it breathes; 1 is usual, 0 is a fire that does not puff.
        puffing: f64 = 1.0, limits(Range::new(0.0, 5.0));
        /// How often it sheds them; `"auto"` is `1.5 / sqrt(D)` Hz (Cetegen and Ahmed 1993).
        puffing_hz: Auto<f64> = Auto::Auto, limits(Range::new(0.01, 100.0)), unit("Hz");
        /// Turbulence: standard deviation of a velocity component, as a share of the speed of the gas; 0 in the paper.
        turbulence: f64 = 0.2, limits(Range::new(0.0, 2.0));
        /// Size of the largest eddies, in burner diameters.
        eddy_size: f64 = 0.8, limits(Range::new(0.05, 20.0)), unit("diameters");
    }
}

bansho_base::parameters! {
    /// How gas burns and what becomes of it.
    pub struct CombustionParameters {
        /// What becomes of its temperature.
        temperature_model: TemperatureLaw = TemperatureLaw::Simulated;
        /// Temperature that burning gas nears.
        flame_temperature_k: f64 = 1900.0, limits(KELVIN), unit("K");
        /// How long it takes to heat up.
        heating_time_s: f64 = 0.03, limits(Range::new(1e-3, 10.0)), unit("s");
        /// How much of the fuel's burning waits for air: 0 burns all gas alike, 1 burns what lies outside first, so that flames
        /// narrow upward.
        oxygen_dependence: f64 = 0.75, limits(FRACTION);
        /// Volume fraction of soot that forms in burning gas, in parts per million.
        soot_ppm: f64 = 1.2, limits(Range::new(0.0, 100.0)), unit("1e-6");
        /// Share of the soot that does not burn in the flame and leaves it as smoke.
        smoke_fraction: f64 = 0.0, limits(FRACTION);
        /// Strength of cooling by the soot's own radiation; 1 is physical.
        radiative_cooling: f64 = 0.3, limits(Range::new(0.0, 10.0));
        /// How long burnt gas stays after its fuel is gone, unless it leaves the domain.
        burnt_gas_lifetime_s: f64 = 0.35, limits(Range::new(0.0, 60.0)), unit("s");
    }
}

bansho_base::parameters! {
    /// Burning gas as particles that move by smoothed particle hydrodynamics (Inagaki et al.): fires that answer to wind and obstacles.
    pub struct FlameParticlesParameters {
        /// Where the flame stands; burners count from here.
        position: [f64; 3] = [0.0, 0.0, 0.0], unit("m");
        /// Burners; where the list is empty, one that is all default.
        burners: Vec<BurnerParameters> = Vec::new(), limits(Length { min: 0, max: 200, item: () });
        /// About how many particles live at a time, all burners together: as many as the design has room for. Gas that burns out early
        /// leaves up to a fifth of it free, and puffing lets the number swing. More than 20 million are refused with the memory that they
        /// would take.
        particles: i64 = 12_000, limits(Range::new(1.0, 1e12));
        /// Pressure and viscosity.
        fluid: FluidParameters = FluidParameters::default();
        /// Buoyancy, wind, entrainment, puffing, turbulence.
        forces: ForceParameters = ForceParameters::default();
        /// Burning, heating, cooling, soot.
        combustion: CombustionParameters = CombustionParameters::default();
        /// How it looks.
        rendering: RenderingParameters = RenderingParameters::default();
        /// Least corner of the box that gas may fill, from `position`; `"auto"` leaves room for flame and smoke.
        domain_min: Auto<[f64; 3]> = Auto::Auto, unit("m");
        /// Greatest corner of the box that gas may fill, from `position`.
        domain_max: Auto<[f64; 3]> = Auto::Auto, unit("m");
        /// Length of a step; particles are drawn between steps by their velocity.
        step_s: f64 = 1.0 / 120.0, limits(Range::new(1e-4, 0.05)), unit("s");
        /// How long it burns before the shot; `"auto"` until the flame is developed.
        preroll_s: Auto<f64> = Auto::Auto, limits(Range::new(0.0, 600.0)), unit("s");
    }
}

bansho_base::choice! {
    /// What becomes of a particle in the picture.
    pub enum SpriteStyle {
        /// What a ray sees of its ball: sums are the exact line integrals of the gas, so that light and opacity follow from its soot.
        LineIntegral = "line_integral",
        /// The paper's: poly6 itself, times the color of a black body, added; opacity from density.
        Poly6 = "poly6",
        /// The paper's figure 7: a square, the redder the denser the gas.
        Squares = "squares",
    }
}

bansho_base::parameters! {
    /// How the gas is drawn.
    pub struct RenderingParameters {
        /// What becomes of a particle: exact line integrals, the paper's sprites, or squares that show the density.
        sprite: SpriteStyle = SpriteStyle::LineIntegral;
        /// How strongly soot absorbs, and so shines, beside what its volume fraction gives.
        soot_gain: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// How unevenly gas finer than the particles burns: 0 is the smooth sum of the particles alone. The mean light stays.
        detail: f64 = 0.85, limits(FRACTION);
        /// Size of that detail, in support radii.
        detail_size: f64 = 0.9, limits(Range::new(0.05, 20.0));
        /// How crisp the edges of burning gas are.
        sharpness: f64 = 0.7, limits(FRACTION);
        /// Speed of gas that draws detail as it is; faster gas stretches it along its way.
        detail_speed: Auto<f64> = Auto::Auto, limits(Range::new(0.01, 1000.0)), unit("m/s");
        /// Light of the thin blue zone where fresh gas begins to burn.
        base_blue: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Opacity of the center of a poly6 sprite in gas of mean density.
        opacity: f64 = 0.06, limits(FRACTION);
        /// Side of the squares of `sprite = "squares"`, in support radii.
        square_size: f64 = 0.25, limits(Range::new(0.001, 10.0));
        /// Share of the light of others that soot scatters on rather than takes away: what makes smoke visible.
        smoke_albedo: f64 = 0.3, limits(FRACTION);
        /// How strongly hot gas bends the light of what lies behind; 1 is physical, 0 leaves it straight.
        heat_haze_gain: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Sparks.
        sparks: SparkParameters = SparkParameters::default();
        /// Light on others.
        light: GasLightParameters = GasLightParameters::default();
    }
}

bansho_base::parameters! {
    /// The light that the flame throws on others; follows what the gas radiates at each moment.
    pub struct GasLightParameters {
        /// Scale of that light; 0 for none.
        scale: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// How many point lights stand along the flame.
        count: i64 = 3, limits(Range::new(1.0, 16.0));
    }
}
