"""Writes the meshes of the scenes beside this folder: a car (car_body.glb, car_glass.glb, car_trim.glb, car_metal.glb) and lamp_post.glb.

The car is 4.3 m long and stands at the origin, its front toward +x, y up. The post is 5.4 m high; its arm reaches 1.3 m toward +z. Each file is one glTF mesh without materials, since the color of an
obstacle is a parameter of the scene: `python3 make_car.py`.
"""

import json
import math
import pathlib
import struct

FOLDER = pathlib.Path(__file__).parent


class Mesh:
    def __init__(self):
        self.vertices, self.triangles = [], []

    def loft(self, rings):
        """Joins closed rings of equal length; the first and the last are closed by a fan."""
        first, count = len(self.vertices), len(rings[0])
        for ring in rings:
            self.vertices += ring
        for ring in range(len(rings) - 1):
            for i in range(count):
                a, b = first + ring * count + i, first + ring * count + (i + 1) % count
                self.triangles += [(a, b, b + count), (a, b + count, a + count)]
        for ring, turned in ((0, True), (len(rings) - 1, False)):
            points = rings[ring]
            center = tuple(sum(p[axis] for p in points) / count for axis in range(3))
            self.vertices.append(center)
            middle, start = len(self.vertices) - 1, first + ring * count
            for i in range(count):
                a, b = start + i, start + (i + 1) % count
                self.triangles.append((middle, b, a) if turned else (middle, a, b))

    def box(self, center, half, rounding=0.0):
        """A box, lofted along x, with corners cut by `rounding`."""
        (x, y, z), (a, b, c), r = center, half, rounding
        outline = [(b - r, c), (b, c - r), (b, r - c), (b - r, -c), (r - b, -c), (-b, r - c), (-b, c - r), (r - b, c)]
        ring = lambda at, scale: [(at, y + v * scale, z + w * scale) for v, w in outline]
        inset = 1.0 - r / min(b, c)
        self.loft([ring(x - a, inset), ring(x - a + r, 1.0), ring(x + a - r, 1.0), ring(x + a, inset)])

    def cylinder(self, center, radius, half_width, steps=40):
        """A cylinder along z with slightly rounded edges."""
        (x, y, z), bevel = center, min(0.02, 0.3 * half_width)
        ring = lambda at, r: [
            (x + r * math.cos(2 * math.pi * i / steps), y + r * math.sin(2 * math.pi * i / steps), at)
            for i in range(steps)
        ]
        w = half_width
        self.loft([ring(z - w, radius - bevel), ring(z - w + bevel, radius), ring(z + w - bevel, radius),
                   ring(z + w, radius - bevel)])

    def ellipsoid(self, center, half, steps=16):
        rings = []
        for j in range(1, steps):
            angle = math.pi * j / steps
            s, c = math.sin(angle), math.cos(angle)
            rings.append([
                (center[0] - half[0] * c, center[1] + half[1] * s * math.cos(t), center[2] + half[2] * s * math.sin(t))
                for t in (2 * math.pi * i / 20 for i in range(20))
            ])
        self.loft(rings)

    def outward(self):
        """Turns the mesh inside out if its volume is negative."""
        volume = 0.0
        for a, b, c in self.triangles:
            p, q, r = (self.vertices[i] for i in (a, b, c))
            cross = (q[1] * r[2] - q[2] * r[1], q[2] * r[0] - q[0] * r[2], q[0] * r[1] - q[1] * r[0])
            volume += sum(p[axis] * cross[axis] for axis in range(3))
        if volume < 0.0:
            self.triangles = [(a, c, b) for a, b, c in self.triangles]
        return self

    def joined(self, *others):
        for other in others:
            offset = len(self.vertices)
            self.vertices += other.vertices
            self.triangles += [tuple(i + offset for i in triangle) for triangle in other.triangles]
        return self

    def write(self, name):
        vertices = b"".join(struct.pack("<3f", *vertex) for vertex in self.vertices)
        indices = b"".join(struct.pack("<3H", *triangle) for triangle in self.triangles)
        binary = vertices + indices + b"\0" * (-len(vertices + indices) % 4)
        low = [min(v[axis] for v in self.vertices) for axis in range(3)]
        high = [max(v[axis] for v in self.vertices) for axis in range(3)]
        gltf = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "buffers": [{"byteLength": len(binary)}],
            "bufferViews": [
                {"buffer": 0, "byteLength": len(vertices)},
                {"buffer": 0, "byteOffset": len(vertices), "byteLength": len(indices)},
            ],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": len(self.vertices), "type": "VEC3", "min": low, "max": high},
                {"bufferView": 1, "componentType": 5123, "count": 3 * len(self.triangles), "type": "SCALAR"},
            ],
        }
        text = json.dumps(gltf, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(binary)
        data = struct.pack("<4sII", b"glTF", 2, length) + struct.pack("<I4s", len(text), b"JSON") + text
        data += struct.pack("<I4s", len(binary), b"BIN\0") + binary
        (FOLDER / name).write_bytes(data)
        print(name, len(data), "bytes,", len(self.triangles), "triangles")


def between(points, x):
    """Smooth interpolation of (x, value) points."""
    for (x0, v0), (x1, v1) in zip(points, points[1:]):
        if x <= x1:
            t = min(max((x - x0) / (x1 - x0), 0.0), 1.0)
            return v0 + (v1 - v0) * t * t * (3 - 2 * t)
    return points[-1][1]


WHEELS, RADIUS, TRACK = (1.32, -1.30), 0.32, 0.74
#: Top, bottom and half width of the lower body by x.
TOP = [(-2.15, 0.62), (-2.08, 0.86), (-1.75, 0.94), (-0.9, 0.93), (0.75, 0.92), (1.35, 0.84), (1.95, 0.74), (2.12, 0.62),
       (2.17, 0.5)]
BOTTOM = [(-2.15, 0.42), (-1.95, 0.27), (-1.6, 0.2), (1.6, 0.18), (2.0, 0.22), (2.17, 0.32)]
WIDTH = [(-2.15, 0.62), (-2.06, 0.76), (-1.7, 0.85), (0.0, 0.88), (1.4, 0.86), (1.85, 0.79), (2.08, 0.66), (2.17, 0.52)]


def section(x):
    top, bottom, width = between(TOP, x), between(BOTTOM, x), between(WIDTH, x)
    height = top - bottom
    half = [(bottom, 0.0), (bottom, 0.86), (bottom + 0.12 * height, 0.97), (bottom + 0.42 * height, 1.0),
            (bottom + 0.66 * height, 0.995), (bottom + 0.7 * height, 0.975), (top - 0.07 * height, 0.93),
            (top - 0.015 * height, 0.86), (top + 0.01, 0.6), (top + 0.02, 0.0)]
    right = [(x, y, width * w) for y, w in half]
    left = [(x, y, -width * w) for y, w in reversed(half[1:-1])]
    return right + left


def cabin(s, grow=0.0, steps=48, angles=None):
    """A ring of the cabin at height s, 0 at the belt line and 1 at the roof, or the points of it at some angles."""
    front, rear = 0.92 - 0.80 * s - 0.06 * s * s, -1.78 + 0.66 * s + 0.05 * s * s
    width, y = 0.80 - 0.19 * s - 0.03 * s * s, 0.89 + 0.53 * s
    middle, length = 0.5 * (front + rear), 0.5 * (front - rear)
    points = []
    for angle in angles or [2 * math.pi * i / steps for i in range(steps)]:
        c, d = math.cos(angle), math.sin(angle)
        scale = (abs(c) ** 4.5 + abs(d) ** 4.5) ** (-1 / 4.5)
        points.append((middle + (length + grow) * c * scale, y, (width + grow) * d * scale))
    return points


def pillar(low, high, angle, spread):
    """A strip of paint on the glass from s = low to s = high about an angle."""
    mesh, rings = Mesh(), []
    for step in range(9):
        s = low + (high - low) * step / 8
        angles = [angle + spread * (i / 4 - 0.5) for i in range(5)]
        rings.append(cabin(s, 0.008, angles=angles) + cabin(s, -0.02, angles=angles[::-1]))
    mesh.loft(rings)
    return mesh.outward()


def body():
    mesh = Mesh()
    stations = [-2.15 + 4.32 * i / 60 for i in range(61)]
    mesh.loft([section(x) for x in stations])
    mesh.outward()
    roof = Mesh()
    rings = [cabin(s, 0.01) for s in (0.9, 0.95, 0.985)]
    top = rings[-1]
    for shrink, rise in ((0.97, 0.012), (0.85, 0.03), (0.6, 0.045), (0.3, 0.052)):
        center = 0.5 * (min(p[0] for p in top) + max(p[0] for p in top))
        rings.append([(center + (p[0] - center) * shrink, p[1] + rise, p[2] * shrink) for p in top])
    roof.loft(rings)
    corners = math.atan2(1.0, 1.0)
    pillars = [pillar(0.0, 0.93, side * corner, spread) for side in (1, -1)
               for corner, spread in ((corners * 0.93, 0.10), (math.pi / 2 + 0.06, 0.09), (math.pi - corners * 0.9, 0.22))]
    mirrors = [Mesh() for _ in range(2)]
    for mirror, side in zip(mirrors, (1, -1)):
        mirror.ellipsoid((0.62, 0.98, side * 0.93), (0.07, 0.075, 0.1))
    return mesh.joined(roof.outward(), *pillars, *(mirror.outward() for mirror in mirrors))


def glass():
    mesh = Mesh()
    mesh.loft([cabin(s / 10) for s in range(11)])
    mesh.outward()
    lenses = []
    for side in (1, -1):
        lens = Mesh()
        lens.ellipsoid((2.03, 0.61, side * 0.56), (0.09, 0.085, 0.14))
        lenses.append(lens.outward())
    return mesh.joined(*lenses)


def trim():
    parts = []
    for x in WHEELS:
        for side in (1, -1):
            arch, tire = Mesh(), Mesh()
            arch.cylinder((x, RADIUS + 0.02, side * (TRACK + 0.02)), RADIUS + 0.07, 0.125)
            tire.cylinder((x, RADIUS, side * (TRACK + 0.035)), RADIUS, 0.125)
            parts += [arch.outward(), tire.outward()]
    grille, lip, rear = Mesh(), Mesh(), Mesh()
    grille.box((2.14, 0.50, 0.0), (0.05, 0.05, 0.36), 0.015)
    lip.box((2.10, 0.30, 0.0), (0.06, 0.05, 0.56), 0.02)
    rear.box((-2.10, 0.42, 0.0), (0.06, 0.09, 0.62), 0.03)
    first, *others = parts + [grille.outward(), lip.outward(), rear.outward()]
    return first.joined(*others)


def metal():
    parts = []
    for x in WHEELS:
        for side in (1, -1):
            rim = Mesh()
            rim.cylinder((x, RADIUS, side * (TRACK + 0.05)), 0.205, 0.12)
            parts.append(rim.outward())
    plate = Mesh()
    plate.box((2.19, 0.40, 0.0), (0.012, 0.055, 0.26), 0.01)
    first, *others = parts + [plate.outward()]
    return first.joined(*others)


def lamp_post():
    """A tapered post with a foot, a curved arm and a flat head."""
    steps = 20

    def tube(path, radii):
        """A tube along points in the plane of y and z."""
        rings = []
        for i, (y, z) in enumerate(path):
            (y0, z0), (y1, z1) = path[max(i - 1, 0)], path[min(i + 1, len(path) - 1)]
            length = math.hypot(y1 - y0, z1 - z0)
            up, out = (z1 - z0) / length, (y1 - y0) / length
            ring = []
            for j in range(steps):
                c, s = math.cos(2 * math.pi * j / steps), math.sin(2 * math.pi * j / steps)
                ring.append((radii[i] * c, y - radii[i] * s * up, z + radii[i] * s * out))
            rings.append(ring)
        mesh = Mesh()
        mesh.loft(rings)
        return mesh.outward()

    foot = tube([(0.0, 0.0), (0.9, 0.0), (0.95, 0.0), (1.0, 0.0)], [0.11, 0.11, 0.09, 0.062])
    bend = [(5.0 + 0.4 * math.sin(a), 0.4 - 0.4 * math.cos(a)) for a in (math.pi / 2 * i / 8 for i in range(9))]
    path = [(0.98, 0.0), (3.0, 0.0)] + bend + [(5.42, 1.0)]
    radii = [0.06, 0.05] + [0.042 - 0.008 * i / 8 for i in range(9)] + [0.034]
    head = Mesh()
    head.box((0.0, 5.43, 1.22), (0.12, 0.05, 0.3), 0.03)
    return foot.joined(tube(path, radii), head.outward())


body().write("car_body.glb")
glass().write("car_glass.glb")
trim().write("car_trim.glb")
metal().write("car_metal.glb")
lamp_post().write("lamp_post.glb")
