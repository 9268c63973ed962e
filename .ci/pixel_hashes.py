#!/usr/bin/env python3
"""Hashes of decoded pixels of every scene and every kind of output, for changes that must not change a picture.

    .ci/pixel_hashes.py PROGRAM                 writes hashes to standard output
    .ci/pixel_hashes.py PROGRAM --check FILE    compares with hashes that were written before

Files carry fingerprints, so what is hashed is what other programs decode from them: channels of EXR (beauty, layers, AOVs, depth) as they are
stored, codes of PNG, APNG and GIF, columns of PLY. Needs OpenEXR, numpy, Pillow and plyfile for Python.
"""

import argparse
import concurrent.futures
import hashlib
import pathlib
import subprocess
import sys
import tempfile

import numpy
import OpenEXR
from PIL import Image, ImageSequence
from plyfile import PlyData

SIZE = "64x36"
FRAMES = "0,10"


def digest(parts):
    total = hashlib.sha256()
    for part in parts:
        total.update(part)
    return total.hexdigest()[:24]


def of_exr(path):
    """Every channel of every part by name, with the data window."""
    with OpenEXR.File(str(path), separate_channels=True) as file:
        parts = []
        for part in file.parts:
            parts.append(repr((part.name(), part.header["dataWindow"])).encode())
            for name in sorted(part.channels):
                parts.append(name.encode())
                parts.append(numpy.ascontiguousarray(part.channels[name].pixels).tobytes())
    return digest(parts)


def of_picture(path):
    """Every frame of a PNG, an APNG or a GIF. Pillow reads 16 bits of color as 8, so those are compared as they are inflated."""
    with Image.open(path) as picture:
        frames = [frame.convert("RGBA").tobytes() for frame in ImageSequence.Iterator(picture)]
    return digest(frames)


def of_png_16(path):
    """The inflated rows of a PNG, whose filters are the same for the same pixels."""
    import zlib

    data, inflated, at = path.read_bytes(), b"", 8
    while at < len(data):
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        if kind == b"IDAT":
            inflated += data[at + 8 : at + 8 + length]
        at += 12 + length
    return digest([zlib.decompress(inflated)])


def of_ply(path):
    return digest([numpy.ascontiguousarray(element.data).tobytes() for element in PlyData.read(str(path)).elements])


# Kinds of output: name, arguments after the scene, what is read, and how.
KINDS = [
    ("exr", ["--frames", FRAMES, "--layers", "--aovs", "-o", "f.####.exr"], "*.exr", of_exr),
        ("transparent", ["--frames", FRAMES, "--transparent", "-o", "f.####.exr"], "*.exr", of_exr),
    ("png", ["--frames", FRAMES, "-o", "f.####.png"], "*.png", of_picture),
    ("png16", ["--frames", FRAMES, "--bits", "16", "-o", "f.####.png"], "*.png", of_png_16),
]


def run(program, arguments, folder):
    done = subprocess.run([program, *arguments], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(arguments)}\n{done.stderr}")


def hashes_of(program, scene, kind):
    name, arguments, pattern, read = kind
    with tempfile.TemporaryDirectory() as folder:
        run(program, ["render", str(scene), "--size", SIZE, "--threads", "1", "--progress", "none", *arguments], folder)
        files = sorted(pathlib.Path(folder).glob(pattern))
        if not files:
            raise SystemExit(f"{scene.stem}: {name} wrote nothing")
        return [f"{scene.stem} {name} {file.name} {read(file)}" for file in files]


def others(program, scenes):
    """What is written otherwise: a loop, a flipbook, particles, streaks."""
    torch, still = scenes / "torch.toml", scenes / "inagaki_still.toml"
    jobs = [
        ("apng", ["render", str(torch), "--size", SIZE, "--frames", "0-2", "-o", "f.apng"], "*.apng", of_picture),
        ("gif", ["render", str(torch), "--size", SIZE, "--frames", "0-2", "-o", "f.gif"], "*.gif", of_picture),
        ("loop", ["render", str(torch), "--size", SIZE, "--loop", "1", "--frames", "0,10", "-o", "f.####.exr"], "*.exr", of_exr),
        ("steppedloop", ["render", str(still), "--size", SIZE, "--loop", "0.5", "--frames", "0,3", "-o", "f.####.exr"],
         "*.exr", of_exr),
        ("flipbook", ["flipbook", str(torch), "--size", SIZE, "--grid", "2x2", "-o", "f.png"], "*.png", of_picture),
        ("ply", ["simulate", str(still), "--frames", "0,1", "--particles", "p.####.ply"], "*.ply", of_ply),
    ]
    lines = []
    for name, arguments, pattern, read in jobs:
        with tempfile.TemporaryDirectory() as folder:
            run(program, arguments, folder)
            files = sorted(pathlib.Path(folder).glob(pattern))
            if not files:
                raise SystemExit(f"{name} wrote nothing")
            lines += [f"{name} {file.relative_to(folder)} {read(file)}" for file in files]
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("--check", type=pathlib.Path)
    parser.add_argument("--scenes", type=pathlib.Path, default=pathlib.Path(__file__).parent.parent / "scenes")
    options = parser.parse_args()
    program, scenes = options.program.resolve(), options.scenes.resolve()
    jobs = [(program, scene, kind) for scene in sorted([*scenes.glob("*.toml"), *scenes.glob("papers/*/*.toml")]) for kind in KINDS]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        lines = [line for found in pool.map(lambda job: hashes_of(*job), jobs) for line in found]
    lines += others(program, scenes)
    if options.check is None:
        print("\n".join(lines))
        return
    expected = options.check.read_text().splitlines()
    changed = sorted(set(expected) ^ set(lines))
    for line in changed:
        print("-" if line in expected else "+", line)
    if changed:
        sys.exit(f"{len(changed)} lines of {options.check} differ")
    print(f"{len(lines)} hashes are equal")


if __name__ == "__main__":
    main()
