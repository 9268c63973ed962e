"""`winter`: a cabin at a half frozen fjord below mountains, on a dark night: the sky and its light are left to Bansho."""

import numpy as np

import plants
import plate
import shapes
from north import birch, birch_bark, eroded, flat, resized, shore_stone, smoothstep, snow, water
from shaders import Shader, glow, plain
from shapes import TAU, Mesh

POSITION, TARGET, FOV_DEG = (0.0, 3.1, 0.0), (0.0, 6.3, -20.0), 47.0
FAR = 40000.0
CABIN, CABIN_TURN = np.array([10.6, 28.0]), 0.24

rng = np.random.default_rng(47)


# The ground near the camera. z is up, y away from the viewer; the water lies at z = 0.

def shore(x):
    """Where the land ends, for each x."""
    wander = 2.2 * shapes.fbm(flat(x, 0 * x, 0.11), 3, 4)
    return 18.5 + 24.0 * smoothstep(2.5, 13.0, x) + 9.0 * smoothstep(-7.0, -17.0, x) + wander


def trail(count):
    """The path to the cabin's door: `count` points along it."""
    stops = np.array([[-4.6, 3.0], [-2.7, 7.5], [-0.7, 11.0], [0.9, 14.2], [3.2, 17.6], [6.2, 20.4], [9.4, 22.9], [11.5, 25.2], [11.65, 25.9]])
    t = np.linspace(0, len(stops) - 1, 400)
    line = np.stack([np.interp(t, np.arange(len(stops)), stops[:, i]) for i in range(2)], axis=1)
    kernel = np.hanning(91)
    kernel /= kernel.sum()
    line = np.stack([np.convolve(np.pad(line[:, i], 45, mode="reflect", reflect_type="odd"), kernel, "valid") for i in range(2)], axis=1)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    s = np.linspace(0, length[-1], count)
    return np.stack([np.interp(s, length, line[:, i]) for i in range(2)], axis=1), length[-1]


def footprints():
    """Two lines of steps, there and back: (x, y, direction, depth)."""
    made = []
    r = np.random.default_rng(8)
    for side_of_trail, stride, seed in ((-0.16, 0.66, 1), (0.24, 0.60, 2)):
        _, length = trail(2)
        steps = int(length / stride)
        points, _ = trail(steps)
        tangent = np.gradient(points, axis=0)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        foot = np.where(np.arange(steps) % 2 == 0, 0.12, -0.12)
        wander = 0.12 * np.sin(np.arange(steps) * 0.23 + seed)
        at = points + normal * (side_of_trail + foot + wander + r.normal(0, 0.03, steps))[:, None] + tangent * r.normal(0, 0.05, (steps, 1))
        heading = np.arctan2(tangent[:, 1], tangent[:, 0]) + r.normal(0, 0.12, steps)
        made.append(np.column_stack([at, heading, r.uniform(0.15, 0.23, steps)]))
    return np.concatenate(made)


STEPS = footprints()


def trodden(x, y):
    """What the steps add to the height of the snow."""
    change = np.zeros_like(x)
    for sx, sy, heading, depth in STEPS:
        near = np.flatnonzero((np.abs(x - sx) < 0.75) & (np.abs(y - sy) < 0.75))
        if not len(near):
            continue
        c, s = np.cos(heading), np.sin(heading)
        u, v = (x[near] - sx) * c + (y[near] - sy) * s, -(x[near] - sx) * s + (y[near] - sy) * c
        ragged = 0.03 * shapes.noise(flat(x[near], y[near], 14.0), 3)
        r = np.hypot(u / 0.20, v / 0.105) + ragged / 0.1
        hole = -depth * (1 - smoothstep(0.72, 1.25, r))
        dragged = -0.35 * depth * (1 - smoothstep(0.5, 1.3, np.hypot((u + 0.30) / 0.22, v / 0.07)))
        rim = 0.032 * np.exp(-(((r - 1.45) / 0.28) ** 2)) * (1 + 0.9 * shapes.noise(flat(x[near], y[near], 22.0), 5))
        change[near] = np.minimum(change[near], np.minimum(hole, dragged)) + np.maximum(rim, 0)
    return change


def smooth_ground(x, y):
    s = shore(x) - y
    land = 0.22 + 1.25 * smoothstep(0.0, 11.0, s) + 0.35 * smoothstep(8.0, 22.0, s)
    land = land + smoothstep(1.0, 8.0, s) * 0.40 * shapes.fbm(flat(x, y, 0.085), 3, 21)
    far_side = smoothstep(13.0, 30.0, x) * smoothstep(20.0, 45.0, y) + smoothstep(-14.0, -30.0, x) * smoothstep(8.0, 25.0, y)
    return s, land + 1.1 * far_side


