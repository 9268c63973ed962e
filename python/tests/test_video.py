"""Cameras of others, and rain over videos: K, poses, sequences and iterators."""

import numpy as np
import pytest

import bansho

SIZE = (180, 320)
K = np.array([[400.0, 0.0, 159.5], [0.0, 400.0, 89.5], [0.0, 0.0, 1.0]])


def flat(value: int = 60, size: tuple[int, int] = SIZE) -> np.ndarray:
    return np.full((*size, 3), value, np.uint8)


def turned(degrees: float, position: tuple[float, float, float]) -> np.ndarray:
    """A level camera, turned to the left."""
    angle = np.radians(degrees)
    pose = np.eye(4)
    pose[:3, :3] = [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]
    pose[:3, 3] = position
    return pose


def test_a_principal_point_off_center_moves_streaks_as_opencv_does():
    camera = np.array([[400.0, 0.0, 205.0], [0.0, 400.0, 55.0], [0.0, 0.0, 1.0]])
    scene = bansho.rain_scene(SIZE, rate_mm_per_h=5, camera=camera, exposure_s=1 / 2000, seed=2, depth=False)
    frame = bansho.open(scene, aovs=True, arrays={"image": flat()}).render(0)
    assert frame.camera.K == pytest.approx(camera, abs=1e-6)
    # By hand: the camera is 1.6 m above the ground and looks along -z; x of OpenCV is to the right, y down, z forward.
    x, y, z = frame.drops["position"].T
    pixels = np.column_stack([400.0 * x / -z + 205.0, 400.0 * (1.6 - y) / -z + 55.0])
    opacity = np.asarray(frame.aovs["rain.streak_opacity"])
    near = [(int(round(column)), int(round(row))) for column, row in pixels[-z > 0.5] if 1 <= column < 318 and 1 <= row < 178]
    hits = sum(opacity[row - 1 : row + 2, column - 1 : column + 2].max() > 0 for column, row in near)
    assert len(near) > 100 and hits > 0.97 * len(near)


def test_the_pose_of_a_frame_is_that_of_the_middle_of_its_exposure():
    poses = np.stack([turned(10.0 * number, (0.5 * number, 1.6, -0.2 * number**2)) for number in range(4)])
    for exposure in (1 / 500, 1 / 60, 1 / 15):
        scene = bansho.rain_scene(SIZE, camera=K, pose=poses, exposure_s=exposure, fps=30, frames=4, depth=False)
        shot = bansho.open(scene, arrays={"image": flat()})
        for number, pose in enumerate(poses):
            assert shot.camera(number).world_from_camera == pytest.approx(pose, abs=1e-6), (exposure, number)


def test_the_camera_moves_on_before_the_first_pose_and_after_the_last():
    poses = np.stack([turned(5.0 * number, (0.5 * number, 1.6, -0.25 * number)) for number in range(3)])
    scene = bansho.rain_scene(SIZE, pose=poses, exposure_s=1 / 60, fps=30, frames=3, depth=False)
    keys = scene["camera.position"]["keys"]
    assert [time for time, _ in keys] == pytest.approx([1 / 120 + number / 30 for number in range(-1, 4)])
    assert [place for _, place in keys] == pytest.approx(np.array([[0.5 * number, 1.6, -0.25 * number] for number in range(-1, 4)]))
    forward = np.array([place for _, place in scene["camera.target"]["keys"]]) - [place for _, place in keys]
    assert forward / 10 == pytest.approx(np.array([-turned(5.0 * number, (0, 0, 0))[:3, 2] for number in range(-1, 4)]))


def test_drops_that_fall_with_the_camera_are_points_in_every_frame():
    fps = 60.0
    poses = np.stack([np.eye(4)] * 3)
    # Drops of 1 mm fall with 4.03 m/s, and the camera as fast.
    poses[:, 1, 3] = 1.6 - 4.03 / fps * np.arange(3)
    options = {"fps": fps, "camera": K, "rate_mm_per_h": 5, "truth": True, "strength": "physical", "exposure_s": 0.9 / fps, "parameters": {"diameters_mm": [1.0]}}
    covered = [[np.count_nonzero(truth.streak_opacity > 1e-4) for _, truth in bansho.rain_video([flat()] * 3, poses=path, **options)] for path in (poses, None)]
    for number, (moving, still) in enumerate(zip(*covered, strict=True)):
        assert moving < 0.5 * still, f"frame {number}: {moving} of {still} pixels"


