"""`fjord`: a fjord between snowy mountains, with the lights of a village on its far shore, on a dark night: the sky and its light are left to Bansho."""

import numpy as np

import north
import plants
import plate
import shapes
from north import flat, smoothstep
from shaders import Shader, glow, plain
from shapes import TAU, Mesh

POSITION, TARGET, FOV_DEG = (0.0, 2.3, 0.0), (0.0, 8.99, -20.0), 60.0
FAR = 60000.0

rng = np.random.default_rng(83)


# The near shore. z is up, y away from the viewer; the water of a scene lies at z = 0, in front of that of the plate.

WATER = -0.35


def shore(x):
    """Where the land ends, for each x: a cove between two points of land."""
    return 11.8 + 15.0 * smoothstep(4.5, 15.0, x) + 7.0 * smoothstep(-8.0, -16.0, x) + 2.3 * shapes.fbm(flat(x, 0 * x, 0.13), 3, 4)


def ice_edge(x, y):
    """Meters beyond the edge of the ice that holds to the shore, negative on it."""
    wide = 1.2 + 8.0 * smoothstep(-2.0, -16.0, x) + 2.2 * shapes.fbm(flat(x, y, 0.07), 3, 43) + 0.9 * shapes.fbm(flat(x, y, 0.55), 3, 45)
    return y - shore(x) - np.maximum(wide, 0.8)


def ground(x, y):
    """Height of the snow: a bank, and ice in front of open water."""
    s = shore(x) - y
    warp = 0.9 * shapes.fbm(flat(x, y, 0.25), 2, 31)
    ridge = shapes.ridged(np.stack([0.24 * x + 0.30 * y + warp, 0.75 * y - 0.22 * x + warp, 0 * x], axis=-1) * 0.6, 2, 33)
    land = 0.16 + 0.62 * smoothstep(0.0, 7.0, s) + 0.9 * smoothstep(9.0, 16.0, x) * smoothstep(0.0, 9.0, s) + 0.5 * smoothstep(-9.0, -15.0, x) * smoothstep(0.0, 7.0, s)
    land = land + smoothstep(0.0, 4.0, s) * (0.26 * (ridge - 0.6) + 0.28 * shapes.fbm(flat(x, y, 0.17), 3, 21)) + 0.03 * shapes.fbm(flat(x, y, 0.8), 3, 35) + 0.006 * shapes.fbm(flat(x, y, 3.1), 3, 39)
    ice = 0.14 + 0.05 * shapes.fbm(flat(x, y, 0.3), 3, 41) + 0.02 * np.maximum(shapes.fbm(flat(x, y, 0.9), 3, 47), 0)
    # Ice that the tide has lifted and broken along the shore.
    hinge = 0.20 * np.exp(-(((s + 0.7) / 0.55) ** 2)) * np.clip(0.5 + 1.2 * shapes.fbm(flat(x, y, 0.8), 3, 49), 0, 1.4)
    blend = smoothstep(-1.2, 1.2, s)
    height = ice * (1 - blend) + np.maximum(land, ice) * blend + hinge
    return np.where(ice_edge(x, y) > 0, -0.7, height)


def ground_at(x, y):
    return ground(np.atleast_1d(np.asarray(x, float)), np.atleast_1d(np.asarray(y, float)))


WALK = np.array([[-3.4, 3.0], [-3.0, 6.0], [-2.2, 8.5], [-1.3, 10.6], [-0.6, 11.8]])


def near_ground(material, columns, rows):
    slope, distance = np.linspace(-1.15, 1.15, columns), np.geomspace(4.6, 75.0, rows)
    u, d = np.meshgrid(slope, distance)
    x, y = (u * d).ravel(), d.ravel()
    t = np.linspace(0, len(WALK) - 1, 300)
    walk = np.stack([np.interp(t, np.arange(len(WALK)), WALK[:, i]) for i in range(2)], axis=1)
    steps = np.concatenate([north.steps_along(walk, 0.62, 0.12, 3), north.steps_along(walk + np.array([0.55, 0.0]), 0.66, 0.13, 4)])
    z = ground(x, y) + north.trodden(x, y, steps) * (ground(x, y) > 0)
    return Mesh(material).add((np.stack([x, y, z], axis=1), shapes.strip_faces(rows, columns))).build("snow", smooth=True)


