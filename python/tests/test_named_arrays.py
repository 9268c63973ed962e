"""Arrays in place of the files of a scene: each is what the scene uses it for."""

import numpy as np
import pytest

import bansho

SIZE = (36, 64)


def drawn(image, depth=None, **plate):
    tables = {"picture": {"size": [SIZE[1], SIZE[0]]}, "plate": {"image": "p.png", **plate}, "fog": {"visibility_m": 80.0}}
    arrays = {"p.png": image}
    if depth is not None:
        tables["plate"]["depth"], arrays["d.npy"] = "d.npy", depth
    return bansho.open(tables, arrays=arrays).display(0)


@pytest.mark.parametrize("shape", [SIZE, (*SIZE, 1)])
def test_a_gray_image_is_an_image_and_nothing_is_read_from_the_disk(shape, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    depth = np.full(SIZE, 20.0, np.float32)
    gray = np.full(shape, 250, np.uint8)
    assert np.array_equal(drawn(gray, depth), drawn(np.full((*SIZE, 3), 250, np.uint8), depth))


def test_a_depth_may_have_one_channel_and_integers_need_a_scale():
    image = np.full((*SIZE, 3), 120, np.uint8)
    meters = drawn(image, np.full(SIZE, 20.0, np.float32))
    assert np.array_equal(drawn(image, np.full((*SIZE, 1), 20.0)), meters)
    millimeters = np.full(SIZE, 20_000, np.uint16)
    assert np.array_equal(drawn(image, millimeters, depth_scale=0.001), meters)
    with pytest.raises(ValueError, match="d.npy: an array of uint16 without depth_scale; allowed: plate.depth_scale in meters"):
        drawn(image, millimeters)
    with pytest.raises(ValueError, match=r"d.npy: an array of shape \(36, 64, 3\); allowed: \(height, width\)"):
        drawn(image, np.zeros((*SIZE, 3)))


@pytest.mark.parametrize(("options", "origin"), [({"crop": (10, 5, 20, 12)}, (10, 5)), ({"overscan": True}, (-8, -8)), ({"overscan": False}, (0, 0))])
def test_a_camera_is_that_of_the_pixels_of_the_light(options, origin):
    tables = {"picture": {"size": [64, 36], "overscan": 8}, "camera": {"shift": [0.1, -0.05]}, "flame_sheet": [{}]}
    whole = bansho.open(tables, overscan=False).render(0)
    shot = bansho.open(tables, **options)
    frame = shot.render(0)
    camera = frame.camera
    assert camera.size == frame.linear.shape[1::-1] == shot.camera(0).size
    point = np.array([[0.3, 1.1, -0.4]])
    assert np.allclose(camera.project(point)[0, :2] + origin, whole.camera.project(point)[0, :2])
    # The same pixels, where both have them.
    x, y = max(origin[0], 0), max(origin[1], 0)
    own = frame.linear[y - origin[1] :, x - origin[0] :][:10, :20]
    assert np.array_equal(own, whole.linear[y : y + 10, x : x + 20])
