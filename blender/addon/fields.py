"""Values of colour and number sockets: constants, images, and images changed pixel by pixel.

Nodes that compute a colour or a number from others are evaluated with NumPy, once for constants and once for each pixel
of an image.
"""

from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
LARGEST = 1 << 26


class Unsupported(Exception):
    """A node, or a setting of one, that has no counterpart."""


@dataclass
class Field:
    """A colour at each point of a surface.

    values: (4,) for a constant, else (height, width, 4) with row 0 at the top; None for an image that is not read yet.
    image: the image that it shows unchanged. mapping: where the pixels lie, a dictionary of keys of image textures.
    channel: "a" where the alpha of `image` is meant. texture: a texture that is no image.
    """

    values: Any = None
    image: Any = None
    mapping: Any = None
    channel: Any = None
    texture: Any = None
    uv: Any = None

    @property
    def is_constant(self):
        return self.values is not None and self.values.ndim == 1

    def rgb(self):
        """The three numbers of a constant."""
        return [float(v) for v in self.values[:3]]

    def number(self):
        """A constant as one number, its luminance if it is a colour."""
        r, g, b = self.values[:3]
        return float(r) if r == g == b else float(self.values[:3] @ LUMINANCE)


def constant(value):
    """A field of one number, or of a colour."""
    values = np.ones(4, np.float32)
    values[:3] = np.asarray(value, np.float32).reshape(-1)[:3] if np.ndim(value) else value
    return Field(values)


def grey(values):
    """Numbers as colours with an alpha of 1."""
    values = np.asarray(values, np.float32)[..., None]
    return np.concatenate([values, values, values, np.ones_like(values)], axis=-1)


class Fields:
    """Evaluates sockets of the nodes of one owner, such as a material."""

    def __init__(self, images, report, owner):
        self.images, self.report, self.owner = images, report, owner

    def read(self, field):
        """A field with its values."""
        if field.texture is not None:
            raise Unsupported("a pattern cannot be changed")
        if field.values is not None:
            return field
        pixels = self.images.pixels(field.image)
        if pixels is None:
            raise Unsupported(f"the image {field.image.name} cannot be read")
        if field.channel == "a":
            pixels = grey(pixels[..., 3])
        return replace(field, values=pixels, image=None, channel=None)

    def apply(self, function, *inputs):
        """A function of arrays of shape (..., 4), pixel by pixel."""
        inputs = [self.read(field) for field in inputs]
        textured = [field for field in inputs if not field.is_constant]
        for field in textured[1:]:
            if field.mapping != textured[0].mapping or field.values.shape != textured[0].values.shape:
                raise Unsupported("images of different sizes or places cannot be combined")
        values = np.asarray(function(*(field.values for field in inputs)), np.float32)
        if not textured:
            return Field(values)
        if values[..., 0].size > LARGEST:
            raise Unsupported("the image is too large")
        return Field(
            np.broadcast_to(values, textured[0].values.shape).copy(), mapping=textured[0].mapping, uv=textured[0].uv
        )

    def socket(self, socket):
        """The field of an input socket. Nodes that have no counterpart give the socket's own value, and a warning."""
        own = constant(socket.default_value) if hasattr(socket, "default_value") else constant(0)
        source = origin(socket)
        if source is None:
            return own
        node = source.node
        function = _NODES.get(node.type)
        try:
            if function is None:
                raise Unsupported(f"nodes of type {node.bl_label} are left out")
            return function(self, node, source)
        except Unsupported as error:
            self.report.warn(self.owner, f"node {node.name}: {error}; {socket.name} has its own value")
            return own

    def named(self, node, *names):
        """The fields of a node's inputs."""
        return [self.socket(node.inputs[name]) for name in names]


def uses_nodes(owner):
    """Whether a material, world or lamp is made of nodes; from Blender 5 on, all materials and worlds are."""
    always = bpy.app.version >= (5, 0, 0) and not isinstance(owner, bpy.types.Light)
    return owner.node_tree is not None and (always or owner.use_nodes)


def origin(socket):
    """The output socket that an input is linked to, through reroutes and muted nodes; None if there is none."""
    while socket is not None and socket.is_linked and socket.links[0].is_valid:
        link = socket.links[0]
        if link.is_muted:
            return None
        source = link.from_socket
        if source.node.type == "REROUTE":
            socket = source.node.inputs[0]
        elif source.node.mute:
            links = [inner.from_socket for inner in source.node.internal_links if inner.to_socket == source]
            socket = links[0] if links else None
        else:
            return source
    return None


def _image(fields, node, source):
    if node.image is None:
        return constant((1, 0, 1))
    if node.projection != "FLAT":
        raise Unsupported(f"the projection {node.projection} is left out")
    wrap = {"REPEAT": "repeat", "EXTEND": "clamp", "MIRROR": "mirror"}.get(node.extension)
    if wrap is None:
        fields.report.warn(fields.owner, f"node {node.name}: beyond its edges the image is continued, not clipped")
    uv, mapping = _mapping(fields, node)
    mapping = {**mapping, "wrap": wrap or "clamp"}
    if node.interpolation == "Closest":
        mapping["filter"] = "nearest"
    return Field(image=node.image, mapping=mapping, uv=uv, channel="a" if source.name == "Alpha" else None)


