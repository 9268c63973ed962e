"""The curves of `bansho plot` as arrays: each function returns the columns of its table by name."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from . import physics

__all__ = ["black_body", "deposition", "drop_sizes", "emission", "quenching", "streak_opacity", "terminal_velocity"]

Columns = dict[str, NDArray[np.float64]]


def black_body(start_k: float = 1.0, end_k: float = 10_000.0, step_k: float = 1.0) -> Columns:
    """Linear sRGB and ACEScg of luminance 1, and luminance (cd/m^2), by temperature."""
    kelvins = np.arange(start_k, end_k + 1e-9 * step_k, step_k)
    columns: Columns = {"temperature_k": kelvins}
    for space in ("linear_srgb", "acescg"):
        body = physics.black_body(kelvins, space=space)  # type: ignore[arg-type]
        luminance = np.where(body.luminance > 0, body.luminance, 1.0)[:, None]
        for channel, name in enumerate("rgb"):
            columns[f"{space}_{name}"] = (body.radiance / luminance)[:, channel].astype(np.float64)
    columns["luminance_cd_per_m2"] = physics.black_body(kelvins).luminance.astype(np.float64)
    return columns


def drop_sizes(rates_mm_per_h: Sequence[float] = (1.0, 5.0, 10.0, 20.0)) -> Columns:
    """Number density of drops by diameter at rain rates, 1/(m^3 mm)."""
    columns: Columns = {"diameter_mm": physics.drop_sizes(1.0).diameter_mm}
    for rate in rates_mm_per_h:
        columns[f"n_at_{rate:g}_mm_per_h_per_m3_mm"] = physics.drop_sizes(rate).density
    return columns


def terminal_velocity() -> Columns:
    """Terminal velocity of drops by diameter, m/s: both laws."""
    diameters = np.linspace(0, 6, 121)
    return {
        "diameter_mm": diameters,
        "gunn_kinzer_m_per_s": physics.terminal_velocity(diameters),
        "rigid_sphere_m_per_s": physics.terminal_velocity(diameters, law="rigid_sphere"),
    }


def streak_opacity(exposures_s: Sequence[float] = (1 / 30, 1 / 60, 1 / 250)) -> Columns:
    """Opacity on the axis of streaks by diameter and exposure time."""
    diameters = np.linspace(0.1, 6, 119)
    columns: Columns = {"diameter_mm": diameters}
    for exposure in exposures_s:
        columns[f"opacity_at_{exposure:g}_s"] = physics.streak_opacity(diameters, exposure)
    return columns


def emission(energy_ev: float = 3000.0, flux: float = 1.0, spectrum: physics.Spectrum = "gaussian") -> Columns:
    """Volume emission rate of every auroral line by altitude, photons/(m^3 s)."""
    light = physics.aurora_emission(energy_ev, flux, spectrum=spectrum)
    return {"altitude_km": light.altitude_km, **{name: light.rate[:, index] for index, name in enumerate(light.lines)}}


def deposition(energies_ev: Sequence[float] = (1e3, 3e3, 1e4, 3e4), spectrum: physics.Spectrum = "gaussian") -> Columns:
    """Ionization rate by altitude and energy for 1 mW/m^2, 1/(m^3 s)."""
    altitudes, rates = physics.aurora_deposition(list(energies_ev), spectrum=spectrum)
    return {"altitude_km": altitudes, **{f"q_{energy:g}_ev": rates[:, index] for index, energy in enumerate(energies_ev)}}


def quenching() -> Columns:
    """Fraction of excited states that radiate, by altitude."""
    altitudes, fractions = physics.aurora_quenching()
    return {"altitude_km": altitudes, **{name: fractions[:, index] for index, name in enumerate(("O(1S)", "O(1D)", "N2+(B)", "N2(B)"))}}
