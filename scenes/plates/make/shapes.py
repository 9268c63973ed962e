"""Meshes as NumPy arrays: noise, solids, tubes, stones, leaves and grass. z is up; meters."""

import bpy
import numpy as np

TAU = 2.0 * np.pi


# Noise

def hashed(cells, seed):
    """Uniform numbers in 0..1 for integer cells of shape (..., 3)."""
    c = cells.astype(np.int64).astype(np.uint64)
    h = c[..., 0] * np.uint64(0x9E3779B97F4A7C15) ^ c[..., 1] * np.uint64(0xC2B2AE3D27D4EB4F)
    h ^= c[..., 2] * np.uint64(0x165667B19E3779F9) ^ np.uint64((seed * 0x27D4EB2F165667C5) & 0xFFFFFFFFFFFFFFFF)
    h ^= h >> np.uint64(29)
    h *= np.uint64(0xBF58476D1CE4E5B9)
    h ^= h >> np.uint64(32)
    return (h & np.uint64(0xFFFFFF)).astype(float) / 0xFFFFFF


def noise(points, seed=0):
    """Value noise with quintic interpolation, -1..1, of points of shape (n, 3)."""
    cell = np.floor(points)
    f = points - cell
    f = f * f * f * (f * (f * 6 - 15) + 10)
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(np.array(corner) == 1, f, 1 - f), axis=1)
        total += weight * hashed(cell + corner, seed)
    return 2 * total - 1


def fbm(points, octaves=4, seed=0, gain=0.5):
    """Octaves of noise, each `gain` times as high as the one before."""
    total, height = np.zeros(len(points)), 1.0
    for octave in range(octaves):
        total += height * noise(points * 2.03**octave + 17.3 * octave, seed + octave)
        height *= gain
    return total


def ridged(points, octaves=3, seed=0):
    """Sharp ridges: 1 on a ridge, toward 0 between."""
    total, height = np.zeros(len(points)), 0.5
    for octave in range(octaves):
        total += height * (1 - np.abs(noise(points * 2.1**octave + 9.1 * octave, seed + octave)))
        height *= 0.5
    return total / (1 - 0.5**octaves)


# Meshes

class Mesh:
    """Collects parts, and becomes one object. A part has vertices (n, 3), faces (m, 3 or 4) and a slot for its material."""

    def __init__(self, *materials):
        self.materials = list(materials)
        self.parts = []
        self.count = 0

    def add(self, part, slot=0, tint=0.5):
        """`tint` is a number for each vertex, or one for all: materials read it as the attribute "tint"."""
        vertices, faces = part
        tints = np.broadcast_to(np.asarray(tint, float), (len(vertices),))
        self.parts.append((vertices, np.asarray(faces) + self.count, slot, tints))
        self.count += len(vertices)
        return self

    def build(self, name, smooth=False, link=True):
        vertices = np.concatenate([p[0] for p in self.parts]).astype(np.float32)
        sizes = np.concatenate([np.full(len(p[1]), p[1].shape[1]) for p in self.parts])
        corners = np.concatenate([p[1].ravel() for p in self.parts]).astype(np.int32)
        slots = np.concatenate([np.full(len(p[1]), p[2]) for p in self.parts]).astype(np.int32)
        mesh = bpy.data.meshes.new(name)
        mesh.vertices.add(len(vertices))
        mesh.vertices.foreach_set("co", vertices.ravel())
        mesh.loops.add(len(corners))
        mesh.loops.foreach_set("vertex_index", corners)
        mesh.polygons.add(len(sizes))
        mesh.polygons.foreach_set("loop_start", np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int32))
        mesh.polygons.foreach_set("material_index", slots)
        mesh.update(calc_edges=True)
        mesh.validate()
        if smooth:
            mesh.shade_smooth()
        else:
            mesh.shade_flat()
        tint = mesh.attributes.new("tint", "FLOAT", "POINT")
        tint.data.foreach_set("value", np.concatenate([p[3] for p in self.parts]).astype(np.float32))
        for material in self.materials:
            mesh.materials.append(material)
        item = bpy.data.objects.new(name, mesh)
        if link:
            bpy.context.scene.collection.objects.link(item)
        return item


