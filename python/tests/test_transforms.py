"""Transforms: what they draw, worker processes, albumentations."""

import multiprocessing
import pickle

import numpy as np
import pytest

from bansho import transforms, weather

IMAGE = np.full((48, 64, 3), 90, np.uint8)


def test_a_transform_takes_and_returns_named_arrays(photograph):
    transform = transforms.Rain(rate_mm_per_h=(5, 50), seed=1)
    depth = np.full((180, 320), 30.0, np.float32)
    result = transform(image=photograph, depth=depth, mask="kept")
    assert result["mask"] == "kept" and result["depth"] is depth and result["image"].shape == photograph.shape
    assert not np.array_equal(transform(image=photograph, depth=depth)["image"], result["image"]), "another call"
    again = transforms.Rain(rate_mm_per_h=(5, 50), seed=1)(image=photograph, depth=depth)
    assert np.array_equal(again["image"], result["image"])
    assert transforms.Rain(p=0.0)(image=photograph)["image"] is photograph
    assert transforms.Fog((20, 50))(image=photograph, depth=depth)["image"].std() < photograph.std()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rate_mm_per_h": (50, 5)}, r"rate_mm_per_h: \(50, 5\); allowed: a number, or \(low, high\)"),
        ({"rate_mm_per_h": "heavy"}, r"rate_mm_per_h: 'heavy'; allowed: a number, or \(low, high\)"),
        ({"rate_mm_per_h": (1, 2, 3)}, r"rate_mm_per_h: \(1, 2, 3\); allowed: a number, or \(low, high\)"),
        ({"rate_mm_per_h": (0, 5)}, "allowed: rates above 0"),
        ({"wind_speed": None}, "wind_speed: None; allowed: a number"),
        ({"p": "often"}, "p: 'often'; allowed: 0 to 1"),
        ({"p": 2}, "p: 2; allowed: 0 to 1"),
        ({"seed": 0.5}, "seed: 0.5; allowed: a whole number"),
        ({"seed": -1}, "seed: -1; allowed: a whole number, 0 or more"),
    ],
)
def test_bad_input_is_told_what_is_allowed(arguments, message):
    with pytest.raises(ValueError, match=message):
        transforms.Rain(**arguments)


def draw_in_worker(transform, queue):
    """Sends two calls of a transform, and with how many threads they were drawn."""
    drawn = [transform(image=IMAGE)["image"] for _ in range(2)]
    queue.put((drawn, [threads for _, _, threads, *_ in weather._cache._shots]))


def drawn_by_worker(transform, name: str):
    context = multiprocessing.get_context("spawn")
    queue = context.Queue()
    process = context.Process(target=draw_in_worker, args=(transform, queue), name=name)
    process.start()
    try:
        return queue.get(timeout=60)
    finally:
        process.join(10)
        process.kill()


def test_each_worker_process_draws_rain_of_its_own_with_one_thread():
    transform = transforms.Rain(rate_mm_per_h=(20, 50), seed=1)
    (first, threads), (second, _), (again, _) = (drawn_by_worker(transform, name) for name in ("Worker-1", "Worker-2", "Worker-1"))
    images = [*first, *second, *(transform(image=IMAGE)["image"] for _ in range(2))]
    assert len({image.tobytes() for image in images}) == 6
    assert all(np.array_equal(*pair) for pair in zip(first, again, strict=True)), "the same worker draws the same"
    assert threads == [1]


class Rainy:
    """A map-style data set of one picture in rain."""

    def __init__(self, length: int):
        self.length, self.transform = length, transforms.Rain(rate_mm_per_h=(20, 50), seed=1)

    def __len__(self):
        return self.length

    def __getitem__(self, index):
        return self.transform(image=IMAGE)["image"]


