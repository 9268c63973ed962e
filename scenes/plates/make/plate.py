"""Camera, sky, rendering, and the files of a plate.

Bansho's axes are x to the right, y up and z toward the viewer; Blender's z is up and its y is Bansho's -z.
"""

import argparse
import os
import sys
import tempfile

import bpy
import numpy as np
import OpenEXR
from mathutils import Vector
from PIL import Image

from shaders import Shader

SIZE = (1280, 720)
NORMALS_SIZE = (640, 360)
# The most bytes of a plate's files.
LIMITS = {"picture": 300_000, "depth": 400_000, "albedo": 220_000, "normals": 390_000}


def blender(point):
    """A point in Bansho's axes, in Blender's."""
    x, y, z = point
    return (x, -z, y)


def bansho(point):
    """A point in Blender's axes, in Bansho's."""
    x, y, z = point
    return (x, z, -y)


def options(world):
    parser = argparse.ArgumentParser(description=f"Makes the plate `{world}`.")
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--scale", type=float, default=1.0, help="size of a trial, relative to 1280x720")
    parser.add_argument("--crop", type=float, nargs=4, help="left, right, bottom, top, 0 to 1: only the picture of this part")
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--into", default=os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
    parser.add_argument("--passes", help="an NPZ file: rendered passes are kept there, and developed again if it exists")
    parser.add_argument("--lamps", action="store_true", help="switch on the lamps that are left to Bansho, for comparison")
    return parser.parse_args(sys.argv[1:])


def empty_scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def camera(position, target, vertical_fov_deg, far=2000.0):
    """The camera, in Bansho's terms. What lies `far` meters away is not drawn."""
    data = bpy.data.cameras.new("camera")
    item = bpy.data.objects.new("camera", data)
    scene = bpy.context.scene
    scene.collection.objects.link(item)
    scene.camera = item
    item.location = blender(position)
    direction = Vector(blender(target)) - item.location
    item.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()
    data.sensor_fit = "VERTICAL"
    data.sensor_height = 24.0
    data.lens = 12.0 / np.tan(np.radians(vertical_fov_deg) / 2)
    data.clip_start, data.clip_end = 0.05, far
    return item


def gradient_sky(stops, strength, clouds=0.0, cloud_color=(1.0, 1.0, 1.0), glow=None, seen=1.0):
    """A sky from the horizon (0) to overhead (1): `stops` are (sine of elevation, color).

    `clouds` is the contrast of layers of cloud, `glow` a (direction, color, exponent) around a set sun.
    The camera and reflections see the share `seen` of its light.
    """
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    s = Shader("sky", world.node_tree)
    direction = s.node("ShaderNodeTexCoord").outputs["Generated"]
    up = s.axis(direction, "Z")
    color = s.ramp(s.math("MAXIMUM", up, 0.0), *stops)
    if glow is not None:
        toward, glow_color, exponent = glow
        toward = Vector(toward).normalized()
        cosine = s.node("ShaderNodeVectorMath", {0: direction, 1: tuple(toward)}, operation="DOT_PRODUCT").outputs["Value"]
        lobe = s.math("POWER", s.math("MAXIMUM", cosine, 0.0), exponent)
        color = s.mix(lobe, color, glow_color, "ADD")
    if clouds > 0.0:
        # Project the direction on a plane overhead, so that clouds shrink toward the horizon.
        height = s.math("ADD", s.math("MAXIMUM", up, 0.0), 0.12)
        plane = s.combine(s.math("DIVIDE", s.axis(direction, "X"), height), s.math("DIVIDE", s.axis(direction, "Y"), height), 0.0)
        cover = s.remap(s.noise(0.9, 9.0, 0.56, plane, 0.4), 0.34, 0.68)
        color = s.mix(s.math("MULTIPLY", cover, clouds), color, cloud_color)
    if seen != 1.0:
        path = s.node("ShaderNodeLightPath").outputs
        direct = s.math("MAXIMUM", path["Is Camera Ray"], path["Is Glossy Ray"])
        strength = s.remap(direct, 0.0, 1.0, strength, strength * seen)
    background = s.node("ShaderNodeBackground", {"Color": color, "Strength": strength})
    output = s.node("ShaderNodeOutputWorld")
    s.tree.links.new(background.outputs[0], output.inputs["Surface"])


