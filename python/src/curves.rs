//! The physics behind the pictures as arrays: black bodies, drops, streaks, auroral light.

use bansho::{
    Observer,
    aurora::{
        SpectrumShape,
        physics::{
            atmosphere::{atmosphere, level_altitude_km},
            emission::{EMITTERS, Emission, LINES, PHOTONS_PER_KILORAYLEIGH, quenching::radiated_fraction},
            precipitation::{
                Deposition,
                energy_grid::{HIGHEST_EV, LOWEST_EV},
            },
        },
    },
    base::{
        color::{black_body, blackbody::HIGHEST_K, luminance, srgb_from_acescg},
        image::Image,
    },
    rain::{
        VelocityLaw,
        billboards::texture::StreakCube,
        drops::{
            size_distribution::{DropSizeDistribution, SizeBin},
            terminal_velocity::{FallAir, TerminalVelocity},
        },
        lighting::extinction::{ExtinctionEfficiency, extinction},
        streaks::coverage::Streak,
    },
};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;

use crate::{error, frame, work};

fn checked(name: &str, value: f64, [low, high]: [f64; 2], unit: &str) -> PyResult<f64> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(error::value(format!("{name}: {value} is out of range; allowed: {low} to {high}{unit}")))
}

fn checked_all(name: &str, values: &[f64], range: [f64; 2], unit: &str) -> PyResult<()> {
    values.iter().try_for_each(|value| checked(name, *value, range, unit).map(drop))
}

/// Rows of red, green, blue by temperature: linear sRGB or ACEScg, cd/m^2.
#[pyfunction]
pub(crate) fn black_body_radiance<'py>(
    py: Python<'py>,
    temperatures_k: Vec<f64>,
    space: &str,
) -> PyResult<(Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f32>>)> {
    checked_all("temperature_k", &temperatures_k, [0.0, f64::from(HIGHEST_K)], " K")?;
    let is_acescg = match space {
        "acescg" => true,
        "linear_srgb" => false,
        _ => return Err(error::value(format!("space: {space:?}; allowed: \"acescg\", \"linear_srgb\""))),
    };
    let (colors, luminances) = work::run(py, work::thread_count(None)?, |interruption| {
        let (mut colors, mut luminances) = (Vec::new(), Vec::new());
        for few in temperatures_k.chunks(TEMPERATURES_BETWEEN_SIGNALS) {
            if interruption.cancelled() {
                break;
            }
            for kelvin in few {
                let acescg = black_body().radiance(*kelvin as f32);
                luminances.push(luminance(acescg));
                colors.extend(if is_acescg { acescg } else { srgb_from_acescg(acescg) });
            }
        }
        (colors, luminances)
    })?;
    Ok((frame::array2(py, [temperatures_k.len(), 3], colors)?, luminances.into_pyarray(py)))
}

/// Number density of drops by diameter at a rain rate, 1/(m^3 mm).
#[pyfunction]
pub(crate) fn drop_density<'py>(
    py: Python<'py>,
    rate_mm_per_h: f64,
    diameters_mm: Vec<f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let sizes = sizes(rate_mm_per_h)?;
    checked_all("diameter_mm", &diameters_mm, [0.0, 20.0], " mm")?;
    Ok(diameters_mm.iter().map(|diameter| sizes.density(*diameter)).collect::<Vec<_>>().into_pyarray(py))
}

fn sizes(rate_mm_per_h: f64) -> PyResult<DropSizeDistribution> {
    Ok(DropSizeDistribution::marshall_palmer(checked("rate_mm_per_h", rate_mm_per_h, [0.0, 300.0], " mm/h")?))
}

/// Extinction coefficient of rain, 1/m.
#[pyfunction]
pub(crate) fn rain_extinction(rate_mm_per_h: f64) -> PyResult<f64> {
    let sizes = sizes(rate_mm_per_h)?;
    Ok(extinction(&sizes, ExtinctionEfficiency::Geometric, DropSizeDistribution::ALL))
}

