"""What the plates of the north share: eroded mountains, snow and tracks in it, conifers, birches, stones and floes."""

import bpy
import numpy as np

import plants
import shapes
from shaders import Shader, plain
from shapes import TAU, Mesh


def smoothstep(low, high, x):
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def flat(x, y, scale):
    """Points of a plane for the noise functions."""
    return np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3) * scale


# Land

def eroded(height, lift, base, cell, rounds, strength):
    """Rivers cut into rising land: the stream power law, solved implicitly from the mouths upward."""
    ny, nx = height.shape
    n = nx * ny
    index = np.arange(n).reshape(ny, nx)
    height = height.copy()
    r = np.random.default_rng(3)
    for _ in range(rounds):
        height += np.where(base, 0.0, lift)
        padded = np.pad(height, 1, mode="constant", constant_values=1e9)
        best, receiver = np.zeros((ny, nx)), index.copy()
        span = np.full((ny, nx), cell)
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                if dx == 0 and dy == 0:
                    continue
                length = cell * np.hypot(dx, dy)
                fall = (height - padded[1 + dy:1 + dy + ny, 1 + dx:1 + dx + nx]) / length * r.uniform(0.55, 1.0, (ny, nx))
                better = (fall > best) & ~base
                best = np.where(better, fall, best)
                receiver = np.where(better, index + dy * nx + dx, receiver)
                span = np.where(better, length, span)
        receiver, span = receiver.ravel(), span.ravel()
        # Steps to the mouth, by doubling.
        steps, jump = (receiver != np.arange(n)).astype(int), receiver.copy()
        while True:
            further = steps[jump]
            if not further.any():
                break
            steps = steps + further
            jump = jump[jump]
        order = np.argsort(steps, kind="stable")
        levels = np.split(order, np.searchsorted(steps[order], np.arange(1, steps.max() + 1)))
        area = np.full(n, cell * cell)
        for nodes in levels[:0:-1]:
            np.add.at(area, receiver[nodes], area[nodes])
        factor = strength * area ** 0.45 / span
        h = height.ravel()
        for nodes in levels[1:]:
            h[nodes] = (h[nodes] + factor[nodes] * h[receiver[nodes]]) / (1 + factor[nodes])
        height = h.reshape(ny, nx)
        around = np.pad(height, 1, mode="edge")
        mean = (around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:]) / 4
        height = height + 0.10 * (mean - height)
        # Scree: no slope stays steeper than about 50 degrees.
        for axis in (0, 1):
            step = np.diff(height, axis=axis)
            excess = np.sign(step) * np.maximum(np.abs(step) - 1.15 * cell, 0) * 0.22
            first = [slice(None)] * 2
            second = [slice(None)] * 2
            first[axis], second[axis] = slice(None, -1), slice(1, None)
            height[tuple(first)] += excess
            height[tuple(second)] -= excess
    return height


def resized(values, shape):
    """Bilinear."""
    y = np.linspace(0, values.shape[0] - 1, shape[0])
    x = np.linspace(0, values.shape[1] - 1, shape[1])
    rows = np.stack([np.interp(x, np.arange(values.shape[1]), row) for row in values])
    return np.stack([np.interp(y, np.arange(values.shape[0]), column) for column in rows.T], axis=1)


# Materials

def snow(name="snow", grain=1.0, color=(0.80, 0.825, 0.86)):
    s = Shader(name)
    tone = s.shade(color, s.remap(s.noise(0.7, 4.0), 0.3, 0.7, 0.95, 1.03))
    fine = s.bump(s.noise(34.0, 5.0, 0.65), 0.010 * grain, 0.7)
    normal = s.bump(s.noise(5.0, 4.0, 0.55), 0.02 * grain, 0.6, fine)
    return s.finish(s.principled(tone, 0.65, normal, Specular_IOR_Level=0.25))


def water():
    """Still water after a long exposure."""
    s = Shader("water")
    tone = s.mix(s.remap(s.noise(0.05, 3.0), 0.4, 0.6), (0.010, 0.017, 0.021), (0.013, 0.021, 0.025))
    return s.finish(s.principled(tone, 0.10, None, IOR=1.33))


