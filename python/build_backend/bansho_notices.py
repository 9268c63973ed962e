"""The licenses of all crates that are compiled into the wheel: into the extension, and into the program beside it."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
NOTICES = ROOT / "THIRD-PARTY-NOTICES.txt"
LICENSE_NAMES = ("LICEN", "COPYING", "NOTICE", "UNLICENSE", "COPYRIGHT", "OFL", "UFL")


def write_notices() -> None:
    """Writes the license files of the crates to `THIRD-PARTY-NOTICES.txt`."""
    packages = {
        (package["name"], package["version"]): package
        for folder, root in ((ROOT, "bansho-python"), (ROOT.parent, "bansho-cli"))
        for package in _compiled(folder, root)
        if package["source"] is not None
    }
    parts = ["The compiled parts of this package contain the following crates.\n"]
    for _, package in sorted(packages.items()):
        parts.append(f"\n{'=' * 80}\n{package['name']} {package['version']}: {package['license'] or 'see its license file'}\n{package['repository'] or ''}\n")
        parts += [f"\n--- {name}\n{text}" for name, text in _texts(package)]
    NOTICES.write_text("".join(parts), encoding="utf-8")


def _compiled(folder: Path, root: str) -> Iterator[dict[str, Any]]:
    """The crates that are linked into the package `root` of the workspace in `folder`: not what only builds or tests it."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", host()]
    metadata = json.loads(subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, text=True).stdout)
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    reached = {identity for identity, package in packages.items() if package["name"] == root}
    waiting = list(reached)
    while waiting:
        for dependency in nodes[waiting.pop()]["deps"]:
            is_linked = any(kind["kind"] is None for kind in dependency["dep_kinds"])
            if is_linked and dependency["pkg"] not in reached:
                reached.add(dependency["pkg"])
                waiting.append(dependency["pkg"])
    return (packages[identity] for identity in reached)


def _texts(package: dict[str, Any]) -> list[tuple[str, str]]:
    """Name and text of each license file of a crate, in folders of its fonts too; without any the text of the license that its manifest names."""
    folder = Path(package["manifest_path"]).parent
    files = [path for pattern in ("*", "*/*") for path in sorted(folder.glob(pattern)) if path.is_file() and path.name.upper().startswith(LICENSE_NAMES)]
    if files:
        return [(str(path.relative_to(folder)), path.read_text(encoding="utf-8", errors="replace")) for path in files]
    expression = package["license"] or ""
    for name, file in (("Apache-2.0", "LICENSE-APACHE"), ("MIT", "LICENSE-MIT")):
        if name in expression:
            holders = ", ".join(package["authors"]) or f"the authors of {package['name']}"
            lines = (ROOT / file).read_text(encoding="utf-8").splitlines()
            # Whoever holds the rights of this crate, in place of those of Bansho.
            changed = [f"Copyright (c) {holders}" if line.startswith("Copyright") else line for line in lines]
            return [(f"{name}, which its manifest names", "\n".join(changed) + "\n")]
    raise RuntimeError(f"the crate {package['name']} {package['version']} has no license file, and its license is {expression!r}: neither MIT nor Apache-2.0")


def host() -> str:
    """The target that is built for."""
    target = os.environ.get("CARGO_BUILD_TARGET")
    if target:
        return target
    said = subprocess.run(["rustc", "-vV"], check=True, stdout=subprocess.PIPE, text=True).stdout
    return next(line.removeprefix("host: ") for line in said.splitlines() if line.startswith("host: "))
