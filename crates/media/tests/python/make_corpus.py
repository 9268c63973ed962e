"""Writes the corpus of `tests/corpus.rs`: small files by independent writers, and what independent readers find in them.

    pip install pillow numpy opencv-python-headless OpenEXR tifffile trimesh svgwrite svgelements
    python crates/media/tests/python/make_corpus.py crates/media/tests/corpus

Pictures are read back by Pillow (with LittleCMS for profiles), OpenCV, tifffile and OpenEXR, strokes by svgelements, meshes by trimesh. Colors of
chunks that none of them reads are computed with NumPy from the standards. `pngsuite` holds the files of PngSuite, which are kept.
"""

import gzip
import io
import json
import pathlib
import struct
import sys
import zlib

import cv2
import numpy as np
import OpenEXR
import svgelements
import svgwrite
import tifffile
import trimesh
from PIL import Image, ImageCms, ImageOps

OUT = pathlib.Path(sys.argv[1])
ENTRIES: list[dict] = []
WIDTH, HEIGHT = 6, 4
# Decoders may differ by 1 in the inverse cosine transform (ITU-T T.83), which blue, 1.772 Cb, makes 2 codes. Beside a transform in double precision, Pillow and
# zune-jpeg are both off by up to 1.31 codes; zune-jpeg has no setting for that.
JPEG = 2 / 255
# Matrices and curves: LittleCMS rounds to codes, which is half of one.
PROFILE = 0.6 / 255
# LittleCMS interpolates within tetrahedra, moxcms linearly. Between the two, the table below makes 1.7 codes.
CMYK = 1.5 / 255


def add(name: str, data: bytes, **expected) -> None:
    (OUT / name).write_bytes(data)
    ENTRIES.append({"file": name, **expected})


def values(array) -> list:
    """Numbers of a picture, row by row, as JSON has them."""
    flat = np.asarray(array, dtype=np.float64).reshape(-1)
    return [("inf" if np.isposinf(v) else "nan" if np.isnan(v) else float(f"{v:.7g}")) for v in flat]


def picture(name: str, data: bytes, rgba: np.ndarray, tolerance: float = 1 / 255, encoding: str = "display", **more) -> None:
    height, width = rgba.shape[:2]
    add(name, data, kind="picture", size=[width, height], values=values(rgba), tolerance=tolerance, encoding=encoding, **more)


def depth(name: str, data: bytes, array: np.ndarray, **more) -> None:
    height, width = array.shape
    add(name, data, kind="depth", size=[width, height], values=values(array), tolerance=1e-6, **more)