/// Terminal velocity by diameter, m/s.
#[pyfunction]
pub(crate) fn terminal_velocity<'py>(
    py: Python<'py>,
    diameters_mm: Vec<f64>,
    law: &str,
    temperature_k: f64,
    pressure_pa: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    checked_all("diameter_mm", &diameters_mm, [0.0, 20.0], " mm")?;
    checked("temperature_k", temperature_k, [150.0, 400.0], " K")?;
    checked("pressure_pa", pressure_pa, [1e3, 2e5], " Pa")?;
    let velocity = TerminalVelocity { law: parse_law(law)?, air: FallAir::at(temperature_k, pressure_pa) };
    Ok(diameters_mm.iter().map(|diameter| velocity.speed(*diameter)).collect::<Vec<_>>().into_pyarray(py))
}

fn parse_law(name: &str) -> PyResult<VelocityLaw> {
    VelocityLaw::from_name(name)
        .ok_or_else(|| error::value(format!("law: {name:?}; allowed: \"gunn_kinzer\", \"rigid_sphere\"")))
}

/// Opacity on the axis of a streak by diameter.
#[pyfunction]
pub(crate) fn streak_opacity<'py>(
    py: Python<'py>,
    diameters_mm: Vec<f64>,
    exposure_s: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    checked_all("diameter_mm", &diameters_mm, [0.01, 20.0], " mm")?;
    checked("exposure_s", exposure_s, [1e-6, 10.0], " s")?;
    let velocity = TerminalVelocity { law: VelocityLaw::GunnKinzer, air: FallAir::default() };
    let opacity = |diameter: f64| Streak::new(diameter, velocity.speed(diameter), exposure_s).profile(0.0);
    Ok(diameters_mm.iter().map(|diameter| opacity(*diameter)).collect::<Vec<_>>().into_pyarray(py))
}

/// Streaks that are drawn, and temperatures whose radiance is computed, between two looks at whether to stop.
const DROPS_BETWEEN_SIGNALS: usize = 16;
const TEMPERATURES_BETWEEN_SIGNALS: usize = 1 << 16;

/// Streak textures of a cube of rain, size x size for each diameter, with the drops: diameter (mm), speed (m/s), position (m).
#[pyfunction]
pub(crate) fn streak_textures<'py>(
    py: Python<'py>,
    rate_mm_per_h: f64,
    diameters_mm: Vec<f64>,
    exposure_s: f64,
    edge_m: f64,
    size: usize,
    seed: u64,
    variant: u32,
) -> PyResult<(Bound<'py, PyArray3<f32>>, Vec<Bound<'py, PyArray2<f64>>>)> {
    let sizes = sizes(rate_mm_per_h)?;
    if diameters_mm.is_empty() || diameters_mm.windows(2).any(|pair| pair[1] <= pair[0]) {
        return Err(error::value(format!("diameters_mm: {diameters_mm:?}; allowed: one or more, ascending")));
    }
    let cube = StreakCube { edge: edge_m, size, exposure: exposure_s, ..StreakCube::default() };
    cube.check().map_err(|refused| error::value(refused.to_string()))?;
    let drawn = work::run(py, work::thread_count(None)?, |interruption| {
        let (mut textures, mut all_drops) = (Vec::new(), Vec::new());
        for bin in SizeBin::around(&diameters_mm) {
            let drops = cube.drops(&sizes, &bin, seed, variant)?;
            let mut image = Image::filled(size, size, [0.0]);
            for few in drops.chunks(DROPS_BETWEEN_SIGNALS) {
                if interruption.cancelled() {
                    // Nobody sees what is returned after a signal.
                    return Ok((textures, all_drops));
                }
                cube.draw_over(few, &mut image)?;
            }
            textures.extend(image.into_pixels().into_flattened());
            all_drops.push(drops);
        }
        Ok::<_, bansho::rain::billboards::texture::StreakTextureError>((textures, all_drops))
    })?;
    let (textures, all_drops) = drawn.map_err(|refused| error::value(refused.to_string()))?;
    let mut listed = Vec::with_capacity(all_drops.len());
    for drops in all_drops {
        let rows = drops.iter().flat_map(|drop| {
            let [x, y, z] = drop.position;
            [drop.diameter_mm, drop.speed, x, y, z]
        });
        listed.push(frame::array2(py, [drops.len(), 5], rows.collect())?);
    }
    Ok((frame::array3(py, [diameters_mm.len(), size, size], textures)?, listed))
}

