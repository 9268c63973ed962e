"""Materials as Python expressions: `Shader` wraps a node tree, each method adds a node and returns its output socket."""

import bpy


class Shader:
    """The nodes of one material. Inputs may be sockets, numbers, or tuples of linear Rec. 709 color."""

    def __init__(self, name, tree=None):
        if tree is None:
            self.material = bpy.data.materials.new(name)
            self.material.use_nodes = True
            tree = self.material.node_tree
        self.tree = tree
        tree.nodes.clear()

    def node(self, kind, inputs=None, **properties):
        node = self.tree.nodes.new(kind)
        for key, value in properties.items():
            setattr(node, key, value)
        for key, value in (inputs or {}).items():
            self.connect(node.inputs[key], value)
        return node

    def connect(self, socket, value):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        elif isinstance(value, (tuple, list)) and len(socket.default_value) == 4 and len(value) == 3:
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value

    # Coordinates and attributes

    def position(self):
        """The point in the coordinates of the object, in meters: for objects at the origin, of the world."""
        return self.node("ShaderNodeTexCoord").outputs["Object"]

    def stretched(self, vector, scale, offset=(0.0, 0.0, 0.0)):
        inputs = {"Vector": vector, "Scale": scale, "Location": offset}
        return self.node("ShaderNodeMapping", inputs).outputs[0]

    def axis(self, vector, name):
        return self.node("ShaderNodeSeparateXYZ", {0: vector}).outputs["XYZ".index(name)]

    def combine(self, x, y, z):
        return self.node("ShaderNodeCombineXYZ", {0: x, 1: y, 2: z}).outputs[0]

    def attribute(self, name):
        """A number that the mesh stores for each vertex."""
        return self.node("ShaderNodeAttribute", attribute_name=name).outputs["Fac"]

    def instance(self):
        """A random number of the instance, 0..1."""
        return self.node("ShaderNodeObjectInfo").outputs["Random"]

    def upwardness(self):
        """The z component of the normal of the surface."""
        return self.axis(self.node("ShaderNodeNewGeometry").outputs["Normal"], "Z")

    def occlusion(self, distance):
        """1 where nothing is near, toward 0 in crevices."""
        return self.node("ShaderNodeAmbientOcclusion", {"Distance": distance}, samples=2).outputs["AO"]

    # Patterns

    def noise(self, scale, detail=5.0, roughness=0.55, vector=None, distortion=0.0):
        inputs = {"Scale": scale, "Detail": detail, "Roughness": roughness, "Distortion": distortion}
        inputs["Vector"] = vector if vector is not None else self.position()
        return self.node("ShaderNodeTexNoise", inputs).outputs[0]

    def cells(self, scale, feature="F1", vector=None, randomness=1.0, output=0):
        """Voronoi cells: distances, or with `output=1` a color for each cell."""
        inputs = {"Scale": scale, "Randomness": randomness}
        inputs["Vector"] = vector if vector is not None else self.position()
        return self.node("ShaderNodeTexVoronoi", inputs, feature=feature).outputs[output]

    # Arithmetic

    def math(self, operation, a, b=0.0, clamp=False):
        return self.node("ShaderNodeMath", {0: a, 1: b}, operation=operation, use_clamp=clamp).outputs[0]

    def remap(self, value, low, high, to_low=0.0, to_high=1.0):
        """Linear from low..high to to_low..to_high, constant beyond."""
        return self.node("ShaderNodeMapRange", {0: value, 1: low, 2: high, 3: to_low, 4: to_high}).outputs[0]

    def mix(self, factor, a, b, blend="MIX"):
        node = self.node("ShaderNodeMix", {0: factor, 6: a, 7: b}, data_type="RGBA", blend_type=blend)
        return node.outputs[2]

    def ramp(self, factor, *stops):
        """A color for each factor: stops are (factor, color)."""
        node = self.node("ShaderNodeValToRGB", {0: factor})
        elements = node.color_ramp.elements
        while len(elements) < len(stops):
            elements.new(0.5)
        for element, (position, color) in zip(elements, stops):
            element.position = position
            element.color = (*color, 1.0)
        return node.outputs[0]

    def shade(self, color, factor):
        """A color times a number."""
        return self.mix(1.0, color, self.combine(factor, factor, factor), "MULTIPLY")

    def bump(self, height, distance, strength=1.0, normal=None):
        """The normal of a relief whose height 1 is `distance` meters."""
        inputs = {"Height": height, "Distance": distance, "Strength": strength}
        if normal is not None:
            inputs["Normal"] = normal
        return self.node("ShaderNodeBump", inputs).outputs[0]

    # Surfaces

    def principled(self, color, roughness=0.8, normal=None, **inputs):
        sockets = {"Base Color": color, "Roughness": roughness}
        if normal is not None:
            sockets["Normal"] = normal
        sockets.update({key.replace("_", " "): value for key, value in inputs.items()})
        return self.node("ShaderNodeBsdfPrincipled", sockets).outputs[0]

    def emission(self, color, strength):
        return self.node("ShaderNodeEmission", {"Color": color, "Strength": strength}).outputs[0]

    def blend(self, factor, a, b):
        return self.node("ShaderNodeMixShader", {0: factor, 1: a, 2: b}).outputs[0]

    def leaf(self, color, roughness=0.45, transmitted=0.4, normal=None):
        """A surface that lets part of the light through."""
        front = self.principled(color, roughness, normal)
        lit_from_behind = self.mix(1.0, color, (1.1, 1.25, 0.55), "MULTIPLY")
        back = self.node("ShaderNodeBsdfTranslucent", {"Color": lit_from_behind}).outputs[0]
        return self.blend(transmitted, front, back)

    def pane(self, tint=(0.9, 0.95, 0.93), roughness=0.01, normal=None):
        """Thin glass: reflects by Fresnel's equations, and does not refract."""
        fresnel_inputs = {"IOR": 1.5}
        glossy_inputs = {"Color": (1.0, 1.0, 1.0), "Roughness": roughness}
        if normal is not None:
            glossy_inputs["Normal"] = normal
        fresnel = self.node("ShaderNodeFresnel", fresnel_inputs).outputs[0]
        clear = self.node("ShaderNodeBsdfTransparent", {"Color": tint}).outputs[0]
        glossy = self.node("ShaderNodeBsdfGlossy", glossy_inputs).outputs[0]
        return self.blend(self.math("MULTIPLY", fresnel, 1.9, clamp=True), clear, glossy)

    def finish(self, surface):
        output = self.node("ShaderNodeOutputMaterial")
        self.tree.links.new(surface, output.inputs["Surface"])
        return self.material


def plain(name, color, roughness=0.7, **inputs):
    """A material of one color, with faint stains and wear."""
    s = Shader(name)
    stains = s.remap(s.noise(3.0, 8.0, 0.65), 0.3, 0.75, 0.72, 1.12)
    wear = s.remap(s.noise(40.0, 3.0), 0.3, 0.7, -0.08, 0.08)
    normal = s.bump(s.noise(60.0, 4.0), 0.0008)
    return s.finish(s.principled(s.shade(color, stains), s.math("ADD", wear, roughness, True), normal, **inputs))


def glow(name, color, strength):
    s = Shader(name)
    return s.finish(s.emission(color, strength))
