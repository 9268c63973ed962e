//! Parameters of an aurora. Symbols and equation numbers are those of the thesis.

use std::sync::OnceLock;

use bansho_base::{
    host::once::get_or_compute,
    parameters::{Auto, Length, Range, animated::Animated},
};

use super::shapes::{MorphingParameters, ShapeError, ShapeErrorKind, ShapeParameters, SheetParameters};
use crate::physics::{
    atmosphere::atmosphere,
    emission::Emission,
    extinction::Extinction,
    precipitation::{
        Spectrum, TrackModel,
        energy_grid::{HIGHEST_EV, LOWEST_EV},
        spectrum::ARC,
    },
};

/// Range of a fraction.
const FRACTION: Range = Range::new(0.0, 1.0);

bansho_base::choice! {
    /// How the energies of the electrons are spread.
    pub enum SpectrumShape {
        /// About one energy, as in arcs: a third wide.
        Gaussian = "gaussian",
        /// A hot plasma's, as in diffuse auroras; `energy_ev` is its characteristic energy.
        Maxwellian = "maxwellian",
        /// All alike.
        Monoenergetic = "monoenergetic",
    }
}

impl SpectrumShape {
    /// The spectrum itself.
    #[must_use]
    pub fn spectrum(self) -> Spectrum {
        match self {
            Self::Gaussian => ARC,
            Self::Maxwellian => Spectrum::Maxwellian,
            Self::Monoenergetic => Spectrum::Monoenergetic,
        }
    }
}

bansho_base::choice! {
    /// How Poisson's equation is solved.
    pub enum FieldSolver {
        /// Exactly, by sine transform.
        SineTransform = "sine_transform",
        /// By Gauss-Seidel sweeps, eq. (2.6), stopped as `sweeps` and `tolerance` say.
        GaussSeidel = "gauss_seidel",
    }
}

bansho_base::choice! {
    /// How charge lies on the sheets.
    pub enum FieldCharge {
        /// As on conductors: all sheets are at one potential, and particles stay where they are along them.
        Conductor = "conductor",
        /// All scattered particles have the same, eq. (2.2): particles draw away from the ends of sheets and into spirals.
        Uniform = "uniform",
    }
}

bansho_base::choice! {
    /// Kernels of the repulsion.
    pub enum RepulsionKernel {
        /// Cubic spline, eqs. (2.17) and (2.18): lets particles come close to each other, so that their own pattern stays.
        CubicSpline = "cubic_spline",
        /// Poly6 for the density, spiky for the force, eqs. (2.12) and (2.16): parts close particles, and evens their pattern out. As
        /// light is drawn, spread as far as neighbors are, both look nearly alike.
        Poly6Spiky = "poly6_spiky",
    }
}

bansho_base::parameters! {
    /// The field that pulls particles to the shape (2.2.3). Lengths of the grid are cells, times frames of 1/30 s, the charge is such that a sheet's potential is of order one.
    pub struct FieldParameters {
        /// Cells of the grid along each side; 255 is solved fastest, the thesis has 256.
        cells: i64 = 255, limits(Range::new(16.0, 511.0));
        /// How the potential is found.
        solver: FieldSolver = FieldSolver::SineTransform;
        /// How charge lies on the sheets.
        charge: FieldCharge = FieldCharge::Conductor;
        /// Most Gauss-Seidel sweeps.
        sweeps: i64 = 200, limits(Range::new(1.0, 2000.0));
        /// Greatest change at which Gauss-Seidel sweeps stop, as a share of the potential of a sheet.
        tolerance: f64 = 1e-4, limits(Range::new(0.0, 1.0));
        /// How far the sheets reach out for particles (screening length); `"auto"` is three cells.
        screening_length_km: Auto<f64> = Auto::Auto, limits(Range::new(0.05, 20_000.0)), unit("km");
        /// Strength of the pull; 1 draws a particle in from three cells within about half a second.
        attraction: f64 = 1.0, limits(Range::new(0.0, 20.0));
        /// Magnetic field across the plane: how far it turns a particle's way in a frame. Particles drift along the sheet, east on one side and west on the other.
        gyration_deg_per_frame: f64 = 4.0, limits(Range::new(-60.0, 60.0)), unit("degrees");
        /// Strength of the noise in the potential, as a share of the depth of a sheet.
        noise: f64 = 0.08, limits(Range::new(0.0, 4.0));
        /// Size of the noise's swirls.
        noise_scale_km: f64 = 30.0, limits(Range::new(0.1, 20_000.0)), unit("km");
        /// Time in which the noise becomes another.
        noise_correlation_time_s: f64 = 1.5, limits(Range::new(0.01, 1e5)), unit("s");
    }
}

