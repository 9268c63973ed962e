"""`street`: a wet street of old town houses at night. The nearest lamp is off: it is left to Bansho."""

import bpy
import numpy as np

import cars
import plants
import plate
import shapes
from shaders import Shader, glow, plain
from shapes import Mesh

POSITION, TARGET, FOV_DEG = (0.9, 1.55, 4.0), (-0.45, 2.25, -16.0), 38.0
LAMP = (3.57, 5.16, -7.5)   # the middle of the lamp that Bansho adds, below the housing
KERB = 0.11
LEFT, RIGHT = -6.7, 6.5     # the facades
ROAD = (-4.1, 4.1)

rng = np.random.default_rng(7)


# Materials

def asphalt():
    s = Shader("asphalt")
    p = s.position()
    x, y = s.axis(p, "X"), s.axis(p, "Y")
    grit = s.cells(85.0, output=1)
    stones = s.remap(s.axis(grit, "X"), 0.0, 1.0, 0.45, 1.5)
    color = s.shade((0.045, 0.044, 0.043), stones)
    color = s.shade(color, s.remap(s.noise(0.55, 7.0, 0.6), 0.3, 0.7, 0.7, 1.3))

    # Repairs: rectangles with ragged edges, newer and darker than the rest.
    wobble = s.math("MULTIPLY", s.math("SUBTRACT", s.noise(2.5, 5.0), 0.5), 0.22)
    repairs = 0.0
    for x0, x1, y0, y1 in ((-1.1, 0.7, 1.2, 4.4), (0.9, 2.0, 6.2, 13.0), (-2.3, -1.3, 7.0, 9.5), (-0.6, 0.5, 15, 24), (1.6, 3.6, 0.2, 2.2)):
        dx = s.math("SUBTRACT", (x1 - x0) / 2, s.math("ABSOLUTE", s.math("SUBTRACT", x, (x0 + x1) / 2)))
        dy = s.math("SUBTRACT", (y1 - y0) / 2, s.math("ABSOLUTE", s.math("SUBTRACT", y, (y0 + y1) / 2)))
        inside = s.math("ADD", s.math("MINIMUM", dx, dy), s.math("MULTIPLY", wobble, 0.3))
        repairs = s.math("MAXIMUM", repairs, s.remap(inside, 0.0, 0.03))
    color = s.mix(s.math("MULTIPLY", repairs, 0.75), color, (0.017, 0.017, 0.018))

    # Cracks, and the tar that was poured into some of them.
    warped = s.mix(0.22, p, s.node("ShaderNodeTexNoise", {"Scale": 1.8, "Detail": 6.0}).outputs["Color"], "LINEAR_LIGHT")
    edges = s.cells(0.42, "DISTANCE_TO_EDGE", warped)
    where = s.remap(s.noise(0.28, 2.0), 0.46, 0.56)
    cracks = s.math("MULTIPLY", s.remap(edges, 0.002, 0.010, 1.0, 0.0), where)
    tar = s.math("MULTIPLY", s.remap(edges, 0.012, 0.018, 1.0, 0.0), s.remap(s.noise(0.35, 1.0), 0.56, 0.6))
    color = s.mix(s.math("MAXIMUM", cracks, tar), color, (0.006, 0.006, 0.006))

    # Markings, worn off by tires.
    worn = s.remap(s.math("ADD", s.noise(5.0, 9.0, 0.72), s.math("MULTIPLY", s.noise(0.6), 0.35)), 0.58, 0.72, 1.0, 0.08)
    dash = s.math("LESS_THAN", s.math("MODULO", s.math("ADD", y, 101.2), 6.0), 3.0)
    center = s.math("LESS_THAN", s.math("ABSOLUTE", s.math("ADD", x, 0.08)), 0.065)
    edge_lines = s.math("LESS_THAN", s.math("ABSOLUTE", s.math("SUBTRACT", s.math("ABSOLUTE", x), 2.0)), 0.05)
    stripe = s.math("LESS_THAN", s.math("MODULO", s.math("ADD", x, 40.25), 1.0), 0.5)
    crossing = s.math("MULTIPLY", s.math("LESS_THAN", s.math("ABSOLUTE", s.math("SUBTRACT", y, 19.0)), 1.6), stripe)
    lines = s.math("MAXIMUM", s.math("MULTIPLY", dash, center), s.math("MULTIPLY", edge_lines, 0.8))
    lines = s.math("MAXIMUM", lines, crossing)
    painted = s.math("MULTIPLY", lines, worn)
    color = s.mix(s.math("MULTIPLY", painted, 0.85), color, (0.42, 0.42, 0.40))

    # Water: in hollows and in the gutters.
    hollows = s.noise(0.33, 5.0, 0.5, s.stretched(p, (1.0, 0.6, 1.0)))
    gutter = s.remap(s.math("ABSOLUTE", x), 3.1, 4.0, 0.0, 0.16)
    level = s.math("ADD", s.math("ADD", hollows, gutter), s.math("MULTIPLY", s.math("SUBTRACT", s.noise(9.0, 4.0), 0.5), 0.1))
    water = s.remap(level, 0.53, 0.62)
    color = s.shade(color, s.remap(water, 0.0, 1.0, 1.0, 0.6))
    film = s.remap(s.noise(1.1, 5.0), 0.3, 0.7, 0.20, 0.42)
    roughness = s.mix(water, s.combine(film, film, film), (0.015, 0.015, 0.015))
    roughness = s.axis(roughness, "X")
    grain = s.math("ADD", s.remap(s.cells(85.0), 0.0, 0.7, 1.0, 0.0), s.math("MULTIPLY", cracks, -2.0))
    dry = s.remap(water, 0.0, 0.9, 1.0, 0.02)
    normal = s.bump(grain, 0.0035, dry, s.bump(s.noise(1.6, 4.0), 0.010, dry))
    normal = s.bump(s.noise(14.0, 2.0), 0.0004, 1.0, normal)
    return s.finish(s.principled(color, roughness, normal, Specular_IOR_Level=0.5, Coat_Weight=s.remap(water, 0.0, 1.0, 0.25, 1.0), Coat_Roughness=0.05, Coat_IOR=1.33))


