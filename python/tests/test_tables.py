"""The keyword builders and their stub are those of the descriptors."""

import inspect
import ast
from pathlib import Path

import pytest

import bansho
from bansho import _bansho, stubs, tables


def test_the_stub_is_the_one_of_the_descriptors():
    stub = Path(__file__).parents[1] / "package" / "bansho" / "tables.pyi"
    ast.parse(stub.read_text(encoding="utf-8"))
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


def test_tables_within_tables_have_builders_whose_keys_are_checked():
    inner = [name for name, table in tables.described_tables() if not table["key"]]
    assert {"RainSplashes", "FlameParticlesCombustion", "AuroraShape"} <= set(inner) and len(inner) >= 20
    splashes = bansho.RainSplashes(fraction=0.2)
    assert "fraction:" in splashes.__doc__
    rain = bansho.Rain(rate_mm_per_h=30, splashes=splashes)
    assert rain == bansho.Rain(rate_mm_per_h=30, splashes={"fraction": 0.2})
    assert rain.to_dict() == {"rate_mm_per_h": 30, "splashes": {"fraction": 0.2}}
    assert bansho.Scene([rain])["rain.splashes.fraction"] == 0.2
    assert bansho.AuroraShapeLink(from_=1).to_dict() == {"from": 1}
    for wrong in (lambda: bansho.RainSplashes(fractoin=0.2), lambda: bansho.Rain(splashes={"fractoin": 0.2})):
        with pytest.raises(TypeError, match="RainSplashes: unknown key `fractoin`, did you mean `fraction`.*allowed: "):
            wrong()


def test_a_builder_of_defaults_makes_a_scene():
    for table in _bansho.table_descriptors():
        builder = getattr(bansho, "".join(word.capitalize() for word in table["key"].split("_")))
        assert bansho.Scene([builder()]).to_toml()


def test_builders_have_a_signature_that_notebooks_complete():
    parameters = inspect.signature(bansho.FlameSheet).parameters
    assert list(parameters) == list(bansho.FlameSheet.parameters) and "width" in parameters
    assert all(parameter.kind is inspect.Parameter.KEYWORD_ONLY for parameter in parameters.values())
