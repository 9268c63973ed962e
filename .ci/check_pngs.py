#!/usr/bin/env python3
"""Fails unless a folder holds exactly so many whole PNG files that decode and are not all empty.

An independent reader: it checks every chunk's checksum and inflates every picture. Usage: check_pngs.py DIR COUNT
"""

import struct
import sys
import zlib
from pathlib import Path

CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}


def chunks(data):
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError("no PNG signature")
    at = 8
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        (checksum,) = struct.unpack(">I", data[at + 8 + length:at + 12 + length])
        if checksum != zlib.crc32(kind + body):
            raise ValueError(f"chunk {kind} is damaged")
        yield kind, body
        at += 12 + length
    if kind != b"IEND":
        raise ValueError("no end")


def decode(path):
    """Whether any byte of the inflated picture is not zero."""
    found = list(chunks(path.read_bytes()))
    width, height, bits, color = struct.unpack(">IIBB", found[0][1][:10])
    pixels = zlib.decompress(b"".join(body for kind, body in found if kind == b"IDAT"))
    row = 1 + (width * CHANNELS[color] * bits + 7) // 8
    if len(pixels) != row * height:
        raise ValueError(f"{len(pixels)} bytes of pixels, expected {row * height}")
    return any(pixels)


def main():
    folder, count = Path(sys.argv[1]), int(sys.argv[2])
    paths = sorted(folder.iterdir())
    if len(paths) != count or any(path.suffix != ".png" for path in paths):
        print(f"FAIL  {folder} holds {len(paths)} files, expected {count} PNG files")
        return 1
    for path in paths:
        try:
            if not decode(path):
                raise ValueError("empty")
        except (ValueError, KeyError, struct.error, zlib.error) as fault:
            print(f"FAIL  {path.name}: {fault}")
            return 1
    print(f"ok    {count} PNG files decode")
    return 0


if __name__ == "__main__":
    sys.exit(main())