fn parse_shape(name: &str) -> PyResult<SpectrumShape> {
    SpectrumShape::from_name(name).ok_or_else(|| {
        error::value(format!("spectrum: {name:?}; allowed: \"gaussian\", \"maxwellian\", \"monoenergetic\""))
    })
}

/// Auroral lines: name, wavelength in nm.
#[pyfunction]
pub(crate) fn aurora_lines() -> Vec<(&'static str, f64)> {
    LINES.iter().map(|line| (line.name, line.wavelength_nm)).collect()
}

/// Altitudes in km; volume emission rate of each line by altitude, photons/(m^3 s); brightness of each line seen along the column, kR.
#[pyfunction]
pub(crate) fn aurora_emission<'py>(
    py: Python<'py>,
    energy_ev: f64,
    flux_mw_per_m2: f64,
    spectrum: &str,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>)> {
    checked("energy_ev", energy_ev, [LOWEST_EV, HIGHEST_EV], " eV")?;
    checked("flux_mw_per_m2", flux_mw_per_m2, [0.0, 1e6], " mW/m^2")?;
    let emission = Emission::new(atmosphere(), parse_shape(spectrum)?.spectrum());
    let profile = emission.profile(energy_ev);
    let mut rates = Vec::with_capacity(profile.len() * LINES.len());
    for photons in &profile {
        rates.extend(LINES.iter().map(|line| flux_mw_per_m2 * line.photons * photons[line.emitter.index()]));
    }
    let altitudes: Vec<f64> = (0..profile.len()).map(level_altitude_km).collect();
    let column = emission.column(energy_ev).kilorayleigh;
    let brightness = LINES.iter().map(|line| flux_mw_per_m2 * line.photons * column[line.emitter.index()]);
    let rates = frame::array2(py, [profile.len(), LINES.len()], rates)?;
    Ok((altitudes.into_pyarray(py), rates, brightness.collect::<Vec<f64>>().into_pyarray(py)))
}

/// Altitudes in km; ionization rate by altitude for each energy, 1/(m^3 s) for 1 mW/m^2.
#[pyfunction]
pub(crate) fn aurora_deposition<'py>(
    py: Python<'py>,
    energies_ev: Vec<f64>,
    spectrum: &str,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>)> {
    checked_all("energy_ev", &energies_ev, [LOWEST_EV, HIGHEST_EV], " eV")?;
    let deposition = Deposition::new(atmosphere(), parse_shape(spectrum)?.spectrum());
    let levels = atmosphere().levels().len();
    let altitudes: Vec<f64> = (0..levels).map(level_altitude_km).collect();
    let mut rates = Vec::with_capacity(levels * energies_ev.len());
    for altitude_km in &altitudes {
        rates.extend(energies_ev.iter().map(|energy| deposition.ionization(*energy, *altitude_km)));
    }
    Ok((altitudes.into_pyarray(py), frame::array2(py, [levels, energies_ev.len()], rates)?))
}

/// Altitudes in km; fraction of the excited states that radiate, of O(1S), O(1D), N2+(B) and N2(B).
#[pyfunction]
pub(crate) fn aurora_quenching<'py>(
    py: Python<'py>,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>)> {
    let levels = atmosphere().levels();
    let altitudes: Vec<f64> = (0..levels.len()).map(level_altitude_km).collect();
    let fractions = levels.iter().flat_map(|air| EMITTERS.map(|emitter| radiated_fraction(emitter, air)));
    let fractions = frame::array2(py, [levels.len(), EMITTERS.len()], fractions.collect())?;
    Ok((altitudes.into_pyarray(py), fractions))
}

/// Photons per m^2 and s of one kilorayleigh.
pub(crate) const KILORAYLEIGH: f64 = PHOTONS_PER_KILORAYLEIGH;
