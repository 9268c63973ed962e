"""JPEG files of flat gray, with as many claimed pixels as one likes (ITU-T T.81)."""

import struct


def segment(marker: int, contents: bytes) -> bytes:
    return struct.pack(">BBH", 0xFF, marker, len(contents) + 2) + contents


QUANTIZATION = segment(0xDB, b"\0" + b"\1" * 64)


def huffman(table: int, symbols: bytes) -> bytes:
    """A table in which the first symbol has a code of one bit, and each further one of one bit more."""
    counts = bytes(1 if length < len(symbols) else 0 for length in range(16))
    return segment(0xC4, bytes([table]) + counts + symbols)


def frame(marker: int, width: int, height: int, components: int) -> bytes:
    listed = b"".join(bytes([index + 1, 0x11, 0]) for index in range(components))
    return segment(marker, struct.pack(">BHHB", 8, height, width, components) + listed)


def scan(components: int, first: int, last: int, approximation: int, data: bytes) -> bytes:
    listed = b"".join(bytes([index + 1, 0x00]) for index in range(components))
    return segment(0xDA, bytes([components]) + listed + bytes([first, last, approximation])) + data


def padded(bits: int, count: int) -> bytes:
    """`count` bits, the last byte filled with ones."""
    fill = -count % 8
    return ((bits << fill) | ((1 << fill) - 1)).to_bytes((count + fill) // 8, "big").replace(b"\xff", b"\xff\0")


def baseline(width: int, height: int, components: int = 1, blocks: int | None = None) -> bytes:
    """Gray; every block is two zero bits. `blocks` of them are there, or all."""
    if blocks is None:
        blocks = components * -(-width // 8) * -(-height // 8)
    tables = QUANTIZATION + huffman(0x00, b"\0") + huffman(0x10, b"\0")
    data = padded(0, 2 * blocks)
    return b"\xff\xd8" + tables + frame(0xC0, width, height, components) + scan(components, 0, 63, 0, data) + b"\xff\xd9"


def progressive_bomb(width: int, height: int, scans: int) -> bytes:
    """Scans that each visit all blocks of a large picture: one code says that the next 32767 are empty."""
    blocks = -(-width // 8) * -(-height // 8)
    tables = QUANTIZATION + huffman(0x00, b"\0") + huffman(0x10, b"\xe0")
    bits, count = 0, 0
    for _ in range(-(-blocks // 32767)):
        # The code of one bit, then fourteen ones: a run of 2^14 + 16383 blocks.
        bits, count = bits << 15 | 0x3FFF, count + 15
    run = padded(bits, count)
    begin = scan(1, 0, 0, 0, padded(0, blocks))
    again = scan(1, 1, 63, 0, run)
    return b"\xff\xd8" + tables + frame(0xC2, width, height, 1) + begin + again * scans + b"\xff\xd9"
