"""Arguments that are wrong: each is a `ValueError` that says what was given and what is allowed."""

import numpy as np
import pytest

import bansho

IMAGE = np.full((18, 32, 3), 60, np.uint8)
DEPTH = np.full((18, 32), 9.0, np.float32)
RAGGED = [[400, 0, 16], [0, 400], [0, 0, 1]]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"image": "photograph.jpg"}, "image: a str; allowed: an array of numbers"),
        ({"image": [[1, 2], [3]]}, "image: a list .*; allowed: an array of numbers of one shape"),
        ({"strength": [1]}, r'strength: \[1\]; allowed: "physical", or a number above 0 up to 20'),
        ({"strength": "strong"}, "strength: 'strong'; allowed: \"physical\", or a number"),
        ({"strength": float("nan")}, 'strength: nan; allowed: "physical", or a number'),
        ({"strength": None, "visibility": ["augment"]}, r"visibility: \['augment'\]; allowed: "),
        ({"strength": None, "visibility": "augment", "exposure_s": 0}, "exposure_s: 0.0; allowed: a number of seconds above 0"),
        ({"exposure_s": "long"}, "exposure_s: 'long'; allowed: a number"),
        ({"exposure_s": float("nan")}, "exposure_s: nan; allowed: a number"),
        ({"camera": RAGGED}, r"camera: \[\[400, 0, 16\], .*; allowed: a matrix K"),
        ({"camera": "K"}, "camera: 'K'; allowed: a matrix K"),
        ({"camera": [["f", 0, 1]] * 3}, "camera: .*; allowed: a matrix K"),
        ({"pose": "level"}, "pose: 'level'; allowed: 4 x 4"),
        ({"pose": [[1, 0], [0]]}, r"pose: \[\[1, 0\], \[0\]\]; allowed: 4 x 4"),
        ({"pose": np.eye(3)}, r"pose: an array of shape \(3, 3\); allowed: 4 x 4"),
        ({"wind": ((1, 2), 3)}, r"wind: .*; allowed: \(x, y, z\)"),
        ({"wind": "west"}, r"wind: 'west'; allowed: \(x, y, z\)"),
        ({"wind": (1, float("inf"), 0)}, "wind: inf; allowed: a number"),
        ({"gust": "strong"}, "gust: 'strong'; allowed: a number"),
        ({"depth_scale": "x"}, "depth_scale: 'x'; allowed: a number of meters"),
        ({"depth_scale": float("nan")}, "depth_scale: nan; allowed: a number of meters"),
        ({"depth_scale": 0.0}, "depth_scale: 0 is out of range; allowed: 0.000001 to 1000000 m"),
        ({"rate_mm_per_h": [5, 20]}, r"rate_mm_per_h: \[5, 20\]; allowed: a number"),
        ({"image": np.stack([IMAGE] * 3), "depth": None, "rate_mm_per_h": [5, 20]}, r"rate_mm_per_h: an array of shape \(2,\) for 3 images; allowed: a number, or one for each image"),
        ({"image": np.stack([IMAGE] * 2), "depth": None, "rate_mm_per_h": "heavy"}, "rate_mm_per_h: 'heavy'; allowed: a number, or one for each image"),
        ({"image": np.stack([IMAGE] * 2), "rate_mm_per_h": [[5], [6, 7]]}, "rate_mm_per_h: .*; allowed: a number, or one for each image"),
        ({"seed": "7"}, "seed: '7'; allowed: a whole number"),
        ({"threads": "all"}, "threads: 'all'; allowed: 1 to 1024"),
        ({"threads": 1.5}, "threads: 1.5; allowed: 1 to 1024"),
        ({"parameters": "distance"}, r"parameters: 'distance'; allowed: a dict of keys of \[\[rain\]\]"),
        ({"exposure_ev100": None}, "exposure_ev100: None; allowed: a number"),
    ],
)
def test_wrong_arguments_of_rain(arguments, message):
    with pytest.raises(ValueError, match=message):
        bansho.rain(**{"image": IMAGE, "depth": DEPTH, "strength": "physical", **arguments})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: bansho.rain_scene("big"), "size: 'big'; allowed: 2 whole numbers of pixels, none below 0"),
        (lambda: bansho.rain_scene(None), r"size: None; allowed: \(height, width\)"),
        (lambda: bansho.open({}, size="big"), "size: 'big'; allowed: 2 whole numbers of pixels"),
        (lambda: bansho.open({}, size=64), "size: 64; allowed: 2 whole numbers of pixels"),
        (lambda: bansho.open({}, size=(64, "x")), "size: 'x'; allowed: 2 whole numbers of pixels"),
        (lambda: bansho.open({}, crop=(0, 0, 8)), r"crop: \(0, 0, 8\); allowed: 4 whole numbers of pixels"),
        (lambda: bansho.open({}, seed="x"), "seed: 'x'; allowed: a whole number"),
        (lambda: bansho.open({}, loop_s="x"), "loop_s: 'x'; allowed: a number of seconds"),
        (lambda: bansho.fog(IMAGE, DEPTH, "thick"), "visibility_m: 'thick'; allowed: a number"),
        (lambda: bansho.fog(IMAGE, DEPTH, depth_scale="x"), "depth_scale: 'x'; allowed: a number of meters"),
        (lambda: bansho.fog(IMAGE, DEPTH, camera=RAGGED), "camera: .*; allowed: a matrix K"),
        (lambda: bansho.rain_stereo(IMAGE, IMAGE, baseline_m="wide"), "baseline_m: 'wide'; allowed: a number"),
        (lambda: bansho.augment_strength("x"), "exposure_s: 'x'; allowed: a number of seconds above 0"),
        (lambda: bansho.datasets.RainPairs([IMAGE], per_image="two"), "per_image: 'two'; allowed: 1 or more"),
        (lambda: bansho.datasets.AllSkyAurora(1.5), "count: 1.5; allowed: 1 or more"),
        (lambda: next(bansho.datasets.iterate([1], workers="all")), "workers: 'all'; allowed: 0 or more"),
        (lambda: bansho.open({}, seed=-1), "seed: -1; allowed: a whole number from 0 to 9e15"),
        (lambda: bansho.Effect(bansho.FlameSheet(), seed=-1), "seed: -1; allowed: a whole number from 0 to 9e15"),
        (lambda: bansho.Effect(bansho.FlameSheet(), max_steps=-1), "max_steps: -1; allowed: a whole number above 0"),
        (lambda: bansho.Effect(bansho.FlameSheet(), size=(8, 8)).set_size(-1, 4), "width: -1; allowed: a whole number from 1 to 65536"),
        (lambda: bansho.open({"flame_sheet": [{}]}, size=(8, 8)).render(2**70), "a frame number: 1180591620717411303424; allowed: a whole number"),
        (lambda: bansho.streaks(size=-1), "size: -1; allowed: 1 to 65536 pixels"),
        (lambda: bansho.streaks(size=3.5), "size: 3.5; allowed: 1 to 65536 pixels"),
        (lambda: bansho.streaks(seed=-1), "seed: -1; allowed: a whole number from 0 to 9e15"),
        (lambda: bansho.aurora_emission(np.array([1e3, 2e3])), r"energy_ev: array\(\[1000., 2000.\]\); allowed: a number"),
        (lambda: bansho.drop_sizes("x"), "rate_mm_per_h: 'x'; allowed: a number"),
        (lambda: bansho.rain(IMAGE.astype(np.int32)), "image: an array of int32; allowed: uint8 .sRGB., float16"),
        (lambda: bansho.labels.boxes([1]), r"mask: an array of shape \(1,\); allowed: \(height, width\)"),
        (lambda: bansho.transforms.Rain((5, 500)), r"rate_mm_per_h: \(5, 500\); allowed: rates above 0, up to 300"),
        (lambda: bansho.transforms.Rain(exposure_s=0), "exposure_s: 0; allowed: times above 0 s"),
        # At once, not by the first call in a worker process.
        (lambda: bansho.transforms.Rain(visibility="x"), 'visibility: .x.; allowed: "physical", "augment"'),
        (lambda: bansho.transforms.Rain(strength=500), "strength: 500; allowed: "),
        (lambda: bansho.transforms.Rain(threads="x"), "threads: 'x'; allowed: 1 to 1024"),
        (lambda: bansho.datasets.RainPairs([IMAGE], seed=-1), "seed: -1; allowed: a whole number from 0 to 9e15"),
        (lambda: bansho.datasets.AllSkyAurora(1, seed=1.5), "seed: 1.5; allowed: a whole number from 0 to 9e15"),
        (lambda: bansho.datasets.AllSkyAurora(1, energy_ev=(-1, 5)), r"energy_ev: \(-1, 5\); allowed: numbers above 0"),
        (lambda: bansho.rain(IMAGE[None], seed=-1, strength=1), "seed: -1; allowed: a whole number from 0 to 9e15"),
        (lambda: bansho.rain(IMAGE, pose=np.zeros((0, 4, 4)), strength=1), r"pose: an array of shape \(0, 4, 4\); allowed: 4 x 4"),
        (lambda: bansho.rain(IMAGE, pose=np.full((4, 4), np.nan), strength=1), "pose: a matrix with a value that is not finite"),
        (lambda: bansho.open(bansho.FlameSheet(), size=(8, 8)).display(0, bits=300), "bits: 300; allowed: 8, 16"),
        (lambda: bansho.open({}, arrays=[1]), "arrays: a list; allowed: a dict of arrays"),
        (lambda: bansho.Scene(7), "a scene of 7; allowed: tables such as bansho.Rain"),
        (lambda: bansho.Scene([bansho.Camera(), bansho.Camera()]), "two tables `camera` in a scene; allowed: one"),
        (lambda: bansho.Scene({}).add(bansho.RainSplashes()), "a RainSplashes; allowed: a table of a scene"),
        (lambda: bansho.Effect(bansho.FlameSheet(), size=(8, 4)).depth(np.zeros((4, 8), np.float32, order="F")), "out: pixels that are not one after the other"),
        (lambda: bansho.Effect(bansho.FlameSheet()).advance(2**2000), "dt: .*; allowed: a number of seconds"),
        (lambda: bansho.labels.rle(["x"]), "mask: a list; allowed: an array of numbers"),
    ],
)
def test_wrong_arguments_of_others(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    "call",
    [
        lambda: bansho.transforms.Rain(foo=1),
        lambda: bansho.transforms.Fog(foo=1),
        lambda: bansho.datasets.RainPairs([IMAGE], foo=1),
    ],
)
def test_options_that_do_not_exist_are_told_at_once(call):
    with pytest.raises(TypeError, match="unknown option 'foo'; allowed: camera, pose"):
        call()


