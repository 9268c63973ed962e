"""Keyword builders of all tables of a scene: `bansho.FlameSheet(width=0.4)`.

The classes are made from the descriptors of the library; `tables.pyi` is generated from the same descriptors by `python -m bansho.stubs`, so that editors
complete and explain them. There is no second list.
"""

from __future__ import annotations

import difflib
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

    __slots__ = ("_values",)

    def __init__(self, **values: Any) -> None:
        for key in values:
            if key not in self.parameters:
                nearest = difflib.get_close_matches(key, self.parameters, n=1)
                hint = f", did you mean `{nearest[0]}`?" if nearest else ""
                raise TypeError(f"{type(self).__name__}: unknown key `{key}`{hint}; allowed: {', '.join(self.parameters)}")
        self._values = {key: value for key, value in values.items() if value is not None}

    def to_dict(self) -> dict[str, Any]:
        """The keys that are stated, with their values."""
        return dict(self._values)

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and other._values == self._values  # type: ignore[attr-defined]

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{key}={value!r}' for key, value in self._values.items())})"


def class_name(key: str) -> str:
    """`flame_sheet` as `FlameSheet`."""
    return "".join(word.capitalize() for word in key.split("_"))


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
    common = {"unit": "", "default": None, "choices": [], "is_for_paper": False}
    return [{**common, **name}, {**common, **enabled, "default": True}]


def all_parameters(table: dict[str, Any]) -> list[dict[str, Any]]:
    """All keys of a table."""
    return common_parameters(table) + table["parameters"]


def _builder(table: dict[str, Any]) -> type[SceneTable]:
    parameters = all_parameters(table)
    lines = "\n".join(f"{parameter['key']}:\n    {parameter_lines(parameter)}" for parameter in parameters)
    namespace = {
        "__doc__": f"{table['doc']}\n\n{lines}\n",
        "__module__": __name__,
        "__slots__": (),
        "key": table["key"],
        "is_list": table["is_list"],
        "parameters": tuple(parameter["key"] for parameter in parameters),
    }
    return type(class_name(table["key"]), (SceneTable,), namespace)


for _table in _bansho.table_descriptors():
    _class = _builder(_table)
    globals()[_class.__name__] = _class
    __all__.append(_class.__name__)
