//! The light held against what is observed: figures that a command can print and a test can check.

use std::fmt;

use super::{Emission, Emitter, LINES};
use crate::aurora::{
    atmosphere::{Atmosphere, LEVELS, level_altitude_km},
    precipitation::{Spectrum, spectrum::ARC},
};

/// Share of N2+ ions, band and pairs in the column of Fang et al.: rayleighs of 427.8 nm per mW m^-2, by energy in keV.
const BLUE_OF_FANG: [(f64, f64); 4] = [(1.0, 250.0), (3.0, 294.0), (10.0, 307.0), (30.0, 304.0)];
/// Energies of the figures, keV.
const ENERGIES_KEV: [f64; 8] = [0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 30.0];

/// Figures of one energy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Central energy of the spectrum, keV.
    pub energy_kev: f64,
    /// Altitude of the greatest deposition, km.
    pub deposition_peak_km: f64,
    /// Altitude of the greatest emission by emitter, km.
    pub peaks_km: [f64; 4],
    /// I(427.8), R per mW m^-2.
    pub blue_rayleigh: f64,
    /// I(557.7) / I(427.8).
    pub green_to_blue: f64,
    /// I(630.0) / I(427.8).
    pub red_to_blue: f64,
    /// Share of the red light from above 200 km.
    pub red_above_200_km: f64,
    /// Photons of the whole first positive system to those of 557.7 nm.
    pub first_positive_to_green: f64,
    /// Mean lifetime of the red light, s.
    pub red_lifetime: f64,
}

/// One demand on the light.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What is demanded.
    pub demand: String,
    /// What was found.
    pub found: f64,
    /// Least and greatest that is allowed.
    pub allowed: [f64; 2],
}

impl Check {
    /// Whether the demand is met.
    #[must_use]
    pub fn holds(&self) -> bool {
        (self.allowed[0]..=self.allowed[1]).contains(&self.found)
    }
}

/// Figures and demands. `Display` prints both as tables.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Figures by energy, rising.
    pub figures: Vec<Figures>,
    /// All demands.
    pub checks: Vec<Check>,
}

/// Measures the light of the default spectrum of arcs.
#[must_use]
pub fn calibrate(air: &Atmosphere) -> Calibration {
    let figures: Vec<_> = measure(air, ARC);
    let mut checks = Vec::new();
    for figure in &figures {
        checks.extend(check_colours(figure));
    }
    checks.extend(check_peaks(&figures));
    checks.extend(check_slopes(&figures));
    Calibration { figures, checks }
}

/// The figures of a spectrum.
#[must_use]
pub fn measure(air: &Atmosphere, spectrum: Spectrum) -> Vec<Figures> {
    let table = Emission::new(air, spectrum);
    ENERGIES_KEV.into_iter().map(|energy_kev| figures_at(&table, energy_kev)).collect()
}

fn figures_at(table: &Emission, energy_kev: f64) -> Figures {
    let energy_ev = energy_kev * 1e3;
    let profile = table.profile(energy_ev);
    let [green, red, blue, first_positive] = table.column(energy_ev).kilorayleigh;
    let red_at = |level: usize| profile[level][Emitter::OxygenRed.index()];
    let above = (0..LEVELS).filter(|level| level_altitude_km(*level) >= 200.0).map(red_at).sum::<f64>();
    Figures {
        energy_kev,
        deposition_peak_km: peak_km(|level| table.deposition().ionisation(energy_ev, level_altitude_km(level))),
        peaks_km: std::array::from_fn(|i| peak_km(|level| profile[level][i])),
        blue_rayleigh: blue * 1e3,
        green_to_blue: green / blue,
        red_to_blue: red / blue,
        red_above_200_km: above / (0..LEVELS).map(red_at).sum::<f64>(),
        first_positive_to_green: first_positive / green,
        red_lifetime: table.column(energy_ev).lifetime[Emitter::OxygenRed.index()],
    }
}

/// Altitude of the level with the greatest value, km.
fn peak_km(value: impl Fn(usize) -> f64) -> f64 {
    let values: Vec<f64> = (0..LEVELS).map(value).collect();
    let greatest = (0..LEVELS).fold(0, |best, level| if values[level] > values[best] { level } else { best });
    level_altitude_km(greatest)
}

