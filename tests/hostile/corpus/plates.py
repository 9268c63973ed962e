"""Plates: PNG, JPEG and OpenEXR files that are cut off, lie about themselves, or hold more than they seem to."""

import string
import struct
import zlib

from . import exr, jpeg, png
from .case import Case, Content, built

SCENE = 'bansho = 2\n[picture]\nsize = [32, 24]\nframes = 2\n[plate]\nimage = "{}"\n[[flame_sheet]]\n'
DEPTH = 'bansho = 2\n[picture]\nsize = [32, 24]\nframes = 2\n[plate]\nimage = "flat.png"\ndepth = "{}"\n[[flame_sheet]]\n'
LIT = 'bansho = 2\n[picture]\nsize = [24, 16]\nframes = 2\n[plate]\nimage = "flat.png"\ndepth = "depth.exr"\nalbedo = "{}"\n{}[[flame_sheet]]\n'
MEGA = 1_000_000
LETTERS = string.ascii_uppercase + string.ascii_lowercase


def plate(name: str, extension: str, content: Content, code: int | tuple[int, ...] = 3, words: str = "", **more) -> Case:
    file = f"plate.{extension}"
    says = rf"^error: scene\.toml:6:9: plate\.image: .*plate\.{extension}.*({words})"
    return Case(extension, name, ["check", "scene.toml"], code, says, {"scene.toml": SCENE.format(file), file: content}, **more)