def paving():
    s = Shader("paving")
    p = s.position()
    plane = s.combine(s.axis(p, "Y"), s.axis(p, "X"), 0.0)
    bricks = dict(offset=0.5)
    slabs = s.node("ShaderNodeTexBrick", {
        "Vector": plane, "Color1": (0.10, 0.098, 0.093), "Color2": (0.055, 0.054, 0.052), "Mortar": (0.012, 0.011, 0.010), "Scale": 1.0,
        "Mortar Size": 0.009, "Mortar Smooth": 0.25, "Brick Width": 0.62, "Row Height": 0.42, "Bias": -0.1}, **bricks)
    color = s.shade(slabs.outputs["Color"], s.remap(s.noise(2.6, 8.0, 0.65), 0.3, 0.7, 0.6, 1.25))
    spots = s.remap(s.cells(3.1, randomness=1.0), 0.04, 0.07, 0.55, 1.0)
    color = s.shade(color, spots)
    wet = s.remap(s.noise(0.8, 6.0, 0.6), 0.46, 0.6)
    roughness = s.remap(wet, 0.0, 1.0, 0.42, 0.10)
    joints = s.math("SUBTRACT", 1.0, slabs.outputs["Fac"])
    normal = s.bump(joints, 0.006, 0.8, s.bump(s.noise(45.0, 5.0), 0.0016, 0.7, s.bump(s.noise(1.3, 2.0), 0.02)))
    return s.finish(s.principled(color, roughness, normal, Coat_Weight=s.math("MULTIPLY", wet, 0.8), Coat_Roughness=0.08, Coat_IOR=1.33))


def weather(s, color, foot=0.9):
    """Streaks that run down a wall, dirt in its corners, and its splashed foot."""
    p = s.position()
    streaks = s.noise(1.0, 6.0, 0.6, s.stretched(p, (3.2, 3.2, 0.16)))
    color = s.shade(color, s.remap(streaks, 0.35, 0.75, 1.12, 0.55))
    color = s.shade(color, s.remap(s.noise(0.7, 5.0), 0.3, 0.7, 0.8, 1.15))
    splash = s.math("ADD", s.axis(p, "Z"), s.math("MULTIPLY", s.noise(2.2, 6.0), 0.7))
    color = s.shade(color, s.remap(splash, KERB + 0.2, foot, 0.42, 1.0))
    return s.shade(color, s.remap(s.occlusion(0.35), 0.25, 0.9, 0.45, 1.0))


def brick(name, a, b, mortar=(0.16, 0.15, 0.135)):
    s = Shader(name)
    p = s.position()
    plane = s.combine(s.axis(p, "Y"), s.axis(p, "Z"), 0.0)
    wall = s.node("ShaderNodeTexBrick", {
        "Vector": plane, "Color1": a, "Color2": b, "Mortar": mortar, "Scale": 1.0, "Mortar Size": 0.0065, "Mortar Smooth": 0.2,
        "Brick Width": 0.225, "Row Height": 0.076, "Bias": -0.2})
    color = s.shade(wall.outputs["Color"], s.remap(s.noise(11.0, 7.0, 0.7), 0.3, 0.7, 0.65, 1.3))
    joints = s.math("SUBTRACT", 1.0, wall.outputs["Fac"])
    normal = s.bump(joints, 0.006, 0.9, s.bump(s.noise(60.0, 5.0), 0.003, 0.8))
    return s.finish(s.principled(weather(s, color), s.remap(s.noise(1.0), 0.3, 0.7, 0.45, 0.75), normal))


def plaster(name, color):
    s = Shader(name)
    p = s.position()
    tone = s.shade(color, s.remap(s.noise(1.8, 9.0, 0.7), 0.3, 0.7, 0.82, 1.12))
    fallen = s.remap(s.math("ADD", s.noise(0.85, 9.0, 0.68), s.remap(s.axis(p, "Z"), 0.5, 3.0, 0.10, 0.0)), 0.64, 0.655)
    tone = s.mix(fallen, tone, (0.19, 0.16, 0.13))
    edges = s.cells(0.5, "DISTANCE_TO_EDGE", s.mix(0.3, p, s.node("ShaderNodeTexNoise", {"Scale": 2.0, "Detail": 6.0}).outputs["Color"], "LINEAR_LIGHT"))
    cracks = s.math("MULTIPLY", s.remap(edges, 0.002, 0.008, 1.0, 0.0), s.remap(s.noise(0.4, 1.0), 0.5, 0.58))
    tone = s.shade(tone, s.remap(cracks, 0.0, 1.0, 1.0, 0.4))
    normal = s.bump(fallen, -0.012, 1.0, s.bump(s.noise(35.0, 7.0, 0.7), 0.004, 0.8))
    return s.finish(s.principled(weather(s, tone), 0.7, normal))


