"""Frames: the pixels of the program, arrays that belong to the caller, data."""

import io
import subprocess

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
            if bits == 8:
                stored = np.asarray(Image.open(tmp_path / f"{alpha}{bits}.0001.png"))
                assert np.array_equal(plain.render(1).display(alpha=alpha), stored), alpha
            assert plain.display(1, alpha=alpha, bits=bits).dtype == (np.uint8 if bits == 8 else np.uint16)


def test_the_program_writes_the_same_bytes(program, tmp_path):
    scene = bansho.Scene.parse(TEXT)
    scene.save(tmp_path / "scene.toml")
    command = [*program, "render", str(tmp_path / "scene.toml"), "--frames", "1", "--out", str(tmp_path / "program.####.png")]
    subprocess.run(command, check=True, capture_output=True)
    bansho.open(bansho.Scene.load(tmp_path / "scene.toml")).write(tmp_path / "python.####.png", frames=1)
    assert (tmp_path / "program.0001.png").read_bytes() == (tmp_path / "python.0001.png").read_bytes()


def test_frames_do_not_depend_on_threads_or_on_those_before(torch_scene):
    one, many = bansho.open(torch_scene, threads=1), bansho.open(torch_scene, threads=3)
    backward = [many.render(number).linear for number in (3, 2, 1, 0)][::-1]
    for frame, expected in zip(one.frames(), backward, strict=True):
        assert np.array_equal(frame.linear, expected)
        assert frame.linear.flags.owndata or frame.linear.base is not None


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
    assert {figure.phenomenon for figure in frame.figures} >= {"rain"}
    lights = frame.lights
    assert lights and all(light.phenomenon == "flame_sheet" and light.kind == "point" and light.intensity > 0 for light in lights)
    assert frame.camera.world_from_camera[:3, 3] == pytest.approx([0.3, 1.2, 4.0])
    assert np.allclose(frame.camera.world_from_camera[:3, :3].T @ frame.camera.world_from_camera[:3, :3], np.eye(3))
    assert np.array_equal(np.asarray(Image.open(io.BytesIO(frame._repr_png_()))), frame.display())


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
    with pytest.raises(ValueError, match="a frame number of type str"):
        bansho.open(torch_scene).render("1")