def cut(extension: str, whole: bytes, keep: int, count: int = 40) -> Case:
    """A plate cut off at so many places, none within its last `keep` bytes, each with a scene of its own."""
    places = sorted({(len(whole) - keep) * step // count for step in range(count)})
    files: dict[str, Content] = {}
    for place in places:
        files[f"{place}.toml"] = SCENE.format(f"{place}.{extension}")
        files[f"{place}.{extension}"] = whole[:place]
    says = rf"^error: \d+\.toml:6:9: plate\.image: \d+\.{extension}: "
    return Case(extension, f"cut off at {len(places)} places", ["check", *(f"{place}.toml" for place in places)], 3, says, files, errors=len(places))


def spoiled(extension: str, whole: bytes, step: int) -> Case:
    """A plate with one wrong byte at every so many places: some of them are refused, none ends the program."""
    places = range(0, len(whole), step)
    files: dict[str, Content] = {}
    for place in places:
        files[f"{place}.toml"] = SCENE.format(f"{place}.{extension}")
        files[f"{place}.{extension}"] = whole[:place] + bytes([whole[place] ^ 0xA5]) + whole[place + 1 :]
    says = rf"^error: \d+\.toml:6:9: plate\.image: \d+\.{extension}: "
    return Case(extension, "one wrong byte at many places", ["check", *(f"{place}.toml" for place in places)], (0, 3), says, files, errors=-1)


def _png() -> list[Case]:
    small, flat = png.gradient(), png.flat(32, 24)
    pixels = png.chunk(b"IDAT", zlib.compress(bytes(24 * 97)))
    header = png.header(32, 24)

    def with_chunk(kind: bytes, contents: bytes) -> bytes:
        return png.flat(32, 24, extra=png.chunk(kind, contents))

    def compressed(count: int) -> bytes:
        return png.zeros_deflated(count)

    animation = png.chunk(b"acTL", struct.pack(">II", 2**31 - 1, 0)) + png.chunk(b"fcTL", struct.pack(">IIIIIHHBB", 0, 32, 24, 0, 0, 1, 30, 0, 0))
    tiff = b"II*\0" + struct.pack("<IH", 8, 1)
    return [
        plate("whole", "png", flat, 0),
        cut("png", small, 16),
        spoiled("png", small, 7),
        plate("empty", "png", b"", words="damaged"),
        plate("signature alone", "png", png.SIGNATURE, words="damaged"),
        plate("text", "png", "no picture\n" * 100, words="damaged"),
        plate("a JPEG by another name", "png", jpeg.baseline(32, 24), words="damaged"),
        plate("wrong checksum of the header", "png", png.SIGNATURE + header[:-1] + bytes([header[-1] ^ 1]) + pixels + png.END, words="damaged"),
        plate("wrong checksum of the pixels", "png", png.SIGNATURE + header + pixels[:-1] + bytes([pixels[-1] ^ 1]) + png.END, words="damaged"),
        plate("0 x 5", "png", png.with_pixels(0, 5, zlib.compress(b"")), words="damaged|0 x 5"),
        plate("5 x 0", "png", png.with_pixels(5, 0, zlib.compress(b"")), words="damaged|5 x 0"),
        plate("sides of 2^31 - 1", "png", png.with_pixels(2**31 - 1, 2**31 - 1, zlib.compress(bytes(1000))), words="16384|damaged"),
        plate("sides of 2^32 - 1", "png", png.with_pixels(2**32 - 1, 2**32 - 1, zlib.compress(bytes(1000))), words="16384|damaged"),
        plate("a side of 16385", "png", png.flat(16385, 1), words="16384"),
        plate("16384 x 1", "png", png.flat(16384, 1), 0),
        plate("16384 x 16384, few bytes", "png", png.with_pixels(16384, 16384, zlib.compress(bytes(1000))), words="in total|more than its"),
        plate("8192 x 8192, few bytes", "png", png.with_pixels(8192, 8192, zlib.compress(bytes(1000))), words="more than its"),
        plate("bomb: 16384 x 8192, 16 bits, gray", "png", built(lambda: png.flat(16384, 8192, 16, png.GREY)), words="GiB|MiB|memory|allowed", signaled=True, large=True),
        plate("bomb: 16384 x 8192, 16 bits, color and alpha", "png", built(lambda: png.flat(16384, 8192, 16, png.RGBA)), words="GiB|MiB|memory|allowed", signaled=True, large=True),
        plate("bomb: 16384 x 8192, 1 bit", "png", built(lambda: png.flat(16384, 8192, 1, png.GREY)), words="GiB|MiB|memory|allowed", signaled=True, large=True),
        plate("8192 x 8192, 16 bits", "png", built(lambda: png.flat(8192, 8192, 16, png.RGBA)), (0, 3), "GiB|MiB|memory|allowed", signaled=True, large=True),
        plate("4096 x 4096", "png", built(lambda: png.flat(4096, 4096)), 0, signaled=True, large=True),
        Case("png", "bomb with more memory for inputs", ["check", "--max-asset-memory", "64KiB", "scene.toml"], (2, 3), r"^error: ",
             {"scene.toml": SCENE.format("plate.png"), "plate.png": png.flat(512, 512)}),
        plate("pixels that inflate to more", "png", built(lambda: png.with_pixels(32, 24, compressed(600 * MEGA))), (0, 3), "damaged", signaled=True, large=True),
        plate("pixels that inflate to less", "png", png.with_pixels(32, 24, zlib.compress(bytes(100))), words="damaged"),
        plate("pixels that are no zlib", "png", png.with_pixels(32, 24, b"\xff" * 5000), words="damaged"),
        plate("zlib with a dictionary", "png", png.with_pixels(32, 24, b"\x78\xbb" + bytes(50)), words="damaged"),
        plate("filter 255", "png", png.with_pixels(32, 24, zlib.compress((b"\xff" + bytes(96)) * 24)), words="damaged"),
        plate("no pixels", "png", png.SIGNATURE + header + png.END, words="damaged"),
        plate("1,000 empty IDAT", "png", png.SIGNATURE + header + png.chunk(b"IDAT", b"") * 1000 + pixels + png.END, 0),
        plate("100,000 empty chunks", "png", built(lambda: png.SIGNATURE + header + png.chunk(b"abCd", b"") * 100_000 + pixels + png.END), 0),
        plate("a chunk of 2^31 - 1 bytes", "png", png.SIGNATURE + header + struct.pack(">I", 2**31 - 1) + b"tEXt" + bytes(100), words="damaged"),
        plate("a chunk of 2^32 - 1 bytes", "png", png.SIGNATURE + header + struct.pack(">I", 2**32 - 1) + b"IDAT" + bytes(100), words="damaged"),
        plate("two headers", "png", png.SIGNATURE + header + png.header(9, 9) + pixels + png.END, (0, 3), "damaged"),
        plate("pixels before the header", "png", png.SIGNATURE + pixels + header + png.END, words="damaged"),
        plate("an unknown critical chunk", "png", png.flat(32, 24, extra=png.chunk(b"ABCD", b"x")), (0, 3), "damaged"),
        plate("palette missing", "png", png.flat(32, 24, color=png.PALETTE), words="damaged"),
        plate("palette of nothing", "png", png.flat(32, 24, color=png.PALETTE, extra=png.chunk(b"PLTE", b"")), (0, 3), "damaged"),
        plate("palette too short for its pixels", "png", png.SIGNATURE + png.header(32, 24, 8, png.PALETTE) + png.chunk(b"PLTE", b"\1\2\3")
              + png.chunk(b"IDAT", zlib.compress((b"\0" + b"\xff" * 32) * 24)) + png.END, (0, 3), "damaged"),
        plate("7 bits", "png", png.flat(32, 24, 7), words="damaged"),
        plate("color type 5", "png", png.SIGNATURE + png.header(32, 24, 8, 5) + pixels + png.END, words="damaged"),
        plate("interlaced", "png", png.flat(32, 24, interlace=1), (0, 3), "damaged"),
        plate("interlaced by a method of tomorrow", "png", png.flat(32, 24, interlace=9), words="damaged"),
        plate("bomb in zTXt", "png", built(lambda: with_chunk(b"zTXt", b"k\0\0" + compressed(400 * MEGA))), (0, 3), "damaged", signaled=True, large=True),
        plate("bomb in iTXt", "png", built(lambda: with_chunk(b"iTXt", b"k\0\1\0\0\0" + compressed(400 * MEGA))), (0, 3), "damaged", signaled=True, large=True),
        plate("bomb in iCCP", "png", built(lambda: with_chunk(b"iCCP", b"icc\0\0" + compressed(400 * MEGA))), (0, 3), "damaged", signaled=True, large=True),
        plate("1,000 times a text of 60 kB", "png", built(lambda: png.flat(32, 24, extra=png.chunk(b"tEXt", b"k\0" + b"a" * 60_000) * 1000)), (0, 3), "damaged", large=True),
        plate("Exif of nothing", "png", with_chunk(b"eXIf", b""), 0),
        plate("Exif that names itself", "png", with_chunk(b"eXIf", tiff + struct.pack("<HHII", 0x8769, 4, 1, 8) + struct.pack("<I", 8)), 0),
        plate("Exif of 2^32 - 1 values", "png", with_chunk(b"eXIf", tiff + struct.pack("<HHII", 0x829A, 5, 2**32 - 1, 0) + struct.pack("<I", 0)), 0),
        plate("Exif with fractions by zero", "png", with_chunk(b"eXIf", tiff + struct.pack("<HHII", 0x829A, 5, 1, 26) + struct.pack("<III", 0, 0, 0)), 0),
        plate("gamma of zero", "png", with_chunk(b"gAMA", struct.pack(">I", 0)), (0, 3), "damaged"),
        plate("animation of 2^31 - 1 frames", "png", png.flat(32, 24, extra=animation), (0, 3), "damaged"),
        Case("png", "rendered over a plate that is cut off in its second frame", ["render", "scene.toml", "-o", "out/a.png", "--threads", "2"], 3,
             r"^error: scene\.toml:6:9: plate\.image: plate\.0001\.png: is damaged",
             {"scene.toml": SCENE.format("plate.####.png"), "plate.0000.png": flat, "plate.0001.png": flat[:60]}, leaves=["out/a.0000.png"]),
    ]


def _jpeg() -> list[Case]:
    whole = jpeg.baseline(64, 48)
    tables = jpeg.QUANTIZATION + jpeg.huffman(0x00, b"\0") + jpeg.huffman(0x10, b"\0")
    exif = jpeg.segment(0xE1, b"Exif\0\0II*\0" + struct.pack("<IH", 8, 65535) + bytes(100))
    frame, scan = jpeg.frame(0xC0, 64, 48, 1), jpeg.scan(1, 0, 63, 0, jpeg.padded(0, 2 * 48))
    start, end = b"\xff\xd8", b"\xff\xd9"
    return [
        plate("whole", "jpg", whole, 0),
        plate("whole, of three components", "jpg", jpeg.baseline(64, 48, 3), 0),
        plate("cut off within its tables", "jpg", whole[:50], words="damaged"),
        plate("cut off within its frame", "jpg", whole[:125], words="damaged"),
        plate("cut off before its pixels", "jpg", whole[: -len(end) - 12], (0, 3), "damaged"),
        spoiled("jpg", whole, 3),
        plate("CMYK", "jpg", jpeg.baseline(64, 48, 4), (0, 3), "damaged"),
        plate("nine components", "jpg", start + tables + jpeg.frame(0xC0, 64, 48, 9) + scan + end, words="damaged"),
        plate("65535 x 65535", "jpg", jpeg.baseline(65535, 65535, 1, 100), words="16384"),
        plate("16000 x 8000, few bytes", "jpg", jpeg.baseline(16000, 8000, 1, 100), words="GiB|MiB|memory|more than|damaged", signaled=True),
        plate("bomb: 16000 x 8000", "jpg", built(lambda: jpeg.baseline(16000, 8000)), words="GiB|MiB|memory|allowed", signaled=True, large=True),
        plate("8000 x 8000, whole", "jpg", built(lambda: jpeg.baseline(8000, 8000)), (0, 3), "GiB|MiB|memory|allowed", signaled=True, large=True),
        plate("0 x 48", "jpg", jpeg.baseline(0, 48, 1, 1), words="damaged"),
        plate("64 x 0", "jpg", jpeg.baseline(64, 0, 1, 48), words="damaged"),
        plate("progressive, 3,000 scans of 8000 x 8000", "jpg", built(lambda: jpeg.progressive_bomb(8000, 8000, 3000)), (0, 3), "damaged|scans|GiB|MiB|memory|allowed", signaled=True, large=True),
        plate("progressive, 100,000 scans of 64 x 48", "jpg", built(lambda: jpeg.progressive_bomb(64, 48, 100_000)), (0, 3), "damaged|scans", signaled=True, large=True),
        plate("no tables", "jpg", start + frame + scan + end, words="damaged"),
        plate("tables of a bad length", "jpg", start + b"\xff\xdb\0\1" + frame + scan + end, words="damaged"),
        plate("a table of too many codes", "jpg", start + jpeg.segment(0xC4, b"\0" + b"\xff" * 16 + bytes(255)) + frame + scan + end, words="damaged"),
        plate("two frames", "jpg", start + tables + frame + jpeg.frame(0xC0, 9, 9, 1) + scan + end, (0, 3), "damaged"),
        plate("scan before its frame", "jpg", start + tables + scan + frame + end, words="damaged"),
        plate("arithmetic coding", "jpg", start + tables + jpeg.frame(0xC9, 64, 48, 1) + scan + end, words="damaged"),
        plate("lossless", "jpg", start + tables + jpeg.frame(0xC3, 64, 48, 1) + scan + end, words="damaged"),
        plate("Exif of 65,535 entries that are not there", "jpg", start + exif + whole[2:], 0),
        plate("restarts of every block", "jpg", start + tables + jpeg.segment(0xDD, struct.pack(">H", 1)) + frame + scan + end, (0, 3), "damaged"),
        plate("16 MB of fill bytes", "jpg", built(lambda: start + b"\xff" * (16 * MEGA) + whole[3:]), (0, 3), "damaged", large=True),
        plate("100,000 comments", "jpg", built(lambda: start + jpeg.segment(0xFE, b"a" * 20) * 100_000 + whole[2:]), 0),
        plate("JPEG 2000", "jpg", b"\0\0\0\x0cjP  \r\n\x87\n" + bytes(200), words="a JPEG 2000 picture"),
    ]


def _garbage(compression: str) -> Case:
    garbage = bytes((index * 73 + index // 7) % 256 for index in range(300))
    return plate(f"garbage compressed by {compression}", "exr", exr.scan_lines(64, 48, compression, garbage), (0, 3) if compression == "none" else 3, "damaged")


def _exr() -> list[Case]:
    whole = exr.black(24, 16)
    window = struct.pack("<iiii", -(2**31), -(2**31), 2**31 - 1, 2**31 - 1)
    tiles = exr.attribute(b"tiles", b"tiledesc", struct.pack("<IIB", 2**31 - 1, 2**31 - 1, 0))
    no_tiles = exr.attribute(b"tiles", b"tiledesc", struct.pack("<IIB", 0, 0, 0))
    tiny_tiles = exr.attribute(b"tiles", b"tiledesc", struct.pack("<IIB", 1, 1, 2))

    def one(head: bytes, flags: int = 0, rest: bytes = bytes(4000)) -> bytes:
        return exr.version(flags) + head + b"\0" + rest

    def listed(channel_list: bytes) -> bytes:
        return one(exr.attributes(24, 16, channel_list=channel_list))

    part = exr.attributes(24, 16, more=exr.attribute(b"name", b"string", b"a") + exr.attribute(b"type", b"string", b"scanlineimage")
                          + exr.attribute(b"chunkCount", b"int", struct.pack("<i", 2**31 - 1)))
    return [
        plate("whole", "exr", whole, 0),
        cut("exr", whole, 1, 30),
        spoiled("exr", whole[:400], 5),
        *[_garbage(compression) for compression in exr.COMPRESSIONS],
        plate("compression 77", "exr", one(exr.attributes(24, 16, compression=77)), words="damaged|compress"),
        plate("no channels", "exr", listed(b"\0"), words="damaged|channel"),
        plate("channels of other names", "exr", listed(exr.channels("QUX")), words="layer|damaged"),
        plate("a channel name that does not end", "exr", listed(b"R" * 5000), words="damaged"),
        plate("5,000 channels", "exr", listed(b"".join(exr.channel(b"c%d" % index) for index in range(5000)) + b"\0"), words="damaged|channels"),
        plate("channels of an unknown kind", "exr", listed(exr.channels("BGR", 99)), words="damaged"),
        plate("channels sampled at every 0 pixels", "exr", listed(exr.channel(b"R", sampling=(0, 0)) + b"\0"), words="damaged|channel"),
        plate("channels sampled at every 2^31 - 1 pixels", "exr", listed(b"".join(exr.channel(n, sampling=(2**31 - 1, 1)) for n in (b"B", b"G", b"R")) + b"\0"), words="damaged|channel|sampl"),
        plate("a window of 2^32 on a side", "exr", one(exr.attributes(24, 16, window=window)), words="16384|damaged"),
        plate("a window turned inside out", "exr", one(exr.attributes(24, 16, window=struct.pack("<iiii", 9, 9, 0, 0))), words="damaged|0 x 0"),
        plate("a window far away", "exr", one(exr.attributes(24, 16, window=struct.pack("<iiii", 2**31 - 20, 0, 2**31 - 1, 9))), (0, 3), "damaged|16384"),
        plate("16384 x 16384, few bytes", "exr", one(exr.attributes(16384, 16384)), words="in total|more than|damaged"),
        plate("bomb: 16384 x 8192, zip", "exr", built(lambda: exr.zip_bomb(16384, 8192)), words="GiB|MiB|memory|allowed", signaled=True, large=True),
        plate("bomb: 8192 x 8192, zip", "exr", built(lambda: exr.zip_bomb(8192, 8192)), (0, 3), "GiB|MiB|memory|allowed", signaled=True, large=True),
        plate("bomb: 2048 x 2048 of 52 channels", "exr", built(lambda: exr.zip_bomb(2048, 2048, LETTERS)),
              (0, 3), "GiB|MiB|memory|allowed|damaged", signaled=True, large=True),
        plate("a block inflates to more", "exr", built(lambda: exr.scan_lines(64, 48, "zip", png.zeros_deflated(300 * MEGA))), words="damaged", signaled=True, large=True),
        plate("blocks beyond the file", "exr", exr.version() + exr.attributes(24, 16) + b"\0" + struct.pack("<Q", 2**63) * 16, words="damaged"),
        plate("all blocks at one place", "exr", exr.version() + exr.attributes(24, 16) + b"\0" + struct.pack("<Q", 1) * 16 + bytes(5000), words="damaged"),
        plate("a block of 2^31 - 1 bytes", "exr", exr.version() + exr.attributes(24, 16) + b"\0" + struct.pack("<Q", 500) * 16 + struct.pack("<ii", 0, 2**31 - 1) * 100, words="damaged"),
        plate("a block of less than no bytes", "exr", exr.version() + exr.attributes(24, 16) + b"\0" + struct.pack("<Q", 500) * 16 + struct.pack("<ii", 0, -1) * 100, words="damaged"),
        plate("tiles of 2^31 - 1", "exr", one(exr.attributes(24, 16, more=tiles), exr.TILED), words="damaged"),
        plate("tiles of nothing", "exr", one(exr.attributes(24, 16, more=no_tiles), exr.TILED), words="damaged"),
        plate("tiles of a pixel, in all levels", "exr", one(exr.attributes(8000, 8000, more=tiny_tiles), exr.TILED), words="damaged|more than"),
        plate("tiled without tiles", "exr", one(exr.attributes(24, 16), exr.TILED), words="damaged"),
        plate("deep", "exr", one(exr.attributes(24, 16), exr.DEEP), words="damaged|deep"),
        plate("2^31 - 1 chunks in a part", "exr", exr.version(exr.PARTS) + part + b"\0\0" + bytes(4000), words="damaged"),
        plate("1,000 parts", "exr", exr.version(exr.PARTS) + (part + b"\0") * 1000 + b"\0" + bytes(4000), words="damaged|parts"),
        plate("parts that do not end", "exr", exr.version(exr.PARTS) + (part + b"\0") * 3, words="damaged"),
        plate("an attribute of 2^31 - 1 bytes", "exr", exr.version() + b"a\0int\0" + struct.pack("<i", 2**31 - 1) + bytes(100), words="damaged"),
        plate("an attribute of less than no bytes", "exr", exr.version() + b"a\0int\0" + struct.pack("<i", -5) + bytes(100), words="damaged"),
        plate("100,000 attributes", "exr", built(lambda: exr.version() + b"".join(exr.attribute(b"a%d" % index, b"int", bytes(4)) for index in range(100_000)) + exr.attributes(24, 16) + b"\0" + bytes(5000)),
              (0, 3), "damaged"),
        plate("a preview of 2^32 pixels", "exr", one(exr.attributes(24, 16, more=exr.attribute(b"preview", b"preview", struct.pack("<II", 65536, 65536)))), words="damaged"),
        plate("version 99", "exr", exr.MAGIC + struct.pack("<I", 99) + bytes(100), words="damaged"),
        plate("primaries of no color", "exr", one(exr.attributes(24, 16, more=exr.attribute(b"chromaticities", b"chromaticities", bytes(32)))), words="damaged|color"),
        plate("not-a-number everywhere", "exr", exr.scan_lines(24, 16, "none", struct.pack("<I", 0x7FC00000) * 24 * 3, sample=exr.FLOAT), 0),
    ]


def _kinds() -> list[Case]:
    flat = png.flat(32, 24)
    files = {"flat.png": flat}

    def depth(name: str, extension: str, content: Content, words: str = "") -> Case:
        file = f"depth.{extension}"
        return Case("depth", name, ["check", "scene.toml"], 3, rf"^error: scene\.toml:7:9: plate\.depth: .*depth\.{extension}.*({words})",
                    {**files, "scene.toml": DEPTH.format(file), file: content})

    def named(name: str, path: str, code: int = 3, words: str = "", extra: dict[str, Content] | None = None) -> Case:
        return Case("plate", name, ["check", "scene.toml"], code, rf"^error: scene\.toml:6:9: plate\.image: .*({words})", {"scene.toml": SCENE.format(path), **files, **(extra or {})})

    return [
        depth("PNG", "png", flat, "channel|depth|picture"),
        depth("cut off", "exr", exr.black(24, 16, "Z")[:200], "damaged"),
        depth("of colors only", "exr", exr.black(24, 16), "channel|depth|Z"),
        depth("garbage", "exr", bytes(range(256)) * 4, "damaged"),
        named("missing", "gone.png", words="no such file"),
        named("of an unknown kind", "flat.xyz", words="not a supported picture format", extra={"flat.xyz": flat}),
        named("without an extension", "flat", words="not a supported picture format", extra={"flat": flat}),
        named("name of 5,000 bytes", "a" * 5000 + ".png", words="cannot be read|no such"),
        named("name with NUL", "a\\u0000.png", words=""),
        named("name with a newline", "a\\nerror: b.png", words=""),
        named("empty name", "", words=""),
        named("two places for the number", "a.##.##.png", words="one place"),
        named("10,000 places of a number", "#" * 10_000 + ".png", words="cannot be read|no such|one run of up to"),
        named("100,000 places of a number", "#" * 100_000 + ".png", words=""),
        named("sequence without a frame", "gone.####.png", words="no such file"),
        named("sequence with a gap", "f.#.png", words="no such file", extra={"f.0.png": flat}),
    ]


def _lit() -> list[Case]:
    """Albedo and normals, which a plate needs to be lit."""

    def floats(value: float, names: str = "BGR", width: int = 24) -> bytes:
        return exr.scan_lines(width, 16, "none", struct.pack("<f", value) * width * len(names), names=names, sample=exr.FLOAT)

    files = {"flat.png": png.flat(24, 16), "depth.exr": floats(3.0, "Z"), "half.exr": floats(0.5)}

    def albedo(name: str, file: str, content: Content, code: int = 3, words: str = "") -> Case:
        says = rf"^error: scene\.toml:8:10: plate\.albedo: .*({words})"
        return Case("lit plate", name, ["check", "scene.toml"], code, says, {**files, "scene.toml": LIT.format(file, ""), file: content})

    def normal(name: str, file: str, content: Content, code: int = 3, words: str = "") -> Case:
        scene = LIT.format("half.exr", f'normal = "{file}"\n')
        says = rf"^error: scene\.toml:9:10: plate\.normal: .*({words})"
        return Case("lit plate", name, ["check", "scene.toml"], code, says, {**files, "scene.toml": scene, file: content})

    without_depth = LIT.format("half.exr", 'normal = "half.exr"\n').replace('depth = "depth.exr"\n', "")
    draws = Case("lit plate", "albedo and normals of no number, drawn", ["render", "scene.toml", "-o", "frame.#.png"], 0,
                 files={**files, "scene.toml": LIT.format("nan.exr", 'normal = "nan.exr"\n'), "nan.exr": floats(float("nan"))}, leaves=("frame.*.png",))
    return [
        albedo("whole", "a.exr", floats(0.5), 0),
        albedo("albedo above 1", "a.exr", floats(1.5), words="has the value 1.5 at pixel .0, 0.; allowed: 0 to 1"),
        albedo("albedo below 0", "a.exr", floats(-0.5), words="allowed: 0 to 1"),
        albedo("infinite albedo", "a.exr", floats(float("inf")), words="allowed: 0 to 1"),
        albedo("albedo of another shape", "a.exr", floats(0.5, width=16), words="allowed: 24 x 16"),
        albedo("albedo that is cut off", "a.exr", floats(0.5)[:300], words="damaged"),
        albedo("albedo that is text", "a.exr", "no picture\n" * 100, words="damaged"),
        normal("normals", "n.exr", floats(0.5, "XYZ"), 0),
        normal("normals above 1", "n.exr", floats(2.0), words="allowed: -1 to 1"),
        normal("infinite normals", "n.exr", floats(float("-inf"), "XYZ"), words="allowed: -1 to 1"),
        normal("normals of another shape", "n.exr", floats(0.5, width=16), words="allowed: 24 x 16"),
        normal("normals in a PNG", "n.png", png.flat(24, 16), words="not a supported format of normals"),
        normal("normals with two channels", "n.exr", floats(0.5, "XY"), words="layer|channel|damaged"),
        Case("lit plate", "normals without a depth", ["check", "scene.toml"], 3, r"^error: scene\.toml:7:10: plate\.albedo: .*needs a depth",
             {**files, "scene.toml": without_depth}),
        draws,
    ]


def cases() -> list[Case]:
    return _png() + _jpeg() + _exr() + _kinds() + _lit()
