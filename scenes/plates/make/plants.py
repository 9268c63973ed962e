"""Trees, shrubs, ferns, grass and litter, and their materials."""

import numpy as np

import shapes
from shaders import Shader
from shapes import TAU, Mesh


# Materials

def bark(name, dark, light, moss=(0.06, 0.08, 0.02), mossy=0.35, wet=0.75, scale=1.0):
    """Furrowed bark: dark in the furrows (the mesh's tint), with lichen and moss."""
    s = Shader(name)
    tall = s.stretched(s.position(), (14.0 * scale, 14.0 * scale, 2.4 * scale))
    furrows = s.noise(1.0, 8.0, 0.66, tall, 0.6)
    grain = s.noise(90.0, 4.0, 0.6)
    level = s.math("ADD", s.math("MULTIPLY", furrows, 0.6), s.math("MULTIPLY", s.attribute("tint"), 0.45))
    color = s.mix(s.remap(level, 0.3, 0.72), dark, light)
    color = s.shade(color, s.remap(s.noise(1.3, 4.0), 0.3, 0.7, 0.65, 1.2))
    color = s.shade(color, s.remap(grain, 0.3, 0.7, 0.75, 1.2))
    lichen = s.remap(s.noise(9.0, 6.0, 0.7), 0.62, 0.72, 0.0, 0.5)
    color = s.mix(lichen, color, (0.22, 0.24, 0.19))
    green = s.math("MULTIPLY", s.remap(s.noise(1.7, 7.0, 0.65), 0.45, 0.62), mossy)
    color = s.mix(green, color, moss)
    normal = s.bump(furrows, 0.02, 0.9, s.bump(grain, 0.003, 0.6))
    return s.finish(s.principled(color, wet, normal, Specular_IOR_Level=0.35))


def foliage(name, young, old, roughness=0.42, transmitted=0.4):
    """Leaves between two colors, by their tint and by the tree."""
    s = Shader(name)
    tint = s.math("ADD", s.math("MULTIPLY", s.attribute("tint"), 0.75), s.math("MULTIPLY", s.instance(), 0.25))
    color = s.mix(tint, young, old)
    color = s.shade(color, s.remap(s.noise(0.9, 3.0), 0.3, 0.7, 0.75, 1.2))
    return s.finish(s.leaf(color, roughness, transmitted))


# Trees

def bough(rng, start, heading, length, joints, wander, rise):
    """A path that wanders and bends up (or, with negative `rise`, down)."""
    step = length / (joints - 1)
    path = [np.asarray(start, float)]
    heading = heading / np.linalg.norm(heading)
    for _ in range(joints - 1):
        heading = heading + rng.normal(0, wander, 3) + np.array([0, 0, rise]) * step / length
        heading /= np.linalg.norm(heading)
        path.append(path[-1] + step * heading)
    return np.array(path)


