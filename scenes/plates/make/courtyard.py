"""`courtyard`: the paved yard of an old stone house at dusk, with a fire basket laid but not lit: the fire is left to Bansho."""

import numpy as np

import plants
import plate
import shapes
from shaders import Shader, glow, plain
from shapes import TAU, Mesh

POSITION, TARGET, FOV_DEG = (0.5, 1.6, 4.0), (-0.1, 1.62, -6.0), 38.0
BASKET = (0.95, 2.1)          # the middle of the fire basket on the ground, in Blender's x and y
BACK, LEFT, RIGHT = 6.6, -4.3, 4.9

rng = np.random.default_rng(47)


# Materials

def masonry(name, a, b):
    """Hewn stones: each its own tone (the tint), with lichen, streaks below the sky, and green toward the ground."""
    s = Shader(name)
    p = s.position()
    tint = s.attribute("tint")
    tone = s.mix(tint, a, b)
    odd = s.remap(s.math("FRACT", s.math("MULTIPLY", tint, 17.3)), 0.75, 0.95, 0.0, 0.55)
    tone = s.mix(odd, tone, (0.16, 0.105, 0.068))
    tone = s.shade(tone, s.remap(s.noise(5.0, 9.0, 0.68), 0.3, 0.7, 0.62, 1.25))
    pores = s.noise(75.0, 5.0, 0.7)
    tone = s.shade(tone, s.remap(pores, 0.3, 0.7, 0.72, 1.2))
    streaks = s.noise(1.0, 6.0, 0.6, s.stretched(p, (2.6, 2.6, 0.22)))
    tone = s.shade(tone, s.remap(streaks, 0.38, 0.75, 1.1, 0.5))
    lichen = s.remap(s.noise(6.5, 8.0, 0.72), 0.58, 0.64, 0.0, 0.55)
    tone = s.mix(lichen, tone, (0.24, 0.235, 0.19))
    level = s.math("ADD", s.axis(p, "Z"), s.math("MULTIPLY", s.noise(1.8, 8.0, 0.66), 1.5))
    damp = s.remap(level, 0.75, 1.35, 0.75, 0.0)
    tone = s.mix(damp, tone, (0.030, 0.036, 0.018))
    tone = s.shade(tone, s.remap(s.occlusion(0.10), 0.3, 0.85, 0.35, 1.0))
    normal = s.bump(pores, 0.004, 0.9, s.bump(s.noise(17.0, 8.0, 0.66), 0.016, 0.9))
    return s.finish(s.principled(tone, s.remap(damp, 0.0, 0.75, 0.82, 0.6), normal, Specular_IOR_Level=0.35))


def mortar():
    s = Shader("mortar")
    tone = s.shade((0.19, 0.168, 0.135), s.remap(s.noise(4.0, 9.0, 0.7), 0.3, 0.7, 0.45, 1.15))
    level = s.math("ADD", s.axis(s.position(), "Z"), s.math("MULTIPLY", s.noise(1.8, 8.0, 0.66), 1.5))
    tone = s.mix(s.remap(level, 0.75, 1.4, 0.8, 0.0), tone, (0.028, 0.033, 0.017))
    return s.finish(s.principled(tone, 0.9, s.bump(s.noise(55.0, 8.0, 0.72), 0.008, 0.9)))


def flagstone():
    s = Shader("flagstone")
    p = s.position()
    tint = s.attribute("tint")
    tone = s.mix(tint, (0.085, 0.082, 0.078), (0.19, 0.172, 0.145))
    tone = s.shade(tone, s.remap(s.noise(3.2, 9.0, 0.68), 0.3, 0.7, 0.6, 1.25))
    tone = s.shade(tone, s.remap(s.noise(85.0, 4.0), 0.3, 0.7, 0.78, 1.18))
    tone = s.mix(s.remap(s.noise(0.8, 7.0, 0.65), 0.5, 0.66, 0.0, 0.6), tone, (0.040, 0.034, 0.026))
    lichen = s.remap(s.noise(8.0, 8.0, 0.7), 0.61, 0.66, 0.0, 0.5)
    tone = s.mix(lichen, tone, (0.22, 0.22, 0.18))
    wet = s.remap(s.noise(0.55, 6.0, 0.6), 0.50, 0.62)
    tone = s.shade(tone, s.remap(wet, 0.0, 1.0, 1.0, 0.55))
    normal = s.bump(s.noise(60.0, 7.0, 0.7), 0.0035, s.remap(wet, 0.0, 1.0, 0.9, 0.3), s.bump(s.noise(6.0, 5.0), 0.02, 0.6))
    return s.finish(s.principled(tone, s.remap(wet, 0.0, 1.0, 0.62, 0.13), normal))


def joint_soil():
    s = Shader("joint soil")
    tone = s.mix(s.remap(s.noise(2.5, 8.0, 0.65), 0.42, 0.6), (0.030, 0.024, 0.017), (0.030, 0.048, 0.012))
    return s.finish(s.principled(tone, 0.95, s.bump(s.noise(50.0, 8.0, 0.7), 0.012)))