def night_sky():
    """The faint glow of a night without moon and aurora, brighter toward the horizon."""
    light = (0.30, 0.40, 0.58)
    gradient_sky([(0.0, tuple(1.5 * c for c in light)), (0.25, tuple(1.2 * c for c in light)), (1.0, light)], 1.0, seen=0.12)


def area_light(position, size, color, watts, direction=(0, 0, -1), spread_deg=180.0):
    """A rectangle of light at a point in Blender's axes."""
    data = bpy.data.lights.new("area", "AREA")
    data.shape = "RECTANGLE"
    data.size, data.size_y = size
    data.color, data.energy = color, watts
    data.spread = np.radians(spread_deg)
    item = bpy.data.objects.new("area", data)
    item.location = position
    item.rotation_euler = Vector(direction).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(item)
    return item


def point_light(position, color, watts, radius=0.05, spot_deg=None):
    data = bpy.data.lights.new("lamp", "SPOT" if spot_deg else "POINT")
    data.color, data.energy, data.shadow_soft_size = color, watts, radius
    if spot_deg:
        data.spot_size, data.spot_blend = np.radians(spot_deg), 0.6
    item = bpy.data.objects.new("lamp", data)
    item.location = position
    bpy.context.scene.collection.objects.link(item)
    return item


# Rendering

def settings(scene, args, samples):
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = round(SIZE[0] * args.scale)
    scene.render.resolution_y = round(SIZE[1] * args.scale)
    scene.render.resolution_percentage = 100
    if args.threads:
        scene.render.threads_mode, scene.render.threads = "FIXED", args.threads
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.seed = 1
    cycles.use_adaptive_sampling = samples > 16
    cycles.adaptive_threshold = 0.02
    cycles.use_denoising = samples > 16
    cycles.denoiser = "OPENIMAGEDENOISE"
    cycles.denoising_prefilter = "ACCURATE"
    cycles.max_bounces = 5
    cycles.diffuse_bounces = 3
    cycles.glossy_bounces = 3
    cycles.transmission_bounces = 4
    cycles.transparent_max_bounces = 12
    cycles.sample_clamp_indirect = 6.0
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.pixel_filter_type = "BLACKMAN_HARRIS"
    cycles.filter_width = 1.4
    layer = scene.view_layers[0]
    layer.use_pass_z = True
    layer.use_pass_normal = True
    layer.use_pass_diffuse_color = True
    layer.use_pass_glossy_color = True
    if args.crop:
        scene.render.use_border = scene.render.use_crop_to_border = True
        left, right, bottom, top = args.crop
        scene.render.border_min_x, scene.render.border_max_x = left, right
        scene.render.border_min_y, scene.render.border_max_y = bottom, top


def passes(scene):
    """Renders; the passes by name, as arrays (height, width, channels)."""
    path = os.path.join(tempfile.mkdtemp(), "passes.exr")
    image = scene.render.image_settings
    if hasattr(image, "media_type"):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER"
    image.color_depth = "32"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    result = {}
    with OpenEXR.File(path, separate_channels=True) as file:
        for part in range(len(file.parts)):
            for name, channel in file.channels(part).items():
                *_, layer, component = name.split(".")
                result.setdefault(layer, {})[component] = channel.pixels
    os.remove(path)
    os.rmdir(os.path.dirname(path))
    order = "RGBAXYZV"
    return {name: np.stack([c[k] for k in sorted(c, key=order.index)], axis=-1) for name, c in result.items()}


