//! Aurora: where electrons lose their energy, and the light of the air that they strike (Sekiguchi, 2.3 and 2.4; Fang et al. 2010).

use bansho::aurora::{
    SpectrumShape,
    physics::{
        atmosphere::{LOWEST_KM, atmosphere, level_altitude_km},
        emission::{EMITTERS, Emission, LINES, Line, quenching::radiated_fraction},
        precipitation::Deposition,
    },
};

use super::{
    csv::{number, rows},
    figure::{Axis, Figure, FigureTable, Panel, Plot, Rgb, Series, bounds},
    ticks,
};

/// Energy (keV), altitude (km) and ionization rate (m^-3 s^-1 per mW m^-2) of the peaks of Fang et al. (2010), computed independently.
const FANG_PEAKS: &str = include_str!("data/fang2010_peaks.csv");
/// Altitude (km), fractions of O(1S), O(1D), N2+(B) and N2(B) that radiate, computed independently.
const QUENCHING: &str = include_str!("data/quenching.csv");

/// Decades of a rate that are shown below its maximum.
const DECADES: f64 = 1e-4;
/// Fraction of its maximum below which a profile ends for the altitude axis.
const FAINT: f64 = 0.02;

/// The color of a line, dark enough for white paper.
fn line_color(line: &Line) -> Rgb {
    match line.wavelength_nm as u32 {
        391 => [110, 40, 160],
        427 => [45, 70, 200],
        470 => [40, 150, 220],
        557 => [20, 150, 40],
        630 => [215, 35, 35],
        636 => [240, 130, 90],
        _ => [130, 40, 60],
    }
}

/// An altitude axis that shows the profiles of some columns of a table whose first column is the altitude.
fn altitude_axis(table: &FigureTable, columns: &[usize]) -> Axis {
    let mut top = LOWEST_KM + 40.0;
    for &column in columns {
        let most = table.bounds(&[column]).map_or(0.0, |[_, high]| high);
        top = table.rows.iter().filter(|row| row[column] > FAINT * most).map(|row| row[0]).fold(top, f64::max);
    }
    Axis::linear("Altitude", "km", [LOWEST_KM, ticks::rounded([0.0, top], 12)[1]])
}

/// Volume emission rate of every line by altitude, for an energy in eV and an energy flux in mW/m^2.
pub(crate) fn emission(energy_ev: f64, flux_mw_per_m2: f64, shape: SpectrumShape) -> Figure {
    let profile = Emission::new(atmosphere(), shape.spectrum()).profile(energy_ev);
    let mut table = FigureTable::of_functions("altitude_km", LINES.iter().map(line_column));
    for (level, photons) in profile.iter().enumerate() {
        let rates = LINES.iter().map(|line| flux_mw_per_m2 * line.photons * photons[line.emitter.index()]);
        table.push(level_altitude_km(level), rates);
    }
    let columns: Vec<usize> = (1..=LINES.len()).collect();
    let most = table.bounds(&columns).map_or(1.0, |[_, high]| high);
    let mut series = Vec::new();
    for (index, line) in LINES.iter().enumerate() {
        // The altitude is vertical, as in every figure of an atmosphere.
        series.push(Series::curve(pretty(line.name), index, table.points(1 + index, 0)).colored(line_color(line)));
    }
    Figure {
        title: format!(
            "Auroral emission for {} eV ({}) and {} mW/m²",
            number(energy_ev),
            shape.name(),
            number(flux_mw_per_m2)
        ),
        panels: vec![Panel::Plot(Plot {
            x: Axis::log("Volume emission rate", "photons m⁻³ s⁻¹", [DECADES * most, most]),
            y: altitude_axis(&table, &columns),
            series,
        })],
        table,
    }
}

/// The column of a line's volume emission rate.
fn line_column(line: &Line) -> String {
    let name = line.name.to_lowercase().replace("n2+", "n2_ion").replace([' ', '.'], "_");
    format!("{name}_photons_per_m3_s")
}

/// The name of a line with lowered and raised digits.
fn pretty(name: &str) -> String {
    name.replace("N2+", "N₂⁺").replace("N2 ", "N₂ ")
}

