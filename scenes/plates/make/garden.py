"""`garden`: a path along a fence at the edge of a wood, on an overcast day. No lamps."""

import numpy as np

import plants
import plate
import shapes
from shaders import Shader, plain
from shapes import Mesh

POSITION, TARGET, FOV_DEG = (0.0, 1.55, 4.0), (0.25, 1.52, -10.0), 37.0

rng = np.random.default_rng(23)


def path_middle(y):
    return 0.15 + 0.9 * np.sin((y + 1.0) / 7.5) + 0.018 * np.maximum(y, 0) ** 1.3


def off_path(x, y):
    """0 on the path, 1 from half a meter beside it."""
    distance = np.abs(x - path_middle(y)) - 0.72 - 0.13 * np.sin(2.1 * y) - 0.07 * np.sin(5.3 * y + 1)
    return np.clip(distance / 0.5, 0, 1)


def height(points):
    """The path is level to a centimeter; beside it the ground rises."""
    x, y = points[:, 0], points[:, 1]
    flat = points * np.array([1, 1, 0])
    t = off_path(x, y)
    bank = 0.10 * t + 0.16 * np.clip(np.abs(x - path_middle(y)) - 2, 0, 5) / 5 * t
    relief = 0.07 * shapes.fbm(flat * 0.7, 4, 3) * t + 0.008 * shapes.fbm(flat * 4.5, 3, 8)
    return bank + relief


def on_ground(points):
    points = np.asarray(points, float)
    points[:, 2] += height(points)
    return points


def around(count, x, y, keep=None, jitter=0.0):
    """Random points of a rectangle for which `keep(x, y)` is above a random number."""
    px, py = rng.uniform(*x, count * 4), rng.uniform(*y, count * 4)
    if keep is not None:
        chosen = rng.uniform(size=px.size) < keep(px, py)
        px, py = px[chosen], py[chosen]
    px, py = px[:count], py[:count]
    return on_ground(np.stack([px, py, np.full(len(px), jitter)], axis=1))


def soil():
    s = Shader("soil")
    p = s.position()
    tone = s.mix(s.remap(s.noise(1.1, 8.0, 0.65), 0.32, 0.68), (0.040, 0.028, 0.018), (0.105, 0.080, 0.055))
    grit = s.cells(70.0, output=1)
    tone = s.shade(tone, s.remap(s.axis(grit, "X"), 0.0, 1.0, 0.6, 1.45))
    wet = s.remap(s.noise(0.9, 6.0, 0.6, s.stretched(p, (1.0, 0.5, 1.0))), 0.46, 0.60)
    wet = s.math("MULTIPLY", wet, s.remap(s.axis(p, "Y"), 6.0, 13.0, 1.0, 0.0))
    tone = s.shade(tone, s.remap(wet, 0.0, 1.0, 1.0, 0.5))
    roughness = s.remap(wet, 0.0, 1.0, 0.85, 0.16)
    lumps = s.bump(s.noise(11.0, 7.0, 0.65), 0.03, 0.9)
    normal = s.bump(s.remap(s.cells(70.0), 0.0, 0.7, 1.0, 0.0), 0.005, s.remap(wet, 0.0, 1.0, 1.0, 0.25), lumps)
    return s.finish(s.principled(tone, roughness, normal))


def old_wood(name, dark, light, along="Z", moss=0.5):
    """Weathered boards: gray, with long cracks, and green toward the top."""
    s = Shader(name)
    p = s.position()
    scales = {"X": (1.2, 30.0, 30.0), "Y": (30.0, 1.2, 30.0), "Z": (30.0, 30.0, 1.2)}[along]
    grain = s.noise(1.0, 7.0, 0.62, s.stretched(p, scales), 0.3)
    board = s.attribute("tint")
    tone = s.mix(s.remap(grain, 0.32, 0.7), dark, light)
    tone = s.shade(tone, s.remap(board, 0.0, 1.0, 0.6, 1.3))
    tone = s.shade(tone, s.remap(s.noise(2.3, 6.0, 0.65), 0.3, 0.7, 0.6, 1.2))
    green = s.math("MULTIPLY", s.remap(s.noise(4.0, 7.0, 0.7), 0.48, 0.62), moss)
    tone = s.mix(green, tone, (0.055, 0.075, 0.02))
    cracks = s.remap(grain, 0.28, 0.38)
    tone = s.shade(tone, s.remap(cracks, 0.0, 1.0, 0.4, 1.0))
    return s.finish(s.principled(tone, 0.62, s.bump(grain, 0.006, 0.9)))


