"""Scenes: text, paths, errors."""

import pickle

import numpy as np
import pytest

import bansho

TEXT = """\
bansho = 2   # the format

[picture]
size = [320, 180]

[[rain]]   # a shower
name = "shower"
rate_mm_per_h = 5.0   # light

[[flame_sheet]]
[[flame_sheet]]
name = "torch"
height = 2.0
"""


def test_values_are_read_by_path_number_and_name():
    scene = bansho.Scene.parse(TEXT)
    assert scene["rain.rate_mm_per_h"] == scene["rain.0.rate_mm_per_h"] == scene["rain.shower.rate_mm_per_h"] == 5.0
    assert scene["flame_sheet.1.height"] == scene["flame_sheet.torch.height"] == 2.0
    assert scene["picture.size"] == [320, 180]
    assert scene["picture.fps"] == 30, "the default"
    assert scene["camera.glare"] is None, "optional, and not stated"
    assert scene.to_dict()["rain"][0] == {"name": "shower", "rate_mm_per_h": 5.0}


def test_changes_keep_comments_and_lines():
    scene = bansho.Scene.parse(TEXT)
    scene["rain.shower.rate_mm_per_h"] = 20
    scene["picture.size"] = np.array([640, 360])
    assert scene.to_toml() == TEXT.replace("5.0   # light", "20   # light").replace("[320, 180]", "[640, 360]")
    del scene["rain.rate_mm_per_h"]
    assert scene["rain.rate_mm_per_h"] == 10.0
    assert "# a shower" in scene.to_toml()
    scene.add(bansho.Fog(visibility_m=300))
    scene.add(bansho.FlameSheet(name="candle"))
    assert scene["fog.visibility_m"] == 300 and scene["flame_sheet.candle.name"] == "candle"
    scene.add(bansho.Fog())
    assert scene["fog.visibility_m"] == 500 and "\n[fog]\n" in scene.to_toml()


def test_an_error_has_the_programs_words_line_key_and_what_is_allowed():
    with pytest.raises(bansho.SceneError) as caught:
        bansho.Scene.parse(TEXT.replace("rate_mm_per_h = 5.0", "rate_mm_per_h = 2000.0"), name="wet.toml")
    error = caught.value
    assert (error.line, error.column, error.key, error.allowed) == (8, 17, "rain.0.rate_mm_per_h", "0 to 300 mm/h")
    assert str(error).startswith("wet.toml:8:17: rain.0.rate_mm_per_h: 2000 is out of range; allowed: 0 to 300 mm/h\n")
    assert isinstance(error, ValueError)
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.problems) == (str(error), error.problems)


def test_all_problems_are_told_at_once():
    with pytest.raises(bansho.SceneError) as caught:
        bansho.Scene.parse("bansho = 2\n[picture]\nview = 'agxx'\nsiez = 3\n")
    problems = caught.value.problems
    assert {problem.line for problem in problems} == {3, 4}
    assert any("agx" in problem.choices for problem in problems)
    assert any("did you mean `size`?" in problem.message for problem in problems)


def test_a_refused_change_changes_nothing():
    scene = bansho.Scene.parse(TEXT)
    for path, value in [("rain.rate_mm_per_h", -1), ("rain.raet", 1), ("rian.rate_mm_per_h", 1), ("picture.size", "wide"), ("rain.rate_mm_per_h", object())]:
        with pytest.raises(ValueError):
            scene[path] = value
        assert scene.to_toml() == TEXT
    with pytest.raises(bansho.SceneError, match="rian.*rain"):
        scene["rian.rate_mm_per_h"] = 3
    with pytest.raises(bansho.SceneError, match="available: .*rate_mm_per_h"):
        scene["rain.nothing"]


def test_tables_that_contradict_each_other_are_set_together():
    scene = bansho.Scene.parse("bansho = 2\n[[rain]]\n")
    scene.update({"picture.frames": 3, "picture.first_frame": 10})
    assert bansho.open(scene, size=(16, 16)).range == (10, 13)