bansho_base::parameters! {
    /// When particles are born and die as the shape changes (2.3.4, table 3.3).
    pub struct RelocationParameters {
        /// A cell is near the shape if its scatter count is at least this share of the mean of all cells.
        scatter_count_threshold: f64 = 0.10, limits(Range::new(0.0, 100.0));
        /// And if its potential is below this multiple of the mean of all cells.
        potential_threshold: f64 = 0.25, limits(Range::new(0.0, 100.0));
        /// Below this many particles, some are born in a near cell.
        births_below: f64 = 50.0, limits(Range::new(0.0, 1e6));
        /// At most this many at a time.
        max_births: f64 = 10.0, limits(Range::new(0.0, 1e6));
        /// Above this many particles, those farthest from the shape die in a near cell.
        deaths_above: f64 = 500.0, limits(Range::new(1.0, 1e6));
        /// At most this many at a time.
        max_deaths: f64 = 100.0, limits(Range::new(0.0, 1e6));
        /// Takes the four counts as those of a near cell that holds 75 particles on average, and scales them to as many as there are, so that the look does not depend on `count` of the particles; births then go by stretches of the sheets, to those that lack most, and deaths to those that hold too many. If not, they are taken as they are, cell by cell.
        scale_counts: bool = true;
    }
}

bansho_base::parameters! {
    /// The particles and how they move (2.3).
    pub struct ParticleParameters {
        /// About how many there are.
        count: i64 = 60_000, limits(Range::new(100.0, 1e6));
        /// Weight w_L of the Lorentz force, eq. (2.20).
        lorentz_weight: f64 = 0.6, limits(Range::new(0.0, 10.0));
        /// Weight w_P of the repulsion, eq. (2.20).
        repulsion_weight: f64 = 0.4, limits(Range::new(0.0, 10.0));
        /// Gas constant k of the repulsion, eq. (2.13): 1 fills the sheet's thickness against the pull.
        repulsion: f64 = 1.0, limits(Range::new(0.0, 20.0));
        /// Kernels of the repulsion.
        kernel: RepulsionKernel = RepulsionKernel::CubicSpline;
        /// How many neighbors a particle has on average, which sets the support radius h.
        neighbor_count: f64 = 35.0, limits(Range::new(6.0, 200.0));
        /// How fast motion through the field dies down; the thesis has none.
        friction_per_s: f64 = 6.0, limits(Range::new(0.0, 30.0)), unit("1/s");
        /// Holds the sum of kinetic and potential energy, so that particles do not speed up without end.
        limit_energy: bool = true;
        /// Time in which particles appear and vanish.
        fade_s: f64 = 0.4, limits(Range::new(0.0, 10.0)), unit("s");
        /// Births and deaths.
        relocation: RelocationParameters = RelocationParameters::default();
    }
}

bansho_base::parameters! {
    /// Rays: streaks of brightness along the sheet, and dark ones.
    pub struct RayParameters {
        /// How much the brightness varies along the sheet: the standard deviation of its logarithm.
        contrast: f64 = 0.7, limits(Range::new(0.0, 3.0));
        /// Distance from ray to ray.
        spacing_km: f64 = 2.5, limits(Range::new(0.05, 1000.0)), unit("km");
        /// How fast rays run along the sheet, one way on its one side and the other way on the other.
        shear_km_per_s: f64 = 1.5, limits(Range::new(-100.0, 100.0)), unit("km/s");
        /// How long a ray lives.
        lifetime_s: f64 = 3.0, limits(Range::new(0.01, 1e5)), unit("s");
        /// How much the energy of the electrons varies with the rays: bright ones reach lower. The standard deviation of its logarithm.
        energy_variation: f64 = 0.05, limits(Range::new(0.0, 2.0));
        /// Depth of black rays: thin gaps that run along the sheet.
        black_ray_depth: f64 = 0.0, limits(FRACTION);
        /// Distance from one black ray to the next.
        black_ray_spacing_km: f64 = 8.0, limits(Range::new(0.1, 1000.0)), unit("km");
    }
}

bansho_base::parameters! {
    /// Folds and curls that travel along the drawn sheets.
    pub struct FoldParameters {
        /// How far they swing to each side of the drawn line.
        amplitude_km: f64 = 3.0, limits(Range::new(0.0, 500.0)), unit("km");
        /// Distance from fold to fold.
        wavelength_km: f64 = 40.0, limits(Range::new(0.5, 10_000.0)), unit("km");
        /// How fast they travel along the sheet.
        speed_km_per_s: f64 = 2.0, limits(Range::new(-100.0, 100.0)), unit("km/s");
        /// How long a fold lives.
        lifetime_s: f64 = 8.0, limits(Range::new(0.01, 1e5)), unit("s");
        /// How far their crests lean over: 0 for waves, 1 for curls.
        curl: f64 = 0.3, limits(Range::new(0.0, 2.0));
    }
}