def grain(angle, along, seed):
    """The relief of split wood: bends, long fibers, and cracks between them, in meters."""
    around_it = np.stack([np.cos(angle), np.sin(angle), along * 0.9], axis=-1).reshape(-1, 3)
    bends = 0.009 * shapes.fbm(around_it * 1.5, 3, seed)
    fine = around_it * np.array([5.5, 5.5, 1.0])
    fibers = 0.0022 * shapes.fbm(fine * 1.7, 4, seed + 1, 0.6)
    cracks = np.clip(shapes.ridged(fine * 0.55, 2, seed + 2) - 0.80, 0, 1)
    return (bends + fibers - 0.05 * cracks).reshape(angle.shape)


def fence(wood):
    mesh = Mesh(wood)
    ys = np.arange(-3.2, 26.0, 2.15)
    posts = []
    for y in ys:
        x = path_middle(y) + 1.55 + rng.normal(0, 0.04)
        foot = on_ground([[x, y, 0.0]])[0]
        lean = rng.normal(0, 0.02, 2)
        tall = rng.uniform(1.08, 1.2)
        head = foot + np.array([lean[0], lean[1], tall])
        p = np.linspace(foot - np.array([0, 0, 0.1]), head, 90)
        seed = int(rng.integers(1 << 20))

        def relief(angle, along, seed=seed):
            return grain(angle, along, seed)

        mesh.add(shapes.tube(p, 0.062, 64, relief=relief), 0, rng.uniform(0, 1))
        posts.append((foot, head))
    for (f0, h0), (f1, h1) in zip(posts, posts[1:]):
        for share in (0.40, 0.83):
            a, b = f0 + (h0 - f0) * share, f1 + (h1 - f1) * share
            a, b = a + [-0.07, -0.12, rng.normal(0, 0.02)], b + [-0.07, 0.12, rng.normal(0, 0.02)]
            t = np.linspace(0, 1, 130)[:, None]
            line = a * (1 - t) + b * t
            line[:, 2:] -= rng.uniform(0.0, 0.035) * 4 * t * (1 - t)
            line[:, 0] += 0.012 * shapes.noise(line * 1.4 + 30, 4)
            seed = int(rng.integers(1 << 20))

            def relief(angle, along, seed=seed):
                return 0.014 * np.cos(2 * angle) + grain(angle, along, seed)

            mesh.add(shapes.tube(line, rng.uniform(0.040, 0.048), 52, relief=relief), 0, rng.uniform(0, 1))
    mesh.build("fence", smooth=True)