def ground(x, y):
    """Height of the snow: a bank, and a shelf of ice in front of open water."""
    s, land = smooth_ground(x, y)
    # Drifts, drawn out by the wind from the left, with steep lee sides.
    warp = 0.9 * shapes.fbm(flat(x, y, 0.25), 2, 31)
    ridge = shapes.ridged(np.stack([0.22 * x + 0.30 * y + warp, 0.75 * y - 0.22 * x + warp, 0 * x], axis=-1) * 0.55, 2, 33)
    drift = 0.34 * (ridge - 0.6) + 0.06 * shapes.fbm(flat(x, y, 0.45), 3, 35)
    ripples = 0.034 * shapes.ridged(np.stack([1.1 * x + 1.5 * y + 2 * warp, 3.2 * y - 1.0 * x + 2 * warp, 0 * x], axis=-1) * 0.9, 2, 37)
    bumps = 0.008 * shapes.fbm(flat(x, y, 3.1), 3, 39)
    land = land + smoothstep(-0.5, 4.0, s) * drift + ripples + bumps
    ice = 0.17 + 0.05 * shapes.fbm(flat(x, y, 0.3), 3, 41) + ripples + bumps
    height = np.where(s > 0, np.maximum(land, ice), ice)
    blend = smoothstep(-1.5, 1.5, s)
    height = ice * (1 - blend) + np.maximum(land, ice) * blend
    # Level at the cabin.
    at = np.hypot(x - CABIN[0], y - CABIN[1])
    height = height + (1.75 - height) * (1 - smoothstep(3.2, 6.5, at)) * 0.85
    # The edge of the ice, and floes.
    edge = 12.0 + 5.0 * shapes.fbm(flat(x, y, 0.06), 3, 43) + 1.2 * shapes.fbm(flat(x, y, 0.5), 3, 45)
    open_water = smoothstep(0.0, 0.35, -s - edge)
    cracked = shapes.fbm(flat(x, y * 0.6, 0.33), 3, 47)
    floe = smoothstep(0.40, 0.44, cracked) * (1 - smoothstep(8.0, 22.0, -s - edge))
    height = height * (1 - open_water) - 0.5 * open_water
    return np.where(open_water > 0.99, -0.5 + 0.62 * floe, height)


def ground_at(points):
    points = np.asarray(points, float)
    return ground(points[:, 0], points[:, 1])


def near_ground(material, columns, rows):
    """A sheet whose meshes are about equally large in the picture."""
    slope = np.linspace(-0.95, 0.95, columns)
    distance = np.geomspace(4.2, 95.0, rows)
    u, d = np.meshgrid(slope, distance)
    x, y = (u * d).ravel(), d.ravel()
    z = ground(x, y) + trodden(x, y) * (np.hypot(x - CABIN[0], y - CABIN[1]) > 2.6)
    return Mesh(material).add((np.stack([x, y, z], axis=1), shapes.strip_faces(rows, columns))).build("snow", smooth=True)


# Mountains

WEST, EAST, SOUTH, NORTH = -8000.0, 8000.0, 500.0, 9500.0
# (x, y, height, radius) of massifs: where land rises.
MASSIFS = (
    (-3050, 5000, 1.00, 1500), (-1750, 6500, 0.95, 950), (-4600, 3700, 0.75, 1300), (2300, 5400, 0.86, 1150), (3900, 4300, 0.95, 1250),
    (5600, 3600, 0.75, 1300), (330, 7200, 0.82, 1250), (-900, 9000, 0.7, 1000), (-6400, 4200, 0.9, 1500), (1750, 6100, 0.75, 900),
    (-1700, 3100, 0.24, 800), (7000, 5000, 0.9, 1600),
)


def mountains():
    """Heights on a grid, by erosion at doubled resolutions."""
    height = None
    for shape, rounds in (((141, 251), 45), ((282, 501), 30), ((563, 1001), 16), ((1125, 2001), 5)):
        cell = (EAST - WEST) / (shape[1] - 1)
        x, y = np.meshgrid(np.linspace(WEST, EAST, shape[1]), np.linspace(SOUTH, NORTH, shape[0]))
        wx = x + 420 * shapes.fbm(flat(x, y, 1 / 1300), 4, 61).reshape(shape)
        wy = y + 420 * shapes.fbm(flat(x, y, 1 / 1300), 4, 62).reshape(shape)
        crest = shapes.ridged(flat(wx, wy, 1 / 1700), 3, 64).reshape(shape)
        swell = 0.03
        for mx, my, tall, radius in MASSIFS:
            swell = np.maximum(swell, tall * np.exp(-(((wx - mx) ** 2 + (wy - my) ** 2) / radius**2) ** 1.1))
        lift = swell * (0.35 + 1.5 * np.clip(crest - 0.45, 0, 1) ** 1.1) * (smoothstep(700, 2400, y) * 0.97 + 0.03)
        base = y < SOUTH + 1.5 * cell
        if height is None:
            height = 1600 * lift + 60 * shapes.fbm(flat(x, y, 1 / 400), 5, 63).reshape(shape) * (0.1 + swell)
        else:
            height = resized(height, shape) + 0.30 * cell * shapes.fbm(flat(x, y, 1 / (4 * cell)), 3, 65).reshape(shape) * (0.1 + np.minimum(swell, 1))
        height[base] = 0
        height = eroded(height, lift * 14.0, base, cell, rounds, 0.016)
    return height


