"""Parked cars: stacked rounded rectangles, with panes, lamps, wheels and seams where they lie on the rings."""

import bpy
import numpy as np

import shapes
from shaders import Shader, plain
from shapes import TAU, Mesh

SEDAN = dict(
    length=4.5, width=1.80, sill=0.24, hood=0.80, belt=0.96, trunk=1.06, roof=1.44,
    glass_foot=(-1.72, 1.08), glass_top=(-0.98, 0.15), pillar=0.12,
)
HATCHBACK = dict(
    length=4.0, width=1.74, sill=0.24, hood=0.86, belt=0.98, trunk=1.02, roof=1.50,
    glass_foot=(-1.92, 1.08), glass_top=(-1.52, 0.28), pillar=-0.05,
)
ESTATE = dict(
    length=4.65, width=1.84, sill=0.27, hood=0.92, belt=1.04, trunk=1.06, roof=1.62,
    glass_foot=(-2.22, 1.10), glass_top=(-1.88, 0.30), pillar=-0.10,
)


def paint(name, color, metallic=0.35):
    s = Shader(name)
    beads = s.remap(s.cells(95.0), 0.0, 0.32, 1.0, 0.0)
    dirt = s.remap(s.noise(2.2, 7.0, 0.65), 0.42, 0.72, 0.0, 0.35)
    low = s.remap(s.axis(s.position(), "Z"), 0.2, 0.65, 0.55, 0.0)
    dirt = s.math("MAXIMUM", dirt, low)
    color = s.mix(dirt, color, (0.05, 0.045, 0.04))
    roughness = s.remap(dirt, 0.0, 0.6, 0.28, 0.6)
    normal = s.bump(beads, 0.0016, 0.6)
    return s.finish(s.principled(color, roughness, normal, Metallic=metallic, Coat_Weight=1.0, Coat_Roughness=0.06))


def glass():
    """Dark panes: what is inside is not seen."""
    s = Shader("car glass")
    beads = s.remap(s.cells(85.0), 0.0, 0.3, 1.0, 0.0)
    return s.finish(s.principled((0.006, 0.008, 0.009), 0.04, s.bump(beads, 0.0012, 0.5), Specular_IOR_Level=0.8))


def lens(name, color, strength):
    s = Shader(name)
    ribs = s.noise(60.0, 1.0)
    return s.finish(s.principled(color, 0.12, s.bump(ribs, 0.002), Emission_Color=color, Emission_Strength=strength, Coat_Weight=1.0))


def smoothstep(x, low, high):
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def ring(theta, half_length, half_width, power):
    c, s = np.cos(theta), np.sin(theta)
    return half_length * np.sign(c) * np.abs(c) ** (2 / power), half_width * np.sign(s) * np.abs(s) ** (2 / power)


def deck(shape, x):
    """Height of the bonnet, the shoulder and the boot."""
    half = shape["length"] / 2
    front, rear = shape["glass_foot"][1], shape["glass_foot"][0]
    height = shape["belt"] + np.zeros_like(x)
    nose = smoothstep(x, front - 0.2, half)
    height -= (shape["belt"] - shape["hood"]) * nose**0.8 + 0.10 * smoothstep(x, half - 0.35, half)
    tail = smoothstep(-x, -rear - 0.6, -rear + 0.1)
    return height + (shape["trunk"] - shape["belt"]) * tail - 0.05 * smoothstep(-x, half - 0.25, half)


