"""Effects that follow a program's time."""

import numpy as np
import pytest

import bansho


def test_an_effect_draws_what_a_shot_draws(torch_scene):
    effect = bansho.Effect(torch_scene, backdrop=True)
    effect.at(1 / 30)
    light = effect.linear(space="acescg")
    scene = torch_scene.copy()
    scene["camera.glare"] = 0.0
    assert np.allclose(light, bansho.open(scene).render(1).linear, atol=1e-6)
    assert effect.time_s == pytest.approx(1 / 30)


def test_it_writes_into_the_callers_memory():
    torch = bansho.Effect(bansho.FlameSheet(width=0.4), size=(40, 30))
    pixels = np.full((30, 40, 4), -1, np.float32)
    torch.advance(1 / 60)
    assert torch.linear(pixels) is pixels and pixels[..., 3].min() >= 0 and pixels.max() > 0
    codes = bytearray(30 * 40 * 4)
    view = np.frombuffer(codes, np.uint8).reshape(30, 40, 4)
    torch.display(view)
    assert any(codes)
    assert torch.depth().shape == (30, 40) and np.isinf(torch.depth()).any()


def test_wind_camera_and_flames_change_live():
    effect = bansho.Effect([bansho.FlameSheet(name="torch"), bansho.Rain(rate_mm_per_h=5)], size=(40, 30))
    before = effect.linear()
    effect.set_wind((3, 0, 0), gust=0.5)
    for _ in range(30):
        assert effect.advance(1 / 60) == 0
    assert effect.wind[0] == pytest.approx((3, 0, 0)) and effect.wind[1] == pytest.approx(0.5)
    effect.set_camera(position=(0.0, 1.0, 8.0), vertical_fov_deg=50.0)
    effect.extinguish("torch")
    effect.set_rain_rate(50)
    for _ in range(60):
        effect.advance(1 / 60)
    assert effect.linear()[..., 0].sum() < 0.5 * before[..., 0].sum()
    effect.set_size(20, 10)
    assert effect.linear().shape == (10, 20, 4)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda effect: effect.set_wind((500, 0, 0)), "wind.velocity: 500 is out of range; allowed: -100 to 100 m/s"),
        (lambda effect: effect.advance(float("nan")), "dt: NaN s is out of range; allowed: "),
        (lambda effect: effect.ignite("candle"), "there is no phenomenon `candle`; allowed: flame_sheet"),
        (lambda effect: effect.set_camera(targets=(0, 0, 0)), "unknown key `targets`, did you mean `target`"),
        (lambda effect: effect.linear(np.zeros((3, 3, 4), np.float32)), r"an array of shape \[3, 3, 4\]; allowed: \(30, 40, 4\)"),
        (lambda effect: effect.linear(np.zeros((30, 40, 4), np.float64)), "out: an array of float64; allowed: float32"),
        (lambda effect: effect.aov("heat"), "no channel `heat`"),
        (lambda effect: effect.linear(space="srgb"), 'space: "srgb"; allowed: "acescg", "linear_srgb"'),
    ],
)
def test_bad_input_is_told_what_is_allowed(call, message):
    effect = bansho.Effect(bansho.FlameSheet(), size=(40, 30))
    with pytest.raises(ValueError, match=message):
        call(effect)
    assert effect.advance(1 / 60) == 0
