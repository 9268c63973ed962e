//! Parameters of the volume flame.

use bansho_base::parameters::{AssetPath, Auto, Length, Range, animated::Animated};

use super::fuel::Fuel;
use crate::{particles::BurnerShape, sparks::SparkParameters};

const FRACTION: Range = Range::new(0.0, 1.0);
const LENGTH: Range = Range::new(1e-3, 1e3);

bansho_base::choice! {
    /// How fine the grid is, if `resolution` does not say.
    pub enum GridQuality {
        /// 9 cells across a burner or a characteristic diameter: for looking at motion.
        Preview = "preview",
        /// 14 cells.
        Standard = "standard",
        /// 24 cells.
        Final = "final",
    }
}

bansho_base::parameters! {
    /// A source of gas.
    pub struct VolumeBurnerParameters {
        /// Shape of the surface.
        shape: BurnerShape = BurnerShape::Disk;
        /// Position of its center relative to the flame's `position`.
        position: Animated<[f64; 3]> = Animated::from([0.0, 0.0, 0.0]), unit("m");
        /// Rotation about x, then y, then z.
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
        /// Heat release rate Q, which fixes the mass of fuel that leaves the burner. Fuel `"smoke"` releases none: there it is the mass of smoke, 1 g/s for each kW.
        heat_release_kw: f64 = 60.0, limits(Range::new(1e-3, 1e6)), unit("kW");
        /// Flow as a fraction of full flow; 0 turns the burner off. Keys make a burst of gas, as an explosion has it.
        flow: Animated<f64> = Animated::from(1.0), limits(FRACTION);
    }
}

bansho_base::parameters! {
    /// Mixing, heat and soot of the gas. `"auto"` is the fuel's own value.
    pub struct GasParameters {
        /// Fraction of the heat of combustion that leaves as radiation, which fixes how far the soot cools.
        radiant_fraction: Auto<f64> = Auto::Auto, limits(Range::new(0.0, 0.8));
        /// Largest volume fraction of soot in the flame, in parts per million.
        soot_ppm: Auto<f64> = Auto::Auto, limits(Range::new(0.0, 100.0)), unit("1e-6");
        /// Mass of smoke for each mass of fuel.
        smoke_yield: Auto<f64> = Auto::Auto, limits(FRACTION);
        /// Temperature of the flame without loss of heat.
        flame_temperature_k: Auto<f64> = Auto::Auto, limits(Range::new(300.0, 4000.0)), unit("K");
        /// Coefficient of Smagorinsky's eddy viscosity, which stands for eddies below a cell.
        smagorinsky: f64 = 0.1, limits(Range::new(0.0, 0.5));
        /// Relative variation of the flow over the surface of a burner and over time, from which a fire becomes uneven.
        unevenness: f64 = 0.3, limits(FRACTION);
    }
}

bansho_base::parameters! {
    /// Light of the flame on other objects.
    pub struct VolumeLightParameters {
        /// Factor of that light; 0 for none.
        scale: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Number of point lights along the flame.
        count: i64 = 3, limits(Range::new(1.0, 16.0));
    }
}

bansho_base::parameters! {
    /// Rendering of the gas.
    pub struct VolumeRenderingParameters {
        /// Factor of absorption and emission of soot; at 1 they follow from its volume fraction.
        soot_gain: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Factor of the light of the thin blue zone in which gas burns.
        blue: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Single-scattering albedo of smoke.
        smoke_albedo: f64 = 0.3, limits(FRACTION);
        /// Factor of the refraction of light from behind by hot gas; 1 is physical, 0 is none.
        heat_haze_gain: f64 = 1.0, limits(Range::new(0.0, 1000.0));
        /// Sparks.
        sparks: SparkParameters = SparkParameters::default();
        /// Light on other objects.
        light: VolumeLightParameters = VolumeLightParameters::default();
    }
}

bansho_base::parameters! {
    /// Burning gas on a grid, for fires that neck, roll and puff, and are seen from any side.
    pub struct FlameVolumeParameters {
        /// Position of the flame. The positions of burners and domain are relative to it.
        position: [f64; 3] = [0.0, 0.0, 0.0], unit("m");
        /// Burners; an empty list is one burner with default values.
        burners: Vec<VolumeBurnerParameters> = Vec::new(), limits(Length { min: 0, max: 200, item: () });
        /// What burns.
        fuel: Fuel = Fuel::Wood;
        /// How fine the grid is.
        quality: GridQuality = GridQuality::Standard;
        /// Cells in a meter; `"auto"` follows from `quality`, the burners and their heat.
        resolution: Auto<f64> = Auto::Auto, limits(Range::new(0.5, 2000.0)), unit("1/m");
        /// Whether the bottom of the domain is a floor. Otherwise air flows in from below, as around a torch.
        floor: bool = true;
        /// Minimum corner of the simulated domain relative to `position`; `"auto"` leaves enough space around the flame.
        domain_min: Auto<[f64; 3]> = Auto::Auto, unit("m");
        /// Maximum corner of the simulated domain relative to `position`.
        domain_max: Auto<[f64; 3]> = Auto::Auto, unit("m");
        /// Mixing, heat and soot.
        gas: GasParameters = GasParameters::default();
        /// Appearance.
        rendering: VolumeRenderingParameters = VolumeRenderingParameters::default();
        /// Time between states. The solver divides it so that no gas crosses more than a cell in one of its steps.
        step_s: f64 = 1.0 / 60.0, limits(Range::new(1e-3, 0.1)), unit("s");
        /// Duration of the simulation before the shot; `"auto"` is long enough for the flame to develop fully.
        preroll_s: Auto<f64> = Auto::Auto, limits(Range::new(0.0, 600.0)), unit("s");
    }
}