def far_terrain(material, columns, rows, peak=1380.0):
    """The far shore, foothills and mountains, in meshes that are about equally large in the picture."""
    table = mountains()
    scale = peak / np.quantile(table, 0.9995)
    slope = np.linspace(-0.92, 0.92, columns)
    distance = np.geomspace(520.0, 9400.0, rows)

    def height(x, y):
        i = np.clip((x - WEST) / (EAST - WEST) * (table.shape[1] - 1), 0, table.shape[1] - 1.001)
        j = np.clip((y - SOUTH) / (NORTH - SOUTH) * (table.shape[0] - 1), 0, table.shape[0] - 1.001)
        a, b = i.astype(int), j.astype(int)
        u, v = i - a, j - b
        u, v = u * u * (3 - 2 * u) * 0.5 + 0.5 * u, v * v * (3 - 2 * v) * 0.5 + 0.5 * v
        h = (table[b, a] * (1 - u) + table[b, a + 1] * u) * (1 - v) + (table[b + 1, a] * (1 - u) + table[b + 1, a + 1] * u) * v
        h = peak * (np.maximum(h, 0) * scale / peak) ** 1.2
        rugged = smoothstep(60.0, 420.0, h)
        warp = 18 * shapes.fbm(flat(x, y, 1 / 90), 2, 71)
        crags = shapes.ridged(flat(x + warp, y - warp, 1 / 95), 5, 73) - 0.55
        h = h + rugged * (62 * crags + 8 * shapes.fbm(flat(x, y, 1 / 34), 3, 75))
        bank = y - (640 + 60 * shapes.fbm(flat(x, 0 * x, 1 / 260), 4, 77) + 60 * smoothstep(0.0, 500.0, np.abs(x - 60)))
        rise = 2.0 + 0.03 * np.maximum(bank, 0) + 10 * smoothstep(0, 200, bank) * (0.6 + shapes.fbm(flat(x, y, 1 / 170), 4, 79))
        rise = rise + 75 * smoothstep(100, 900, bank) * np.clip(0.45 + shapes.fbm(flat(x, y, 1 / 620), 4, 81), 0, 2)
        return np.where(bank > 0, np.maximum(smoothstep(0, 14, bank) * rise + smoothstep(250, 1100, bank) * h, 0.3), -3.0)

    u, d = np.meshgrid(slope, distance)
    x, y = (u * d).ravel(), d.ravel()
    z = height(x, y)
    Mesh(material).add((np.stack([x, y, z], axis=1), shapes.strip_faces(rows, columns))).build("mountains", smooth=True)
    return height


# Materials

def mountain():
    """Snow on what is flat enough to hold it, rock elsewhere, and bare wood below."""
    s = Shader("mountain")
    p = s.position()
    up = s.upwardness()
    broad = s.math("MULTIPLY", s.math("SUBTRACT", s.noise(0.0022, 7.0, 0.62), 0.5), 0.60)
    fine = s.math("MULTIPLY", s.math("SUBTRACT", s.noise(0.045, 5.0, 0.65), 0.5), 0.26)
    strata = s.noise(1.0, 5.0, 0.6, s.stretched(p, (0.006, 0.006, 0.085)), 0.8)
    ledges = s.math("MULTIPLY", s.math("SUBTRACT", strata, 0.5), 0.40)
    level = s.math("ADD", s.math("ADD", up, broad), s.math("ADD", fine, ledges))
    cover = s.remap(level, 0.63, 0.70)
    rock = s.mix(s.remap(strata, 0.35, 0.65), (0.035, 0.036, 0.040), (0.105, 0.102, 0.10))
    rock = s.shade(rock, s.remap(s.noise(0.03, 7.0, 0.7), 0.3, 0.7, 0.6, 1.35))
    white = s.shade((0.78, 0.81, 0.85), s.remap(s.noise(0.012, 5.0), 0.3, 0.7, 0.90, 1.04))
    tone = s.mix(cover, rock, white)
    normal = s.bump(s.noise(0.05, 8.0, 0.68), 9.0, 0.55, s.bump(strata, 5.0, 0.35))
    return s.finish(s.principled(tone, 0.9, normal, Specular_IOR_Level=0.1))


def needles():
    """Dark green; some carry rime."""
    s = Shader("spruce needles")
    tint = s.attribute("tint")
    green = s.mix(tint, (0.012, 0.026, 0.014), (0.030, 0.046, 0.020))
    rime = s.math("MULTIPLY", s.remap(tint, 0.70, 0.78), s.remap(s.noise(1.1, 4.0), 0.35, 0.65, 0.25, 1.0))
    tone = s.mix(rime, green, (0.56, 0.60, 0.64))
    return s.finish(s.leaf(tone, 0.6, 0.15))


def logs_wood():
    s = Shader("cabin logs")
    p = s.position()
    grain = s.noise(1.0, 6.0, 0.65, s.stretched(p, (2.2, 26.0, 30.0)), 0.6)
    tone = s.mix(s.remap(grain, 0.3, 0.7), (0.070, 0.040, 0.023), (0.165, 0.095, 0.052))
    tone = s.mix(s.math("MULTIPLY", s.attribute("tint"), 0.55), tone, (0.085, 0.074, 0.064))
    tone = s.shade(tone, s.remap(s.noise(2.2, 6.0), 0.3, 0.7, 0.65, 1.2))
    return s.finish(s.principled(tone, 0.75, s.bump(grain, 0.008, 0.8)))


def lit_pane(strength):
    """A window of a room lit by lamps: brighter toward the lamp, darker toward the top and along curtains.

    What it lights is lit three times as strongly as a pane of this brightness would.
    """
    s = Shader("lit pane")
    uv = s.attribute("tint")
    tone = s.mix(s.noise(2.2, 3.0), (1.0, 0.47, 0.14), (1.0, 0.62, 0.27))
    level = s.math("MULTIPLY", s.remap(uv, 0.0, 1.0, 0.35, 1.0), s.remap(s.noise(5.0, 3.0), 0.3, 0.7, 0.65, 1.25))
    seen = s.node("ShaderNodeLightPath").outputs["Is Camera Ray"]
    return s.finish(s.emission(tone, s.math("MULTIPLY", level, s.remap(seen, 0.0, 1.0, 3.0 * strength, strength))))


# Trees

