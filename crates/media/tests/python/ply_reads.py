"""Opens a PLY file with the package plyfile and prints its particles, one a line.

Usage: ply_reads.py FILE
"""

import sys

import plyfile

vertices = plyfile.PlyData.read(sys.argv[1])["vertex"]
names = [prop.name for prop in vertices.properties]
print(" ".join(names))
for vertex in vertices.data:
    print(" ".join(repr(float(vertex[name])) for name in names))