fn check(demand: String, found: f64, allowed: [f64; 2]) -> Check {
    Check { demand, found, allowed }
}

/// Demands on the column of one energy.
fn check_colours(figure: &Figures) -> Vec<Check> {
    let kev = figure.energy_kev;
    let mut checks = vec![check(format!("red above 200 km at {kev} keV"), figure.red_above_200_km, [0.5, 1.0])];
    if kev >= 1.0 {
        checks.push(check(format!("I(557.7)/I(427.8) at {kev} keV"), figure.green_to_blue, [2.5, 7.0]));
    }
    if kev <= 1.0 {
        checks.push(check(format!("I(630.0)/I(427.8) at {kev} keV"), figure.red_to_blue, [2.0, f64::INFINITY]));
    }
    if kev >= 10.0 {
        checks.push(check(format!("I(630.0)/I(427.8) at {kev} keV"), figure.red_to_blue, [0.0, 0.5]));
    }
    for (_, rayleigh) in BLUE_OF_FANG.into_iter().filter(|(energy_kev, _)| *energy_kev == kev) {
        checks.push(check(
            format!("I(427.8) at {kev} keV to Fang's column"),
            figure.blue_rayleigh / rayleigh,
            [0.75, 1.25],
        ));
    }
    checks
}

fn check_peaks(figures: &[Figures]) -> Vec<Check> {
    let green = figures.iter().filter(|figure| (3.0..=10.0).contains(&figure.energy_kev)).map(|figure| {
        check(format!("green peak at {} keV, km", figure.energy_kev), figure.peaks_km[0], [100.0, 120.0])
    });
    let fang = [(1.0, 158.35), (3.0, 122.23), (10.0, 104.68), (30.0, 95.194)];
    let deposited = fang.into_iter().flat_map(|(kev, peak_km)| {
        let at = figures.iter().find(|figure| figure.energy_kev == kev);
        at.map(|figure| {
            let demand = format!("deposition peak at {kev} keV beside Fang's, km");
            check(demand, figure.deposition_peak_km - peak_km, [-4.0, 4.0])
        })
    });
    let ratio = LINES.iter().find(|line| line.name.contains("391.4")).map(|line| line.photons);
    let violet = ratio.map(|ratio| check("I(391.4)/I(427.8)".to_owned(), ratio, [3.28 * 0.95, 3.28 * 1.05]));
    green.chain(deposited).chain(violet).collect()
}

/// Both ratios fall from each energy to the next above 1 keV.
fn check_slopes(figures: &[Figures]) -> Vec<Check> {
    let pairs = figures.windows(2).filter(|pair| pair[0].energy_kev >= 1.0);
    let falls = pairs.flat_map(|pair| {
        let step = format!("from {} to {} keV", pair[0].energy_kev, pair[1].energy_kev);
        [
            check(
                format!("I(557.7)/I(427.8) changes {step} by"),
                pair[1].green_to_blue / pair[0].green_to_blue,
                [0.0, 1.0],
            ),
            check(
                format!("I(630.0)/I(427.8) changes {step} by"),
                pair[1].red_to_blue / pair[0].red_to_blue,
                [0.0, 0.8],
            ),
        ]
    });
    falls.collect()
}