def find(all_passes, *words):
    for name, pixels in all_passes.items():
        if all(word in name.lower().replace(" ", "") for word in words):
            return pixels
    raise KeyError(f"no pass {words} in {list(all_passes)}")


def center_depth(scene):
    """Depth along the axis at pixel centers; 0 for the sky."""
    cycles = scene.cycles
    saved = cycles.samples, cycles.pixel_filter_type, cycles.filter_width, cycles.use_denoising
    adaptive = cycles.use_adaptive_sampling
    cycles.samples, cycles.pixel_filter_type, cycles.filter_width, cycles.use_denoising = 1, "BOX", 0.01, False
    cycles.use_adaptive_sampling = False
    bounces = cycles.max_bounces
    cycles.max_bounces = 0
    depth = find(passes(scene), "depth")[..., 0]
    cycles.samples, cycles.pixel_filter_type, cycles.filter_width, cycles.use_denoising = saved
    cycles.use_adaptive_sampling, cycles.max_bounces = adaptive, bounces
    return np.where(depth < 0.75 * scene.camera.data.clip_end, depth, 0.0).astype(np.float32)


# What a lens and air do

def blurred(image, sigma):
    """A Gaussian blur by Fourier transform, with mirrored edges."""
    pad = int(3 * sigma)
    pad = min(pad, min(image.shape[:2]) - 1)
    wide = np.pad(image, ((pad, pad), (pad, pad), (0, 0)), mode="reflect")
    fy = np.fft.fftfreq(wide.shape[0])[:, None]
    fx = np.fft.rfftfreq(wide.shape[1])[None, :]
    kernel = np.exp(-2 * np.pi**2 * sigma**2 * (fx**2 + fy**2))
    out = np.fft.irfft2(np.fft.rfft2(wide, axes=(0, 1)) * kernel[..., None], s=wide.shape[:2], axes=(0, 1))
    return out[pad:pad + image.shape[0], pad:pad + image.shape[1]]


def with_points(image, points, item):
    """Lamps too small to be seen as more than points: (position in Blender's axes, color, watts), as `point_light` has them.

    They are added as a lens images them, over about a pixel, and hidden by nothing.
    """
    height, width = image.shape[:2]
    to_camera = np.array(item.matrix_world.inverted())
    focal = height / 2 / (12.0 / item.data.lens)
    image = image.copy()
    for position, color, watts in points:
        x, y, z, _ = to_camera @ np.array([*position, 1.0])
        u, v = width / 2 - focal * x / z - 0.5, height / 2 + focal * y / z - 0.5
        left, top = int(u) - 2, int(v) - 2
        if z > 0 or not (0 <= left < width - 6 and 0 <= top < height - 6):
            continue
        spot = np.exp(-0.5 * ((np.arange(left, left + 6) - u) ** 2 + (np.arange(top, top + 6)[:, None] - v) ** 2) / 0.6**2)
        radiance = watts / (4 * np.pi) / (x * x + y * y + z * z) * focal**2
        image[top:top + 6, left:left + 6] += (radiance * spot / spot.sum())[..., None] * np.asarray(color)
    return image


def haze(image, depth, distance, color):
    """Air that hides 1/e of what is at `distance` meters, and is itself of this color."""
    far = np.where(depth > 0, depth, 1e6)[..., None]
    transmittance = np.exp(-far / distance)
    return image * transmittance + np.asarray(color) * (1 - transmittance)


def veil(image, share, limit=8.0):
    """The light that a lens scatters: a narrow and a wide halo around what is bright."""
    scale = image.shape[1] / 1280
    light = np.minimum(image, limit)
    halo = 0.5 * blurred(light, 3 * scale) + 0.3 * blurred(light, 14 * scale) + 0.2 * blurred(light, 60 * scale)
    return image * (1 - share) + share * halo


