//! Parameters of the particle flame. Symbols and equation numbers are those of Inagaki et al.

use bansho_base::parameters::{AssetPath, Auto, Length, Range, animated::Animated};
use bansho_sph::KernelShape;

use crate::sparks::SparkParameters;

const FRACTION: Range = Range::new(0.0, 1.0);
const LENGTH: Range = Range::new(1e-3, 1e4);
const KELVIN: Range = Range::new(250.0, 4000.0);

bansho_base::choice! {
    /// Shape of the surface that gas is emitted from.
    pub enum BurnerShape {
        /// A disk whose normal is the burner's y axis.
        Disk = "disk",
        /// A ball of `diameter`, within which gas is emitted.
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
    /// Pressure, eq. (11), in gas of lower density than rho_0.
    pub enum NegativePressure {
        /// It is 0.
        Clamped = "clamped",
        /// It is negative, as in the paper: gas of low density contracts into strings (tensile instability).
        Allowed = "allowed",
    }
}

bansho_base::choice! {
    /// Model of the gas: what happens to a particle from its emission to its removal.
    pub enum GasModel {
        /// Gas burns, heats up, forms soot, rises and mixes with air; it is removed some time after it has burnt out.
        Combustion = "combustion",
        /// The paper's algorithm (section 4.3). In each step the same number of particles is added, with equal speed, temperature and mass. They move by
        /// Euler's equation, eq. (1), with pressure and the wind's force per volume. When there are more than `particles`, the oldest are removed. Nothing
        /// burns, cools or is buoyant. Of `fluid`, `forces` and `combustion` only `support_radius`, `rest_density`, `stiffness`, `pressure_kernel`,
        /// `negative_pressure`, `wind_response` and `soot_ppm` apply. A burner's gas rises to the burner's `height` at constant `speed`.
        Euler = "euler",
    }
}

bansho_base::choice! {
    /// Model of the temperature of a particle.
    pub enum TemperatureLaw {
        /// The gas is heated by combustion, and cools by mixing with air and by radiation.
        Simulated = "simulated",
        /// The temperature at emission stays constant, as in the paper.
        Constant = "constant",
    }
}

bansho_base::choice! {
    /// Model of the wind's effect on the gas.
    pub enum WindForce {
        /// Entrained air adds its momentum: the gas takes on the velocity of the wind as it mixes with air.
        Entrainment = "entrainment",
        /// The wind's velocity, times `wind_response`, is a force per volume, as in the paper.
        BodyForce = "body_force",
    }
}

bansho_base::parameters! {
    /// A source of burning gas. Its heat release rate and its size determine all other properties, unless they are given.
    pub struct BurnerParameters {
        /// Shape of the surface.
        shape: BurnerShape = BurnerShape::Disk;
        /// Position of its center relative to the flame's `position`. If the burner moves, gas is emitted at its current position; the burner's velocity is not
        /// added to that of the gas.
        position: Animated<[f64; 3]> = Animated::from([0.0, 0.0, 0.0]), unit("m");
        /// Rotation about x, then y, then z; without rotation gas is emitted upward.
        rotation_deg: [f64; 3] = [0.0, 0.0, 0.0], limits(Range::new(-3600.0, 3600.0)), unit("degrees");
        /// Diameter D of a disk or a point, width of a line.
        diameter: f64 = 0.3, limits(LENGTH), unit("m");
        /// Length of a line.
        length: f64 = 1.0, limits(LENGTH), unit("m");
        /// Sides of a box.
        size: [f64; 3] = [0.3, 0.3, 0.3], limits(LENGTH), unit("m");
        /// glTF file of a mesh.
        file: Option<AssetPath> = None;
        /// Scale factor of a mesh.
        scale: f64 = 1.0, limits(Range::new(1e-4, 1e4));
        /// Heat release rate Q; together with the size it determines the height of the flame (Heskestad 1983).
        heat_release_kw: f64 = 60.0, limits(Range::new(1e-3, 1e6)), unit("kW");
        /// Height of the flame; `"auto"` is Heskestad's `0.235 Q^(2/5) - 1.02 D`, at least `D / 2`.
        height: Auto<f64> = Auto::Auto, limits(LENGTH), unit("m");
        /// Exit speed of the gas; `"auto"` derives it from the size.
        speed: Auto<f64> = Auto::Auto, limits(Range::new(0.0, 100.0)), unit("m/s");
        /// Temperature of the gas at emission. With `gas_model = "euler"` or a constant temperature it is the temperature of the flame: 1900 K is that of
        /// luminous soot.
        temperature_k: f64 = 1150.0, limits(KELVIN), unit("K");
        /// Gas flow as a fraction of full flow; 0 turns the burner off.
        flow: Animated<f64> = Animated::from(1.0), limits(FRACTION);
    }
}

bansho_base::parameters! {
    /// Smoothed particle hydrodynamics, section 4.
    pub struct FluidParameters {
        /// Support radius d, eq. (2), in mean distances between particles at the burner.
        support_radius: f64 = 2.3, limits(Range::new(1.2, 6.0)), unit("distances");
        /// Rest density rho_0, eq. (11), as a fraction of the density at the burner.
        rest_density: f64 = 0.8, limits(Range::new(0.0, 10.0));
        /// Speed of sound, `sqrt(k)` of eq. (11) at the burner's temperature, as a multiple of the exit speed of the gas. It determines how
        /// compressible the gas is.
        stiffness: f64 = 1.2, limits(Range::new(0.0, 20.0));
        /// Kernel of the pressure force, eq. (12). The paper uses `"poly6"`, whose gradient vanishes at the center, so particles clump.
        pressure_kernel: KernelShape = KernelShape::Spiky;
        /// Pressure of gas of low density, eq. (11).
        negative_pressure: NegativePressure = NegativePressure::Clamped;
        /// Viscosity: fraction of the velocity differences to neighbors that is removed in 0.01 s (XSPH); 0 is the paper's Euler equation, eq. (1).
        viscosity: f64 = 0.12, limits(FRACTION);
        /// Heat conduction: fraction of the temperature differences to neighbors that is removed in 0.01 s.
        conduction: f64 = 0.08, limits(FRACTION);
        /// Maximum number of sub-steps per step. Gas that would need more sub-steps is made more compressible instead.
        max_substeps: i64 = 3, limits(Range::new(1.0, 100.0));
    }
    paper: pressure_kernel, negative_pressure;
}

bansho_base::parameters! {
    /// Forces on the gas other than pressure.
    pub struct ForceParameters {
        /// Factor of buoyancy; 1 is physical, 0 is the paper's value.
        buoyancy: f64 = 1.0, limits(Range::new(0.0, 10.0));
        /// Model of the wind's effect on the gas.
        wind_model: WindForce = WindForce::Entrainment;
        /// Factor of the wind's effect. With `wind_model = "body_force"` it is the force per volume divided by the wind speed, in N s/m^4.
        wind_response: f64 = 1.0, limits(Range::new(0.0, 100.0));
        /// Entrainment coefficient: speed at which air enters the gas, as a fraction of their relative speed. Entrained air slows, dilutes and cools the gas.
        entrainment: f64 = 0.12, limits(FRACTION);
        /// Contraction of the plume as the rising gas accelerates; at 1 its volume is conserved.
        plume_contraction: f64 = 0.9, limits(FRACTION);
        /// Factor of the strength of the vortex rings that the fire sheds; at 0 it does not puff.
        puffing: f64 = 1.0, limits(Range::new(0.0, 5.0));
        /// Frequency of shedding; `"auto"` is `1.5 / sqrt(D)` Hz (Cetegen and Ahmed 1993).
        puffing_hz: Auto<f64> = Auto::Auto, limits(Range::new(0.01, 100.0)), unit("Hz");
        /// Turbulence intensity: standard deviation of a velocity component, as a fraction of the speed of the gas; 0 in the paper.
        turbulence: f64 = 0.2, limits(Range::new(0.0, 2.0));
        /// Size of the largest eddies, in burner diameters.
        eddy_size: f64 = 0.8, limits(Range::new(0.05, 20.0)), unit("diameters");
    }
    paper: wind_model;
}

bansho_base::parameters! {
    /// Combustion, temperature and soot of the gas.
    pub struct CombustionParameters {
        /// Model of the temperature.
        temperature_model: TemperatureLaw = TemperatureLaw::Simulated;
        /// Temperature that burning gas approaches.
        flame_temperature_k: f64 = 1900.0, limits(KELVIN), unit("K");
        /// Time constant of heating.
        heating_time_s: f64 = 0.03, limits(Range::new(1e-3, 10.0)), unit("s");
        /// Dependence of combustion on exposure to air. At 0 all gas burns at the same rate; at 1 gas at the surface burns first, so flames taper toward the
        /// tip.
        oxygen_dependence: f64 = 0.75, limits(FRACTION);
        /// Volume fraction of soot in burning gas, in parts per million.
        soot_ppm: f64 = 1.2, limits(Range::new(0.0, 100.0)), unit("1e-6");
        /// Fraction of the soot that is not burned in the flame and becomes smoke.
        smoke_fraction: f64 = 0.0, limits(FRACTION);
        /// Factor of cooling by the radiation of soot; 1 is physical.
        radiative_cooling: f64 = 0.3, limits(Range::new(0.0, 10.0));
        /// Time for which burnt gas remains after its fuel is consumed, unless it leaves the domain.
        burnt_gas_lifetime_s: f64 = 0.35, limits(Range::new(0.0, 60.0)), unit("s");
    }
    paper: temperature_model;
}

bansho_base::parameters! {
    /// Burning gas as particles that move by smoothed-particle hydrodynamics (Inagaki et al.), for fires that interact with wind and obstacles.
    pub struct FlameParticlesParameters {
        /// Position of the flame. The positions of burners and domain are relative to it.
        position: [f64; 3] = [0.0, 0.0, 0.0], unit("m");
        /// Burners; an empty list is one burner with default values.
        burners: Vec<BurnerParameters> = Vec::new(), limits(Length { min: 0, max: 200, item: () });
        /// Approximate number of particles alive at a time, of all burners together. The actual number varies with puffing and is up to a fifth lower, since
        /// some gas burns out early. More than 20 million are rejected, with an error that states the memory they would take.
        particles: i64 = 12_000, limits(Range::new(1.0, 1e12));
        /// Model of the gas: combustion, or the paper's constant particles.
        gas_model: GasModel = GasModel::Combustion;
        /// Pressure and viscosity.
        fluid: FluidParameters = FluidParameters::default();
        /// Buoyancy, wind, entrainment, puffing, turbulence.
        forces: ForceParameters = ForceParameters::default();
        /// Burning, heating, cooling, soot.
        combustion: CombustionParameters = CombustionParameters::default();
        /// Appearance.
        rendering: GasRenderingParameters = GasRenderingParameters::default();
        /// Minimum corner of the simulated domain relative to `position`, outside which gas is removed; `"auto"` leaves enough space for flame and smoke.
        domain_min: Auto<[f64; 3]> = Auto::Auto, unit("m");
        /// Maximum corner of the simulated domain relative to `position`.
        domain_max: Auto<[f64; 3]> = Auto::Auto, unit("m");
        /// Time step. Between steps positions are extrapolated by the velocities.
        step_s: f64 = 1.0 / 120.0, limits(Range::new(1e-4, 0.05)), unit("s");
        /// Duration of the simulation before the shot; `"auto"` is long enough for the flame to develop fully.
        preroll_s: Auto<f64> = Auto::Auto, limits(Range::new(0.0, 600.0)), unit("s");
    }
    paper: gas_model;
}

bansho_base::choice! {
    /// How a particle is drawn.
    pub enum SpriteStyle {
        /// The line integral of its kernel: sums of sprites are the exact line integrals of the gas, and light and opacity follow from its soot.
        LineIntegral = "line_integral",
        /// The paper's sprite: poly6 itself, times the color of a black body. The light of sprites is added; opacity depends on density.
        Poly6 = "poly6",
        /// A square colored by density, as in the paper's figure 7: red where the gas is dense.
        Squares = "squares",
    }
}

bansho_base::choice! {
    /// How a particle deflects the light from behind.
    pub enum HeatHazeModel {
        /// By the gradient of the optical path through its gas, which follows from its temperature and the volume that it fills.
        Refraction = "refraction",
        /// By the gradient of poly6 itself, equally for all particles, as in the paper (figure 3). With `heat_haze_gain = 1` a particle deflects light as much
        /// as gas that has just been emitted.
        Poly6 = "poly6",
    }
}

bansho_base::parameters! {
    /// Rendering of the gas.
    pub struct GasRenderingParameters {
        /// How a particle is drawn: exact line integrals, the paper's sprites, or squares that show the density.
        sprite: SpriteStyle = SpriteStyle::LineIntegral;
        /// Factor of absorption and emission of soot; at 1 they follow from its volume fraction.
        soot_gain: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Amount of detail finer than the particles, which comes from intermittent burning. At 0 the picture is the smooth sum of the particles. The mean
        /// light does not change.
        detail: f64 = 0.85, limits(FRACTION);
        /// Size of the detail, in support radii.
        detail_size: f64 = 0.9, limits(Range::new(0.05, 20.0));
        /// Sharpness of the edges of burning gas.
        sharpness: f64 = 0.7, limits(FRACTION);
        /// Speed of gas whose detail is isotropic; faster gas stretches the detail along its motion.
        detail_speed: Auto<f64> = Auto::Auto, limits(Range::new(0.01, 1000.0)), unit("m/s");
        /// Factor of the light of the thin blue zone in which gas begins to burn.
        base_blue: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Opacity of the center of a poly6 sprite in gas of mean density.
        opacity: f64 = 0.06, limits(FRACTION);
        /// Side of the squares of `sprite = "squares"`, in support radii.
        square_size: f64 = 0.25, limits(Range::new(0.001, 10.0));
        /// Single-scattering albedo of soot for the light of other objects, which makes smoke visible.
        smoke_albedo: f64 = 0.3, limits(FRACTION);
        /// Factor of the refraction of light from behind by hot gas; 1 is physical, 0 is none.
        heat_haze_gain: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// How a particle refracts light from behind.
        heat_haze_model: HeatHazeModel = HeatHazeModel::Refraction;
        /// Sparks.
        sparks: SparkParameters = SparkParameters::default();
        /// Light on other objects.
        light: GasLightParameters = GasLightParameters::default();
    }
    paper: sprite, opacity, square_size, heat_haze_model;
}

bansho_base::parameters! {
    /// Light of the flame on other objects. It follows the gas's emission over time.
    pub struct GasLightParameters {
        /// Factor of that light; 0 for none.
        scale: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Number of point lights along the flame.
        count: i64 = 3, limits(Range::new(1.0, 16.0));
    }
}
