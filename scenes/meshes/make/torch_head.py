"""Writes torch_head.glb: cloth wound around the end of a stick, for torch_in_gusts.toml. One closed mesh. Lengths in meters, y up."""
from pathlib import Path

import numpy as np

from logs import volume, write_glb

SIDES, RINGS = 40, 27
LOW, HIGH, RADIUS, TURNS = -0.085, 0.085, 0.052, 5.5


def main():
    rng = np.random.default_rng(2)
    angle = np.arange(SIDES) * 2 * np.pi / SIDES
    rings = []
    for ring in range(RINGS):
        t = ring / (RINGS - 1)
        # A bulge that is tied at both ends, and the ridges of the strips of cloth, which wind around it.
        bulge = 0.62 + 0.38 * np.sin(np.pi * np.clip(0.08 + 0.9 * t, 0, 1)) ** 0.6
        # Two layers of strips cross each other.
        winding = (angle / (2 * np.pi) + TURNS * t) % 1
        crossing = (-2 * angle / (2 * np.pi) + TURNS * 0.6 * t + 0.3) % 1
        ridge = 0.09 * winding + 0.06 * np.abs(crossing - 0.5) + rng.uniform(-0.02, 0.02, SIDES)
        r = RADIUS * (bulge - 0.05 + ridge)
        y = LOW + (HIGH - LOW) * t + 0.004 * np.sin(3 * angle + 4 * t)
        rings.append(np.stack([r * np.cos(angle), y, r * np.sin(angle)], axis=1))
    vertices = np.concatenate(rings + [[[0.0, LOW, 0.0], [0.004, HIGH + 0.012, 0.0]]])
    triangles = []
    for ring in range(RINGS - 1):
        for k in range(SIDES):
            a, b = ring * SIDES + k, ring * SIDES + (k + 1) % SIDES
            triangles += [(a, a + SIDES, b), (b, a + SIDES, b + SIDES)]
    low, high, last = len(vertices) - 2, len(vertices) - 1, (RINGS - 1) * SIDES
    for k in range(SIDES):
        after = (k + 1) % SIDES
        triangles += [(low, k, after), (high, last + after, last + k)]
    triangles = np.array(triangles)
    if volume(vertices, triangles) < 0:
        triangles = triangles[:, ::-1]
    write_glb(Path(__file__).parent.parent / "torch_head.glb", vertices, triangles)


main()