def test_every_pair_has_rain():
    with pytest.raises(TypeError, match="unknown option 'p': every pair has rain"):
        bansho.datasets.RainPairs([IMAGE], p=0.25)


def test_no_pictures_make_none():
    assert bansho.rain(np.zeros((0, 9, 9, 3), np.uint8), strength=1, truth=True)[1] == []
    assert bansho.rain(np.zeros((0, 9, 9, 3), np.uint8), strength=1).shape == (0, 9, 9, 3)


def test_numbers_of_any_byte_order_are_numbers():
    light = np.random.default_rng(1).random((18, 32, 3), np.float32)
    assert np.array_equal(bansho.rain(light.astype(">f4"), strength=5), bansho.rain(light, strength=5))


class NoBuffer:
    """Has DLPack, and refuses."""

    def __dlpack__(self, **options):
        raise BufferError("it lies on another device")

    def __dlpack_device__(self):
        return (2, 0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda effect: effect.linear(out=object()), r"out: a object \(.*\); allowed: an array \(height, width, 4\) of float32 in main memory"),
        (lambda effect: effect.linear(out=[0.0] * 4), r"out: a list \(.*\); allowed: an array \(height, width, 4\) of float32"),
        (lambda effect: effect.linear(out=NoBuffer()), r"out: a NoBuffer \(.*\); allowed: an array"),
        (lambda effect: effect.depth(out="depth"), r"out: a str \(.*\); allowed: an array \(height, width\) of float32"),
        (lambda effect: effect.display(out=bytes(40 * 30 * 4)), "out: cannot be written; allowed: a writable array"),
        (lambda effect: effect.set_wind("west"), r"velocity: 'west'; allowed: \(x, y, z\)"),
        (lambda effect: effect.set_wind(3), r"velocity: an array of shape \(\); allowed: \(x, y, z\)"),
        (lambda effect: effect.set_wind((1, 0, 0), gust="strong"), "gust: 'strong'; allowed: a number"),
        (lambda effect: effect.advance("1/60"), "dt: '1/60'; allowed: a number of seconds"),
        (lambda effect: effect.at(None), "seconds: None; allowed: a number of seconds"),
        (lambda effect: effect.set_size("big", 3), "width: 'big'; allowed: a whole number"),
        (lambda effect: effect.set_exposure_ev100("bright"), "exposure_ev100: 'bright'; allowed: a number"),
        (lambda effect: effect.move_to("flame_sheet", (1, 2)), r"position: an array of shape \(2,\); allowed: \(x, y, z\)"),
        (lambda effect: effect.set_flow("flame_sheet", "full"), "flow: 'full'; allowed: a number"),
        (lambda effect: bansho.Effect(bansho.FlameSheet(), size="big"), "size: 'big'; allowed: 2 whole numbers of pixels"),
        (lambda effect: bansho.Effect(bansho.FlameSheet(), max_steps=1.5), "max_steps: 1.5; allowed: a whole number above 0"),
    ],
)
def test_wrong_arguments_of_an_effect(call, message):
    effect = bansho.Effect(bansho.FlameSheet(), size=(40, 30))
    with pytest.raises(ValueError, match=message):
        call(effect)
    assert effect.advance(1 / 60) == 0
