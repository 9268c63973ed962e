"""Plates and depths of other programs: TIFF, WebP, PFM and NPY, color profiles and Exif that lie, and formats that are not read."""

import struct
import zlib

from . import jpeg, png
from .case import Case, Content, built
from .plates import DEPTH, MEGA, cut, plate, spoiled


def depth(name: str, extension: str, content: Content, code: int | tuple[int, ...] = 3, words: str = "", more: str = "", **options) -> Case:
    file = f"depth.{extension}"
    says = rf"^error: scene\.toml:\d+:\d+: plate\.depth\w*: .*({words})"
    scene = DEPTH.format(file).replace("[[flame_sheet]]", more + "[[flame_sheet]]")
    return Case(extension, name, ["check", "scene.toml"], code, says, {"scene.toml": scene, file: content, "flat.png": png.flat(32, 24)}, **options)


def tiff(entries: list[tuple[int, int, int, int]], rest: bytes = b"") -> bytes:
    """A little-endian file of one directory: tag, type, count, value or offset."""
    directory = b"".join(struct.pack("<HHII", *entry) for entry in entries)
    return b"II*\0" + struct.pack("<IH", 8, len(entries)) + directory + bytes(4) + rest


def gray_tiff(width: int, height: int, data: bytes, bits: int = 8, compression: int = 1, more: tuple = ()) -> bytes:
    entries = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 1, bits), (259, 3, 1, compression), (262, 3, 1, 1), (277, 3, 1, 1), (278, 4, 1, height),
               (279, 4, 1, len(data)), *more]
    start = 8 + 2 + 12 * (len(entries) + 1) + 4
    return tiff(sorted([*entries, (273, 4, 1, start)]), data)


def npy(header: str, data: bytes = b"") -> bytes:
    return b"\x93NUMPY\1\0" + struct.pack("<H", len(header)) + header.encode() + data


