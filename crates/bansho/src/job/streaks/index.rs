//! The index of streak textures: the drops of every picture, and how to read it.

use std::f64::consts::PI;

use bansho_base::image::Image;
use bansho_media::files::provenance;
use bansho_rain::{
    OpacityLaw,
    billboards::texture::{FallingDrop, StreakCube},
    drops::size_distribution::{DropSizeDistribution, SizeBin},
    lighting::extinction::{ExtinctionEfficiency, extinction, visibility},
    streaks::{coverage::paper_opacity, oscillation::mode_frequency},
};
use bansho_render::display::BitDepth;

use super::{
    StreakFormat, Streaks, Texture,
    files::{LitPicture, TextureWriter, WrittenTexture},
};

use serde_json::{Value, json};

/// The description of one texture.
pub(crate) struct Entry {
    pub(crate) file: String,
    description: Value,
}

impl Entry {
    pub(crate) fn new(
        texture: &Texture,
        cube: &StreakCube,
        file: String,
        drops: Vec<FallingDrop>,
        image: &Image<1>,
        written: WrittenTexture,
    ) -> Self {
        let opacities = image.pixels().as_flattened();
        let mean = opacities.iter().map(|&opacity| f64::from(opacity)).sum::<f64>() / opacities.len() as f64;
        let largest = opacities.iter().fold(0.0_f32, |largest, &opacity| largest.max(opacity));
        let mut description = json!({
            "file": file,
            "rate_mm_per_h": texture.rate,
            "diameter_mm": texture.bin.diameter_mm,
            "variant": texture.variant,
            "mean_drop_count": cube.mean_count(texture.sizes, &texture.bin),
            "drop_count": drops.len(),
            "mean_opacity": mean,
            "largest_opacity": largest,
        });
        if let Some(scale) = written.scale {
            description["opacity_scale"] = json!(scale);
        }
        if let Some(LitPicture { file, scale }) = written.lit {
            description["lit"] = json!({ "file": file, "radiance_scale": scale });
        }
        description["drops"] = drops.iter().map(|drop| describe_drop(cube, drop)).collect();
        Self { file, description }
    }
}

fn describe_drop(cube: &StreakCube, drop: &FallingDrop) -> Value {
    let streak = cube.streak(drop);
    let [opacity, mean_opacity] = opacities(cube, drop);
    json!({
        "diameter_mm": drop.diameter_mm,
        "velocity_m_per_s": drop.speed,
        "length_m": streak.length,
        "opacity": opacity,
        "mean_opacity": mean_opacity,
        "position_m": drop.position,
    })
}

/// Opacity on the axis of a drop's streak, and its mean across the streak.
fn opacities(cube: &StreakCube, drop: &FallingDrop) -> [f64; 2] {
    let streak = cube.streak(drop);
    match cube.opacity {
        OpacityLaw::ExposureFraction => [streak.profile(0.0), streak.mean_opacity().min(1.0)],
        OpacityLaw::Paper => [paper_opacity(drop.diameter_mm, drop.speed); 2],
    }
}

/// The index of all textures.
pub(crate) fn describe(
    streaks: &Streaks,
    cube: &StreakCube,
    writer: &TextureWriter,
    distributions: &[DropSizeDistribution],
    entries: &[Entry],
) -> Value {
    let bins = SizeBin::around(&streaks.diameters);
    let mut index = json!({
        "format": 1,
        "program": provenance::PROGRAM,
        "size_pixels": cube.size,
        "box_m": cube.edge,
        "pixel_m": cube.pixel(),
        "exposure_s": cube.exposure,
        "velocity": streaks.law.name(),
        "opacity_law": cube.opacity.name(),
        "drop_count": cube.drop_count.name(),
        "air": { "density_kg_per_m3": cube.terminal_velocity.air.density, "viscosity_pa_s": cube.terminal_velocity.air.viscosity },
        "diameters": if cube.spread { "sampled within the bin for each drop" } else { "that of the bin" },
        "seed": streaks.seed,
        "how_to_read": how_to_read(streaks, writer),
    });
    if streaks.oscillation > 0.0 {
        index["oscillation"] = json!({
            "amplitude": streaks.oscillation,
            "what": "the radiance of a streak is 1 + amplitude (2/3 sin(2 pi f2 t) + 1/3 sin(2 pi f3 t)) times that of a steady drop, with \
                     Rayleigh's frequencies of the modes 2 and 3, and random phases",
        });
    }
    if let Some(light) = &writer.light {
        index["light"] = json!({
            "toward": light.toward.to_array(),
            "radiance_of_an_opaque_drop_per_illuminance_per_sr": light.radiance,
            "space": "ACEScg",
        });
    }
    let rains = streaks.rates.iter().zip(distributions);
    index["rain"] = rains.map(|(&rate, sizes)| describe_rain(rate, sizes, &bins, cube)).collect();
    index["bins"] = bins.iter().map(|bin| describe_bin(bin, cube)).collect();
    index["textures"] = entries.iter().map(|entry| entry.description.clone()).collect();
    index
}