def birch_bark():
    """White where it is thick, brown on twigs, and rime on these."""
    s = Shader("birch bark")
    bands = s.noise(1.0, 5.0, 0.65, s.stretched(s.position(), (9.0, 9.0, 30.0)))
    white = s.mix(s.remap(bands, 0.56, 0.63), (0.36, 0.345, 0.32), (0.035, 0.03, 0.028))
    twig = s.mix(s.remap(s.noise(6.0, 3.0), 0.4, 0.6), (0.045, 0.030, 0.024), (0.17, 0.16, 0.16))
    return s.finish(s.principled(s.mix(s.remap(s.attribute("tint"), 0.4, 0.8), twig, white), 0.8))


def shore_stone(white):
    """Dark stone under snow."""
    s = Shader("shore stone")
    level = s.math("ADD", s.upwardness(), s.math("MULTIPLY", s.math("SUBTRACT", s.noise(5.0, 5.0, 0.6), 0.5), 0.25))
    rock = s.mix(s.remap(s.noise(4.0, 8.0, 0.7), 0.35, 0.65), (0.035, 0.035, 0.037), (0.14, 0.135, 0.13))
    tone = s.mix(s.remap(level, 0.40, 0.48), rock, white)
    return s.finish(s.principled(tone, 0.75, s.bump(s.noise(20.0, 7.0, 0.7), 0.02, 0.7)))


def needles(name="dark needles", rimed=0.5):
    """Dark green; a few carry rime."""
    s = Shader(name)
    tint = s.attribute("tint")
    green = s.mix(tint, (0.010, 0.021, 0.012), (0.028, 0.042, 0.019))
    green = s.shade(green, s.remap(s.instance(), 0.0, 1.0, 0.7, 1.25))
    rime = s.math("MULTIPLY", s.remap(tint, 0.78, 0.86), s.remap(s.noise(0.8, 4.0), 0.42, 0.66, 0.0, rimed))
    tone = s.mix(rime, green, (0.56, 0.60, 0.64))
    return s.finish(s.leaf(tone, 0.6, 0.15))


def pine_bark():
    """Gray below, and orange where it peels, higher up."""
    s = Shader("pine bark")
    p = s.position()
    scales = s.noise(1.0, 7.0, 0.66, s.stretched(p, (13.0, 13.0, 3.2)), 0.6)
    low = s.mix(s.remap(scales, 0.35, 0.65), (0.030, 0.022, 0.017), (0.115, 0.090, 0.072))
    high = s.mix(s.remap(scales, 0.35, 0.65), (0.095, 0.045, 0.022), (0.240, 0.120, 0.060))
    tone = s.mix(s.remap(s.axis(p, "Z"), 2.5, 6.5), low, high)
    return s.finish(s.principled(tone, 0.8, s.bump(scales, 0.015, 0.8)))


def conifers():
    """What spruces and pines are made of, (bark, needles, snow) of each."""
    white = snow("tree snow", 0.5, (0.78, 0.81, 0.85))
    spruce_bark = plants.bark("spruce bark", (0.020, 0.015, 0.012), (0.085, 0.066, 0.052), mossy=0.1)
    return (spruce_bark, needles(), white), (pine_bark(), needles("pine needles", 0.35), white)


# Trees. Each has a seed of its own, and is a mesh of its own.

def around(azimuth, share, scale, seed):
    """Noise on the mantle of a crown."""
    return shapes.fbm(np.stack([np.cos(azimuth) * 0.9, np.sin(azimuth) * 0.9, share * scale], axis=-1), 3, seed)


