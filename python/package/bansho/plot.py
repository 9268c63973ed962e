"""Curves as arrays. `columns` returns the table of any curve of `bansho plot` with the program's columns; the other functions return curves of the physics in the
process, without the program, under names of their own."""

from __future__ import annotations

import csv
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import physics
from ._program import program
from .scene import Scene

__all__ = ["black_body", "columns", "deposition", "drop_sizes", "emission", "quenching", "streak_opacity", "terminal_velocity"]

Columns = dict[str, NDArray[np.float64]]


def columns(curve: str, *inputs: Scene | str | Path, **options: Any) -> Columns:
    """The table of `bansho plot CURVE`, by the program that is installed with this package: `columns("flame-statistics", "torch.toml", frames=24)`.

    :param curve: its name on the page on plots: `"kernel"`, `"beam"`, `"transfer-curves"`, `"flame-shape"`, `"parameters"`, `"metadata"` and the others.
    :param inputs: what it is made from: a scene, or the path of one; of `"metadata"` the files of frames.
    :param options: the options of the program, with underscores in place of hyphens; lists are joined by commas.
    :returns: the columns by name; NaN where there is no number.
    :raises ValueError: what the program says of an unknown curve or option.
    """
    arguments = [curve.replace("_", "-")]
    with tempfile.TemporaryDirectory() as folder:
        for number, source in enumerate(inputs):
            if isinstance(source, Scene):
                path = Path(folder) / f"scene_{number}.toml"
                path.write_text(source.to_toml(), encoding="utf-8")
                source = path
            arguments.append(str(source))
        for name, value in options.items():
            values = value if isinstance(value, (list, tuple)) else [value]
            arguments += [f"--{name.replace('_', '-')}", ",".join(str(item) for item in values)]
        done = subprocess.run([str(program()), "plot", *arguments, "-o", "-"], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise ValueError(done.stderr.strip())
    _, names, *rows = csv.reader(done.stdout.splitlines())
    numbers = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows], dtype=np.float64)
    return dict(zip(names, numbers.T, strict=True))


def black_body(start_k: float = 1.0, end_k: float = 10_000.0, step_k: float = 1.0) -> Columns:
    """Linear sRGB and ACEScg of luminance 1, and luminance (cd/m^2), by temperature."""
    kelvins = np.arange(start_k, end_k + 1e-9 * step_k, step_k, dtype=np.float64)
    columns: Columns = {"temperature_k": kelvins}
    for space in ("linear_srgb", "acescg"):
        body = physics.black_body(kelvins, space=space)  # type: ignore[arg-type]
        luminance = np.where(body.luminance > 0, body.luminance, 1.0)[:, None]
        for channel, name in enumerate("rgb"):
            columns[f"{space}_{name}"] = (body.radiance / luminance)[:, channel].astype(np.float64)
    columns["luminance_cd_per_m2"] = physics.black_body(kelvins).luminance.astype(np.float64)
    return columns


def drop_sizes(rates_mm_per_h: Sequence[float] = (1.0, 5.0, 20.0, 50.0)) -> Columns:
    """Number density of drops by diameter at rain rates, 1/(m^3 mm)."""
    columns: Columns = {"diameter_mm": physics.drop_sizes(1.0).diameter_mm}
    for rate in rates_mm_per_h:
        columns[f"n_at_{rate:g}_mm_per_h_per_m3_mm"] = physics.drop_sizes(rate).density
    return columns


def terminal_velocity() -> Columns:
    """Terminal velocity of drops by diameter, m/s: both laws."""
    diameters = np.linspace(0, 6, 121, dtype=np.float64)
    return {
        "diameter_mm": diameters,
        "gunn_kinzer_m_per_s": physics.terminal_velocity(diameters),
        "rigid_sphere_m_per_s": physics.terminal_velocity(diameters, law="rigid_sphere"),
    }


def streak_opacity(exposures_s: Sequence[float] = (1 / 30, 1 / 60, 1 / 250)) -> Columns:
    """Opacity on the axis of streaks by diameter and exposure time."""
    diameters = np.linspace(0.1, 6, 119, dtype=np.float64)
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
