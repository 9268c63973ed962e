"""`clearing`: a snowy clearing in a northern forest with the track of a skier, on a dark night: the sky and its light are left to Bansho."""

import numpy as np

import north
import plate
import shapes
from north import flat, smoothstep
from shaders import Shader
from shapes import TAU, Mesh

POSITION, TARGET, FOV_DEG = (0.0, 1.75, 0.0), (0.0, 7.48, -20.0), 56.0
FAR = 40000.0

rng = np.random.default_rng(71)


# The clearing. z is up, y away from the viewer.

def along(y):
    """Where the skier went, for each y."""
    stops = np.array([[-2.35, 3.0], [-1.9, 6.0], [-1.35, 9.0], [-0.3, 13.0], [1.3, 18.0], [3.1, 24.0], [4.1, 31.0], [3.5, 40.0], [1.2, 52.0], [-2.0, 68.0], [-5.5, 90.0], [-9.5, 130.0], [-12.0, 300.0]])
    fine = np.linspace(3.0, 300.0, 1200)
    line = np.interp(fine, stops[:, 1], stops[:, 0])
    kernel = np.hanning(25)
    line = np.convolve(np.pad(line, 12, mode="reflect", reflect_type="odd"), kernel / kernel.sum(), "valid")
    return np.interp(y, fine, line)


def into_forest(x, y):
    """Meters from the edge of the forest, negative in the clearing."""
    wander = 5.0 * shapes.fbm(flat(x, y, 1 / 17), 3, 11)
    half = np.interp(y, (0, 15, 30, 48, 70, 95, 130), (8.5, 13.5, 19.0, 21.0, 16.0, 8.0, 2.5))
    middle = along(np.maximum(y, 3.0)) * 0.6 + 0.4 * np.interp(y, (0, 40, 90), (1.5, 3.0, -4.0))
    return np.abs(x - middle) - half + wander * np.interp(y, (0, 60, 130), (0.7, 1.0, 0.35))


MOUNDS = np.column_stack([rng.uniform(-1, 1, 150), np.exp(rng.uniform(np.log(7), np.log(70), 150)), rng.gamma(2.2, 0.11, 150), rng.uniform(0.35, 1.3, 150)])
MOUNDS[:, 0] *= MOUNDS[:, 1]
MOUNDS = MOUNDS[(into_forest(MOUNDS[:, 0], MOUNDS[:, 1]) > -5.5) & (np.abs(MOUNDS[:, 0] - along(MOUNDS[:, 1])) > 2.0)]


def smooth_ground(x, y):
    edge = into_forest(x, y)
    land = 0.55 * shapes.fbm(flat(x, y, 1 / 26), 3, 21) + 0.9 * smoothstep(-6, 14, edge) + 0.010 * np.maximum(y - 30, 0)
    return land - 0.35 * np.exp(-((x - along(np.maximum(y, 3))) / 6.0) ** 2)


def ground(x, y):
    """Height of the snow, without tracks."""
    warp = 0.9 * shapes.fbm(flat(x, y, 0.22), 2, 31)
    ridge = shapes.ridged(np.stack([0.20 * x + 0.34 * y + warp, 0.70 * y - 0.26 * x + warp, 0 * x], axis=-1) * 0.42, 2, 33)
    land = smooth_ground(x, y) + 0.20 * (ridge - 0.6) + 0.045 * shapes.fbm(flat(x, y, 0.6), 3, 35) + 0.007 * shapes.fbm(flat(x, y, 3.3), 3, 39)
    for mx, my, tall, wide in MOUNDS:
        near = np.flatnonzero((np.abs(x - mx) < 2.4 * wide) & (np.abs(y - my) < 2.4 * wide))
        if len(near):
            d2 = ((x[near] - mx) ** 2 + (y[near] - my) ** 2) / wide**2
            land[near] += tall * np.exp(-(d2**1.3)) * (1 + 0.3 * shapes.noise(flat(x[near], y[near], 2.0), 5))
    return land


def ground_at(x, y):
    return ground(np.atleast_1d(np.asarray(x, float)), np.atleast_1d(np.asarray(y, float)))