def _mapping(fields, node):
    """Name of the UV layer (None: the active one) and keys of the texture for where an image lies."""
    source, placed = origin(node.inputs["Vector"]), {}
    if source is not None and source.node.type == "MAPPING":
        mapping = source.node
        if mapping.vector_type != "POINT" or any(
            mapping.inputs[name].is_linked for name in ("Location", "Rotation", "Scale") if name in mapping.inputs
        ):
            raise Unsupported(f"the mapping {mapping.name} is no constant one of points")
        offset, rotation, scale = (mapping.inputs[name].default_value for name in ("Location", "Rotation", "Scale"))
        if rotation[0] or rotation[1]:
            raise Unsupported(f"the mapping {mapping.name} turns out of the plane")
        degrees = float(np.degrees(rotation[2]))
        placed = {"scale": [scale[0], scale[1]], "rotation_degrees": degrees, "offset": [offset[0], offset[1]]}
        source = origin(mapping.inputs["Vector"])
        if source is None:
            raise Unsupported(f"the mapping {mapping.name} has no coordinates")
    if source is None or (source.node.type == "TEX_COORD" and source.name == "UV"):
        return None, placed
    if source.node.type == "UVMAP":
        return source.node.uv_map or None, placed
    raise Unsupported(f"coordinates of {source.node.bl_label}, {source.name}, are left out")


def _checker(fields, node, _source):
    _, placed = _mapping(fields, node)
    colors = fields.named(node, "Color1", "Color2")
    scale = fields.socket(node.inputs["Scale"])
    if placed or not all(field.is_constant for field in (*colors, scale)):
        raise Unsupported("a checker is constant and not mapped")
    # Blender's square at the origin has the second colour, and its scale counts squares.
    texture = {"type": "checker", "color0": colors[1].rgb(), "color1": colors[0].rgb(), "scale": scale.number() / 2}
    return Field(texture=texture)


def _color_attribute(_fields, node, source):
    if source.name != "Color":
        raise Unsupported(f"{source.name} of attributes is left out")
    return Field(texture={"type": "vertex_color", "layer": getattr(node, "layer_name", "")})


def _rgb(_fields, node, _source):
    return constant(node.outputs[0].default_value)


def _mix(fields, node, _source):
    kind = getattr(node, "data_type", "RGBA")
    if node.type == "MIX":
        sockets = [socket for socket in node.inputs if socket.enabled]
        if kind not in ("RGBA", "FLOAT") or getattr(node, "factor_mode", "UNIFORM") != "UNIFORM":
            raise Unsupported("only colours and numbers are mixed")
        factor, a, b = sockets[0], sockets[1], sockets[2]
        clamps = node.clamp_result if kind == "RGBA" else False
    else:
        factor, a, b = node.inputs["Fac"], node.inputs["Color1"], node.inputs["Color2"]
        clamps = node.use_clamp
    blend = getattr(node, "blend_type", "MIX") if kind == "RGBA" else "MIX"
    factor, a, b = (fields.socket(socket) for socket in (factor, a, b))
    blends = {
        "MIX": lambda x, y: y,
        "MULTIPLY": lambda x, y: x * y,
        "ADD": lambda x, y: x + y,
        "SUBTRACT": lambda x, y: x - y,
        "SCREEN": lambda x, y: 1 - (1 - x) * (1 - y),
        "DARKEN": np.minimum,
        "LIGHTEN": np.maximum,
        "DIFFERENCE": lambda x, y: np.abs(x - y),
    }
    if blend not in blends:
        raise Unsupported(f"the blending {blend} is left out")

    def mixed(t, x, y):
        # Numbers are clamped by default, and colours mixed by a number.
        t = np.clip(t[..., :1], 0, 1)
        result = (1 - t) * x + t * blends[blend](x, y)
        result[..., 3] = 1
        return np.clip(result, 0, 1) if clamps else result

    return fields.apply(mixed, factor, a, b)