def snow_lumps(mesh, slot, r, at, along, size, seed):
    """Flattened lumps of snow at points, drawn out along directions."""
    v, f = shapes.lathe([(0.0, 1.0), (0.6, 0.75), (0.95, 0.25), (0.9, -0.12), (0.5, -0.25), (0.0, -0.25)], 7)
    along = along * np.array([1, 1, 0.6])
    along = along / (np.linalg.norm(along, axis=1, keepdims=True) + 1e-9)
    side = np.cross(along, [0, 0, 1.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True) + 1e-9
    stretch = r.uniform(1.1, 2.2, (len(at), 1, 1))
    size = size[:, None, None]
    points = at[:, None, :] + size * (stretch * v[None, :, :1] * along[:, None, :] + v[None, :, 1:2] * side[:, None, :] + 0.75 * v[None, :, 2:] * np.array([0, 0, 1.0]))
    points = points + size * 0.4 * shapes.fbm(points.reshape(-1, 3) * 9.0, 2, seed).reshape(len(at), len(v), 1) * v[None]
    mesh.add((points.reshape(-1, 3), (f[None] + (np.arange(len(at)) * len(v))[:, None, None]).reshape(-1, 4)), slot)


def needle_quads(r, base, forward, length, width=0.11, spread=0.75, sag=-0.08):
    """Flat lozenges that point forward on all sides of twigs."""
    away = r.normal(0, 1, base.shape)
    away -= forward * np.sum(away * forward, axis=1, keepdims=True)
    away /= np.linalg.norm(away, axis=1, keepdims=True) + 1e-9
    toward = 0.65 * forward + spread * away + np.array([0, 0, sag])
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    across = np.cross(toward, r.normal(0, 1, base.shape))
    across /= np.linalg.norm(across, axis=1, keepdims=True) + 1e-9
    size = (length * r.uniform(0.65, 1.2, len(base)))[:, None]
    corners = np.stack([base, base + 0.45 * size * toward + width * size * across, base + size * toward, base + 0.45 * size * toward - width * size * across], axis=1)
    return corners.reshape(-1, 3), np.arange(4 * len(base)).reshape(-1, 4)


def spruce(name, height, materials, seed, crown=0.15, taper=0.9, foot=0.05, gaps=0.25, uneven=0.35, lee=0.15, bend=0.02, droop=1.0, load=1.0, top="leader", boughs=1.0,
           twig_step=0.085, needle_step=0.02, needle=0.06, rings=(9, 8)):
    """A spruce as it grew: boughs of uneven length, thinned on one side and in gaps, which carry snow where wind and thaw left it.

    `crown` is its largest radius and `foot` the height of its lowest boughs, relative to its height; `gaps` the share of boughs that are missing; `uneven` and `lee` how much their lengths vary,
    in patches and between two sides; `top` is "leader", "broken" or "forked". The materials are bark, needles and snow.
    """
    r = np.random.default_rng(seed)
    mesh = Mesh(*materials)
    joints = 18
    rise = np.linspace(0, 1, joints)
    heading, sway = r.uniform(0, TAU), r.uniform(0, TAU)
    offset = bend * height * (rise**1.6 + 0.35 * np.sin(3.2 * rise + sway))
    stem = np.stack([offset * np.cos(heading), offset * np.sin(heading), -0.3 + (height + 0.3) * rise], axis=1)
    stem[:, :2] += 0.006 * height * np.stack([np.sin(5 * rise + sway), np.sin(4.3 * rise + 2 * sway)], axis=1) * rise[:, None]
    stem[:, :2] -= stem[:1, :2]
    thick = np.linspace(0.011 * height + 0.02, 0.008, joints)
    broken = r.uniform(0.82, 0.9) if top == "broken" else 1.0
    whole = rise <= broken
    mesh.add(shapes.tube(stem[whole], thick[whole], 9, capped=True), 0)

    # Boughs: more of them toward the top, in loose whorls.
    count = round(95 * height**0.55 * boughs)
    share = foot + (1 - foot) * r.uniform(0, 1, count) ** 0.86 * 0.985
    whorl = np.round(share * height / (0.34 + 0.012 * height)) * (0.34 + 0.012 * height) / height
    share = np.where(r.uniform(size=count) < 0.55, whorl + r.normal(0, 0.05 / height, count), share)
    share = np.clip(share, foot, 0.992)
    azimuth = np.arange(count) * 2.39996 + r.normal(0, 0.5, count)
    keep = (around(azimuth, share, 6.0, seed + 1) > np.interp(gaps, (0, 1), (-1.0, 0.6)) - 0.5 * smoothstep(0.7, 0.95, share)) & (share < broken)
    share, azimuth = share[keep], azimuth[keep]
    count = len(share)
    s = np.clip((share - foot) / (1 - foot), 0, 1)
    length = crown * height * ((1 - s) ** taper * 0.97 + 0.03) * (1 - 0.45 * np.exp(-s / 0.07))
    length *= np.clip(1 + uneven * 1.3 * around(azimuth, share, 4.0, seed + 2), 0.35, 1.7) * (1 + lee * np.cos(azimuth - heading))
    length *= np.where(r.uniform(size=count) < 0.25, r.uniform(0.3, 0.7, count), r.uniform(0.75, 1.15, count))
    at_z = share * height
    n = 9
    t = np.linspace(0, 1, n)[None, :]
    first = np.interp(share, (0, 0.6, 0.85, 1.0), (-0.05, 0.15, 0.6, 1.1))[:, None] + r.normal(0, 0.16, (count, 1))
    hang = (0.95 * droop * (1 - 0.6 * share) * r.uniform(0.45, 1.4, count))[:, None]
    out = length[:, None] * t * (1 - 0.10 * t * hang)
    up = length[:, None] * (first * t - hang * t**1.7 + 0.34 * hang * t**4)
    turn = azimuth[:, None] + 0.2 * t * r.normal(0, 1, (count, 1))
    path = np.stack([out * np.cos(turn), out * np.sin(turn), at_z[:, None] + up], axis=-1)
    for axis in (0, 1):
        path[..., axis] += np.interp(at_z, stem[:, 2], stem[:, axis])[:, None]
    if top == "forked":
        # A second leader, from where the first one once broke.
        fork = share > 0.78
        second = fork & (r.uniform(size=count) < 0.45)
        apart = 0.035 * height * smoothstep(0.78, 0.9, share)[:, None, None] * np.array([np.cos(heading + 1.3), np.sin(heading + 1.3), -0.5])
        path = np.where(second[:, None, None], path + apart, path)
    for p, l in zip(path, length):
        mesh.add(shapes.tube(p[::2], np.linspace(0.010 * l + 0.006, 0.003, len(p[::2])), 4, capped=False), 0)
    # Dead twigs below the crown.
    for _ in range(round(5 * height * foot * 4)):
        z = r.uniform(0.02, foot + 0.12) * height
        a, l = r.uniform(0, TAU), r.uniform(0.25, 0.8) * crown * height
        base = np.array([np.interp(z, stem[:, 2], stem[:, 0]), np.interp(z, stem[:, 2], stem[:, 1]), z])
        stick = plants.bough(r, base, np.array([np.cos(a), np.sin(a), -0.2]), l, 6, 0.12, -0.2)
        mesh.add(shapes.tube(stick, np.linspace(0.014, 0.004, 6), 4, capped=False), 0)

    # Twigs: pairs along each bough, shorter toward its end, and needles on them.
    starts, ends = [], []
    for p, l in zip(path, length):
        k = max(int(l / twig_step), 3)
        q = np.clip(np.repeat(np.linspace(0.12, 1.0, k), 2) + r.uniform(-0.5, 0.5, 2 * k) / k, 0.03, 1.0)
        i = np.minimum((q * (n - 1)).astype(int), n - 2)
        f = (q * (n - 1) - i)[:, None]
        along = p[i + 1] - p[i]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        side = np.cross(along, [0, 0, 1.0])
        side /= np.linalg.norm(side, axis=1, keepdims=True) + 1e-9
        sign = np.tile([-1.0, 1.0], k)[:, None]
        toward = 0.75 * along + sign * side * r.uniform(0.5, 1.1, (2 * k, 1)) + np.array([0, 0, -0.42]) + r.normal(0, 0.22, (2 * k, 3))
        toward /= np.linalg.norm(toward, axis=1, keepdims=True)
        size = (0.36 * l * (1.05 - q) + 0.07) * r.uniform(0.45, 1.3, 2 * k)
        a = p[i] * (1 - f) + p[i + 1] * f
        starts.append(a)
        ends.append(a + toward * size[:, None])
    starts, ends = np.concatenate(starts + [p[:-1] for p in path]), np.concatenate(ends + [p[1:] for p in path])
    if top != "broken":
        z = np.linspace(0.9, 1.0, 7) * height
        tip = np.stack([np.interp(z, stem[:, 2], stem[:, 0]), np.interp(z, stem[:, 2], stem[:, 1]), z], axis=1)
        starts, ends = np.concatenate([starts, tip[:-1]]), np.concatenate([ends, tip[1:]])
    span = np.linalg.norm(ends - starts, axis=1)
    many = np.maximum((span / needle_step).astype(int), 2)
    which = np.repeat(np.arange(len(span)), many)
    f = r.uniform(0, 1.03, len(which))[:, None]
    mesh.add(needle_quads(r, starts[which] * (1 - f) + ends[which] * f, ((ends - starts) / (span[:, None] + 1e-9))[which], needle), 1, np.repeat(r.uniform(0, 1, len(which)), 4))

    # Snow lies in patches of the mantle: pads along boughs, and clumps on the sprays.
    bearing = np.clip(0.76 + 0.9 * around(azimuth, share, 5.0, seed + 3) + 0.25 * (load - 1), 0, 1.25) * load
    chosen = np.flatnonzero((length > 0.16) & (bearing > 0.3) & (r.uniform(size=count) < 0.25 + 0.6 * bearing))
    if len(chosen):
        m, (rows, sides) = len(chosen), rings
        p, l = path[chosen], length[chosen]
        begin, stop = r.uniform(0.08, 0.55, m), r.uniform(0.7, 1.07, m)
        q = np.linspace(0, 1, rows)
        at = np.clip(begin[:, None] + (stop - begin)[:, None] * q, 0, 1.0) * (n - 1)
        i = np.minimum(at.astype(int), n - 2)
        f = (at - i)[..., None]
        row = np.arange(m)[:, None]
        center = p[row, i] * (1 - f) + p[row, i + 1] * f
        along = p[row, i + 1] - p[row, i]
        side = np.cross(along, [0, 0, 1.0])
        side /= np.linalg.norm(side, axis=-1, keepdims=True) + 1e-9
        width = ((0.055 * l + 0.028) * bearing[chosen] * r.uniform(0.6, 1.35, m))[:, None] * np.sin(np.pi * q) ** 0.55
        angle = np.arange(sides) / sides * TAU
        tall = np.where(np.sin(angle) > 0, 0.72 * np.sqrt(np.abs(np.sin(angle))), -0.22 * np.abs(np.sin(angle)))
        points = center[:, :, None, :] + side[:, :, None, :] * (width[..., None] * np.cos(angle))[..., None]
        points[..., 2] += width[..., None] * tall + 0.01
        out_of = (points - center[:, :, None, :]).reshape(-1, 3)
        points = points.reshape(-1, 3)
        points = points + out_of * (0.75 * shapes.fbm(points * 8.0 + r.uniform(-50, 50, 3), 3, seed + 5, 0.65))[:, None]
        faces = (shapes.strip_faces(rows, sides, closed=True)[None] + (np.arange(m) * rows * sides)[:, None, None]).reshape(-1, 4)
        mesh.add((points, faces), 2)
    # On the sprays: few where boughs are bare.
    twig_azimuth = np.arctan2(starts[:, 1], starts[:, 0])
    twig_bearing = np.clip(0.5 + 0.9 * around(twig_azimuth, starts[:, 2] / height, 5.0, seed + 3), 0, 1.2) * load
    chosen = np.flatnonzero(r.uniform(size=len(starts)) < 0.55 * twig_bearing)
    f = r.uniform(0.2, 0.95, (len(chosen), 1))
    size = 0.034 * r.gamma(3.0, 0.33, len(chosen)) * (0.4 + 0.9 * np.clip(span[chosen] / 0.25, 0, 1)) * (0.7 + 0.04 * height) * (0.6 + 0.5 * load)
    snow_lumps(mesh, 2, r, starts[chosen] * (1 - f) + ends[chosen] * f + np.array([0, 0, 0.01]), (ends - starts)[chosen], size, seed + 6)
    return mesh.build(name, smooth=True, link=False)


def pine(name, height, materials, seed, bare=0.45, crown=0.2, load=1.0, bend=0.06, limbs=20):
    """A Scots pine: a bare stem, and an open crown of limbs that rise, with tufts of needles and snow on them."""
    r = np.random.default_rng(seed)
    tree = plants.Tree(r)
    stem = plants.bough(r, (0, 0, -0.3), np.array([r.normal(0, bend), r.normal(0, bend), 1.0]), height, 15, 0.028, 0.25)
    tree.grow(stem, 0.0125 * height + 0.03, 0, (limbs, 9, 5), (crown / 0.72, 0.5, 0.5), (1.35, 0.8, 0.75), 0.13, (0.55, 0.35, 0.3), 4, bare, 0.2)
    mesh = Mesh(*materials)
    for path, radii, level in tree.limbs:
        mesh.add(shapes.tube(path, np.maximum(radii, 0.006), (10, 6, 4, 3)[level], capped=False), 0)
    at, toward = np.concatenate(tree.leaf_at), np.concatenate(tree.leaf_toward)
    toward[:, 2] += 0.35
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    each = 13
    base = np.repeat(at, each, axis=0) + r.normal(0, 0.035, (len(at) * each, 3))
    mesh.add(needle_quads(r, base, np.repeat(toward, each, axis=0), 0.13, 0.06, 0.7, 0.0), 1, np.repeat(r.uniform(0, 1, len(base)), 4))
    azimuth = np.arctan2(at[:, 1], at[:, 0])
    bearing = np.clip(0.5 + 1.1 * around(azimuth, at[:, 2] / height, 7.0, seed + 3), 0, 1.2) * load
    chosen = np.flatnonzero(r.uniform(size=len(at)) < 0.75 * bearing)
    snow_lumps(mesh, 2, r, at[chosen] + np.array([0, 0, 0.05]), toward[chosen], 0.075 * r.gamma(3.0, 0.33, len(chosen)) * (0.5 + 0.6 * load), seed + 6)
    return mesh.build(name, smooth=True, link=False)


def birch(name, height, bark_material, seed, leans=(0.10, -0.16)):
    """A bare downy birch."""
    tree = plants.Tree(np.random.default_rng(seed))
    for lean in leans:
        stem = plants.bough(tree.rng, (0.1 * np.sign(lean), 0, -0.2), np.array([lean, 0.5 * lean, 1.0]), height * (1 - abs(lean)), 12, 0.06, 0.12)
        tree.grow(stem, 0.0085 * height, 0, (15, 9, 5), (0.36, 0.42, 0.45), (0.75, 0.7, 0.7), 0.10, (0.35, 0.15, 0.0), 1, 0.22)
    mesh = Mesh(bark_material)
    for path, radii, level in tree.limbs:
        mesh.add(shapes.tube(path, np.maximum(radii, 0.0035), (9, 5, 4, 3)[level], capped=False), 0, (0.9, 0.35, 0.2, 0.2)[level])
    return mesh.build(name, smooth=True, link=False)


def willow(name, height, bark_material, seed, stems=8):
    """A bare shrub."""
    r = np.random.default_rng(seed)
    tree = plants.Tree(r)
    for k in range(stems):
        lean, azimuth = r.uniform(0.1, 0.8), k * 2.4 + r.normal(0, 0.4)
        toward = np.array([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)])
        stem = plants.bough(r, (0.1 * np.cos(azimuth), 0.1 * np.sin(azimuth), -0.1), toward, height * r.uniform(0.5, 1.15), 8, 0.10, 0.1)
        tree.grow(stem, 0.009 * height, 0, (7, 4), (0.42, 0.45), (0.6, 0.6), 0.12, (0.4, 0.2), 1, 0.25)
    mesh = Mesh(bark_material)
    for path, radii, level in tree.limbs:
        mesh.add(shapes.tube(path, np.maximum(radii, 0.003), (5, 4, 3)[level], capped=False), 0, 0.2)
    return mesh.build(name, smooth=True, link=False)


