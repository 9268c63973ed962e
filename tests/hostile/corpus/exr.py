"""OpenEXR files, right and wrong, attribute by attribute (OpenEXR File Layout)."""

import struct
import zlib

MAGIC = b"v/1\x01"
TILED, LONG_NAMES, DEEP, PARTS = 0x200, 0x400, 0x800, 0x1000
HALF, FLOAT = 1, 2
COMPRESSIONS = ["none", "rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"]
LINES = {"none": 1, "rle": 1, "zips": 1, "zip": 16, "piz": 32, "pxr24": 16, "b44": 32, "b44a": 32, "dwaa": 32, "dwab": 256}


def attribute(name: bytes, kind: bytes, value: bytes) -> bytes:
    return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value


def channel(name: bytes, sample: int = HALF, sampling: tuple[int, int] = (1, 1)) -> bytes:
    return name + b"\0" + struct.pack("<iBxxxii", sample, 0, *sampling)


def channels(names: str = "BGR", sample: int = HALF) -> bytes:
    return b"".join(channel(name.encode(), sample) for name in names) + b"\0"


def attributes(width: int, height: int, compression: int = 0, channel_list: bytes | None = None, window: bytes | None = None,
               more: bytes = b"") -> bytes:
    """What every part needs, without the zero that ends it."""
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1) if window is None else window
    return (
        attribute(b"channels", b"chlist", channels() if channel_list is None else channel_list)
        + attribute(b"compression", b"compression", bytes([compression]))
        + attribute(b"dataWindow", b"box2i", window)
        + attribute(b"displayWindow", b"box2i", window)
        + attribute(b"lineOrder", b"lineOrder", b"\0")
        + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1.0))
        + attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0.0, 0.0))
        + attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1.0))
        + more
    )


def version(flags: int = 0) -> bytes:
    return MAGIC + struct.pack("<I", 2 | flags)


def scan_lines(width: int, height: int, compression: str, block: bytes, count: int | None = None, names: str = "BGR",
               sample: int = HALF) -> bytes:
    """A file whose every block of lines holds the bytes of `block`."""
    head = version() + attributes(width, height, COMPRESSIONS.index(compression), channels(names, sample)) + b"\0"
    lines = LINES[compression]
    blocks = -(-height // lines) if count is None else count
    start, each = len(head) + 8 * blocks, 8 + len(block)
    table = b"".join(struct.pack("<Q", start + index * each) for index in range(blocks))
    return head + table + b"".join(struct.pack("<ii", index * lines, len(block)) + block for index in range(blocks))


def black(width: int, height: int, names: str = "BGR", sample: int = HALF) -> bytes:
    """A whole black picture, not compressed."""
    return scan_lines(width, height, "none", bytes(width * len(names) * 2 * sample), names=names, sample=sample)


def zip_bomb(width: int, height: int, names: str = "ABGR") -> bytes:
    """A whole black picture of half floats in very few bytes. Zeros are, after the format's predictor, a zero and then 128s."""
    length = 16 * width * len(names) * 2
    return scan_lines(width, height, "zip", zlib.compress(b"\0" + b"\x80" * (length - 1), 9), names=names)
