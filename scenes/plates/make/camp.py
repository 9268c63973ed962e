"""`camp`: a camp in a pine wood at dusk, its fireplace laid but not lit: the fire is left to Bansho, at the origin."""

import numpy as np

import plants
import plate
import shapes
from shaders import Shader, plain
from shapes import TAU, Mesh

POSITION, TARGET, FOV_DEG = (0.0, 1.35, 4.3), (0.0, 0.72, 0.0), 33.0

rng = np.random.default_rng(31)


def height(points):
    """Level around the fireplace, uneven from 2.5 m away."""
    flat = points * np.array([1, 1, 0])
    far = np.clip((np.hypot(points[:, 0], points[:, 1]) - 2.2) / 3.0, 0, 1)
    pit = -0.03 * np.exp(-((np.hypot(points[:, 0], points[:, 1]) / 0.42) ** 4))
    return pit + 0.010 * shapes.fbm(flat * 3.0, 4, 2) + far * (0.05 + 0.14 * shapes.fbm(flat * 0.35, 3, 5))


def on_ground(points):
    points = np.asarray(points, float)
    points[:, 2] += height(points)
    return points


def around(count, x, y, keep=None):
    px, py = rng.uniform(*x, count * 4), rng.uniform(*y, count * 4)
    inside = np.hypot(px, py) > 0.55
    if keep is not None:
        inside &= rng.uniform(size=px.size) < keep(px, py)
    px, py = px[inside][:count], py[inside][:count]
    return on_ground(np.stack([px, py, np.zeros(len(px))], axis=1))


def patches(x, y, scale, seed):
    return np.clip(0.5 + 1.2 * shapes.fbm(np.stack([x, y, 0 * x], axis=1) * scale, 3, seed), 0, 1)


# Materials

def forest_floor():
    s = Shader("forest floor")
    p = s.position()
    tone = s.mix(s.remap(s.noise(1.6, 9.0, 0.68), 0.33, 0.67), (0.042, 0.027, 0.017), (0.135, 0.086, 0.052))
    needles = s.noise(1.0, 5.0, 0.7, s.stretched(p, (95.0, 28.0, 30.0)), 2.5)
    tone = s.shade(tone, s.remap(needles, 0.3, 0.7, 0.5, 1.45))
    distance = s.node("ShaderNodeVectorMath", {0: s.combine(s.axis(p, "X"), s.axis(p, "Y"), 0.0)}, operation="LENGTH").outputs["Value"]
    edge = s.math("ADD", distance, s.math("MULTIPLY", s.math("SUBTRACT", s.noise(7.0, 6.0, 0.65), 0.5), 0.45))
    trodden = s.remap(edge, 0.8, 1.9, 0.6, 0.0)
    tone = s.mix(trodden, tone, (0.075, 0.058, 0.044))
    ash = s.remap(edge, 0.36, 0.58, 1.0, 0.0)
    gray = s.mix(s.remap(s.noise(16.0, 8.0, 0.7), 0.36, 0.64), (0.012, 0.011, 0.011), (0.20, 0.195, 0.19))
    tone = s.mix(ash, tone, gray)
    soot = s.remap(edge, 0.5, 1.05, 0.65, 0.0)
    tone = s.mix(soot, tone, (0.016, 0.014, 0.013))
    tone = s.mix(ash, tone, gray)
    normal = s.bump(needles, 0.006, 0.9, s.bump(s.noise(14.0, 8.0, 0.7), 0.022, 0.9))
    return s.finish(s.principled(tone, 0.85, normal, Specular_IOR_Level=0.3))


