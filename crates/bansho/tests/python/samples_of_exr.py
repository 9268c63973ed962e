"""Reads all EXR files of a folder with OpenEXR's own package and writes beside each, to FILE.CHANNEL, the numbers of every channel, low
byte first.

Usage: samples_of_exr.py FOLDER
"""

import pathlib
import sys

import OpenEXR

for path in sorted(pathlib.Path(sys.argv[1]).glob("*.exr")):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        for name, channel in file.channels().items():
            pixels = channel.pixels
            pathlib.Path(f"{path}.{name}").write_bytes(pixels.astype(pixels.dtype.newbyteorder("<")).tobytes())