def moved(part, offset=(0, 0, 0), turn=0.0, scale=1.0):
    """A part scaled, turned about z (radians) and moved."""
    v = part[0] * np.asarray(scale, float)
    c, s = np.cos(turn), np.sin(turn)
    v = np.stack([c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1], v[:, 2]], axis=1)
    return v + np.asarray(offset, float), part[1]


def rotated(part, axis, angle):
    """A part turned about an axis through the origin."""
    return part[0] @ rotation(axis, angle).T, part[1]


def rotation(axis, angle):
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def joined(parts):
    vertices, faces, count = [], [], 0
    for v, f in parts:
        vertices.append(v)
        faces.append(np.asarray(f) + count)
        count += len(v)
    return np.concatenate(vertices), np.concatenate(faces)


def grid(xs, ys, height=0.0):
    """A sheet over the rectangle of xs and ys: `height` is a number or a function of points (n, 3)."""
    x, y = np.meshgrid(xs, ys)
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    points[:, 2] = height(points) if callable(height) else height
    return points, strip_faces(len(ys), len(xs))


def strip_faces(rows, columns, closed=False):
    """Quads between rows of vertices; `closed` joins the last column to the first."""
    i = np.arange(rows - 1)[:, None] * columns
    j = np.arange(columns if closed else columns - 1)[None, :]
    k = (j + 1) % columns
    return np.stack([i + j, i + k, i + columns + k, i + columns + j], axis=-1).reshape(-1, 4)


