"""Data sets, transforms and labels."""

import json

import numpy as np
import pytest

import bansho
from bansho import datasets, labels, transforms


@pytest.fixture(scope="module")
def pairs():
    random = np.random.default_rng(4)
    images = [random.integers(0, 256, (48, 64, 3), dtype=np.uint8) for _ in range(3)]
    depths = [np.full((48, 64), distance, np.float32) for distance in (5, 20, 80)]
    return datasets.RainPairs(images, depths, per_image=2, seed=7, truth=True, rate_mm_per_h=(5, 50))


def test_an_item_follows_from_seed_and_index_alone(pairs):
    assert len(pairs) == 6
    backward = [pairs[index] for index in reversed(range(6))][::-1]
    for index, item in enumerate(backward):
        again = pairs[index]
        assert all(np.array_equal(item[key], again[key]) for key in item), index
        assert 5 <= item["rate_mm_per_h"] <= 50
        assert np.array_equal(item["clean"], pairs.images[index // 2])
    assert not np.array_equal(backward[0]["rainy"], backward[1]["rainy"])
    other = datasets.RainPairs(pairs.images, pairs.depths, per_image=2, seed=8, rate_mm_per_h=(5, 50))
    assert not np.array_equal(other[0]["rainy"], backward[0]["rainy"])


def test_one_and_four_workers_make_the_same_data(pairs):
    own = list(datasets.iterate(pairs, workers=0))
    for workers in (1, 4):
        for item, expected in zip(datasets.iterate(pairs, workers=workers), own, strict=True):
            assert all(np.array_equal(item[key], expected[key]) for key in expected), workers


def test_a_loader_of_torch_takes_the_pairs(pairs):
    data = pytest.importorskip("torch.utils.data")
    loader = data.DataLoader(pairs, batch_size=2, num_workers=2)
    rainy = np.concatenate([batch["rainy"].numpy() for batch in loader])
    assert np.array_equal(rainy, np.stack([pairs[index]["rainy"] for index in range(6)]))


def test_all_sky_auroras_have_kilorayleighs():
    auroras = datasets.AllSkyAurora(2, size=64, seed=1, particles=2000)
    item = auroras[1]
    assert item["image"].shape == (64, 64, 4) and item["kilorayleigh_557"].max() > 0.1
    assert all(np.array_equal(item[key], auroras[1][key]) for key in item)
    # As bright as electrons of that energy make the green line, somewhere on the sky, within what the slant of a sheet adds.
    column = bansho.aurora_emission(item["energy_ev"], item["flux_mw_per_m2"])
    green = column.kilorayleigh[abs(column.wavelength_nm - 557.7) < 0.5][0]
    assert 0.05 * green < item["kilorayleigh_557"].max() < 40 * green


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
    with pytest.raises(ValueError, match="rate_mm_per_h: .*allowed: a number, or"):
        transforms.Rain(rate_mm_per_h=(50, 5))


def test_it_works_in_a_pipeline_of_albumentations(photograph):
    albumentations = pytest.importorskip("albumentations")
    rain = transforms.Rain(rate_mm_per_h=(20, 20)).as_albumentations()
    pipeline = albumentations.Compose([albumentations.HorizontalFlip(p=1.0), rain], seed=3)
    result = pipeline(image=photograph)["image"]
    assert result.shape == photograph.shape and not np.array_equal(result, photograph[:, ::-1])


def test_parts_of_a_mask_are_boxes():
    mask = np.zeros((6, 8), bool)
    mask[0, 0] = mask[1, 1] = mask[2, 0] = True
    mask[3:6, 4:7] = True
    mask[4, 5] = False
    assert labels.boxes(mask) == [labels.Box(4, 3, 3, 3, 8), labels.Box(0, 0, 2, 3, 3)]
    assert labels.boxes(mask, min_area=4) == [labels.Box(4, 3, 3, 3, 8)]
    assert labels.yolo({"rain": mask}, min_area=4) == "2 0.687500 0.750000 0.375000 0.500000\n"
    record = labels.coco([("a.png", {"fire": mask})])
    assert json.loads(json.dumps(record)) == record
    decoded = np.zeros(mask.size, bool)
    for annotation in record["annotations"]:
        ends = np.cumsum(annotation["segmentation"]["counts"])
        part = np.zeros(mask.size, bool)
        for start, end in zip(ends[::2], ends[1::2], strict=False):
            part[start:end] = True
        assert part.sum() == annotation["area"]
        decoded |= part
    assert np.array_equal(decoded.reshape(mask.shape, order="F"), mask)


def test_every_part_is_found_whatever_its_form():
    random = np.random.default_rng(0)
    for _ in range(20):
        mask = random.random((23, 31)) < 0.4
        todo = {(int(y), int(x)) for y, x in zip(*np.nonzero(mask), strict=True)}
        areas = []
        while todo:
            stack, area = [todo.pop()], 0
            while stack:
                y, x = stack.pop()
                area += 1
                near = {(y + dy, x + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1)} & todo
                todo -= near
                stack.extend(near)
            areas.append(area)
        assert sorted(areas, reverse=True) == [box.area for box in labels.boxes(mask)]


def test_fire_and_rain_are_labeled():
    scene = bansho.Scene([bansho.Picture(size=(96, 64)), bansho.FlameSheet(smoke={"optical_depth": 1.0}), bansho.Rain(rate_mm_per_h=50)])
    frame = bansho.open(scene, aovs=True).render(3)
    fire = labels.mask(frame, "fire")
    assert fire.any() and (np.asarray(frame.aovs["flame_sheet.temperature_k"])[fire] >= 800).all()
    assert labels.mask(frame, "rain", 0.001).sum() > labels.mask(frame, "rain", 0.01).sum()
    assert not (labels.mask(frame, "smoke") & fire).any()
    with pytest.raises(ValueError, match="category: 'snow'; allowed: 'fire'"):
        labels.mask(frame, "snow")
    with pytest.raises(ValueError, match="no AOV of aurora; allowed: .*aovs=True"):
        labels.mask(frame, "aurora")
