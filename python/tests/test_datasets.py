"""Data sets."""

import numpy as np
import pytest

import bansho
from bansho import datasets


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
