"""Physics as arrays, against numbers of others."""

import csv
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import bansho
from bansho import plot

# Its name before numpy 2.
trapezoid = getattr(np, "trapezoid", None) or np.trapz

DATA = Path(__file__).parents[2] / "crates" / "cli" / "src" / "plot" / "data"


def rows_of(name: str) -> np.ndarray:
    lines = [line for line in (DATA / name).read_text().splitlines() if line and (line[0].isdigit() or line[0] == "-")]
    return np.array([[float(cell) for cell in row] for row in csv.reader(lines)])


def test_black_bodies_follow_planck():
    rows = rows_of("black_body.csv")
    body = bansho.black_body(rows[:, 0])
    bright = rows[:, 1] > 1e-3
    assert body.luminance[bright] == pytest.approx(rows[bright, 1], rel=2e-3)
    assert body.radiance[bright] / body.luminance[bright, None] == pytest.approx(rows[bright, 2:5], rel=5e-3, abs=2e-3)
    assert bansho.black_body(1900.0).radiance.shape == (3,)


def test_drops_follow_marshall_and_palmer():
    for rate, diameter, density in rows_of("marshall_palmer.csv"):
        assert bansho.drop_sizes(rate, [diameter]).density[0] == pytest.approx(density, rel=1e-3)
    assert bansho.drop_sizes(20).visibility_m == pytest.approx(3.912 / bansho.rain_extinction(20))


def test_terminal_velocities_and_opacities_are_the_measured_ones():
    measured = rows_of("gunn_kinzer_1949.csv")
    assert bansho.terminal_velocity(measured[:, 0]) == pytest.approx(measured[:, 1], rel=0.01, abs=0.02)
    for diameter, exposure, opacity in rows_of("streak_opacity.csv"):
        assert bansho.streak_opacity(diameter, exposure) == pytest.approx(opacity, rel=0.01)


def test_a_streak_texture_holds_the_area_of_its_drops():
    cube = bansho.streaks(20, (1.0, 2.0), exposure_s=1 / 60, size=256)
    assert cube.opacity.shape == (2, 256, 256)
    for texture, drops in zip(cube.opacity, cube.drops, strict=True):
        # Of drops that are inside of the cube during the whole exposure.
        inside = (drops["position"][:, 1] > drops["speed"] / 60 + 0.01) & (abs(drops["position"][:, 0] - 0.5) < 0.49)
        area = np.pi / 4 * (1e-3 * drops["diameter_mm"]) ** 2
        total = float(texture.sum(dtype=np.float64)) * cube.pixel_m**2
        assert area[inside].sum() * 0.99 <= total <= area.sum() * 1.01
        assert drops["speed"] == pytest.approx(bansho.terminal_velocity(drops["diameter_mm"]), rel=1e-6)


def test_auroral_light_peaks_where_electrons_stop():
    light = bansho.aurora_emission(3000, 10)
    assert light.rate.shape == (len(light.altitude_km), len(light.lines))
    green = light.rate[:, abs(light.wavelength_nm - 557.7) < 0.5][:, 0]
    assert 105 < light.altitude_km[green.argmax()] < 135
    # 1 kR is 1e13 photons/(m^2 s) from a column.
    column = trapezoid(green, 1e3 * light.altitude_km) / bansho._bansho.PHOTONS_PER_KILORAYLEIGH
    assert column == pytest.approx(light.kilorayleigh[abs(light.wavelength_nm - 557.7) < 0.5][0], rel=0.01)
    for energy, altitude, rate in rows_of("fang2010_peaks.csv"):
        altitudes, rates = bansho.aurora_deposition(1e3 * energy, spectrum="monoenergetic")
        assert rates[:, 0].max() == pytest.approx(rate, rel=0.02)
        assert altitudes[rates[:, 0].argmax()] == pytest.approx(altitude, abs=1.0)


def test_curves_are_those_of_the_program(program):
    text = subprocess.run([*program, "plot", "drop-sizes", "--rates", "1,20", "-o", "-"], check=True, capture_output=True, text=True).stdout
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    table = np.array([[float(cell or "nan") for cell in line.split(",")] for line in lines[1:]])
    columns = plot.drop_sizes((1, 20))
    assert np.allclose(table[:, :3], np.column_stack(list(columns.values())), rtol=1e-5)


def test_every_curve_of_the_program_is_there_as_columns():
    """Those of the page on plots: some have functions, all are tables of the program."""
    scene = bansho.Scene({"flame_sheet": [{"name": "torch"}], "wind": {"velocity": {"keys": [[0, [0, 0, 0]], [1, [1, 0, 0]]]}}})
    page = (Path(__file__).parents[2] / "docs" / "src" / "guide" / "plots.md").read_text(encoding="utf-8")
    listed = set(re.findall(r"^\| `plot ([a-z-]+)", page, re.MULTILINE))
    inputs = {
        "transfer-curves": ([scene], {}),
        "flame-shape": ([scene], {}),
        "flame-statistics": ([scene], {"frames": 2, "height": 32}),
        "parameters": ([scene], {"path": "wind.velocity"}),
    }
    drawn_by_camera_or_from_files = {"deflection", "metadata"}
    for name in listed - drawn_by_camera_or_from_files:
        sources, options = inputs.get(name, ([], {}))
        columns = plot.columns(name, *sources, **options)
        assert len({len(column) for column in columns.values()}) == 1 and len(columns) > 1, name
    assert listed >= {"kernel", "beam", *(name.replace("_", "-") for name in plot.__all__ if name != "columns")}
    wind = plot.columns("parameters", scene, path="wind.velocity")
    assert np.nanmax(wind["wind.velocity.x"]) == pytest.approx(1, abs=0.05), wind.keys()
    with pytest.raises(ValueError, match="unrecognized subcommand 'candle'"):
        plot.columns("candle")


def test_every_function_has_columns_of_one_length():
    for name in (name for name in plot.__all__ if name != "columns"):
        columns = getattr(plot, name)()
        assert len({len(column) for column in columns.values()}) == 1 and len(columns) > 1


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: bansho.black_body(20_000), "temperature_k: 20000 is out of range; allowed: 0 to 10000 K"),
        (lambda: bansho.drop_sizes(-1), "rate_mm_per_h: -1 is out of range; allowed: 0 to 300 mm/h"),
        (lambda: bansho.aurora_emission(10), "energy_ev: 10 is out of range; allowed: 100 to 100000 eV"),
        (lambda: bansho.aurora_emission(1000, spectrum="flat"), 'spectrum: "flat"; allowed: "gaussian"'),
        (lambda: bansho.streaks(diameters_mm=(2.0, 1.0)), "allowed: one or more, ascending"),
        (lambda: bansho.terminal_velocity("wide"), "diameter_mm: 'wide'; allowed: numbers"),
    ],
)
def test_bad_input_is_told_what_is_allowed(call, message):
    with pytest.raises(ValueError, match=message):
        call()
