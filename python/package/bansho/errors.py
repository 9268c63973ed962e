"""Exceptions of Bansho. Each says what was given and what is allowed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

__all__ = ["InternalError", "MissingNameError", "PhysicalStrengthNotice", "Problem", "SceneError"]


@dataclass(frozen=True)
class Problem:
    """A problem of a scene, in the words of the program."""

    line: int | None
    """Line of the scene's text, from 1; `None` for what is not in a text."""
    column: int | None
    """Column in that line, from 1."""
    key: str
    """Path of the parameter, such as ``rain.0.rate_mm_per_h``."""
    message: str
    """What is wrong, and what is allowed."""
    allowed: str | None
    """What is allowed: the part of the message that says so."""
    choices: tuple[str, ...] = ()
    """The names that are allowed, where it is one of several."""


class SceneError(ValueError):
    """A scene, or a value for one, is invalid. `problems` has all of them; `line`, `column`, `key` and `allowed` are those of the first."""

    problems: tuple[Problem, ...]

    def __init__(self, message: str, problems: Iterable[Mapping[str, Any] | Problem] = ()) -> None:
        super().__init__(message)
        self.problems = tuple(
            problem if isinstance(problem, Problem) else Problem(**{**problem, "choices": tuple(problem["choices"])})
            for problem in problems
        )

    def __reduce__(self) -> tuple[Any, ...]:
        # Exceptions of worker processes are pickled.
        return type(self), (str(self), self.problems)

    @property
    def line(self) -> int | None:
        """Line of the first problem."""
        return self.problems[0].line if self.problems else None

    @property
    def column(self) -> int | None:
        """Column of the first problem."""
        return self.problems[0].column if self.problems else None

    @property
    def key(self) -> str | None:
        """Path of the parameter of the first problem."""
        return self.problems[0].key if self.problems else None

    @property
    def allowed(self) -> str | None:
        """What is allowed instead of the first problem."""
        return self.problems[0].allowed if self.problems else None


class MissingNameError(KeyError):
    """A frame has no AOV or layer of that name. The message says what is allowed."""

    def __str__(self) -> str:
        # That of a KeyError is its argument in quotes.
        return str(self.args[0]) if self.args else ""


class InternalError(RuntimeError):
    """A fault of Bansho itself. The interpreter lives; the object whose method failed is of no use any more."""


class PhysicalStrengthNotice(UserWarning):
    """Said once: weather is as strong as physics makes it, which by day may hardly be seen."""