def _math(fields, node, _source):
    functions = {
        "ADD": np.add,
        "SUBTRACT": np.subtract,
        "MULTIPLY": np.multiply,
        "DIVIDE": lambda x, y: np.divide(x, y, out=np.zeros_like(x + y), where=y != 0),
        "POWER": lambda x, y: np.power(np.maximum(x, 0), y),
        "MINIMUM": np.minimum,
        "MAXIMUM": np.maximum,
        "GREATER_THAN": lambda x, y: np.float32(x > y),
        "LESS_THAN": lambda x, y: np.float32(x < y),
    }
    singles = {"SQRT": lambda x: np.sqrt(np.maximum(x, 0)), "ABSOLUTE": np.abs}
    if node.operation not in functions and node.operation not in singles:
        raise Unsupported(f"the operation {node.operation} is left out")
    inputs = [fields.socket(socket) for socket in node.inputs if socket.enabled]

    def computed(*values):
        numbers = [
            value[..., :3] @ LUMINANCE if (value[..., :1] != value[..., :3]).any() else value[..., 0]
            for value in values
        ]
        if node.operation in singles:
            result = singles[node.operation](numbers[0])
        else:
            result = functions[node.operation](*numbers[:2])
        return grey(np.clip(result, 0, 1) if node.use_clamp else result)

    return fields.apply(computed, *inputs[: 1 if node.operation in singles else 2])


def _invert(fields, node, _source):
    factor = "Fac" if "Fac" in node.inputs else "Factor"

    def inverted(t, x):
        t = np.clip(t[..., :1], 0, 1)
        return np.concatenate([(1 - t) * x[..., :3] + t * (1 - x[..., :3]), x[..., 3:]], axis=-1)

    return fields.apply(inverted, *fields.named(node, factor, "Color"))


def _gamma(fields, node, _source):
    def powers(x, gamma):
        return np.concatenate([np.maximum(x[..., :3], 0) ** gamma[..., :1], np.ones_like(x[..., :1])], axis=-1)

    return fields.apply(powers, *fields.named(node, "Color", "Gamma"))


def _bright_contrast(fields, node, _source):
    def changed(x, bright, contrast):
        a, b = 1 + contrast[..., :1], bright[..., :1] - contrast[..., :1] * 0.5
        return np.concatenate([np.maximum(a * x[..., :3] + b, 0), np.ones_like(x[..., :1])], axis=-1)

    return fields.apply(changed, *fields.named(node, "Color", "Bright", "Contrast"))


def _ramp(fields, node, source):
    table = np.array([node.color_ramp.evaluate(i / 4095) for i in range(4096)], np.float32)

    def looked_up(x):
        position = np.clip(x[..., :3] @ LUMINANCE, 0, 1) * 4095
        colors = table[np.round(position).astype(np.int32)]
        return grey(colors[..., 3]) if source.name == "Alpha" else colors

    return fields.apply(looked_up, *fields.named(node, "Fac" if "Fac" in node.inputs else "Factor"))


def _separate(fields, node, source):
    if getattr(node, "mode", "RGB") != "RGB":
        raise Unsupported(f"the mode {node.mode} is left out")
    index = [socket.name for socket in node.outputs].index(source.name)
    return fields.apply(lambda x: grey(x[..., index]), fields.socket(node.inputs[0]))


def _combine(fields, node, _source):
    if getattr(node, "mode", "RGB") != "RGB":
        raise Unsupported(f"the mode {node.mode} is left out")

    def combined(r, g, b):
        shape = np.broadcast_shapes(r.shape, g.shape, b.shape)
        result = np.ones(shape, np.float32)
        result[..., 0], result[..., 1], result[..., 2] = r[..., 0], g[..., 0], b[..., 0]
        return result

    return fields.apply(combined, *(fields.socket(socket) for socket in node.inputs[:3]))


def _to_grey(fields, node, _source):
    return fields.apply(lambda x: grey(x[..., :3] @ LUMINANCE), *fields.named(node, "Color"))


def _map_range(fields, node, _source):
    if node.data_type != "FLOAT" or node.interpolation_type != "LINEAR":
        raise Unsupported("only linear ranges of numbers are mapped")
    names = ("Value", "From Min", "From Max", "To Min", "To Max")

    def mapped(x, a, b, c, d):
        x, a, b, c, d = (value[..., 0] for value in (x, a, b, c, d))
        share = np.divide(x - a, b - a, out=np.zeros_like(x + a), where=(b - a) != 0)
        return grey(c + (np.clip(share, 0, 1) if node.clamp else share) * (d - c))

    return fields.apply(mapped, *fields.named(node, *names))


def _clamp(fields, node, _source):
    def clamped(x, low, high):
        return grey(np.clip(x[..., 0], low[..., 0], high[..., 0]))

    return fields.apply(clamped, *fields.named(node, "Value", "Min", "Max"))


_NODES = {
    "TEX_IMAGE": _image,
    "TEX_CHECKER": _checker,
    "VERTEX_COLOR": _color_attribute,
    "RGB": _rgb,
    "VALUE": _rgb,
    "MIX": _mix,
    "MIX_RGB": _mix,
    "MATH": _math,
    "INVERT": _invert,
    "GAMMA": _gamma,
    "BRIGHTCONTRAST": _bright_contrast,
    "VALTORGB": _ramp,
    "SEPARATE_COLOR": _separate,
    "SEPRGB": _separate,
    "COMBINE_COLOR": _combine,
    "COMBRGB": _combine,
    "RGBTOBW": _to_grey,
    "MAP_RANGE": _map_range,
    "CLAMP": _clamp,
}