def test_a_scene_of_tables_is_a_scene_of_text(torch_scene):
    again = bansho.Scene.parse(torch_scene.to_toml())
    assert again.to_dict() == torch_scene.to_dict() == {
        "bansho": 2,
        "picture": {"size": [96, 64], "frames": 4},
        "flame_sheet": [{"width": 0.5, "height": 0.9}],
    }
    assert bansho.Scene(torch_scene.to_dict()).to_dict() == torch_scene.to_dict()
    assert pickle.loads(pickle.dumps(torch_scene)) == torch_scene
    with pytest.raises(bansho.SceneError):
        bansho.Scene({"picture": {"size": [0, 1]}})


def test_files_are_read_and_missing_ones_named(tmp_path):
    path = tmp_path / "wet.toml"
    bansho.Scene.parse(TEXT).save(path)
    assert bansho.Scene.load(path).to_toml() == TEXT
    with pytest.raises(FileNotFoundError, match="wett.toml.*did you mean .*wet.toml"):
        bansho.Scene.load(tmp_path / "wett.toml")


def test_tables_and_values_that_are_stated_are_in_a_scene():
    scene = bansho.Scene.parse("bansho = 2\n[fog]\nvisibility_m = 80.0\n[[rain]]\nsplashes = { fraction = 0.2 }\n[[rain]]\nname = \"far\"\n")
    assert list(scene) == ["bansho", "fog", "rain"]
    assert all(path in scene for path in ("fog", "fog.visibility_m", "rain", "rain.0.splashes.fraction", "rain.1.name"))
    assert not any(path in scene for path in ("camera", "fog.visibility", "rain.2", "rain.1.splashes", "rain.0.splashes.fraction.x"))
    scene["rain.0.diameters_mm"] = [0.5]
    assert "rain.0.diameters_mm.0" in scene and not any(path in scene for path in ("rain.0.diameters_mm.1", "rain.0.diameters_mm.x"))
    scene.add(bansho.Camera())
    del scene["rain.1"]
    assert "camera" in scene and "rain.splashes" in scene


def test_one_of_several_tables_is_selected_by_number_or_name():
    scene = bansho.Scene([bansho.FlameSheet(height=1.6), bansho.FlameSheet(name="torch", height=2.0)])
    assert scene["flame_sheet.torch.height"] == 2.0 and "flame_sheet.torch.height" in scene
    for path in ("flame_sheet.height", "flame_sheet.lamp.height"):
        with pytest.raises(bansho.SceneError, match="0 to 1 or .*torch"):
            scene[path]
        with pytest.raises(bansho.SceneError, match="0 to 1 or .*torch"):
            del scene[path]
        assert path not in scene
    # All of them.
    scene["flame_sheet.height"] = 3.0
    assert scene["flame_sheet.0.height"] == scene["flame_sheet.torch.height"] == 3.0
    del scene["flame_sheet.torch.height"]
    assert scene["flame_sheet.0.height"] == 3.0 and "flame_sheet.torch.height" not in scene


def test_what_takes_a_scene_takes_tables():
    size = {"size": (16, 9)}
    expected = bansho.open(bansho.Scene([bansho.FlameSheet()]), **size).render(0).linear
    for tables in (bansho.FlameSheet(), [bansho.FlameSheet()], {"flame_sheet": [{}]}, bansho.Scene(bansho.FlameSheet())):
        assert np.array_equal(bansho.open(tables, **size).render(0).linear, expected)


@pytest.mark.parametrize("number", [float("nan"), float("-inf"), np.float32("nan"), np.float64("inf")])
def test_a_number_that_is_not_finite_is_refused_and_changes_nothing(number):
    scene = bansho.Scene.parse(TEXT)
    with pytest.raises(ValueError, match=r"the number (nan|-?inf|np\.float64\(inf\)); allowed: finite numbers"):
        scene["rain.shower.rate_mm_per_h"] = number
    assert scene.to_toml() == TEXT