def fire_stone():
    """Gray stones, black with soot on the side of the fire."""
    s = Shader("fire stone")
    p = s.position()
    tone = s.mix(s.attribute("tint"), (0.10, 0.098, 0.094), (0.22, 0.20, 0.175))
    tone = s.shade(tone, s.remap(s.noise(9.0, 9.0, 0.7), 0.3, 0.7, 0.6, 1.3))
    tone = s.shade(tone, s.remap(s.noise(80.0, 4.0), 0.3, 0.7, 0.75, 1.2))
    distance = s.node("ShaderNodeVectorMath", {0: s.combine(s.axis(p, "X"), s.axis(p, "Y"), 0.0)}, operation="LENGTH").outputs["Value"]
    edge = s.math("ADD", distance, s.math("MULTIPLY", s.math("SUBTRACT", s.noise(9.0, 6.0, 0.65), 0.5), 0.22))
    soot = s.remap(edge, 0.52, 0.76, 0.95, 0.0)
    tone = s.mix(soot, tone, (0.010, 0.009, 0.009))
    earth = s.remap(s.math("ADD", s.axis(p, "Z"), s.math("MULTIPLY", s.noise(12.0), 0.06)), 0.03, 0.09, 0.7, 0.0)
    tone = s.mix(earth, tone, (0.045, 0.032, 0.022))
    lichen = s.math("MULTIPLY", s.remap(s.noise(13.0, 7.0, 0.7), 0.57, 0.63), s.remap(edge, 0.7, 0.85, 0.0, 0.6))
    tone = s.mix(lichen, tone, (0.24, 0.26, 0.20))
    return s.finish(s.principled(tone, 0.75, s.bump(s.noise(38.0, 9.0, 0.72), 0.010, 0.9)))


def charred():
    """Half-burned wood: checked like alligator skin, ash on its edges."""
    s = Shader("charred")
    p = s.position()
    warped = s.mix(0.03, p, s.node("ShaderNodeTexNoise", {"Scale": 20.0, "Detail": 4.0}).outputs["Color"], "LINEAR_LIGHT")
    checks = s.cells(34.0, "DISTANCE_TO_EDGE", warped)
    distance = s.node("ShaderNodeVectorMath", {0: s.combine(s.axis(p, "X"), s.axis(p, "Y"), 0.0)}, operation="LENGTH").outputs["Value"]
    edge = s.math("ADD", distance, s.math("MULTIPLY", s.math("SUBTRACT", s.noise(11.0, 6.0, 0.65), 0.5), 0.25))
    burned = s.remap(edge, 0.26, 0.44, 1.0, 0.0)
    coal = s.mix(s.remap(s.noise(22.0, 7.0, 0.7), 0.56, 0.68, 0.0, 0.6), (0.010, 0.0095, 0.009), (0.17, 0.165, 0.16))
    grain = s.noise(55.0, 6.0, 0.65)
    wood = s.shade((0.085, 0.058, 0.038), s.remap(grain, 0.3, 0.7, 0.5, 1.4))
    tone = s.mix(burned, wood, coal)
    groove = s.remap(checks, 0.0, 0.10)
    tone = s.shade(tone, s.remap(groove, 0.0, 1.0, 0.35, 1.0))
    normal = s.bump(groove, 0.008, s.remap(burned, 0.0, 1.0, 0.15, 1.0), s.bump(grain, 0.006, 0.8))
    return s.finish(s.principled(tone, s.remap(burned, 0.0, 1.0, 0.8, 0.5), normal))


def end_grain():
    """Sawn wood: rings and radial cracks about the local axis, which the tint measures (0 at the heart)."""
    s = Shader("end grain")
    radius = s.math("ADD", s.attribute("tint"), s.math("MULTIPLY", s.math("SUBTRACT", s.noise(7.0, 3.0), 0.5), 0.09))
    rings = s.math("SINE", s.math("MULTIPLY", radius, 120.0))
    tone = s.mix(s.remap(rings, -1.0, 1.0), (0.20, 0.125, 0.065), (0.33, 0.225, 0.125))
    tone = s.mix(s.remap(radius, 0.0, 0.6, 0.4, 0.0), tone, (0.16, 0.075, 0.035))
    tone = s.shade(tone, s.remap(s.noise(9.0, 8.0, 0.7), 0.3, 0.7, 0.55, 1.15))
    return s.finish(s.principled(tone, 0.75, s.bump(s.noise(70.0, 5.0), 0.003, 0.8)))


# Things