bansho_base::parameters! {
    /// Patches of the sheet that brighten and fade.
    pub struct PulsationParameters {
        /// How far they fade: 0 not at all, 1 to nothing.
        modulation_depth: f64 = 0.0, limits(FRACTION);
        /// Time from bright to bright.
        period_s: f64 = 8.0, limits(Range::new(0.05, 1e5)), unit("s");
        /// Length of a patch along the sheet.
        patch_length_km: f64 = 60.0, limits(Range::new(0.1, 20_000.0)), unit("km");
    }
}

bansho_base::parameters! {
    /// An aurora (Sekiguchi): shapes drawn in the plane at 100 km altitude, particles that follow them, the light of the air that they strike.
    pub struct AuroraParameters {
        /// Side of the drawn square, its middle under the observer's zenith.
        extent_km: f64 = 600.0, limits(Range::new(1.0, 20_000.0)), unit("km");
        /// Energy flux of the electrons within a sheet; 10 is a faint arc, 50 a bright one, 300 a storm.
        flux_mw_per_m2: Animated<f64> = Animated::from(50.0), limits(Range::new(0.0, 10_000.0)), unit("mW/m^2");
        /// Energy of the electrons: 500 eV gives a high and red aurora, 5000 a green one, 30000 one with a low rosy edge. With the factor of a sheet
        /// it is held to what the tables of the air know, 100 eV to 100 keV.
        energy_ev: Animated<f64> = Animated::from(5000.0), limits(Range::new(100.0, 100_000.0)), unit("eV");
        /// How their energies are spread.
        spectrum: SpectrumShape = SpectrumShape::Gaussian;
        /// Thickness of a sheet, twice L_thr; `"auto"` is two cells of the field.
        thickness_km: Auto<f64> = Auto::Auto, limits(Range::new(0.01, 1000.0)), unit("km");
        /// Dip of the magnetic field: 90 is upright, rays lean to the south (north of the equator) by what is missing. Field lines flatter than 30
        /// degrees leave the drawn region and are drawn at 30.
        dip_deg: f64 = 77.0, limits(Range::new(-90.0, 90.0)), unit("degrees");
        /// Direction of magnetic north, east of true north.
        declination_deg: f64 = 0.0, limits(Range::new(-180.0, 180.0)), unit("degrees");
        /// How many seconds of the aurora pass in one of the picture: so much sooner does light that lingers fade. At 1 the green light of a sheet
        /// that crosses the sky in seconds stays behind, and its front is purple; most films of auroras are quickened, and theirs is green.
        time_lapse: f64 = 1.0, limits(Range::new(0.01, 1e4));
        /// Time that it runs before the shot.
        preroll_s: f64 = 1.5, limits(Range::new(0.0, 60.0)), unit("s");
        /// The shapes that it takes one after the other; two curtains that wave where the list is empty.
        shapes: Vec<ShapeParameters> = Vec::new(), limits(Length { min: 0, max: 1000, item: () });
        /// How one shape becomes the next.
        morphing: MorphingParameters = MorphingParameters::default();
        /// The electric field that draws particles to the shapes.
        field: FieldParameters = FieldParameters::default();
        /// The particles that stand for the electrons.
        particles: ParticleParameters = ParticleParameters::default();
        /// Rays: fine streaks of more and less light along a sheet.
        rays: RayParameters = RayParameters::default();
        /// Folds that run along a sheet.
        folds: FoldParameters = FoldParameters::default();
        /// Patches that brighten and fade.
        pulsation: PulsationParameters = PulsationParameters::default();
        /// How light is drawn.
        rendering: RenderingParameters = RenderingParameters::default();
    }
}

impl AuroraParameters {
    /// Width of a cell of the field, km.
    #[must_use]
    pub fn cell_km(&self) -> f64 {
        self.extent_km / self.field.cells as f64
    }

    /// L_thr, km: half the thickness of a sheet.
    #[must_use]
    pub fn half_thickness_km(&self) -> f64 {
        match self.thickness_km {
            Auto::Auto => self.cell_km(),
            Auto::Set(thickness) => thickness / 2.0,
        }
    }
}

bansho_base::choice! {
    /// How the falls of the electrons become light.
    pub enum Sampling {
        /// By the mean of infinitely many falls: no noise.
        MeanProfile = "mean_profile",
        /// By single collisions, as in the thesis (2.4).
        SingleCollisions = "single_collisions",
    }
}

impl TrackModel {
    /// The emission table for a spectrum.
    #[must_use]
    pub fn emission(self, spectrum: Spectrum) -> Emission {
        match self {
            Self::Fang2010 => Emission::new(atmosphere(), spectrum),
            Self::HardSphereAtmosphere => Emission::from_hard_spheres(atmosphere(), spectrum),
        }
    }

