"""Reads all PNG, APNG and GIF files of a folder and writes beside each, to FILE.samples, the samples of all its frames as 16-bit numbers,
low byte first. By Pillow; files of 16 bits, of which Pillow keeps 8, chunk by chunk as the PNG specification says.

Usage: samples_of_pictures.py FOLDER
"""

import pathlib
import struct
import sys
import zlib

from PIL import Image, ImageSequence

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def chunks(data):
    assert data[:8] == SIGNATURE
    at = 8
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        contents = data[at + 8 : at + 8 + length]
        (sum_of_chunk,) = struct.unpack(">I", data[at + 8 + length : at + 12 + length])
        assert zlib.crc32(kind + contents) == sum_of_chunk, kind
        yield kind, contents
        at += 12 + length


def paeth(left, above, corner):
    guess = left + above - corner
    return min((abs(guess - left), 0, left), (abs(guess - above), 1, above), (abs(guess - corner), 2, corner))[2]


def lines(packed, height, length, step):
    """Undoes the filters of section 9."""
    raw = zlib.decompress(packed)
    before = bytes(length)
    for row in range(height):
        kind, *line = raw[row * (length + 1) : (row + 1) * (length + 1)]
        for i in range(length):
            left = line[i - step] if i >= step else 0
            corner = before[i - step] if i >= step else 0
            guess = (0, left, before[i], (left + before[i]) // 2, paeth(left, before[i], corner))[kind]
            line[i] = (line[i] + guess) & 255
        before = bytes(line)
        yield before


def sixteen(data):
    """The samples of all frames; nothing for a file of 8 bits."""
    frames = []
    for kind, contents in chunks(data):
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack(">IIBB", contents[:10])
            if depth != 16:
                return None
            channels = {2: 3, 6: 4}[color]
        elif kind == b"fcTL" and (not frames or frames[-1]):
            frames.append(b"")
        elif kind == b"IDAT":
            frames = frames or [b""]
            frames[-1] += contents
        elif kind == b"fdAT":
            frames[-1] += contents[4:]
    samples = b"".join(b"".join(lines(frame, height, 2 * channels * width, 2 * channels)) for frame in frames)
    return struct.unpack(f">{len(samples) // 2}H", samples)


def by_pillow(path):
    samples = []
    with Image.open(path) as image:
        for frame in ImageSequence.Iterator(image):
            wanted = "RGBA" if path.suffix == ".gif" else frame.mode
            assert wanted in ("RGB", "RGBA"), wanted
            samples += frame.convert(wanted).tobytes()
    return samples


for path in sorted(pathlib.Path(sys.argv[1]).iterdir()):
    samples = None if path.suffix == ".gif" else sixteen(path.read_bytes())
    if samples is None:
        samples = by_pillow(path)
    pathlib.Path(f"{path}.samples").write_bytes(struct.pack(f"<{len(samples)}H", *samples))