def side_heading(rng, tangent, angle, azimuth):
    """A direction at `angle` to the tangent."""
    helper = np.array([0.0, 0.0, 1.0]) if abs(tangent[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    a = np.cross(tangent, helper)
    a /= np.linalg.norm(a)
    b = np.cross(tangent, a)
    return np.cos(angle) * tangent + np.sin(angle) * (np.cos(azimuth) * a + np.sin(azimuth) * b)


def trunk(rng, path, radii, sides=120, spacing=0.02, depth=0.018, furrows=9.0, flare=0.5):
    """A stem with furrowed bark and a flared foot; also a tint that is dark in the furrows."""
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    count = max(int(length[-1] / spacing), 8)
    s = np.linspace(0, length[-1], count)
    fine = np.stack([np.interp(s, length, path[:, i]) for i in range(3)], axis=1)
    kernel = np.hanning(9)
    kernel /= kernel.sum()
    smooth = np.stack([np.convolve(np.pad(fine[:, i], 4, mode="reflect", reflect_type="odd"), kernel, "valid") for i in range(3)], axis=1)
    radius = np.interp(s, length, radii)
    seed = int(rng.integers(1 << 30))
    offset = rng.uniform(-99, 99, 3)
    store = []

    def relief(angle, along):
        r = np.interp(along, s, radius)
        points = np.stack([np.cos(angle) * furrows / 3, np.sin(angle) * furrows / 3, along * 1.6], axis=-1).reshape(-1, 3) + offset
        warp = 0.35 * shapes.fbm(points * 0.9, 2, seed + 3)
        cracks = shapes.ridged(points * 1.6 + warp[:, None], 3, seed)
        plates = 1 - np.clip((cracks - 0.62) / 0.3, 0, 1)
        store.append(plates)
        lumps = shapes.fbm(points * np.array([0.35, 0.35, 0.5]), 3, seed + 7)
        bark_relief = depth * (plates - 0.6) + 0.25 * depth * shapes.fbm(points * 5, 3, seed + 5, 0.6)
        roots = np.exp(-along / 0.28) * flare * (0.75 + 0.6 * np.cos(5 * angle + offset[0]) + 0.3 * np.cos(3 * angle + offset[1]))
        return bark_relief.reshape(angle.shape) + r * (0.07 * lumps.reshape(angle.shape) + roots)

    vertices, faces = shapes.tube(smooth, radius, sides, capped=False, relief=relief)
    return (vertices, faces), store[0]


class Tree:
    """Branches and leaf positions of one tree. `habit` has the shape, as keyword arguments of `grow`."""

    def __init__(self, rng):
        self.rng = rng
        self.limbs = []
        self.leaf_at, self.leaf_toward = [], []

    def grow(self, path, radius, level, counts, reach, angle, wander, rise, leaf_count, bare=0.0, taper=0.25):
        """Adds a branch, its side branches and the leaves of its last branches.

        `counts` has the side branches of a branch of each level, `reach` their length relative to hers, `angle` and `rise` how
        they stand. The lowest share `bare` of the branch has none. Short branches have fewer.
        """
        rng = self.rng
        self.limbs.append((path, np.linspace(radius, radius * taper, len(path)), level))
        if level == len(counts):
            t = rng.uniform(bare, 1, leaf_count) * (len(path) - 1)
            i = np.minimum(t.astype(int), len(path) - 2)
            f = (t - i)[:, None]
            along = path[i + 1] - path[i]
            along /= np.linalg.norm(along, axis=1, keepdims=True)
            self.leaf_at.append(path[i] * (1 - f) + path[i + 1] * f)
            self.leaf_toward.append(along + rng.normal(0, 0.7, (leaf_count, 3)))
            return
        length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        count = counts[level]
        azimuth = rng.uniform(0, TAU)
        for k in range(count):
            t = (bare + (1 - bare) * (k + rng.uniform(0.1, 0.9)) / count) * (len(path) - 1)
            i = min(int(t), len(path) - 2)
            at = path[i] + (t - i) * (path[i + 1] - path[i])
            tangent = path[i + 1] - path[i]
            tangent /= np.linalg.norm(tangent)
            azimuth += 2.4 + rng.normal(0, 0.4)
            remaining = 1 - t / (len(path) - 1)
            size = length * reach[level] * (0.35 + 0.65 * remaining) * rng.uniform(0.7, 1.2)
            heading = side_heading(rng, tangent, angle[level] * rng.uniform(0.75, 1.2), azimuth)
            child = bough(rng, at, heading, size, 7 if level < len(counts) - 1 else 4, wander, rise[level])
            thick = radius * (1 - (1 - taper) * (1 - remaining)) * 0.55
            self.grow(child, thick, level + 1, counts, reach, angle, wander, rise, leaf_count, 0.12, taper)

    def build(self, name, bark_material, leaf_material, leaf_length, leaf_width=0.55, sides=(14, 7, 5, 3), link=False, from_level=0):
        rng = self.rng
        mesh = Mesh(bark_material, leaf_material)
        for path, radii, level in self.limbs:
            if level >= from_level:
                mesh.add(shapes.tube(path, radii, sides[min(level, len(sides) - 1)], capped=False))
        at, toward = np.concatenate(self.leaf_at), np.concatenate(self.leaf_toward)
        toward[:, 2] -= 0.35
        normals = rng.normal(0, 0.45, at.shape) + np.array([0, 0, 1.0])
        lengths = leaf_length * rng.uniform(0.6, 1.25, len(at))
        vertices, faces, count = shapes.leaves(at, toward, normals, lengths, leaf_width)
        mesh.add((vertices, faces), 1, np.repeat(rng.uniform(0, 1, len(at)), count))
        return mesh.build(name, smooth=True, link=link)


def broadleaf(rng, name, height, bark_material, leaf_material, leaf_length=0.09, density=1.0, bare=0.25, radius=None, link=False):
    """A maple or lime: rising limbs, and foliage over most of its height."""
    tree = Tree(rng)
    stem = bough(rng, (0, 0, -0.1), np.array([0, 0, 1.0]), height, 14, 0.035, 0.1)
    tree.grow(
        stem, radius or height * 0.022, 0, (22, 11, 8), reach=(0.44, 0.46, 0.5), angle=(0.95, 0.85, 0.8), wander=0.1,
        rise=(0.35, 0.1, -0.1), leaf_count=round(15 * density), bare=bare,
    )
    return tree.build(name, bark_material, leaf_material, leaf_length, link=link)


def shrub(rng, name, height, bark_material, leaf_material, leaf_length=0.05, stems=9, leaf_width=0.5, leaf_count=12):
    """Stems from one foot, leafy to the ground."""
    tree = Tree(rng)
    for k in range(stems):
        lean = rng.uniform(0.1, 0.75)
        azimuth = k * 2.4 + rng.normal(0, 0.3)
        heading = np.array([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)])
        foot = np.array([0.12 * np.cos(azimuth), 0.12 * np.sin(azimuth), -0.03])
        stem = bough(rng, foot, heading, height * rng.uniform(0.7, 1.15), 8, 0.09, 0.1)
        tree.grow(stem, 0.012 * height, 0, (11, 7), (0.45, 0.5), (0.8, 0.8), 0.12, (0.2, 0.0), leaf_count, 0.12)
    return tree.build(name, bark_material, leaf_material, leaf_length, leaf_width, sides=(6, 4, 3))


def conifer(rng, name, height, bark_material, needle_material, bare=0.15, radius=None, density=1.0):
    """A spruce: tiers of drooping branches; needles are narrow leaves along the twigs."""
    tree = Tree(rng)
    stem = bough(rng, (0, 0, -0.1), np.array([0, 0, 1.0]), height, 14, 0.012, 0.05)
    tree.grow(
        stem, radius or height * 0.014, 0, (110, 22), reach=(0.24, 0.34), angle=(1.45, 0.95), wander=0.05, rise=(-0.25, -0.25),
        leaf_count=round(26 * density), bare=bare,
    )
    return tree.build(name, bark_material, needle_material, 0.055, 0.13, sides=(12, 5, 3))


# Low plants

def fern(rng, name, material, length=0.7, fronds=11):
    mesh = Mesh(material)
    at, toward, normals, lengths = [], [], [], []
    for k in range(fronds):
        azimuth = k * TAU / fronds + rng.normal(0, 0.25)
        lean = rng.uniform(0.5, 0.9)
        heading = np.array([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)])
        path = bough(rng, (0, 0, 0), heading, length * rng.uniform(0.7, 1.15), 26, 0.015, -1.5)
        mesh.add(shapes.tube(path, np.linspace(0.004, 0.001, len(path)), 4, capped=False))
        tangents, n, b = shapes.frames_along(path)
        across = np.cross(tangents, [0, 0, 1.0])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        t = np.linspace(0, 1, len(path))
        size = length * 0.27 * np.sin(np.pi * np.clip(t * 0.93 + 0.05, 0, 1)) ** 0.8 * (1.1 - 0.45 * t)
        for side in (-1, 1):
            at.append(path[3:])
            toward.append((side * across + 0.45 * tangents)[3:])
            normals.append(np.cross(across, tangents)[3:] + rng.normal(0, 0.08, (len(path) - 3, 3)))
            lengths.append(size[3:])
    at = np.concatenate(at)
    v, f, count = shapes.leaves(at, np.concatenate(toward), np.concatenate(normals), np.concatenate(lengths), 0.3, 0.05, 0.2)
    return mesh.add((v, f), 0, np.repeat(rng.uniform(0, 1, len(at)), count)).build(name, smooth=True, link=False)