def spruce(name, height, bark_material, needle_material, snow_material, seed, crown=0.17, twig_step=0.075, needle_step=0.017, needle=0.05, load=1.0, pad=(13, 10), clumps=5.0):
    """A northern spruce that carries snow: whorls of drooping boughs, flat sprays of twigs, needles, and pads of snow on the boughs."""
    r = np.random.default_rng(seed)
    mesh = Mesh(bark_material, needle_material, snow_material)
    joints = 16
    stem = np.stack([
        0.012 * height * np.sin(np.linspace(0, 2.5, joints) + r.uniform(0, 6)), 0.012 * height * np.sin(np.linspace(0, 2.2, joints) + r.uniform(0, 6)),
        np.linspace(-0.3, height, joints)], axis=1)
    stem[:, :2] -= stem[:1, :2]
    mesh.add(shapes.tube(stem, np.linspace(0.010 * height + 0.015, 0.006, joints), 9, capped=False), 0)

    # Boughs.
    levels, z = [], 0.05 * height
    while z < height - 0.12:
        levels.append(z)
        z += (0.022 * height) * r.uniform(0.7, 1.25) * (0.5 + 0.5 * (1 - z / height)) + 0.03
    at_z, azimuth = [], []
    for z in levels:
        count = int(r.integers(5, 9))
        at_z += list(z + r.uniform(-0.5, 0.5, count) * 0.018 * height)
        azimuth += list(r.uniform(0, TAU) + np.arange(count) * TAU / count + r.normal(0, 0.22, count))
    at_z, azimuth = np.array(at_z), np.array(azimuth)
    share = np.clip(at_z / height, 0, 1)
    length = crown * height * ((1 - share) ** 0.88 * 0.98 + 0.02) * np.where(r.uniform(size=len(at_z)) < 0.28, r.uniform(0.25, 0.6, len(at_z)), r.uniform(0.7, 1.18, len(at_z)))
    length *= 1 - 0.35 * np.exp(-share / 0.06)
    count, joints = len(at_z), 9
    t = np.linspace(0, 1, joints)[None, :]
    first = np.where(share > 0.8, 0.75, 0.12)[:, None] + r.normal(0, 0.12, (count, 1))
    droop = (0.95 * (1 - 0.55 * share) * load * r.uniform(0.6, 1.3, count))[:, None]
    out = length[:, None] * t * (1 - 0.10 * t * droop)
    up = length[:, None] * (first * t - droop * t**1.7 + 0.30 * droop * t**4)
    turn = azimuth[:, None] + 0.12 * t * r.normal(0, 1, (count, 1))
    path = np.stack([out * np.cos(turn), out * np.sin(turn), at_z[:, None] + up], axis=-1)
    path[..., 0] += np.interp(at_z, stem[:, 2], stem[:, 0])[:, None]
    path[..., 1] += np.interp(at_z, stem[:, 2], stem[:, 1])[:, None]
    for p, l in zip(path, length):
        mesh.add(shapes.tube(p[::2], np.linspace(0.010 * l + 0.006, 0.003, len(p[::2])), 4, capped=False), 0)

    # Twigs: pairs along each bough, shorter toward its end.
    starts, ends = [], []
    for p, l in zip(path, length):
        k = max(int(l / twig_step), 3)
        s = np.repeat(np.linspace(0.10, 1.0, k), 2) + r.uniform(-0.5, 0.5, 2 * k) / k
        s = np.clip(s, 0.03, 1.0)
        i = np.minimum((s * (joints - 1)).astype(int), joints - 2)
        f = (s * (joints - 1) - i)[:, None]
        along = p[i + 1] - p[i]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        side = np.cross(along, [0, 0, 1.0])
        side /= np.linalg.norm(side, axis=1, keepdims=True) + 1e-9
        sign = np.tile([-1.0, 1.0], k)[:, None]
        heading = 0.75 * along + sign * side * r.uniform(0.6, 1.1, (2 * k, 1)) + np.array([0, 0, -0.32]) + r.normal(0, 0.15, (2 * k, 3))
        heading /= np.linalg.norm(heading, axis=1, keepdims=True)
        size = (0.36 * l * (1.05 - s) + 0.07) * r.uniform(0.6, 1.2, 2 * k)
        a = p[i] * (1 - f) + p[i + 1] * f
        starts.append(a)
        ends.append(a + heading * size[:, None])
    starts, ends = np.concatenate(starts + [p[:-1] for p in path]), np.concatenate(ends + [p[1:] for p in path])

    # Needles: flat lozenges that point forward on all sides of a twig.
    span = np.linalg.norm(ends - starts, axis=1)
    many = np.maximum((span / needle_step).astype(int), 2)
    which = np.repeat(np.arange(len(span)), many)
    f = r.uniform(0, 1.03, len(which))[:, None]
    base = starts[which] * (1 - f) + ends[which] * f
    forward = (ends - starts)[which] / span[which][:, None]
    away = r.normal(0, 1, base.shape)
    away -= forward * np.sum(away * forward, axis=1, keepdims=True)
    away /= np.linalg.norm(away, axis=1, keepdims=True) + 1e-9
    toward = 0.65 * forward + 0.75 * away + np.array([0, 0, -0.08])
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    across = np.cross(toward, r.normal(0, 1, base.shape))
    across /= np.linalg.norm(across, axis=1, keepdims=True) + 1e-9
    size = (needle * r.uniform(0.65, 1.2, len(base)))[:, None]
    corners = np.stack([base, base + 0.45 * size * toward + 0.11 * size * across, base + size * toward, base + 0.45 * size * toward - 0.11 * size * across], axis=1)
    faces = np.arange(4 * len(base)).reshape(-1, 4)
    mesh.add((corners.reshape(-1, 3), faces), 1, np.repeat(r.uniform(0, 1, len(base)), 4))

    # Snow: a lumpy pad along the outer part of most boughs.
    rings, sides = pad
    for turns in range(2):
        keep = (length > 0.16) & (r.uniform(size=count) < (0.93 if turns == 0 else 0.55))
        p, l, m = path[keep], length[keep], int(keep.sum())
        begin = r.uniform(0.10, 0.35, m) if turns == 0 else r.uniform(0.5, 0.65, m)
        stop = r.uniform(0.88, 1.06, m) if turns == 0 else r.uniform(0.9, 1.08, m)
        q = np.linspace(0, 1, rings)
        s = np.clip(begin[:, None] + (stop - begin)[:, None] * q, 0, 1.0) * (joints - 1)
        i = np.minimum(s.astype(int), joints - 2)
        f = (s - i)[..., None]
        row = np.arange(m)[:, None]
        center = p[row, i] * (1 - f) + p[row, i + 1] * f
        along = p[row, i + 1] - p[row, i]
        side = np.cross(along, [0, 0, 1.0])
        side /= np.linalg.norm(side, axis=-1, keepdims=True) + 1e-9
        if turns:
            center = center + side * (r.choice([-1, 1], m) * r.uniform(0.08, 0.16, m) * l)[:, None, None] + np.array([0, 0, -0.02])
        profile = np.sin(np.pi * np.clip(q, 0.0, 1.0)) ** 0.55
        width = ((0.085 * l + 0.035) * load * r.uniform(0.75, 1.3, m) * (0.7 if turns else 1.0))[:, None] * profile
        angle = np.arange(sides) / sides * TAU
        cosine, sine = np.cos(angle), np.sin(angle)
        tall = np.where(sine > 0, 0.72 * np.sqrt(np.abs(sine)), -0.22 * np.abs(sine))
        w = width[..., None]
        points = center[:, :, None, :] + side[:, :, None, :] * (w * cosine)[..., None]
        points[..., 2] += w * tall + 0.015
        flat_points = points.reshape(-1, 3)
        offset = r.uniform(-50, 50, 3)
        lumps = shapes.fbm(flat_points * 8.0 + offset, 3, seed + 5, 0.65)
        out_of = (points - center[:, :, None, :]).reshape(-1, 3)
        flat_points = flat_points + out_of * (0.55 * lumps)[:, None]
        quads = shapes.strip_faces(rings, sides, closed=True)
        all_faces = (quads[None] + (np.arange(m) * rings * sides)[:, None, None]).reshape(-1, 4)
        mesh.add((flat_points, all_faces), 2)
    # Clumps on the sprays beside them.
    chosen = r.integers(0, len(starts), int(clumps * count))
    f = r.uniform(0.2, 0.95, (len(chosen), 1))
    center = starts[chosen] * (1 - f) + ends[chosen] * f + np.array([0, 0, 0.01])
    along = (ends - starts)[chosen]
    along[:, 2] *= 0.5
    along /= np.linalg.norm(along, axis=1, keepdims=True) + 1e-9
    side = np.cross(along, [0, 0, 1.0])
    v, f = shapes.lathe([(0.0, 1.0), (0.6, 0.75), (0.95, 0.25), (0.9, -0.12), (0.5, -0.25), (0.0, -0.25)], 7)
    size = (0.045 * load * r.gamma(4.0, 0.25, len(chosen)) * (0.35 + 0.9 * np.clip(np.linalg.norm((ends - starts)[chosen], axis=1) / 0.25, 0, 1)) * (0.6 + 0.045 * height))[:, None, None]
    points = center[:, None, :] + size * (1.7 * v[None, :, :1] * along[:, None, :] + v[None, :, 1:2] * side[:, None, :] + 0.75 * v[None, :, 2:] * np.array([0, 0, 1.0]))
    points = points + size * 0.35 * shapes.fbm(points.reshape(-1, 3) * 11.0, 2, seed + 6).reshape(len(chosen), len(v), 1) * v[None]
    mesh.add((points.reshape(-1, 3), (f[None] + (np.arange(len(chosen)) * len(v))[:, None, None]).reshape(-1, 4)), 2)
    tip = np.array([[stem[-1, 0], stem[-1, 1], height - 0.30], [stem[-1, 0] + 0.01, stem[-1, 1], height - 0.1], [stem[-1, 0], stem[-1, 1], height + 0.05]])
    mesh.add(shapes.tube(tip, [0.02, 0.032, 0.008], 8), 2)
    return mesh.build(name, smooth=True, link=False)