def ramp(channels: int = 3, top: int = 255) -> np.ndarray:
    """A smooth picture: no sharp edges, so that JPEG stays within a code."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / [[[HEIGHT - 1]], [[WIDTH - 1]]]
    planes = [0.2 + 0.6 * x, 0.3 + 0.5 * y, 0.7 - 0.4 * x * y, 0.25 + 0.5 * x + 0.25 * y]
    kind = np.uint8 if top == 255 else np.uint16
    return np.round(np.stack(planes[:channels], -1) * top).astype(kind)


def rgba_of(image: Image.Image) -> np.ndarray:
    """What Pillow sees, turned by Exif."""
    return np.asarray(ImageOps.exif_transpose(image).convert("RGBA")) / 255


def saved(image: Image.Image, kind: str, **options) -> bytes:
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()


def encode_srgb(light):
    light = np.clip(light, 0, None)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def decode_srgb(value):
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def xyz_from_rgb(primaries, white) -> np.ndarray:
    columns = np.array([[x, y, 1 - x - y] for x, y in primaries]).T
    target = np.array([white[0] / white[1], 1, (1 - white[0] - white[1]) / white[1]])
    return columns * np.linalg.solve(columns, target)


def bradford(source, target) -> np.ndarray:
    cones = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
    xyz = lambda white: np.array([white[0] / white[1], 1, (1 - white[0] - white[1]) / white[1]])
    gains = (cones @ xyz(target)) / (cones @ xyz(source))
    return np.linalg.inv(cones) @ np.diag(gains) @ cones


D65, D50 = (0.3127, 0.3290), (0.34567, 0.35850)
SRGB = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)]
P3 = [(0.680, 0.320), (0.265, 0.690), (0.150, 0.060)]
ADOBE = [(0.64, 0.33), (0.21, 0.71), (0.15, 0.06)]
REC2020 = [(0.708, 0.292), (0.170, 0.797), (0.131, 0.046)]
PROPHOTO = [(0.734699, 0.265301), (0.159597, 0.840403), (0.036598, 0.000105)]


def to_srgb(light: np.ndarray, primaries, white) -> np.ndarray:
    matrix = np.linalg.inv(xyz_from_rgb(SRGB, D65)) @ bradford(white, D65) @ xyz_from_rgb(primaries, white)
    return light @ matrix.T


def opaque(rgb: np.ndarray) -> np.ndarray:
    return np.dstack([rgb, np.ones(rgb.shape[:2])])


# --- orientation -----------------------------------------------------------------------------------------------------------------------------------


def orientations() -> None:
    image = Image.fromarray(ramp())
    for tag in range(1, 9):
        exif = Image.Exif()
        exif[0x0112] = tag
        for name, kind, options in [
            ("jpg", "JPEG", {"quality": 100, "subsampling": 0}), ("png", "PNG", {}), ("webp", "WEBP", {"lossless": True}), ("tif", "TIFF", {}),
        ]:
            data = saved(image, kind, exif=exif, **options)
            picture(f"orientation_{tag}.{name}", data, rgba_of(Image.open(io.BytesIO(data))), tolerance=JPEG if name == "jpg" else 1 / 255)
    for name, tag in [("zero", 0), ("nine", 9)]:
        exif = Image.Exif()
        exif[0x0112] = tag
        data = saved(image, "PNG", exif=exif)
        remark = {"remark": "its orientation is 9"} if tag else {}
        picture(f"orientation_{name}.png", data, opaque(ramp() / 255), **remark)
    outside = b"MM\0*\0\0\0\x08\0\x02\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\x01\x0e\0\x02\0\0\x00\x40\x7f\xff\xff\xff\0\0\0\0"
    data = saved(image, "PNG", exif=outside)
    picture("exif_points_outside.png", data, np.rot90(opaque(ramp() / 255), -1), remark="Exif data are damaged")


# --- PNG, WebP and TIFF --------------------------------------------------------------------------------------------------------------------------------


def png_kinds() -> None:
    rgb, rgba = Image.fromarray(ramp()), Image.fromarray(ramp(4))
    kinds = {"1": rgb.convert("1"), "l": rgb.convert("L"), "la": rgba.convert("LA"), "p": rgb.quantize(16), "rgb": rgb, "rgba": rgba}
    for name, image in kinds.items():
        data = saved(image, "PNG")
        picture(f"png_{name}.png", data, rgba_of(Image.open(io.BytesIO(data))))
    for bits in (1, 2, 4, 8):
        data = saved(rgb.quantize(2**bits if bits < 8 else 200), "PNG", bits=bits)
        picture(f"png_palette_{bits}.png", data, rgba_of(Image.open(io.BytesIO(data))))
    data = saved(rgb.quantize(8), "PNG", transparency=3)
    picture("png_palette_transparent.png", data, rgba_of(Image.open(io.BytesIO(data))))
    data = saved(rgb, "PNG", transparency=tuple(int(v) for v in ramp()[0, 0]))
    picture("png_color_key.png", data, rgba_of(Image.open(io.BytesIO(data))))
    for channels in (1, 3, 4):
        wide = ramp(channels, 65535)
        stored = wide[..., 0] if channels == 1 else cv2.cvtColor(wide, cv2.COLOR_RGB2BGR if channels == 3 else cv2.COLOR_RGBA2BGRA)
        data = cv2.imencode(".png", stored)[1].tobytes()
        seen = np.repeat(wide, 3, -1) if channels == 1 else wide
        shown = seen / 65535 if channels == 4 else opaque(seen / 65535)
        picture(f"png_16_bits_{channels}.png", data, shown, tolerance=1e-6)


def webp_kinds() -> None:
    for name, channels, options in [
        ("lossless", 3, {"lossless": True}), ("lossless_alpha", 4, {"lossless": True, "exact": True}), ("lossy", 3, {"quality": 100, "method": 6}),
    ]:
        data = saved(Image.fromarray(ramp(channels)), "WEBP", **options)
        picture(f"webp_{name}.webp", data, rgba_of(Image.open(io.BytesIO(data))), tolerance=1 / 255 if channels == 4 or "less" in name else 3 / 255)
    frames = [Image.fromarray(ramp()), Image.fromarray(255 - ramp())]
    data = saved(frames[0], "WEBP", save_all=True, append_images=frames[1:], lossless=True)
    picture("webp_animation.webp", data, opaque(ramp() / 255), remark="several pictures")


def tiff_kinds() -> None:
    for compression in (None, "tiff_lzw", "tiff_adobe_deflate", "packbits"):
        for channels in (3, 4):
            data = saved(Image.fromarray(ramp(channels)), "TIFF", compression=compression)
            seen = rgba_of(Image.open(io.BytesIO(data)))
            picture(f"tiff_{compression or 'plain'}_{channels}.tif", data, seen)

    def written(array, **options) -> bytes:
        buffer = io.BytesIO()
        tifffile.imwrite(buffer, array, **options)
        return buffer.getvalue()

    def read(data: bytes) -> np.ndarray:
        return tifffile.imread(io.BytesIO(data))

    for name, array, options in [
        ("16_bits", ramp(3, 65535), {}), ("big_endian", ramp(3, 65535), {"byteorder": ">"}), ("bigtiff", ramp(), {"bigtiff": True}),
        ("planes", np.moveaxis(ramp(), -1, 0), {"planarconfig": "separate"}), ("tiles", np.kron(ramp(), np.ones((8, 8, 1), np.uint8)), {"tile": (16, 16)}),
    ]:
        data = written(array, photometric="rgb", **options)
        seen = read(data)
        seen = np.moveaxis(seen, 0, -1) if name == "planes" else seen
        picture(f"tiff_{name}.tif", data, opaque(seen / (65535 if seen.dtype == np.uint16 else 255)))
    light = (ramp() / 64).astype(np.float32)
    picture("tiff_light.tif", written(light, photometric="rgb"), opaque(light), tolerance=1e-6, encoding="linear")
    data = written(ramp(4), photometric="rgb", extrasamples=["assocalpha"])
    straight = ramp(4) / 255
    straight[..., :3] = np.minimum(straight[..., :3] / straight[..., 3:], 1)
    picture("tiff_associated_alpha.tif", data, straight)
    pages = io.BytesIO()
    with tifffile.TiffWriter(pages) as writer:
        writer.write(ramp(), photometric="rgb")
        writer.write(255 - ramp(), photometric="rgb")
    picture("tiff_pages.tif", pages.getvalue(), opaque(ramp() / 255), remark="several pictures")
    data = saved(Image.fromarray(ramp()).convert("CMYK"), "TIFF")
    picture("tiff_cmyk.tif", data, rgba_of(Image.open(io.BytesIO(data)).convert("RGB")))
    white_is_zero = written(ramp()[..., 0], photometric="miniswhite")
    picture("tiff_white_is_zero.tif", white_is_zero, opaque(np.repeat(255 - ramp()[..., :1], 3, -1) / 255))


# --- color -------------------------------------------------------------------------------------------------------------------------------------------


def s15(value: float) -> bytes:
    return struct.pack(">i", round(value * 65536))


def icc(primaries, white, curve: bytes, gray: bool = False) -> bytes:
    """An ICC profile of version 2 with matrix and curves (ICC.1:2001-04)."""
    xyz = lambda v: b"XYZ \0\0\0\0" + b"".join(map(s15, v))
    tags = {b"desc": b"desc\0\0\0\0\0\0\0\x05test\0" + bytes(79), b"wtpt": xyz((0.9642, 1.0, 0.8249)), b"cprt": b"text\0\0\0\0none\0"}
    if gray:
        tags[b"kTRC"] = curve
    else:
        matrix = bradford(white, D50) @ xyz_from_rgb(primaries, white)
        for index, color in enumerate(b"rgb"):
            tags[bytes([color]) + b"XYZ"] = xyz(matrix[:, index])
            tags[bytes([color]) + b"TRC"] = curve
    table, body, at = b"", b"", 128 + 4 + 12 * len(tags)
    for name, data in tags.items():
        data += bytes(-len(data) % 4)
        table += name + struct.pack(">II", at + len(body), len(data))
        body += data
    space = b"GRAY" if gray else b"RGB "
    head = struct.pack(">I4sI4s4s4s", 0, b"none", 0x02100000, b"mntr", space, b"XYZ ") + struct.pack(">6H", 2020, 1, 1, 0, 0, 0)
    head += b"acsp" + bytes(28) + s15(0.9642) + s15(1.0) + s15(0.8249) + bytes(48)
    profile = head + struct.pack(">I", len(tags)) + table + body
    return struct.pack(">I", len(profile)) + profile[4:]


def gamma_curve(gamma: float) -> bytes:
    return b"curv\0\0\0\0" + struct.pack(">IH", 1, round(gamma * 256)) + b"\0\0"


def srgb_curve() -> bytes:
    table = np.round(decode_srgb(np.arange(1024) / 1023) * 65535).astype(">u2").tobytes()
    return b"curv\0\0\0\0" + struct.pack(">I", 1024) + table


def undated(profile: bytes) -> bytes:
    """Without the time of its creation, so that the same files are written again."""
    return profile[:24] + struct.pack(">6H", 2020, 1, 1, 0, 0, 0) + profile[36:]


def profiles() -> None:
    prophoto_white = D50
    every = {
        "p3": icc(P3, D65, srgb_curve()), "adobe": icc(ADOBE, D65, gamma_curve(563 / 256)), "prophoto": icc(PROPHOTO, prophoto_white, gamma_curve(1.8)),
        "rec2020": icc(REC2020, D65, gamma_curve(2.4)), "srgb": undated(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()),
    }
    srgb = ImageCms.createProfile("sRGB")
    for name, profile in every.items():
        for extension, kind, options in [
            ("png", "PNG", {}), ("jpg", "JPEG", {"quality": 100, "subsampling": 0}), ("webp", "WEBP", {"lossless": True}), ("tif", "TIFF", {}),
        ]:
            data = saved(Image.fromarray(ramp()), kind, icc_profile=profile, **options)
            stored = Image.open(io.BytesIO(data)).convert("RGB")
            seen = ImageCms.profileToProfile(stored, ImageCms.ImageCmsProfile(io.BytesIO(profile)), srgb)
            picture(f"profile_{name}.{extension}", data, opaque(np.asarray(seen) / 255), tolerance=JPEG + PROFILE if extension == "jpg" else PROFILE)
    gray = icc(None, None, gamma_curve(1.8), gray=True)
    data = saved(Image.fromarray(ramp()[..., 0]), "PNG", icc_profile=gray)
    light = (ramp()[..., :1] / 255) ** 1.8
    picture("profile_gray.png", data, opaque(np.repeat(encode_srgb(light), 3, -1)), tolerance=PROFILE)
    for name, profile, words in [
        ("damaged", every["p3"][:200], "ICC profile"), ("for_cmyk", every["p3"].replace(b"RGB ", b"CMYK"), "ICC profile"), ("of_zeros", bytes(500), "ICC profile"),
    ]:
        data = saved(Image.fromarray(ramp()), "PNG", icc_profile=profile)
        picture(f"profile_{name}.png", data, opaque(ramp() / 255), remark=words)


def cmyk_profile(grid: int = 6) -> bytes:
    """A profile of a press with curves and a table (ICC.1:2001-04, lut16Type): inks multiply the light of the paper, and no other way leads back."""
    inks = np.array([[0.10, 0.45, 0.75], [0.75, 0.12, 0.30], [0.90, 0.80, 0.08], [0.07, 0.07, 0.07]])
    paper = np.array([0.86, 0.88, 0.80])
    steps = np.linspace(0, 1, grid)
    amounts = np.stack(np.meshgrid(steps, steps, steps, steps, indexing="ij"), -1)
    light = paper * np.prod(1 - amounts[..., None] * (1 - inks), axis=-2)
    xyz = light @ (bradford(D65, D50) @ xyz_from_rgb(SRGB, D65)).T / np.array([0.9642, 1.0, 0.8249])
    cube = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz * (29 / 6) ** 2 / 3 + 4 / 29)
    lab = np.stack([116 * cube[..., 1] - 16, 500 * (cube[..., 0] - cube[..., 1]), 200 * (cube[..., 1] - cube[..., 2])], -1)
    table = np.round(np.clip([652.80, 256, 256] * (lab + [0, 128, 128]), 0, 65535)).astype(">u2")
    curve = np.round((np.arange(256) / 255) ** 1.25 * 65535).astype(">u2")
    identity = b"".join(map(s15, np.eye(3).reshape(-1)))
    lut = b"mft2\0\0\0\0" + bytes([4, 3, grid, 0]) + identity + struct.pack(">HH", 256, 2) + 4 * curve.tobytes() + table.tobytes() + 3 * b"\0\0\xff\xff"
    tags = {
        b"desc": b"desc\0\0\0\0\0\0\0\x05test\0" + bytes(79), b"cprt": b"text\0\0\0\0none\0", b"A2B0": lut,
        b"wtpt": b"XYZ \0\0\0\0" + b"".join(map(s15, (0.9642, 1.0, 0.8249))),
    }
    listed, body, at = b"", b"", 128 + 4 + 12 * len(tags)
    for name, data in tags.items():
        data += bytes(-len(data) % 4)
        listed += name + struct.pack(">II", at + len(body), len(data))
        body += data
    head = struct.pack(">I4sI4s4s4s", 0, b"none", 0x02100000, b"prtr", b"CMYK", b"Lab ") + struct.pack(">6H", 2020, 1, 1, 0, 0, 0)
    head += b"acsp" + bytes(28) + s15(0.9642) + s15(1.0) + s15(0.8249) + bytes(48)
    profile = head + struct.pack(">I", len(tags)) + listed + body
    return struct.pack(">I", len(profile)) + profile[4:]


def cmyk() -> None:
    profile, srgb = cmyk_profile(), ImageCms.createProfile("sRGB")
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / [[[HEIGHT - 1]], [[WIDTH - 1]]]
    inks = np.stack([0.1 + 0.8 * x, 0.9 - 0.7 * y, 0.5 * x + 0.4 * y, 0.6 * x * y], -1)
    stored = Image.fromarray(np.round(inks * 255).astype(np.uint8), "CMYK")
    for extension, kind, options in [("jpg", "JPEG", {"quality": 100, "subsampling": 0}), ("tif", "TIFF", {})]:
        data = saved(stored, kind, icc_profile=profile, **options)
        read = Image.open(io.BytesIO(data))
        # Optimized, LittleCMS interpolates between codes of a table of its own.
        exact = ImageCms.Flags.NOOPTIMIZE
        seen = ImageCms.profileToProfile(read, ImageCms.ImageCmsProfile(io.BytesIO(profile)), srgb, outputMode="RGB", flags=exact)
        picture(f"cmyk_profile.{extension}", data, opaque(np.asarray(seen) / 255), tolerance=CMYK)


def with_chunks(*chunks: tuple[bytes, bytes]) -> bytes:
    data = saved(Image.fromarray(ramp()), "PNG")
    more = b"".join(struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in chunks)
    return data[:33] + more + data[33:]


def chunks() -> None:
    shown = ramp() / 255
    pq = lambda v: (np.maximum(v ** (32 / 2523) - 3424 / 4096, 0) / (2413 / 128 - 2392 / 128 * v ** (32 / 2523))) ** (16384 / 2610)
    bt709 = lambda v: np.where(v < 0.081, v / 4.5, ((v + 0.099) / 1.099) ** (1 / 0.45))
    srgb = lambda light, primaries=SRGB, white=D65: opaque(encode_srgb(np.clip(to_srgb(light, primaries, white), 0, 1)))
    cicp = lambda primaries, transfer: (b"cICP", bytes([primaries, transfer, 0, 1]))
    for name, numbers, expected in [
        ("p3", (12, 13), srgb(decode_srgb(shown), P3)), ("rec709", (1, 1), srgb(bt709(shown))), ("rec2020", (9, 14), srgb(bt709(shown), REC2020)),
        ("gamma22", (1, 4), srgb(shown**2.2)), ("gamma28", (1, 5), srgb(shown**2.8)), ("dci", (11, 17), srgb(shown**2.6, P3, (0.314, 0.351))),
        ("ntsc", (4, 4), srgb(shown**2.2, [(0.67, 0.33), (0.21, 0.71), (0.14, 0.08)], (0.310, 0.316))),
        ("smpte170", (6, 13), srgb(decode_srgb(shown), [(0.630, 0.340), (0.310, 0.595), (0.155, 0.070)])),
    ]:
        picture(f"cicp_{name}.png", with_chunks(cicp(*numbers)), np.clip(expected, 0, 1))
    light = to_srgb(pq(shown) * 10_000 / 203, REC2020, D65)
    picture("cicp_pq.png", with_chunks(cicp(9, 16)), opaque(light), tolerance=1e-4, encoding="linear", remark="203 cd/m^2 is display white")
    picture("cicp_linear.png", with_chunks(cicp(12, 8)), opaque(to_srgb(shown, P3, D65)), tolerance=1e-5, encoding="linear")
    picture("cicp_first.png", with_chunks(cicp(12, 13), (b"sRGB", b"\0"), (b"gAMA", struct.pack(">I", 100000))), np.clip(srgb(decode_srgb(shown), P3), 0, 1))
    for name, body in [("unknown_primaries", bytes([77, 13, 0, 1])), ("unknown_transfer", bytes([1, 99, 0, 1])), ("narrow", bytes([9, 16, 0, 0]))]:
        picture(f"cicp_{name}.png", with_chunks((b"cICP", body)), opaque(shown), remark="interpreted as sRGB")
    add("cicp_ycbcr.png", with_chunks((b"cICP", bytes([9, 16, 9, 1]))), kind="picture", error="its cICP states YCbCr")
    for gamma in (0.35, 0.55, 1 / 1.8, 1 / 2.6):
        scaled = round(gamma * 100000)
        body = (b"gAMA", struct.pack(">I", scaled))
        picture(f"gamma_{scaled}.png", with_chunks(body), srgb(shown ** (100000 / scaled)))
    scale = lambda points: struct.pack(">8I", *(round(v * 100000) for point in points for v in point))
    picture("gamma_chromaticities.png", with_chunks((b"gAMA", struct.pack(">I", 45455 + 1000)), (b"cHRM", scale([D65, *ADOBE]))),
            np.clip(srgb(shown ** (100000 / 46455), ADOBE), 0, 1))
    picture("gamma_of_srgb.png", with_chunks((b"gAMA", struct.pack(">I", 45455)), (b"cHRM", scale([D65, *SRGB]))), opaque(shown), tolerance=1e-6)
    picture("chromaticities_of_nothing.png", with_chunks((b"gAMA", struct.pack(">I", 50000)), (b"cHRM", scale([D65, (0.3, 0.3), (0.3, 0.3), (0.3, 0.3)]))),
            opaque(shown), remark="describe no colors")


# --- EXR -----------------------------------------------------------------------------------------------------------------------------------------------


def exr(channels: dict, **header) -> bytes:
    path = OUT / "temporary.exr"
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    with OpenEXR.File(header, dict(channels)) as file:
        file.write(str(path))
    data = path.read_bytes()
    path.unlink()
    return data


def read_exr(data: bytes) -> np.ndarray:
    path = OUT / "temporary.exr"
    path.write_bytes(data)
    with OpenEXR.File(str(path), separate_channels=True) as file:
        planes = [np.array(file.channels()[name].pixels, np.float64) for name in "RGB"]
    path.unlink()
    return np.dstack(planes)


def plane(seed: float, kind=np.float16) -> np.ndarray:
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    return (0.05 + seed + 0.11 * x + 0.07 * y).astype(kind)


def exrs() -> None:
    rgb = lambda kind: {name: plane(seed, kind) for name, seed in zip("RGB", (0.0, 0.4, 0.9))}
    stack = lambda channels, names: np.dstack([channels[name].astype(np.float64) for name in names])
    names = ["NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA"]
    for compression in names:
        for kind in (np.float16, np.float32):
            channels = rgb(kind)
            data = exr(channels, compression=getattr(OpenEXR, f"{compression}_COMPRESSION"))
            # What loses precision is compared with OpenEXR's own reading.
            loss = 2e-3 if compression == "DWAA" else 1e-6
            picture(f"exr_{compression.lower()}_{np.dtype(kind).name}.exr", data, opaque(read_exr(data)), tolerance=loss, encoding="linear")
    alpha = {**rgb(np.float16), "A": plane(0.0)}
    picture("exr_alpha.exr", exr(alpha), stack(alpha, "RGBA"), tolerance=1e-6, encoding="linear", alpha="associated")
    gray = {"Y": plane(0.1)}
    picture("exr_gray.exr", exr({**gray, "A": np.ones((HEIGHT, WIDTH), np.float16)}), opaque(stack(gray, "YYY")), tolerance=1e-6, encoding="linear")
    chromaticities = {
        "p3": (P3, D65), "rec2020": (REC2020, D65), "xyz": ([(1, 0), (0, 1), (0, 0)], (1 / 3, 1 / 3)), "prophoto": (PROPHOTO, D50),
    }
    for name, (primaries, white) in chromaticities.items():
        channels = rgb(np.float32)
        numbers = tuple(float(v) for point in [*primaries, white] for v in point)
        expected = opaque(to_srgb(stack(channels, "RGB"), primaries, white))
        picture(f"exr_{name}.exr", exr(channels, chromaticities=numbers), expected, tolerance=2e-5, encoding="linear")
    squeezed = exr(rgb(np.float16), pixelAspectRatio=2.0)
    picture("exr_pixel_aspect.exr", squeezed, opaque(stack(rgb(np.float16), "RGB")), tolerance=1e-6, encoding="linear", remark="2 times as wide as high")
    conventions(rgb(np.float16), stack)


def conventions(rgb: dict, stack) -> None:
    """The names of channels of renderers; every pass but the beauty has other values."""
    other = {name: plane(3.0 + index) for index, name in enumerate("RGB")}
    z = plane(7.0, np.float32)
    layer = lambda prefix, channels: {f"{prefix}.{name}": value for name, value in channels.items()}
    beauty = {**rgb, "A": np.ones((HEIGHT, WIDTH), np.float16)}
    xyz = {name: plane(5.0, np.float32) for name in "XYZ"}
    files = {
        "blender": {**layer("ViewLayer.AO", other), **layer("ViewLayer.Combined", beauty), "ViewLayer.Depth.Z": z, **layer("ViewLayer.Normal", xyz)},
        "blender_v": {**layer("RenderLayer.Combined", beauty), "RenderLayer.Depth.V": z, **layer("RenderLayer.DiffCol", other)},
        "vray": {**beauty, "ZDepth": z, **layer("diffuse", other), **layer("normals", xyz)},
        "redshift": {**beauty, "Z.Z": z, **layer("AO", other)},
        "arnold": {**beauty, "Z": z, **layer("N", xyz), **layer("albedo", other)},
        "karma": {**layer("C", {k.lower(): v for k, v in beauty.items()}), "depth": z, **layer("albedo", {k.lower(): v for k, v in other.items()})},
        "unreal": {**beauty, **layer("FinalImageMovieRenderQueue_WorldDepth", {"R": z, "G": z, "B": z}), **layer("FinalImageWorldNormal", other)},
        "nuke": {**beauty, "depth.Z": z, "forward.u": plane(1.0), "forward.v": plane(2.0)},
    }
    expected = opaque(stack(rgb, "RGB"))
    for name, channels in files.items():
        picture(f"renderer_{name}.exr", exr(channels), expected, tolerance=1e-6, encoding="linear", depth=values(z))
        depth(f"depth_renderer_{name}.exr", exr(channels), z)
    passes = exr({**layer("AO", other), **layer("Emit", rgb)})
    add("renderer_without_beauty.exr", passes, kind="picture", error="it has AO, Emit; select one with `image_layer`")
    picture("renderer_layer.exr", passes, expected, tolerance=1e-6, encoding="linear", image_layer="Emit")
    add("renderer_no_such_layer.exr", passes, kind="picture", image_layer="Beauty", error="has no layer `Beauty` of colors; it has AO, Emit")


# --- depth ----------------------------------------------------------------------------------------------------------------------------------------------


def depths() -> None:
    meters = plane(1.0, np.float32)
    meters[0, 0], meters[1, 1], meters[2, 2] = 0.0, np.inf, np.nan
    for kind in (np.float16, np.float32, np.float64, np.uint8, np.uint16, np.int16, np.int32, np.int64):
        array = meters.astype(kind) if np.issubdtype(kind, np.floating) else (np.nan_to_num(meters, posinf=0) * 40).astype(kind)
        buffer = io.BytesIO()
        np.save(buffer, array)
        depth(f"depth_{np.dtype(kind).name}.npy", buffer.getvalue(), array.astype(np.float32))
    for name, array in [("fortran", np.asfortranarray(meters)), ("big_endian", meters.astype(">f4")), ("batch", meters[None, ..., None])]:
        buffer = io.BytesIO()
        np.save(buffer, array)
        depth(f"depth_{name}.npy", buffer.getvalue(), meters)
    for name, array, words in [("objects", np.array([[{}]]), "type `|O`"), ("cube", np.zeros((2, 3, 4)), "the shape [2, 3, 4]"), ("complex", np.zeros((2, 2), complex), "type `<c16`")]:
        buffer = io.BytesIO()
        np.save(buffer, array, allow_pickle=True)
        add(f"depth_{name}.npy", buffer.getvalue(), kind="depth", error=words)
    path = OUT / "temporary.pfm"
    finite = np.nan_to_num(meters, posinf=9.0)
    cv2.imwrite(str(path), finite)
    depth("depth_opencv.pfm", path.read_bytes(), cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
    path.unlink()
    depth("depth_big_endian.pfm", b"Pf\n%d %d\n1.0\n" % (WIDTH, HEIGHT) + finite[::-1].astype(">f4").tobytes(), finite)
    codes = (np.nan_to_num(meters, posinf=0) * 256).astype(np.uint16)
    depth("depth_kitti.png", cv2.imencode(".png", codes)[1].tobytes(), codes)
    depth("depth_8_bits.png", cv2.imencode(".png", (codes // 16).astype(np.uint8))[1].tobytes(), (codes // 16).astype(np.uint8))
    add("depth_colored.png", saved(Image.fromarray(ramp()), "PNG"), kind="depth", error="it has colors; allowed for depth: a gray PNG")
    for name, array in [("float32", meters), ("float64", meters.astype(np.float64)), ("uint16", codes), ("float16", meters.astype(np.float16))]:
        buffer = io.BytesIO()
        tifffile.imwrite(buffer, array, photometric="minisblack")
        depth(f"depth_{name}.tif", buffer.getvalue(), array.astype(np.float32))
    depth("depth_only.exr", exr({"distance": finite}), finite)


# --- strokes ---------------------------------------------------------------------------------------------------------------------------------------------


def strokes(name: str, text: str, packed: bool = False) -> None:
    """The ends of all lines as svgelements finds them."""
    lines = []
    for element in svgelements.SVG.parse(io.StringIO(text), reify=True, ppi=96).elements():
        visible = getattr(element, "values", {}).get("visibility") != "hidden"
        if isinstance(element, (svgelements.Path, svgelements.Polyline, svgelements.Polygon, svgelements.SimpleLine)) and visible:
            for subpath in svgelements.Path(element).as_subpaths():
                path = svgelements.Path(subpath)
                points = [path.point(t) for t in (0, 1)]
                lines.append([[float(p.x), float(p.y)] for p in points])
    data = text.encode()
    add(name, gzip.compress(data, mtime=0) if packed else data, kind="strokes", lines=lines)


def drawings() -> None:
    def drawing(name: str, *elements, packed: bool = False, style: str = "", **options) -> None:
        document = svgwrite.Drawing(size=(100, 100), debug=False, **options)
        document.viewbox(0, 0, 100, 100)
        if style:
            document.defs.add(document.style(style))
        for element in elements:
            document.add(element(document) if callable(element) else element)
        strokes(name, document.tostring(), packed)

    drawing("lines.svg", lambda d: d.line((1, 2), (30, 40)), lambda d: d.polyline([(0, 0), (5, 5), (9, 3)]), lambda d: d.polygon([(1, 1), (5, 1), (3, 4)]))
    drawing("packed.svgz", lambda d: d.line((1, 2), (30, 40)), packed=True)
    for name, data in {
        "relative": "m1 2 l3 4 h5 v6", "smooth": "M0 0 C1 2 3 4 5 6 S7 8 9 10 Q11 12 13 14 T15 16", "arc": "M10 10 A5 8 30 1 0 20 25", "closed": "M1 1 L5 1 L5 5 Z",
        "compact": "M1-2.5.5.5", "several": "M1 1 L2 2 M5 5 L6 7 m1 1 l2 2", "exponents": "M1e1 2E0 L3e-1 4",
    }.items():
        drawing(f"path_{name}.svg", lambda d, data=data: d.path(data))
    for name, transform in {
        "translate": "translate(3 4)", "scale": "scale(2 3)", "rotate": "rotate(30 10 10)", "skew": "skewX(20) skewY(10)", "matrix": "matrix(1 2 3 4 5 6)",
        "list": "translate(10),rotate(45),scale(.5)",
    }.items():
        drawing(f"transform_{name}.svg", lambda d, transform=transform: d.path("M1 2 L8 9", transform=transform))

    def used(d):
        arc = d.path("M0 0 L5 5", id="arc")
        d.defs.add(arc)
        return d.use(arc, insert=(10, 20))

    drawing("use.svg", used)
    nested = lambda d: d.g(transform="translate(5 5)")

    def deep(d):
        group, inner = nested(d), nested(d)
        inner.add(d.line((0, 0), (1, 1)))
        group.add(inner)
        return group

    drawing("groups.svg", deep)
    drawing("hidden.svg", lambda d: d.line((0, 0), (9, 9), visibility="hidden"), lambda d: d.line((1, 1), (2, 2)))
    drawing("unpainted.svg", lambda d: d.path("M1 1 L5 2", fill="none", stroke="none"))
    for name, text, words in [
        ("cut_path.svg", '<svg>\n<path id="arc" d="M0 0L1"/></svg>', "path `arc` in line 2"), ("only_shapes.svg", '<svg><rect width="5" height="5"/></svg>', "only rect"),
        ("no_svg.svg", "<html/>", "not an SVG"), ("uses_itself.svg", '<svg><g id="a"><use href="#a"/></g></svg>', "use themselves"),
    ]:
        add(name, text.encode(), kind="strokes", error=words)


# --- meshes --------------------------------------------------------------------------------------------------------------------------------------------


def meshes() -> None:
    def mesh(name: str, data: bytes, bounds, triangles: int) -> None:
        add(name, data, kind="mesh", bounds=[[float(v) for v in corner] for corner in bounds], triangles=triangles)

    def exported(name: str, scene) -> None:
        data = scene.export(file_type="glb")
        read = trimesh.load(io.BytesIO(data), file_type="glb", force="scene")
        mesh(name, data, read.bounds, sum(len(read.geometry[read.graph[node][1]].faces) for node in read.graph.nodes_geometry))

    box = trimesh.creation.box((1, 2, 3))
    exported("box.glb", trimesh.Scene(box))
    exported("icosphere.glb", trimesh.Scene(trimesh.creation.icosphere(1, 2.5)))
    exported("cone.glb", trimesh.Scene(trimesh.creation.cone(0.5, 2, sections=12)))
    turned = trimesh.Scene()
    turned.add_geometry(box, transform=trimesh.transformations.rotation_matrix(0.7, (1, 2, 3), (4, 5, 6)))
    turned.add_geometry(trimesh.creation.cylinder(0.3, 4, sections=8), transform=trimesh.transformations.translation_matrix((7, 0, -2)))
    exported("turned.glb", turned)
    heated = trimesh.creation.box((1, 1, 1))
    heated.vertex_attributes["_heat"] = np.arange(len(heated.vertices), dtype=np.float32)
    exported("own_attribute.glb", trimesh.Scene(heated))
    files = trimesh.exchange.gltf.export_gltf(trimesh.Scene(box), embed_buffers=True)
    mesh("embedded.gltf", files["model.gltf"], box.bounds, len(box.faces))
    document = json.loads(files["model.gltf"])
    for name, required, words in [
        ("materials", ["KHR_materials_unlit", "KHR_texture_transform"], None), ("draco", ["KHR_draco_mesh_compression"], "compressed by Draco"),
        ("meshopt", ["EXT_meshopt_compression"], "compressed by meshopt"), ("quantized", ["KHR_mesh_quantization"], "quantized"),
    ]:
        data = json.dumps({**document, "extensionsRequired": required, "extensionsUsed": required}).encode()
        if words:
            add(f"{name}.gltf", data, kind="mesh", error=words)
        else:
            mesh(f"{name}.gltf", data, box.bounds, len(box.faces))


def sparse_meshes() -> None:
    """Accessors whose elements are partly replaced, as Blender writes shape keys. trimesh leaves them out, so NumPy replaces them."""
    base = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, 0, 2]], np.float32)
    faces = np.array([[0, 1, 2], [2, 1, 3], [0, 1, 4]], np.uint16)
    replaced, values = np.array([1, 3]), np.array([[3, 0, -1], [4, 5, 0]], np.float32)
    shown = base.copy()
    shown[replaced] = values
    moved = base.copy()
    moved[replaced] += 0.5 * values
    alone = np.zeros_like(base)
    alone[[0, 2, 3, 4]] = [[0, 0, 1], [1, 0, 2], [0, 6, 0], [3, 3, 0]]
    order = faces.reshape(-1).copy()
    order[[5, 8]] = [4, 2]
    skinned = base.copy()
    skinned[3] += [0, 0, 9]

    def document(name: str, accessors: list, primitive: dict, result: np.ndarray, shown_faces=faces, **more) -> None:
        binary, views = bytearray(), []

        def view(array: np.ndarray) -> int:
            binary.extend(bytes(-len(binary) % 4))
            views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes})
            binary.extend(array.tobytes())
            return len(views) - 1

        listed = []
        for kind, shape, count, dense, sparse in accessors:
            entry = {"componentType": kind, "type": shape, "count": count}
            if dense is not None:
                entry["bufferView"] = view(dense)
            if sparse is not None:
                indices, replacements = sparse
                component = {1: 5121, 2: 5123, 4: 5125}[indices.itemsize]
                entry["sparse"] = {"count": len(indices), "indices": {"bufferView": view(indices), "componentType": component}, "values": {"bufferView": view(replacements)}}
            listed.append(entry)
        scene = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}]}
        scene.update(accessors=listed, bufferViews=views, buffers=[{"byteLength": len(binary)}])
        for key, value in more.items():
            scene[key] = value
        text = json.dumps(scene).encode()
        text += b" " * (-len(text) % 4)
        binary.extend(bytes(-len(binary) % 4))
        body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + bytes(binary)
        used = result[np.unique(shown_faces)]
        bounds = [[float(v) for v in used.min(0)], [float(v) for v in used.max(0)]]
        add(f"sparse_{name}.glb", struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body, kind="mesh", bounds=bounds, triangles=len(shown_faces))

    f32, u16, u8 = 5126, 5123, 5121
    indices = (u16, "SCALAR", 9, faces, None)
    whole = (f32, "VEC3", 5, base, None)
    plain = {"attributes": {"POSITION": 0}, "indices": 1}
    for width in (np.uint8, np.uint16, np.uint32):
        sparse = (replaced.astype(width), values)
        document(f"positions_{np.dtype(width).name}", [(f32, "VEC3", 5, base, sparse), indices], plain, shown)
    document("zeros", [(f32, "VEC3", 5, None, (np.array([0, 2, 3, 4], np.uint8), alone[[0, 2, 3, 4]])), indices], plain, alone)
    document("indices", [whole, (u16, "SCALAR", 9, faces, (np.array([5, 8], np.uint8), order[[5, 8]]))], plain, base, order.reshape(-1, 3))
    morphed = {**plain, "targets": [{"POSITION": 2}, {"POSITION": 3}]}
    targets = [(f32, "VEC3", 5, None, (replaced.astype(np.uint16), values)), (f32, "VEC3", 5, None, None)]
    document("morph_target", [whole, indices, *targets], morphed, moved, meshes=[{"primitives": [morphed], "weights": [0.5, 1]}])
    joints = (u8, "VEC4", 5, None, (np.array([3], np.uint8), np.array([[1, 0, 0, 0]], np.uint8)))
    weights = (f32, "VEC4", 5, np.tile(np.array([1, 0, 0, 0], np.float32), (5, 1)), None)
    raised = np.eye(4, dtype=np.float32)
    raised[3, 2] = 9
    matrices = (f32, "MAT4", 2, np.tile(np.eye(4, dtype=np.float32), (2, 1, 1)), (np.array([1], np.uint8), raised[None]))
    bound = {"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1}
    nodes = [{"mesh": 0, "skin": 0}, {}, {}]
    document("skin", [whole, indices, joints, weights, matrices], bound, skinned, nodes=nodes, scenes=[{"nodes": [0, 1, 2]}], skins=[{"joints": [1, 2], "inverseBindMatrices": 4}])


# --- PngSuite ----------------------------------------------------------------------------------------------------------------------------------------------


def png_chunks(data: bytes) -> dict[bytes, bytes]:
    found, at = {}, 8
    while at + 8 <= len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        found.setdefault(kind, data[at + 8 : at + 8 + length])
        at += 12 + length
    return found


def stored_codes(data: bytes, chunks: dict[bytes, bytes]) -> np.ndarray:
    """Red, green, blue and alpha as stored, 0 to 1: by Pillow or, since that has no colors of 16 bits, by OpenCV."""
    bits, color_type = chunks[b"IHDR"][8:10]
    if bits < 16:
        codes = np.asarray(Image.open(io.BytesIO(data)).convert("RGBA")) / 255
        if color_type == 0 and (key := chunks.get(b"tRNS")):
            # Pillow compares codes of 8 bits with one of fewer.
            codes[..., 3] = np.round(codes[..., 0] * (2**bits - 1)) != int.from_bytes(key, "big")
        return codes
    wide = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    assert wide.dtype == np.uint16, wide.dtype
    planes = wide.reshape(*wide.shape[:2], -1)
    rgb = np.repeat(planes, 3, -1) if planes.shape[-1] == 1 else planes[..., 2::-1]
    alpha = planes[..., 3:] / 65535 if planes.shape[-1] == 4 else np.ones((*rgb.shape[:2], 1))
    if key := chunks.get(b"tRNS"):
        alpha = 1.0 - np.all(rgb == np.frombuffer(key, ">u2"), -1, keepdims=True)
    return np.dstack([rgb / 65535, alpha])


def png_suite() -> None:
    """The files of Willem van Schaik's PngSuite, which are there and not written. Their values are in one file, as codes of 8 bits."""
    suite, blob = OUT / "pngsuite", bytearray()
    for path in sorted(suite.glob("*.png")):
        data = path.read_bytes()
        name = f"pngsuite/{path.name}"
        if path.name.startswith("x"):
            ENTRIES.append({"file": name, "kind": "picture", "error": "is damaged"})
            continue
        chunks = png_chunks(data)
        codes = stored_codes(data, chunks)
        gamma = struct.unpack(">I", chunks.get(b"gAMA", b"\0\0\xb1\x8f"))[0]
        # Chromaticities, where there are any, are those of sRGB.
        if scale := chunks.get(b"cHRM"):
            assert np.allclose(np.frombuffer(scale, ">u4") / 100000, np.array([D65, *SRGB]).reshape(-1), atol=1e-3), name
        if abs(gamma - 45455) > 60 and gamma != 100000:
            codes[..., :3] = encode_srgb(codes[..., :3] ** (100000 / gamma))
        height, width = codes.shape[:2]
        encoding = "linear" if gamma == 100000 else "display"
        ENTRIES.append({"file": name, "kind": "picture", "size": [width, height], "values_from": len(blob), "tolerance": 1 / 255, "encoding": encoding})
        blob += np.round(codes * 255).astype(np.uint8).tobytes()
    (suite / "values.zz").write_bytes(zlib.compress(bytes(blob), 9))


