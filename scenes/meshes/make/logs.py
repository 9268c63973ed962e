"""Writes logs.glb: the crossed logs of bonfire.toml, one closed mesh of irregular cylinders with broken ends. Lengths in meters, y up.

Logs touch but hardly overlap: where two closed surfaces overlap, a point is outside of the sum of them.
"""
import struct, sys, json
from pathlib import Path

import numpy as np

SIDES, RINGS = 20, 13

# Both ends of each log's axis, and its radius at both ends. Logs on the ground first, then those that lean on each other.
LOGS = [
    ([-0.721, 0.074, 0.301], [0.618, 0.070, 0.438], 0.095, 0.080),
    ([-0.657, 0.082, -0.388], [0.701, 0.076, -0.297], 0.100, 0.085),
    ([-0.323, 0.266, 0.671], [-0.225, 0.285, -0.646], 0.075, 0.080),
    ([0.326, 0.264, 0.721], [0.409, 0.275, -0.659], 0.078, 0.070),
    ([-0.714, 0.090, -0.018], [0.204, 0.976, -0.158], 0.078, 0.060),
    ([0.731, 0.080, -0.008], [-0.055, 1.053, 0.144], 0.075, 0.055),
    ([0.088, 0.070, 0.628], [-0.015, 0.985, -0.104], 0.070, 0.052),
    ([0.090, 0.070, -0.680], [-0.155, 0.798, 0.322], 0.070, 0.050),
]


def segment_distance(p, q):
    s = np.linspace(0, 1, 200)
    a = p[0] + s[:, None] * (p[1] - p[0])
    b = q[0] + s[:, None] * (q[1] - q[0])
    return np.linalg.norm(a[:, None] - b[None], axis=2).min()


def log(rng, start, end, radius_start, radius_end):
    start, end = np.array(start), np.array(end)
    axis = end - start
    length = np.linalg.norm(axis)
    axis /= length
    side = np.cross(axis, [0.31, 0.2, 0.93]); side /= np.linalg.norm(side)
    up = np.cross(axis, side)
    angle = np.arange(SIDES) * 2 * np.pi / SIDES
    # The outline of a log is not round, and turns along it; bark has ridges along the log, and knots.
    low = sum(rng.uniform(0.02, 0.05) * np.cos(k * angle + rng.uniform(0, 7)) for k in (2, 3, 5))
    ridges = rng.uniform(-0.055, 0.055, SIDES)
    knots = [(rng.uniform(0.15, 0.85), rng.uniform(0, 2 * np.pi), rng.uniform(0.12, 0.3)) for _ in range(3)]
    bend = rng.normal(0, 0.010, (2, 3))
    points = []
    for ring in range(RINGS):
        t = ring / (RINGS - 1)
        radius = radius_start + (radius_end - radius_start) * t
        shape = 1 + low + ridges + rng.uniform(-0.05, 0.05, SIDES)
        for at, around, height in knots:
            apart = np.angle(np.exp(1j * (angle - around)))
            shape += height * np.exp(-((t - at) * length / (0.5 * radius)) ** 2 - (apart / 0.45) ** 2)
        along = np.full(SIDES, t * length)
        if ring in (0, RINGS - 1):
            shape *= 0.93
            along += rng.uniform(-0.02, 0.02, SIDES)
        curve = sum(b * np.sin(np.pi * (k + 1) * t) for k, b in enumerate(bend)) * length
        center = start + curve
        points.append(center + along[:, None] * axis + radius * shape[:, None] * (np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * up))
    caps = [points[0].mean(0), points[-1].mean(0)]
    vertices = np.concatenate(points + [np.array(caps)])
    # The ground is level, and nothing is below it.
    vertices[:, 1] = np.maximum(vertices[:, 1], 0.002)
    triangles = []
    for ring in range(RINGS - 1):
        for k in range(SIDES):
            a, b = ring * SIDES + k, ring * SIDES + (k + 1) % SIDES
            c, d = a + SIDES, b + SIDES
            triangles += [(a, b, c), (b, d, c)] if (ring + k) % 2 else [(a, b, d), (a, d, c)]
    first, last = RINGS * SIDES, RINGS * SIDES + 1
    for k in range(SIDES):
        after = (k + 1) % SIDES
        triangles += [(first, after, k), (last, (RINGS - 1) * SIDES + k, (RINGS - 1) * SIDES + after)]
    return vertices, np.array(triangles)


def volume(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def write_glb(path, vertices, triangles):
    positions, indices = vertices.astype("<f4"), triangles.astype("<u2").ravel()
    binary = positions.tobytes() + indices.tobytes()
    binary += b"\0" * (-len(binary) % 4)
    description = {
        "asset": {"version": "2.0", "generator": Path(sys.argv[0]).name},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": positions.nbytes, "target": 34962},
            {"buffer": 0, "byteOffset": positions.nbytes, "byteLength": indices.nbytes, "target": 34963},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3",
             "min": positions.min(0).tolist(), "max": positions.max(0).tolist()},
            {"bufferView": 1, "componentType": 5123, "count": len(indices), "type": "SCALAR"},
        ],
    }
    text = json.dumps(description, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    Path(path).write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    print(path, len(chunks) + 12, "bytes,", len(positions), "vertices,", len(triangles), "triangles")


if __name__ == "__main__":
    rng = np.random.default_rng(4)
    axes = [np.array(entry[:2]) for entry in LOGS]
    for i in range(len(LOGS)):
        for j in range(i):
            gap = segment_distance(axes[i], axes[j]) - max(LOGS[i][2:]) * 0.9 - max(LOGS[j][2:]) * 0.9
            if gap < 0.0:
                print("logs", j, i, "overlap by", round(-gap, 3), "m")
    vertices, triangles, base = [], [], 0
    for entry in LOGS:
        v, t = log(rng, *entry)
        if volume(v, t) < 0:
            t = t[:, ::-1]
        vertices.append(v); triangles.append(t + base); base += len(v)
    write_glb(Path(__file__).parent.parent / "logs.glb", np.concatenate(vertices), np.concatenate(triangles))