# The fjord and its mountains

WEST, EAST, SOUTH, NORTH = -6500.0, 6500.0, 60.0, 10500.0
# (x, y, height, radius) of massifs: where land rises.
MASSIFS = (
    (-1900, 2250, 0.66, 800), (-2700, 3500, 0.95, 1050), (-1750, 4700, 0.80, 800), (-3900, 1900, 0.85, 1200), (-2900, 5900, 0.9, 1100), (-4900, 3900, 1.0, 1500),
    (1750, 2050, 0.58, 650), (2450, 3300, 1.00, 900), (1650, 4700, 0.72, 700), (3700, 2500, 0.95, 1100), (2900, 5600, 0.95, 1100), (4900, 4300, 1.0, 1500),
    (-500, 8300, 0.85, 800), (650, 9100, 1.00, 1000), (-1500, 8700, 0.8, 900), (1700, 7600, 0.85, 900), (3500, 8200, 0.9, 1300), (-3500, 8000, 0.95, 1300),
)


def bank(x, y):
    """Meters inland from the water of the fjord, negative on the water."""
    middle = np.interp(y, (0, 1500, 3000, 4500, 6000, 7500), (-60, -40, -10, 70, 40, -200))
    half = np.interp(y, (0, 700, 1500, 2500, 3600, 5000, 6500), (620, 600, 560, 470, 430, 330, 150))
    wander = 95 * shapes.fbm(flat(x, y, 1 / 520), 4, 77) + 14 * shapes.fbm(flat(x, y, 1 / 80), 3, 78)
    return np.maximum(np.abs(x - middle) - half, y - 6300) + wander


def mountains():
    """Heights on a grid, by erosion at doubled resolutions."""
    height = None
    for shape, rounds in (((113, 141), 45), ((226, 282), 30), ((451, 563), 16), ((901, 1125), 6)):
        cell = (EAST - WEST) / (shape[1] - 1)
        x, y = (a.ravel() for a in np.meshgrid(np.linspace(WEST, EAST, shape[1]), np.linspace(SOUTH, NORTH, shape[0])))
        wx, wy = x + 340 * shapes.fbm(flat(x, y, 1 / 1100), 4, 61), y + 340 * shapes.fbm(flat(x, y, 1 / 1100), 4, 62)
        crest = shapes.ridged(flat(wx, wy, 1 / 1050), 4, 64)
        swell = 0.05
        for mx, my, tall, radius in MASSIFS:
            swell = np.maximum(swell, tall * np.exp(-(((wx - mx) ** 2 + (wy - my) ** 2) / (1.3 * radius) ** 2) ** 0.9))
        inland = bank(x, y)
        lift = (swell * (0.15 + 2.3 * np.clip(crest - 0.40, 0, 1) ** 1.2) * (smoothstep(-20, 700, inland) * 0.9 + 0.1)).reshape(shape)
        base = (inland < 0).reshape(shape)
        if height is None:
            height = 1000 * lift + (40 * shapes.fbm(flat(x, y, 1 / 400), 5, 63) * (0.1 + swell)).reshape(shape)
        else:
            height = north.resized(height, shape) + (0.30 * cell * shapes.fbm(flat(x, y, 1 / (4 * cell)), 3, 65) * (0.1 + np.minimum(swell, 1))).reshape(shape)
        height[base] = 0
        height = north.eroded(height, lift * 14.0, base, cell, rounds, 0.013)
    return height


