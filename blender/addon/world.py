"""The world as an environment light."""

import math

from mathutils import Euler, Matrix

from . import transforms
from .fields import Fields, Unsupported, constant, origin, uses_nodes

# Steradian's axes of an image (x, y up, -z in its middle) as those of Blender (middle +x, up +z).
AXES = Matrix(((0, 0, -1, 0), (-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1)))


def convert(world, images, report):
    """The environment light of a world; None if it is black."""
    if world is None:
        return None
    about = f"world {world.name}"
    if not uses_nodes(world):
        return _constant(list(world.color))
    output = world.node_tree.get_output_node("CYCLES") or world.node_tree.get_output_node("ALL")
    if output is None:
        return None
    if output.inputs["Volume"].is_linked:
        report.warn(about, "its volume is left out")
    source = origin(output.inputs["Surface"])
    if source is None:
        return None
    node = source.node
    if node.type != "BACKGROUND":
        report.warn(about, f"node {node.name}: shaders of type {node.bl_label} are left out")
        return None
    fields = Fields(images, report, about)
    strength = fields.socket(node.inputs["Strength"])
    if not strength.is_constant:
        report.warn(about, f"node {node.name}: its strength has no texture")
        strength = constant(node.inputs["Strength"].default_value)
    image = origin(node.inputs["Color"])
    if image is not None and image.node.type == "TEX_ENVIRONMENT":
        return _image(image.node, strength.number(), images, report, about)
    color = fields.socket(node.inputs["Color"])
    if not color.is_constant:
        report.warn(about, f"node {node.name}: only environment textures and constant colours are shown")
        color = constant(node.inputs["Color"].default_value)
    return _constant([c * strength.number() for c in color.rgb()])


def _constant(color):
    color = [max(c, 0.0) for c in color]
    return {"type": "environment", "radiance": color} if any(color) else None


def _image(node, strength, images, report, about):
    if node.image is None or strength <= 0:
        return None
    if node.projection != "EQUIRECTANGULAR":
        report.warn(about, f"node {node.name}: the projection {node.projection} is left out")
        return None
    file = images.file(node.image, ("HDR", "OPEN_EXR"))
    if file is None:
        return None
    try:
        turn = _rotation(node)
    except Unsupported as error:
        report.warn(about, f"node {node.name}: {error}")
        turn = Matrix.Identity(4)
    # The mapping turns the direction that is looked up, so the image turns the other way.
    turned = transforms.rigid(turn.inverted() @ AXES)
    return {"type": "environment", "file": file, "scale": strength, "transform": turned}


def _rotation(node):
    source = origin(node.inputs["Vector"])
    turn = Matrix.Identity(4)
    if source is not None and source.node.type == "MAPPING":
        mapping = source.node
        names = ("Location", "Rotation", "Scale")
        location, rotation, scale = (mapping.inputs[name].default_value for name in names)
        linked = any(mapping.inputs[name].is_linked for name in names)
        if linked or any(location) or any(not math.isclose(s, 1) for s in scale) or mapping.vector_type != "POINT":
            raise Unsupported(f"the mapping {mapping.name} is left out: it is no constant rotation")
        turn = Euler(rotation, "XYZ").to_matrix().to_4x4()
        source = origin(mapping.inputs["Vector"])
    if source is not None and not (source.node.type == "TEX_COORD" and source.name in ("Generated", "Object")):
        raise Unsupported(f"coordinates of {source.node.bl_label}, {source.name}, are left out")
    return turn
