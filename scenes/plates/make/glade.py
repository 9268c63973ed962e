"""`glade`: snowy spruces, pines and birches around a glade, seen from below by a wide lens that is tilted up. The sky and its light are left to Bansho."""

import numpy as np

import north
import plate
import shapes
from clearing import hills, wooded
from north import flat, smoothstep
from shapes import TAU, Mesh

POSITION, TARGET, FOV_DEG = (0.0, 1.7, 0.0), (0.0, 31.0, -60.0), 64.0
FAR = 40000.0

rng = np.random.default_rng(83)


# The glade. z is up, y away from the viewer.

def into_forest(x, y):
    """Meters from the edge of the forest, negative in the glade, which opens to a bog."""
    wander = 4.0 * shapes.fbm(flat(x, y, 1 / 13), 3, 12)
    left = np.interp(y, (0, 12, 30, 60, 110), (-9.0, -10.5, -15.0, -30.0, -60.0))
    right = np.interp(y, (0, 12, 30, 60, 110), (11.0, 15.0, 24.0, 34.0, 48.0))
    end = y - np.interp(x, (-60, -20, 10, 50), (70, 105, 125, 90))
    return np.maximum(np.maximum(left - x, x - right), end) + wander


def ground(x, y):
    """Height of the snow, which rises to a low bank on the left."""
    edge = into_forest(x, y)
    land = 0.6 * shapes.fbm(flat(x, y, 1 / 21), 3, 22) + 1.0 * smoothstep(-7, 12, edge) + 0.012 * np.maximum(y - 40, 0) + 1.1 * smoothstep(-3, -16, x) * smoothstep(7, 20, y)
    warp = 0.9 * shapes.fbm(flat(x, y, 0.22), 2, 32)
    ridge = shapes.ridged(np.stack([0.24 * x - 0.30 * y + warp, 0.66 * y + 0.28 * x + warp, 0 * x], axis=-1) * 0.42, 2, 34)
    return land + 0.22 * (ridge - 0.6) + 0.05 * shapes.fbm(flat(x, y, 0.6), 3, 36) + 0.008 * shapes.fbm(flat(x, y, 3.3), 3, 40)


def ground_at(x, y):
    return ground(np.atleast_1d(np.asarray(x, float)), np.atleast_1d(np.asarray(y, float)))


# A hare's way across, from the left to the trees on the right.
WALK = np.array([[-9.0, 19.0], [-6.0, 17.2], [-2.5, 17.8], [1.0, 20.5], [5.5, 22.0], [10.0, 24.5], [15.0, 26.0]])


def near_ground(material, columns, rows, wells):
    """A sheet whose meshes are about equally large in the picture; snow has sunk around the stems of `wells`."""
    slope, distance = np.linspace(-1.7, 1.7, columns), np.geomspace(7.5, 420.0, rows)
    u, d = np.meshgrid(slope, distance)
    x, y = (u * d).ravel(), d.ravel()
    t = np.linspace(0, len(WALK) - 1, 300)
    walk = np.stack([np.interp(t, np.arange(len(WALK)), WALK[:, i]) for i in range(2)], axis=1)
    z = ground(x, y) + 0.6 * north.trodden(x, y, north.steps_along(walk, 0.9, 0.06, 4))
    north.sink_around_stems(x, y, z, wells)
    return Mesh(material).add((np.stack([x, y, z], axis=1), shapes.strip_faces(rows, columns))).build("snow", smooth=True)


def near_trees(spruce_parts, pine_parts):
    """The trees in front: (x, y, what). No two are the same."""
    s = north.spruce
    return [
        # On the left, from the edge of the picture inward.
        (-15.5, 12.5, s("a", 14.5, spruce_parts, 201, 0.125, 0.85, 0.06, 0.30, 0.45, 0.22, 0.02, load=0.9)),
        (-12.4, 15.2, s("b", 9.2, spruce_parts, 202, 0.15, 0.95, 0.03, 0.22, 0.40, 0.12, 0.05, load=1.1)),
        (-17.6, 19.8, s("c", 15.8, spruce_parts, 203, 0.11, 0.75, 0.14, 0.42, 0.5, 0.25, 0.03, load=0.7, top="broken")),
        (-11.6, 19.6, s("d", 5.2, spruce_parts, 204, 0.19, 1.05, 0.01, 0.12, 0.30, 0.10, 0.06, load=1.5)),
        (-14.6, 23.5, north.pine("e", 14.2, pine_parts, 205, 0.45, 0.18, 0.8)),
        (-12.9, 28.6, s("f", 11.2, spruce_parts, 206, 0.125, 0.8, 0.08, 0.36, 0.5, 0.28, 0.04, load=0.85)),
        (-9.4, 24.5, s("g", 2.4, spruce_parts, 207, 0.27, 1.1, 0.0, 0.08, 0.3, 0.1, 0.05, load=1.9)),
        (-16.3, 34.0, s("h", 13.0, spruce_parts, 208, 0.13, 0.9, 0.07, 0.28, 0.4, 0.15, 0.02, load=0.9, top="forked")),
        # On the right, lower and farther away.
        (21.0, 18.0, north.pine("i", 13.4, pine_parts, 211, 0.40, 0.21, 0.9, 0.10)),
        (17.2, 20.6, s("j", 8.4, spruce_parts, 212, 0.15, 0.9, 0.02, 0.26, 0.42, 0.18, 0.04, load=1.1)),
        (24.8, 25.5, s("k", 12.6, spruce_parts, 213, 0.12, 0.8, 0.10, 0.38, 0.5, 0.22, 0.045, load=0.75)),
        (15.2, 24.4, s("l", 3.1, spruce_parts, 214, 0.23, 1.0, 0.0, 0.14, 0.35, 0.1, 0.10, load=1.6)),
        (21.8, 31.0, s("m", 9.6, spruce_parts, 215, 0.14, 1.0, 0.05, 0.26, 0.35, 0.12, 0.02, load=1.0)),
        (29.5, 22.0, s("n", 15.0, spruce_parts, 216, 0.115, 0.8, 0.12, 0.35, 0.45, 0.2, 0.03, load=0.8)),
        (18.4, 36.0, north.pine("o", 10.2, pine_parts, 217, 0.35, 0.2, 1.0, 0.12)),
        # Young ones in the glade.
        (4.6, 44.0, s("p", 4.0, spruce_parts, 218, 0.2, 1.0, 0.0, 0.12, 0.35, 0.1, 0.06, load=1.5)),
        (-4.2, 52.0, s("q", 6.4, spruce_parts, 219, 0.16, 0.95, 0.02, 0.25, 0.4, 0.15, 0.03, load=1.1)),
    ]