class Land:
    """The far land: heights, and where snow holds."""

    def __init__(self, peak=1250.0):
        table = mountains()
        table = peak * (np.maximum(table, 0) / np.quantile(table, 0.9995)) ** 1.12
        cell = (EAST - WEST) / (table.shape[1] - 1)
        smooth = table
        for _ in range(6):
            wide = np.pad(smooth, 1, mode="edge")
            smooth = (wide[:-2, 1:-1] + wide[2:, 1:-1] + wide[1:-1, :-2] + wide[1:-1, 2:] + 2 * smooth) / 6
        gy, gx = np.gradient(smooth, cell)
        self.table, self.up = table, 1 / np.sqrt(1 + gx**2 + gy**2)
        # Hollows keep snow, and wind takes it from edges.
        self.hollow = np.clip((smooth - table) / (0.12 * cell), -1.5, 1.5)
        wide = smooth
        for _ in range(40):
            pad = np.pad(wide, 1, mode="edge")
            wide = (pad[:-2, 1:-1] + pad[2:, 1:-1] + pad[1:-1, :-2] + pad[1:-1, 2:]) / 4
        self.gully = np.clip((wide - smooth) / (0.8 * cell), -1.5, 1.5)

    def at(self, table, x, y):
        i = np.clip((x - WEST) / (EAST - WEST) * (table.shape[1] - 1), 0, table.shape[1] - 1.001)
        j = np.clip((y - SOUTH) / (NORTH - SOUTH) * (table.shape[0] - 1), 0, table.shape[0] - 1.001)
        a, b = i.astype(int), j.astype(int)
        u, v = i - a, j - b
        u, v = u * u * (3 - 2 * u) * 0.5 + 0.5 * u, v * v * (3 - 2 * v) * 0.5 + 0.5 * v
        return (table[b, a] * (1 - u) + table[b, a + 1] * u) * (1 - v) + (table[b + 1, a] * (1 - u) + table[b + 1, a + 1] * u) * v

    def height(self, x, y):
        h = self.at(self.table, x, y)
        inland = bank(x, y)
        steep = smoothstep(0.93, 0.70, self.at(self.up, x, y)) * smoothstep(40.0, 200.0, h)
        warp = 14 * shapes.fbm(flat(x, y, 1 / 80), 2, 71)
        crags = shapes.ridged(flat(x + warp, y - warp, 1 / 75), 4, 73) - 0.55
        h = h + steep * 58 * crags + (0.3 + steep) * smoothstep(10, 120, inland) * 4.0 * shapes.fbm(flat(x, y, 1 / 26), 3, 75)
        rise = 1.2 + 0.055 * np.clip(inland, 0, 260) + 5 * smoothstep(0, 160, inland) * (0.4 + shapes.fbm(flat(x, y, 1 / 120), 3, 79))
        return np.where(inland > 0, np.maximum(smoothstep(0, 9, inland) * np.maximum(rise, 0.4) + smoothstep(10, 220, inland) * h, 0.3), -3.0)

    def build(self, material, columns, rows):
        slope, distance = np.linspace(-1.12, 1.12, columns), np.geomspace(300.0, 10400.0, rows)
        u, d = np.meshgrid(slope, distance)
        x, y = (u * d).ravel(), d.ravel()
        z = self.height(x, y)
        p = np.stack([x, y, z], axis=1).reshape(rows, columns, 3)
        normal = np.cross(np.gradient(p, axis=1), np.gradient(p, axis=0))
        up = (normal[..., 2] / (np.linalg.norm(normal, axis=-1) + 1e-9)).ravel()
        level = 0.40 * up + 0.60 * self.at(self.up, x, y) + 0.10 * self.at(self.gully, x, y) + 0.10 * self.at(self.hollow, x, y)
        level = level + 0.07 * shapes.fbm(flat(x, y, 1 / 420), 4, 85)
        # Rock on the steepest quarter of what rises above the shore.
        level = level + 0.76 - np.quantile(level[z > 120], 0.26)
        mesh = Mesh(material).add((p.reshape(-1, 3), shapes.strip_faces(rows, columns)), 0, level)
        return mesh.build("mountains", smooth=True)


# Materials

