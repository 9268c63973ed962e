"""Opens a multilayer EXR file in Blender's compositor and prints what each pass holds, a fact a line.

Usage: bpy_reads.py FILE WIDTH HEIGHT [LAYER...]
"""

import os
import sys
import tempfile

import bpy
import numpy

file, width, height, layers = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4:]

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_mode = "RGBA"
scene.render.image_settings.color_depth = "32"
# Nothing is drawn, but nothing is composited without a camera either.
scene.camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(scene.camera)

image = bpy.data.images.load(file)
print(f"fact type = {image.type}")
print(f"fact color space = {image.colorspace_settings.name}")

tree = bpy.data.node_groups.new("compositing", "CompositorNodeTree")
tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
scene.compositing_node_group = tree
output = tree.nodes.new("NodeGroupOutput")


def composited(socket):
    """The pixels that a pass gives the compositor, top row first."""
    tree.links.new(socket, output.inputs[0])
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = os.path.join(folder, "pass.exr")
        bpy.ops.render.render(write_still=True)
        written = bpy.data.images.load(scene.render.filepath)
        pixels = numpy.array(written.pixels[:], dtype=numpy.float64)
        bpy.data.images.remove(written)
    return pixels.reshape(height, width, 4)[::-1]


# The node begins with the layer without a name, that of the picture itself.
for layer in [None, *layers]:
    node = tree.nodes.new("CompositorNodeImage")
    node.image = image
    if layer is not None:
        node.layer = layer
    for socket in node.outputs:
        pixels = composited(socket).reshape(-1, 4)
        # One number for each component that every pixel and its place take part in.
        weights = numpy.arange(1, len(pixels) + 1, dtype=numpy.float64)[:, numpy.newaxis]
        sums = (numpy.where(numpy.isfinite(pixels), pixels, 0.0) * weights).sum(axis=0)
        infinite = int(numpy.isinf(pixels[:, 0]).sum())
        place = socket.name if layer is None else f"{layer}/{socket.name}"
        print(f"pass {place} = {socket.type} {infinite} " + " ".join(repr(float(value)) for value in sums))
    tree.nodes.remove(node)
