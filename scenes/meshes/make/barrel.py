"""Writes barrel.glb: the open steel barrel of burning_barrel.toml, one closed surface of revolution with a cavity and dents.

The wall is much thicker than sheet steel, so that the grid of the gas resolves it. Lengths in meters, y up.
"""
from pathlib import Path

import numpy as np

from logs import volume, write_glb

SIDES = 40
RADIUS, HEIGHT, WALL, FLOOR = 0.29, 0.86, 0.05, 0.10


def main():
    # The outline from the middle of the foot, up the outside with its two hoops, over the rim and down the inside: radius, height.
    outside = [(RADIUS + 0.006, 0.002), (RADIUS + 0.006, 0.025), (RADIUS, 0.035)]
    for hoop in (HEIGHT / 3, 2 * HEIGHT / 3):
        outside += [(RADIUS, hoop - 0.10), (RADIUS, hoop - 0.024), (RADIUS + 0.014, hoop - 0.006), (RADIUS + 0.014, hoop + 0.006), (RADIUS, hoop + 0.024)]
    outside += [(RADIUS, HEIGHT - 0.10), (RADIUS, HEIGHT - 0.03), (RADIUS + 0.008, HEIGHT - 0.02), (RADIUS + 0.008, HEIGHT - 0.004), (RADIUS, HEIGHT)]
    inside = [(RADIUS - WALL, HEIGHT), (RADIUS - WALL, 0.5 * HEIGHT), (RADIUS - WALL, FLOOR)]
    outline = outside + inside
    angle = np.arange(SIDES) * 2 * np.pi / SIDES
    # Shallow dents.
    dents = [(0.9, 0.5, 0.014), (2.5, 0.2, 0.012), (4.4, 0.6, 0.016)]
    rings = []
    for index, (radius, height) in enumerate(outline):
        r = np.full(SIDES, radius)
        if index < len(outside):
            for around, at, depth in dents:
                apart = np.angle(np.exp(1j * (angle - around)))
                r -= depth * np.exp(-(apart / 0.5) ** 2 - ((height - at) / 0.14) ** 2)
        y = np.full(SIDES, height) + (0.008 * np.cos(2 * angle + 0.6) if height >= HEIGHT - 0.03 else 0.0)
        rings.append(np.stack([r * np.cos(angle), y, r * np.sin(angle)], axis=1))
    vertices = np.concatenate(rings + [[[0.0, 0.002, 0.0], [0.0, FLOOR, 0.0]]])
    triangles = []
    for ring in range(len(rings) - 1):
        for k in range(SIDES):
            a, b = ring * SIDES + k, ring * SIDES + (k + 1) % SIDES
            triangles += [(a, a + SIDES, b), (b, a + SIDES, b + SIDES)]
    foot, floor, last = len(vertices) - 2, len(vertices) - 1, (len(rings) - 1) * SIDES
    for k in range(SIDES):
        after = (k + 1) % SIDES
        triangles += [(foot, k, after), (floor, last + after, last + k)]
    triangles = np.array(triangles)
    if volume(vertices, triangles) < 0:
        triangles = triangles[:, ::-1]
    print("volume", volume(vertices, triangles))
    write_glb(Path(__file__).parent.parent / "barrel.glb", vertices, triangles)


main()
