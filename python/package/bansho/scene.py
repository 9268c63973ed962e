"""Scenes: text with comments, read and changed by path."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from . import _bansho, _checks
from .tables import SceneTable

__all__ = ["Scene"]


class Scene:
    """A scene. It is valid at any time: a change that would make it invalid raises `SceneError` and changes nothing.

    >>> scene = bansho.Scene.parse("bansho = 2\\n[[rain]]  # a shower\\n")
    >>> scene["rain.rate_mm_per_h"] = 20
    >>> scene["rain.rate_mm_per_h"]
    20.0
    """

    __slots__ = ("_folder", "_name", "_text")

    def __init__(self, tables: Mapping[str, Any] | SceneTable | Iterable[SceneTable] = (), *, folder: str | os.PathLike[str] = "") -> None:
        """A scene of tables: a dict as a scene file has it, or builders such as `bansho.Rain(rate_mm_per_h=20)`.

        Paths of files in it count from `folder`.
        """
        if isinstance(tables, SceneTable):
            tables = [tables]
        if not isinstance(tables, Mapping):
            allowed = "tables such as bansho.Rain(...), or a dict"
            if isinstance(tables, (str, bytes)) or not isinstance(tables, Iterable):
                raise ValueError(f"a scene of {_checks.shortened(tables)}; allowed: {allowed}")
            collected: dict[str, Any] = {}
            for table in tables:
                if not isinstance(table, SceneTable):
                    raise ValueError(f"a {type(table).__name__} in a scene; allowed: {allowed}")
                if table.is_list:
                    collected.setdefault(table.key, []).append(table)
                elif table.key in collected:
                    raise ValueError(f"two tables `{table.key}` in a scene; allowed: one")
                else:
                    collected[table.key] = table
            tables = collected
        self._name = "scene"
        self._folder = Path(folder)
        self._text = _bansho.text_of_tables(tables, self._name)

    @classmethod
    def _of_text(cls, text: str, name: str, folder: Path) -> Scene:
        scene = cls.__new__(cls)
        scene._text, scene._name, scene._folder = text, name, folder
        return scene

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """Reads a scene file. Paths of files in it count from its folder."""
        try:
            text, name, folder = _bansho.read_scene(Path(path))
        except OSError as failed:
            if os.path.exists(path):
                raise
            raise FileNotFoundError(*failed.args) from None
        _bansho.check_scene(text, name)
        return cls._of_text(text, name, Path(folder))

    @classmethod
    def parse(cls, text: str, *, name: str = "scene", folder: str | os.PathLike[str] = "") -> Scene:
        """A scene of the text of a scene file; `name` is what messages call it."""
        _bansho.check_scene(text, name)
        return cls._of_text(text, name, Path(folder))

    def __getitem__(self, path: str) -> Any:
        """The value in effect at a dotted path: the one that is stated, else the default, of an optional one `None`.

        A number or a name selects a table of a list, ``rain.0.rate_mm_per_h``; it may be left out where there is only one.
        """
        return _bansho.value_at(self._text, self._name, path)

    def __setitem__(self, path: str, value: Any) -> None:
        """Sets the value at a dotted path. Without a number or a name it is set in all tables of a list."""
        self._text = _bansho.with_values(self._text, self._name, [(path, value)])

    def __contains__(self, path: object) -> bool:
        """Whether the text states a value, or has a table, at a dotted path."""
        value: Any = self.to_dict()
        for part in str(path).split("."):
            if isinstance(value, list):
                selected = [item for item in value if isinstance(item, dict) and item.get("name") == part]
                if not selected and part.isdecimal():
                    selected = value[int(part) :]
                if selected:
                    value = selected[0]
                    continue
                if len(value) != 1 or part.isdecimal():
                    return False
                value = value[0]
            if not isinstance(value, dict) or part not in value:
                return False
            value = value[part]
        return True

    def __iter__(self) -> Iterator[str]:
        """The names of the tables that the text has."""
        return iter(self.to_dict())

    def __delitem__(self, path: str) -> None:
        """Removes a value, which then has its default, or a table."""
        self._text = _bansho.without_value(self._text, self._name, path)

    def update(self, values: Mapping[str, Any]) -> None:
        """Sets several values at once, of which each alone might contradict the others."""
        self._text = _bansho.with_values(self._text, self._name, list(values.items()))

    def add(self, table: SceneTable) -> None:
        """Adds a table, such as `bansho.FlameSheet(width=0.4)`; of a kind of which a scene has one, replaces it."""
        if not isinstance(table, SceneTable) or not table.key:
            raise ValueError(f"a {type(table).__name__}; allowed: a table of a scene such as bansho.FlameSheet(width=0.4)")
        self._text = _bansho.with_table(self._text, self._name, table.key, table)

    def to_toml(self) -> str:
        """The text of the scene file, with its comments."""
        return self._text

    def to_dict(self) -> dict[str, Any]:
        """The values that the text states."""
        return _bansho.stated_values(self._text, self._name)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the scene file."""
        Path(path).write_text(self._text, encoding="utf-8")

    def copy(self) -> Scene:
        """A scene of its own with the same text."""
        return self._of_text(self._text, self._name, self._folder)

    @property
    def name(self) -> str:
        """What messages call it: the path of its file."""
        return self._name

    @property
    def folder(self) -> Path:
        """The folder from which paths in it count."""
        return self._folder

    @property
    def asset_paths(self) -> list[str]:
        """Paths of all files that it names, as its text has them."""
        return _bansho.asset_paths(self._text, self._name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and (self._text, self._folder) == (other._text, other._folder)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Scene {self._name}: {len(self._text.splitlines())} lines>"

    def __getstate__(self) -> tuple[str, str, str]:
        return self._text, self._name, str(self._folder)

    def __setstate__(self, state: tuple[str, str, str]) -> None:
        self._text, self._name, self._folder = state[0], state[1], Path(state[2])