def test_iterators_give_what_sequences_give(photograph):
    images = [photograph, 255 - photograph, photograph[::-1].copy()]
    depths = [np.full(SIZE, distance, np.float32) for distance in (10, 20, 30)]
    poses = np.stack([turned(2.0 * number, (0.1 * number, 1.6, 0)) for number in range(3)])
    options = {"fps": 30, "rate_mm_per_h": 20, "strength": 5.0, "seed": 3}
    for path in (poses, None):
        expected = list(bansho.rain_video(images, depths, poses=path, **options))
        given = None if path is None else iter(path)
        lazily = list(bansho.rain_video(iter(images), (depth for depth in depths), poses=given, **options))
        assert len(lazily) == 3 and all(np.array_equal(*pair) for pair in zip(lazily, expected, strict=True))
    of_arrays = list(bansho.rain_video(np.stack(images), np.stack(depths), **options))
    assert all(np.array_equal(*pair) for pair in zip(of_arrays, expected, strict=True))


def test_images_are_asked_for_when_they_are_drawn(photograph):
    asked = []

    def images():
        for number in range(3):
            asked.append(number)
            yield photograph

    frames = bansho.rain_video(images(), fps=30, strength=5.0)
    next(frames)
    assert asked == [0]
    assert len(list(frames)) == 2 and asked == [0, 1, 2]


def test_images_and_depths_that_do_not_fit_are_told():
    def draw(images, depths=None, **options):
        return list(bansho.rain_video(images, depths, **{"fps": 30, "strength": "physical", **options}))

    poses, plane = np.stack([turned(0, (0, 1.6, 0))] * 2), np.full(SIZE, 9.0)
    for call, message in [
        (lambda: draw([]), "images: none; allowed: one or more"),
        (lambda: draw(iter([])), "images: none; allowed: one or more"),
        (lambda: draw(5), "images: a int; allowed: a sequence"),
        (lambda: draw([flat(), flat(size=(90, 160))]), r"images: image 1 has the shape \(90, 160, 3\); allowed: 180 x 320 pixels, as the first"),
        (lambda: draw([flat(), "x"]), "image 1: a str; allowed: an array of numbers"),
        (lambda: draw([flat()] * 3, [plane] * 2), "depth: 2 of them for 3 images; allowed: one, or one for each"),
        (lambda: draw(iter([flat()] * 3), iter([plane] * 2)), "depths: 2 of them, and more images; allowed: one for each image"),
        (lambda: draw(iter([flat()]), iter([])), "depths: none; allowed: one for each image, or None"),
        (lambda: draw([flat()] * 2, [plane, None]), "depths: image 1 is without one, unlike the first"),
        (lambda: draw([flat()] * 2, [None, plane]), "depths: image 1 is with one, unlike the first"),
        (lambda: draw([flat()] * 3, poses=poses), r"poses: an array of shape \(2, 4, 4\); allowed: \(3, 4, 4\), one for each image"),
        (lambda: draw(iter([flat()] * 3), poses=poses), "images: more than 2; allowed: one for each pose"),
        (lambda: draw(iter([flat()]), poses=iter(poses)), "images: 1 for 2 poses; allowed: one for each pose"),
        (lambda: draw([flat()], poses="left"), r"poses: 'left'; allowed: an array \(N, 4, 4\)"),
        (lambda: draw([flat()], poses=[[1, 2], [3]]), r"poses: .*; allowed: an array \(N, 4, 4\)"),
        (lambda: draw([flat()], fps="fast"), "fps: 'fast'; allowed: a number above 0"),
        (lambda: draw([flat()], fps=0), "fps: 0; allowed: a number above 0"),
        (lambda: draw([flat()], fps=float("nan")), "fps: nan; allowed: a number above 0"),
    ]:
        with pytest.raises(ValueError, match=message):
            call()