def mountain():
    """Snow where it holds (the mesh's tint), rock elsewhere, in ledges and ribs."""
    s = Shader("mountain")
    p = s.position()
    fine = s.math("MULTIPLY", s.math("SUBTRACT", s.noise(0.035, 6.0, 0.68), 0.5), 0.22)
    strata = s.noise(1.0, 5.0, 0.6, s.stretched(p, (0.008, 0.008, 0.07)), 0.9)
    ledges = s.math("MULTIPLY", s.math("SUBTRACT", strata, 0.5), 0.16)
    level = s.math("ADD", s.attribute("tint"), s.math("ADD", fine, ledges))
    cover = s.remap(level, 0.735, 0.785)
    rock = s.mix(s.remap(strata, 0.35, 0.65), (0.032, 0.033, 0.037), (0.100, 0.097, 0.095))
    rock = s.shade(rock, s.remap(s.noise(0.03, 7.0, 0.7), 0.3, 0.7, 0.6, 1.35))
    rock = s.mix(s.remap(s.noise(0.11, 4.0, 0.7), 0.56, 0.70, 0.0, 0.6), rock, (0.5, 0.52, 0.55))
    white = s.shade((0.79, 0.815, 0.85), s.remap(s.noise(0.012, 5.0), 0.3, 0.7, 0.88, 1.03))
    # Scrub that shows through the snow low on the slopes.
    low = s.math("MULTIPLY", s.remap(s.axis(p, "Z"), 40.0, 190.0, 1.0, 0.0), s.remap(s.noise(0.012, 6.0, 0.7), 0.50, 0.64))
    white = s.mix(s.math("MULTIPLY", low, s.remap(s.noise(0.16, 4.0, 0.75), 0.42, 0.60, 0.0, 0.85)), white, (0.10, 0.088, 0.078))
    normal = s.bump(s.noise(0.05, 8.0, 0.66), 6.0, 0.5)
    return s.finish(s.principled(s.mix(cover, rock, white), 0.9, normal, Specular_IOR_Level=0.1))


# The village

def lamps(land):
    """Street lamps: (x, y, z, color, watts). They stand along the shore, closer together in the middle of the village."""
    r = np.random.default_rng(19)
    found = []
    for low, high, count, side in ((1180, 2250, 46, 1), (1450, 1800, 26, 1), (2500, 3400, 16, -1), (900, 4500, 9, 1), (1200, 4800, 6, -1)):
        for y in r.uniform(low, high, count):
            inland = r.gamma(1.6, 28.0) + 14
            x = np.arange(0, 1600.0, 4.0) * side
            b = bank(x, np.full_like(x, y))
            inside = np.flatnonzero(b > inland)
            if not len(inside):
                continue
            at = x[inside[0]]
            warm = r.uniform() < 0.8
            color = (1.0, r.uniform(0.50, 0.62), r.uniform(0.16, 0.28)) if warm else (1.0, r.uniform(0.80, 0.92), r.uniform(0.6, 0.85))
            found.append((at, y, land.height(np.array([at]), np.array([y]))[0] + r.uniform(4.5, 7.0), color, 6500.0 * r.gamma(2.2, 0.45)))
    return found


LAMPS = []


def lamp_points():
    return [((x, y, z), color, 2.2 * watts) for x, y, z, color, watts in LAMPS]


def village(land):
    """Lamps, and houses beside them, some with lit windows."""
    LAMPS.extend(lamps(land))
    wall = [plain(f"wall {k}", c, 0.8) for k, c in enumerate(((0.30, 0.055, 0.035), (0.62, 0.60, 0.55), (0.45, 0.33, 0.10), (0.10, 0.14, 0.20)))]
    white = north.snow("roof snow", 0.3, (0.78, 0.81, 0.85))
    window = glow("window", (1.0, 0.55, 0.2), 26.0)
    mesh = Mesh(*wall, white, window)
    r = np.random.default_rng(23)
    for x, y, z, color, watts in LAMPS:
        plate.point_light((x, y, z), color, 2.0 * watts, 0.6)
        for _ in range(int(r.integers(1, 3))):
            hx, hy = x + r.normal(0, 16), y + r.normal(0, 22)
            if bank(np.array([hx]), np.array([hy]))[0] < 6:
                continue
            long, deep, tall, turn = r.uniform(4, 7.5), r.uniform(3.2, 4.5), r.uniform(3.2, 6.0), r.uniform(0, TAU)
            at = (hx, hy, land.height(np.array([hx]), np.array([hy]))[0] - 0.8)
            mesh.add(shapes.moved(shapes.box((-long, -deep, 0), (long, deep, tall + 0.8)), at, turn), int(r.integers(0, 4)))
            ridge, e = tall + 0.8 + 0.7 * deep, 0.6
            v = np.array([[-long - e, -deep - e, tall + 0.4], [long + e, -deep - e, tall + 0.4], [long + e, 0, ridge], [-long - e, 0, ridge], [-long - e, deep + e, tall + 0.4], [long + e, deep + e, tall + 0.4]])
            mesh.add(shapes.moved((np.concatenate([v, v - np.array([0, 0, 0.5])]), np.array([[0, 1, 2, 3], [3, 2, 5, 4], [0, 6, 7, 1], [4, 5, 11, 10], [0, 3, 9, 6], [3, 4, 10, 9], [1, 7, 8, 2], [2, 8, 11, 5]])), at, turn), 4)
            gable = np.array([[-long, -deep, tall + 0.8], [-long, deep, tall + 0.8], [-long, 0, ridge - 0.4], [-long, 0, ridge - 0.4]])
            mesh.add(shapes.moved((np.concatenate([gable, gable * np.array([-1, 1, 1])]), np.array([[0, 1, 2, 3], [4, 5, 6, 7]])), at, turn), int(r.integers(0, 4)))
            if r.uniform() < 0.6:
                for side in (-1, 1):
                    for k in range(int(r.integers(1, 4))):
                        a = r.uniform(-long + 1, long - 1)
                        mesh.add(shapes.moved(shapes.box((a - 0.6, side * deep - 0.05, 2.0), (a + 0.6, side * deep + 0.05, 3.3)), at, turn), 5)
    mesh.build("village")
    print("lamps:", len(LAMPS))


