"""Frames: the pixels of the program, arrays that belong to the caller, data."""

import io
import os
import pickle
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest

import bansho

OpenEXR = pytest.importorskip("OpenEXR")
Image = pytest.importorskip("PIL.Image")

TEXT = """\
bansho = 2
[picture]
size = [96, 64]
frames = 4
[camera]
position = [0.3, 1.2, 4.0]
[[flame_sheet]]
[[rain]]
rate_mm_per_h = 40.0
opacity_gain = 8.0
"""


def channels_of(path):
    """The channels of an EXR by name."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: np.array(channel.pixels) for name, channel in file.channels().items()}


@pytest.fixture(scope="module")
def shot():
    return bansho.open(bansho.Scene.parse(TEXT), layers=True, aovs=True, figures=True)


def codes_of(path):
    """The codes of a PNG (RFC 2083) of 8 or 16 bits, (H, W, channels): libraries in wide use read four channels of 16 bits as 8 bits."""
    data, chunks, at = path.read_bytes(), {}, 8
    while at < len(data):
        (length,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        chunks[kind] = chunks.get(kind, b"") + data[at + 8 : at + 8 + length]
        at += 12 + length
    width, height, bits, color = struct.unpack(">IIBB", chunks[b"IHDR"][:10])
    pixel = {2: 3, 6: 4}[color] * bits // 8
    rows = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(height, 1 + width * pixel)
    decoded = np.zeros((height + 1, width + 1, pixel), int)
    for y, row in enumerate(rows, start=1):
        kind, values = row[0], row[1:].astype(int).reshape(width, pixel)
        for x in range(1, width + 1):
            left, up, corner = decoded[y, x - 1], decoded[y - 1, x], decoded[y - 1, x - 1]
            nearest = np.stack([abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)]).argmin(axis=0)
            predicted = [0, left, up, (left + up) // 2, np.choose(nearest, [left, up, corner])][kind]
            decoded[y, x] = (values[x - 1] + predicted) % 256
    return np.ascontiguousarray(decoded[1:, 1:], dtype=np.uint8).view(">u2" if bits == 16 else np.uint8)


def test_light_and_aovs_are_those_of_the_exr_bit_for_bit(shot, tmp_path):
    shot.write(tmp_path / "f.####.exr", frames=[2])
    channels = channels_of(tmp_path / "f.0002.exr")
    frame = shot.render(2)
    for index, name in enumerate("RGBA"):
        assert np.array_equal(frame.linear[..., index].astype(np.float16).view(np.uint16), channels[name].view(np.uint16)), name
    assert np.array_equal(frame.depth, channels["Z"])
    assert set(frame.aovs) >= {"rain.streak_opacity", "flame_sheet.temperature_k"}
    for name, aov in frame.aovs.items():
        # A name that does not end in a component has one in the file.
        stored = channels.get(name, channels.get(f"{name}.V"))
        assert stored is not None and stored.dtype == np.float32 and np.array_equal(aov, stored), name
    for name, layer in frame.layers.items():
        for index, component in enumerate("RGBA"):
            assert np.array_equal(layer[..., index].astype(np.float16), channels[f"{name}.{component}"]), name


def test_display_codes_are_those_of_the_png(shot, tmp_path):
    for bits in (8, 16):
        for alpha in ("encoded", "linear"):
            plain = bansho.open(bansho.Scene.parse(TEXT), backdrop=False)
            plain.write(tmp_path / f"{alpha}{bits}.####.png", frames=[1], bits=bits, alpha=alpha)
            stored = codes_of(tmp_path / f"{alpha}{bits}.0001.png")
            codes = plain.render(1).display(alpha=alpha, bits=bits)
            assert codes.dtype == (np.uint8 if bits == 8 else np.uint16) and codes.shape == (64, 96, 4)
            assert np.array_equal(codes, stored), (alpha, bits)
            assert np.array_equal(plain.display(1, alpha=alpha, bits=bits), codes), (alpha, bits)
            if bits == 8:
                assert np.array_equal(np.asarray(Image.open(tmp_path / f"{alpha}{bits}.0001.png")), stored)
    # Over black, where no division by a small alpha makes dithering larger: finer codes, and nearly those of 8 bits.
    sixteen, eight = (plain.display(1, alpha=None, bits=bits) for bits in (16, 8))
    assert len(np.unique(sixteen[..., 0])) > 256 >= len(np.unique(eight[..., 0]))
    assert np.abs(sixteen / 257 - eight).max() <= 1.0


def test_the_program_writes_the_same_bytes(program, tmp_path):
    scene = bansho.Scene.parse(TEXT)
    scene.save(tmp_path / "scene.toml")
    command = [*program, "render", str(tmp_path / "scene.toml"), "--frames", "1", "--out", str(tmp_path / "program.####.png")]
    subprocess.run(command, check=True, capture_output=True)
    bansho.open(bansho.Scene.load(tmp_path / "scene.toml")).write(tmp_path / "python.####.png", frames=1)
    assert (tmp_path / "program.0001.png").read_bytes() == (tmp_path / "python.0001.png").read_bytes()


def test_the_module_is_the_program(program, tmp_path, monkeypatch):
    bansho.Scene.parse(TEXT).save(tmp_path / "scene.toml")
    # The module runs the program among Python's scripts, else the one on the path.
    monkeypatch.setenv("PATH", os.pathsep.join([str(Path(program[0]).parent), os.environ["PATH"]]))
    ran = subprocess.run([sys.executable, "-m", "bansho", "--version"], check=True, capture_output=True).stdout
    if ran != subprocess.run([*program, "--version"], check=True, capture_output=True).stdout:
        pytest.skip("the program among Python's scripts has another version")
    for name, command in (("module", [sys.executable, "-m", "bansho"]), ("program", program)):
        options = ["--frames", "1", "--layers", "--out", str(tmp_path / f"{name}.####.exr")]
        subprocess.run([*command, "render", str(tmp_path / "scene.toml"), *options], check=True, capture_output=True)
    assert (tmp_path / "module.0001.exr").read_bytes() == (tmp_path / "program.0001.exr").read_bytes()
    failed = subprocess.run([sys.executable, "-m", "bansho", "render", str(tmp_path / "nothing.toml")], capture_output=True)
    assert failed.returncode != 0 and b"nothing.toml" in failed.stderr


def test_frames_do_not_depend_on_threads_or_on_those_before(torch_scene):
    one, many = bansho.open(torch_scene, threads=1), bansho.open(torch_scene, threads=3)
    backward = [many.render(number).linear for number in (3, 2, 1, 0)][::-1]
    for frame, expected in zip(one.frames(), backward, strict=True):
        assert np.array_equal(frame.linear, expected)


def test_arrays_outlive_their_shot(torch_scene):
    light = bansho.open(torch_scene).render(0).linear
    light += 1.0
    assert light.flags["W"] and light.min() >= 1.0


def test_linear_srgb_is_acescg_by_the_published_matrix(torch_scene):
    shot = bansho.open(torch_scene, space="linear_srgb")
    frame = shot.render(1)
    acescg = frame.in_space("acescg")
    # ACEScg to linear sRGB with Bradford's adaptation.
    matrix = np.array([[1.70505, -0.62179, -0.08326], [-0.13026, 1.14080, -0.01055], [-0.02400, -0.12897, 1.15297]], np.float32)
    assert np.allclose(frame.linear[..., :3], acescg[..., :3] @ matrix.T, atol=1e-4 * acescg.max())
    assert np.array_equal(frame.linear[..., 3], acescg[..., 3])


def test_the_camera_projects_drops_to_their_streaks():
    scene = bansho.Scene([bansho.Picture(size=(320, 180), exposure_ev100=12), bansho.Sky(), bansho.Rain(method="drops", splashes={"fraction": 0.0}), bansho.Camera(position=(0, 1.5, 4))])
    frame = bansho.open(scene, aovs=True).render(0)
    drops = frame.drops
    assert drops.dtype.metadata["units"]["velocity"] == "m/s" and len(drops) > 50
    pixels = frame.camera.project(drops["position"])
    opacity = np.asarray(frame.aovs["rain.streak_opacity"])
    near = [(int(round(x)), int(round(y))) for x, y, depth in pixels if depth > 0.5 and 0 <= x < 319 and 0 <= y < 179]
    hits = sum(opacity[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].max() > 0 for x, y in near)
    assert len(near) > 30 and hits > 0.97 * len(near)


def test_data_of_a_frame(shot):
    frame = shot.render(0)
    assert frame.aovs["flame_sheet.temperature_k"].unit == "K" and "temperature" in frame.aovs["flame_sheet.temperature_k"].doc
    aov = frame.aovs["flame_sheet.temperature_k"]
    sent = pickle.loads(pickle.dumps(aov[:5]))
    assert (sent.unit, sent.doc) == (aov.unit, aov.doc) and np.array_equal(sent, aov[:5]), "what a worker process returns keeps its unit"
    assert {figure.phenomenon for figure in frame.figures} >= {"rain"}
    lights = frame.lights
    assert lights and all(light.phenomenon == "flame_sheet" and light.kind == "point" and light.intensity > 0 for light in lights)
    assert frame.camera.world_from_camera[:3, 3] == pytest.approx([0.3, 1.2, 4.0])
    assert np.allclose(frame.camera.world_from_camera[:3, :3].T @ frame.camera.world_from_camera[:3, :3], np.eye(3))
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(frame._repr_png_()))), frame.display())


def test_particles_are_those_of_each_phenomenon(shot):
    frame = shot.render(0)
    assert set(frame.particles) == {"rain"}, "a sheet of flame has none"
    drops = frame.particles["rain"]
    assert drops["position"].shape == drops["velocity"].shape == (len(drops), 3) and len(drops) > 1000
    # Without wind drops fall straight down, as fast as those of Gunn and Kinzer.
    assert not drops["velocity"][:, [0, 2]].any()
    assert -drops["velocity"][:, 1] == pytest.approx(bansho.terminal_velocity(drops["diameter_mm"].astype(float)), rel=1e-3)

    burning = bansho.Scene([bansho.Picture(size=(32, 32)), bansho.FlameParticles(name="fire", particles=2000, preroll_s=1)])
    particles = bansho.open(burning).render(1).particles["fire"]
    units = particles.dtype.metadata["units"]
    assert units == {"position": "m", "velocity": "m/s", "temperature": "K", "density": "kg/m^3"} and set(units) == set(particles.dtype.names)
    assert 250 < particles["temperature"].min() < particles["temperature"].max() < 2500
    hot = particles["temperature"] > 1000
    assert particles["density"][hot].mean() < 0.5 * 1.2, "hot gas is light"
    assert particles["velocity"][hot][:, 1].mean() > 0, "and rises"


def test_names_that_are_missing_are_told_with_the_option_and_those_there_are(shot):
    plain = bansho.open(bansho.Scene.parse(TEXT), size=(16, 16)).render(0)
    of_scene = "allowed: aovs=True of bansho.open, with which this scene has flame_sheet.temperature_k,"
    with pytest.raises(KeyError, match=f"^there is no AOV 'heat', since the frame has none; {of_scene}"):
        plain.aovs["heat"]
    with pytest.raises(KeyError, match="^there is no layer 'rain', since the frame has none; allowed: layers=True of bansho.open$"):
        plain.layers["rain"]
    with pytest.raises(ValueError, match="the frame has no figures; allowed: figures=True of bansho.open"):
        _ = plain.figures
    frame = shot.render(0)
    with pytest.raises(bansho.MissingNameError, match="^there is no AOV 'rain.opacity'; allowed: .*rain.streak_opacity"):
        frame.aovs["rain.opacity"]
    with pytest.raises(bansho.MissingNameError, match="^there is no layer 'flame'; allowed: flame_sheet, rain$"):
        frame.layers["flame"]
    assert dict(plain.aovs) == {} and "rain" in frame.layers and frame.aovs.get("heat") is None
    assert repr(frame.layers) == "<layers: flame_sheet, rain>" and len(frame.layers) == 2


def test_a_plate_of_arrays_is_a_plate_of_files(photograph, tmp_path):
    depth = np.full((180, 320), 8.0, np.float32)
    Image.fromarray(photograph).save(tmp_path / "plate.png")
    np.save(tmp_path / "depth.npy", depth)
    scene = bansho.Scene({"picture": {"size": [320, 180]}, "plate": {"image": "plate.png", "depth": "depth.npy"}, "fog": {"visibility_m": 60.0}}, folder=tmp_path)
    of_files = bansho.open(scene).render(0)
    elsewhere = bansho.Scene.parse(scene.to_toml(), folder=tmp_path / "nowhere")
    of_arrays = bansho.open(elsewhere, arrays={"plate.png": photograph, "depth.npy": depth}).render(0)
    assert np.array_equal(of_files.linear, of_arrays.linear) and np.array_equal(of_files.display(), of_arrays.display())
    with pytest.raises(ValueError, match="names no file 'other.png'; allowed: depth.npy, plate.png"):
        bansho.open(elsewhere, arrays={"other.png": photograph})


def test_a_sequence_of_arrays_has_one_for_each_frame(photograph):
    scene = bansho.Scene({"picture": {"size": [320, 180], "frames": 2, "first_frame": 5}, "plate": {"image": "p.####.png"}, "camera": {"glare": 0.0}})
    shot = bansho.open(scene, arrays={"p.####.png": [photograph, 255 - photograph]})
    assert np.array_equal(shot.display(5, alpha=None), photograph)
    assert np.array_equal(shot.display(6, alpha=None), 255 - photograph)
    with pytest.raises(ValueError, match="frame 7; allowed: frames 5 to 6"):
        shot.display(7)


def test_progress_is_told_and_options_are_checked(torch_scene, tmp_path):
    told = []
    bansho.open(torch_scene).write(tmp_path / "f.####.png", progress=lambda done, total: told.append((done, total)))
    assert told[-1] == (4, 4) and sorted(path.name for path in tmp_path.iterdir()) == [f"f.{number:04}.png" for number in range(4)]
    for options, message in [
        ({"threads": 0}, "threads: 0; allowed: 1 to 1024"),
        ({"view": "agxx"}, 'view: "agxx"; allowed: '),
        ({"space": "rec709"}, "space: 'rec709'; allowed: "),
        ({"size": (0, 5)}, "a picture of 0 x 5 pixels; allowed: 1 to"),
        ({"size": (-3, 5)}, "size"),
        ({"crop": (90, 0, 10, 10)}, "extends beyond the picture"),
        ({"loop_s": 0.01}, "a loop of 0.01 s; allowed: "),
    ]:
        with pytest.raises(ValueError, match=message):
            bansho.open(torch_scene, **options)
    with pytest.raises(ValueError, match='alpha: "sraight"; allowed: "encoded", "linear"'):
        bansho.open(torch_scene).display(0, alpha="sraight")
    with pytest.raises(ValueError, match="a frame number: '1'; allowed: a whole number"):
        bansho.open(torch_scene).render("1")


def test_progress_of_frames_is_told(torch_scene):
    told = []
    shot = bansho.open(torch_scene, size=(16, 16))
    frames = shot.frames(1, 4, step=2, progress=lambda done, total: told.append((done, total)))
    assert next(frames).number == 1 and told == [], "it is told once the next one is asked for"
    assert [frame.number for frame in frames] == [3] and told == [(1, 2), (2, 2)]


def test_a_bar_of_tqdm_shows_the_progress(torch_scene, tmp_path, monkeypatch):
    tqdm = pytest.importorskip("tqdm.auto")
    bars = []

    class Bar(tqdm.tqdm):
        """A bar that is kept."""

        def __init__(self, **options):
            super().__init__(file=io.StringIO(), mininterval=0, **options)
            bars.append(self)

    monkeypatch.setattr(tqdm, "tqdm", Bar)
    shot = bansho.open(torch_scene, size=(16, 16))
    assert len(list(shot.frames(progress=True))) == 4
    shot.write(tmp_path / "f.####.png", frames=[0, 2], progress=True)
    assert [(bar.n, bar.total, bar.unit, bar.disable) for bar in bars] == [(4, 4, "frame", True), (2, 2, "frame", True)], "full and closed"
    bars.clear()
    for in_flight in (1, 2):
        frames = shot.frames(progress=True, frames_in_flight=in_flight)
        next(frames)
        next(frames)
        frames.close()
    assert [(bar.n, bar.disable) for bar in bars] == [(1, True), (1, True)], "closed where the loop over the frames ends early"


def test_without_tqdm_frames_are_drawn_all_the_same(torch_scene, monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)
    assert len(list(bansho.open(torch_scene, size=(16, 16)).frames(progress=True))) == 4