def shed(at, turn, boards, tin, dark):
    """A hut of upright boards with a roof of corrugated sheets."""
    mesh = Mesh(boards, tin, dark)
    wide, deep, eaves, ridge = 3.6, 4.6, 2.2, 3.5

    def place(part, slot, tint):
        mesh.add(shapes.moved(part, at, turn), slot, tint)

    for y0, sign in ((0.0, -1), (deep, 1)):
        x = -wide / 2
        while x < wide / 2 - 0.03:
            w = min(rng.uniform(0.12, 0.19), wide / 2 - x)
            top = eaves + (ridge - eaves) * (1 - abs(x + w / 2) / (wide / 2)) - 0.04
            low = rng.uniform(0.02, 0.12)
            if not (y0 == 0.0 and 0.2 < x + w / 2 < 1.15):
                out = sign * rng.uniform(0.0, 0.012)
                place(shapes.box((x + 0.004, y0 - 0.012 + out, low), (x + w - 0.004, y0 + 0.012 + out, top), 0.003), 0, rng.uniform(0, 1))
            else:
                place(shapes.box((x + 0.004, 0.035, 0.08), (x + w - 0.004, 0.06, 1.95), 0.003), 0, rng.uniform(0, 0.4))
                place(shapes.box((x + 0.004, -0.012, 2.0), (x + w - 0.004, 0.012, top), 0.003), 0, rng.uniform(0, 1))
            x += w
    for x0, sign in ((-wide / 2, -1), (wide / 2, 1)):
        y = 0.0
        while y < deep - 0.03:
            w = min(rng.uniform(0.12, 0.19), deep - y)
            out = sign * rng.uniform(0.0, 0.012)
            place(shapes.box((x0 - 0.012 + out, y + 0.004, rng.uniform(0.02, 0.12)), (x0 + 0.012 + out, y + w - 0.004, eaves), 0.003), 0, rng.uniform(0, 1))
            y += w
    place(shapes.box((-wide / 2 + 0.03, 0.1, 0), (wide / 2 - 0.03, deep - 0.1, eaves - 0.05)), 2, 0.5)
    for z in (0.45, 1.55):
        place(shapes.box((0.2, 0.015, z), (1.12, 0.035, z + 0.11), 0.004), 0, 0.8)
    place(shapes.box((-1.25, -0.03, 1.1), (-0.45, 0.01, 1.75), 0.005), 2, 0.1)
    for low, high in (((-1.32, -0.05, 1.03), (-0.38, 0.0, 1.1)), ((-1.32, -0.05, 1.75), (-0.38, 0.0, 1.82)), ((-1.32, -0.05, 1.03), (-1.25, 0.0, 1.82)), ((-0.45, -0.05, 1.03), (-0.38, 0.0, 1.82)), ((-0.87, -0.045, 1.1), (-0.83, 0.0, 1.75))):
        place(shapes.box(low, high, 0.006), 0, 0.9)
    for side in (-1, 1):
        across = np.linspace(0, 1, 8)
        for k in range(6):
            y0 = -0.3 + k * (deep + 0.6) / 6
            ys = np.linspace(y0, y0 + (deep + 0.6) / 6 + 0.04, 60)
            t, y = np.meshgrid(across, ys)
            z = ridge + 0.05 - (ridge - eaves + 0.25) * t + 0.009 * np.sin(y * 2 * np.pi / 0.076) + 0.004 * (k % 2)
            points = np.stack([side * t * (wide / 2 + 0.3), y, z], axis=-1).reshape(-1, 3)
            place((points, shapes.strip_faces(60, 8)), 1, rng.uniform(0, 1))
    place(shapes.tube([[0, -0.3, ridge + 0.07], [0, deep + 0.3, ridge + 0.07]], 0.06, 10), 1, 0.4)
    mesh.build("shed")


def rusty_tin():
    s = Shader("tin")
    rust = s.remap(s.math("ADD", s.noise(1.6, 9.0, 0.7), s.math("MULTIPLY", s.attribute("tint"), 0.1)), 0.44, 0.62)
    tone = s.mix(rust, (0.20, 0.21, 0.22), (0.11, 0.045, 0.022))
    tone = s.shade(tone, s.remap(s.noise(7.0, 6.0), 0.3, 0.7, 0.7, 1.2))
    moss = s.remap(s.noise(2.6, 7.0, 0.7), 0.54, 0.64, 0.0, 0.7)
    tone = s.mix(moss, tone, (0.05, 0.06, 0.02))
    return s.finish(s.principled(tone, s.remap(rust, 0.0, 1.0, 0.35, 0.8), s.bump(rust, 0.001)))


