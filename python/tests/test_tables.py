"""The keyword builders and their stub are those of the descriptors."""

from pathlib import Path

import pytest

import bansho
from bansho import _bansho, stubs


def test_the_stub_is_the_one_of_the_descriptors():
    stub = Path(__file__).parents[1] / "package" / "bansho" / "tables.pyi"
    assert stub.read_text(encoding="utf-8") == stubs.stub(), "run `python -m bansho.stubs python/package/bansho/tables.pyi`"


def test_every_table_has_a_builder_that_explains_its_keys():
    for table in _bansho.table_descriptors():
        builder = getattr(bansho, "".join(word.capitalize() for word in table["key"].split("_")))
        assert builder.key == table["key"]
        for parameter in table["parameters"]:
            assert parameter["key"] in builder.parameters
            assert parameter["doc"] in builder.__doc__ and parameter["allowed"] in builder.__doc__


def test_unknown_keys_are_refused_with_those_that_are_allowed():
    with pytest.raises(TypeError, match="unknown key `heigth`, did you mean `height`.*allowed: .*width"):
        bansho.FlameSheet(heigth=0.4)
    assert bansho.FlameSheet(width=0.4, height=None).to_dict() == {"width": 0.4}


def test_a_builder_of_defaults_makes_a_scene():
    for table in _bansho.table_descriptors():
        builder = getattr(bansho, "".join(word.capitalize() for word in table["key"].split("_")))
        assert bansho.Scene([builder()]).to_toml()