def build(args):
    scene = plate.empty_scene()
    view = plate.camera(POSITION, TARGET, FOV_DEG, FAR)
    plate.night_sky()
    detail = max(args.scale, 0.4)

    white = north.snow("stone snow", 0.5, (0.79, 0.82, 0.86))
    near_ground(north.snow(), round(1900 * detail), round(1200 * detail))
    sheet = Mesh(north.water())
    sheet.add(shapes.grid(np.linspace(-1500, 1500, 3), np.array([9.0, 300.0, 8000.0]), WATER))
    sheet.build("water")
    land = Land()
    land.build(mountain(), round(2000 * detail), round(1300 * detail))
    # Land beside and behind the camera, which only lights what is seen.
    Mesh(white).add(shapes.grid(np.array([-60.0, 60.0]), np.array([-60.0, 4.5]), 0.6)).build("behind")

    # Woods on the lower slopes: spruce where it was planted, birch elsewhere.
    dark = north.needles()
    spruce_parts = (plants.bark("spruce bark", (0.020, 0.015, 0.012), (0.085, 0.066, 0.052), mossy=0.1), dark, white)
    coarse = dict(twig_step=0.3, needle_step=0.09, needle=0.22, rings=(5, 5), boughs=0.6)
    wood = [north.spruce(f"spruce {k}", h, spruce_parts, 20 + k, crown, load=load, **coarse) for k, (h, crown, load) in enumerate(((9.0, 0.15, 0.7), (7.0, 0.17, 0.9), (11.0, 0.13, 0.6), (5.0, 0.2, 0.9)))]
    twigs = north.birch_bark()
    bare = [north.birch(f"birch {k}", h, twigs, 50 + k, leans) for k, (h, leans) in enumerate(((7.0, (0.1, -0.15)), (5.2, (0.05,)), (4.0, (0.2, -0.1, 0.02))))]
    for name, items, count, limit, scale, seed, cut in (("spruces", wood, 120000, 130, 190, 91, 0.05), ("birches", bare, 260000, 260, 240, 93, 0.12)):
        d = np.exp(rng.uniform(np.log(450), np.log(5200), count))
        x = rng.uniform(-1.08, 1.08, count) * d
        inland = bank(x, d)
        x, d, inland = x[inland > 6], d[inland > 6], inland[inland > 6]
        z = land.height(x, d)
        patch = shapes.fbm(flat(x, d, 1 / scale), 4, seed)
        thick = np.clip(0.25 + 1.6 * (patch + cut), 0, 1)
        keep = (z > 1.5) & (rng.uniform(size=len(x)) < thick * (1 - smoothstep(0.35 * limit, limit, z + 60 * shapes.fbm(flat(x, d, 1 / 150), 3, seed + 1)))) & (land.at(land.up, x, d) > 0.66)
        keep &= rng.uniform(size=len(x)) < np.clip(d / 1500, 0.3, 1)
        points = np.stack([x, d, z - 0.3], axis=1)[keep]
        shapes.scatter(name, items, points, rng.uniform(0, TAU, len(points)), rng.uniform(0.35, 1.25, len(points)), rng.normal(0, 0.04, (len(points), 2)))
        print(name, len(points))
    village(land)

    # Boulders at the shore, in groups, and floes off the ice.
    stones = Mesh(north.shore_stone((0.78, 0.81, 0.85)), white)
    for gx, gy, count, spread, large in ((6.9, 15.2, 9, 1.7, 1.05), (-6.4, 12.6, 7, 1.3, 0.7), (11.8, 22.0, 8, 2.2, 1.4), (1.7, 15.6, 4, 0.9, 0.5), (-12.8, 19.5, 6, 1.8, 0.9), (4.4, 20.5, 3, 1.2, 0.75)):
        for _ in range(count):
            size = large * np.clip(rng.gamma(2.0, 0.3), 0.14, 1.0) * np.array([rng.uniform(0.9, 1.5), rng.uniform(0.8, 1.2), rng.uniform(0.5, 0.85)])
            x, y = gx + rng.normal(0, spread), gy + rng.normal(0, 0.7 * spread)
            north.snowy_stone(stones, rng, (x, y, max(ground_at(x, y)[0], -0.05) + 0.22 * size[2]), size, rng.uniform(0, TAU), 0.20 * size[2] + 0.05)
    stones.build("stones", smooth=True)
    floes = Mesh(white)
    taken = []
    for _ in range(5200):
        y = np.exp(rng.uniform(np.log(13), np.log(120)))
        x = rng.uniform(-1.1, 1.1) * y
        off = ice_edge(np.array([x]), np.array([y]))[0]
        radius = np.clip(0.35 + rng.gamma(1.5, 0.5), 0.3, 3.2)
        drift = shapes.fbm(flat(np.array([x]), np.array([y]), 0.07), 3, 57)[0]
        if off < radius * 0.6 or rng.uniform() > np.exp(-off / 2.6) + 0.16 * smoothstep(0.25, 0.6, drift) * np.exp(-off / 40.0):
            continue
        if any((x - a) ** 2 + (y - b) ** 2 < (0.98 * (radius + c)) ** 2 for a, b, c in taken):
            continue
        taken.append((x, y, radius))
        floes.add(shapes.moved(north.floe(rng, radius), (x, y, rng.uniform(-0.02, 0.02)), rng.uniform(0, TAU)))
    floes.build("floes", smooth=True)
    print("floes:", len(taken))
    bush = [north.willow(f"willow {k}", h, twigs, 160 + k, stems) for k, (h, stems) in enumerate(((0.9, 7), (0.6, 6), (1.2, 8)))]
    for x, y, k, size in ((12.5, 17.8, 2, 1.0), (13.6, 18.6, 0, 1.1), (14.8, 17.2, 1, 1.2), (-12.6, 14.0, 0, 0.9), (-11.4, 14.6, 1, 1.0), (15.9, 21.0, 2, 1.1), (-13.6, 15.6, 2, 0.8)):
        north.place(bush[k], (x, y, ground_at(x, y)[0] - 0.05), rng.uniform(0, TAU), size)
    straw = north.straw()
    n = 260
    y = np.exp(rng.uniform(np.log(7), np.log(24), n))
    x = rng.uniform(-1.0, 1.0, n) * y
    keep = (shapes.fbm(flat(x, y, 0.2), 3, 97) > 0.2) & (shore(x) - y > 0.8)
    points = np.stack([x, y, ground(x, y) - 0.06], axis=1)[keep]
    shapes.scatter("straw", straw, points, rng.uniform(0, TAU, len(points)), rng.uniform(0.3, 0.85, len(points)))
    return view


if __name__ == "__main__":
    arguments = plate.options("fjord")
    seen = build(arguments)
    plate.make("fjord", arguments, -4.0, seen, "AgX - Base Contrast", halo=0.09, occlusion=8.0, metals=False, points=lamp_points())
