"""PNG files, right and wrong, chunk by chunk (PNG specification, third edition)."""

import struct
import zlib

SIGNATURE = b"\x89PNG\r\n\x1a\n"
GREY, RGB, PALETTE, RGBA = 0, 2, 3, 6
CHANNELS = {GREY: 1, RGB: 3, PALETTE: 1, RGBA: 4}
END = struct.pack(">I4sI", 0, b"IEND", zlib.crc32(b"IEND"))


def chunk(kind: bytes, contents: bytes) -> bytes:
    return struct.pack(">I", len(contents)) + kind + contents + struct.pack(">I", zlib.crc32(contents, zlib.crc32(kind)))


def header(width: int, height: int, bits: int = 8, color: int = RGB, interlace: int = 0) -> bytes:
    return chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, color, 0, 0, interlace))


def zeros_deflated(count: int) -> bytes:
    """So many zeros as a zlib stream, without compressing more than a few of them."""
    block_bytes = 1 << 20
    compressor = zlib.compressobj(9)
    head = compressor.compress(bytes(block_bytes)) + compressor.flush(zlib.Z_FULL_FLUSH)
    block = compressor.compress(bytes(block_bytes)) + compressor.flush(zlib.Z_FULL_FLUSH)
    if count < block_bytes:
        return zlib.compress(bytes(count), 9)
    rest = zlib.compressobj(9, zlib.DEFLATED, -15)
    tail = rest.compress(bytes(count % block_bytes)) + rest.flush()
    adler = (count % 65521) << 16 | 1
    return head + block * (count // block_bytes - 1) + tail + struct.pack(">I", adler)


def flat(width: int, height: int, bits: int = 8, color: int = RGB, extra: bytes = b"", interlace: int = 0) -> bytes:
    """A whole black picture, with chunks of `extra` before its pixels."""
    row = 1 + (width * bits * CHANNELS[color] + 7) // 8
    pixels = zeros_deflated(row * height) if not interlace else zlib.compress(bytes(row * height * 2))
    return SIGNATURE + header(width, height, bits, color, interlace) + extra + chunk(b"IDAT", pixels) + END


def gradient(side: int = 24) -> bytes:
    """A small picture whose pixels do not compress to nothing, so that it can be cut at many places."""
    rows = b"".join(b"\0" + bytes((x * 37 + y * 91 + x * y * c) % 256 for x in range(side) for c in (1, 2, 3)) for y in range(side))
    return SIGNATURE + header(side, side) + chunk(b"IDAT", zlib.compress(rows)) + END


def with_pixels(width: int, height: int, contents: bytes, bits: int = 8, color: int = RGB) -> bytes:
    """A picture whose IDAT holds whatever is given."""
    return SIGNATURE + header(width, height, bits, color) + chunk(b"IDAT", contents) + END
