//! A figure as plain data: panels of curves with their axes, and the table of numbers behind them.

use bansho::base::math;

/// A figure: panels from top to bottom, all as wide as each other.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    /// What it shows, in one line.
    pub(crate) title: String,
    /// From top to bottom.
    pub(crate) panels: Vec<Panel>,
    /// All numbers that it shows, for CSV.
    pub(crate) table: FigureTable,
}

/// A part of a figure with axes of its own. If the panel below has the same x axis, only that one labels it.
#[derive(Clone, Debug)]
pub(crate) enum Panel {
    /// Curves and points.
    Plot(Plot),
    /// Colors along an axis.
    Colors(ColorStrip),
}

impl Panel {
    /// The horizontal axis.
    pub(crate) fn x(&self) -> &Axis {
        match self {
            Self::Plot(plot) => &plot.x,
            Self::Colors(strip) => &strip.x,
        }
    }
}

/// Curves and points over two axes.
#[derive(Clone, Debug)]
pub(crate) struct Plot {
    /// Horizontal.
    pub(crate) x: Axis,
    /// Vertical.
    pub(crate) y: Axis,
    /// Drawn in this order.
    pub(crate) series: Vec<Series>,
}

/// sRGB colors, evenly spaced from one end of an axis to the other.
#[derive(Clone, Debug)]
pub(crate) struct ColorStrip {
    /// Horizontal.
    pub(crate) x: Axis,
    /// At the middles of equal intervals.
    pub(crate) colors: Vec<Rgb>,
}

/// An sRGB color.
pub(crate) type Rgb = [u8; 3];

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Axis {
    /// The quantity, with its symbol.
    pub(crate) label: String,
    /// Its unit; empty for a dimensionless one.
    pub(crate) unit: String,
    /// How numbers become distances.
    pub(crate) scale: Scale,
    /// Lower and upper end.
    pub(crate) range: [f64; 2],
}

impl Axis {
    /// A linear axis.
    pub(crate) fn linear(label: &str, unit: &str, range: [f64; 2]) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), scale: Scale::Linear, range }
    }

    /// A logarithmic axis over whole decades; a short one ends at 1, 2 or 5 times a power of ten.
    pub(crate) fn log(label: &str, unit: &str, range: [f64; 2]) -> Self {
        let ends: &[f64] = if range[1] < 1e3 * range[0] { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let [low, high] = range.map(decade);
        let low = ends.iter().map(|end| end * low).filter(|end| *end <= range[0] * 1.000_001).fold(low, f64::max);
        let above = ends.iter().map(|end| end * high).chain([10.0 * high]);
        let range = [low, above.filter(|end| *end >= range[1] * 0.999_999).fold(10.0 * high, f64::min)];
        Self { label: label.to_owned(), unit: unit.to_owned(), scale: Scale::Log, range }
    }

    /// Label and unit, as printed along the axis; its numbers are multiples of `factor`.
    pub(crate) fn caption(&self, factor: &str) -> String {
        match [factor, &self.unit].map(str::is_empty) {
            [true, true] => self.label.clone(),
            [true, false] => format!("{} ({})", self.label, self.unit),
            [false, true] => format!("{} ({factor})", self.label),
            [false, false] => format!("{} ({factor} {})", self.label, self.unit),
        }
    }
}

/// The largest power of ten up to `value`, which may lie below it by rounding.
fn decade(value: f64) -> f64 {
    math::pow(10.0, (math::log10(value) + 1e-9).floor())
}

/// How numbers become distances along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    /// In proportion.
    Linear,
    /// By the logarithm.
    Log,
}

/// A curve, or points.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    /// What the legend calls it.
    pub(crate) label: String,
    /// Its color.
    pub(crate) color: Rgb,
    /// Line or markers.
    pub(crate) style: Style,
    /// (x, y); a curve is interrupted where a number is not finite.
    pub(crate) points: Vec<[f64; 2]>,
}

impl Series {
    /// Curve `index` of a plot, in the color of that number.
    pub(crate) fn curve(label: impl Into<String>, index: usize, points: Vec<[f64; 2]>) -> Self {
        Self { label: label.into(), color: color(index), style: Style::Line, points }
    }

    /// Measurements, or numbers of somebody else, which the curves are compared with: gray circles.
    pub(crate) fn reference(label: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { label: label.into(), color: PALETTE[6], style: Style::Markers, points }
    }

    /// The same curve, dashed.
    pub(crate) fn dashed(self) -> Self {
        Self { style: Style::Dashed, ..self }
    }

    /// The same curve in another color.
    pub(crate) fn colored(self, color: Rgb) -> Self {
        Self { color, ..self }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Style {
    /// A line.
    Line,
    /// A dashed line.
    Dashed,
    /// Circles: measurements, or numbers of somebody else.
    Markers,
}

/// Colors of curves that are told apart with any color vision and in print: M. Okabe and K. Ito, "Color universal design" (2008).
pub(crate) const PALETTE: [Rgb; 8] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [60, 60, 60],
    [150, 90, 40],
];

/// The color of curve `index`.
pub(crate) fn color(index: usize) -> Rgb {
    PALETTE[index % PALETTE.len()]
}

/// A unit of the library with raised digits.
pub(crate) fn pretty_unit(unit: &str) -> String {
    unit.replace("^2", "²").replace("^3", "³")
}

/// Numbers in rows and columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct FigureTable {
    /// Name of each column, with its unit.
    pub(crate) columns: Vec<String>,
    /// One number per column; one that is not finite is an empty cell.
    pub(crate) rows: Vec<Vec<f64>>,
}

impl FigureTable {
    /// A table without rows.
    pub(crate) fn new(columns: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self { columns: columns.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// A table without rows: the argument of some functions, then the functions.
    pub(crate) fn of_functions(argument: &str, functions: impl IntoIterator<Item = String>) -> Self {
        Self::new([argument.to_owned()].into_iter().chain(functions))
    }

    /// Adds the row of one argument with the values of the functions.
    pub(crate) fn push(&mut self, argument: f64, values: impl IntoIterator<Item = f64>) {
        self.rows.push([argument].into_iter().chain(values).collect());
    }

    /// Two columns as points.
    pub(crate) fn points(&self, x: usize, y: usize) -> Vec<[f64; 2]> {
        self.rows.iter().map(|row| [row[x], row[y]]).collect()
    }

    /// Smallest and largest finite number of some columns; `None` if there are none.
    pub(crate) fn bounds(&self, columns: &[usize]) -> Option<[f64; 2]> {
        bounds(self.rows.iter().flat_map(|row| columns.iter().map(|&column| row[column])))
    }
}

/// Smallest and largest finite number; `None` if there are none.
pub(crate) fn bounds(values: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold(None, |found: Option<[f64; 2]>, value| {
        Some(found.map_or([value; 2], |[low, high]| [low.min(value), high.max(value)]))
    })
}
