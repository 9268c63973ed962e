//! Parameters of an aurora. Symbols and equation numbers are those of the thesis.

use std::sync::{Arc, OnceLock};

use bansho_base::{
    host::once::get_or_compute,
    parameters::{Auto, Length, Range, animated::Animated},
};

use super::shapes::{MorphingParameters, ShapeError, ShapeErrorKind, ShapeParameters, SheetParameters};
use crate::physics::{
    atmosphere::atmosphere,
    emission::{ColorMatching, Emission},
    extinction::Extinction,
    precipitation::{
        HardSphereParameters, Spectrum, TrackModel,
        energy_grid::{ARC, HIGHEST_EV, LOWEST_EV},
    },
};

/// Range of a fraction.
const FRACTION: Range = Range::new(0.0, 1.0);

bansho_base::choice! {
    /// Energy spectrum of the electrons.
    pub enum SpectrumShape {
        /// Gaussian about `energy_ev` with a standard deviation of 35 % of it, as in arcs.
        Gaussian = "gaussian",
        /// Maxwellian, the spectrum of a hot plasma, as in diffuse auroras; `energy_ev` is the characteristic energy, half the mean energy.
        Maxwellian = "maxwellian",
        /// All electrons have the energy `energy_ev`.
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
    /// Solver of Poisson's equation.
    pub enum FieldSolver {
        /// Direct solution by sine transform.
        SineTransform = "sine_transform",
        /// Gauss-Seidel sweeps, eq. (2.6), until `sweeps` or `tolerance` is reached.
        GaussSeidel = "gauss_seidel",
    }
}

bansho_base::choice! {
    /// Distribution of the charge along the sheets.
    pub enum FieldCharge {
        /// As on conductors: all sheets have the same potential, so particles do not drift along them.
        Conductor = "conductor",
        /// All scattered particles have the same charge, eq. (2.2): particles move away from the ends of sheets and into spirals.
        Uniform = "uniform",
    }
}

bansho_base::choice! {
    /// Kernels of the repulsion.
    pub enum RepulsionKernel {
        /// Cubic spline, eqs. (2.17) and (2.18): particles may come close to each other and keep their pattern.
        CubicSpline = "cubic_spline",
        /// Poly6 for the density, spiky for the force, eqs. (2.12) and (2.16): separates close particles and evens out their pattern. The light of a
        /// particle spreads as far as its neighbors are, so both kernels look nearly the same.
        Poly6Spiky = "poly6_spiky",
    }
}

bansho_base::parameters! {
    /// The electric field that attracts particles to the shape (2.2.3). Its constants are in cells of the grid and frames of 1/30 s, and the charge
    /// is such that the potential of a sheet is of order one.
    pub struct FieldParameters {
        /// Number of cells of the grid along each side; 255 is solved fastest, the thesis has 256.
        cells: i64 = 255, limits(Range::new(16.0, 511.0));
        /// Solver of Poisson's equation.
        solver: FieldSolver = FieldSolver::SineTransform;
        /// Distribution of the charge along the sheets.
        charge: FieldCharge = FieldCharge::Conductor;
        /// Maximum number of Gauss-Seidel sweeps.
        sweeps: i64 = 200, limits(Range::new(1.0, 2000.0));
        /// Maximum change of the potential, as a fraction of the potential of a sheet, below which Gauss-Seidel sweeps stop.
        tolerance: f64 = 1e-4, limits(Range::new(0.0, 1.0));
        /// Screening length: distance from which the sheets attract particles; `"auto"` is three cells.
        screening_length_km: Auto<f64> = Auto::Auto, limits(Range::new(0.05, 20_000.0)), unit("km");
        /// Strength of the attraction; at 1 a particle arrives from a distance of three cells within about half a second.
        attraction: f64 = 1.0, limits(Range::new(0.0, 20.0));
        /// Magnetic field perpendicular to the plane, as the angle by which it turns the velocity of a particle per frame. Particles drift along the
        /// sheet, east on one side and west on the other.
        gyration_deg_per_frame: f64 = 4.0, limits(Range::new(-60.0, 60.0)), unit("degrees");
        /// Amplitude of the noise in the potential, as a fraction of the depth of the potential of a sheet.
        noise: f64 = 0.08, limits(Range::new(0.0, 4.0));
        /// Length scale of the noise.
        noise_scale_km: f64 = 30.0, limits(Range::new(0.1, 20_000.0)), unit("km");
        /// Correlation time of the noise.
        noise_correlation_time_s: f64 = 1.5, limits(Range::new(0.01, 1e5)), unit("s");
    }
    paper: solver, charge, sweeps, tolerance;
}

bansho_base::parameters! {
    /// Births and deaths of particles when the shape changes (2.3.4, table 3.3).
    pub struct RelocationParameters {
        /// Whether particles are created and removed. If `false`, all particles of the first shape remain (thesis, figure 2.14, left).
        enabled: bool = true;
        /// A cell is near the shape if its scatter count is at least this fraction of the mean over all cells, and its potential is below
        /// `potential_threshold`.
        scatter_count_threshold: f64 = 0.10, limits(Range::new(0.0, 100.0));
        /// Maximum potential of a near cell, as a multiple of the mean over all cells.
        potential_threshold: f64 = 0.25, limits(Range::new(0.0, 100.0));
        /// Particles are created in a near cell that has fewer than this number.
        births_below: f64 = 50.0, limits(Range::new(0.0, 1e6));
        /// Maximum number of births in a near cell per update of the shape.
        max_births: f64 = 10.0, limits(Range::new(0.0, 1e6));
        /// In a near cell with more particles than this, those farthest from the shape are removed.
        deaths_above: f64 = 500.0, limits(Range::new(1.0, 1e6));
        /// Maximum number of deaths in a near cell per update of the shape.
        max_deaths: f64 = 100.0, limits(Range::new(0.0, 1e6));
        /// Scales the four counts, which refer to near cells of 75 particles on average, to the number of particles, so that the look does not depend
        /// on `count` of the particles. Births are then distributed over intervals of the sheets in proportion to their deficit, and deaths to
        /// intervals with a surplus. If `false`, the counts are applied literally, cell by cell.
        scale_counts: bool = true;
    }
}

bansho_base::choice! {
    /// Which particles repel each other.
    pub enum NeighborSearch {
        /// All within the support radius of the kernels.
        SupportRadius = "support_radius",
        /// All in the 3 x 3 cells, each h wide, around the cell of a particle, as in 2.5.1 of the thesis. A cubic spline reaches 2h, so parts of
        /// its support are missed.
        ThreeByThreeCells = "three_by_three_cells",
    }
}

bansho_base::choice! {
    /// By which densities the pressure force between two particles is divided.
    pub enum RepulsionForce {
        /// By both: particles that repel each other keep their common momentum.
        BothDensities = "both_densities",
        /// By that of the neighbor alone, as (2.14) is printed, and by delta_0 instead of the particle's own: where the density varies, the forces of two
        /// particles on each other differ, and the particles drift together.
        AsPrinted = "as_printed",
    }
}

bansho_base::choice! {
    /// How the energy flux of the sheets is distributed to the particles.
    pub enum PowerDistribution {
        /// Each interval of a sheet has its drawn power, whatever the number of particles there, and `rays` are drawn on it.
        BySheetLength = "by_sheet_length",
        /// Every particle has the same power, as in the thesis, so that a sheet is bright where particles cluster. The total is that of the sheets when
        /// there are `count` particles.
        Equal = "equal",
        /// The same, but the total is always that of the sheets: table 3.3 of the thesis may triple the number of particles, and with it the light.
        EqualShare = "equal_share",
    }
}

bansho_base::parameters! {
    /// Number and motion of the particles (2.3).
    pub struct ParticleParameters {
        /// Approximate number of particles.
        count: i64 = 60_000, limits(Range::new(100.0, 1e6));
        /// Weight w_L of the Lorentz force, eq. (2.20).
        lorentz_weight: f64 = 0.6, limits(Range::new(0.0, 10.0));
        /// Weight w_P of the repulsion, eq. (2.20).
        repulsion_weight: f64 = 0.4, limits(Range::new(0.0, 10.0));
        /// Gas constant k of the repulsion, eq. (2.13); at 1 the repulsion fills the thickness of the sheet against the attraction.
        repulsion: f64 = 1.0, limits(Range::new(0.0, 20.0));
        /// Kernels of the repulsion.
        kernel: RepulsionKernel = RepulsionKernel::CubicSpline;
        /// Mean number of neighbors of a particle, which determines the support radius of both kernels.
        neighbor_count: f64 = 35.0, limits(Range::new(6.0, 10_000.0));
        /// Smoothing length h of the kernels in cells of the field, instead of `neighbor_count`: poly6 and spiky end at h, the cubic spline at 2h, eqs.
        /// (2.12) to (2.18). In the thesis h is one cell (2.5.1), which is some 900 neighbors; then the cubic spline lets particles cluster into rays
        /// 0.9 h apart.
        smoothing_length_cells: Auto<f64> = Auto::Auto, limits(Range::new(0.05, 4.0));
        /// Which particles repel each other.
        neighbor_search: NeighborSearch = NeighborSearch::SupportRadius;
        /// Densities by which the force (2.14) is divided.
        repulsion_force: RepulsionForce = RepulsionForce::BothDensities;
        /// How the energy flux is distributed to the particles.
        power_distribution: PowerDistribution = PowerDistribution::BySheetLength;
        /// Decay rate of the velocity; the thesis has no friction.
        friction_per_s: f64 = 6.0, limits(Range::new(0.0, 30.0)), unit("1/s");
        /// Limits the sum of kinetic and potential energy, so that particles do not accelerate without bound.
        limit_energy: bool = true;
        /// Duration of the fade-in and the fade-out of particles.
        fade_s: f64 = 0.4, limits(Range::new(0.0, 10.0)), unit("s");
        /// Births and deaths when the shape changes.
        relocation: RelocationParameters = RelocationParameters::default();
    }
    paper: lorentz_weight, repulsion_weight, kernel, smoothing_length_cells, neighbor_search, repulsion_force, power_distribution, limit_energy, relocation;
}

bansho_base::parameters! {
    /// Rays: bright and dark streaks along the sheet.
    pub struct RayParameters {
        /// Variation of the brightness along the sheet: the standard deviation of its logarithm.
        contrast: f64 = 0.6, limits(Range::new(0.0, 3.0));
        /// Distance between rays.
        spacing_km: f64 = 2.5, limits(Range::new(0.05, 1000.0)), unit("km");
        /// Length of the largest variations along the sheet: rays come in bundles, and these in bright and quiet stretches.
        outer_scale_km: f64 = 80.0, limits(Range::new(0.05, 10_000.0)), unit("km");
        /// Amplitude of variations relative to those twice as long: 0.5 for bundles that outshine their rays, 1 for rays that are as strong as bundles.
        octave_gain: f64 = 0.6, limits(Range::new(0.0, 1.0));
        /// Speed of the rays along the sheet, in opposite directions on its two sides.
        shear_km_per_s: f64 = 1.5, limits(Range::new(-100.0, 100.0)), unit("km/s");
        /// Lifetime of a group of four rays; that of longer variations is longer in proportion.
        lifetime_s: f64 = 3.0, limits(Range::new(0.01, 1e5)), unit("s");
        /// Variation of the electron energy with the rays: bright rays reach lower altitudes. The standard deviation of its logarithm.
        energy_variation: f64 = 0.15, limits(Range::new(0.0, 2.0));
        /// Variation of brightness and energy across the thickness of the sheet, as a factor of `contrast` and `energy_variation`: a fold that is seen along
        /// the sheet is several rays instead of one bar.
        filament_contrast: f64 = 1.5, limits(Range::new(0.0, 5.0));
        /// Distance between filaments across the sheet.
        filament_spacing_km: f64 = 2.5, limits(Range::new(0.05, 1000.0)), unit("km");
        /// Length of filaments along the sheet.
        filament_length_km: f64 = 20.0, limits(Range::new(0.05, 10_000.0)), unit("km");
        /// Depth of black rays, thin dark gaps that travel along the sheet.
        black_ray_depth: f64 = 0.0, limits(FRACTION);
        /// Distance between black rays.
        black_ray_spacing_km: f64 = 8.0, limits(Range::new(0.1, 1000.0)), unit("km");
    }
}

bansho_base::parameters! {
    /// Folds and curls that travel along the drawn sheets.
    pub struct FoldParameters {
        /// Amplitude of the displacement to each side of the drawn line.
        amplitude_km: f64 = 3.0, limits(Range::new(0.0, 500.0)), unit("km");
        /// Distance between folds.
        wavelength_km: f64 = 40.0, limits(Range::new(0.5, 10_000.0)), unit("km");
        /// Speed of the folds along the sheet.
        speed_km_per_s: f64 = 2.0, limits(Range::new(-100.0, 100.0)), unit("km/s");
        /// Lifetime of a fold.
        lifetime_s: f64 = 8.0, limits(Range::new(0.01, 1e5)), unit("s");
        /// Lean of the crests: 0 for waves, 1 for curls.
        curl: f64 = 0.3, limits(Range::new(0.0, 2.0));
    }
}

bansho_base::parameters! {
    /// A slow flow that winds the sheets as a whole, each with the others: bends, swirls and quiet stretches.
    pub struct SwirlParameters {
        /// Path along which the flow carries a point of a sheet (root mean square); 0 for none.
        displacement_km: f64 = 30.0, limits(Range::new(0.0, 1000.0)), unit("km");
        /// Size of the largest swirls.
        size_km: f64 = 160.0, limits(Range::new(1.0, 10_000.0)), unit("km");
        /// Speed with which the swirls drift eastward.
        drift_km_per_s: f64 = 0.3, limits(Range::new(-100.0, 100.0)), unit("km/s");
        /// Lifetime of a swirl.
        lifetime_s: f64 = 60.0, limits(Range::new(0.01, 1e5)), unit("s");
    }
}

bansho_base::parameters! {
    /// The diffuse aurora: a weak glow without rays on both sides of the sheets.
    pub struct DiffuseParameters {
        /// Power of its electrons relative to those of the sheets, in addition to them.
        fraction: f64 = 0.7, limits(Range::new(0.0, 100.0));
        /// Width to each side of the sheets (standard deviation).
        width_km: f64 = 35.0, limits(Range::new(1.0, 2000.0)), unit("km");
        /// Energy of its electrons.
        energy_ev: f64 = 3000.0, limits(Range::new(100.0, 100_000.0)), unit("eV");
        /// Variation of its brightness in patches: the standard deviation of its logarithm.
        contrast: f64 = 0.5, limits(Range::new(0.0, 2.0));
        /// Size of the largest patches.
        patch_km: f64 = 90.0, limits(Range::new(1.0, 10_000.0)), unit("km");
        /// Lifetime of the largest patches.
        lifetime_s: f64 = 30.0, limits(Range::new(0.01, 1e5)), unit("s");
    }
}

bansho_base::parameters! {
    /// Patches of the sheet that brighten and fade.
    pub struct PulsationParameters {
        /// Depth of the fading: 0 for none, 1 for complete darkness.
        modulation_depth: f64 = 0.0, limits(FRACTION);
        /// Period of the pulsation.
        period_s: f64 = 8.0, limits(Range::new(0.05, 1e5)), unit("s");
        /// Length of a patch along the sheet.
        patch_length_km: f64 = 60.0, limits(Range::new(0.1, 20_000.0)), unit("km");
    }
}

bansho_base::choice! {
    /// What is drawn: the light, or a stage of its computation as a map of the drawn square in front of everything. Maps show the square seen along the
    /// field, east to the right and north up, as wide as the picture is high; `exposure_ev100 = 9.7` shows their white as white.
    pub enum AuroraStage {
        /// The aurora.
        Light = "light",
        /// Control points and segments of the in-between shape (thesis, figures 2.9, 2.15, 3.4 to 3.8).
        Shape = "shape",
        /// Particles scattered about the in-between shape, N(i, j) (figure 2.10).
        ScatterCount = "scatter_count",
        /// Noise in the potential (figure 2.11).
        PotentialNoise = "potential_noise",
        /// Potential with its noise, and the electric field as arrows (figures 2.12, 3.14).
        Potential = "potential",
        /// Cells that are near the shape by potential and scatter count (red), and by their potential alone (yellow).
        NearCells = "near_cells",
        /// Particles per cell (figure 2.14).
        ParticleCount = "particle_count",
    }
}

bansho_base::parameters! {
    /// An aurora (Sekiguchi): shapes drawn in the plane at 100 km altitude, particles that follow them, and the light of the air that they strike.
    pub struct AuroraParameters {
        /// Side of the drawn square, which is centered on the observer's zenith.
        extent_km: f64 = 600.0, limits(Range::new(1.0, 20_000.0)), unit("km");
        /// Energy flux of the electrons, mean over the thickness of a sheet: 10 for a faint arc, 50 for a bright one, 300 for a storm.
        flux_mw_per_m2: Animated<f64> = Animated::from(50.0), limits(Range::new(0.0, 10_000.0)), unit("mW/m^2");
        /// Energy of the electrons: 500 eV for a high, red aurora, 5000 eV for a green one, 30000 eV for one with a low, pink lower border. The
        /// product with the factor of a sheet must be within the range of the tables, 100 eV to 100 keV.
        energy_ev: Animated<f64> = Animated::from(5000.0), limits(Range::new(100.0, 100_000.0)), unit("eV");
        /// Energy spectrum of the electrons.
        spectrum: SpectrumShape = SpectrumShape::Gaussian;
        /// Thickness of a sheet, twice L_thr; `"auto"` is two cells of the field.
        thickness_km: Auto<f64> = Auto::Auto, limits(Range::new(0.01, 1000.0)), unit("km");
        /// Dip of the magnetic field. At 90 rays are vertical; otherwise they lean by the difference, toward the south (north of the equator). Field
        /// lines with a dip below 30 degrees leave the drawn region and are drawn at 30.
        dip_deg: f64 = 77.0, limits(Range::new(-90.0, 90.0)), unit("degrees");
        /// Direction of magnetic north, east of true north.
        declination_deg: f64 = 0.0, limits(Range::new(-180.0, 180.0)), unit("degrees");
        /// Seconds of the aurora per second of the picture; the afterglow fades faster by this factor. At 1 the green light of a sheet that crosses
        /// the sky in seconds stays behind, and its front is purple. Most films of auroras are time lapses, in which the front is green.
        time_lapse: f64 = 1.0, limits(Range::new(0.01, 1e4));
        /// Whether excited atoms emit over their lifetime, 0.75 s for green and up to 134 s for red light. If `false` they emit at once, as in the thesis.
        afterglow: bool = true;
        /// Altitude above which the sun shines: N2+ ions scatter its light there, and rays have tall blue-violet tops. With the sun at a depression D
        /// it is 6371 km (1 / cos D - 1): 98 km at 10 degrees, 225 km at 15, 409 km at 20. Without it the aurora is in the Earth's shadow.
        sunlit_above_km: Option<f64> = None, limits(Range::new(80.0, 800.0)), unit("km");
        /// Simulated time before the shot.
        preroll_s: f64 = 1.5, limits(Range::new(0.0, 60.0)), unit("s");
        /// The shapes in chronological order; two waving curtains if the list is empty.
        shapes: Vec<ShapeParameters> = Vec::new(), limits(Length { min: 0, max: 1000, item: () });
        /// Transition from one shape to the next.
        morphing: MorphingParameters = MorphingParameters::default();
        /// The electric field that attracts particles to the shapes.
        field: FieldParameters = FieldParameters::default();
        /// The particles that represent the electrons.
        particles: ParticleParameters = ParticleParameters::default();
        /// Rays: fine bright and dark streaks along a sheet.
        rays: RayParameters = RayParameters::default();
        /// Folds that travel along a sheet.
        folds: FoldParameters = FoldParameters::default();
        /// A slow flow that winds the sheets as a whole.
        swirls: SwirlParameters = SwirlParameters::default();
        /// The diffuse aurora beside the sheets.
        diffuse: DiffuseParameters = DiffuseParameters::default();
        /// Patches that brighten and fade.
        pulsation: PulsationParameters = PulsationParameters::default();
        /// Rendering of the light.
        rendering: RenderingParameters = RenderingParameters::default();
        /// What is drawn: the light, or a map of a stage of its computation.
        stage: AuroraStage = AuroraStage::Light;
    }
    paper: afterglow, morphing, stage;
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
    /// How the tracks of the electrons become light.
    pub enum Sampling {
        /// By the mean of infinitely many tracks: no noise.
        MeanProfile = "mean_profile",
        /// By single collisions, as in the thesis (2.4).
        SingleCollisions = "single_collisions",
        /// By single photons, to the letter of the thesis (2.4.1, 2.4.2): every electron has a random path of its own, and for each collision one species, one
        /// line and one quenching are drawn. Noisier than `single_collisions` and slower, with the same mean; needs `energy_deposition = "hard_sphere"`.
        SinglePhotons = "single_photons",
    }
}

impl TrackModel {
    /// The emission table for a spectrum.
    #[must_use]
    pub fn emission(self, spectrum: Spectrum) -> Emission {
        match self {
            Self::Fang2010 => Emission::new(atmosphere(), spectrum),
            Self::HardSphereAtmosphere => {
                Emission::from_hard_spheres(atmosphere(), spectrum, &HardSphereParameters::default())
            }
        }
    }

    /// The table for a spectrum that a scene can select, computed once per process.
    fn shared_emission(self, shape: SpectrumShape) -> Arc<Emission> {
        static TABLES: [OnceLock<Arc<Emission>>; TrackModel::CHOICES.len() * SpectrumShape::CHOICES.len()] =
            [const { OnceLock::new() }; TrackModel::CHOICES.len() * SpectrumShape::CHOICES.len()];
        let index = self as usize * SpectrumShape::CHOICES.len() + shape as usize;
        get_or_compute(&TABLES[index], || Arc::new(self.emission(shape.spectrum()))).clone()
    }
}

impl RenderingParameters {
    /// The emission table for a spectrum. With `sunlit_above_km`, N2+ scatters sunlight above that altitude.
    pub(crate) fn emission(&self, shape: SpectrumShape, sunlit_above_km: Option<f64>) -> Arc<Emission> {
        let has_own_radii = self.energy_deposition == TrackModel::HardSphereAtmosphere
            && self.hard_spheres != HardSphereParameters::default();
        let emission = if has_own_radii {
            Arc::new(Emission::from_hard_spheres(atmosphere(), shape.spectrum(), &self.hard_spheres))
        } else {
            self.energy_deposition.shared_emission(shape)
        };
        match sunlit_above_km {
            Some(altitude_km) => Arc::new(Emission::clone(&emission).sunlit_above(atmosphere(), altitude_km)),
            None => emission,
        }
    }
}

bansho_base::choice! {
    /// Where the light of particles is blurred.
    pub enum Blur {
        /// On the sky, perpendicular to the field, by `blur_radius_km`: a near ray is wider than a far one.
        World = "world",
        /// In the picture, by `blur_radii`, at any distance, as in the thesis (2.28).
        Screen = "screen",
    }
}

bansho_base::parameters! {
    /// Radii (standard deviations) of the thesis's blur, eq. (2.28), which depend on the spectral line only; the thesis does not state their values.
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
    /// Rendering of the light of an aurora.
    pub struct RenderingParameters {
        /// How the tracks of the electrons become light.
        sampling: Sampling = Sampling::MeanProfile;
        /// Model of the energy loss of the electrons: the measured atmosphere, or the thesis's hard spheres.
        energy_deposition: TrackModel = TrackModel::Fang2010;
        /// The thesis's hard spheres.
        hard_spheres: HardSphereParameters = HardSphereParameters::default();
        /// Color matching functions by which spectral lines become color. Table 2.1 has the five lines of `energy_deposition = "hard_sphere"` only.
        color_matching: ColorMatching = ColorMatching::Cie1931;
        /// White balance of the camera of `color_matching = "camera"`, as the temperature of a black body; its colors are those of photographs if
        /// `picture.white_balance_k` is the same.
        camera_white_k: f64 = 4000.0, limits(Range::new(1500.0, 25_000.0)), unit("K");
        /// Where light is blurred: on the sky in km, or in the picture in pixels.
        blur_space: Blur = Blur::World;
        /// Radii of the blur in the picture.
        blur_radii: BlurParameters = BlurParameters::default();
        /// Blur radius of a particle's light perpendicular to the field (standard deviation). With `"auto"` it follows the distance between
        /// neighboring particles, and rays stay sharp.
        blur_radius_km: Auto<f64> = Auto::Auto, limits(Range::new(0.005, 100.0)), unit("km");
        /// Deflection of an electron from the field by a collision: RMS tangent of the angle, the vector omega of (2.21) and (2.24).
        collision_deflection: f64 = 0.002, limits(Range::new(0.0, MAX_COLLISION_DEFLECTION));
        /// The lower atmosphere, which attenuates light near the horizon.
        extinction: Extinction = Extinction::default();
        /// Attenuation coefficient d of (2.27): light from a distance of z km is attenuated by exp(-(d z)^2), besides `extinction`. The thesis does not
        /// state its value. AOVs in kilorayleigh include it.
        attenuation_per_km: f64 = 0.0, limits(Range::new(0.0, 0.1)), unit("1/km");
    }
    paper: sampling, energy_deposition, hard_spheres, color_matching, blur_space, blur_radii, attenuation_per_km;
}

/// Checks that the color table has the lines of the emission.
///
/// # Errors
///
/// Table 2.1 with other lines than its five.
pub(crate) fn check_color_matching(parameters: &AuroraParameters) -> Result<(), ShapeError> {
    let RenderingParameters { color_matching, energy_deposition, .. } = &parameters.rendering;
    if *color_matching == ColorMatching::Table21 && *energy_deposition != TrackModel::HardSphereAtmosphere {
        let key = "rendering.color_matching".to_owned();
        return Err(ShapeError { key, kind: ShapeErrorKind::LinesOutsideTable21 });
    }
    Ok(())
}

/// Checks that single photons are those of the thesis, whose rules are those of hard spheres.
///
/// # Errors
///
/// Single photons with another model of the energy loss.
pub(crate) fn check_sampling(parameters: &AuroraParameters) -> Result<(), ShapeError> {
    let RenderingParameters { sampling, energy_deposition, .. } = &parameters.rendering;
    if *sampling == Sampling::SinglePhotons && *energy_deposition != TrackModel::HardSphereAtmosphere {
        return Err(ShapeError { key: "rendering.sampling".to_owned(), kind: ShapeErrorKind::PhotonsWithoutSpheres });
    }
    if *sampling == Sampling::SinglePhotons && parameters.sunlit_above_km.is_some() {
        return Err(ShapeError { key: "sunlit_above_km".to_owned(), kind: ShapeErrorKind::PhotonsInSunlight });
    }
    Ok(())
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
    for (shape, shape_parameters) in parameters.shapes.iter().enumerate() {
        for (entry, sheet) in shape_parameters.sheets.iter().enumerate() {
            if let Some((point, kind)) = first_outside(sheet, entry + 1, energy_ev) {
                return Err(ShapeError { key: format!("shapes.{shape}.sheets.{entry}.energy_factor.{point}"), kind });
            }
        }
    }
    Ok(())
}

/// The first point of a sheet's energy curve outside the tables. The curve does not overshoot its points.
fn first_outside(sheet: &SheetParameters, number: usize, [low, high]: [f64; 2]) -> Option<(usize, ShapeErrorKind)> {
    for (point, &[length_fraction, factor]) in sheet.energy_factor.points().iter().enumerate() {
        let (min_ev, max_ev) = (low * factor, high * factor);
        let energy_ev = if max_ev > HIGHEST_EV * (1.0 + RELATIVE_ROUNDING) {
            max_ev
        } else if min_ev < LOWEST_EV * (1.0 - RELATIVE_ROUNDING) {
            min_ev
        } else {
            continue;
        };
        return Some((point, ShapeErrorKind::EnergyOutside { sheet: number, length_fraction, energy_ev }));
    }
    None
}