# The cabin

def cabin(wood, dark_wood, snow_material, pane, stone_material, frame):
    mesh = Mesh(wood, dark_wood, snow_material, pane, stone_material, frame)
    r = np.random.default_rng(12)
    base = np.array([CABIN[0], CABIN[1], 1.62])
    long, deep, radius, courses = 2.75, 2.1, 0.115, 11

    def put(part, slot, tint=0.5):
        mesh.add(shapes.moved(part, base, CABIN_TURN), slot, tint)

    def beam(start, end, thick, slot=0):
        n = max(int(np.linalg.norm(np.subtract(end, start)) / 0.25), 2)
        t = np.linspace(0, 1, n)[:, None]
        path = np.asarray(start) * (1 - t) + np.asarray(end) * t
        path = path + r.normal(0, 0.004, path.shape)
        put(shapes.tube(path, thick * r.uniform(0.94, 1.05), 14), slot, r.uniform(0, 1))

    step = 1.86 * radius
    for k in range(courses):
        z = radius + k * step
        for side in (-1, 1):
            e = 0.26 + r.uniform(-0.03, 0.03)
            beam((-long - e, side * deep, z), (long + e, side * deep, z), radius)
            beam((side * long, -deep - e, z + step / 2), (side * long, deep + e, z + step / 2), radius)
    eaves, pitch = courses * step + 0.05, 0.68
    k = 0
    while True:
        z = eaves + k * step
        half = deep - (z - eaves) / pitch - 0.05
        if half < 0.15:
            break
        for side in (-1, 1):
            beam((side * long, -half, z), (side * long, half, z), radius)
        k += 1
    # Roof boards, rafters and the snow on them.
    over_x, over_y, ridge = long + 0.62, deep + 0.60, eaves + pitch * deep + 0.10
    top = lambda v: ridge - pitch * np.abs(v)
    for side in (-1, 1):
        n = 30
        for j in range(n):
            a, b = -over_x + 2 * over_x * j / n, -over_x + 2 * over_x * (j + 1) / n - 0.012
            v = np.array([[a, 0, 0], [b, 0, 0], [b, side * over_y, -pitch * over_y], [a, side * over_y, -pitch * over_y]], float)
            v[:, 2] += ridge
            low = v - np.array([0, 0, 0.05])
            put((np.concatenate([v, low]), np.array([[0, 1, 2, 3], [7, 6, 5, 4], [3, 2, 6, 7], [0, 3, 7, 4], [1, 5, 6, 2]])), 1, r.uniform(0, 1))
        for x in (-over_x, over_x):
            put(shapes.tube([[x, 0, ridge - 0.07], [x, side * (over_y + 0.02), top(over_y) - 0.07]], 0.075, 6), 1, 0.3)
    rows, columns = 150, 170
    u, v = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
    x, y = u * (over_x + 0.10), v * (over_y + 0.10)
    x = x + 0.05 * shapes.fbm(flat(y, 0 * y, 1.1), 3, 5).reshape(u.shape) * u**8
    y = y + 0.06 * shapes.fbm(flat(x, 0 * x, 1.0), 3, 6).reshape(u.shape) * v**8
    round_x, round_y = np.clip(1 - np.abs(u) ** 22, 0, 1) ** 0.5, np.clip(1 - np.abs(v) ** 22, 0, 1) ** 0.5
    lumps = shapes.fbm(np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3) * 0.8, 4, 7).reshape(u.shape)
    depth = (0.42 + 0.09 * lumps) * round_x * round_y
    smooth_top = ridge - pitch * (np.sqrt(y**2 + 0.35**2) - 0.12)
    z = smooth_top + depth - 0.10 + (1 - round_y) * -0.05
    put((np.stack([x, y, z], axis=-1).reshape(-1, 3), shapes.strip_faces(rows, columns)), 2)
    # The underside of the snow at the eaves.
    put((np.stack([x, y, np.minimum(top(np.abs(y)) - 0.02, z)], axis=-1).reshape(-1, 3), shapes.strip_faces(rows, columns)), 2)
    # Icicles.
    for _ in range(34):
        x0, l = r.uniform(-over_x, over_x), 0.08 + r.gamma(1.6, 0.07)
        y0 = -(over_y + 0.02)
        z0 = top(over_y) - 0.03
        put(shapes.tube([[x0, y0, z0 + 0.05], [x0 + 0.004, y0, z0 - 0.4 * l], [x0, y0, z0 - l]], [0.018, 0.012, 0.002], 6), 2)

    # Windows, a door.
    front = -deep - radius

    def opening(cx, cz, w, h, out, lit=True):
        """On the front for out = "y", on the gable for "x"."""
        def place(part):
            vertices, faces = part
            if out == "x":
                vertices = np.stack([-long - radius - (vertices[:, 1] * -1), vertices[:, 0], vertices[:, 2]], axis=1)
            else:
                vertices = vertices + np.array([0, front, 0])
            return vertices, faces
        if lit:
            grid_x, grid_z = np.meshgrid(np.linspace(-w / 2, w / 2, 24), np.linspace(-h / 2, h / 2, 20))
            points = np.stack([cx + grid_x.ravel(), np.full(grid_x.size, -0.012), cz + grid_z.ravel()], axis=1)
            a, b = 2 * grid_x / w, 2 * grid_z / h
            curtain = smoothstep(0.95, 0.55, np.abs(a) + 0.18 * b)
            level = curtain * (0.9 - 0.35 * b) * np.exp(-0.5 * ((a - 0.15) ** 2 + (b + 0.2) ** 2)) + 0.12
            put(place((points, shapes.strip_faces(20, 24))), 3, np.clip(level.ravel(), 0, 1))
        t = 0.075
        for low, high in (
            ((cx - w / 2 - t, -0.06, cz - h / 2 - t), (cx - w / 2, 0.05, cz + h / 2 + t)), ((cx + w / 2, -0.06, cz - h / 2 - t), (cx + w / 2 + t, 0.05, cz + h / 2 + t)),
            ((cx - w / 2, -0.06, cz + h / 2), (cx + w / 2, 0.05, cz + h / 2 + t)), ((cx - w / 2 - 0.1, -0.12, cz - h / 2 - t), (cx + w / 2 + 0.1, 0.05, cz - h / 2)),
            ((cx - 0.018, -0.045, cz - h / 2), (cx + 0.018, -0.015, cz + h / 2)), ((cx - w / 2, -0.045, cz + 0.10 * h - 0.014), (cx + w / 2, -0.015, cz + 0.10 * h + 0.014)),
        ):
            put(place(shapes.box(low, high, 0.006)), 5)
        sill = shapes.tube([[cx - w / 2 - 0.08, -0.09, cz - h / 2 + 0.01], [cx, -0.09, cz - h / 2 + 0.03], [cx + w / 2 + 0.08, -0.09, cz - h / 2 + 0.01]], [0.035, 0.05, 0.03], 8)
        put(place(sill), 2)

    opening(-1.55, 1.35, 0.95, 0.82, "y")
    opening(1.75, 1.35, 0.80, 0.82, "y")
    opening(-0.35, 1.35, 0.80, 0.78, "x")
    for k in range(6):
        x = 0.10 + 0.145 * k
        put(shapes.box((x, front - 0.03, 0.10), (x + 0.14, front + 0.06, 2.02), 0.006), 1, r.uniform(0, 1))
    for low, high in (((0.02, front - 0.06, 0.06), (0.10, front + 0.08, 2.10)), ((0.97, front - 0.06, 0.06), (1.05, front + 0.08, 2.10)), ((0.02, front - 0.06, 2.02), (1.05, front + 0.08, 2.11))):
        put(shapes.box(low, high, 0.006), 5)
    # A chimney, firewood, skis.
    chimney = shapes.box((0.9, 0.25, ridge - 0.6), (1.45, 0.8, ridge + 0.85), 0.03)
    put(chimney, 4)
    cap = shapes.sphere(14)
    put((cap[0] * np.array([0.36, 0.36, 0.20]) + np.array([1.175, 0.525, ridge + 0.92]), cap[1]), 2)
    for row in range(7):
        for k in range(9):
            y0 = -1.55 + 0.155 * k + (0.075 if row % 2 else 0)
            a = np.array([-long - 0.32, y0 + 0.9, 0.1 + 0.135 * row]) + r.normal(0, 0.01, 3)
            if a[1] > 1.5 or row > 4 + 2 * np.sin(k):
                continue
            put(shapes.tube([a + np.array([-0.26, 0, 0]), a + np.array([0.12, 0, 0])], r.uniform(0.055, 0.078), 9), 0, r.uniform(0, 1))
    for x in (-0.42, -0.30):
        put(shapes.box((x, front - 0.34, 0.0), (x + 0.07, front - 0.32, 0.02), 0.004), 5)
        v, f = shapes.box((x, -0.012, 0.0), (x + 0.075, 0.012, 1.85), 0.004)
        v[:, 1] += front - 0.36 + 0.16 * v[:, 2]
        put((v, f), 5)
    return mesh.build("cabin", smooth=True)