/// The meaning of pixels and numbers.
fn how_to_read(streaks: &Streaks, writer: &TextureWriter) -> Value {
    let pixel = match (streaks.format, streaks.bits) {
        (StreakFormat::Exr, _) => "opacity = channel `opacity.V`, and A in half precision".to_owned(),
        (StreakFormat::Png, bits) => {
            let largest = if bits == BitDepth::Sixteen { 65_535 } else { 255 };
            format!("opacity = code / {largest} * opacity_scale, linear: no gamma")
        }
    };
    let drop = match streaks.cube.opacity {
        OpacityLaw::ExposureFraction => {
            "a round drop: opacity 2 sqrt(r^2 - b^2) / (v T) at distance b from the axis, `opacity` on the axis, \
             `mean_opacity` across the streak; it covers (pi/4) D^2 for any exposure"
        }
        OpacityLaw::Paper => {
            "a line one pixel wide, of the opacity 2 D / v with D in mm and v in m/s, for any exposure"
        }
    };
    let mut description = json!({
        "pixel": pixel,
        "opacity": "fraction of the pixel that drops cover, averaged over the exposure; to composite over a picture: picture * (1 - opacity) + drops",
        "tiling": "the texture repeats in both directions: a streak that leaves at an edge enters at the opposite one",
        "axes": "position_m is right, up, toward the viewer, from the lower left far corner; \
                 the center of the drop when the shutter opens; it then falls straight down by length_m",
        "drop": drop,
        "rain": "Marshall and Palmer 1948: 8000 exp(-4.1 R^-0.21 D) drops per m^3 and mm; \
                 with these velocities its rain rate is 14 to 18 % higher than R",
        "extinction": "extinction_per_m is geometric (Q = 1), over all diameters; \
                       visibility_m includes diffraction (Q = 2), for 2 % of contrast",
    });
    if writer.light.is_some() {
        let lit = match streaks.format {
            StreakFormat::Exr => {
                "R, G, B: radiance for illuminance 1 on a plane \
                 that faces the light, premultiplied"
            }
            StreakFormat::Png => {
                "lit.file: radiance = code / largest code * radiance_scale for illuminance 1 on a plane \
                 that faces the light, premultiplied, linear ACEScg"
            }
        };
        description["lit"] = json!(lit);
    }
    description
}

fn describe_rain(rate: f64, sizes: &DropSizeDistribution, bins: &[SizeBin], cube: &StreakCube) -> Value {
    let whole = extinction(sizes, ExtinctionEfficiency::Geometric, DropSizeDistribution::ALL);
    let in_bins: f64 = bins.iter().map(|bin| extinction(sizes, ExtinctionEfficiency::Geometric, bin.range_mm)).sum();
    let mut description = json!({
        "rate_mm_per_h": rate,
        "drops_per_m3": sizes.count(DropSizeDistribution::ALL),
        "drops_per_m3_in_bins": bins.iter().map(|bin| bin.count(sizes)).sum::<f64>(),
        "liquid_water_g_per_m3": sizes.liquid_water(),
        "median_volume_diameter_mm": sizes.median_volume_diameter(),
        "rate_from_drops_mm_per_h": sizes.rain_rate(&cube.terminal_velocity, DropSizeDistribution::ALL),
        "extinction_per_m": whole,
        "extinction_per_m_in_bins": in_bins,
    });
    // Without rain the visibility is infinite, which JSON has no number for.
    description["visibility_m"] = Some(visibility(sizes)).filter(|visibility| visibility.is_finite()).into();
    description
}

fn describe_bin(bin: &SizeBin, cube: &StreakCube) -> Value {
    let speed = cube.terminal_velocity.speed(bin.diameter_mm);
    let drop = FallingDrop { diameter_mm: bin.diameter_mm, speed, position: [0.0; 3] };
    let (streak, [opacity, mean_opacity]) = (cube.streak(&drop), opacities(cube, &drop));
    let oscillation_hz = [2, 3].map(|mode| mode_frequency(mode, bin.diameter_mm));
    json!({
        "diameter_mm": bin.diameter_mm,
        "range_mm": bin.range_mm,
        "velocity_m_per_s": speed,
        "length_m": streak.length,
        "opacity": opacity,
        "mean_opacity": mean_opacity,
        "oscillation_hz": oscillation_hz,
        "hidden_mm2": 0.25 * PI * bin.diameter_mm * bin.diameter_mm,
    })
}
