//! Rain: drop sizes, terminal velocities and the opacity of streaks (Yoshida, Dobashi & Yamamoto).

use bansho::rain::{
    VelocityLaw,
    drops::{
        size_distribution::DropSizeDistribution,
        terminal_velocity::{FallAir, TerminalVelocity},
    },
    streaks::coverage::Streak,
};

use super::{
    csv::{number, rows},
    figure::{Axis, Figure, FigureTable, Panel, Plot, Series},
    ticks,
};

/// Diameter (mm) and terminal velocity (m/s): Gunn and Kinzer (1949).
const GUNN_KINZER: &str = include_str!("data/gunn_kinzer_1949.csv");
/// Rain rate (mm/h), diameter (mm), number density (1/(m^3 mm)): the formula of Marshall and Palmer (1948), computed independently.
const MARSHALL_PALMER: &str = include_str!("data/marshall_palmer.csv");
/// Diameter (mm), exposure time (s), opacity D / (v T) with the velocities of Gunn and Kinzer, computed independently.
const STREAK_OPACITY: &str = include_str!("data/streak_opacity.csv");

/// Largest diameter that is plotted, mm: larger drops break up.
const LARGEST_MM: f64 = 6.0;
/// Rows for each mm of diameter.
const PER_MM: usize = 20;

/// Diameters from 0 to [`LARGEST_MM`], mm.
fn diameters_mm() -> Vec<f64> {
    (0..=LARGEST_MM as usize * PER_MM).map(|index| index as f64 / PER_MM as f64).collect()
}

fn diameter_axis() -> Axis {
    Axis::linear("Drop diameter D", "mm", [0.0, LARGEST_MM])
}

/// A column of `points` beside the rows of the same abscissa.
fn add_reference(table: &mut FigureTable, name: String, points: &[[f64; 2]]) {
    table.columns.push(name);
    for row in &mut table.rows {
        let found = points.iter().find(|point| (point[0] - row[0]).abs() < 1e-9);
        row.push(found.map_or(f64::NAN, |point| point[1]));
    }
}

/// Drop size distributions of Marshall and Palmer (1948), eq. (1), at rain rates in mm/h.
pub(crate) fn drop_sizes(rates_mm_per_h: &[f64]) -> Figure {
    let names = rates_mm_per_h.iter().map(|rate| format!("n_at_{}_mm_per_h_per_m3_mm", number(*rate)));
    let mut table = FigureTable::of_functions("diameter_mm", names);
    let distributions: Vec<_> =
        rates_mm_per_h.iter().map(|rate| DropSizeDistribution::marshall_palmer(*rate)).collect();
    for diameter in diameters_mm() {
        table.push(diameter, distributions.iter().map(|distribution| distribution.density(diameter)));
    }
    let mut series = Vec::new();
    for (index, rate) in rates_mm_per_h.iter().enumerate() {
        series.push(Series::curve(format!("R = {} mm/h", number(*rate)), index, table.points(0, 1 + index)));
    }
    let reference = rows::<3>(MARSHALL_PALMER).into_iter();
    let points: Vec<[f64; 2]> = reference
        .filter(|[rate, ..]| rates_mm_per_h.contains(rate))
        .map(|[_, diameter, density]| [diameter, density])
        .collect();
    if !points.is_empty() {
        series.push(Series::reference("formula at the paper's diameters", points));
    }
    Figure {
        title: "Drop size distribution of Marshall and Palmer (1948), eq. (1)".to_owned(),
        panels: vec![Panel::Plot(Plot {
            x: diameter_axis(),
            y: Axis::log("Number density n(D)", "m⁻³ mm⁻¹", [1e-2, 1e4]),
            series,
        })],
        table,
    }
}