def forest_points(wells):
    """Where the trees behind stand, taller inside and younger at the edge: points, and sizes."""
    n = 24000
    y = np.exp(rng.uniform(np.log(26), np.log(420), n))
    x = rng.uniform(-1.7, 1.7, n) * y
    inside = into_forest(x, y)
    thick = np.clip(0.40 + 0.8 * shapes.fbm(flat(x, y, 1 / 30), 3, 92), 0.04, 1) * np.clip((inside + 2) / 5, 0, 1)
    keep = (inside > -2) & (rng.uniform(size=n) < thick * np.clip((y / 150) ** 1.1, 0.05, 1))
    x, y, inside = x[keep], y[keep], inside[keep]
    chosen = north.spaced(x, y, 2.4, wells, 1.8)
    x, y, inside = x[chosen], y[chosen], inside[chosen]
    size = np.clip(0.5 + 0.05 * inside, 0.35, 1.0) * rng.uniform(0.5, 1.15, len(x)) * (1 + 0.15 * shapes.fbm(flat(x, y, 1 / 40), 2, 94))
    return np.stack([x, y, ground(x, y) - 0.1], axis=1), size


def undergrowth(twigs):
    """Willows at the edge, and dry grass."""
    bush = [north.willow(f"willow {k}", h, twigs, 260 + k, stems) for k, (h, stems) in enumerate(((1.9, 9), (1.3, 7), (2.5, 8), (0.9, 6)))]
    n = 900
    y = np.exp(rng.uniform(np.log(12), np.log(90), n))
    x = rng.uniform(-1.5, 1.5, n) * y
    edge = into_forest(x, y)
    keep = (edge > -5) & (edge < 3) & (shapes.fbm(flat(x, y, 1 / 7), 3, 96) > 0.22)
    points = np.stack([x, y, ground(x, y) - 0.1], axis=1)[keep]
    shapes.scatter("willows", bush, points, rng.uniform(0, TAU, len(points)), rng.uniform(0.35, 1.1, len(points)), rng.normal(0, 0.1, (len(points), 2)))
    n = 500
    y = np.exp(rng.uniform(np.log(12), np.log(50), n))
    x = rng.uniform(-1.2, 1.2, n) * y
    keep = shapes.fbm(flat(x, y, 1 / 5), 3, 98) > 0.42
    points = np.stack([x, y, ground(x, y) - 0.06], axis=1)[keep]
    shapes.scatter("straw", north.straw(), points, rng.uniform(0, TAU, len(points)), rng.uniform(0.3, 0.9, len(points)))


def build(args):
    plate.empty_scene()
    view = plate.camera(POSITION, TARGET, FOV_DEG, FAR)
    plate.night_sky()
    detail = max(args.scale, 0.4)

    spruce_parts, pine_parts = north.conifers()
    near = near_trees(spruce_parts, pine_parts)
    wells = []
    for x, y, item in near:
        north.place(item, (x, y, ground_at(x, y)[0] - 0.05), rng.uniform(0, TAU), 1.0, rng.normal(0, 0.02, 2))
        wells.append((x, y, 0.7 + 0.03 * item.dimensions[2]))
    points, size = forest_points(wells)
    shapes.scatter("forest", [item for _, _, item in near], points, rng.uniform(0, TAU, len(points)), size, rng.normal(0, 0.03, (len(points), 2)))
    wells += [(x, y, 0.8) for x, y, _ in points if y < 75]
    print("trees:", len(points))

    near_ground(north.snow(), round(2000 * detail), round(900 * detail), wells)
    hills(wooded(), round(1100 * detail), round(420 * detail))
    # Land beside and behind the camera, which only lights what is seen.
    Mesh(spruce_parts[2]).add(shapes.grid(np.array([-60.0, 60.0]), np.array([-60.0, 7.4]), -0.3)).build("behind")

    twigs = north.birch_bark()
    for k, (x, y, h, turn, leans) in enumerate((
            (-8.9, 16.4, 7.6, 0.4, (0.10, -0.16)), (-10.2, 22.0, 9.8, 2.0, (0.06, 0.2)), (12.9, 19.0, 8.8, 1.1, (-0.12, 0.05, 0.22)), (14.4, 29.0, 7.5, 3.7, (0.05,)), (8.6, 38.0, 5.6, 5.0, (0.15, -0.1)))):
        north.place(north.birch(f"birch {k}", h, twigs, 250 + k, leans), (x, y, ground_at(x, y)[0]), turn)
    undergrowth(twigs)
    return view


if __name__ == "__main__":
    arguments = plate.options("glade")
    seen = build(arguments)
    plate.make("glade", arguments, -4.0, seen, "AgX - Base Contrast", halo=0.05, occlusion=3.0, metals=False)
