//! The poly6 kernel and its gradient: Inagaki et al., eq. (2), figures 2 and 3.

use bansho::{
    base::math,
    fire::particles::render::{line_gradient, line_integral},
    sph::{Poly6, SmoothingKernel},
};

use super::{
    figure::{Axis, Figure, FigureTable, Panel, Plot, Series},
    texture::{FigureTexture, signed_code, unsigned_code},
};

/// Rows of the table, without the first.
const STEPS: usize = 200;

/// Poly6 of support radius 1, 1/d^3.
fn poly6(r: f64) -> f64 {
    if r < 1.0 { f64::from(Poly6::<3>::new(1.0).value((r * r) as f32)) } else { 0.0 }
}

/// Its derivative, 1/d^4.
fn poly6_gradient(r: f64) -> f64 {
    if r < 1.0 { r * f64::from(Poly6::<3>::new(1.0).gradient_factor((r * r) as f32)) } else { 0.0 }
}

/// Where the gradient is steepest: the derivative of `r (1 - r^2)^2` is 0 at `1 / sqrt(5)`.
fn steepest_gradient() -> f64 {
    poly6_gradient(math::sqrt(0.2)).abs()
}

/// The figure: kernel, gradient, and their line integrals, by which Bansho draws gas.
pub(crate) fn figure() -> Figure {
    let mut table = FigureTable::new([
        "r_per_d",
        "poly6_times_d3",
        "poly6_gradient_times_d4",
        "line_integral_times_d2",
        "line_integral_gradient_times_d3",
    ]);
    for step in 0..=STEPS {
        let r = step as f64 / STEPS as f64;
        table.push(r, [poly6(r), poly6_gradient(r), line_integral(r, 1.0), line_gradient(r, 1.0)]);
    }
    let x = Axis::linear("Distance r/d", "", [0.0, 1.0]);
    let values = vec![
        Series::curve("poly6, W d³: the paper's sprite", 0, table.points(0, 1)),
        Series::curve("its line integral, times d²", 1, table.points(0, 3)).dashed(),
    ];
    let gradients = vec![
        Series::curve("of poly6, W' d⁴: the paper's deflection", 0, table.points(0, 2)),
        Series::curve("of its line integral, times d³", 1, table.points(0, 4)).dashed(),
    ];
    Figure {
        title: "Poly6 kernel of support radius d (Inagaki et al., eq. (2), figures 2 and 3)".to_owned(),
        panels: vec![
            Panel::Plot(Plot { x: x.clone(), y: Axis::linear("Kernel", "", [0.0, 1.6]), series: values }),
            Panel::Plot(Plot { x, y: Axis::linear("Derivative", "", [-3.0, 0.0]), series: gradients }),
        ],
        table,
    }
}

/// Centers of texels from the upper left, from -1 to 1: to the right and up.
fn texel_centers(size: usize) -> impl Iterator<Item = [f64; 2]> {
    (0..size * size).map(move |index| {
        let [column, row] = [index % size, index / size].map(|index| (2.0 * index as f64 + 1.0) / size as f64 - 1.0);
        [column, -row]
    })
}

/// Poly6 over a square of side 2 d, scaled to 1 at the center: figure 2.
pub(crate) fn density_texture(size: usize) -> FigureTexture {
    let values = texel_centers(size).map(|[x, y]| poly6(math::hypot(x, y)) / poly6(0.0));
    FigureTexture::linear_8(size, values.map(|value| [unsigned_code(value); 3]))
}

/// Direction in which a particle deflects light, outward, over a square of side 2 d, scaled to 1 where it is largest: figure 3. In the plane
/// through the particle nothing is deflected along z.
pub(crate) fn deflection_texture(size: usize) -> FigureTexture {
    let directions = texel_centers(size).map(deflection);
    FigureTexture::linear_8(size, directions.map(|direction| direction.map(signed_code)))
}

/// The deflection at (x, y), in support radii from the particle, of length 1 where it is largest.
fn deflection([x, y]: [f64; 2]) -> [f64; 3] {
    let r = math::hypot(x, y);
    // The direction (x, y) / r has no value at the center, where the gradient is 0.
    let outward = -poly6_gradient(r) / (steepest_gradient() * r.max(f64::MIN_POSITIVE));
    [x * outward, y * outward, 0.0]
}