def curtain(color):
    s = Shader("curtain")
    weave = s.remap(s.noise(4.0, 4.0), 0.3, 0.7, 0.8, 1.1)
    front = s.node("ShaderNodeBsdfDiffuse", {"Color": s.shade(color, weave)}).outputs[0]
    through = s.node("ShaderNodeBsdfTranslucent", {"Color": s.shade(color, weave)}).outputs[0]
    return s.finish(s.blend(0.55, front, through))


def room(name, color, strength):
    """A lit room, seen through a window: bright above, with the shapes of furniture below."""
    s = Shader(name)
    p = s.position()
    things = s.cells(1.3, vector=s.stretched(p, (1.0, 1.6, 0.9)), output=1)
    tone = s.mix(0.45, color, things, "MULTIPLY")
    level = s.math("MULTIPLY", s.remap(s.noise(0.9, 3.0), 0.3, 0.7, 0.45, 1.3), strength)
    return s.finish(s.emission(tone, level))


# Facades

class Row:
    """Houses along one side of the street. Boxes are in (along the street, out from the wall, up)."""

    def __init__(self, wall, outward):
        self.wall, self.outward = wall, outward

    def placed(self, part):
        v, f = part
        return np.stack([self.wall + self.outward * v[:, 1], v[:, 0], v[:, 2]], axis=1), f

    def box(self, mesh, slot, low, high, chamfer=0.0):
        mesh.add(self.placed(shapes.box(low, high, chamfer)), slot)


def wall_with_openings(row, mesh, slot, u0, u1, top, openings):
    """A wall 35 cm thick as boxes around its openings."""
    us = sorted({u0, u1, *(o[0] for o in openings), *(o[1] for o in openings)})
    for a, b in zip(us, us[1:]):
        middle = (a + b) / 2
        cuts = sorted((o[2], o[3]) for o in openings if o[0] < middle < o[1])
        z = 0.0
        for low, high in [*cuts, (top, top)]:
            if low > z:
                row.box(mesh, slot, (a, -0.35, z), (b, 0.0, low))
            z = high


def window(row, mesh, slots, u0, u1, v0, v1, lit, style):
    """Frame, glass, curtains and the room behind an opening."""
    frame, pane, cloth, dark, stone = slots
    depth = -0.15
    t = 0.055
    for low, high in (((u0, v0), (u0 + t, v1)), ((u1 - t, v0), (u1, v1)), ((u0, v0), (u1, v0 + t)), ((u0, v1 - t), (u1, v1))):
        row.box(mesh, frame, (low[0], depth - 0.06, low[1]), (high[0], depth + 0.02, high[1]), 0.008)
    middle = (u0 + u1) / 2
    transom = v0 + (v1 - v0) * (0.68 if style == "casement" else 0.5)
    row.box(mesh, frame, (u0, depth - 0.05, transom - 0.03), (u1, depth + 0.03, transom + 0.03), 0.008)
    row.box(mesh, frame, (middle - 0.025, depth - 0.05, v0), (middle + 0.025, depth + 0.015, v1 if style != "casement" else transom), 0.006)
    tilt = rng.normal(0, 0.006)
    p, f = shapes.grid(np.array([u0, middle, u1]), np.array([v0, transom, v1]))
    p = np.stack([p[:, 0], depth - 0.02 + tilt * (p[:, 0] - middle), p[:, 1]], axis=1)
    mesh.add(row.placed((p, f)), pane)
    back = -1.3
    room_slot = dark if lit is None else lit
    for low, high in (((u0 - 0.7, back - 0.02, v0 - 0.8), (u1 + 0.7, back, v1 + 0.3)), ((u0 - 0.7, back, v0 - 0.8), (u0 - 0.68, -0.36, v1 + 0.3)), ((u1 + 0.68, back, v0 - 0.8), (u1 + 0.7, -0.36, v1 + 0.3)), ((u0 - 0.7, back, v1 + 0.3), (u1 + 0.7, -0.36, v1 + 0.32))):
        row.box(mesh, room_slot, low, high)
    drawn = rng.uniform(0.18, 0.5)
    for a, b in ((u0 - 0.05, u0 + drawn * (u1 - u0)), (u1 - rng.uniform(0.15, 0.5) * (u1 - u0), u1 + 0.05)):
        us = np.linspace(a, b, 40)
        v, f = shapes.grid(us, np.linspace(v0 - 0.1, v1, 5))
        folds = 0.035 * np.sin(v[:, 0] * rng.uniform(38, 55)) + 0.02 * np.sin(v[:, 0] * 17 + 1)
        mesh.add(row.placed((np.stack([v[:, 0], -0.33 + folds, v[:, 1]], axis=1), f)), cloth)
    row.box(mesh, stone, (u0 - 0.08, -0.16, v0 - 0.09), (u1 + 0.08, 0.09, v0), 0.012)
    return middle