    /// The table for a spectrum that a scene can select, computed once per process.
    pub(crate) fn shared_emission(self, shape: SpectrumShape) -> &'static Emission {
        static TABLES: [OnceLock<Emission>; TrackModel::CHOICES.len() * SpectrumShape::CHOICES.len()] =
            [const { OnceLock::new() }; TrackModel::CHOICES.len() * SpectrumShape::CHOICES.len()];
        let index = self as usize * SpectrumShape::CHOICES.len() + shape as usize;
        get_or_compute(&TABLES[index], || self.emission(shape.spectrum()))
    }
}

bansho_base::choice! {
    /// How single collisions are smoothed to light.
    pub enum Blur {
        /// On the sky, across the field, as far as `blur_radius_km` says: a near ray is wider than a far one.
        World = "world",
        /// In the picture, by `blur_radii`, wherever they are, as in the thesis (2.28).
        Screen = "screen",
    }
}

bansho_base::parameters! {
    /// Radii (standard deviations) of the thesis's blur, eq. (2.28), which depend on the line alone; it does not say how large they are.
    pub struct BlurParameters {
        /// Of the green line of oxygen, 557.7 nm.
        green_px: f64 = 1.5, limits(Range::new(0.0, 100.0)), unit("pixels");
        /// Of its red lines, 630.0 and 636.4 nm.
        red_px: f64 = 4.0, limits(Range::new(0.0, 100.0)), unit("pixels");
        /// Of the bands of N2+, 391.4 to 470.9 nm.
        violet_px: f64 = 1.0, limits(Range::new(0.0, 100.0)), unit("pixels");
        /// Of the bands of N2, 670.5 nm among them.
        deep_red_px: f64 = 1.0, limits(Range::new(0.0, 100.0)), unit("pixels");
    }
}

/// Maximum deflection by a collision. Collisions spread by a few long steps at high altitude, the mean profile by a
/// Gaussian patch of the same width; where it exceeds a few km the two pictures differ.
pub(crate) const MAX_COLLISION_DEFLECTION: f64 = 0.05;

bansho_base::parameters! {
    /// How the light of an aurora is drawn.
    pub struct RenderingParameters {
        /// By the mean fall, or by collisions.
        sampling: Sampling = Sampling::MeanProfile;
        /// What stops the electrons: measured air, or the thesis's hard spheres.
        energy_deposition: TrackModel = TrackModel::Fang2010;
        /// Where light is smoothed: on the sky in km, or in the picture in pixels.
        blur_space: Blur = Blur::World;
        /// Radii of the blur in pixels.
        blur_radii: BlurParameters = BlurParameters::default();
        /// How far the light of a particle spreads across the field (standard deviation); `"auto"` is as far as its neighbors are, and rays stay sharp.
        blur_radius_km: Auto<f64> = Auto::Auto, limits(Range::new(0.005, 100.0)), unit("km");
        /// How far a collision turns an electron from the field: rms tangent of the angle, the vector omega of (2.21) and (2.24).
        collision_deflection: f64 = 0.002, limits(Range::new(0.0, MAX_COLLISION_DEFLECTION));
        /// The air below, which dims what is low in the sky.
        extinction: Extinction = Extinction::default();
    }
}

/// Relative rounding error that is accepted.
const RELATIVE_ROUNDING: f64 = 1e-9;

/// Checks the energy at every point of every sheet's curve against the range of the tables.
///
/// # Errors
///
/// The first point where a sheet's factor takes the aurora's energy out of the range.
pub(crate) fn check_energies(parameters: &AuroraParameters) -> Result<(), ShapeError> {
    let energy_ev = parameters.energy_ev.bounds();
    for (shape, of) in parameters.shapes.iter().enumerate() {
        for (entry, sheet) in of.sheets.iter().enumerate() {
            if let Some((point, kind)) = outside(sheet, entry + 1, energy_ev) {
                return Err(ShapeError { key: format!("shapes.{shape}.sheets.{entry}.energy_factor.{point}"), kind });
            }
        }
    }
    Ok(())
}

/// The first point of a sheet's energy curve outside the tables. The curve does not overshoot its points.
fn outside(sheet: &SheetParameters, number: usize, [low, high]: [f64; 2]) -> Option<(usize, ShapeErrorKind)> {
    let of_point = |(point, [at, factor]): (usize, &[f64; 2])| {
        let (least, greatest) = (low * factor, high * factor);
        let energy_ev = if greatest > HIGHEST_EV * (1.0 + RELATIVE_ROUNDING) {
            greatest
        } else if least < LOWEST_EV * (1.0 - RELATIVE_ROUNDING) {
            least
        } else {
            return None;
        };
        Some((point, ShapeErrorKind::EnergyOutside { sheet: number, at: *at, energy_ev }))
    };
    sheet.energy_factor.points().iter().enumerate().find_map(of_point)
}