def flowers(name, petals, center, stem, kinds, tall, size, count=6):
    """A tuft of stems with five-petaled flowers."""
    result = []
    for k in range(kinds):
        mesh = Mesh(petals, center, stem)
        at, toward, normals, lengths = [], [], [], []
        for _ in range(count):
            lean = rng.normal(0, 0.2, 2)
            path = plants.bough(rng, np.array([*rng.normal(0, 0.05, 2), 0]), np.array([*lean, 1.0]), tall * rng.uniform(0.6, 1.15), 8, 0.06, 0.0)
            mesh.add(shapes.tube(path, np.linspace(0.003, 0.0015, 8), 5), 2)
            head = path[-1]
            mesh.add(shapes.moved(shapes.sphere(5), head, scale=size * 0.22), 1)
            tilt = rng.normal(0, 0.35, 2)
            for petal in range(6):
                a = petal * shapes.TAU / 6 + rng.normal(0, 0.1)
                at.append(head)
                toward.append([np.cos(a), np.sin(a), 0.35 - tilt @ [np.cos(a), np.sin(a)]])
                normals.append([0, 0, 1.0])
                lengths.append(size * rng.uniform(0.85, 1.1))
            for _ in range(2):
                at.append(path[3])
                a = rng.uniform(0, shapes.TAU)
                toward.append([np.cos(a), np.sin(a), 0.9])
                normals.append([0, 0, 1.0])
                lengths.append(tall * 0.3)
        v, f, n = shapes.leaves(np.array(at), np.array(toward, float), np.array(normals), np.array(lengths), 0.45, 0.1, 0.3)
        petal_leaf = np.arange(len(at)) % 8 < 6
        each = f.reshape(len(at), -1, 4)
        mesh.add((v, each[petal_leaf].reshape(-1, 4)), 0).add((v, each[~petal_leaf].reshape(-1, 4)), 2)
        result.append(mesh.build(f"{name}{k}", smooth=True, link=False))
    return result


def petal(name, color):
    s = Shader(name)
    return s.finish(s.leaf(s.shade(color, s.remap(s.instance(), 0.0, 1.0, 0.7, 1.1)), 0.5, 0.35))