def house(row, u0, u1, floors, ground, storey, columns, wall_material, trim_material, rooms, shared, lit_share, shop=None, door=True):
    """One house: openings, windows, trim, cornice, pipes, roof. `shop` is the light of a shop on its ground floor."""
    frame, pane, cloth, dark, slate, metal, door_paint = shared
    mesh = Mesh(wall_material, trim_material, frame, pane, cloth, dark, slate, metal, door_paint, *rooms)
    rooms_at = 9
    top = ground + floors * storey + 0.55
    width = u1 - u0
    openings, panes = [], []
    wide = min(1.15, width / columns * 0.5)
    centers = u0 + width * (np.arange(columns) + 0.5) / columns
    for k in range(floors):
        v0 = ground + k * storey + 0.75
        for c in centers:
            openings.append((c - wide / 2, c + wide / 2, v0, v0 + storey * (0.62 if k < floors - 1 else 0.52)))
    panes += openings
    entrance = None
    if shop is not None:
        shop_opening = (u0 + 0.5, u1 - 1.9, 0.65, ground - 0.55)
        openings = [*openings, shop_opening]
        entrance = (u1 - 1.5, u1 - 0.45, KERB, 2.35)
    else:
        doors = columns // 2 if door else -1
        for i, c in enumerate(centers):
            if i == doors:
                entrance = (c - 0.55, c + 0.55, KERB, 2.75)
            else:
                openings = [*openings, (c - wide / 2, c + wide / 2, 1.15, ground - 0.65)]
                panes = [*panes, openings[-1]]
    if entrance is not None:
        openings = [*openings, entrance]
    wall_with_openings(row, mesh, 0, u0, u1, top, openings)

    for o in panes:
        lit = rooms_at + int(rng.integers(len(rooms))) if rng.uniform() < lit_share else None
        window(row, mesh, (2, 3, 4, 5, 1), *o, lit, "casement" if columns < 4 else "sash")
        a, b, v0, v1 = o
        row.box(mesh, 1, (a - 0.13, -0.02, v0), (a, 0.035, v1 + 0.13), 0.01)
        row.box(mesh, 1, (b, -0.02, v0), (b + 0.13, 0.035, v1 + 0.13), 0.01)
        row.box(mesh, 1, (a - 0.16, -0.02, v1), (b + 0.16, 0.05, v1 + 0.16), 0.012)
        if columns < 4:
            row.box(mesh, 1, (a - 0.24, -0.02, v1 + 0.16), (b + 0.24, 0.13, v1 + 0.22), 0.02)

    if entrance is not None:
        a, b, v0, v1 = entrance
        row.box(mesh, 8, (a, -0.32, v0), (b, -0.26, v1 - 0.45), 0.006)
        for i in range(2):
            for j, (low, high) in enumerate(((0.2, 0.85), (1.0, 1.75))):
                left = a + 0.1 + i * (b - a) / 2
                row.box(mesh, 8, (left, -0.27, v0 + low), (left + (b - a) / 2 - 0.2, -0.245, v0 + high), 0.012)
        row.box(mesh, rooms_at, (a, -0.5, v1 - 0.42), (b, -0.48, v1))
        row.box(mesh, 8, (a, -0.30, v1 - 0.47), (b, -0.22, v1 - 0.40), 0.01)
        row.box(mesh, 1, (a - 0.16, -0.02, v0), (a, 0.06, v1 + 0.16), 0.015)
        row.box(mesh, 1, (b, -0.02, v0), (b + 0.16, 0.06, v1 + 0.16), 0.015)
        row.box(mesh, 1, (a - 0.22, -0.02, v1), (b + 0.22, 0.12, v1 + 0.2), 0.02)
        row.box(mesh, 1, (a - 0.1, -0.3, 0.0), (b + 0.1, 0.32, KERB + 0.13), 0.015)

    # Foot, string course, cornice, gutter, pipe, roof.
    row.box(mesh, 1, (u0 + 0.003, -0.1, 0.0), (entrance[0] - 0.16 if entrance else u1, 0.045, 0.58), 0.012)
    if entrance:
        row.box(mesh, 1, (entrance[1] + 0.16, -0.1, 0.0), (u1 - 0.003, 0.045, 0.58), 0.012)
    row.box(mesh, 1, (u0, -0.02, ground - 0.1), (u1, 0.10, ground + 0.14), 0.02)
    for out, low, high in ((0.10, -0.32, -0.18), (0.2, -0.18, -0.06), (0.34, -0.06, 0.06)):
        row.box(mesh, 1, (u0, -0.05, top + low), (u1, out, top + high), 0.02)
    for u in np.arange(u0 + 0.3, u1, 0.55):
        row.box(mesh, 1, (u, 0.0, top - 0.30), (u + 0.14, 0.19, top - 0.16), 0.01)
    gutter = np.array([[u0, 0.40, top + 0.03], [(u0 + u1) / 2, 0.40, top + 0.015], [u1, 0.40, top + 0.0]])
    mesh.add(row.placed(shapes.tube(gutter, 0.07, 10)), 7)
    pipe = np.array([[u1 - 0.12, 0.38, top], [u1 - 0.12, 0.30, top - 0.3], [u1 - 0.12, 0.09, top - 0.55], [u1 - 0.12, 0.09, 2.4], [u1 - 0.12, 0.09, KERB]])
    mesh.add(row.placed(shapes.tube(pipe, 0.05, 10)), 7)
    for z in np.arange(1.0, top - 1, 1.8):
        mesh.add(row.placed(shapes.tube(np.array([[u1 - 0.12, 0.09, z], [u1 - 0.12, 0.09, z + 0.05]]), 0.062, 10)), 7)
    slope = np.array([[u0, 0.3, top + 0.06], [u1, 0.3, top + 0.06], [u1, -3.2, top + 2.9], [u0, -3.2, top + 2.9]])
    mesh.add(row.placed((slope, np.array([[0, 1, 2, 3]]))), 6)
    for k in range(int(rng.integers(1, 3))):
        u = rng.uniform(u0 + 0.5, u1 - 1.5)
        row.box(mesh, 0, (u, -2.6, top + 1), (u + 1.1, -1.9, top + 3.7), 0.02)
        for j in range(3):
            pot = np.array([[u + 0.25 + 0.3 * j, -2.25, top + 3.7], [u + 0.25 + 0.3 * j, -2.25, top + 4.1]])
            mesh.add(row.placed(shapes.tube(pot, (0.11, 0.09), 10)), 0)
    mesh.build("house")
    return top