def car(name, shape, body, materials, at, heading, lit=0.0, plate_text="B KR 417"):
    """`at` is the ground below the middle; `heading` turns its front from +x (radians)."""
    black, pane, red, white, chrome, tire = materials
    mesh = Mesh(body, black, pane, red, white, chrome, tire)
    columns = 288
    theta = (np.arange(columns) + 0.5) / columns * TAU
    half, wide = shape["length"] / 2, shape["width"] / 2

    # The body, from the sill to the shoulder, then over the bonnet and the boot to the middle.
    levels = np.linspace(0, 1, 26)
    rings, paint_slots = [], []
    for t in levels:
        length = half * (0.965 + 0.035 * np.sin(np.pi * min(t * 1.25, 1.0)) - 0.02 * t)
        width = wide * (0.94 + 0.06 * np.sin(np.pi * np.clip(0.12 + 0.8 * t, 0, 1)))
        x, y = ring(theta, length, width, 5.2)
        y = y * (1 - 0.10 * smoothstep(np.abs(x), half - 1.1, half))
        z = shape["sill"] + t * (deck(shape, x) - shape["sill"])
        crease = 0.012 * np.exp(-((t - 0.72) / 0.05) ** 2)
        rings.append(np.stack([x, y * (1 + crease), z], axis=1))
    shoulder = rings[-1]
    for inset, lift in ((0.985, 0.012), (0.955, 0.024), (0.9, 0.034), (0.7, 0.055), (0.4, 0.07), (0.1, 0.075)):
        p = shoulder * np.array([1 - 0.25 * (1 - inset), inset, 1.0])
        p[:, 2] = deck(shape, p[:, 0]) + lift
        rings.append(p)
    body_grid = np.array(rings)
    faces = shapes.strip_faces(len(rings), columns, closed=True)
    row = np.repeat(np.arange(len(rings) - 1), columns)
    column = np.tile(np.arange(columns), len(rings) - 1)
    x = body_grid[row, column, 0]
    y = np.abs(body_grid[row, column, 1])
    slot = np.zeros(len(faces), int)
    slot[row < 4] = 1
    end = half - 0.42
    lamp_row = (row >= 14) & (row <= 21) & (y > wide * 0.52)
    slot[lamp_row & (x < -end)] = 3
    slot[lamp_row & (x > end) & (row <= 20)] = 4
    slot[(x > end) & (y < wide * 0.45) & (row >= 9) & (row <= 17)] = 1
    vertices = body_grid.reshape(-1, 3)
    for k in range(5):
        if np.any(slot == k):
            mesh.add((vertices, faces[slot == k]), k)

    # The greenhouse.
    foot, top = shape["glass_foot"], shape["glass_top"]
    heights = np.concatenate([np.linspace(0, 0.86, 15), [0.9, 0.935, 0.965, 0.985, 0.996, 1.0]])
    shrink = np.interp(heights, [0, 0.86, 0.9, 0.935, 0.965, 0.985, 0.996, 1.0], [1, 1, 0.985, 0.955, 0.88, 0.7, 0.35, 0.03])
    rings = []
    for t, k in zip(heights, shrink):
        s = min(t / 0.9, 1.0)
        rear = foot[0] + (top[0] - foot[0]) * s**1.1
        front = foot[1] + (top[1] - foot[1]) * s**1.15
        middle, reach = (rear + front) / 2, (front - rear) / 2
        px, py = ring(theta, reach * (0.3 + 0.7 * k), wide * (0.90 - 0.20 * s) * k, 4.6)
        base = shape["belt"] - 0.02
        rings.append(np.stack([px + middle, py, np.full(columns, base + t * (shape["roof"] - base))], axis=1))
    house = np.array(rings)
    faces = shapes.strip_faces(len(rings), columns, closed=True)
    row = np.repeat(np.arange(len(rings) - 1), columns)
    column = np.tile(np.arange(columns), len(rings) - 1)
    angle = theta[column]
    corner = np.abs(np.mod(angle, np.pi / 2) - np.pi / 4)
    is_side = np.abs(np.sin(angle)) ** 0.45 > np.abs(np.cos(angle)) ** 0.45
    px = house[row, column, 0]
    clear = (row >= 2) & (row <= 13) & ~((corner < 0.085) & True)
    clear &= ~(is_side & (np.abs(px - shape["pillar"]) < 0.06))
    slot = np.where(clear, 2, 0)
    slot[(row == 14) & is_side] = 5 if shape is SEDAN else 1
    slot[row <= 1] = np.where(is_side[row <= 1], 1, 0)
    vertices = house.reshape(-1, 3)
    for k in (0, 1, 2, 5):
        if np.any(slot == k):
            mesh.add((vertices, faces[slot == k]), k)

    # Seams of doors and the tailgate: lines of the rings' columns and rows.
    def seam(points, radius=0.004):
        mesh.add(shapes.tube(points, radius, 5, capped=False), 1)

    for side in (1, -1):
        upper = body_grid[4:26]
        for door in (shape["glass_foot"][1] - 0.05, shape["pillar"], shape["pillar"] - 1.02):
            distance = np.abs(upper[12, :, 0] - door) + 10 * (np.sign(upper[12, :, 1]) != side)
            seam(upper[:, np.argmin(distance)] * np.array([1, 1.0006, 1]))
        handle_z = shape["belt"] - 0.14
        for door in (shape["pillar"] - 0.85, shape["pillar"] + 0.12):
            mesh.add(shapes.box((door, side * wide - 0.02, handle_z), (door + 0.2, side * wide + 0.018, handle_z + 0.03), 0.008), 5)
        mirror = shapes.stone(np.random.default_rng(3), (0.07, 0.11, 0.075), 10, 0.5, 0.0)
        mesh.add(shapes.moved(mirror, (shape["glass_foot"][1] - 0.25, side * (wide + 0.06), shape["belt"] + 0.1)), 0)
        for axle in (half - 0.88, -half + 0.86):
            y0 = side * (wide - 0.012)
            center = np.array([axle, y0, 0.32])
            arc = np.linspace(-0.25, np.pi + 0.25, 30)
            lip = center + 0.375 * np.stack([np.cos(arc), 0 * arc, np.sin(arc)], axis=1)
            mesh.add(shapes.tube(lip, 0.022, 8), 0)
            profile = [(0.0, -0.16), (0.37, -0.16), (0.37, 0.006), (0.0, 0.006)]
            well = shapes.rotated(shapes.lathe(profile, 40), (1, 0, 0), -np.pi / 2 * side)
            mesh.add(shapes.moved(well, center), 1)
            profile = [(0.20, 0.0), (0.215, 0.022), (0.26, 0.03), (0.295, 0.025), (0.32, 0.0), (0.32, -0.15)]
            mesh.add(shapes.moved(shapes.rotated(shapes.lathe(profile, 40), (1, 0, 0), -np.pi / 2 * side), center), 6)
            rim = shapes.lathe([(0.20, 0.018), (0.19, 0.0), (0.15, 0.008)], 40)
            mesh.add(shapes.moved(shapes.rotated(rim, (1, 0, 0), -np.pi / 2 * side), center), 5)
            hub = shapes.lathe([(0.06, 0.012), (0.05, 0.02), (0.0, 0.022)], 20)
            mesh.add(shapes.moved(shapes.rotated(hub, (1, 0, 0), -np.pi / 2 * side), center), 5)
            for spoke in np.arange(7) / 7 * TAU:
                ends = [center + side * np.array([0, h, 0]) + r * np.array([np.cos(spoke), 0, np.sin(spoke)]) for r, h in ((0.04, 0.016), (0.12, 0.02), (0.2, 0.012))]
                mesh.add(shapes.tube(ends, (0.022, 0.017, 0.024), 6), 5)

    # Number plates, a wiper, the rear bumper's edge.
    for end, at_z in ((-1, 0.62), (1, 0.42)):
        x0 = end * (half + 0.003)
        mesh.add(shapes.box((x0 - 0.012, -0.26, at_z - 0.056), (x0 + 0.012, 0.26, at_z + 0.056), 0.004), 4)
    seam(body_grid[9][np.abs(body_grid[9][:, 0] + half) < 0.5][::2], 0.005)

    item = mesh.build(name, smooth=True)
    item.location = at
    item.rotation_euler = (0, 0, heading)
    item.data.set_sharp_from_angle(angle=np.radians(32))
    font = bpy.data.curves.new(name + " plate", "FONT")
    font.body, font.size, font.align_x, font.align_y = plate_text, 0.105, "CENTER", "CENTER"
    font.extrude = 0.001
    font.materials.append(black)
    text = bpy.data.objects.new(name + " plate", font)
    bpy.context.scene.collection.objects.link(text)
    text.parent = item
    text.location = (-half - 0.018, 0, 0.615)
    text.rotation_euler = (np.pi / 2, 0, -np.pi / 2)
    return item


def shared_materials(tail=0.0):
    """Trim, panes, lamps and tires, for all cars."""
    return (
        plain("car trim", (0.012, 0.012, 0.013), 0.45),
        glass(),
        lens("tail lamp", (0.35, 0.008, 0.006), tail),
        lens("head lamp", (0.55, 0.57, 0.6), 0.0),
        plain("chrome", (0.55, 0.56, 0.58), 0.25, Metallic=1.0),
        plain("tire", (0.014, 0.014, 0.015), 0.75),
    )