impl fmt::Display for Calibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  keV  deposited  557.7  630.0  427.8 peak km   R(427.8)   G/B    R/B  red>200  1P/G  red tau s")?;
        for figure in &self.figures {
            let [green, red, blue, _] = figure.peaks_km;
            writeln!(
                f,
                "{:5} {:10} {green:6} {red:6} {blue:6} {:18.0} {:6.2} {:6.3} {:7.2} {:6.1} {:9.1}",
                figure.energy_kev,
                figure.deposition_peak_km,
                figure.blue_rayleigh,
                figure.green_to_blue,
                figure.red_to_blue,
                figure.red_above_200_km,
                figure.first_positive_to_green,
                figure.red_lifetime,
            )?;
        }
        for check in &self.checks {
            let [least, greatest] = check.allowed;
            let verdict = if check.holds() { "holds" } else { "FAILS" };
            writeln!(f, "{verdict}  {}: {:.4} in [{least:.4}, {greatest:.4}]", check.demand, check.found)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use bansho_base::math;

    use super::*;
    use crate::aurora::atmosphere::atmosphere;

    #[test]
    fn every_demand_holds() {
        let calibration = calibrate(atmosphere());
        assert_eq!(calibration.checks.len(), 8 + 7 + 2 + 3 + 4 + 3 + 4 + 1 + 12);
        assert!(calibration.checks.iter().all(Check::holds), "{calibration}");
    }

    #[test]
    fn a_broken_demand_is_said() {
        let broken = check("nothing".to_owned(), 2.0, [0.0, 1.0]);
        let printed = Calibration { figures: Vec::new(), checks: vec![broken] }.to_string();
        assert!(printed.contains("FAILS  nothing: 2.0000 in [0.0000, 1.0000]"), "{printed}");
    }

    /// The rows of the method's page below a heading, cell by cell.
    fn table_of_page(heading: &str) -> Vec<Vec<String>> {
        let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/methods/aurora.md");
        let page = std::fs::read_to_string(page).unwrap();
        let lines =
            page.lines().skip_while(|line| !line.starts_with(heading)).skip_while(|line| !line.starts_with('|'));
        let cells = |line: &str| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect();
        lines.take_while(|line| line.starts_with('|')).skip(2).map(cells).collect()
    }

    /// Whether a number, printed with its unit, is `found` to its last digit.
    fn printed(cell: &str, found: f64) -> bool {
        let number = cell.split(' ').next().unwrap();
        let digits = number.split_once('.').map_or(0, |(_, digits)| digits.len());
        (number.parse::<f64>().unwrap() - found).abs() <= 0.51 * math::pow(0.1, digits as f64)
    }

    #[test]
    fn the_page_prints_what_comes_of_it() {
        let table = Emission::new(atmosphere(), ARC);
        let rows = table_of_page("### What comes of it");
        assert_eq!(rows.len(), 5);
        for row in &rows {
            let energy_kev = row[0].trim_end_matches(" keV").parse().unwrap();
            let figures = figures_at(&table, energy_kev);
            let Figures { deposition_peak_km, peaks_km, blue_rayleigh, green_to_blue, .. } = figures;
            let spread_km = table.column(energy_kev * 1e3).spread_km[Emitter::OxygenRed.index()];
            let found = [
                deposition_peak_km,
                peaks_km[0],
                peaks_km[1],
                blue_rayleigh,
                1e-3 * green_to_blue * blue_rayleigh,
                green_to_blue,
                figures.red_to_blue,
                100.0 * figures.red_above_200_km,
                figures.red_lifetime,
                spread_km,
            ];
            for (cell, found) in row[1..].iter().zip(found) {
                assert!(printed(cell, found), "{energy_kev} keV: {cell}, not {found}");
            }
        }
    }

    #[test]
    fn the_page_prints_the_emission() {
        let table = Emission::new(atmosphere(), ARC);
        let rows = table_of_page("Emission of 557.7 / 630.0 / 427.8 nm");
        assert_eq!(rows.len(), 12);
        let mut wrong = Vec::new();
        for row in &rows {
            for (cell, energy_ev) in row[1..].iter().zip([1e3, 3e3, 1e4, 3e4]) {
                let light = table.at(energy_ev, row[0].parse().unwrap()).map(|photons| photons * 1e-6);
                let cells: Vec<&str> = cell.split(" / ").collect();
                for (cell, found) in cells.iter().zip(&light[..3]) {
                    // A bare 0 is less than what the table prints at all.
                    let holds = if *cell == "0" { *found < 0.0051 } else { printed(cell, *found) };
                    if !holds {
                        wrong.push(format!("{} km, {energy_ev} eV: {cell}, not {found}", row[0]));
                    }
                }
            }
        }
        assert!(wrong.is_empty(), "{wrong:#?}");
    }

    #[test]
    fn single_energies_are_within_two_kilometres_of_the_demand() {
        // 3 keV alone deposits at 122 km; only a spread of energies brings the green peak below 120 km.
        let figures = measure(atmosphere(), Spectrum::Monoenergetic);
        let peak_km = |kev: f64| figures.iter().find(|figure| figure.energy_kev == kev).unwrap().peaks_km[0];
        assert!((peak_km(3.0) - 121.0).abs() <= 1.0 && (100.0..120.0).contains(&peak_km(5.0)));
    }
}