def box(low, high, chamfer=0.0):
    """An axis-aligned box between two corners, its edges cut off by `chamfer`."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    center, half = (low + high) / 2, (high - low) / 2
    if chamfer <= 0:
        signs = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
        faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        return center + signs * half, np.array(faces)
    chamfer = min(chamfer, 0.49 * half.min())
    vertices, index = [], {}
    for corner in np.ndindex(2, 2, 2):
        sign = 2 * np.array(corner) - 1
        for axis in range(3):
            inset = np.full(3, chamfer)
            inset[axis] = 0
            index[(*corner, axis)] = len(vertices)
            vertices.append(center + sign * (half - inset))
    faces = []
    for axis in range(3):
        a, b = (axis + 1) % 3, (axis + 2) % 3
        for side in (0, 1):
            ring = []
            for ia, ib in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = [0, 0, 0]
                corner[axis], corner[a], corner[b] = side, ia, ib
                ring.append(index[(*corner, axis)])
            faces.append(ring if side else ring[::-1])
        for ia in (0, 1):
            for ib in (0, 1):
                ends = []
                for along in (0, 1):
                    corner = [0, 0, 0]
                    corner[axis], corner[a], corner[b] = along, ia, ib
                    ends.append((index[(*corner, a)], index[(*corner, b)]))
                quad = [ends[0][0], ends[1][0], ends[1][1], ends[0][1]]
                faces.append(quad if ia == ib else quad[::-1])
    for corner in np.ndindex(2, 2, 2):
        triangle = [index[(*corner, axis)] for axis in range(3)]
        triangle = triangle if sum(corner) % 2 else triangle[::-1]
        faces.append([*triangle, triangle[2]])
    # Triangles are written as quads whose last corner is repeated; `validate` would drop them, so shift that corner.
    vertices = np.array(vertices)
    fixed = []
    extra = []
    for face in faces:
        if face[2] == face[3]:
            middle = (vertices[face[0]] + vertices[face[2]]) / 2
            extra.append(middle)
            fixed.append([face[0], face[1], face[2], len(vertices) + len(extra) - 1])
        else:
            fixed.append(face)
    return np.concatenate([vertices, extra]), np.array(fixed)


def frames_along(path):
    """Unit tangents and two normals along a path, without twist."""
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True) + 1e-12
    first = np.cross(tangents[0], [0.0, 0.0, 1.0])
    if np.linalg.norm(first) < 0.1:
        first = np.cross(tangents[0], [0.0, 1.0, 0.0])
    normals = np.empty_like(path)
    normal = first
    for i, tangent in enumerate(tangents):
        normal = normal - tangent * (normal @ tangent)
        normal /= np.linalg.norm(normal)
        normals[i] = normal
    return tangents, normals, np.cross(tangents, normals)


def tube(path, radii, sides=8, capped=True, relief=None):
    """A tube around a path. `relief(angle, along)` is added to the radius, at arrays of angles and of meters along."""
    path = np.asarray(path, float)
    radii = np.broadcast_to(np.asarray(radii, float), (len(path),))
    _, n, b = frames_along(path)
    angles = np.arange(sides) / sides * TAU
    r = np.repeat(radii[:, None], sides, axis=1)
    if relief is not None:
        steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
        along = np.concatenate([[0], np.cumsum(steps)])
        r = r + relief(*np.broadcast_arrays(angles[None, :], along[:, None]))
    ring = np.cos(angles)[None, :, None] * n[:, None, :] + np.sin(angles)[None, :, None] * b[:, None, :]
    vertices = (path[:, None, :] + r[..., None] * ring).reshape(-1, 3)
    faces = strip_faces(len(path), sides, closed=True)
    if capped:
        vertices = np.concatenate([vertices, path[[0, -1]]])
        count = len(path) * sides
        half = np.arange(0, sides - 1, 2)
        start = np.stack([np.full(len(half), count), (half + 2) % sides, half + 1, half], axis=1)
        last = count - sides
        end = np.stack([np.full(len(half), count + 1), last + half, last + half + 1, last + (half + 2) % sides], axis=1)
        faces = np.concatenate([faces, start, end])
    return vertices, faces


def lathe(profile, sides=24):
    """A solid of revolution about z from (radius, z) pairs."""
    profile = np.asarray(profile, float)
    angles = np.arange(sides) / sides * TAU
    x = profile[:, 0, None] * np.cos(angles)
    y = profile[:, 0, None] * np.sin(angles)
    z = np.repeat(profile[:, 1, None], sides, axis=1)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3), strip_faces(len(profile), sides, closed=True)


def sphere(detail=24):
    """A unit sphere of six grids, so that its quads are about equally large."""
    t = np.tan(np.linspace(-np.pi / 4, np.pi / 4, detail))
    u, v = np.meshgrid(t, t)
    parts = []
    for axis in range(3):
        for side in (-1, 1):
            p = np.empty((detail * detail, 3))
            p[:, axis] = side
            p[:, (axis + 1) % 3] = u.ravel()
            p[:, (axis + 2) % 3] = v.ravel() * side
            parts.append((p / np.linalg.norm(p, axis=1, keepdims=True), strip_faces(detail, detail)))
    return joined(parts)


def stone(rng, size, detail=28, squareness=0.35, roughness=0.12):
    """A boulder: a sphere drawn toward a box, with a few broken faces and relief. `size` is its three half axes."""
    v, f = sphere(detail)
    cube = v / np.abs(v).max(axis=1, keepdims=True)
    v = v * (1 - squareness) + 0.8 * cube * squareness
    for _ in range(7):
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        excess = v @ normal - rng.uniform(0.62, 0.92)
        v = v - np.where(excess > 0, 0.85 * excess, 0)[:, None] * normal
    offset = rng.uniform(-50, 50, 3)
    seed = int(rng.integers(1 << 30))
    relief = roughness * fbm(v * 1.3 + offset, 3, seed) + 0.25 * roughness * fbm(v * 6 + offset, 4, seed + 9, 0.6)
    v = v * (1 + relief)[:, None]
    return v * np.asarray(size, float), f


def leaves(positions, directions, normals, lengths, width=0.5, fold=0.25, curl=0.35):
    """One leaf for each position: pointed ovals, folded at the midrib and curled, of 10 vertices each."""
    along = np.array([0.0, 0.3, 0.65, 1.0])
    half = np.array([0.04, 0.42, 0.34, 0.0]) * width * 1.15
    template = []
    for a, h in zip(along, half):
        drop = -curl * a * a
        template += [[a, -h, drop + fold * h], [a, 0.0, drop], [a, h, drop + fold * h]]
    template = np.array(template)
    faces = strip_faces(4, 3)
    x = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    y = np.cross(normals, x)
    y /= np.linalg.norm(y, axis=1, keepdims=True) + 1e-9
    z = np.cross(x, y)
    basis = np.stack([x, y, z], axis=1) * lengths[:, None, None]
    vertices = np.einsum("ti,nij->ntj", template, basis) + positions[:, None, :]
    count = len(template)
    all_faces = faces[None] + (np.arange(len(positions)) * count)[:, None, None]
    return vertices.reshape(-1, 3), all_faces.reshape(-1, 4), count


def blades(rng, count, spread, height, width, lean=0.45):
    """A tuft of grass: blades that bend outward, 4 joints each."""
    t = np.linspace(0, 1, 5)
    angle = rng.uniform(0, TAU, count)
    reach = spread * np.sqrt(rng.uniform(0, 1, count))
    base = np.stack([reach * np.cos(angle), reach * np.sin(angle), np.zeros(count)], axis=1)
    heading = angle + rng.normal(0, 0.9, count)
    tall = height * rng.uniform(0.45, 1.15, count)
    bend = lean * rng.uniform(0.2, 1.5, count)
    out = np.stack([np.cos(heading), np.sin(heading), np.zeros(count)], axis=1)
    side = np.stack([-out[:, 1], out[:, 0], np.zeros(count)], axis=1)
    along = (bend * tall)[:, None] * t**2
    up = tall[:, None] * (t - 0.35 * bend[:, None] * t**3)
    center = base[:, None] + along[..., None] * out[:, None]
    center[..., 2] += up
    half = width * 0.5 * (1 - t**1.8)[None, :, None] * side[:, None] * rng.uniform(0.6, 1.3, count)[:, None, None]
    vertices = np.stack([center - half, center + half], axis=2).reshape(-1, 3)
    faces = strip_faces(5, 2)[None] + (np.arange(count) * 10)[:, None, None]
    tints = np.repeat(rng.uniform(0, 1, count), 10)
    return (vertices, faces.reshape(-1, 4)), tints


def scatter(name, items, points, turns, scales, tilt=None):
    """Instances of objects on points: each a random one of `items`, turned about z, tilted about x and y, and scaled."""
    group = bpy.data.node_groups.new(name, "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, link = group.nodes, group.links.new
    start, end = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    family = bpy.data.collections.new(name)
    for item in items:
        family.objects.link(item)
    info = nodes.new("GeometryNodeCollectionInfo")
    info.inputs["Collection"].default_value = family
    info.inputs["Separate Children"].default_value = True
    info.inputs["Reset Children"].default_value = True
    instances = nodes.new("GeometryNodeInstanceOnPoints")
    instances.inputs["Pick Instance"].default_value = True

    def attribute(key, kind):
        node = nodes.new("GeometryNodeInputNamedAttribute")
        node.data_type = kind
        node.inputs["Name"].default_value = key
        return node.outputs[0]

    link(start.outputs[0], instances.inputs["Points"])
    link(info.outputs[0], instances.inputs["Instance"])
    link(attribute("turn", "FLOAT_VECTOR"), instances.inputs["Rotation"])
    link(attribute("size", "FLOAT"), instances.inputs["Scale"])
    link(attribute("pick", "INT"), instances.inputs["Instance Index"])
    link(instances.outputs[0], end.inputs[0])

    count = len(points)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(count)
    mesh.vertices.foreach_set("co", np.asarray(points, np.float32).ravel())
    tilt = np.zeros((count, 2)) if tilt is None else tilt
    euler = np.concatenate([tilt, np.asarray(turns)[:, None]], axis=1).astype(np.float32)
    mesh.attributes.new("turn", "FLOAT_VECTOR", "POINT").data.foreach_set("vector", euler.ravel())
    sizes = np.broadcast_to(np.asarray(scales, np.float32), (count,)).copy()
    mesh.attributes.new("size", "FLOAT", "POINT").data.foreach_set("value", sizes)
    picks = np.random.default_rng(count).integers(0, len(items), count).astype(np.int32)
    mesh.attributes.new("pick", "INT", "POINT").data.foreach_set("value", picks)
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    item.modifiers.new("scatter", "NODES").node_group = group
    return item
