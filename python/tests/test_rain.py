"""Rain and fog over pictures: physics, coherence, bad input."""

import subprocess
import warnings
from pathlib import Path

import numpy as np
import pytest

import bansho

# Its name before numpy 2.
trapezoid = getattr(np, "trapezoid", None) or np.trapz

PLATES = Path(__file__).parents[2] / "scenes" / "plates"
K = np.array([[400.0, 0.0, 159.5], [0.0, 400.0, 89.5], [0.0, 0.0, 1.0]])


def flat(value: int = 60, size: tuple[int, int] = (180, 320)) -> np.ndarray:
    return np.full((*size, 3), value, np.uint8)


def test_attenuation_follows_the_rain_rate():
    """The light that passes rain of rate R over a distance d is exp(-beta d): beta by Marshall and Palmer's drops alone, integrated here."""
    diameters = np.linspace(0, 20, 200_001)
    for rate in (2.0, 10.0, 50.0, 100.0):
        density = 8000 * np.exp(-4.1 * rate**-0.21 * diameters)
        beta = trapezoid(density * np.pi / 4 * (1e-3 * diameters) ** 2, diameters)
        for distance in (50.0, 200.0):
            depth = np.full((180, 320), distance, np.float32)
            _, truth = bansho.rain(flat(), depth, rate_mm_per_h=rate, camera=K, depth_kind="distance", truth=True, strength="physical")
            measured = -np.log(truth.transmission.mean(dtype=np.float64)) / distance
            assert measured == pytest.approx(beta, rel=0.02), f"{rate} mm/h, {distance} m"


def test_a_picture_is_dimmed_as_its_truth_says():
    """What airlight adds is the same everywhere, so the difference of two pictures falls by the transmission alone."""
    depth = np.full((180, 320), 150.0, np.float32)
    options = {"rate_mm_per_h": 60.0, "camera": K, "strength": "physical", "truth": True, "seed": 5}
    bright = np.full((180, 320, 3), 0.30, np.float32)
    bright[::2] = 0.10
    mixed, truth = bansho.rain(bright, depth, **options)
    contrast = (mixed[1::2] - mixed[::2])[..., 1] / 0.20
    assert contrast.mean() == pytest.approx(truth.transmission.mean(), rel=0.02)