def developed(linear, exposure, look="AgX - High Contrast"):
    """The picture through Blender's view transform, as 8-bit sRGB."""
    scene = bpy.context.scene
    height, width = linear.shape[:2]
    image = bpy.data.images.new("linear", width, height, alpha=False, float_buffer=True)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = linear[::-1]
    image.pixels.foreach_set(pixels.ravel())
    view = scene.view_settings
    view.view_transform = look.split(" - ")[0]
    view.look = look if " - " in look else "None"
    view.exposure = exposure
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGB", "8"
    path = tempfile.mktemp(suffix=".png")
    image.save_render(path, scene=scene)
    bpy.data.images.remove(image)
    with Image.open(path) as picture:
        result = picture.convert("RGB")
    os.remove(path)
    return result


# Files

def encoded(linear):
    """Linear to sRGB, 8 bits."""
    x = np.clip(linear, 0, 1)
    return np.round(255 * np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)).astype(np.uint8)


def save_jpeg(picture, path, limit):
    """At the highest quality that fits into `limit` bytes."""
    for quality in range(95, 40, -1):
        picture.save(path, quality=quality, optimize=True, progressive=True, subsampling="4:2:0")
        if os.path.getsize(path) <= limit:
            print(f"{path}: quality {quality}")
            return
    raise ValueError(f"{path}: does not fit into {limit} bytes")


def rounded(values, bits):
    """Floats with this many bits of mantissa, which compress well."""
    drop = 23 - bits
    raw = np.ascontiguousarray(values, np.float32).view(np.uint32)
    half = np.uint32(1 << (drop - 1))
    return ((raw + half) & np.uint32(~((1 << drop) - 1) & 0xFFFFFFFF)).view(np.float32)


def save_depth(depth, path, limit):
    """With as many bits of mantissa as fit into `limit` bytes; half floats, which have 10, compress better where those suffice.

    For foliage not even 8 bits fit: its depths are rounded to equal steps of 1 / depth, which are finer near the camera,
    and to 5 bits where these are finer.
    """
    def fits(values, compression):
        header = {"compression": compression, "type": OpenEXR.scanlineimage}
        with OpenEXR.File(header, {"Z": values}) as file:
            file.write(path)
        return os.path.getsize(path) <= limit

    for bits in (14, 13, 12, 11, 10, 9, 8):
        values = rounded(depth, bits)
        if fits(values.astype(np.float16) if bits <= 10 else values, OpenEXR.ZIP_COMPRESSION):
            print(f"{path}: {bits} bits of mantissa")
            return
    for steps in (2048, 1448, 1024, 860, 724, 608, 512):
        inverse = np.round(steps / np.maximum(depth, 0.1)) / steps
        values = np.where(depth < steps / 32, 1 / np.maximum(inverse, 1e-6), rounded(depth, 5))
        values = np.where(depth > 0, values, 0).astype(np.float16)
        if fits(values, OpenEXR.PIZ_COMPRESSION):
            print(f"{path}: steps of 1/{steps} in 1 / depth")
            return
    raise ValueError(f"{path}: does not fit into {limit} bytes")


def neighbor_changes(values):
    """For each pixel, the second smallest of its differences to four neighbors: small on surfaces and at their edges, large in foliage."""
    wide = np.pad(values, ((1, 1), (1, 1), (0, 0)), mode="edge")
    middle = wide[1:-1, 1:-1]
    sides = (wide[:-2, 1:-1], wide[2:, 1:-1], wide[1:-1, :-2], wide[1:-1, 2:])
    return np.sort(np.stack([np.linalg.norm(side - middle, axis=-1) for side in sides]), axis=0)[1]