def shop_front(row, u0, u1, ground, frame, pane, sign_paint, warm):
    """The window of a shop: mullions, a board above, shelves inside, and its light."""
    mesh = Mesh(frame, pane, sign_paint, warm, plain("shop wall", (0.5, 0.4, 0.28), 0.8), *[plain(f"goods{i}", c, 0.6) for i, c in enumerate(((0.5, 0.08, 0.05), (0.08, 0.2, 0.35), (0.5, 0.35, 0.1), (0.1, 0.3, 0.15), (0.55, 0.5, 0.42)))])
    a, b, low, high = u0 + 0.5, u1 - 1.9, 0.65, ground - 0.55
    row.box(mesh, 0, (a - 0.12, -0.1, low - 0.12), (b + 0.12, 0.10, low + 0.02), 0.012)
    for u in np.linspace(a, b, 4):
        row.box(mesh, 0, (u - 0.04, -0.14, low), (u + 0.04, 0.02, high), 0.01)
    row.box(mesh, 0, (a, -0.14, high - 0.55), (b, 0.0, high - 0.49), 0.008)
    p, f = shapes.grid(np.array([a, b]), np.array([low, high]))
    mesh.add(row.placed((np.stack([p[:, 0], np.full(len(p), -0.1), p[:, 1]], axis=1), f)), 1)
    row.box(mesh, 2, (u0 + 0.2, 0.0, high + 0.06), (u1 - 0.2, 0.14, high + 0.60), 0.02)
    row.box(mesh, 4, (u0, -3.0, 0.3), (u1, -2.95, ground))
    row.box(mesh, 4, (u0 + 0.1, -3.0, 0.3), (u0 + 0.15, -0.36, ground))
    row.box(mesh, 4, (u1 - 0.4, -3.0, 0.3), (u1 - 0.35, -0.36, ground))
    row.box(mesh, 4, (u0, -3.0, 0.3), (u1, -0.36, 0.34))
    row.box(mesh, 3, (a + 0.3, -2.3, ground - 0.25), (b - 0.3, -1.9, ground - 0.22))
    row.box(mesh, 3, (a + 0.3, -1.0, ground - 0.25), (b - 0.3, -0.8, ground - 0.22))
    for shelf in (0.72, 1.15, 1.6, 2.05):
        front = -0.55 if shelf < 1.0 else -2.7
        row.box(mesh, 0, (a, front - 0.35, shelf - 0.03), (b, front, shelf))
        for w in np.arange(-2.7, -0.75, 0.1):
            wide, tall = rng.uniform(0.03, 0.09), rng.uniform(0.16, 0.34)
            row.box(mesh, 5 + int(rng.integers(5)), (u1 - 0.62, w, shelf), (u1 - 0.42, w + wide, shelf + tall), 0.004)
        row.box(mesh, 0, (u1 - 0.66, -2.8, shelf - 0.03), (u1 - 0.4, -0.7, shelf))
        u = a + 0.1
        while u < b - 0.3:
            w, h = rng.uniform(0.05, 0.3), rng.uniform(0.1, 0.36)
            row.box(mesh, 5 + int(rng.integers(5)), (u, front - 0.3, shelf), (u + w, front - rng.uniform(0.02, 0.2), shelf + h), 0.006)
            u += w + rng.uniform(0.005, 0.12)
    mesh.build("shop")
    return a, b, low, high


def writing(body, at, size, turn, material, extrude=0.01):
    font = bpy.data.curves.new(body, "FONT")
    font.body, font.size, font.extrude = body, size, extrude
    font.align_x = font.align_y = "CENTER"
    font.space_character = 1.15
    font.materials.append(material)
    item = bpy.data.objects.new(body, font)
    item.location, item.rotation_euler = at, (np.pi / 2, 0, turn)
    bpy.context.scene.collection.objects.link(item)


# Street furniture

def lamp_post(mesh, x, y, toward, lens_slot):
    """A post with an arm toward the road (-1 or 1 in x) and a flat housing. Slots: 0 paint, 1 glass or light."""
    mesh.add(shapes.moved(shapes.lathe([(0.0, 0.0), (0.12, 0.0), (0.12, 0.04), (0.085, 0.06), (0.085, 1.1), (0.065, 1.16), (0.058, 2.5), (0.045, 4.9)], 20), (x, y, KERB)), 0)
    t = np.linspace(0, 1, 12)
    arm = np.stack([x + toward * 0.62 * t, np.full(12, y), KERB + 4.85 + 0.33 * np.sin(t * np.pi / 2)], axis=1)
    mesh.add(shapes.tube(arm, 0.032, 10), 0)
    middle = np.array([x + toward * 0.88, y, KERB + 5.18])
    v, f = shapes.sphere(20)
    cube = v / np.abs(v).max(axis=1, keepdims=True)
    v = (0.55 * v + 0.45 * cube) * np.array([0.36, 0.13, 0.075])
    v[:, 2] = np.where(v[:, 2] < -0.02, -0.02, v[:, 2])
    mesh.add((v + middle, f), 0)
    flat = shapes.box(middle + np.array([-0.24, -0.085, -0.034]), middle + np.array([0.24, 0.085, -0.021]), 0.004)
    mesh.add(flat, lens_slot)
    mesh.add(shapes.box((x - 0.06, y - 0.09, KERB + 0.55), (x + 0.06, y - 0.07, KERB + 0.95), 0.004), 0)
    return middle


