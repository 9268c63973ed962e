"""Opens an EXR file with OpenEXR's own package and prints what it found, a fact a line.

Usage: openexr_reads.py FILE
"""

import sys

import numpy
import OpenEXR

with OpenEXR.File(sys.argv[1], separate_channels=True) as file:
    header = file.header()
    for name in sorted(header):
        if name != "channels":
            value = header[name]
            if isinstance(value, numpy.ndarray):
                value = [float(x) for x in value.flatten()]
            print(f"{name} = {value}")
    for name, channel in sorted(file.channels().items()):
        pixels = channel.pixels
        # One number that every pixel and its place take part in.
        weights = numpy.arange(1, pixels.size + 1, dtype=numpy.float64).reshape(pixels.shape)
        finite = numpy.where(numpy.isfinite(pixels), pixels.astype(numpy.float64), 0.0)
        print(f"channel {name} {pixels.dtype} {pixels.shape[1]}x{pixels.shape[0]} {float((finite * weights).sum())!r}")
