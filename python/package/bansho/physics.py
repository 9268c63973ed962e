"""The physics behind the pictures, as arrays: black bodies, drops, streaks, auroral light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _bansho, _checks

__all__ = [
    "AuroraEmission",
    "BlackBody",
    "DropSizes",
    "Streaks",
    "aurora_deposition",
    "aurora_emission",
    "aurora_quenching",
    "black_body",
    "drop_sizes",
    "rain_extinction",
    "streak_opacity",
    "streaks",
    "terminal_velocity",
]

Spectrum = Literal["gaussian", "maxwellian", "monoenergetic"]


def _numbers(values: ArrayLike, name: str) -> tuple[list[float], tuple[int, ...]]:
    """Numbers in a list, and the shape of their array."""
    array = _checks.numbers(values, name, "numbers")
    return array.ravel().tolist(), array.shape


@dataclass(frozen=True)
class BlackBody:
    """Light of black bodies."""

    temperature_k: NDArray[np.float64]
    """Temperature, K."""
    radiance: NDArray[np.float32]
    """Red, green and blue, whose luminance is in cd/m^2: (..., 3)."""
    luminance: NDArray[np.float32]
    """Luminance, cd/m^2."""


def black_body(temperature_k: ArrayLike, *, space: Literal["linear_srgb", "acescg"] = "linear_srgb") -> BlackBody:
    """Light of black bodies of 0 to 10000 K, by Planck's law and the CIE 1931 observer. Below about 150 K it is 0."""
    kelvins, shape = _numbers(temperature_k, "temperature_k")
    radiance, luminance = _bansho.black_body_radiance(kelvins, space)
    return BlackBody(np.reshape(kelvins, shape), radiance.reshape((*shape, 3)), luminance.reshape(shape))


@dataclass(frozen=True)
class DropSizes:
    """Drops of a rain rate by diameter: Marshall and Palmer (1948)."""

    rate_mm_per_h: float
    """Rain rate, mm/h."""
    diameter_mm: NDArray[np.float64]
    """Diameter, mm."""
    density: NDArray[np.float64]
    """Number density, 1/(m^3 mm)."""
    extinction: float
    """Extinction coefficient of all drops, 1/m."""

    @property
    def visibility_m(self) -> float:
        """Meteorological visibility in that rain, m."""
        return 3.912 / self.extinction if self.extinction > 0 else float("inf")


def drop_sizes(rate_mm_per_h: float, diameter_mm: ArrayLike | None = None) -> DropSizes:
    """Number density of drops by diameter (by default 0 to 6 mm) at a rain rate."""
    diameters, _ = _numbers(np.linspace(0, 6, 121) if diameter_mm is None else diameter_mm, "diameter_mm")
    rate = _checks.number(rate_mm_per_h, "rate_mm_per_h")
    return DropSizes(rate, np.array(diameters), _bansho.drop_density(rate, diameters), _bansho.rain_extinction(rate))


def rain_extinction(rate_mm_per_h: float) -> float:
    """Extinction coefficient of rain, 1/m: light falls to exp(-beta d) over a distance d."""
    return _bansho.rain_extinction(_checks.number(rate_mm_per_h, "rate_mm_per_h"))


def terminal_velocity(
    diameter_mm: ArrayLike,
    *,
    law: Literal["gunn_kinzer", "rigid_sphere"] = "gunn_kinzer",
    temperature_k: float = 293.15,
    pressure_pa: float = 101_325.0,
) -> NDArray[np.float64]:
    """Terminal velocity of raindrops, m/s: measured by Gunn and Kinzer (1949), or of rigid spheres."""
    diameters, shape = _numbers(diameter_mm, "diameter_mm")
    return _bansho.terminal_velocity(diameters, law, _checks.number(temperature_k, "temperature_k"), _checks.number(pressure_pa, "pressure_pa")).reshape(shape)


def streak_opacity(diameter_mm: ArrayLike, exposure_s: float) -> NDArray[np.float64]:
    """Opacity on the axis of the streak of a drop that falls at its terminal velocity: D / (v T), at most 1."""
    diameters, shape = _numbers(diameter_mm, "diameter_mm")
    return _bansho.streak_opacity(diameters, _checks.number(exposure_s, "exposure_s")).reshape(shape)


