"""Absurd values for every parameter, as the program's own JSON schema lists them."""

from collections.abc import Iterator

from .case import Case

Path = tuple[tuple[str, bool], ...]


def _tables(schema: dict, path: Path = ()) -> Iterator[tuple[Path, dict]]:
    """Every table below a schema of one, with the way to it: each key, and whether a list of tables stands there."""
    for key, below in schema["properties"].items():
        is_list = below.get("type") == "array" and "properties" in below.get("items", {})
        table = below["items"] if is_list else below
        if "properties" in table:
            here = (*path, (key, is_list))
            yield here, table
            yield from _tables(table, here)


def _header(path: Path) -> str:
    name = ".".join(key for key, _ in path)
    return f"[[{name}]]" if path[-1][1] else f"[{name}]"


def _alternatives(schema: dict) -> list[dict]:
    return schema.get("anyOf", [schema])


def _numeric(schema: dict) -> dict | None:
    """The limits of the number, or of the numbers of the list, that a schema allows."""
    for one in _alternatives(schema):
        if one.get("type") in ("number", "integer"):
            return one
        if one.get("type") == "array" and one.get("items", {}).get("type") == "number":
            return one["items"]
    return None


def _count(schema: dict) -> int:
    """How many numbers are in its list; 0 where it is a number alone."""
    lists = [one for one in _alternatives(schema) if one.get("type") == "array"]
    alone = any(one.get("type") in ("number", "integer") for one in _alternatives(schema))
    return 0 if alone or not lists else max(1, lists[0].get("minItems", 1))


def _numbers(schema: dict, text: str) -> str:
    count = _count(schema)
    return f"[{', '.join([text] * count)}]" if count else text


def _beyond(limits: dict, side: str) -> str | None:
    limit = limits.get("maximum" if side == "above" else "minimum")
    if limit is None:
        return None
    step = max(1, abs(limit) * 1e-3)
    beyond = limit + step if side == "above" else limit - step
    return str(int(beyond)) if limits["type"] == "integer" else repr(float(beyond))


def _wrong_type(schema: dict) -> str | None:
    kinds = {one.get("type", "enum") for one in _alternatives(schema)}
    return "[[[[[]]]]]" if kinds <= {"string", "enum", "boolean", "number", "integer"} else '"many"'


def _text(schema: dict, what: str, index: int) -> str | None:
    """An absurd value for a parameter; `None` where this absurdity is none for it."""
    if what == "of a wrong type":
        return _wrong_type(schema)
    limits = _numeric(schema)
    if limits is None:
        return None
    if what == "1e308":
        return _numbers(schema, "-1e308" if index % 2 else "1e308")
    if what == "not finite":
        return _numbers(schema, ["nan", "inf", "-inf"][index % 3])
    if what == "of 64 bits":
        return _numbers(schema, "-9223372036854775808" if index % 2 else "9223372036854775807")
    beyond = _beyond(limits, what)
    return None if beyond is None else _numbers(schema, beyond)


def _lines(tables: list[tuple[Path, dict]], choose) -> tuple[list[str], list[int]]:
    """The lines of a scene with a value for each parameter, and the numbers of those lines."""
    text, stated, index = ["bansho = 2"], [], 0
    for path, table in tables:
        text.append(_header(path))
        for key, schema in table["properties"].items():
            if "properties" in schema or "properties" in schema.get("items", {}):
                continue
            value = choose(schema, index)
            if value is not None:
                text.append(f"{key} = {value}")
                stated.append(len(text))
                index += 1
    return text, stated


def _absurd(name: str, tables: list[tuple[Path, dict]], what: str) -> Case | None:
    text, stated = _lines(tables, lambda schema, index: _text(schema, what, index))
    if not stated:
        return None
    shown = stated[:100]
    places = [rf"(?m)^error: scene\.toml:{line}:\d+: " for line in shown]
    return Case("limits", f"[{name}] {what}", ["check", "scene.toml"], 3, rf"^error: (scene\.toml:\d+:\d+: {name}|.*more)",
                {"scene.toml": "\n".join(text) + "\n"}, errors=len(stated), places=places)


def _extreme(name: str, tables: list[tuple[Path, dict]], side: str) -> Case:
    """Every number at its limit: each by itself is allowed."""
    def value(schema: dict, _: int) -> str | None:
        limits = _numeric(schema)
        limit = None if limits is None else limits.get(side)
        if limit is None:
            return None
        return _numbers(schema, str(int(limit)) if limits["type"] == "integer" else repr(float(limit)))

    text, _ = _lines(tables, value)
    return Case("limits", f"[{name}] all at the {side}", ["check", "scene.toml"], (0, 3), r"^error: scene\.toml:\d+:\d+: .*allowed|^error: scene\.toml:\d+:\d+: ",
                {"scene.toml": "\n".join(text) + "\n"}, errors=-1)


def _denormal(name: str, tables: list[tuple[Path, dict]]) -> Case:
    text, _ = _lines(tables, lambda schema, _: None if _numeric(schema) is None or _numeric(schema)["type"] == "integer" else _numbers(schema, "5e-324"))
    return Case("limits", f"[{name}] denormal numbers", ["check", "scene.toml"], (0, 3), r"^error: scene\.toml:\d+:\d+: ",
                {"scene.toml": "\n".join(text) + "\n"}, errors=-1)


def cases(schema: dict) -> list[Case]:
    tables: dict[str, list[tuple[Path, dict]]] = {}
    for path, table in _tables(schema):
        tables.setdefault(path[0][0], []).append((path, table))
    made: list[Case | None] = []
    for name, below in tables.items():
        for what in ("above", "below", "1e308", "not finite", "of 64 bits", "of a wrong type"):
            made.append(_absurd(name, below, what))
        made += [_extreme(name, below, "minimum"), _extreme(name, below, "maximum"), _denormal(name, below)]
    return [case for case in made if case is not None]