def planks(name, color, axis="Z"):
    s = Shader(name)
    scales = {"X": (1.0, 34.0, 34.0), "Z": (34.0, 34.0, 1.0)}[axis]
    grain = s.noise(1.0, 8.0, 0.62, s.stretched(s.position(), scales), 0.4)
    tone = s.shade(color, s.remap(grain, 0.3, 0.7, 0.45, 1.35))
    tone = s.shade(tone, s.remap(s.attribute("tint"), 0.0, 1.0, 0.7, 1.25))
    worn = s.remap(s.math("ADD", s.noise(5.0, 9.0, 0.72), s.remap(s.axis(s.position(), "Z"), 0.1, 0.9, 0.14, 0.0)), 0.58, 0.66, 0.0, 0.8)
    tone = s.mix(worn, tone, s.shade((0.17, 0.14, 0.11), s.remap(grain, 0.3, 0.7, 0.5, 1.3)))
    return s.finish(s.principled(tone, 0.55, s.bump(grain, 0.005, 0.9)))


# Stonework

def block(low, high, round_by=0.03, bulge=0.02, detail=13):
    """A hewn stone that fills a box, with worn edges and a rough face."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    half = (high - low) / 2
    v, f = shapes.sphere(detail)
    cube = v / np.abs(v).max(axis=1, keepdims=True)
    inner = np.maximum(half - round_by, 0.3 * half)
    points = cube * inner + v * (half - inner)
    offset = rng.uniform(-99, 99, 3)
    seed = int(rng.integers(1 << 30))
    relief = bulge * shapes.fbm(points * 4.5 + offset, 4, seed, 0.55)
    chips = np.clip(shapes.noise(points * 6 + offset, seed + 3) - 0.35, 0, 1) * np.clip(np.abs(cube).min(axis=1) - 0.3, 0, 1)
    points = points + (relief - 0.10 * chips)[:, None] * v
    return points + (low + high) / 2, f


def courses(mesh, length, top, holes, place, depth=0.22):
    """A wall of coursed rubble in (along, out, up), around holes (u0, u1, z0, z1); `place` maps it to the world."""
    z = -0.05
    while z < top:
        h = min(rng.uniform(0.15, 0.33), max(top - z, 0.12))
        u = -rng.uniform(0, 0.3)
        while u < length:
            w = rng.uniform(0.22, 0.62) * (0.7 + h)
            end = u + w
            for a, b, c, d in holes:
                if z + h > c + 0.04 and z < d - 0.04:
                    if u < a < end + 0.12:
                        end = a
                    elif a <= u < b or (u < a and end > a):
                        u, end = b, b + w
            end = min(end, length)
            if end - u > 0.06 and u < length:
                gap = rng.uniform(0.006, 0.015)
                out = rng.normal(0, 0.012)
                if w > 0.34 and h > 0.24 and rng.uniform() < 0.35:
                    parts = ((z + gap, z + h * 0.52 - gap), (z + h * 0.52 + gap, z + h - gap))
                else:
                    parts = ((z + gap, z + h - gap),)
                for z0, z1 in parts:
                    part = block((u + gap, -depth, z0 + rng.normal(0, 0.004)), (end - gap, out, z1 + rng.normal(0, 0.004)), 0.035, 0.022)
                    mesh.add(place(part), 0, rng.uniform(0, 1))
            u = end
        z += h


def mortar_sheet(mesh, length, top, holes, place):
    """The mortar between the stones: a rough sheet just behind their faces."""
    us, zs = np.arange(-0.1, length + 0.1, 0.035), np.arange(-0.1, top + 0.02, 0.035)
    v, f = shapes.grid(us, zs)
    out = -0.028 + 0.014 * shapes.fbm(np.stack([v[:, 0], v[:, 1], 0 * v[:, 0]], axis=1) * 5.0, 4, 77)
    middle = v[f].mean(axis=1)
    keep = np.ones(len(f), bool)
    for a, b, c, d in holes:
        keep &= ~((middle[:, 0] > a) & (middle[:, 0] < b) & (middle[:, 1] > c) & (middle[:, 1] < d))
    mesh.add(place((np.stack([v[:, 0], out, v[:, 1]], axis=1), f[keep])), 1)


def paving(stone_material, soil_material):
    """Flagstones in rows of different width, sunk a little; their tops lie within a centimeter of the ground plane."""
    mesh = Mesh(stone_material)
    y = -3.6
    joints = []
    while y < BACK + 0.3:
        deep = rng.uniform(0.34, 0.62)
        x = LEFT - 0.3 - rng.uniform(0, 0.5)
        while x < RIGHT + 0.3:
            wide = rng.uniform(0.35, 0.95)
            gap = rng.uniform(0.007, 0.017)
            n = 26
            xs = np.linspace(x + gap, x + wide - gap, n)
            ys = np.linspace(y + gap, y + deep - gap, n)
            tilt = rng.normal(0, 0.004, 2)
            sunk = rng.normal(0, 0.003)
            seed = int(rng.integers(1 << 20))
            skew = rng.normal(0, 0.012, 4)

            def top(points):
                u = (points[:, 0] - xs[0]) / (xs[-1] - xs[0])
                v = (points[:, 1] - ys[0]) / (ys[-1] - ys[0])
                edge = np.minimum(np.minimum(u, 1 - u) * (xs[-1] - xs[0]), np.minimum(v, 1 - v) * (ys[-1] - ys[0]))
                flat = points * np.array([1, 1, 0])
                wear = 0.010 + 0.012 * shapes.noise(flat * 9, seed)
                lip = -0.030 * np.clip(1 - edge / np.maximum(wear, 0.004), 0, 1) ** 2
                return sunk + tilt[0] * (u - 0.5) + tilt[1] * (v - 0.5) + 0.004 * shapes.fbm(flat * 5, 3, seed) + lip

            part, faces = shapes.grid(xs, ys, top)
            u = (part[:, 0] - xs[0]) / (xs[-1] - xs[0])
            v = (part[:, 1] - ys[0]) / (ys[-1] - ys[0])
            part[:, 0] += skew[0] * v * (1 - u) + skew[1] * v * u
            part[:, 1] += skew[2] * u * (1 - v) + skew[3] * u * v
            mesh.add((part, faces), 0, rng.uniform(0, 1))
            joints.append((x, y, wide, deep))
            x += wide
        y += deep
    mesh.build("flagstones", smooth=True)
    soil = Mesh(soil_material)
    soil.add(shapes.grid(np.linspace(LEFT - 1, RIGHT + 1, 300), np.linspace(-4, BACK + 0.4, 300), lambda p: -0.016 + 0.006 * shapes.fbm(p * 7, 3, 6)))
    soil.build("soil", smooth=True)
    return joints


def arch(mesh, left, right, spring, place, depth=0.34, out=0.045, thick=0.27, stones=11, slot=2):
    """A round arch of wedges over an opening, on jambs of larger stones."""
    center, radius = (left + right) / 2, (right - left) / 2
    for k in range(stones):
        a0, a1 = np.pi * k / stones + 0.012, np.pi * (k + 1) / stones - 0.012
        reach = thick * (1.25 if k == stones // 2 else 1.0)
        v, f = block((-1, -depth, 0), (1, out + (0.03 if k == stones // 2 else rng.normal(0, 0.006)), 1), 0.0, 0.0, 12)
        t = (v[:, 0] + 1) / 2
        low = radius + 0.004
        angle = a0 + t * (a1 - a0)
        r = low + np.clip(v[:, 2], 0, 1) * reach
        points = np.stack([center - r * np.cos(angle), v[:, 1], spring + r * np.sin(angle)], axis=1)
        seed = int(rng.integers(1 << 20))
        points[:, 1] += 0.010 * shapes.fbm(points * 6, 4, seed)
        points[:, 1] -= 0.025 * (np.abs(2 * t - 1) > 0.97) + 0.025 * (np.abs(2 * v[:, 2] - 1) > 0.97)
        mesh.add(place((points, f)), slot, rng.uniform(0.3, 0.9))
    z = 0.0
    turn = 0
    while z < spring - 0.05:
        h = min(rng.uniform(0.26, 0.36), spring - z)
        if spring - (z + h) < 0.12:
            h = spring - z
        for side in (-1, 1):
            w = (0.34 if (turn + (side > 0)) % 2 else 0.22) + rng.normal(0, 0.012)
            edge = left if side < 0 else right
            u0, u1 = (edge - w, edge) if side < 0 else (edge, edge + w)
            mesh.add(place(block((u0 + 0.006, -depth, z + 0.006), (u1 - 0.006, out + rng.normal(0, 0.005), z + h - 0.006), 0.02, 0.012)), slot, rng.uniform(0.3, 0.9))
        z += h
        turn += 1


def door(wood, iron, left, right, spring, place):
    """Planks under an arch, on two long hinges, with nails, a ring and a lock."""
    mesh = Mesh(wood, iron)
    center, radius = (left + right) / 2, (right - left) / 2
    u = left
    while u < right - 0.02:
        w = min(rng.uniform(0.13, 0.18), right - u)
        top = spring + np.sqrt(max(radius**2 - (u + w / 2 - center) ** 2, 0.0))
        mesh.add(place(shapes.box((u + 0.003, -0.24 + rng.normal(0, 0.002), 0.06), (u + w - 0.003, -0.19 + rng.normal(0, 0.003), top), 0.005)), 0, rng.uniform(0, 1))
        u += w
    for z in (0.55, 1.75):
        strap = shapes.box((left + 0.02, -0.19, z - 0.028), (right - 0.22, -0.178, z + 0.028), 0.004)
        v = strap[0]
        v[:, 2] = z + (v[:, 2] - z) * (1.0 - 0.55 * (v[:, 0] - left) / (right - left))
        mesh.add(place(strap), 1)
        for x in np.arange(left + 0.08, right - 0.25, 0.13):
            mesh.add(place(shapes.moved(shapes.sphere(6), (x, -0.178, z), scale=0.011)), 1)
    for z in np.arange(0.3, 2.2, 0.3):
        for x in np.arange(left + 0.08, right, 0.155):
            if z < spring + 0.2:
                mesh.add(place(shapes.moved(shapes.sphere(5), (x + rng.normal(0, 0.004), -0.188, z + rng.normal(0, 0.006)), scale=0.008)), 1)
    t = np.linspace(0, TAU, 30)
    ring = np.stack([right - 0.17 + 0.05 * np.sin(t), np.full(30, -0.165), 1.08 - 0.05 + 0.05 * np.cos(t)], axis=1)
    mesh.add(place(shapes.tube(ring, 0.007, 8)), 1)
    mesh.add(place(shapes.box((right - 0.21, -0.19, 0.90), (right - 0.13, -0.180, 1.14), 0.006)), 1)
    mesh.build("door")


def ivy(name, leaf_material, stem_material, place, low, high, spread, top, count, seed):
    """Stems that climb a wall and fork, and leaves that hang in front of it."""
    r = np.random.default_rng(seed)
    mesh = Mesh(stem_material, leaf_material)
    at = []
    for _ in range(count):
        u, z = r.uniform(low, high), 0.0
        line = []
        heading = r.normal(0, 0.25)
        reach = top * r.uniform(0.45, 1.0)
        while z < reach:
            line.append([u, 0.03 + 0.012 * np.sin(9 * z + u), z])
            heading = 0.86 * heading + r.normal(0, 0.2)
            u += 0.06 * heading * spread
            z += 0.06
        line = np.array(line)
        if len(line) < 4:
            continue
        mesh.add(place(shapes.tube(line, np.linspace(0.011, 0.003, len(line)), 5, capped=False)), 0)
        n = len(line) * 17
        i = r.integers(0, len(line), n)
        side = r.normal(0, 0.13, n) * (1.1 - 0.6 * i / len(line))
        at.append(line[i] + np.stack([side, r.uniform(0.015, 0.13, n), r.normal(0, 0.06, n)], axis=1))
    at = np.concatenate(at)
    n = len(at)
    toward = np.stack([r.normal(0, 0.5, n), 0.35 + 0.2 * r.normal(0, 1, n), np.full(n, -1.0)], axis=1)
    normals = np.stack([r.normal(0, 0.35, n), np.ones(n), 0.45 + r.normal(0, 0.3, n)], axis=1)
    v, f, each = shapes.leaves(at, toward, normals, 0.068 * r.uniform(0.5, 1.25, n), 0.95, 0.18, 0.2)
    mesh.add(place((v, f)), 1, np.repeat(r.uniform(0, 1, n), each))
    mesh.build(name, smooth=True)


# Things in the yard

def barrel(at, wood, iron):
    mesh = Mesh(wood, iron)
    z = np.linspace(0, 0.92, 24)
    radius = 0.27 + 0.065 * np.sin(np.pi * z / 0.92)
    staves = 22
    for k in range(staves):
        a0, a1 = TAU * k / staves + 0.008, TAU * (k + 1) / staves - 0.008
        a = np.linspace(a0, a1, 5)
        bow = 0.004 * np.sin(np.linspace(0, np.pi, 5))
        r = radius[:, None] + bow[None]
        points = np.stack([r * np.cos(a), r * np.sin(a), np.repeat(z[:, None], 5, axis=1)], axis=-1).reshape(-1, 3)
        mesh.add(shapes.moved((points, shapes.strip_faces(24, 5)), at), 0, rng.uniform(0, 1))
    mesh.add(shapes.moved(shapes.lathe([(0.262, 0.0), (0.262, 0.92)], 44), at), 1)
    mesh.add(shapes.moved(shapes.lathe([(0.28, 0.90), (0.24, 0.90), (0.24, 0.84), (0.0, 0.84)], 44), at), 0, 0.2)
    for zz in (0.07, 0.24, 0.66, 0.83):
        r = 0.27 + 0.065 * np.sin(np.pi * zz / 0.92) + 0.006
        mesh.add(shapes.moved(shapes.lathe([(r - 0.006, zz - 0.022), (r, zz - 0.022), (r + 0.002, zz), (r, zz + 0.022), (r - 0.006, zz + 0.022)], 48), at), 1)
    mesh.build("barrel", smooth=True).data.set_sharp_from_angle(angle=0.6)


def pot(at, size, clay, soil, plant_objects, name):
    profile = np.array([(0.0, 0.0), (0.62, 0.0), (0.66, 0.05), (0.86, 0.92), (1.0, 0.93), (1.02, 1.12), (0.94, 1.14), (0.90, 1.0), (0.0, 0.98)]) * size * np.array([0.55, 0.62])
    mesh = Mesh(clay, soil).add(shapes.moved(shapes.lathe(profile[:-1], 40), at), 0).add(shapes.moved(shapes.lathe(profile[-2:], 40), at), 1)
    mesh.build(name, smooth=True).data.set_sharp_from_angle(angle=0.7)
    point = np.array([[at[0], at[1], at[2] + 0.6 * size]])
    shapes.scatter(name + " plant", plant_objects, point, [rng.uniform(0, 6)], [1.0])


def fire_basket(iron, charred, middle):
    """A basket of iron bars on four legs, with logs in it. The fire stands on the logs."""
    mesh = Mesh(iron)
    at = np.array([middle[0], middle[1], 0.0])
    bottom, rim = 0.26, 0.62

    def hoop(radius, z, thickness):
        t = np.linspace(0, TAU, 49)
        mesh.add(shapes.tube(np.stack([radius * np.cos(t), radius * np.sin(t), np.full(49, z)], axis=1) + at, thickness, 8))

    hoop(0.25, bottom, 0.012)
    hoop(0.315, 0.44, 0.010)
    hoop(0.37, rim, 0.014)
    for k in range(18):
        a = TAU * k / 18
        line = [[r * np.cos(a), r * np.sin(a), z] for r, z in ((0.25, bottom), (0.315, 0.44), (0.37, rim), (0.385, rim + 0.05))]
        mesh.add(shapes.tube(np.array(line) + at, 0.0075, 7))
    for x in np.linspace(-0.2, 0.2, 6):
        reach = np.sqrt(0.25**2 - x**2)
        mesh.add(shapes.tube(np.array([[x, -reach, bottom], [x, reach, bottom]]) + at, 0.008, 6))
    for k in range(4):
        a = TAU * (k + 0.5) / 4
        leg = [[r * np.cos(a), r * np.sin(a), z] for r, z in ((0.25, bottom + 0.02), (0.29, 0.13), (0.37, 0.006), (0.42, 0.006))]
        mesh.add(shapes.tube(np.array(leg) + at, 0.013, 8))
    mesh.build("basket", smooth=True)
    for start, end, radius in (
        ((-0.20, -0.10, 0.32), (0.20, -0.06, 0.33), 0.052), ((-0.21, 0.08, 0.32), (0.20, 0.10, 0.33), 0.055), ((-0.08, -0.22, 0.42), (-0.06, 0.23, 0.43), 0.046),
        ((0.11, -0.22, 0.42), (0.09, 0.22, 0.42), 0.048), ((-0.22, 0.02, 0.50), (0.24, -0.04, 0.54), 0.042), ((-0.14, 0.14, 0.47), (0.10, -0.12, 0.62), 0.034),
    ):
        t = np.linspace(0, 1, 10)[:, None]
        path = at + np.array(start) * (1 - t) + np.array(end) * t
        part, tint = plants.trunk(rng, path, np.full(10, radius), 60, 0.012, 0.007, 8, 0.0)
        sides = 60
        caps = Mesh(charred).add(part, 0, tint)
        for ring_of in (part[0][:sides], part[0][-sides:]):
            shares = np.array([0.0, 0.5, 0.99])
            middle_of = ring_of.mean(axis=0)
            caps.add(((middle_of + shares[:, None, None] * (ring_of - middle_of)).reshape(-1, 3), shapes.strip_faces(3, sides, closed=True)), 0, 0.5)
        caps.build("log", smooth=True)


def lantern(place, u, z, iron, pane):
    """An iron lantern on a bracket, not lit."""
    mesh = Mesh(iron, pane)
    for part in (
        shapes.tube([[u, 0.0, z + 0.42], [u, 0.14, z + 0.47], [u, 0.28, z + 0.43]], 0.011, 8), shapes.tube([[u, 0.0, z + 0.22], [u, 0.16, z + 0.42]], 0.008, 8),
        shapes.box((u - 0.012, 0.0, z + 0.15), (u + 0.012, 0.012, z + 0.52), 0.003),
    ):
        mesh.add(place(part))
    for x0, y0 in ((-0.07, -0.07), (0.07, -0.07), (-0.07, 0.07), (0.07, 0.07)):
        mesh.add(place(shapes.tube([[u + x0 * 0.7, 0.28 + y0 * 0.7, z], [u + x0, 0.28 + y0, z + 0.24]], 0.006, 6)))
    mesh.add(place(shapes.box((u - 0.06, 0.22, z - 0.02), (u + 0.06, 0.34, z), 0.004)))
    roof = shapes.lathe([(0.14, 0.0), (0.135, 0.015), (0.05, 0.11), (0.03, 0.15), (0.0, 0.17)], 4)
    mesh.add(place(shapes.moved(roof, (u, 0.28, z + 0.24), np.pi / 4)))
    for side in (-1, 1):
        mesh.add(place(shapes.box((u - 0.055, 0.28 + side * 0.055 - 0.001, z), (u + 0.055, 0.28 + side * 0.055 + 0.001, z + 0.24))), 1)
    mesh.build("lantern")


def small_window(place, stone, frame, pane, room, u0, u1, z0, z1, bars=None):
    """A window with stone surround in a hole of the wall."""
    mesh = Mesh(stone, frame, pane, room, *([bars] if bars else []))
    for low, high in (((u0 - 0.17, z0 - 0.16), (u1 + 0.17, z0)), ((u0 - 0.2, z1), (u1 + 0.2, z1 + 0.22)), ((u0 - 0.17, z0), (u0, z1)), ((u1, z0), (u1 + 0.17, z1))):
        mesh.add(place(block((low[0], -0.34, low[1] + 0.004), (high[0], 0.05 if high[1] <= z0 else 0.03, high[1] - 0.004), 0.015, 0.008)), 0, rng.uniform(0.4, 0.9))
    t = 0.05
    middle, across = (u0 + u1) / 2, (z0 + z1) / 2
    for low, high in (((u0, z0), (u0 + t, z1)), ((u1 - t, z0), (u1, z1)), ((u0, z0), (u1, z0 + t)), ((u0, z1 - t), (u1, z1)), ((middle - 0.025, z0), (middle + 0.025, z1)), ((u0, across - 0.012), (u1, across + 0.012))):
        mesh.add(place(shapes.box((low[0], -0.22, low[1]), (high[0], -0.16, high[1]), 0.008)), 1)
    v, f = shapes.grid(np.array([u0, u1]), np.array([z0, z1]))
    mesh.add(place((np.stack([v[:, 0], np.full(len(v), -0.19), v[:, 1]], axis=1), f)), 2)
    mesh.add(place(shapes.box((u0 - 0.5, -0.95, z0 - 0.4), (u1 + 0.5, -0.9, z1 + 0.4))), 3)
    for side, edge in ((-1, u0), (1, u1)):
        mesh.add(place(shapes.box((min(edge, edge + side * 0.5), -0.9, z0 - 0.4), (max(edge, edge + side * 0.5), -0.36, z1 + 0.4))), 3)
    if bars:
        for u in np.linspace(u0, u1, 5)[1:-1]:
            mesh.add(place(shapes.tube([[u, -0.06, z0], [u, -0.06, z1]], 0.011, 8)), 4)
    mesh.build("window")


def build(args):
    plate.empty_scene()
    view = plate.camera(POSITION, TARGET, FOV_DEG)
    plate.gradient_sky(
        [(0.0, (0.80, 0.50, 0.34)), (0.14, (0.56, 0.47, 0.46)), (0.35, (0.27, 0.33, 0.46)), (1.0, (0.12, 0.185, 0.34))], 1.0, 0.35,
        (0.40, 0.33, 0.36), ((-0.9, -0.5, 0.10), (1.3, 0.60, 0.24), 5.0))

    stone = masonry("rubble", (0.125, 0.115, 0.10), (0.27, 0.235, 0.185))
    ashlar = masonry("ashlar", (0.21, 0.19, 0.155), (0.30, 0.265, 0.21))
    bond = mortar()
    on_back = lambda part: (np.stack([LEFT + part[0][:, 0], BACK - part[0][:, 1], part[0][:, 2]], axis=1), part[1])
    on_left = lambda part: (np.stack([LEFT + part[0][:, 1], BACK - part[0][:, 0], part[0][:, 2]], axis=1), part[1])
    on_right = lambda part: (np.stack([RIGHT - part[0][:, 1], BACK - part[0][:, 0], part[0][:, 2]], axis=1), part[1])

    # The house at the back: an arched door, a window on each floor.
    d0, d1, spring = 2.55, 3.75, 1.72
    lit_window, dark_window, upper = (5.45, 6.25, 1.15, 2.15), (0.75, 1.45, 1.35, 2.2), (2.65, 3.55, 3.55, 4.65)
    upper_right = (5.6, 6.4, 3.6, 4.6)
    width = RIGHT - LEFT
    arch_holes = [(d0 - 0.30, d1 + 0.30, -1.0, spring)]
    for k in range(10):
        z = spring + k * 0.095
        r = (d1 - d0) / 2 + 0.27
        reach = np.sqrt(max(r**2 - (z + 0.05 - spring) ** 2, 0.0))
        arch_holes.append(((d0 + d1) / 2 - reach, (d0 + d1) / 2 + reach, z, z + 0.095))
    frames = [(a - 0.17, b + 0.17, c - 0.16, d + 0.22) for a, b, c, d in (lit_window, dark_window, upper, upper_right)]
    openings = [(d0, d1, -1.0, spring + 0.6), lit_window, dark_window, upper, upper_right]
    wall = Mesh(stone, bond, ashlar)
    courses(wall, width, 6.1, [*arch_holes, *frames], on_back)
    mortar_sheet(wall, width, 6.1, openings, on_back)
    arch(wall, d0, d1, spring, on_back)
    # Reveals and a dark hall behind the door.
    wall.add(on_back(shapes.box((d0 - 0.6, -0.45, 0), (d1 + 0.6, -0.40, 3.0))), 1)
    for z, out in ((0.0, 0.42), (0.0, 0.0)):
        wall.add(on_back(block((d0 - 0.25 + out * 0.2, -0.3, -0.08), (d1 + 0.25 - out * 0.2, 0.46 - out * 0.2, 0.10 - 0.04 * (out > 0)), 0.025, 0.012, 24)), 2, 0.6)
    # Larger stones at the corner of the house.
    z, turn = -0.05, 0
    while z < 6.1:
        h = rng.uniform(0.28, 0.38)
        wide, deep = (0.52, 0.26) if turn % 2 else (0.28, 0.5)
        wall.add(on_back(block((width - wide, -deep, z + 0.007), (width + 0.035 + rng.normal(0, 0.005), 0.03 + rng.normal(0, 0.006), z + h - 0.007), 0.022, 0.014)), 2, rng.uniform(0.2, 0.9))
        z += h
        turn += 1
    wall.build("back wall", smooth=True)

    side = Mesh(stone, bond, ashlar)
    left_window = (2.1, 2.8, 1.25, 2.15)
    left_frame = (2.1 - 0.17, 2.8 + 0.17, 1.25 - 0.16, 2.15 + 0.22)
    courses(side, BACK + 2.0, 4.4, [left_frame], on_left)
    mortar_sheet(side, BACK + 2.0, 4.4, [left_window], on_left)
    courses(side, BACK + 1.0, 2.5, [], on_right)
    mortar_sheet(side, BACK + 1.0, 2.5, [], on_right)
    for place, top, length in ((on_left, 4.35, BACK + 2.0), (on_right, 2.45, BACK + 1.0)):
        u = 0.0
        while u < length:
            w = rng.uniform(0.5, 0.8)
            side.add(place(block((u + 0.006, -0.35, top), (u + w - 0.006, 0.09, top + 0.13), 0.03, 0.015)), 2, rng.uniform(0, 1))
            u += w
    side.build("side walls", smooth=True)

    # Windows, door, lantern.
    s = Shader("old pane")
    pane = s.finish(s.pane((0.86, 0.93, 0.88), 0.015, s.bump(s.noise(5.0, 3.0), 0.006)))
    frame = plain("window paint", (0.11, 0.14, 0.125), 0.5)
    dark = plain("dark room", (0.012, 0.011, 0.010), 0.9)
    s = Shader("lit room")
    things = s.cells(2.2, vector=s.stretched(s.position(), (1.0, 1.0, 0.8)), output=1)
    warm = s.mix(0.4, (1.0, 0.55, 0.20), things, "MULTIPLY")
    lit = s.finish(s.emission(warm, s.remap(s.noise(1.4, 3.0), 0.3, 0.7, 0.25, 1.0)))
    iron = plain("wrought iron", (0.018, 0.017, 0.017), 0.48, Metallic=0.7)
    small_window(on_back, ashlar, frame, pane, lit, *lit_window)
    small_window(on_back, ashlar, frame, pane, dark, *dark_window, bars=iron)
    small_window(on_back, ashlar, frame, pane, dark, *upper)
    small_window(on_back, ashlar, frame, pane, dark, *upper_right)
    small_window(on_left, ashlar, frame, pane, dark, *left_window, bars=iron)
    door(planks("door planks", (0.045, 0.075, 0.065)), iron, d0, d1, spring, on_back)
    lantern(on_back, d1 + 0.62, 1.95, iron, plain("dirty glass", (0.07, 0.065, 0.05), 0.25))

    # Shutters beside the upper windows; a wooden bench; a gutter and its pipe.
    shutter = Mesh(planks("shutter", (0.05, 0.085, 0.07)), iron)
    for a, b, z0, z1 in (lit_window, upper, upper_right):
        for u0 in (a - 0.21 - (b - a) / 2, b + 0.21):
            w = (b - a) / 2 - 0.02
            for k in range(3):
                shutter.add(on_back(shapes.box((u0 + k * w / 3 + 0.003, 0.03, z0), (u0 + (k + 1) * w / 3 - 0.003, 0.055 + rng.normal(0, 0.002), z1), 0.004)), 0, rng.uniform(0, 1))
            for z in (z0 + 0.14, z1 - 0.2):
                shutter.add(on_back(shapes.box((u0 + 0.01, 0.055, z), (u0 + w - 0.01, 0.08, z + 0.07), 0.005)), 0, rng.uniform(0, 1))
    shutter.build("shutters")
    zinc = plain("zinc", (0.17, 0.175, 0.18), 0.38, Metallic=0.6)
    pipe = np.array([[width - 0.5, 0.10, 6.1], [width - 0.5, 0.10, 0.25], [width - 0.5, 0.22, 0.08]])
    pipes = Mesh(zinc).add(on_back(shapes.tube(pipe, 0.048, 14)))
    for z in (0.8, 2.4, 4.0, 5.6):
        pipes.add(on_back(shapes.tube([[width - 0.5, 0.10, z], [width - 0.5, 0.10, z + 0.04]], 0.057, 14)))
    pipes.build("pipe", smooth=True)
    bench_wood = planks("bench wood", (0.19, 0.155, 0.12), "X")
    bench = Mesh(bench_wood, ashlar)
    for k in range(3):
        bench.add(shapes.box((1.75, 5.72 + 0.135 * k, 0.44 + rng.normal(0, 0.002)), (3.35, 5.72 + 0.135 * k + 0.125, 0.485), 0.008), 0, rng.uniform(0, 1))
    for x in (1.95, 3.0):
        bench.add(block((x, 5.75, -0.02), (x + 0.2, 6.1, 0.44), 0.025, 0.012), 1, 0.4)
    bench.build("bench", smooth=True).data.set_sharp_from_angle(angle=0.6)

    joints = paving(flagstone(), joint_soil())

    # Plants: ivy, pots, grass in the joints, moss at the walls' feet.
    leaf = plants.foliage("ivy leaves", (0.022, 0.055, 0.014), (0.045, 0.075, 0.022), 0.33, 0.15)
    stem = plants.bark("ivy stem", (0.03, 0.025, 0.018), (0.09, 0.075, 0.055), scale=3.0)
    ivy("ivy left", leaf, stem, on_left, 3.2, 5.2, 1.4, 4.3, 16, 3)
    ivy("ivy corner", leaf, stem, on_left, 0.05, 0.9, 1.0, 4.4, 10, 4)
    ivy("ivy back", leaf, stem, on_back, 0.1, 0.7, 0.9, 4.2, 8, 5)
    ivy("ivy right", leaf, stem, on_right, 1.8, 4.2, 1.5, 2.6, 15, 6)
    grass = plants.foliage("joint grass", (0.045, 0.085, 0.016), (0.10, 0.105, 0.035), 0.45, 0.35)
    tufts = plants.grass_tufts(rng, "joint tuft", grass, 4, 0.085, 16, 0.022, 0.0032, 0.7)
    herb = plants.herbs(rng, "joint herb", plants.foliage("weeds", (0.035, 0.085, 0.016), (0.06, 0.10, 0.022), 0.4, 0.35), 4, 0.05, 8)
    spots = []
    for x, y, wide, deep in joints:
        patchy = shapes.fbm(np.array([[x, y, 0.0]]) * 0.6, 2, 9)[0]
        for _ in range(int(rng.poisson(max(0.0, 1.6 + 5.0 * patchy)))):
            spots.append([x + rng.normal(0, 0.005), y + rng.uniform(0, deep), -0.012] if rng.uniform() < 0.5 else [x + rng.uniform(0, wide), y + rng.normal(0, 0.005), -0.012])
    for _ in range(260):
        spots.append([LEFT + abs(rng.normal(0, 0.09)) + 0.02, rng.uniform(-1, BACK), -0.01])
        spots.append([rng.uniform(LEFT, RIGHT), BACK - abs(rng.normal(0, 0.07)) - 0.02, -0.01])
        spots.append([RIGHT - abs(rng.normal(0, 0.09)) - 0.02, rng.uniform(-1, BACK), -0.01])
    spots = np.array(spots)
    clear = ~((np.abs(spots[:, 0] - (LEFT + (d0 + d1) / 2)) < 0.8) & (spots[:, 1] > BACK - 0.7))
    spots = spots[clear]
    half = rng.uniform(size=len(spots)) < 0.68
    shapes.scatter("tufts", tufts, spots[half], rng.uniform(0, 6.3, half.sum()), rng.uniform(0.4, 1.4, half.sum()), rng.normal(0, 0.2, (half.sum(), 2)))
    shapes.scatter("weeds", herb, spots[~half], rng.uniform(0, 6.3, (~half).sum()), rng.uniform(0.5, 1.6, (~half).sum()))
    fallen = plants.litter(rng, "yard leaf", plants.foliage("yard leaves", (0.17, 0.085, 0.025), (0.09, 0.05, 0.02), 0.45, 0.1), 4, 0.05, 3, 0.2)
    n = 150
    where = np.stack([rng.uniform(LEFT, RIGHT, n), rng.uniform(-3, BACK, n), np.full(n, 0.003)], axis=1)
    shapes.scatter("yard litter", fallen, where, rng.uniform(0, 6.3, n), rng.uniform(0.6, 1.2, n))
    clay = plain("clay", (0.24, 0.095, 0.05), 0.75)
    earth = plain("pot soil", (0.022, 0.016, 0.011), 0.95)
    green = plants.foliage("box leaves", (0.030, 0.072, 0.016), (0.050, 0.090, 0.022), 0.35, 0.25)
    bushes = [plants.shrub(np.random.default_rng(400 + k), f"pot bush{k}", (0.62, 0.42, 0.5)[k], stem, green, (0.028, 0.035, 0.03)[k], 12, 0.5, 12) for k in range(3)]
    geranium = plain("geranium", (0.52, 0.02, 0.025), 0.6)
    pot((LEFT + 2.15, BACK - 0.42, 0.0), 0.62, clay, earth, bushes[:1], "pot1")
    pot((LEFT + 1.75, BACK - 0.85, 0.0), 0.42, clay, earth, bushes[1:2], "pot2")
    pot((LEFT + 4.35, BACK - 0.40, 0.0), 0.50, clay, earth, bushes[2:], "pot3")
    blooms = Mesh(geranium)
    for _ in range(26):
        head = np.array([LEFT + 1.75, BACK - 0.85, 0.26]) + np.array([*rng.normal(0, 0.13, 2), rng.uniform(0.18, 0.46)])
        for _ in range(7):
            blooms.add(shapes.moved(shapes.stone(rng, (0.013, 0.013, 0.006), 5, 0, 0), head + rng.normal(0, 0.014, 3)))
    blooms.build("geraniums")

    barrel((RIGHT - 0.55, 5.75, 0.0), planks("staves", (0.12, 0.075, 0.045)), iron)
    wood = Mesh(plants.bark("log bark", (0.022, 0.017, 0.013), (0.115, 0.088, 0.066), mossy=0.2, scale=1.2), plain("split", (0.26, 0.18, 0.105), 0.75))
    for row in range(6):
        for k in range(9):
            y = 3.1 + 0.165 * k + 0.08 * (row % 2) + rng.normal(0, 0.01)
            z = 0.085 + 0.15 * row + rng.normal(0, 0.005)
            r = rng.uniform(0.068, 0.088)
            x = RIGHT - 0.48 + rng.normal(0, 0.03)
            part, tint = plants.trunk(rng, np.stack([np.linspace(x, x + 0.4, 6), np.full(6, y), np.full(6, z)], axis=1), np.full(6, r), 40, 0.02, 0.006, 7, 0.0)
            wood.add(part, 0, tint)
            front = part[0][:40]
            shares = np.array([0.0, 0.5, 0.99])
            center = front.mean(axis=0)
            wood.add(((center + shares[:, None, None] * (front - center)).reshape(-1, 3), shapes.strip_faces(3, 40, closed=True)), 1, rng.uniform(0, 1))
    wood.build("woodpile", smooth=True).data.set_sharp_from_angle(angle=0.8)

    s = Shader("charred")
    coal = s.mix(s.remap(s.noise(20.0, 7.0, 0.7), 0.52, 0.66, 0.0, 0.55), (0.012, 0.011, 0.010), (0.15, 0.14, 0.13))
    wood_tone = s.shade((0.10, 0.07, 0.045), s.remap(s.noise(40.0, 6.0), 0.3, 0.7, 0.5, 1.4))
    tone = s.mix(s.remap(s.noise(6.0, 4.0), 0.42, 0.6, 1.0, 0.15), wood_tone, coal)
    groove = s.remap(s.cells(36.0, "DISTANCE_TO_EDGE"), 0.0, 0.1)
    fire_basket(iron, s.finish(s.principled(tone, 0.65, s.bump(groove, 0.006))), BASKET)

    # A tree and roofs beyond the walls.
    leaves = plants.foliage("yard tree leaves", (0.040, 0.085, 0.016), (0.075, 0.10, 0.024), 0.4, 0.4)
    bark = plants.bark("yard bark", (0.02, 0.016, 0.013), (0.10, 0.085, 0.065))
    trees = [plants.broadleaf(np.random.default_rng(500 + k), f"yard tree{k}", 8.5, bark, leaves, 0.09, 1.1, bare=0.3) for k in range(2)]
    points = np.array([[RIGHT + 2.2, 5.0, -0.3], [RIGHT + 4.5, 9.5, -0.3], [RIGHT + 7.5, 6.5, -0.3], [RIGHT + 6.0, 2.0, -0.3]])
    shapes.scatter("yard trees", trees, points, [0.4, 2.0, 3.3, 5.0], [1.0, 1.1, 1.0, 0.95])
    if args.lamps:
        plate.point_light((BASKET[0], BASKET[1], 0.85), (1.0, 0.45, 0.13), 130.0, 0.2)
    return view


if __name__ == "__main__":
    arguments = plate.options("courtyard")
    seen = build(arguments)
    plate.make("courtyard", arguments, 1.6, seen, air=(500.0, (0.26, 0.26, 0.30)), halo=0.06)