@dataclass(frozen=True)
class Streaks:
    """Streak textures of a cube of rain, one for each diameter."""

    opacity: NDArray[np.float32]
    """Opacity, (diameters, size, size)."""
    diameter_mm: NDArray[np.float64]
    """Diameters, mm."""
    drops: list[NDArray[Any]]
    """The drops of each texture as structured arrays: `diameter_mm`, `speed` (m/s), `position` (m)."""
    pixel_m: float
    """Edge of a pixel, m."""

    @property
    def total(self) -> NDArray[np.float32]:
        """The opacity of all diameters together, (size, size)."""
        return (1 - np.prod(1 - self.opacity, axis=0)).astype(np.float32)


def streaks(
    rate_mm_per_h: float = 10.0,
    diameters_mm: Sequence[float] = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0),
    *,
    exposure_s: float = 1 / 30,
    edge_m: float = 1.0,
    size: int = 512,
    seed: int = 1,
    variant: int = 0,
) -> Streaks:
    """Streak textures of the drops in a cube of rain (Yoshida, Dobashi and Yamamoto): orthographic, from the side, in still air."""
    diameters, _ = _numbers(diameters_mm, "diameters_mm")
    side, number = _checks.whole(size, "size", "1 to 65536 pixels", 1, 65536), _checks.whole(variant, "variant", "0 or more", 0, 2**32 - 1)
    rate, exposure, edge = (_checks.number(value, name) for value, name in ((rate_mm_per_h, "rate_mm_per_h"), (exposure_s, "exposure_s"), (edge_m, "edge_m")))
    opacity, rows = _bansho.streak_textures(rate, diameters, exposure, edge, side, _checks.seed(seed), number)
    drops: list[NDArray[Any]] = []
    for row in rows:
        array = np.zeros(len(row), [("diameter_mm", "f8"), ("speed", "f8"), ("position", "f8", (3,))])
        array["diameter_mm"], array["speed"], array["position"] = row[:, 0], row[:, 1], row[:, 2:]
        drops.append(array)
    return Streaks(opacity, np.array(diameters), drops, edge / side)


@dataclass(frozen=True)
class AuroraEmission:
    """Auroral light by altitude and line."""

    altitude_km: NDArray[np.float64]
    """Altitude, km."""
    lines: tuple[str, ...]
    """Names of the lines."""
    wavelength_nm: NDArray[np.float64]
    """Their wavelengths, nm."""
    rate: NDArray[np.float64]
    """Volume emission rate, photons/(m^3 s): (altitudes, lines)."""
    kilorayleigh: NDArray[np.float64]
    """Brightness of each line from below, kR."""


def aurora_emission(energy_ev: float, flux: float = 1.0, *, spectrum: Spectrum = "gaussian") -> AuroraEmission:
    """Light of the air that electrons strike, by altitude and line.

    :param energy_ev: energy of the electrons, 100 to 100000 eV: of a Gaussian spectrum its mean, of a Maxwellian half its mean.
    :param flux: their energy flux, mW/m^2.
    :param spectrum: `"gaussian"` (arcs), `"maxwellian"` (diffuse auroras) or `"monoenergetic"`.
    """
    altitudes, rates, kilorayleigh = _bansho.aurora_emission(_checks.number(energy_ev, "energy_ev"), _checks.number(flux, "flux"), spectrum)
    names, wavelengths = zip(*_bansho.aurora_lines(), strict=True)
    return AuroraEmission(altitudes, tuple(names), np.array(wavelengths), rates, kilorayleigh)


def aurora_deposition(energy_ev: ArrayLike, *, spectrum: Spectrum = "gaussian") -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Altitudes (km), and ionization rates by altitude and energy for 1 mW/m^2, 1/(m^3 s): Fang et al. (2010)."""
    energies, _ = _numbers(np.atleast_1d(energy_ev), "energy_ev")
    return _bansho.aurora_deposition(energies, spectrum)


def aurora_quenching() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Altitudes (km), and the fraction of excited states that radiate before a collision: O(1S), O(1D), N2+(B), N2(B)."""
    return _bansho.aurora_quenching()