def place(item, at, turn=0.0, size=1.0, tilt=(0.0, 0.0)):
    """A copy of an object that shares its mesh."""
    copy = item.copy()
    copy.location, copy.rotation_euler, copy.scale = at, (*tilt, turn), (size,) * 3
    bpy.context.scene.collection.objects.link(copy)
    return copy


# Steps, stones and floes

def steps_along(path, stride, foot, seed):
    """Steps along a path of points (n, 2): (x, y, direction, depth)."""
    r = np.random.default_rng(seed)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.arange(0.5 * stride, length[-1], stride)
    at = at + r.normal(0, 0.06, len(at))
    points = np.stack([np.interp(at, length, path[:, i]) for i in range(2)], axis=1)
    tangent = np.gradient(points, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    side = np.where(np.arange(len(at)) % 2 == 0, foot, -foot) + r.normal(0, 0.03, len(at))
    return np.column_stack([points + normal * side[:, None], np.arctan2(tangent[:, 1], tangent[:, 0]) + r.normal(0, 0.13, len(at)), r.uniform(0.16, 0.26, len(at))])


def trodden(x, y, steps):
    """What steps add to the height of the snow: holes, the drag of the heel, and a rim."""
    change = np.zeros_like(x)
    for sx, sy, heading, depth in steps:
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


def sink_around_stems(x, y, height, wells):
    """Lowers snow around the stems of trees, `wells` (x, y, radius), and piles it up at their rims."""
    for wx, wy, radius in wells:
        near = np.flatnonzero((np.abs(x - wx) < 3 * radius) & (np.abs(y - wy) < 3 * radius))
        r = np.hypot(x[near] - wx, y[near] - wy) / radius
        height[near] += radius * (0.16 * np.exp(-(((r - 1.05) / 0.45) ** 2)) - 0.30 * np.exp(-((r / 0.55) ** 2)))


def spaced(x, y, cell, wells, distance):
    """Indices of points of which no two stand in a square of that side, and none within a distance of a stem, nearest first."""
    taken, chosen = set(), []
    for k in np.argsort(y):
        square = (int(x[k] // cell), int(y[k] // cell))
        if square not in taken and all(np.hypot(x[k] - wx, y[k] - wy) > distance for wx, wy, _ in wells):
            taken.add(square)
            chosen.append(k)
    return chosen


def snowy_stone(mesh, r, at, size, turn, snow_depth=0.16, detail=44):
    """A boulder in slot 0, and the snow on it in slot 1."""
    size = np.asarray(size, float)
    v, f = shapes.stone(r, size, detail, 0.3, 0.15)
    mesh.add(shapes.moved((v, f), at, turn), 0)
    outward = v / np.linalg.norm(v / size, axis=1, keepdims=True) / size
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    wavy = outward[:, 2] + 0.30 * shapes.fbm(v * (1.6 / size.max()) + r.uniform(-9, 9, 3), 4, 3)
    depth = (smoothstep(0.42, 0.85, wavy) ** 0.7 - 0.10) * snow_depth * (1 + 0.35 * shapes.fbm(v * (2.5 / size.max()), 3, 5))
    cap = v + np.array([0, 0, 1.0]) * depth[:, None] - 0.03 * outward * (depth < 0)[:, None]
    mesh.add(shapes.moved((cap, f), at, turn), 1)


def floe(r, radius, thick=0.13, corners=11):
    """A plate of ice with a rim, frozen together from slush."""
    angle = (np.arange(corners * 3) + r.uniform(-0.25, 0.25, corners * 3)) / (corners * 3) * TAU
    knots = np.interp(angle, np.linspace(0, TAU, corners + 1), np.append(k := r.uniform(0.72, 1.12, corners), k[0]))
    outline = radius * knots * (1 + 0.03 * r.normal(size=len(angle)))
    stretch = r.uniform(0.65, 1.0)
    rings = ((1.0, -0.12), (1.02, 0.4 * thick), (0.97, 0.95 * thick), (0.9, 1.05 * thick), (0.78, 0.8 * thick), (0.4, 0.75 * thick), (0.02, 0.75 * thick))
    points = np.concatenate([np.stack([outline * k * np.cos(angle), outline * k * np.sin(angle) * stretch, np.full(len(angle), z)], axis=1) for k, z in rings])
    points[:, 2] += 0.02 * shapes.fbm(points * 2.2 + r.uniform(-50, 50, 3), 3, 5) * (points[:, 2] > 0)
    return points, shapes.strip_faces(len(rings), len(angle), closed=True)


def straw(kinds=4):
    """Dry grass that sticks out of the snow."""
    tone = plain("straw", (0.13, 0.10, 0.06), 0.8)
    return [Mesh(tone).add(shapes.blades(np.random.default_rng(30 + k), 9 + 3 * k, 0.10 + 0.03 * k, 0.5, 0.006, 0.5)[0]).build(f"straw {k}", link=False) for k in range(kinds)]