def save_normals(normals, path, limit):
    """Half floats in steps of 1/128 where neighbors agree, and in coarser ones where they differ: as fine as fits."""
    changes = neighbor_changes(normals)
    for share in (0.08, 0.11, 0.16, 0.22, 0.32, 0.45, 0.64, 0.9, 1.3):
        steps = 2.0 ** np.clip(np.floor(-np.log2(np.maximum(share * changes, 1e-6))), 2, 7)[..., None]
        value = (np.round(normals * steps) / steps).astype(np.float16)
        for compression in (OpenEXR.ZIP_COMPRESSION, OpenEXR.PIZ_COMPRESSION):
            header = {"compression": compression, "type": OpenEXR.scanlineimage}
            channels = {name: np.ascontiguousarray(value[..., i]) for i, name in enumerate("XYZ")}
            with OpenEXR.File(header, channels) as file:
                file.write(path)
            if os.path.getsize(path) <= limit:
                print(f"{path}: steps up to {share} of the change between neighbors")
                return
    raise ValueError(f"{path}: does not fit into {limit} bytes")


def camera_normals(world_normals, item):
    """Normals in the camera's axes (x right, y up, z toward the viewer), averaged to the size of the file; 0 for the sky."""
    axes = np.array(item.matrix_world.to_3x3())
    n = world_normals @ axes
    height, width = n.shape[:2]
    rows, columns = height // NORMALS_SIZE[1], width // NORMALS_SIZE[0]
    if rows > 1:
        n = n.reshape(NORMALS_SIZE[1], rows, NORMALS_SIZE[0], columns, 3).mean(axis=(1, 3))
    length = np.linalg.norm(n, axis=-1, keepdims=True)
    return np.where(length > 0.2, n / np.maximum(length, 1e-6), 0.0)


def make(world, args, exposure, view_camera, look="AgX - High Contrast", air=None, halo=0.06, occlusion=0.0, metals=True, points=(), **limits):
    """Renders the scene and writes the plate's files: picture, depth, albedo and normals.

    With an `occlusion`, the albedo is multiplied by the share of the sky that is not hidden by what is nearer than this, in meters. Without `metals`, black surfaces stay black in it.
    `points` are lamps that are seen as points. `limits` replace some of LIMITS.
    """
    scene = bpy.context.scene
    bpy.context.view_layer.update()
    settings(scene, args, args.samples)
    if occlusion:
        scene.view_layers[0].use_pass_ambient_occlusion = True
        scene.world.light_settings.distance = occlusion
    if args.passes and os.path.exists(args.passes):
        rendered = dict(np.load(args.passes))
    else:
        depth = center_depth(scene)
        rendered = {**passes(scene), "center": depth}
        if args.passes:
            np.savez(args.passes, **rendered)
    save(world, args, rendered, exposure, view_camera, look, air, halo, metals, points, {**LIMITS, **limits})


def save(world, args, rendered, exposure, view_camera, look, air, halo, metals, points, limits):
    """Develops the picture from the rendered passes, and writes the files."""
    linear = find(rendered, "combined")[..., :3]
    depth = rendered["center"]
    if air is not None:
        linear = haze(linear, depth, *air)
    linear = with_points(linear, points, view_camera)
    picture = developed(veil(linear, halo), exposure, look)
    if args.crop or args.scale != 1.0 or args.lamps:
        name = "_lamps" if args.lamps else ""
        picture.save(os.path.join(args.into, f"{world}{name}.png"))
        return
    path = os.path.join(args.into, world)
    save_jpeg(picture, path + ".jpg", limits["picture"])
    save_depth(depth, path + "_depth.exr", limits["depth"])
    albedo = find(rendered, "diffuse", "color")[..., :3]
    if metals:
        metal = albedo.max(axis=-1, keepdims=True) < 0.01
        albedo = albedo + 0.5 * find(rendered, "glossy", "color")[..., :3] * metal
    if any("occlusion" in name.lower() for name in rendered):
        # Light that bright surfaces return to each other fills their hollows.
        free = np.clip(find(rendered, "occlusion")[..., :1], 0, 1)
        albedo = albedo * free / (1 - albedo * (1 - free))
    save_jpeg(Image.fromarray(encoded(albedo)), path + "_albedo.jpg", limits["albedo"])
    save_normals(camera_normals(find(rendered, "normal"), view_camera), path + "_normals.exr", limits["normals"])
