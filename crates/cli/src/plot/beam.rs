//! The beam of a lamp in rain: illuminance by distance on its axis, and intensity by angle (Yoshida, Dobashi & Yamamoto, section 5.2).

use bansho::{
    base::{
        math::{self, DVec3},
        phenomenon::surroundings::{Emitter, Light},
    },
    rain::{
        drops::size_distribution::DropSizeDistribution,
        lighting::extinction::{ExtinctionEfficiency, extinction},
    },
};

use super::{
    PlotError,
    csv::number,
    figure::{Axis, Figure, FigureTable, Panel, Plot, Series},
};

/// Distances that are plotted, m.
const DISTANCES: [f64; 2] = [1.0, 1000.0];
/// Intervals of the distances and of the angles.
const STEPS: usize = 120;

/// Illuminance by distance on the axis of a spot light of `intensity` (cd) at rain rates in mm/h, and its intensity by angle between its inner and outer
/// cone (degrees).
pub(crate) fn figure(intensity: f64, [inner, outer]: [f64; 2], rates_mm_per_h: &[f64]) -> Result<Figure, PlotError> {
    if inner > outer {
        return Err(PlotError::Cones { inner, outer });
    }
    let [cos_inner, cos_outer] = [inner, outer].map(|angle| math::cos(angle.to_radians()));
    let emitter = Emitter::Spot { position: DVec3::ZERO, axis: DVec3::X, cos_inner, cos_outer };
    let light = Light { emitter, intensity: [intensity as f32; 3] };
    let columns = rates_mm_per_h.iter().map(|rate| format!("lux_at_{}_mm_per_h", number(*rate)));
    let mut table =
        FigureTable::of_functions("distance_m", columns.chain(["angle_deg", "intensity_cd"].map(str::to_owned)));
    let extinctions: Vec<f64> = rates_mm_per_h.iter().map(|rate| extinction_at(*rate)).collect();
    let last_angle = (1.2 * outer).min(180.0);
    for step in 0..=STEPS {
        let fraction = step as f64 / STEPS as f64;
        let distance = DISTANCES[0] * math::pow(DISTANCES[1] / DISTANCES[0], fraction);
        let lux = f64::from(light.illuminance(DVec3::X * distance).0[1]);
        let attenuated = extinctions.iter().map(|extinction| lux * math::exp(-extinction * distance));
        let angle = last_angle * fraction;
        let (sin, cos) = math::sin_cos(angle.to_radians());
        let candela = f64::from(light.illuminance(DVec3::new(cos, sin, 0.0)).0[1]);
        table.push(distance, attenuated.chain([angle, candela]));
    }
    let last = rates_mm_per_h.len();
    let mut series = Vec::new();
    for (index, (rate, extinction)) in rates_mm_per_h.iter().zip(&extinctions).enumerate() {
        let per_km = number(rounded(1e3 * extinction));
        let label = format!("R = {} mm/h, extinction {per_km} per km", number(*rate));
        series.push(Series::curve(label, index, table.points(0, 1 + index)));
    }
    let slope = table.rows.iter().step_by(STEPS / 6).map(|row| [row[0], intensity / (row[0] * row[0])]).collect();
    series.push(Series::reference("inverse square, without rain", slope));
    let label = format!("full up to {}°, none beyond {}°", number(inner), number(outer));
    let across = vec![Series::curve(label, 0, table.points(last + 1, last + 2))];
    let brightest = intensity / (DISTANCES[0] * DISTANCES[0]);
    Ok(Figure {
        title: format!("Beam of {} cd in rain", number(intensity)),
        panels: vec![
            Panel::Plot(Plot {
                x: Axis::log("Distance on the axis", "m", DISTANCES),
                y: Axis::log("Illuminance E", "lx", [1e-7 * brightest, brightest]),
                series,
            }),
            Panel::Plot(Plot {
                x: Axis::linear("Angle from the axis", "°", [0.0, last_angle]),
                y: Axis::linear("Intensity I", "cd", [0.0, intensity]),
                series: across,
            }),
        ],
        table,
    })
}

/// Extinction coefficient of rain (geometric, as light between a lamp and a drop is attenuated), 1/m.
fn extinction_at(rate_mm_per_h: f64) -> f64 {
    let sizes = DropSizeDistribution::marshall_palmer(rate_mm_per_h);
    extinction(&sizes, ExtinctionEfficiency::Geometric, DropSizeDistribution::ALL)
}

/// Rounded to two decimals.
fn rounded(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

#[cfg(test)]
mod tests {
    use bansho::base::assert_measured;

    use super::*;

    #[test]
    fn a_beam_worked_by_hand() {
        let figure = figure(9000.0, [5.0, 22.0], &[0.0, 20.0]).unwrap();
        let row = |distance: f64| {
            figure.table.rows.iter().find(|row| (row[0] / distance - 1.0).abs() < 1e-6).cloned().unwrap()
        };
        // 9000 cd at 10 m: 90 lx. In 20 mm/h the extinction is 1.20 per km: exp(-0.012) = 0.988; at 1000 m exp(-1.2) = 0.301.
        let [near, far] = [row(10.0)[2] / 90.0, row(1000.0)[2] / 0.009];
        assert_measured!("section 5.2: light: at 10 m, lx", row(10.0)[1], 90.0, 1e-3);
        assert_measured!("future work: attenuation: at 10 m", near, 0.988, 2e-4);
        assert_measured!("future work: attenuation: at 1 km", far, 0.301, 3e-3);
        // Half way between the cosines of the cones the smoothstep is a half.
        let half = math::acos(0.5 * (math::cos(5_f64.to_radians()) + math::cos(22_f64.to_radians()))).to_degrees();
        let nearest =
            figure.table.rows.iter().min_by(|a, b| (a[3] - half).abs().total_cmp(&(b[3] - half).abs())).unwrap();
        assert!((nearest[4] / 4500.0 - 1.0).abs() < 0.03, "{nearest:?}");
        assert!(matches!(super::figure(1.0, [30.0, 20.0], &[1.0]), Err(PlotError::Cones { .. })));
    }
}
