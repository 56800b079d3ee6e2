"""Lamps: watts to radiance and intensity as Cycles has them."""

import math

from . import transforms
from .fields import origin, uses_nodes

# A boundary that changes nothing: lamps do not stop light.
CLEAR = "steradian_clear"
CLEAR_MATERIAL = {"type": "dielectric", "ior": 1.0}


def strength(light, report):
    """Colour times power of a lamp, with the strength of its Emission node if it has one."""
    color = [c * light.energy * 2 ** getattr(light, "exposure", 0) for c in light.color]
    if getattr(light, "use_temperature", False):
        color = [c * t for c, t in zip(color, light.temperature_color)]
    if not uses_nodes(light):
        return color
    output = next(
        (node for node in light.node_tree.nodes if node.type == "OUTPUT_LIGHT" and node.is_active_output), None
    )
    source = origin(output.inputs["Surface"]) if output else None
    emission = source.node if source else None
    if emission is None or emission.type != "EMISSION":
        report.warn(f"light {light.name}", "its nodes are left out")
        return color
    for socket in ("Color", "Strength"):
        if emission.inputs[socket].is_linked:
            report.warn(f"light {light.name}", f"what is linked to {socket} of its node {emission.name} is left out")
    factor = emission.inputs["Strength"].default_value
    return [c * n * factor for c, n in zip(color, emission.inputs["Color"].default_value)]


def flux_beam(cutoff, blend):
    """The half-angle within which a spot that falls linearly in its angle has the flux of Blender's.

    Cycles falls as a smoothstep of the cosine between the cutoff and the angle that the blend gives.
    """
    cos_cutoff = math.cos(cutoff)
    inner = cos_cutoff + (1 - cos_cutoff) * blend
    steps = 2000

    def flux(fall):
        angles = [cutoff * (i + 0.5) / steps for i in range(steps)]
        return sum(fall(angle) * math.sin(angle) for angle in angles)

    def smooth(angle):
        share = (math.cos(angle) - cos_cutoff) / max(inner - cos_cutoff, 1e-9)
        share = min(max(share, 0.0), 1.0)
        return share * share * (3 - 2 * share)

    target = flux(smooth)
    low, high = 0.0, cutoff
    for _ in range(40):
        beam = (low + high) / 2
        linear = flux(lambda angle, b=beam: min(1.0, max(0.0, (cutoff - angle) / max(cutoff - b, 1e-9))))
        low, high = (beam, high) if linear < target else (low, beam)
    return low


def convert(light_object, matrix, report):
    """A lamp as (lights, shapes) of the scene format. matrix: its matrix in the world."""
    light = light_object.data
    name = f"light {light_object.name}"
    color = strength(light, report)
    if not any(color):
        return [], []
    position = list(matrix.translation)
    down = -matrix.normalized().col[2].xyz
    if not getattr(light, "normalize", True):
        report.warn(name, "its power is taken as normalized")
    if light.type == "SUN":
        degrees = min(math.degrees(light.angle), 179)
        lamp = {"type": "directional", "direction": list(down), "irradiance": color}
        return [{**lamp, "angular_diameter_degrees": degrees}], []
    if light.type == "SPOT":
        return [_spot(light, color, position, down, name, report)], []
    if light.type == "AREA":
        return [], [_area(light_object, light, color, matrix, report)]
    intensity = [c / (4 * math.pi) for c in color]
    radius = light.shadow_soft_size
    if radius <= 0:
        return [{"type": "point", "position": position, "intensity": intensity}], []
    radiance = [i / (math.pi * radius * radius) for i in intensity]
    sphere = {"type": "sphere", "radius": radius, "transform": {"translate": position}}
    return [], [_emitter(light_object, sphere, radiance)]


def _emitter(light_object, shape, radiance):
    emission = {"radiance": radiance, "hidden": not light_object.visible_camera}
    return {**shape, "name": light_object.name, "material": CLEAR, "emission": emission}


def _spot(light, color, position, down, name, report):
    cutoff = min(light.spot_size / 2, math.pi)
    if light.shadow_soft_size > 0:
        report.warn(name, "its radius is left out: shadows of spots are sharp")
    if light.spot_blend > 0:
        report.warn(name, "its edge falls off linearly in the angle, with the same flux")
    return {
        "type": "spot",
        "position": position,
        "look_at": [p + d for p, d in zip(position, down)],
        "intensity": [c / (4 * math.pi) for c in color],
        "cutoff_angle_degrees": math.degrees(cutoff),
        "beam_angle_degrees": math.degrees(flux_beam(cutoff, light.spot_blend)),
    }


def _area(light_object, light, color, matrix, report):
    if light.spread < math.pi - 1e-3:
        report.warn(f"light {light_object.name}", "its spread is left out: it shines in all directions")
    width = light.size
    height = light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size
    x, y = (matrix.col[0].xyz * width, matrix.col[1].xyz * height)
    area = x.cross(y).length
    if light.shape in ("DISK", "ELLIPSE"):
        # The disk's normal is +z, the lamp's -z.
        placed = matrix.copy()
        for column, factor in enumerate((width / 2, -height / 2, -1)):
            placed.col[column] *= factor
        shape = {"type": "disk", "transform": transforms.step(placed)}
        area *= math.pi / 4
    else:
        corner = matrix.translation - x / 2 + y / 2
        shape = {"type": "quad", "origin": list(corner), "edge_u": list(x), "edge_v": list(-y)}
    return _emitter(light_object, shape, [c / (math.pi * area) for c in color])
