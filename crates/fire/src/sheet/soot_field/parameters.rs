//! Parameters of the soot field.

use bansho_base::parameters::Range;

const FRACTION: Range = Range::new(0.0, 1.0);

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