# --- what is refused -----------------------------------------------------------------------------------------------------------------------------------


def refused() -> None:
    for name, data, words in [
        ("photo.heic", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", "a HEIC photograph"), ("photo_named.jpg", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", "a HEIC photograph"),
        ("picture.avif", b"\0\0\0\x1cftypavif\0\0\0\0", "an AVIF picture"), ("photo.nef", b"MM\0*", "a camera's raw file"), ("scan.dpx", b"SDPX", "a DPX or Cineon scan"),
        ("document.psd", b"8BPS\0\x01", "a Photoshop document"), ("picture.jxl", b"\xff\x0a", "a JPEG XL picture"), ("picture.bmp", b"BM", "convert it to PNG"),
        ("picture.hdr", b"#?RADIANCE\n", "a Radiance picture"), ("picture.xyz", b"?", "is not a supported picture format"),
    ]:
        add(name, data, kind="picture", error=words)
    photo = saved(Image.fromarray(np.kron(ramp(), np.ones((16, 16, 1), np.uint8))), "JPEG", quality=95)
    add("cut.jpg", photo[: len(photo) - 60], kind="picture", size=[16 * WIDTH, 16 * HEIGHT], remark="a part of its data is corrupt")
    junk = saved(Image.fromarray(ramp()), "JPEG", quality=100, subsampling=0)
    picture("junk_between_segments.jpg", junk[:2] + b"\xff\xfe\0\4ab" + b"\7" * 9 + junk[2:], rgba_of(Image.open(io.BytesIO(junk))), tolerance=JPEG)
    # Details that take many codes, for tests that change them.
    y, x = np.mgrid[0:120, 0:160]
    waves = [127 + 60 * np.sin(x / a) * np.cos(y / b) + 40 * np.sin(x * y / c) for a, b, c in ((7, 11, 300), (13, 5, 500), (4, 9, 700))]
    detailed = Image.fromarray(np.round(np.stack(waves, -1)).astype(np.uint8))
    for name, options in [("", {}), ("_restarts", {"restart_marker_rows": 1}), ("_progressive", {"progressive": True}), ("_full", {"subsampling": 0, "optimize": True})]:
        add(f"detailed{name}.jpg", saved(detailed, "JPEG", quality=75, **options), kind="picture", size=[160, 120])
    gray = saved(Image.fromarray(ramp()[..., 0]), "JPEG", quality=100)
    picture("gray.jpg", gray, rgba_of(Image.open(io.BytesIO(gray))))
    progressive = saved(Image.fromarray(ramp()), "JPEG", quality=100, subsampling=0, progressive=True)
    picture("progressive.jpg", progressive, rgba_of(Image.open(io.BytesIO(progressive))), tolerance=JPEG)


def main() -> None:
    OUT.mkdir(parents=True, exist_ok=True)
    for old in OUT.iterdir():
        if old.is_file():
            old.unlink()
    for part in (orientations, png_kinds, webp_kinds, tiff_kinds, profiles, cmyk, chunks, exrs, depths, drawings, meshes, sparse_meshes, png_suite, refused):
        part()
    lines = ",\n".join(json.dumps(entry, separators=(",", ":")) for entry in ENTRIES)
    (OUT / "expected.json").write_text(f"[\n{lines}\n]\n")
    print(len(ENTRIES), "files,", sum(path.stat().st_size for path in OUT.iterdir()), "bytes")


main()