def log(start, end, radius, bark_material, end_material, furrow=0.012, sides=110, name="log"):
    """A sawn trunk from start to end."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    t = np.linspace(0, 1, 12)[:, None]
    path = start * (1 - t) + end * t
    path[:, 2] += 0.03 * radius * np.sin(3 * t[:, 0])
    part, tint = plants.trunk(rng, path, np.linspace(radius, radius * 0.93, 12), sides, 0.012, furrow, 9, 0.0)
    mesh = Mesh(bark_material, end_material).add(part, 0, tint)
    v = part[0]
    for ring_of in (v[:sides], v[-sides:]):
        center = ring_of.mean(axis=0)
        shares = np.array([0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.88, 0.97])
        points = center + shares[:, None, None] * (ring_of - center)[None]
        axis = (end - start) / np.linalg.norm(end - start)
        saw = 0.004 * shapes.noise(points.reshape(-1, 3) * 30, 3)
        points = points.reshape(-1, 3) + saw[:, None] * axis
        mesh.add((points, shapes.strip_faces(len(shares), sides, closed=True)), 1, np.repeat(shares, sides))
        edge = np.concatenate([points[-sides:], ring_of])
        mesh.add((edge, shapes.strip_faces(2, sides, closed=True)), 0, 0.3)
    return mesh.build(name, smooth=True)


def split_log(mesh, start, end, radius, seed, slots):
    """A wedge of firewood: bark on the round, bare wood where it was split."""
    r = np.random.default_rng(seed)
    start, end = np.asarray(start, float), np.asarray(end, float)
    count, opening = 30, r.uniform(1.2, 2.4)
    angles = np.concatenate([np.linspace(-opening / 2, opening / 2, 16)])
    turn = r.uniform(0, TAU)
    outline = np.concatenate([[[0, 0]], radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    c, s = np.cos(turn), np.sin(turn)
    outline = (outline - outline.mean(axis=0)) @ np.array([[c, -s], [s, c]]).T
    axis = (end - start) / np.linalg.norm(end - start)
    side = np.cross(axis, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    up = np.cross(side, axis)
    t = np.linspace(0, 1, count)
    points = start + t[:, None, None] * (end - start) + outline[None, :, :1] * side + outline[None, :, 1:] * up
    points = points.reshape(-1, 3)
    rough = 0.10 * radius * shapes.fbm(points * np.array([22, 22, 22]), 4, seed % 1000)
    middle = np.repeat(start + t[:, None] * (end - start), len(outline), axis=0)
    points = points + rough[:, None] * (points - middle) / radius
    faces = shapes.strip_faces(count, len(outline), closed=True).reshape(count - 1, len(outline), 4)
    mesh.add((points, faces[:, 1:-1].reshape(-1, 4)), slots[0], 0.5)
    mesh.add((points, faces[:, [0, -1]].reshape(-1, 4)), slots[1], 0.5)
    for ring_of in (points[:len(outline)], points[-len(outline):]):
        shares = np.array([0.0, 0.5, 1.0])
        center = ring_of.mean(axis=0)
        p = (center + shares[:, None, None] * (ring_of - center)).reshape(-1, 3)
        mesh.add((p, shapes.strip_faces(3, len(outline), closed=True)), slots[2], np.repeat(0.3 + 0.6 * shares, len(outline)))


def canvas():
    s = Shader("canvas")
    p = s.position()
    tone = s.shade((0.27, 0.245, 0.17), s.remap(s.noise(1.8, 8.0, 0.65), 0.3, 0.7, 0.65, 1.12))
    damp = s.remap(s.math("ADD", s.axis(p, "Z"), s.math("MULTIPLY", s.noise(3.0, 5.0), 0.35)), 0.2, 0.6, 0.55, 1.0)
    tone = s.shade(tone, damp)
    weave = s.noise(260.0, 2.0)
    wrinkles = s.noise(2.4, 6.0, 0.55, None, 1.2)
    normal = s.bump(weave, 0.0006, 0.7, s.bump(wrinkles, 0.05, 0.7))
    front = s.principled(tone, 0.8, normal)
    through = s.node("ShaderNodeBsdfTranslucent", {"Color": tone, "Normal": normal}).outputs[0]
    return s.finish(s.blend(0.2, front, through))


def tent(at, turn, cloth, rope, pole):
    """A ridge tent: two sheets that hang between ridge and pegs, open in front."""
    mesh = Mesh(cloth, rope, pole)
    long, wide, tall = 2.3, 0.95, 1.38
    u, v = np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 44))
    for side in (-1, 1):
        ridge_sag = 0.07 * 4 * u * (1 - u)
        edge_wave = 0.06 * np.abs(np.sin(np.pi * 4 * u)) * v
        x = side * (wide * v**1.06 * (1 - 0.10 * np.sin(np.pi * v)) - edge_wave)
        z = (tall - ridge_sag) * (1 - v) - 0.05 * np.sin(np.pi * v) * np.sin(np.pi * u) + 0.03 * v
        y = u * long + 0.02 * np.sin(5 * v)
        fold = 0.012 * np.sin(14 * u + 5 * v) * v + 0.01 * shapes.fbm(np.stack([u * 6, v * 5, 0 * u + side], axis=-1).reshape(-1, 3), 3, 4).reshape(u.shape)
        points = np.stack([x + side * fold, y, z + 0.5 * fold], axis=-1).reshape(-1, 3)
        mesh.add(shapes.moved((points, shapes.strip_faces(44, 60)), at, turn), 0)
        # The flap, folded back.
        u2, v2 = np.meshgrid(np.linspace(0, 1, 24), np.linspace(0, 1, 30))
        x = side * (wide * v2 * (1 - 0.62 * u2 * (0.25 + 0.75 * v2)))
        z = tall * (1 - v2) + 0.03 * v2
        y = -0.02 - 0.10 * np.sin(np.pi * u2) * v2 + 0.03 * np.sin(16 * u2) * v2
        mesh.add(shapes.moved((np.stack([x, y, z], axis=-1).reshape(-1, 3), shapes.strip_faces(30, 24)), at, turn), 0)
        for y in np.linspace(0, long, 5):
            line = [[side * (wide - 0.03), y, 0.05], [side * (wide + 0.25), y, 0.0]]
            mesh.add(shapes.moved(shapes.tube(line, 0.004, 5), at, turn), 1)
    back = np.array([[-wide, long, 0.03], [wide, long, 0.03], [0, long, tall], [0, long, tall - 0.01]])
    mesh.add(shapes.moved((back, np.array([[0, 1, 3, 2]])), at, turn), 0)
    for y in (0.0, long):
        mesh.add(shapes.moved(shapes.tube([[0, y, -0.05], [0, y, tall + 0.06]], 0.018, 10), at, turn), 2)
    for end in ([[0, 0, tall], [0.1, -1.5, 0.0]], [[0, long, tall], [0, long + 1.4, 0.0]]):
        mesh.add(shapes.moved(shapes.tube(end, 0.004, 5), at, turn), 1)
    mesh.build("tent", smooth=True)


def build(args):
    plate.empty_scene()
    view = plate.camera(POSITION, TARGET, FOV_DEG)
    plate.gradient_sky(
        [(0.0, (0.95, 0.56, 0.33)), (0.10, (0.62, 0.50, 0.46)), (0.28, (0.30, 0.36, 0.48)), (1.0, (0.105, 0.165, 0.32))], 1.0, 0.30,
        (0.34, 0.30, 0.36), ((0.35, 1.0, 0.02), (1.1, 0.42, 0.14), 9.0))
    floor = forest_floor()
    Mesh(floor).add(shapes.grid(np.linspace(-5, 5, 500), np.linspace(-3.6, 6.5, 500), height)).build("floor", smooth=True)
    for x, y in (((-60, 60), (6.5, 90)), ((-60, -5), (-4, 6.5)), ((5, 60), (-4, 6.5))):
        Mesh(floor).add(shapes.grid(np.linspace(*x, 120), np.linspace(*y, 110), height)).build("far floor", smooth=True)

    pine_bark = plants.bark("pine bark", (0.020, 0.014, 0.010), (0.130, 0.090, 0.064), (0.07, 0.085, 0.03), 0.35, 0.8, 0.8)
    log_bark = plants.bark("log bark", (0.022, 0.017, 0.013), (0.115, 0.088, 0.066), (0.06, 0.08, 0.02), 0.35, 0.8, 1.2)
    twig_bark = plants.bark("twig bark", (0.02, 0.016, 0.013), (0.085, 0.066, 0.05), mossy=0.1, scale=2.0)
    needle = plants.foliage("needles", (0.016, 0.034, 0.011), (0.032, 0.050, 0.018), 0.5, 0.15)
    dry_needle = plants.foliage("dry needles", (0.22, 0.115, 0.048), (0.10, 0.058, 0.030), 0.65, 0.05)
    grass = plants.foliage("wood grass", (0.045, 0.075, 0.016), (0.12, 0.105, 0.040), 0.5, 0.3)
    green = plants.foliage("bilberry", (0.030, 0.065, 0.014), (0.055, 0.075, 0.020), 0.4, 0.3)
    fern_green = plants.foliage("fern", (0.050, 0.090, 0.018), (0.12, 0.095, 0.030), 0.5, 0.35)
    sawn = end_grain()

    # The fireplace.
    stones = Mesh(fire_stone())
    count = 13
    for k in range(count):
        a = TAU * (k + rng.uniform(-0.18, 0.18)) / count + 0.2
        size = rng.uniform(0.105, 0.165)
        part = shapes.stone(rng, np.array([rng.uniform(0.9, 1.25), rng.uniform(0.75, 1.0), rng.uniform(0.6, 0.85)]) * size, 46, 0.3, 0.12)
        r = 0.64 + rng.normal(0, 0.025)
        stones.add(shapes.moved(part, (r * np.cos(a), r * np.sin(a), 0.50 * size), a + rng.normal(0, 0.4)), 0, rng.uniform(0, 1))
    for _ in range(9):
        a, r, size = rng.uniform(0, TAU), rng.uniform(0.78, 1.6), rng.uniform(0.02, 0.055)
        stones.add(shapes.moved(shapes.stone(rng, np.array([1.0, 0.8, 0.6]) * size, 20), (r * np.cos(a), r * np.sin(a), 0.2 * size)), 0, rng.uniform(0, 1))
    stones.build("ring", smooth=True)
    burned = charred()
    for start, end, radius in (
        ((-0.42, -0.06, 0.055), (0.30, 0.10, 0.07), 0.055), ((-0.28, 0.26, 0.05), (0.40, -0.10, 0.06), 0.05), ((-0.05, -0.38, 0.05), (0.10, 0.32, 0.16), 0.045),
        ((-0.36, 0.16, 0.05), (0.14, -0.06, 0.24), 0.038), ((0.36, 0.22, 0.05), (-0.10, -0.02, 0.25), 0.036), ((0.30, -0.26, 0.04), (-0.04, 0.05, 0.26), 0.034),
    ):
        log(start, end, radius, burned, burned, 0.006, 64, "fire log")
    coals = [Mesh(burned).add(shapes.stone(rng, (0.022, 0.016, 0.013), 9, 0.6, 0.15)).build(f"coal{k}", smooth=False, link=False) for k in range(4)]
    n = 260
    a, r = rng.uniform(0, TAU, n), 0.46 * np.sqrt(rng.uniform(0, 1, n))
    spots = on_ground(np.stack([r * np.cos(a), r * np.sin(a), np.full(n, 0.006)], axis=1))
    shapes.scatter("coals", coals, spots, rng.uniform(0, 6.3, n), rng.gamma(2.5, 0.36, n), rng.normal(0, 0.4, (n, 2)))

    # Seats, a block with an ax, firewood.
    log((-1.95, -0.55, 0.185), (-1.28, 1.20, 0.185), 0.195, log_bark, sawn, 0.012, 150)
    log((0.55, 1.72, 0.175), (2.25, 1.42, 0.175), 0.185, log_bark, sawn, 0.012, 150)
    log((1.52, -0.08, -0.02), (1.50, -0.06, 0.43), 0.175, log_bark, sawn, 0.012, 150, "block")
    wood = Mesh(log_bark, plain("split wood", (0.30, 0.20, 0.11), 0.75), sawn)
    seed = 100
    for row, per_row in enumerate((6, 5, 4, 2)):
        for k in range(per_row):
            x = 1.98 + 0.135 * k + 0.065 * row + rng.normal(0, 0.012)
            y = 0.42 + rng.normal(0, 0.03)
            z = 0.07 + 0.105 * row + rng.normal(0, 0.006)
            skew = rng.normal(0, 0.03)
            split_log(wood, (x - skew, y - 0.19, z), (x + skew, y + 0.22, z + rng.normal(0, 0.01)), rng.uniform(0.085, 0.12), seed, (0, 1, 2))
            seed += 1
    for x, y, turn in ((1.05, -0.55, 0.4), (1.30, 0.45, 1.9), (-0.95, -0.62, 2.5), (0.98, 0.78, -0.3)):
        c, s = 0.2 * np.cos(turn), 0.2 * np.sin(turn)
        split_log(wood, (x - c, y - s, 0.045), (x + c, y + s, 0.05), 0.075, seed, (0, 1, 2))
        seed += 1
    wood.build("firewood", smooth=True).data.set_sharp_from_angle(angle=0.7)
    ax = Mesh(plain("handle", (0.28, 0.17, 0.08), 0.45), plain("steel", (0.20, 0.20, 0.21), 0.35, Metallic=0.9))
    t = np.linspace(0, 1, 16)
    handle = np.array([1.50, -0.05, 0.47]) + t[:, None] * np.array([0.40, 0.10, 0.40]) + 0.02 * np.sin(t * 5)[:, None] * np.array([-0.6, 0, 0.7])
    ax.add(shapes.tube(handle, 0.016 + 0.004 * np.cos(t * 6), 12), 0)
    head = shapes.box((-0.10, -0.017, -0.045), (0.075, 0.017, 0.045), 0.008)
    v = head[0].copy()
    v[:, 1] *= np.where(v[:, 0] < -0.02, 0.25, 1.0)
    v[:, 2] *= np.where(v[:, 0] < -0.02, 1.35, 1.0)
    ax.add(shapes.moved(shapes.rotated((v, head[1]), (0, 1, 0), -0.8), (1.51, -0.05, 0.46)), 1)
    ax.build("ax", smooth=True).data.set_sharp_from_angle(angle=0.5)
    enamel = plain("enamel", (0.05, 0.10, 0.20), 0.2, Coat_Weight=0.5)
    mug = shapes.lathe([(0.0, 0.0), (0.038, 0.0), (0.041, 0.006), (0.041, 0.078), (0.043, 0.082), (0.039, 0.08), (0.038, 0.01), (0.0, 0.008)], 32)
    handle = np.array([0.041, 0, 0.065]) + np.stack([0.028 * np.sin(np.linspace(0, np.pi, 12)), 0 * np.linspace(0, 1, 12), -0.048 * np.linspace(0, 1, 12)], axis=1)
    cup = Mesh(enamel).add(mug).add(shapes.tube(handle, 0.004, 8)).build("mug", smooth=True)
    cup.location, cup.rotation_euler = (-1.52, 0.42, 0.372), (0.05, 0.02, 2.0)

    tent((-2.15, 3.6, float(height(np.array([[-2.1, 4.2, 0.0]]))[0]) - 0.02), 0.30, canvas(), plain("rope", (0.35, 0.32, 0.25), 0.8), plain("pole", (0.22, 0.15, 0.09), 0.6))

    # Trunks: near ones with bark as relief and stubs of branches.
    near = ((-3.05, 2.5, 0.20), (2.95, 3.2, 0.23), (0.95, 6.0, 0.19), (-0.75, 7.4, 0.16), (3.9, 6.4, 0.20), (-3.9, 6.9, 0.19), (2.1, 8.8, 0.18), (-2.3, 9.6, 0.2), (4.9, 9.2, 0.21), (0.3, 11.0, 0.19), (-5.2, 10.2, 0.2))
    for x, y, radius in near:
        foot = on_ground([[x, y, -0.12]])[0]
        path = plants.bough(rng, foot, np.array([rng.normal(0, 0.03), 0.0, 1.0]), 8.0, 10, 0.018, 0.05)
        fine = 0.014 * max(1.0, (y + 4) / 7)
        part, tint = plants.trunk(rng, path, np.linspace(radius, radius * 0.7, 10), round(150 / max(1.0, (y + 4) / 9)), fine, 0.018, 7.5, 0.35)
        mesh = Mesh(pine_bark).add(part, 0, tint)
        for _ in range(11):
            z = rng.uniform(1.2, 6.5)
            i = int(z / 8.0 * 9)
            a = rng.uniform(0, TAU)
            start = path[i] + (path[i + 1] - path[i]) * (z / 8.0 * 9 - i)
            stub = plants.bough(rng, start, np.array([np.cos(a), np.sin(a), -0.15]), rng.uniform(0.3, 1.3), 7, 0.12, -0.2)
            mesh.add(shapes.tube(stub, np.linspace(0.018, 0.005, 7), 6), 0, 0.4)
        mesh.build("pine", smooth=True)
    spruces = [plants.conifer(np.random.default_rng(200 + k), f"spruce{k}", 11.0, pine_bark, needle, bare=(0.1, 0.25, 0.04)[k]) for k in range(3)]
    spots = []
    for row, count in ((11, 9), (15, 12), (20, 15), (27, 20), (36, 26)):
        x = np.linspace(-row * 0.95, row * 0.95, count) + rng.normal(0, 0.7, count)
        y = row + rng.normal(0, 1.2, count)
        gap = np.abs(x - 0.22 * y) > (1.3 if row < 30 else 2.2)
        spots.append(np.stack([x, y, np.zeros(count)], axis=1)[gap])
    spots = on_ground(np.concatenate([*spots, [[-5.2, 4.5, 0], [5.6, 4.8, 0], [-6.4, 7.8, 0], [6.6, 7.2, 0]]]))
    shapes.scatter("wood", spruces, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.65, 1.25, len(spots)), rng.normal(0, 0.02, (len(spots), 2)))
    young = on_ground(np.array([[-1.35, 6.2, 0], [1.9, 5.6, 0], [3.1, 7.6, 0], [-4.3, 5.6, 0], [-0.2, 9.4, 0], [4.5, 5.2, 0]]))
    shapes.scatter("young spruces", spruces[2:], young, rng.uniform(0, 6.3, len(young)), rng.uniform(0.10, 0.2, len(young)))

    # Litter and low plants.
    open_ground = lambda x, y: np.clip((np.hypot(x, y) - 0.9) / 1.6, 0, 1)
    fallen = plants.litter(rng, "needle litter", dry_needle, 6, 0.055, 70, 0.10, 0.045)
    spots = around(3600, (-4.5, 4.5), (-3.2, 7.0), lambda x, y: 0.25 + 0.75 * open_ground(x, y))
    shapes.scatter("needle floor", fallen, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.7, 1.4, len(spots)))
    leaves = plants.litter(rng, "leaf litter", plants.foliage("old leaves", (0.17, 0.085, 0.03), (0.08, 0.045, 0.02), 0.5, 0.1), 5, 0.05, 5, 0.15)
    spots = around(200, (-4, 4), (-3.0, 6.0), open_ground)
    shapes.scatter("leaf floor", leaves, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.6, 1.2, len(spots)))
    stick = plants.twigs(rng, "stick", twig_bark, 6, 0.45, 4)
    spots = around(260, (-4.5, 4.5), (-3.2, 8.0), lambda x, y: 0.15 + 0.85 * open_ground(x, y))
    shapes.scatter("sticks", stick, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.5, 1.4, len(spots)))
    cones = [Mesh(plain("cone", (0.09, 0.055, 0.032), 0.75)).add(shapes.stone(rng, (0.03, 0.018, 0.017), 14, 0.0, 0.35)).build("cone", link=False)]
    spots = around(90, (-4, 4), (-3.0, 6.0), open_ground)
    shapes.scatter("cones", cones, spots + [0, 0, 0.012], rng.uniform(0, 6.3, len(spots)), rng.uniform(0.7, 1.2, len(spots)))
    tufts = plants.grass_tufts(rng, "wood grass", grass, 5, 0.24, 34, 0.05, 0.0042, 0.65)
    spots = around(1500, (-6.5, 6.5), (-3.2, 9.0), lambda x, y: open_ground(x, y) * patches(x, y, 0.7, 9) ** 1.5)
    shapes.scatter("grass", tufts, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.5, 1.4, len(spots)), rng.normal(0, 0.15, (len(spots), 2)))
    bilberry = [plants.shrub(np.random.default_rng(300 + k), f"bilberry{k}", 0.28, twig_bark, green, 0.026, 10, 0.6, 9) for k in range(3)]
    spots = around(420, (-9, 9), (1.5, 14.0), lambda x, y: np.clip((np.hypot(x, y) - 2.6) / 2.0, 0, 1) * patches(x, y, 0.45, 3) * ~((np.abs(x + 2.3) < 1.2) & (y > 3.4) & (y < 6.2)))
    shapes.scatter("bilberries", bilberry, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.7, 1.5, len(spots)))
    ferns = [plants.fern(np.random.default_rng(320 + k), f"fern{k}", fern_green, 0.6) for k in range(3)]
    spots = on_ground(np.array([[-2.75, 1.75, 0], [-3.3, 1.9, 0], [2.55, 2.5, 0], [3.2, 2.4, 0], [1.35, 5.3, 0], [-0.9, 6.4, 0], [3.5, 5.0, 0], [2.35, 3.4, 0], [-3.6, 3.2, 0], [0.5, 6.6, 0]], float))
    shapes.scatter("ferns", ferns, spots, rng.uniform(0, 6.3, len(spots)), rng.uniform(0.7, 1.3, len(spots)), rng.normal(0, 0.1, (len(spots), 2)))
    if args.lamps:
        plate.point_light((0, 0, 0.45), (1.0, 0.45, 0.13), 90.0, 0.2)
    return view


if __name__ == "__main__":
    arguments = plate.options("camp")
    seen = build(arguments)
    plate.make("camp", arguments, 1.7, seen, air=(220.0, (0.22, 0.20, 0.22)), halo=0.06)