/// Ionization rate by altitude for energies in eV. Times 35 eV it is the energy that is deposited.
pub(crate) fn deposition(energies_ev: &[f64], shape: SpectrumShape) -> Figure {
    let deposition = Deposition::new(atmosphere(), shape.spectrum());
    let names = energies_ev.iter().map(|energy| format!("q_{}_ev_per_m3_s_per_mw_m2", number(*energy)));
    let mut table = FigureTable::of_functions("altitude_km", names);
    for level in 0..atmosphere().levels().len() {
        let altitude_km = level_altitude_km(level);
        table.push(altitude_km, energies_ev.iter().map(|energy| deposition.ionization(*energy, altitude_km)));
    }
    let columns: Vec<usize> = (1..=energies_ev.len()).collect();
    let most = table.bounds(&columns).map_or(1.0, |[_, high]| high);
    let mut series = Vec::new();
    for (index, energy) in energies_ev.iter().enumerate() {
        series.push(Series::curve(kiloelectronvolts(*energy), index, table.points(1 + index, 0)));
    }
    // The peaks are those of beams of one energy.
    if shape == SpectrumShape::Monoenergetic {
        let mut points = Vec::new();
        for [energy_kev, altitude, rate] in rows::<3>(FANG_PEAKS) {
            if energies_ev.iter().any(|energy| (energy_kev * 1e3 / energy - 1.0).abs() < 1e-6) {
                points.push([rate, altitude]);
            }
        }
        if !points.is_empty() {
            series.push(Series::reference("peaks, Fang et al. (2010)", points));
        }
    }
    Figure {
        title: format!("Ionization by electrons of 1 mW/m² ({}); deposited energy is 35 eV q", shape.name()),
        panels: vec![Panel::Plot(Plot {
            x: Axis::log("Ionization rate q", "m⁻³ s⁻¹", [DECADES * most, most]),
            y: altitude_axis(&table, &columns),
            series,
        })],
        table,
    }
}

fn kiloelectronvolts(energy_ev: f64) -> String {
    if energy_ev < 1000.0 { format!("{} eV", number(energy_ev)) } else { format!("{} keV", number(energy_ev / 1e3)) }
}

/// Upper states, in the order of [`EMITTERS`]: name for the legend, for the column, and color.
const STATES: [(&str, &str, Rgb); 4] = [
    ("O(¹S): 557.7 nm", "o_1s_557_7_nm", [20, 150, 40]),
    ("O(¹D): 630.0, 636.4 nm", "o_1d_630_0_636_4_nm", [215, 35, 35]),
    ("N₂⁺(B): 391.4, 427.8, 470.9 nm", "n2_ion_b_391_4_427_8_470_9_nm", [45, 70, 200]),
    ("N₂(B): 670.5 nm and bands", "n2_b_670_5_nm", [130, 40, 60]),
];

/// Fraction of the excited states that radiate before a collision quenches them, by altitude.
pub(crate) fn quenching() -> Figure {
    let names = STATES.iter().map(|(_, column, _)| format!("radiated_fraction_{column}"));
    let mut table = FigureTable::of_functions("altitude_km", names);
    for (level, air) in atmosphere().levels().iter().enumerate() {
        table.push(level_altitude_km(level), EMITTERS.map(|emitter| radiated_fraction(emitter, air)));
    }
    let mut series = Vec::new();
    for (index, (label, _, color)) in STATES.into_iter().enumerate() {
        let curve = Series::curve(label, index, table.points(1 + index, 0)).colored(color);
        // The curve of N2(B) is mostly that of N2+(B), which would be hidden below a line.
        series.push(if index == 3 { curve.dashed() } else { curve });
    }
    let reference = rows::<5>(QUENCHING);
    let points = reference.iter().flat_map(|row| row[1..].iter().map(|&fraction| [fraction, row[0]])).collect();
    series.push(Series::reference("Stern-Volmer, computed independently", points));
    let top = bounds(reference.iter().map(|row| row[0])).map_or(500.0, |[_, high]| high);
    Figure {
        title: "Fraction of excited states that radiate: quenching by N₂, O₂ and O".to_owned(),
        panels: vec![Panel::Plot(Plot {
            x: Axis::linear("Radiated fraction", "", [-0.02, 1.02]),
            y: Axis::linear("Altitude", "km", [LOWEST_KM, top.min(500.0)]),
            series,
        })],
        table,
    }
}
