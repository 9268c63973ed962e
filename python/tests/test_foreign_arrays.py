"""Arrays of other libraries: read and written in place, by DLPack or the buffer protocol."""

import array

import numpy as np
import pytest

import bansho

SIZE = (36, 48)


class OnlyDlpack:
    """An array of a library that numpy does not know: it has DLPack and nothing else."""

    def __init__(self, values: np.ndarray, refuses: bool = False):
        self.values, self.refuses = values, refuses

    def __dlpack__(self, **options):
        if self.refuses:
            raise BufferError("it lies on another device")
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.values.__dlpack_device__()


@pytest.fixture
def inputs() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(3)
    return random.integers(0, 256, (*SIZE, 3), dtype=np.uint8), np.full(SIZE, 20.0, np.float32)


def rainy(image, depth) -> np.ndarray:
    return bansho.rain(image, depth, rate_mm_per_h=20, seed=1, strength=5)


def test_arrays_by_dlpack_give_the_rain_of_arrays_of_numpy(inputs):
    image, depth = inputs
    before = image.copy()
    assert np.array_equal(rainy(OnlyDlpack(image), OnlyDlpack(depth)), rainy(image, depth))
    assert np.array_equal(image, before), "inputs are only read"
    with pytest.raises(ValueError, match=r"image: cannot be read by DLPack \(it lies on another device\); allowed: an array in main memory"):
        rainy(OnlyDlpack(image, refuses=True), depth)


@pytest.mark.skipif(np.lib.NumpyVersion(np.__version__) < "2.1.0", reason="what numpy before 2.1 reads by DLPack is read-only")
def test_an_effect_writes_into_an_array_of_dlpack():
    effect = bansho.Effect(bansho.FlameSheet(width=0.4), size=(SIZE[1], SIZE[0]))
    effect.advance(1 / 60)
    light = np.zeros((*SIZE, 4), np.float32)
    effect.linear(OnlyDlpack(light))
    assert np.array_equal(light, effect.linear())


def test_an_effect_writes_into_the_memory_of_others():
    effect = bansho.Effect(bansho.FlameSheet(width=0.4), size=(SIZE[1], SIZE[0]))
    effect.advance(1 / 60)
    codes = array.array("B", bytes(SIZE[0] * SIZE[1] * 4))
    effect.display(memoryview(codes).cast("B", (*SIZE, 4)))
    assert np.array_equal(np.frombuffer(codes, np.uint8).reshape(*SIZE, 4), effect.display())
    # Memory without a shape has that of the picture.
    flat = bytearray(SIZE[0] * SIZE[1] * 4)
    effect.display(flat)
    assert bytes(flat) == bytes(codes)
    depths = array.array("f", bytes(SIZE[0] * SIZE[1] * 4))
    effect.depth(depths)
    assert np.array_equal(np.frombuffer(depths, np.float32).reshape(SIZE), effect.depth())


def test_tensors_of_torch_are_read_and_written(inputs):
    torch = pytest.importorskip("torch")
    image, depth = (torch.from_numpy(values.copy()) for values in inputs)
    assert np.array_equal(rainy(image, depth), rainy(*inputs))
    with pytest.raises(ValueError, match=r"image: cannot be read by DLPack .*allowed: an array in main memory"):
        rainy(image.float().requires_grad_(), depth)
    effect = bansho.Effect(bansho.FlameSheet(width=0.4), size=(SIZE[1], SIZE[0]))
    light = torch.zeros((*SIZE, 4))
    effect.linear(light)
    assert np.array_equal(light.numpy(), effect.linear()) and light.max() > 0


def test_tensors_of_kornia_are_channels_first_and_turned_before(inputs):
    kornia = pytest.importorskip("kornia")
    image, depth = inputs
    tensor = kornia.image.image_to_tensor(image)
    with pytest.raises(ValueError, match=r"image: an array of shape \(3, 36, 48\); allowed: \(height, width, 3\)"):
        rainy(tensor, depth)
    assert np.array_equal(rainy(tensor.permute(1, 2, 0), depth), rainy(image, depth))