def test_each_worker_and_epoch_of_torch_has_rain_of_its_own():
    torch = pytest.importorskip("torch")

    def epochs():
        torch.manual_seed(5)
        loader = torch.utils.data.DataLoader(Rainy(4), batch_size=1, num_workers=2)
        return [batch.numpy().tobytes() for _ in range(2) for batch in loader]

    first = epochs()
    assert len(set(first)) == 8
    assert epochs() == first, "torch.manual_seed makes it reproducible"


def test_transforms_are_pickled():
    for transform in (transforms.Rain(rate_mm_per_h=(20, 50), seed=4), transforms.Fog((50, 90), seed=4)):
        transform(image=IMAGE, depth=np.full((48, 64), 20.0))
        copy = pickle.loads(pickle.dumps(transform))
        images = [each(image=IMAGE, depth=np.full((48, 64), 20.0))["image"] for each in (transform, copy)]
        assert np.array_equal(*images) and not np.array_equal(images[0], IMAGE)


def test_it_works_in_a_pipeline_of_albumentations(photograph):
    albumentations = pytest.importorskip("albumentations")
    rain = transforms.Rain(rate_mm_per_h=(20, 20)).as_albumentations()
    pipeline = albumentations.Compose([albumentations.HorizontalFlip(p=1.0), rain], seed=3)
    copy = pickle.loads(pickle.dumps(pipeline))
    result = pipeline(image=photograph)["image"]
    assert result.shape == photograph.shape and not np.array_equal(result, photograph[:, ::-1])
    assert np.array_equal(copy(image=photograph)["image"], result), "a copy by pickle"
    assert not np.array_equal(pipeline(image=photograph)["image"], result), "another call"


def test_albumentations_flips_the_depth_with_the_image():
    albumentations = pytest.importorskip("albumentations")
    fog = transforms.Fog((100, 100)).as_albumentations()
    pipeline = albumentations.Compose([albumentations.HorizontalFlip(p=1.0), fog], additional_targets={"depth": "mask"}, seed=3)
    depth = np.full((48, 64), 1.0, np.float32)
    depth[:, :32] = 500.0
    # What is far is on the left, and on the right after the flip: there a picture of two colors loses its contrast.
    image = IMAGE.copy()
    image[::2] = 30
    result = pipeline(image=image, depth=depth)
    assert np.array_equal(result["depth"], depth[:, ::-1])
    contrast = np.ptp(result["image"].astype(int), axis=0).mean(axis=-1)
    assert contrast[:32].min() > 50 and contrast[32:].max() < 12


def test_floats_of_albumentations_are_encoded(photograph):
    albumentations = pytest.importorskip("albumentations")
    images = []
    for image in (photograph, photograph.astype(np.float32) / 255):
        pipeline = albumentations.Compose([transforms.Rain(rate_mm_per_h=(50, 50)).as_albumentations()], seed=3)
        images.append(pipeline(image=image)["image"])
    codes, floats = images
    assert floats.dtype == np.float32 and floats.min() >= 0 and floats.max() <= 1
    assert np.abs(255 * floats - codes).max() < 0.01 and np.abs(codes.astype(int) - photograph).max() > 20
    # Values between two codes stay where they are if nothing is drawn.
    between = np.linspace(0, 1, 30 * 20 * 3, dtype=np.float32).reshape(20, 30, 3)
    unchanged = transforms.Rain(rate_mm_per_h=1e-9).as_albumentations()(image=between)["image"]
    assert np.array_equal(unchanged, between)


@pytest.mark.parametrize("kind", [np.uint8, np.float32])
def test_alpha_of_albumentations_is_kept(photograph, kind):
    pytest.importorskip("albumentations")
    alpha = np.full(photograph.shape[:2], 77, np.uint8)
    image = np.dstack([photograph, alpha])
    image = image if kind == np.uint8 else image.astype(np.float32) / 255
    result = transforms.Rain(rate_mm_per_h=(50, 50)).as_albumentations()(image=image)["image"]
    assert result.shape == image.shape and result.dtype == kind
    assert np.array_equal(result[..., 3], image[..., 3]) and not np.array_equal(result[..., :3], image[..., :3])