def build(args):
    plate.empty_scene()
    view = plate.camera(POSITION, TARGET, FOV_DEG)
    plate.gradient_sky([(0.0, (0.62, 0.66, 0.70)), (0.3, (0.80, 0.84, 0.88)), (1.0, (1.45, 1.5, 1.56))], 1.0, 0.25, (0.9, 0.93, 0.97))

    earth = soil()
    Mesh(earth).add(shapes.grid(np.linspace(-9, 10, 480), np.linspace(-4.5, 16, 520), height)).build("ground", smooth=True)
    Mesh(earth).add(shapes.grid(np.linspace(-70, 70, 281), np.linspace(15.4, 120, 160), lambda p: height(p) - 0.03)).build("far ground", smooth=True)
    for side in (-1, 1):
        xs = np.linspace(9.5, 60, 40)
        Mesh(earth).add(shapes.grid(side * xs if side > 0 else -xs[::-1], np.linspace(-4.5, 17, 30), height)).build("side ground", smooth=True)

    # Materials of plants.
    oak_bark = plants.bark("oak bark", (0.022, 0.018, 0.013), (0.115, 0.095, 0.072), mossy=0.55, wet=0.6)
    thin_bark = plants.bark("thin bark", (0.03, 0.025, 0.02), (0.13, 0.115, 0.095), mossy=0.3, wet=0.6, scale=2.0)
    leaf = plants.foliage("beech leaves", (0.045, 0.105, 0.014), (0.085, 0.125, 0.022), 0.32, 0.42)
    dark_leaf = plants.foliage("hazel leaves", (0.028, 0.068, 0.012), (0.055, 0.10, 0.022), 0.36, 0.38)
    grass = plants.foliage("grass", (0.050, 0.110, 0.016), (0.135, 0.150, 0.040), 0.4, 0.35)
    herb = plants.foliage("herbs", (0.040, 0.105, 0.018), (0.060, 0.120, 0.022), 0.35, 0.4)
    fern_green = plants.foliage("fern", (0.055, 0.125, 0.018), (0.105, 0.145, 0.030), 0.45, 0.4)
    brown = plants.foliage("brown leaves", (0.15, 0.075, 0.025), (0.075, 0.042, 0.020), 0.35, 0.12)

    # Near trunks, with bark as relief.
    for x, y, radius, tall, lean in ((-2.55, 2.6, 0.29, 5.0, 0.05), (3.75, 5.8, 0.22, 6.0, -0.04), (-4.3, 7.6, 0.20, 7.0, -0.02), (5.2, 10.5, 0.26, 8.0, 0.02), (-1.75, 12.8, 0.17, 8.0, 0.04)):
        foot = on_ground([[x, y, -0.12]])[0]
        path = plants.bough(rng, foot, np.array([lean, 0.0, 1.0]), tall, 9, 0.03, 0.0)
        part, tint = plants.trunk(rng, path, np.linspace(radius, radius * 0.72, 9), sides=170, spacing=0.013 * max(1, y / 5), depth=0.03, furrows=9)
        Mesh(oak_bark).add(part, 0, tint).build("trunk", smooth=True)

    # Limbs that hang into the picture from the near trunks.
    hanging = plants.Tree(np.random.default_rng(8))
    for start, heading, length in (((-2.5, 2.6, 3.55), (0.75, 0.1, 0.1), 3.0), ((-2.5, 2.7, 3.1), (-0.8, 0.3, 0.15), 2.6), ((3.7, 5.8, 3.9), (-0.7, -0.3, 0.05), 3.2), ((3.8, 5.9, 3.4), (0.7, -0.4, 0.1), 2.6), ((-4.3, 7.6, 3.8), (0.9, -0.1, 0.15), 3.4)):
        limb = plants.bough(hanging.rng, start, np.array(heading), length, 9, 0.08, -0.15)
        hanging.grow(limb, 0.035, 0, (11, 7), (0.42, 0.5), (0.8, 0.8), 0.09, (-0.15, -0.2), 13, 0.15)
    hanging.build("hanging", thin_bark, leaf, 0.085, 0.58, sides=(9, 5, 4), link=True)

    # The wood behind, and bushes at its edge.
    trees = [plants.broadleaf(np.random.default_rng(40 + k), f"tree{k}", 11.0, oak_bark, (leaf, dark_leaf, leaf)[k], 0.115, 1.25, bare=(0.15, 0.22, 0.1)[k]) for k in range(3)]
    spots = []
    for row, count in ((17, 12), (22, 14), (28, 16), (36, 20), (46, 24)):
        x = np.linspace(-row * 0.85, row * 0.85, count) + rng.normal(0, 0.8, count)
        y = row + rng.normal(0, 1.4, count)
        keep = (np.abs(x - path_middle(y)) > 1.9) & ~((np.abs(x + 5.2) < 3.4) & (y < 19))
        spots.append(np.stack([x, y, np.zeros(count)], axis=1)[keep])
    spots = on_ground(np.concatenate([*spots, [[-7.5, 10.0, 0], [7.8, 9.0, 0], [6.4, 14.2, 0], [9.5, 14.0, 0]]]))
    shapes.scatter("wood", trees, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.8, 1.25, len(spots)), rng.normal(0, 0.03, (len(spots), 2)))
    bushes = [plants.shrub(np.random.default_rng(60 + k), f"bush{k}", 1.5, thin_bark, (dark_leaf, leaf, dark_leaf)[k], (0.06, 0.07, 0.045)[k], 10) for k in range(3)]
    n = 90
    x = rng.uniform(-24, 24, n)
    y = 12.5 + 0.25 * np.abs(x) + rng.uniform(0, 12, n)
    keep = (np.abs(x - path_middle(y)) > 2.2) & ~((np.abs(x + 5.0) < 2.9) & (y < 19.5))
    spots = np.stack([x, y, np.zeros(n)], axis=1)[keep]
    extra = np.array([[-3.4, 4.6, 0], [-4.6, 5.4, 0], [-3.1, 9.4, 0], [4.6, 7.2, 0], [5.9, 8.4, 0], [3.5, 11.2, 0], [-6.3, 8.8, 0], [4.4, 13.6, 0], [-7.4, 12.0, 0]])
    spots = on_ground(np.concatenate([spots, extra]))
    shapes.scatter("bushes", bushes, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.6, 1.5, len(spots)))

    # Grass, herbs, ferns, flowers.
    beside = lambda x, y: off_path(x, y) * np.where(np.abs(x - path_middle(y)) < 0.9, 0.5, 1.0) * np.clip(0.35 + 1.1 * (0.5 + 0.5 * shapes.fbm(np.stack([x, y, 0 * x], axis=1) * 0.5, 3, 5)), 0, 1)
    tall = plants.grass_tufts(rng, "tall grass", grass, 5, 0.40, 36, 0.07, 0.0055, 0.55)
    short = plants.grass_tufts(rng, "short grass", grass, 4, 0.14, 40, 0.07, 0.0042, 0.7)
    for name, items, count, x, y, low, high in (
        ("near grass", tall, 3400, (-5.5, 5.5), (-3.2, 7.0), 0.45, 1.2), ("middle grass", tall, 4200, (-11, 11), (7.0, 20.0), 0.6, 1.35),
        ("turf", short, 6500, (-5, 5), (-3.4, 8.0), 0.6, 1.3), ("far grass", tall, 2600, (-22, 22), (18.0, 34.0), 0.9, 1.6),
    ):
        spots = around(count, x, y, beside)
        shapes.scatter(name, items, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(low, high, len(spots)), rng.normal(0, 0.12, (len(spots), 2)))
    sparse = around(420, (-1.5, 2.5), (-3.0, 12.0), lambda x, y: 0.25 + 0.75 * (off_path(x, y) > 0))
    shapes.scatter("path grass", short, sparse, rng.uniform(0, 6.3, len(sparse)), rng.uniform(0.25, 0.6, len(sparse)))
    low = plants.herbs(rng, "herb", herb, 5, 0.11)
    spots = around(2200, (-6, 6), (-3.2, 12.0), lambda x, y: off_path(x, y) * 0.7 + 0.03)
    shapes.scatter("herbs", low, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.5, 1.5, len(spots)))
    nettles = [plants.shrub(np.random.default_rng(80 + k), f"nettle{k}", 0.55, thin_bark, herb, 0.06, 7, 0.5, 8) for k in range(3)]
    spots = around(170, (-8, 8), (0.5, 14.0), lambda x, y: (np.abs(x - path_middle(y)) > 1.5) * 0.8)
    shapes.scatter("nettles", nettles, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.6, 1.3, len(spots)))
    ferns = [plants.fern(np.random.default_rng(90 + k), f"fern{k}", fern_green, 0.75) for k in range(3)]
    spots = around(70, (-9, 9), (0.8, 15.0), lambda x, y: (np.abs(x - path_middle(y)) > 1.9) * 0.8)
    near = on_ground([[-1.75, 1.1, 0], [-2.2, 1.7, 0], [-1.6, 3.4, 0], [2.6, 4.4, 0], [2.9, 2.5, 0], [-2.9, 1.4, 0]])
    spots = np.concatenate([spots, near])
    shapes.scatter("ferns", ferns, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.6, 1.25, len(spots)), rng.normal(0, 0.1, (len(spots), 2)))
    stem = plants.foliage("stems", (0.04, 0.09, 0.02), (0.07, 0.12, 0.03), 0.4, 0.3)
    yellow_eye = plain("eye", (0.5, 0.30, 0.02), 0.7)
    for name, color, count, x, y, tall_m, size in (
        ("lilies", (0.55, 0.045, 0.015), 34, (0.9, 2.5), (0.6, 8.5), 0.62, 0.055), ("daisies", (0.75, 0.75, 0.70), 120, (-4, 4), (-1.5, 9), 0.22, 0.020),
        ("buttercups", (0.75, 0.52, 0.02), 90, (-5, 5), (-1, 11), 0.30, 0.016), ("bellflowers", (0.16, 0.10, 0.45), 40, (-3.4, -0.8), (0.2, 8), 0.5, 0.03),
    ):
        items = flowers(name, petal(name, color), yellow_eye, stem, 3, tall_m, size, 5)
        spots = around(count, x, y, lambda x, y: (off_path(x, y) > 0.6) * 0.9)
        shapes.scatter(name, items, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.75, 1.2, len(spots)))

    # The path: pebbles, fallen leaves, twigs; boulders at its edge.
    pebble = Shader("pebble")
    tone = pebble.mix(pebble.instance(), (0.055, 0.050, 0.045), (0.20, 0.185, 0.165))
    tone = pebble.shade(tone, pebble.remap(pebble.noise(30.0, 5.0), 0.3, 0.7, 0.75, 1.2))
    pebble = pebble.finish(pebble.principled(tone, 0.45, pebble.bump(pebble.noise(90.0, 4.0), 0.002)))
    pebbles = [Mesh(pebble).add(shapes.stone(rng, (0.016, 0.012, 0.009), 7, 0.3, 0.1)).build(f"pebble{k}", smooth=True, link=False) for k in range(6)]
    on_path = lambda x, y: np.where(off_path(x, y) < 0.3, 0.35 + 0.65 * (shapes.fbm(np.stack([x, y, 0 * x], axis=1) * 1.3, 3, 6) > 0.0), 0.0)
    spots = around(9000, (-1.6, 2.6), (-3.4, 9.0), on_path)
    shapes.scatter("pebbles", pebbles, spots, rng.uniform(0, 6.3, len(spots)), rng.gamma(2.2, 0.42, len(spots)) + 0.25, rng.normal(0, 0.4, (len(spots), 2)))
    fallen = plants.litter(rng, "fallen", brown, 6, 0.06, 8, 0.16)
    spots = around(620, (-5, 5), (-3.4, 13.0), lambda x, y: 0.4 + 0.6 * off_path(x, y))
    shapes.scatter("litter", fallen, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.7, 1.2, len(spots)))
    stick = plants.twigs(rng, "stick", thin_bark, 4, 0.4)
    spots = around(130, (-4, 4), (-3.4, 11.0))
    shapes.scatter("sticks", stick, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.6, 1.3, len(spots)))
    s = Shader("boulder")
    tone = s.mix(s.remap(s.noise(2.5, 8.0, 0.65), 0.35, 0.65), (0.085, 0.082, 0.075), (0.21, 0.20, 0.18))
    tone = s.shade(tone, s.remap(s.noise(45.0, 5.0), 0.3, 0.7, 0.7, 1.25))
    cover = s.math("MULTIPLY", s.remap(s.upwardness(), 0.1, 0.85), s.remap(s.noise(4.0, 8.0, 0.7), 0.42, 0.56))
    tone = s.mix(cover, tone, (0.045, 0.075, 0.014))
    boulder = s.finish(s.principled(tone, 0.55, s.bump(s.noise(25.0, 8.0, 0.7), 0.012, 0.8, s.bump(cover, 0.01))))
    for x, y, size in ((-1.25, 0.35, 0.26), (-1.5, 0.85, 0.17), (1.5, 1.9, 0.20), (-0.85, 4.9, 0.3), (2.35, 6.8, 0.3), (-1.1, 7.6, 0.22), (-2.0, 0.6, 0.33)):
        part = shapes.stone(rng, np.array([1.0, 0.8, 0.6]) * size, 44, 0.35, 0.14)
        at = on_ground([[x, y, 0.12 * size]])[0]
        Mesh(boulder).add(shapes.moved(part, at, rng.uniform(0, 6))).build("boulder", smooth=True)

    fence(old_wood("fence wood", (0.055, 0.048, 0.040), (0.24, 0.215, 0.185), "Z", 0.55))
    shed((-5.0, 13.2, 0.12), 0.38, old_wood("boards", (0.035, 0.024, 0.017), (0.15, 0.105, 0.075), "Z", 0.3), rusty_tin(), plain("inside", (0.012, 0.011, 0.010), 0.8))
    return view


if __name__ == "__main__":
    arguments = plate.options("garden")
    seen = build(arguments)
    plate.make("garden", arguments, 0.75, seen, air=(420.0, (0.60, 0.64, 0.68)), halo=0.05)