def build(args):
    scene = plate.empty_scene()
    view = plate.camera(POSITION, TARGET, FOV_DEG, FAR)
    plate.night_sky()
    detail = max(args.scale, 0.4)

    snow_near, snow_trees = snow(), snow("tree snow", 0.5, (0.78, 0.81, 0.85))
    near_ground(snow_near, round(1900 * detail), round(1300 * detail))
    sheet = Mesh(water())
    sheet.add(shapes.grid(np.linspace(-700, 700, 3), np.array([10.0, 120.0, 900.0])))
    sheet.build("water")
    height = far_terrain(mountain(), round(2000 * detail), round(900 * detail))
    # Land beside and behind the camera, which only lights what is seen.
    Mesh(snow_near).add(shapes.grid(np.array([-60.0, 60.0]), np.array([-60.0, 3.9]), 1.1)).build("behind")

    bark_material = plants.bark("spruce bark", (0.020, 0.015, 0.012), (0.085, 0.066, 0.052), mossy=0.1)
    needle_material = needles()
    tall = [
        spruce("spruce a", 9.5, bark_material, needle_material, snow_trees, 3, 0.165),
        spruce("spruce b", 7.2, bark_material, needle_material, snow_trees, 5, 0.18),
        spruce("spruce c", 4.6, bark_material, needle_material, snow_trees, 7, 0.21, 0.06, 0.015, 0.04),
        spruce("spruce d", 10.0, bark_material, needle_material, snow_trees, 9, 0.125, load=0.75),
        spruce("spruce e", 6.0, bark_material, needle_material, snow_trees, 11, 0.23, load=0.9),
    ]
    places = (
        # x, y, which, size, turn
        (-11.6, 16.0, 0, 0.78, 0.3), (-13.9, 18.6, 1, 1.10, 1.2), (-9.4, 18.2, 2, 0.72, 2.0), (-15.8, 22.5, 3, 0.95, 4.0), (-12.6, 22.8, 4, 0.85, 5.1),
        (-19.0, 25.5, 0, 1.05, 2.2), (-8.0, 20.6, 2, 0.38, 3.3), (-17.5, 29.0, 1, 1.2, 0.8), (-22.5, 31.0, 0, 1.1, 1.0), (-10.9, 20.1, 2, 0.5, 4.4),
        (15.3, 32.5, 3, 0.98, 1.7), (18.4, 29.2, 1, 1.02, 0.2), (12.9, 36.5, 3, 0.70, 3.0), (20.2, 35.5, 0, 1.30, 5.0), (17.0, 25.6, 2, 0.90, 0.9),
        (23.6, 31.5, 4, 0.95, 2.6), (24.5, 36.0, 0, 1.05, 4.4), (21.0, 40.0, 1, 1.45, 0.5), (9.4, 38.5, 1, 0.75, 4.9), (6.4, 34.0, 2, 0.85, 1.4),
        (28.5, 38.5, 0, 1.15, 3.6), (18.0, 41.5, 3, 1.25, 2.9), (20.3, 26.2, 4, 0.62, 4.1), (14.9, 21.6, 2, 0.42, 5.5), (5.1, 31.2, 2, 0.5, 2.4),
        (26.0, 44.0, 0, 1.0, 0.1), (31.0, 43.0, 3, 1.15, 5.9), (13.4, 39.8, 4, 1.15, 0.6), (16.9, 31.0, 2, 0.8, 3.3), (19.0, 32.5, 4, 0.8, 2.0),
        (22.3, 28.6, 2, 1.05, 0.7), (16.2, 36.5, 1, 1.0, 5.2),
    )
    for x, y, which, size, turn in places:
        item = tall[which].copy()
        item.location = (x, y, ground_at([(x, y)])[0] - 0.05)
        item.rotation_euler = (0.02 * np.sin(7 * x), 0.02 * np.cos(5 * y), turn)
        item.scale = (size,) * 3
        scene.collection.objects.link(item)

    # The forest at the foot of the mountains: the same trees, with fewer and larger needles.
    far = [
        spruce(f"far spruce {k}", h, bark_material, needle_material, snow_trees, 20 + k, crown, 0.22, 0.10, 0.20, load, (6, 6), 2.0)
        for k, (h, crown, load) in enumerate(((9.0, 0.15, 0.8), (7.0, 0.17, 0.9), (11.0, 0.14, 0.7), (5.0, 0.2, 1.0)))]
    n = 150000
    d = np.exp(rng.uniform(np.log(600), np.log(3400), n))
    x = rng.uniform(-0.85, 0.85, n) * d
    z = height(x, d)
    slope = (height(x + 12, d + 12) - z) / 17
    thick = np.clip(0.55 + 2.0 * shapes.fbm(flat(x, d, 1 / 190), 4, 91), 0, 1)
    keep = (z > 1.0) & (rng.uniform(size=n) < thick * (1 - smoothstep(110, 300, z + 60 * shapes.fbm(flat(x, d, 1 / 200), 3, 92)))) & (np.abs(slope) < 0.75)
    keep &= rng.uniform(size=n) < np.clip(d / 1300, 0.4, 1)
    points = np.stack([x, d, z - 0.3], axis=1)[keep]
    shapes.scatter("forest", far, points, rng.uniform(0, TAU, len(points)), rng.uniform(0.35, 1.0, len(points)) ** 0.7 * 1.3)
    print("trees of the far forest:", len(points))

    # Birches, and boulders at the shore.
    white_bark = birch_bark()
    bare = [birch(f"birch {k}", h, white_bark, 50 + k) for k, h in enumerate((6.2, 4.6))]
    for x, y, which, size, turn in ((7.4, 32.5, 0, 1.0, 0.4), (4.0, 30.2, 1, 0.85, 2.0), (-6.6, 21.8, 1, 0.9, 1.1), (17.9, 24.6, 0, 0.85, 3.7), (-10.4, 24.0, 0, 1.0, 5.0)):
        item = bare[which].copy()
        item.location, item.rotation_euler, item.scale = (x, y, ground_at([(x, y)])[0]), (0, 0, turn), (size,) * 3
        scene.collection.objects.link(item)
    stones = Mesh(shore_stone((0.78, 0.81, 0.85)))
    for x, off, size in ((-5.4, 0.2, 0.62), (-4.6, -0.5, 0.36), (-3.9, 0.3, 0.28), (0.4, -0.9, 0.72), (1.5, -0.5, 0.40), (-0.5, -1.6, 0.30), (3.9, -2.0, 0.5), (-8.3, -1.5, 0.6)):
        y = shore(np.array([x]))[0] - off
        part = shapes.stone(rng, np.array([rng.uniform(0.9, 1.35), rng.uniform(0.8, 1.1), rng.uniform(0.55, 0.8)]) * size, 36, 0.3, 0.14)
        stones.add(shapes.moved(part, (x, y, ground_at([(x, y)])[0] + 0.06 * size), rng.uniform(0, TAU)))
    stones.build("stones", smooth=True)

    # Shrubs of willow and grass that stick out of the snow.
    stems = [Mesh(plain(f"stalk {k}", (0.10, 0.075, 0.045), 0.8)).add(shapes.blades(np.random.default_rng(30 + k), 16, 0.14, 0.5, 0.006, 0.5)[0]).build(f"stalks {k}", link=False) for k in range(3)]
    n = 90
    u = rng.uniform(-0.8, 0.8, n)
    d = rng.uniform(7, 24, n)
    x = u * d
    clumps = shapes.fbm(flat(x, d, 0.22), 3, 95) > 0.12
    s = shore(x) - d
    keep = clumps & (s > 0.5)
    points = np.stack([x, d, ground(x, d) - 0.05], axis=1)[keep]
    if len(points):
        shapes.scatter("stalks", stems, points, rng.uniform(0, TAU, len(points)), rng.uniform(0.3, 0.85, len(points)))

    cabin(
        logs_wood(), plain("boards", (0.085, 0.055, 0.036), 0.8), snow_trees, lit_pane(110.0), plain("chimney stone", (0.13, 0.125, 0.12), 0.85),
        plain("window frame", (0.42, 0.40, 0.36), 0.6))
    return view


if __name__ == "__main__":
    arguments = plate.options("winter")
    seen = build(arguments)
    plate.make("winter", arguments, -4.0, seen, "AgX - Base Contrast", halo=0.05, occlusion=8.0, metals=False, depth=235_000, normals=265_000)
