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
    figure::{Axis, Figure, FigureTable, Panel, Plot, Rgb, Series, Style, bounds, color},
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
    let reach = |&column: &usize| {
        let most = table.bounds(&[column]).map_or(0.0, |[_, high]| high);
        table.rows.iter().filter(|row| row[column] > FAINT * most).map(|row| row[0]).fold(LOWEST_KM, f64::max)
    };
    let top = columns.iter().map(reach).fold(LOWEST_KM + 40.0, f64::max);
    Axis::linear("Altitude", "km", [LOWEST_KM, ticks::rounded([0.0, top], 12)[1]])
}

/// Volume emission rate of every line by altitude, for an energy in eV and an energy flux in mW/m^2.
pub(crate) fn emission(energy_ev: f64, flux_mw_per_m2: f64, shape: SpectrumShape) -> Figure {
    let profile = Emission::new(atmosphere(), shape.spectrum()).profile(energy_ev);
    let name = |line: &Line| {
        let name = line.name.to_lowercase().replace("n2+", "n2_ion").replace([' ', '.'], "_");
        format!("{name}_photons_per_m3_s")
    };
    let mut table = FigureTable::new(["altitude_km".to_owned()].into_iter().chain(LINES.iter().map(name)));
    for (level, photons) in profile.iter().enumerate() {
        let rate = |line: &Line| flux_mw_per_m2 * line.photons * photons[line.emitter.index()];
        table.rows.push([level_altitude_km(level)].into_iter().chain(LINES.iter().map(rate)).collect());
    }
    let columns: Vec<usize> = (1..=LINES.len()).collect();
    let most = table.bounds(&columns).map_or(1.0, |[_, high]| high);
    let curve = |(index, line): (usize, &Line)| Series {
        label: pretty(line.name),
        color: line_color(line),
        style: Style::Line,
        points: table.points(1 + index, 0),
    };
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
            series: LINES.iter().enumerate().map(curve).collect(),
        })],
        table,
    }
}

/// The name of a line with lowered and raised digits.
fn pretty(name: &str) -> String {
    name.replace("N2+", "N₂⁺").replace("N2 ", "N₂ ")
}

/// Ionization rate by altitude for energies in eV. Times 35 eV it is the energy that is deposited.
pub(crate) fn deposition(energies_ev: &[f64], shape: SpectrumShape) -> Figure {
    let deposition = Deposition::new(atmosphere(), shape.spectrum());
    let name = |energy: &f64| format!("q_{}_ev_per_m3_s_per_mw_m2", number(*energy));
    let mut table = FigureTable::new(["altitude_km".to_owned()].into_iter().chain(energies_ev.iter().map(name)));
    for level in 0..atmosphere().levels().len() {
        let altitude_km = level_altitude_km(level);
        let rate = |energy: &f64| deposition.ionization(*energy, altitude_km);
        table.rows.push([altitude_km].into_iter().chain(energies_ev.iter().map(rate)).collect());
    }
    let columns: Vec<usize> = (1..=energies_ev.len()).collect();
    let most = table.bounds(&columns).map_or(1.0, |[_, high]| high);
    let curve = |(index, energy): (usize, &f64)| Series {
        label: kiloelectronvolts(*energy),
        color: color(index),
        style: Style::Line,
        points: table.points(1 + index, 0),
    };
    let mut series: Vec<Series> = energies_ev.iter().enumerate().map(curve).collect();
    if shape == SpectrumShape::Monoenergetic {
        let is_shown = |row: &[f64; 3]| energies_ev.iter().any(|energy| (row[0] * 1e3 / energy - 1.0).abs() < 1e-6);
        let points: Vec<_> =
            rows::<3>(FANG_PEAKS).into_iter().filter(is_shown).map(|[_, altitude, rate]| [rate, altitude]).collect();
        if !points.is_empty() {
            let label = "peaks, Fang et al. (2010)".to_owned();
            series.push(Series { label, color: color(6), style: Style::Markers, points });
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

/// Upper states: name for the legend, for the column, and color.
const STATES: [(&str, &str, Rgb); 4] = [
    ("O(¹S): 557.7 nm", "o_1s_557_7_nm", [20, 150, 40]),
    ("O(¹D): 630.0, 636.4 nm", "o_1d_630_0_636_4_nm", [215, 35, 35]),
    ("N₂⁺(B): 391.4, 427.8, 470.9 nm", "n2_ion_b_391_4_427_8_470_9_nm", [45, 70, 200]),
    ("N₂(B): 670.5 nm and bands", "n2_b_670_5_nm", [130, 40, 60]),
];

/// Fraction of the excited states that radiate before a collision quenches them, by altitude.
pub(crate) fn quenching() -> Figure {
    let name = |state: &(&str, &str, Rgb)| format!("radiated_fraction_{}", state.1);
    let mut table = FigureTable::new(["altitude_km".to_owned()].into_iter().chain(STATES.iter().map(name)));
    for (level, air) in atmosphere().levels().iter().enumerate() {
        let fractions = EMITTERS.map(|emitter| radiated_fraction(emitter, air));
        table.rows.push([&[level_altitude_km(level)][..], &fractions].concat());
    }
    let curve = |(index, state): (usize, &(&str, &str, Rgb))| Series {
        label: state.0.to_owned(),
        color: state.2,
        // Its curve is mostly that of the other nitrogen.
        style: if index == 3 { Style::Dashed } else { Style::Line },
        points: table.points(1 + index, 0),
    };
    let reference = rows::<5>(QUENCHING);
    let points = reference.iter().flat_map(|row| row[1..].iter().map(|&fraction| [fraction, row[0]])).collect();
    let mut series: Vec<Series> = STATES.iter().enumerate().map(curve).collect();
    let label = "Stern-Volmer, computed independently".to_owned();
    series.push(Series { label, color: color(6), style: Style::Markers, points });
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