/// Terminal velocity in still air at 20 degrees Celsius and 1013.25 hPa: both laws, and the measurements.
pub(crate) fn terminal_velocity() -> Figure {
    let measured: Vec<[f64; 2]> = rows::<2>(GUNN_KINZER);
    let laws = [VelocityLaw::GunnKinzer, VelocityLaw::RigidSphere]
        .map(|law| TerminalVelocity { law, air: FallAir::default() });
    let mut diameters = diameters_mm();
    diameters.extend(measured.iter().map(|point| point[0]));
    diameters.sort_by(f64::total_cmp);
    diameters.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let mut table = FigureTable::new(["diameter_mm", "gunn_kinzer_m_per_s", "rigid_sphere_m_per_s"]);
    for diameter in diameters {
        table.push(diameter, laws.iter().map(|law| law.speed(diameter)));
    }
    add_reference(&mut table, "measured_gunn_kinzer_1949_m_per_s".to_owned(), &measured);
    let top = table.bounds(&[1, 2]).map_or(10.0, |[_, high]| high);
    Figure {
        title: "Terminal velocity of raindrops at 20 °C, 1013 hPa".to_owned(),
        panels: vec![Panel::Plot(Plot {
            x: diameter_axis(),
            y: Axis::linear("Terminal velocity v", "m/s", ticks::rounded([0.0, top], 7)),
            series: vec![
                Series::curve("gunn_kinzer: interpolated measurements", 0, table.points(0, 1)),
                Series::curve("rigid_sphere: eqs. (2) to (4)", 1, table.points(0, 2)).dashed(),
                Series::reference("measured by Gunn and Kinzer (1949)", measured),
            ],
        })],
        table,
    }
}

/// Opacity on the axis of a streak, D / (v T), at exposure times in s.
pub(crate) fn streak_opacity(exposure_times_s: &[f64], law: VelocityLaw) -> Figure {
    let velocity = TerminalVelocity { law, air: FallAir::default() };
    let names = exposure_times_s.iter().map(|time| format!("opacity_at_{}_s", number(*time)));
    let mut table = FigureTable::of_functions("diameter_mm", names);
    // A drop of no diameter has no streak.
    for diameter in diameters_mm().into_iter().filter(|diameter| *diameter >= 0.1) {
        let speed = velocity.speed(diameter);
        table.push(diameter, exposure_times_s.iter().map(|time| Streak::new(diameter, speed, *time).profile(0.0)));
    }
    let mut series = Vec::new();
    for (index, time) in exposure_times_s.iter().enumerate() {
        series.push(Series::curve(format!("T = {}", exposure(*time)), index, table.points(0, 1 + index)));
    }
    if law == VelocityLaw::GunnKinzer {
        let mut reference = Vec::new();
        for time in exposure_times_s {
            let rows = rows::<3>(STREAK_OPACITY).into_iter().filter(|row| (row[1] / time - 1.0).abs() < 1e-4);
            let points: Vec<[f64; 2]> = rows.map(|[diameter, _, opacity]| [diameter, opacity]).collect();
            if !points.is_empty() {
                add_reference(&mut table, format!("reference_at_{}_s", number(*time)), &points);
                reference.extend(points);
            }
        }
        if !reference.is_empty() {
            series.push(Series::reference("D / (v T), Gunn and Kinzer's v", reference));
        }
    }
    let columns: Vec<usize> = (1..=exposure_times_s.len()).collect();
    let [low, high] = table.bounds(&columns).unwrap_or([0.01, 1.0]);
    Figure {
        title: format!("Opacity of rain streaks by exposure time T, terminal velocity v: {}", law.name()),
        panels: vec![Panel::Plot(Plot {
            x: diameter_axis(),
            // Below the lowest curve is room for the legend.
            y: Axis::log("Opacity on the axis, D / (v T)", "", [0.25 * low, high]),
            series,
        })],
        table,
    }
}

/// An exposure time as on a camera's dial.
fn exposure(seconds: f64) -> String {
    let inverse = 1.0 / seconds;
    if seconds < 0.5 && (inverse - inverse.round()).abs() < 1e-6 * inverse {
        format!("1/{inverse:.0} s")
    } else {
        format!("{} s", number(seconds))
    }
}