def array(shape: str, kind: str = "<f4", data: bytes = b"") -> bytes:
    return npy(f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n", data)


def webp(chunks: bytes) -> bytes:
    return b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WEBP" + chunks


def _tiffs() -> list[Case]:
    whole = gray_tiff(32, 24, bytes(768))
    profile = (34675, 7, 2**31 - 1, 8)
    return [
        plate("whole", "tiff", whole, 0),
        cut("tiff", whole, 780, 20),
        spoiled("tiff", whole[:130] + bytes(768), 3),
        plate("a directory that is its own next", "tiff", b"II*\0" + struct.pack("<IHI", 8, 0, 8), words="damaged"),
        plate("65,535 entries that are not there", "tiff", b"II*\0" + struct.pack("<IH", 8, 65535), words="damaged"),
        plate("2^32 - 1 pixels on a side", "tiff", gray_tiff(2**32 - 1, 2**32 - 1, bytes(10)), words="16384|damaged"),
        plate("16384 x 8192, few bytes", "tiff", gray_tiff(16384, 8192, bytes(10)), words="more than its|damaged"),
        plate("bomb: 16000 x 8000, deflate", "tiff", built(lambda: gray_tiff(16000, 8000, png.zeros_deflated(128 * MEGA), 8, 8)), (0, 3), "GiB|MiB|memory|allowed|damaged", signaled=True, large=True),
        plate("a profile of 2 GB that is not there", "tiff", gray_tiff(32, 24, bytes(768), more=(profile,)), (0, 3), "damaged"),
        plate("strips beyond the file", "tiff", gray_tiff(32, 24, bytes(768))[:-700], (0, 3), "damaged"),
        plate("3 bits", "tiff", gray_tiff(32, 24, bytes(768), 3), words="damaged"),
        depth("depth of another size, same shape", "tif", gray_tiff(16, 12, b"\1" * 192), 0),
        depth("depth of another shape", "tif", gray_tiff(24, 32, b"\1" * 768), words="24 x 32 pixels; allowed: 32 x 24"),
    ]


def _depths() -> list[Case]:
    whole = array("(24, 32)", data=struct.pack("<f", 2.0) * 768)
    known = "depth_kind = \"inverse\"\ndepth_known = [{}]\n"
    codes = array("(24, 32)", "<u2", b"".join(struct.pack("<H", index % 32) for index in range(768)))
    return [
        depth("whole", "npy", whole, 0),
        depth("of objects", "npy", array("(24, 32)", "|O", b"\x80\4."), words="type `.O`; allowed: float16"),
        depth("of 2^62 values", "npy", array("(4611686018427387904, 1)"), words="16384|claims"),
        depth("of more values than bytes", "npy", array("(24, 32)"), words="take 3072 bytes, and the file has 0"),
        depth("a header that does not end", "npy", b"\x93NUMPY\1\0\xff\xff{'descr'", words="truncated"),
        depth("no shape", "npy", npy("{'descr': '<f4', 'fortran_order': False}"), words="no `shape`"),
        depth("whole", "pfm", b"Pf\n32 24\n-1\n" + struct.pack("<f", 2.0) * 768, 0),
        depth("a width of 400 digits", "pfm", b"Pf\n" + b"9" * 400 + b" 1\n-1\n", words="damaged"),
        depth("few bytes", "pfm", b"Pf\n16000 8000\n-1\n", words="take 512000000 bytes"),
        depth("known points that are one", "npy", codes, words="points 1 and 2 are in the same pixel", more=known.format("[3, 3, 1.0], [3.5, 3.2, 2.0]")),
        depth("known points of one value", "npy", codes, words="same value at all points", more=known.format("[3, 3, 1.0], [3, 9, 2.0]")),
        depth("known points that contradict each other", "npy", codes, words="larger values are farther", more=known.format("[3, 3, 1.0], [9, 3, 2.0]")),
        depth("known points beyond the picture", "npy", codes, words="within the image of 32 x 24 pixels", more=known.format("[3, 3, 1.0], [99, 3, 2.0]")),
        depth("a known point where nothing is known", "npy", codes, words="no value at point 1", more=known.format("[0, 3, 1.0], [9, 3, 2.0]")),
        depth("an inverse depth that shows no ground", "npy", codes, words="depth_kind.*ground at 0 m|ground at 0 m", more="depth_kind = \"inverse\"\n[ground]\nheight = 0\n"),
        depth("known points of an axis depth", "npy", codes, words="depth_kind", more=known.format("[3, 3, 1.0], [9, 3, 0.5]").replace("inverse", "axis")),
    ]


def _others() -> list[Case]:
    def with_chunk(kind: bytes, contents: bytes) -> bytes:
        return png.flat(32, 24, extra=png.chunk(kind, contents))

    def packed_profile(profile: bytes) -> bytes:
        return with_chunk(b"iCCP", b"icc\0\0" + zlib.compress(profile))

    head = struct.pack(">I", 2**32 - 1) + bytes(32) + b"acsp" + bytes(88)
    pieces = jpeg.segment(0xE2, b"ICC_PROFILE\0\1\xff" + bytes(60_000)) * 300
    photo = jpeg.baseline(64, 48)
    whole = webp(b"VP8L" + struct.pack("<I", 8) + b"\x2f\x1f\xc0\5\0\x88\x88\x08")
    return [
        plate("a profile of zeros", "png", packed_profile(bytes(5000)), 0),
        plate("a profile of 100 MB", "png", built(lambda: with_chunk(b"iCCP", b"icc\0\0" + png.zeros_deflated(100 * MEGA))), (0, 3), "damaged", signaled=True, large=True),
        plate("a profile of 2^32 - 1 tags", "png", packed_profile(head + b"\xff\xff\xff\xff" + bytes(3000)), 0),
        plate("an unknown transfer function", "png", with_chunk(b"cICP", b"\1\x63\0\1"), 0),
        plate("Exif that points outside its block", "png", with_chunk(b"eXIf", b"II*\0" + struct.pack("<IHHHII", 8, 1, 0x010E, 2, 2**31, 2**31) + bytes(4)), 0),
        plate("Exif of an orientation of 2^32 - 1", "png", with_chunk(b"eXIf", b"II*\0" + struct.pack("<IHHHII", 8, 1, 0x0112, 4, 1, 2**32 - 1) + bytes(4)), 0),
        plate("300 pieces of a profile", "jpg", photo[:2] + pieces + photo[2:], 0),
        plate("an empty file", "webp", b"", words="damaged"),
        plate("16384 x 16384, few bytes", "webp", whole[:21] + b"\xff\xff\xff\x0f" + whole[25:], words="in total|more than|damaged|GiB|memory"),
        spoiled("webp", whole, 1),
        plate("a HEIC photograph", "jpg", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", words="a HEIC photograph, which Bansho does not read; convert it"),
        plate("a raw file", "nef", b"II*\0", words="a camera's raw file"),
        plate("a Photoshop document", "psd", b"8BPS\0\1", words="a Photoshop document"),
    ]


def cases() -> list[Case]:
    return _tiffs() + _depths() + _others()