def grass_tufts(rng, name, material, kinds, height, blades=34, spread=0.06, width=0.006, lean=0.45):
    result = []
    for k in range(kinds):
        part, tints = shapes.blades(rng, blades, spread, height * rng.uniform(0.8, 1.2), width, lean)
        result.append(Mesh(material).add(part, 0, tints).build(f"{name}{k}", smooth=True, link=False))
    return result


def herbs(rng, name, material, kinds, size, leaf_count=9, width=0.6):
    """Rosettes of broad leaves: clover, plantain, young shoots."""
    result = []
    for k in range(kinds):
        count = leaf_count + int(rng.integers(0, 5))
        azimuth = np.arange(count) * 2.4
        lift = rng.uniform(0.1, 0.9, count)
        toward = np.stack([np.cos(azimuth), np.sin(azimuth), lift], axis=1)
        at = toward * np.array([0.25, 0.25, 0.5]) * size * rng.uniform(0.3, 1, (count, 1))
        v, f, n = shapes.leaves(at, toward, np.tile([0, 0, 1.0], (count, 1)), size * rng.uniform(0.5, 1, count), width, 0.15, 0.4)
        mesh = Mesh(material).add((v, f), 0, np.repeat(rng.uniform(0, 1, count), n))
        result.append(mesh.build(f"{name}{k}", smooth=True, link=False))
    return result


