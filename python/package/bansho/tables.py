"""Keyword builders of all tables of a scene, `bansho.FlameSheet(width=0.4)`, and of the tables within them, `bansho.RainSplashes(fraction=0.2)`.

The classes are made from the descriptors of the library; `tables.pyi` is generated from the same descriptors by `python -m bansho.stubs`, so that editors
complete and explain them. There is no second list.
"""

from __future__ import annotations

import difflib
import inspect
import keyword
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from . import _bansho

__all__ = ["SceneTable"]


class SceneTable:
    """A table of a scene: its keys and values. Values are checked when the table becomes part of a scene."""

    key: str = ""
    """Its name in scene files."""
    is_list: bool = False
    """Whether a scene may have many of it."""
    parameters: tuple[str, ...] = ()
    """The keys that it may have."""
    _inner: Mapping[str, type[SceneTable]] = {}
    """The builders of those keys that are tables, or lists of tables."""

    __slots__ = ("_values",)

    def __init__(self, **values: Any) -> None:
        values = {key.removesuffix("_"): value for key, value in values.items()}
        for key in values:
            if key not in self.parameters:
                nearest = difflib.get_close_matches(key, self.parameters, n=1)
                hint = f", did you mean `{nearest[0]}`?" if nearest else ""
                raise TypeError(f"{type(self).__name__}: unknown key `{key}`{hint}; allowed: {', '.join(self.parameters)}")
        self._values = {key: self._checked(key, value) for key, value in values.items() if value is not None}

    def _checked(self, key: str, value: Any) -> Any:
        """A value, with the keys of tables in it checked."""
        builder = self._inner.get(key)
        if builder is None:
            return value
        if isinstance(value, Mapping):
            return builder(**value)
        if isinstance(value, Sequence) and not isinstance(value, str):
            return [builder(**item) if isinstance(item, Mapping) else item for item in value]
        return value

    def to_dict(self) -> dict[str, Any]:
        """The keys that are stated, with their values."""
        return {key: _plain(value) for key, value in self._values.items()}

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and other._values == self._values  # type: ignore[attr-defined]

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{key}={value!r}' for key, value in self._values.items())})"


def _plain(value: Any) -> Any:
    """A value with dictionaries in place of builders."""
    if isinstance(value, SceneTable):
        return value.to_dict()
    return [_plain(item) for item in value] if isinstance(value, list) else value


def class_name(key: str) -> str:
    """`flame_sheet` as `FlameSheet`."""
    return "".join(word.capitalize() for word in key.split("_"))


def keyword_name(key: str) -> str:
    """A key as a keyword argument: `from`, which is a word of Python, as `from_`."""
    return f"{key}_" if keyword.iskeyword(key) else key


def inner_class_name(outer: str, parameter: dict[str, Any]) -> str:
    """Name of the builder of a table within another: `RainSplashes`; of one of a list `AuroraShape`."""
    name = outer + class_name(parameter["key"])
    return name.removesuffix("s") if parameter["is_list"] else name


def described_tables() -> Iterator[tuple[str, dict[str, Any]]]:
    """Every table with the name of its builder: those of a scene, each after the tables within it."""
    for table in _bansho.table_descriptors():
        yield from _with_inner(class_name(table["key"]), table)


def _with_inner(name: str, table: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for parameter in table["parameters"]:
        if parameter["table"] is not None:
            inner = {"key": "", "is_list": parameter["is_list"], "is_phenomenon": False, **parameter["table"]}
            yield from _with_inner(inner_class_name(name, parameter), inner)
    yield name, table


def parameter_lines(parameter: dict[str, Any]) -> str:
    """What is said about a parameter: its description, unit, what is allowed, and its default."""
    unit = f" [{parameter['unit']}]" if parameter["unit"] else ""
    default = "" if parameter["default"] is None else f" Default: {parameter['default']!r}."
    choices = "".join(f" `{name}`: {doc}" for name, doc in parameter["choices"])
    return f"{parameter['doc']}{unit} Allowed: {parameter['allowed']}.{default}{choices}"


def common_parameters(table: dict[str, Any]) -> list[dict[str, Any]]:
    """The keys that every phenomenon has, before its own."""
    if not table["is_phenomenon"]:
        return []
    name = {"key": "name", "doc": "Unique name; names its layers.", "type": "str", "allowed": "a string without dots"}
    enabled = {"key": "enabled", "doc": "Whether it is drawn.", "type": "bool", "allowed": "true or false"}
    common = {"unit": "", "default": None, "choices": [], "is_for_paper": False, "table": None, "is_list": False}
    return [{**common, **name}, {**common, **enabled, "default": True}]


def all_parameters(table: dict[str, Any]) -> list[dict[str, Any]]:
    """All keys of a table."""
    return common_parameters(table) + table["parameters"]


def _builder(name: str, table: dict[str, Any]) -> type[SceneTable]:
    parameters = all_parameters(table)
    lines = "\n".join(f"{parameter['key']}:\n    {parameter_lines(parameter)}" for parameter in parameters)
    namespace = {
        "__doc__": f"{table['doc']}\n\n{lines}\n",
        "__module__": __name__,
        "__slots__": (),
        "key": table["key"],
        "is_list": table["is_list"],
        "parameters": tuple(parameter["key"] for parameter in parameters),
        "_inner": {
            parameter["key"]: globals()[inner_class_name(name, parameter)] for parameter in parameters if parameter["table"] is not None
        },
    }
    # What notebooks complete and show; checks are those of `SceneTable`.
    keywords = [inspect.Parameter(keyword_name(parameter["key"]), inspect.Parameter.KEYWORD_ONLY, default=None) for parameter in parameters]
    namespace["__signature__"] = inspect.Signature(keywords)
    return type(name, (SceneTable,), namespace)


for _name, _table in described_tables():
    globals()[_name] = _builder(_name, _table)
    __all__.append(_name)