def build(args):
    scene = plate.empty_scene()
    view = plate.camera(POSITION, TARGET, FOV_DEG)
    plate.gradient_sky(
        [(0.0, (0.20, 0.13, 0.075)), (0.12, (0.10, 0.078, 0.062)), (0.45, (0.034, 0.038, 0.052)), (1.0, (0.020, 0.027, 0.045))], 0.85,
        0.55, (0.075, 0.062, 0.055))

    # Ground.
    Mesh(asphalt()).add(shapes.grid(np.array(ROAD), np.array([-30.0, 140.0]))).build("road")
    pave = Mesh(paving())
    for a, b in ((LEFT - 0.5, ROAD[0] - 0.16), (ROAD[1] + 0.16, RIGHT + 0.5)):
        pave.add(shapes.grid(np.array([a, b]), np.array([-30.0, 140.0]), KERB))
    pave.build("pavement")
    kerb = Mesh(plain("kerb", (0.11, 0.108, 0.10), 0.38, Coat_Weight=0.3, Coat_Roughness=0.15))
    for side in (0, 1):
        y = -10.0
        while y < 110:
            length = rng.uniform(0.85, 1.05)
            a, b = (ROAD[0] - 0.16, ROAD[0]) if side == 0 else (ROAD[1], ROAD[1] + 0.16)
            lift = KERB + rng.normal(0, 0.003)
            kerb.add(shapes.box((a, y + 0.006, -0.1), (b + rng.normal(0, 0.002), y + length - 0.006, lift), 0.02))
            y += length
    kerb.build("kerb")

    # Houses.
    frame_white = plain("window frame", (0.38, 0.37, 0.34), 0.5)
    frame_dark = plain("shop frame", (0.02, 0.05, 0.035), 0.35)
    s = Shader("window pane")
    pane = s.finish(s.pane(normal=s.bump(s.noise(2.0, 2.0), 0.004)))
    s = Shader("slate")
    slate_rows = s.node("ShaderNodeTexBrick", {"Vector": s.combine(s.axis(s.position(), "Y"), s.axis(s.position(), "Z"), 0.0), "Color1": (0.03, 0.032, 0.036), "Color2": (0.05, 0.05, 0.055), "Mortar": (0.008, 0.008, 0.009), "Scale": 1.0, "Brick Width": 0.3, "Row Height": 0.16, "Mortar Size": 0.008})
    slate = s.finish(s.principled(slate_rows.outputs["Color"], 0.35, s.bump(slate_rows.outputs["Fac"], -0.01)))
    shared_for = lambda door_color: (frame_white, pane, curtain((0.55, 0.50, 0.42)), plain("dark room", (0.02, 0.018, 0.016), 0.9), slate, plain("zinc", (0.16, 0.165, 0.17), 0.35, Metallic=0.6), plain("door", door_color, 0.3, Coat_Weight=0.5))
    warm = [room("room warm", (1.0, 0.56, 0.22), 1.9), room("room yellow", (1.0, 0.70, 0.36), 1.5), room("room cool", (0.80, 0.88, 1.0), 0.8), room("room dim", (1.0, 0.45, 0.16), 0.7)]
    red = brick("red brick", (0.21, 0.065, 0.042), (0.12, 0.038, 0.030))
    brown = brick("brown brick", (0.16, 0.085, 0.050), (0.10, 0.055, 0.038))
    yellow = brick("yellow brick", (0.30, 0.21, 0.115), (0.21, 0.14, 0.080))
    ochre, gray, cream, green = (plaster(n, c) for n, c in (("ochre", (0.42, 0.27, 0.12)), ("gray", (0.26, 0.26, 0.26)), ("cream", (0.46, 0.40, 0.30)), ("green", (0.20, 0.26, 0.20))))
    sandstone = plain("sandstone", (0.30, 0.25, 0.18), 0.7)
    limestone = plain("limestone", (0.36, 0.34, 0.30), 0.65)
    dark_stone = plain("dark stone", (0.09, 0.085, 0.08), 0.6)
    left, right = Row(LEFT, 1), Row(RIGHT, -1)
    doors = ((0.10, 0.02, 0.015), (0.015, 0.05, 0.03), (0.02, 0.03, 0.07), (0.06, 0.035, 0.02))
    plan = (
        (left, -6.0, 3.5, 3, 3.6, 3.1, 3, ochre, limestone, 0.2, None),
        (left, 3.5, 12.2, 3, 3.9, 3.2, 4, red, sandstone, 0.30, "shop"),
        (left, 12.2, 19.4, 3, 3.5, 3.0, 3, cream, limestone, 0.25, None),
        (left, 19.4, 29.0, 4, 3.8, 3.2, 4, brown, sandstone, 0.35, None),
        (left, 29.0, 37.0, 3, 3.6, 3.0, 3, gray, dark_stone, 0.30, None),
        (left, 37.0, 50.0, 4, 3.8, 3.2, 5, red, limestone, 0.3, None),
        (left, 50.0, 66.0, 4, 3.8, 3.1, 6, ochre, limestone, 0.3, None),
        (right, -6.0, 4.0, 3, 3.6, 3.1, 3, brown, sandstone, 0.2, None),
        (right, 4.0, 13.6, 3, 3.7, 3.1, 4, yellow, limestone, 0.22, None),
        (right, 13.6, 21.6, 4, 3.7, 3.1, 3, green, limestone, 0.40, None),
        (right, 21.6, 31.4, 3, 3.9, 3.2, 4, red, sandstone, 0.25, None),
        (right, 31.4, 40.0, 4, 3.6, 3.1, 3, cream, limestone, 0.35, None),
        (right, 40.0, 54.0, 3, 3.8, 3.2, 5, brown, sandstone, 0.30, None),
        (right, 54.0, 68.0, 4, 3.8, 3.1, 5, gray, limestone, 0.30, None),
    )
    for i, (row, u0, u1, floors, ground, storey, columns, wall, trim, lit, shop) in enumerate(plan):
        house(row, u0, u1, floors, ground, storey, columns, wall, trim, warm, shared_for(doors[i % 4]), lit, shop)
    closing = Row(0, 1)
    closing.placed = lambda part: (np.stack([part[0][:, 0] - 14, 84.0 - part[0][:, 1], part[0][:, 2]], axis=1), part[1])
    house(closing, 0.0, 28.0, 4, 3.8, 3.1, 8, yellow, limestone, warm, shared_for(doors[0]), 0.4)

    # The shop: the light that falls on the pavement.
    sign = plain("sign board", (0.015, 0.06, 0.045), 0.3, Coat_Weight=0.6)
    a, b, low, high = shop_front(left, 3.5, 12.2, 3.9, frame_dark, pane, sign, glow("shop lamps", (1.0, 0.78, 0.50), 14.0))
    gold = plain("gilt", (0.75, 0.52, 0.18), 0.3, Metallic=1.0)
    writing("LINDEN ANTIQUARIAT", (LEFT + 0.15, (3.5 + 12.2) / 2, high + 0.33), 0.36, np.pi / 2, gold)
    writing("OPEN", (LEFT - 0.02, b - 0.75, 2.0), 0.24, np.pi / 2, glow("neon", (1.0, 0.07, 0.10), 9.0), 0.006)
    cross = Mesh(glow("cross", (0.05, 1.0, 0.30), 5.0), plain("cross box", (0.03, 0.03, 0.03), 0.4))
    for w, h in ((0.30, 0.1), (0.1, 0.30)):
        cross.add(shapes.box((RIGHT - 0.55 - w, 24.6, 3.75 - h), (RIGHT - 0.55 + w, 24.72, 3.75 + h), 0.01))
    cross.add(shapes.box((RIGHT - 0.25, 24.64, 3.7), (RIGHT, 24.68, 3.8)), 1)
    cross.build("pharmacy")

    # Lamps: the nearest is off.
    post_paint = plain("post paint", (0.035, 0.042, 0.04), 0.4, Coat_Weight=0.4)
    off = plain("lamp glass", (0.30, 0.30, 0.28), 0.2)
    light = glow("lamp light", (1.0, 0.72, 0.40), 60.0)
    near = Mesh(post_paint, off)
    middle = lamp_post(near, 4.45, 7.5, -1, 1)
    near.build("near lamp", smooth=True).data.set_sharp_from_angle(angle=0.6)
    assert np.allclose(plate.bansho(middle + np.array([0, 0, -0.13])), LAMP, atol=0.02), plate.bansho(middle)
    far = Mesh(post_paint, light)
    for x, y, toward in ((-4.45, 30.0, 1), (4.45, 47.0, -1), (-4.45, 62.0, 1)):
        at = lamp_post(far, x, y, toward, 1)
        plate.point_light((at[0], at[1], at[2] - 0.12), (1.0, 0.70, 0.38), 260.0, 0.1)
    far.build("far lamps", smooth=True).data.set_sharp_from_angle(angle=0.6)
    if args.lamps:
        plate.point_light(plate.blender(LAMP), (1.0, 0.78, 0.50), 420.0, 0.05)

    # Cars.
    common = cars.shared_materials(0.0)
    braking = cars.shared_materials(16.0)
    cars.car("silver estate", cars.ESTATE, cars.paint("silver", (0.32, 0.33, 0.35), 0.8), common, (3.02, 11.2, 0), np.pi / 2 + 0.012, plate_text="HH LT 208")
    cars.car("blue hatchback", cars.HATCHBACK, cars.paint("blue", (0.012, 0.035, 0.11)), common, (3.06, 16.8, 0), np.pi / 2 - 0.02)
    cars.car("red sedan", cars.SEDAN, cars.paint("red", (0.18, 0.012, 0.010)), common, (3.0, 22.4, 0), np.pi / 2 + 0.01)
    cars.car("gray sedan", cars.SEDAN, cars.paint("gray", (0.06, 0.065, 0.07), 0.7), common, (-3.05, 9.8, 0), -np.pi / 2 + 0.015)
    cars.car("white hatchback", cars.HATCHBACK, cars.paint("white", (0.5, 0.5, 0.48), 0.0), common, (-3.02, 15.2, 0), -np.pi / 2 - 0.015)
    cars.car("black estate", cars.ESTATE, cars.paint("black", (0.01, 0.01, 0.011)), common, (-3.0, 23.6, 0), -np.pi / 2)
    cars.car("green hatchback", cars.HATCHBACK, cars.paint("dark green", (0.015, 0.06, 0.03)), common, (3.0, 29.5, 0), np.pi / 2)
    cars.car("far sedan", cars.SEDAN, cars.paint("dark", (0.03, 0.03, 0.035)), braking, (1.1, 42.0, 0), np.pi / 2)

    # Trees on the left pavement.
    street_bark = plants.bark("street bark", (0.018, 0.016, 0.014), (0.075, 0.066, 0.055), mossy=0.3, wet=0.45)
    lime = plants.foliage("lime leaves", (0.055, 0.10, 0.020), (0.11, 0.095, 0.022), 0.3, 0.45)
    tree = plants.broadleaf(np.random.default_rng(11), "lime", 8.4, street_bark, lime, 0.085, 1.05, bare=0.36, radius=0.16)
    other = plants.broadleaf(np.random.default_rng(12), "lime 2", 7.6, street_bark, lime, 0.085, 1.0, bare=0.36, radius=0.15)
    points = np.array([[-4.95, 13.0, KERB], [4.95, 21.0, KERB], [-4.95, 36.0, KERB], [4.95, 34.0, KERB], [-4.95, 52.0, KERB]])
    plants_turns = np.array([0.5, 2.2, 4.0, 1.0, 5.5])
    shapes.scatter("trees", [tree, other], points, plants_turns, np.array([1.0, 1.0, 1.05, 1.0, 1.1]))
    fallen = plants.litter(np.random.default_rng(5), "fallen", plants.foliage("fallen leaves", (0.16, 0.09, 0.02), (0.09, 0.045, 0.015), 0.25, 0.1), 5, 0.075, 7, 0.22)
    n = 520
    where = np.stack([np.where(rng.uniform(size=n) < 0.7, rng.normal(-4.2, 0.7, n), rng.normal(4.0, 0.7, n)), rng.uniform(-2, 40, n), np.zeros(n)], axis=1)
    where[:, 2] = np.where((where[:, 0] < ROAD[0]) | (where[:, 0] > ROAD[1]), KERB, 0.0) + 0.001
    shapes.scatter("fallen leaves", fallen, where, rng.uniform(0, 6.3, n), rng.uniform(0.7, 1.2, n))

    # Signs, bollards, a bin, a drain, a manhole, wires.
    metal = plain("galvanized", (0.22, 0.225, 0.23), 0.35, Metallic=0.8)
    things = Mesh(metal, plain("sign face", (0.04, 0.09, 0.32), 0.25), plain("sign rim", (0.40, 0.02, 0.02), 0.25), plain("iron", (0.02, 0.02, 0.021), 0.5, Metallic=0.5), plain("bin", (0.02, 0.045, 0.03), 0.45))
    for x, y in ((-4.5, 6.2), (4.5, 14.0)):
        things.add(shapes.tube([[x, y, KERB], [x + 0.01, y, 2.75]], 0.03, 12), 0)
        disc = shapes.rotated(shapes.lathe([(0.0, 0.012), (0.24, 0.012)], 40), (1, 0, 0), np.pi / 2)
        things.add(shapes.moved(disc, (x, y - 0.035, 2.45)), 1)
        rim = shapes.rotated(shapes.lathe([(0.23, 0.016), (0.30, 0.016), (0.30, 0.0), (0.0, 0.0)], 40), (1, 0, 0), np.pi / 2)
        things.add(shapes.moved(rim, (x, y - 0.035, 2.45)), 2)
        bar = shapes.rotated(shapes.box((-0.24, -0.012, -0.035), (0.24, 0.0, 0.035)), (0, 1, 0), np.pi / 4)
        things.add(shapes.moved(bar, (x, y - 0.05, 2.45)), 2)
    for y in (16.6, 18.0, 20.2, 21.6):
        post = shapes.lathe([(0.055, 0.0), (0.055, 0.82), (0.07, 0.83), (0.07, 0.87), (0.05, 0.92), (0.0, 0.95)], 16)
        things.add(shapes.moved(post, (-4.42 + rng.normal(0, 0.01), y, KERB)), 3)
    can = shapes.lathe([(0.0, 0.02), (0.20, 0.02), (0.23, 0.85), (0.25, 0.87), (0.25, 0.93), (0.17, 1.02), (0.0, 1.05)], 24)
    things.add(shapes.moved(can, (4.95, 3.4, KERB)), 4)
    for k in range(9):
        things.add(shapes.box((3.72, 5.0 + 0.05 * k, -0.02), (4.06, 5.025 + 0.05 * k, 0.006), 0.003), 3)
    cover = shapes.lathe([(0.0, 0.004), (0.26, 0.004), (0.27, 0.0), (0.285, 0.0), (0.29, 0.006), (0.33, 0.006), (0.335, 0.0)], 48)
    things.add(shapes.moved(cover, (-0.75, 6.0, 0.0)), 3)
    for k in range(6):
        r = shapes.box((-0.2, -0.2 + 0.07 * k, 0.003), (0.2, -0.17 + 0.07 * k, 0.008), 0.002)
        things.add(shapes.moved(r, (-0.75, 6.0, 0.0)), 3)
    things.build("things", smooth=True).data.set_sharp_from_angle(angle=0.6)
    wires = Mesh(plain("wire", (0.01, 0.01, 0.01), 0.6))
    for (x0, y0, z0), (x1, y1, z1), sag in (((LEFT, 14, 8.6), (RIGHT, 16, 9.2), 0.5), ((LEFT, 25, 8.8), (RIGHT, 24, 8.4), 0.4), ((LEFT, 12, 9.5), (RIGHT, 27, 9.0), 0.8), ((LEFT, 40, 9), (RIGHT, 39, 9), 0.5)):
        t = np.linspace(0, 1, 30)[:, None]
        line = np.array([[x0, y0, z0]]) * (1 - t) + np.array([[x1, y1, z1]]) * t
        line[:, 2:] -= sag * 4 * t * (1 - t)
        wires.add(shapes.tube(line, 0.011, 5))
    wires.build("wires")
    return view


if __name__ == "__main__":
    arguments = plate.options("street")
    seen = build(arguments)
    # Standing water and panes are black too, and would be taken for metals.
    plate.make("street", arguments, 2.4, seen, air=(140.0, (0.020, 0.016, 0.013)), halo=0.10, metals=False)