def skied(x, y):
    """What the skier left: a trench with two grooves, and the marks of poles."""
    slant = np.gradient(along(np.linspace(3, 300, 1200)), 297 / 1199)
    off = (x - along(y)) / np.sqrt(1 + np.interp(y, np.linspace(3, 300, 1200), slant) ** 2)
    near = np.flatnonzero((np.abs(off) < 1.2) & (y < 140))
    change = np.zeros_like(x)
    o, px, py = off[near], x[near], y[near]
    ragged = 0.05 * shapes.fbm(flat(px, py, 2.6), 3, 51)
    trench = -0.15 * (1 - smoothstep(0.26, 0.40, np.abs(o + 0.4 * ragged))) + 0.05 * np.exp(-(((np.abs(o) - 0.47) / 0.08) ** 2)) * (1 + 9 * ragged)
    weave = 0.02 * shapes.fbm(flat(0 * px, py, 0.5), 2, 53)
    for side in (-0.13, 0.14):
        trench = trench - 0.10 * (1 - smoothstep(0.04, 0.075, np.abs(o - side - weave)))
    change[near] = trench
    for k, py in enumerate(np.arange(5.0, 60.0, 1.15)):
        for side in (-0.62, 0.60):
            qx, qy = along(py) + side + 0.05 * np.sin(9.1 * k), py + (0.5 if side > 0 else 0.0) + 0.1 * np.sin(5.3 * k)
            close = np.flatnonzero((np.abs(x - qx) < 0.25) & (np.abs(y - qy) < 0.25))
            change[close] -= 0.12 * np.exp(-(((x[close] - qx) / 0.05) ** 2 + ((y[close] - qy) / 0.07) ** 2) ** 1.5)
    return change


WALK = np.array([[3.6, 4.0], [3.3, 6.5], [3.5, 9.0], [4.4, 12.0], [5.9, 15.2], [7.9, 18.6], [10.4, 21.5], [12.6, 24.0]])


def near_ground(material, columns, rows, wells):
    """A sheet whose meshes are about equally large in the picture; snow has sunk around the stems of `wells`."""
    slope, distance = np.linspace(-1.05, 1.05, columns), np.geomspace(4.6, 420.0, rows)
    u, d = np.meshgrid(slope, distance)
    x, y = (u * d).ravel(), d.ravel()
    t = np.linspace(0, len(WALK) - 1, 300)
    walk = np.stack([np.interp(t, np.arange(len(WALK)), WALK[:, i]) for i in range(2)], axis=1)
    z = ground(x, y) + skied(x, y) + north.trodden(x, y, north.steps_along(walk, 0.68, 0.13, 3))
    north.sink_around_stems(x, y, z, wells)
    return Mesh(material).add((np.stack([x, y, z], axis=1), shapes.strip_faces(rows, columns))).build("snow", smooth=True)


# Hills

def wooded():
    """Hills under forest, with bogs and old clearings in it."""
    s = Shader("wooded hills")
    p = s.position()
    open_snow = s.remap(s.noise(0.0035, 5.0, 0.6), 0.60, 0.64)
    crowns = s.remap(s.noise(0.09, 4.0, 0.75), 0.42, 0.66)
    trees = s.mix(crowns, (0.016, 0.022, 0.018), (0.26, 0.28, 0.30))
    return s.finish(s.principled(s.mix(open_snow, trees, (0.74, 0.77, 0.81)), 0.9, s.bump(s.noise(0.07, 5.0, 0.7), 8.0, 0.8), Specular_IOR_Level=0.1))


def hills(material, columns, rows):
    slope, distance = np.linspace(-1.0, 1.0, columns), np.geomspace(400.0, 9000.0, rows)
    u, d = np.meshgrid(slope, distance)
    x, y = (u * d).ravel(), d.ravel()
    swell = shapes.fbm(flat(x, y, 1 / 2300), 4, 81)
    z = 2.0 + 0.012 * (y - 400) + smoothstep(700, 5200, y) * (150 + 170 * swell) * np.clip(0.55 + 0.6 * shapes.fbm(flat(x, y, 1 / 3600), 2, 83), 0.1, 1.5)
    z = z + 7.0 * smoothstep(500, 1500, y) * (shapes.fbm(flat(x, y, 1 / 24), 3, 85) + 0.4)
    return Mesh(material).add((np.stack([x, y, z], axis=1), shapes.strip_faces(rows, columns))).build("hills", smooth=True)