def litter(rng, name, material, kinds, leaf_length, count=14, spread=0.15, width=0.6):
    """Fallen leaves that lie on each other."""
    result = []
    for k in range(kinds):
        azimuth = rng.uniform(0, TAU, count)
        toward = np.stack([np.cos(azimuth), np.sin(azimuth), rng.normal(0, 0.12, count)], axis=1)
        at = np.concatenate([rng.normal(0, spread, (count, 2)), rng.uniform(0.003, 0.018, (count, 1))], axis=1)
        normals = rng.normal(0, 0.3, (count, 3)) + np.array([0, 0, 1.0])
        lengths = leaf_length * rng.uniform(0.6, 1.2, count)
        v, f, n = shapes.leaves(at, toward, normals, lengths, width, rng.uniform(-0.1, 0.3), rng.uniform(-0.2, 0.3))
        mesh = Mesh(material).add((v, f), 0, np.repeat(rng.uniform(0, 1, count), n))
        result.append(mesh.build(f"{name}{k}", smooth=True, link=False))
    return result


def twigs(rng, name, material, kinds, length, count=5, spread=0.15):
    result = []
    for k in range(kinds):
        mesh = Mesh(material)
        for _ in range(count):
            azimuth = rng.uniform(0, TAU)
            start = np.array([*rng.normal(0, spread, 2), rng.uniform(0.004, 0.012)])
            path = bough(rng, start, np.array([np.cos(azimuth), np.sin(azimuth), rng.normal(0, 0.03)]), length * rng.uniform(0.3, 1), 6, 0.12, 0)
            path[:, 2] = np.maximum(path[:, 2], 0.003)
            mesh.add(shapes.tube(path, np.linspace(0.004, 0.0015, 6) * rng.uniform(0.6, 1.5), 5))
        result.append(mesh.build(f"{name}{k}", smooth=True, link=False))
    return result