def streak_lengths(exposure_s: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Lengths of streaks in a picture, and those that the drops should have, pixels."""
    camera = [[900, 0, 239.5], [0, 900, 359.5], [0, 0, 1]]
    scene = bansho.rain_scene((720, 480), rate_mm_per_h=0.3, camera=camera, exposure_s=exposure_s, seed=seed, depth=False)
    frame = bansho.open(scene, aovs=True, arrays={"image": flat(60, (720, 480))}).render(0)
    opacity = np.asarray(frame.aovs["rain.streak_opacity"])
    measured, expected = [], []
    camera = frame.camera
    drops = frame.drops
    pixels = camera.project(drops["position"])
    speeds = bansho.terminal_velocity(drops["diameter_mm"].astype(float))
    for (x, y, depth), speed in zip(pixels, speeds, strict=True):
        length = 900 * speed * exposure_s / depth
        column = int(round(x))
        if not (2 <= column < 478 and 0.6 * length + 4 < y < 716 - 0.6 * length) or not 1.0 < depth < 4.0:
            continue
        near = opacity[:, column - 1 : column + 2].sum(axis=1)
        # Alone in its columns.
        if (abs(pixels[:, 0] - x) < 4).sum() > 1:
            continue
        # The streak's opacity is even along its axis, so that sum over maximum is its length.
        plateau = np.median(near[int(y - 0.3 * length) : int(y + 0.3 * length) + 1])
        measured.append(near.sum() / plateau)
        expected.append(length)
    return np.array(measured), np.array(expected)


def test_streaks_are_as_long_as_drops_fall_during_the_exposure():
    for exposure in (1 / 125, 1 / 60, 1 / 30):
        pictures = [streak_lengths(exposure, seed) for seed in range(1, 13)]
        measured, expected = (np.concatenate(lengths) for lengths in zip(*pictures, strict=True))
        assert len(measured) >= 5
        assert measured == pytest.approx(expected, rel=0.02), f"{exposure} s"


def test_terminal_velocities_are_those_of_gunn_and_kinzer():
    # Gunn and Kinzer (1949), table 2.
    assert bansho.terminal_velocity([0.5, 1.0, 2.0, 3.0, 5.0]) == pytest.approx([2.06, 4.03, 6.49, 8.06, 9.09], rel=0.02)


def test_the_same_arguments_give_the_same_bytes_whatever_came_before(photograph):
    depth = np.linspace(5, 60, 180, dtype=np.float32)[:, None].repeat(320, 1)
    options = {"rate_mm_per_h": 30.0, "seed": 9, "strength": 4.0, "wind": (2.0, 0.0, 1.0), "gust": 0.5}
    first = bansho.rain(photograph, depth, **options)
    bansho.rain(255 - photograph, depth, **{**options, "seed": 10, "wind": (-5.0, 0.0, 0.0)})
    bansho.fog(photograph, depth, 50.0)
    assert np.array_equal(bansho.rain(photograph, depth, **options), first)
    assert np.array_equal(bansho.rain(photograph, depth, threads=1, **options), first)
    assert np.array_equal(bansho.rain(photograph, depth, truth=True, **options)[0], first)
    assert not np.array_equal(bansho.rain(photograph, depth, **{**options, "seed": 10}), first)


def test_rain_is_the_frame_of_its_scene_and_the_programs_picture(photograph, tmp_path, request):
    image = pytest.importorskip("PIL.Image")
    depth = np.full((180, 320), 40.0, np.float32)
    options = {"rate_mm_per_h": 50.0, "camera": K, "seed": 3, "strength": 3.0, "exposure_s": 1 / 100}
    rainy = bansho.rain(photograph, depth, **options)
    scene = bansho.rain_scene((180, 320), **options)
    assert np.array_equal(bansho.open(scene, arrays={"image": photograph, "depth": depth}).display(0, alpha=None), rainy)
    image.fromarray(photograph).save(tmp_path / "image.png")
    np.save(tmp_path / "depth.npy", depth)
    scene.update({"plate.image": "image.png", "plate.depth": "depth.npy"})
    scene.save(tmp_path / "rain.toml")
    bansho.open(bansho.Scene.load(tmp_path / "rain.toml")).write(tmp_path / "job.####.png", frames=0)
    assert np.array_equal(np.asarray(image.open(tmp_path / "job.0000.png").convert("RGB")), rainy)
    program = request.getfixturevalue("program")
    command = [*program, "render", str(tmp_path / "rain.toml"), "--frames", "0", "--out", str(tmp_path / "p.####.png")]
    subprocess.run(command, check=True, capture_output=True)
    assert (tmp_path / "p.0000.png").read_bytes() == (tmp_path / "job.0000.png").read_bytes()


def test_no_rain_changes_no_pixel(photograph):
    assert np.array_equal(bansho.rain(photograph, rate_mm_per_h=0.0, strength="physical"), photograph)


def test_physical_rain_by_day_is_hardly_seen_and_augmented_rain_is():
    # A bright sky, and in front of what is dark the drops that refract it. The camera is far enough from them.
    image, depth = flat(80), np.full((180, 320), 15.0, np.float32)
    image[:70] = 200
    physical = bansho.rain(image, depth, strength="physical").astype(int) - image
    augmented = bansho.rain(image, depth, visibility="augment").astype(int) - image
    assert np.median(np.abs(physical)) <= 2 and np.abs(physical).max() <= 12
    assert augmented[70:].std() > 4 * physical[70:].std() and augmented[70:].max() > 20
    assert 8 < bansho.augment_strength(1 / 60) < 14 and bansho.augment_strength(1 / 2000) == 1.0


@pytest.mark.parametrize("name", ["court", "garden"])
def test_20_mm_per_h_are_hardly_seen_on_a_plate_by_day(name):
    image = pytest.importorskip("PIL.Image")
    with image.open(PLATES / f"{name}.jpg") as picture:
        plate = np.asarray(picture.convert("RGB"))
    depth = np.full(plate.shape[:2], 20.0, np.float32)
    physical, augmented = (np.abs(bansho.rain(plate, depth, rate_mm_per_h=20, **options).astype(int) - plate) for options in ({"strength": "physical"}, {"visibility": "augment"}))
    # Of 255 codes. Airlight and streaks together: most pixels change by less than is seen, and hardly one by more than the grain of a photograph.
    assert np.median(physical) <= 3 and np.percentile(physical, 99) <= 10
    assert np.percentile(augmented, 99) > 4 * np.percentile(physical, 99) and np.percentile(augmented, 99) > 40


def test_the_transmission_of_the_medium_is_apart_from_that_of_streaks():
    """All pixels are as far, so that the medium passes the same everywhere as where there is no streak, also where many streaks overlap."""
    depth = np.full((180, 320), 5.0, np.float32)
    for strength in (1.0, 5.0, 20.0):
        _, truth = bansho.rain(flat(), depth, rate_mm_per_h=100, depth_kind="distance", truth=True, strength=strength, exposure_s=1 / 200)
        free = truth.streak_opacity == 0
        medium = truth.transmission[free].mean(dtype=np.float64)
        assert 1000 < free.sum() < 20_000 and np.ptp(truth.transmission[free]) < 1e-3
        assert np.abs(truth.medium_transmission[free] - truth.transmission[free]).max() < 1e-5
        assert np.abs(truth.medium_transmission - medium).max() < 1e-3
        # What streaks pass is a product over them, at least one minus the sum of their opacities and at most e to the power of minus it.
        streaks = truth.transmission / truth.medium_transmission
        assert (streaks > 1 - truth.streak_opacity - 1e-4).all() and (streaks < np.exp(-truth.streak_opacity) + 1e-4).all()


def test_the_strength_of_the_default_is_said_once():
    bansho.weather._noticed = False
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        bansho.rain(flat(), rate_mm_per_h=5)
        bansho.rain(flat(), rate_mm_per_h=5)
        bansho.rain(flat(), rate_mm_per_h=5, strength="physical")
    assert [warning.category for warning in caught] == [bansho.PhysicalStrengthNotice]
    assert caught[0].filename == __file__


def test_depth_hides_drops(photograph):
    wall, far = np.full((180, 320), 1.0, np.float32), np.full((180, 320), 50.0, np.float32)
    options = {"rate_mm_per_h": 50.0, "truth": True, "strength": "physical"}
    behind = bansho.rain(photograph, far, **options)[1].streak_depth
    front = bansho.rain(photograph, wall, **options)[1].streak_depth
    assert front.max() <= 1.0 < behind.max()
    inverse = bansho.rain(photograph, 100 / far, depth_kind="inverse", depth_scale=100.0, **options)[1]
    assert np.allclose(inverse.transmission, bansho.rain(photograph, far, **options)[1].transmission, atol=1e-6)
    millimeters = (1000 * far).astype(np.uint16)
    assert np.array_equal(bansho.rain(photograph, millimeters, depth_scale=0.001, **options)[1].streak_depth, behind)


def test_linear_light_stays_linear():
    light = np.full((90, 160, 3), 0.18, np.float32)
    drawn = bansho.rain(light, np.full((90, 160), 10.0), rate_mm_per_h=5, strength="physical")
    assert drawn.dtype == np.float32 and drawn.shape == light.shape
    assert np.abs(drawn - light).max() < 0.05


def test_drops_of_a_stereo_pair_are_the_same_drops():
    image, depth = flat(), np.full((180, 320), 30.0, np.float32)
    (_, left), (_, right) = bansho.rain_stereo(image, image, depth, depth, baseline_m=0.2, camera=K, rate_mm_per_h=5, truth=True, strength="physical", exposure_s=1 / 500)
    checked = 0
    for y, x in zip(*np.nonzero((left.streak_opacity > 0.02) & (left.streak_depth > 0.8)), strict=True):
        disparity = 400 * 0.2 / left.streak_depth[y, x]
        if x - disparity < 2:
            continue
        column = int(round(x - disparity))
        near = right.streak_depth[y, max(column - 2, 0) : column + 3]
        seen = near[near > 0]
        # Another streak may be in front.
        if seen.size and abs(seen - left.streak_depth[y, x]).min() < 0.01:
            checked += 1
        else:
            assert seen.size and seen.min() < left.streak_depth[y, x], (x, y)
    assert checked > 20


def test_drops_of_a_video_go_on_falling():
    fps = 240.0
    images = [flat()] * 4
    poses = np.stack([np.eye(4)] * 4)
    poses[:, 1, 3] = 1.6
    # The camera falls with 4 m/s, and drops of 1 mm fall as fast.
    poses[:, 1, 3] -= 4.03 / fps * np.arange(4)
    options = {"fps": fps, "camera": K, "rate_mm_per_h": 20, "truth": True, "strength": "physical", "exposure_s": 1e-4, "parameters": {"diameters_mm": [1.0]}}
    moving = [truth for _, truth in bansho.rain_video(images, poses=poses, **options)]
    still = [truth for _, truth in bansho.rain_video(images, **options)]
    stay = [np.mean(frames[0].streak_mask & frames[3].streak_mask) / np.mean(frames[0].streak_mask) for frames in (moving, still)]
    assert stay[0] > 0.5 and stay[0] > 3 * stay[1]
    again = [truth for _, truth in bansho.rain_video(images, **options)]
    assert all(np.array_equal(a.streak_opacity, b.streak_opacity) for a, b in zip(again, still, strict=True))


def test_every_picture_of_a_batch_has_rain_of_its_own(photograph):
    batch = np.stack([photograph] * 3)
    rainy = bansho.rain(batch, rate_mm_per_h=(5, 20, 80), strength=10.0, seed=2)
    assert rainy.shape == batch.shape and not np.array_equal(rainy[0], rainy[1])
    alone = bansho.rain(photograph, rate_mm_per_h=20, strength=10.0, seed=bansho.derived_seed(2, 1))
    assert np.array_equal(rainy[1], alone)


def test_fog_has_the_contrast_of_koschmieder():
    image = np.full((90, 160, 3), 0.30, np.float32)
    image[:, ::2] = 0.10
    for visibility in (100.0, 400.0):
        depth = np.full((90, 160), 50.0, np.float32)
        foggy = bansho.fog(image, depth, visibility, depth_kind="distance")
        contrast = (foggy[:, 1::2] - foggy[:, ::2])[..., 1].mean() / 0.20
        assert contrast == pytest.approx(0.02 ** (50.0 / visibility), rel=0.02)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"image": np.zeros((5, 5), np.uint8)}, r"image: an array of shape \(5, 5\); allowed: \(height, width, 3\)"),
        ({"image": np.zeros((5, 5, 3), np.int32)}, "image: an array of int32; allowed: uint8"),
        ({"image": np.full((5, 5, 3), np.nan, np.float32)}, "an image with the value NaN; allowed: finite"),
        ({"depth": np.full((180, 320), np.nan)}, "a depth with the value NaN; allowed: 0 or more"),
        ({"depth": np.full((180, 320), -1.0)}, "a depth with the value -1; allowed: 0 or more"),
        ({"depth": np.zeros((10, 10))}, "depth: 10 x 10 pixels have another shape than the image, 180 x 320"),
        ({"depth": np.ones((180, 320), np.uint16)}, "depth: an array of uint16 without depth_scale; allowed: depth_scale in meters"),
        ({"depth": np.ones((180, 320)), "depth_kind": "inverse"}, "an inverse depth without depth_scale"),
        ({"depth": np.ones((180, 320)), "depth_kind": "disparity"}, "depth_kind: 'disparity'; allowed: \"axis\""),
        ({"depth_kind": "disparity"}, "depth_kind: 'disparity'; allowed: \"axis\""),
        ({"camera": np.eye(4)}, r"camera: an array of shape \(4, 4\); allowed: a matrix K"),
        ({"camera": np.diag([-400.0, 400, 1])}, "is no camera; allowed: a matrix K"),
        ({"camera": np.diag([400.0, 300, 1])}, "focal lengths of 400 and 300 pixels; allowed: equal ones"),
        ({"camera": np.diag([np.inf, 300, 1])}, "not finite"),
        ({"rate_mm_per_h": 500}, "500 is out of range; allowed: 0 to 300 mm/h"),
        ({"rate_mm_per_h": "heavy"}, "rate_mm_per_h: 'heavy'; allowed: a number"),
        ({"exposure_s": -1}, "shutter_s"),
        ({"wind": (1, 2)}, r"wind: an array of shape \(2,\); allowed: \(x, y, z\)"),
        ({"seed": 1.5}, "seed: 1.5; allowed: a whole number"),
        ({"seed": -1}, "seed.*allowed: 0 to"),
        ({"strength": 50}, 'strength: 50; allowed: "physical", or a number above 0 up to 20'),
        ({"strength": 2, "visibility": "augment"}, "allowed: one of both"),
        ({"visibility": "good"}, "visibility: 'good'; allowed: "),
        ({"pose": np.ones((4, 4))}, "is no rotation with a translation; allowed: 4 x 4"),
        ({"parameters": {"distanec": 3}}, "unknown key `distanec`, did you mean `distance`"),
        ({"threads": -1}, "threads: -1; allowed: 1 to 1024"),
    ],
)
def test_bad_input_is_told_what_is_allowed(arguments, message):
    arguments = {"image": flat(), "strength": None if "visibility" in arguments else "physical", **arguments}
    with pytest.raises(ValueError, match=message):
        bansho.rain(**arguments)


def test_fog_needs_a_depth():
    with pytest.raises(ValueError, match="depth: None; allowed: an array"):
        bansho.fog(flat(), None)