def build(args):
    scene = plate.empty_scene()
    view = plate.camera(POSITION, TARGET, FOV_DEG, FAR)
    plate.night_sky()
    detail = max(args.scale, 0.4)

    spruce_parts, pine_parts = north.conifers()

    # No two of the trees in front are the same: (x, y, what).
    s = north.spruce
    near = [
        (-16.6, 30.5, s("a", 14.6, spruce_parts, 101, 0.125, 0.85, 0.07, 0.30, 0.45, 0.22, 0.022, load=0.8)),
        (-20.4, 27.2, s("b", 9.8, spruce_parts, 102, 0.155, 0.95, 0.04, 0.22, 0.40, 0.10, 0.04, load=1.1)),
        (-13.9, 25.8, s("c", 4.3, spruce_parts, 103, 0.22, 1.05, 0.01, 0.12, 0.30, 0.10, 0.05, load=1.5)),
        (-24.0, 36.0, s("d", 16.2, spruce_parts, 104, 0.115, 0.75, 0.16, 0.42, 0.50, 0.25, 0.03, load=0.7, top="broken")),
        (-12.7, 33.8, s("e", 7.4, spruce_parts, 105, 0.13, 0.8, 0.05, 0.36, 0.5, 0.3, 0.09, load=1.2)),
        (-18.8, 21.5, s("f", 2.6, spruce_parts, 106, 0.27, 1.1, 0.0, 0.08, 0.3, 0.1, 0.06, load=1.9)),
        (-28.5, 31.5, s("g", 12.4, spruce_parts, 107, 0.145, 0.9, 0.05, 0.28, 0.4, 0.15, 0.02, load=0.95, top="forked")),
        (-15.2, 42.0, s("h", 11.0, spruce_parts, 108, 0.12, 0.8, 0.10, 0.34, 0.45, 0.2, 0.05, load=0.8)),
        (23.4, 38.5, s("i", 10.6, spruce_parts, 109, 0.135, 0.9, 0.03, 0.30, 0.42, 0.18, 0.03, load=1.0)),
        (30.5, 34.0, s("j", 13.4, spruce_parts, 110, 0.12, 0.8, 0.12, 0.38, 0.5, 0.22, 0.045, load=0.75)),
        (18.9, 33.0, s("k", 3.4, spruce_parts, 111, 0.22, 1.0, 0.0, 0.14, 0.35, 0.1, 0.10, load=1.6)),
        (26.5, 44.5, s("l", 12.2, spruce_parts, 112, 0.14, 1.0, 0.06, 0.26, 0.35, 0.12, 0.02, load=0.9)),
        (20.6, 29.2, s("m", 1.7, spruce_parts, 113, 0.30, 1.1, 0.0, 0.05, 0.3, 0.1, 0.05, load=2.1)),
        (-10.3, 29.0, s("n", 1.9, spruce_parts, 114, 0.28, 1.0, 0.0, 0.1, 0.3, 0.1, 0.12, load=1.8)),
        (-21.5, 33.5, north.pine("p", 13.5, pine_parts, 121, 0.42, 0.17, 0.8)),
        (27.2, 31.0, north.pine("q", 12.0, pine_parts, 122, 0.36, 0.22, 0.9, 0.10)),
        (34.0, 45.0, north.pine("r", 15.5, pine_parts, 123, 0.5, 0.17, 0.8)),
        (14.9, 46.0, north.pine("t", 9.0, pine_parts, 124, 0.3, 0.2, 1.0, 0.12)),
    ]
    wells = []
    for x, y, item in near:
        north.place(item, (x, y, ground_at(x, y)[0] - 0.05), rng.uniform(0, TAU), 1.0, rng.normal(0, 0.02, 2))
        wells.append((x, y, 0.7 + 0.03 * item.dimensions[2]))

    # The forest behind them: the same and more, turned, scaled and leaning, taller inside and younger at its edge.
    coarse = dict(twig_step=0.13, needle_step=0.034, needle=0.09, rings=(6, 6))
    forest = [item for _, _, item in near] + [
        s(f"far {k}", h, spruce_parts, 130 + k, crown, taper, foot, gaps, 0.45, 0.2, bend, load=load, top=top, **coarse)
        for k, (h, crown, taper, foot, gaps, bend, load, top) in enumerate((
            (12.5, 0.11, 0.75, 0.10, 0.35, 0.03, 0.7, "leader"), (10.0, 0.14, 0.95, 0.05, 0.25, 0.02, 0.9, "leader"), (15.0, 0.10, 0.8, 0.2, 0.4, 0.03, 0.6, "leader"), (7.0, 0.15, 0.9, 0.02, 0.2, 0.05, 1.0, "leader"),
            (14.0, 0.13, 0.9, 0.08, 0.3, 0.02, 0.8, "forked"), (11.0, 0.12, 0.85, 0.12, 0.45, 0.04, 0.7, "broken"), (9.0, 0.17, 1.0, 0.04, 0.2, 0.03, 1.1, "leader"), (4.5, 0.2, 1.0, 0.0, 0.15, 0.08, 1.3, "leader")))]
    n = 26000
    y = np.exp(rng.uniform(np.log(36), np.log(480), n))
    x = rng.uniform(-1.05, 1.05, n) * y
    inside = into_forest(x, y)
    thick = np.clip(0.42 + 0.8 * shapes.fbm(flat(x, y, 1 / 30), 3, 91), 0.04, 1) * np.clip((inside + 2) / 5, 0, 1)
    keep = (inside > -2) & (rng.uniform(size=n) < thick * np.clip((y / 150) ** 1.1, 0.05, 1))
    x, y, inside = x[keep], y[keep], inside[keep]
    chosen = north.spaced(x, y, 2.2, wells, 1.6)
    x, y, inside = x[chosen], y[chosen], inside[chosen]
    size = np.clip(0.55 + 0.05 * inside, 0.4, 1.0) * rng.uniform(0.55, 1.2, len(x)) * (1 + 0.15 * shapes.fbm(flat(x, y, 1 / 40), 2, 93))
    points = np.stack([x, y, ground(x, y) - 0.1], axis=1)
    shapes.scatter("forest", forest, points, rng.uniform(0, TAU, len(x)), size, rng.normal(0, 0.03, (len(x), 2)))
    wells += [(a, b, 0.8) for a, b in zip(x, y) if b < 75]
    print("trees:", len(x))

    near_ground(north.snow(), round(2000 * detail), round(1500 * detail), wells)
    hills(wooded(), round(1100 * detail), round(420 * detail))
    # Land beside and behind the camera, which only lights what is seen.
    Mesh(spruce_parts[2]).add(shapes.grid(np.array([-60.0, 60.0]), np.array([-60.0, 4.5]), -0.2)).build("behind")

    # Birches, willows and grass at the edge.
    twigs = north.birch_bark()
    for k, (x, y, h, turn, leans) in enumerate((
            (-8.6, 27.0, 6.8, 0.4, (0.10, -0.16)), (-9.8, 30.5, 8.6, 2.0, (0.06, 0.2)), (16.3, 28.4, 7.4, 1.1, (-0.12, 0.05, 0.22)), (18.4, 40.0, 9.5, 3.7, (0.05,)), (11.8, 36.5, 4.6, 5.0, (0.15, -0.1)), (-25.5, 24.6, 7.8, 4.4, (0.09, -0.2)))):
        north.place(north.birch(f"birch {k}", h, twigs, 150 + k, leans), (x, y, ground_at(x, y)[0]), turn)
    bush = [north.willow(f"willow {k}", h, twigs, 160 + k, stems) for k, (h, stems) in enumerate(((1.9, 9), (1.3, 7), (2.5, 8), (0.9, 6), (1.6, 11)))]
    n = 900
    y = np.exp(rng.uniform(np.log(11), np.log(90), n))
    x = rng.uniform(-1.0, 1.0, n) * y
    edge = into_forest(x, y)
    keep = (edge > -6) & (edge < 3) & (shapes.fbm(flat(x, y, 1 / 7), 3, 95) > 0.25) & (np.abs(x - along(y)) > 1.5)
    points = np.stack([x, y, ground(x, y) - 0.1], axis=1)[keep]
    shapes.scatter("willows", bush, points, rng.uniform(0, TAU, len(points)), rng.uniform(0.35, 1.1, len(points)), rng.normal(0, 0.1, (len(points), 2)))
    straw = north.straw()
    n = 700
    y = np.exp(rng.uniform(np.log(6.5), np.log(36), n))
    x = rng.uniform(-0.95, 0.95, n) * y
    keep = (shapes.fbm(flat(x, y, 1 / 5), 3, 97) > 0.42) & (np.abs(x - along(y)) > 0.9)
    points = np.stack([x, y, ground(x, y) - 0.06], axis=1)[keep]
    shapes.scatter("straw", straw, points, rng.uniform(0, TAU, len(points)), rng.uniform(0.3, 0.9, len(points)))
    return view


if __name__ == "__main__":
    arguments = plate.options("clearing")
    seen = build(arguments)
    plate.make("clearing", arguments, -4.0, seen, "AgX - Base Contrast", halo=0.05, occlusion=3.0, metals=False)
