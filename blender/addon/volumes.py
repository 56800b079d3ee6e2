"""Volume objects as boxes filled with a medium of their OpenVDB file."""

from . import transforms
from .fields import constant, origin, uses_nodes

SHADERS = {"PRINCIPLED_VOLUME", "VOLUME_SCATTER", "VOLUME_ABSORPTION"}


class Volumes:
    """Media, materials and shapes of volume objects."""

    def __init__(self, report):
        self.media, self.materials, self.shapes = {}, {}, []
        self._report = report

    def add(self, owner, matrix, name):
        """An evaluated volume object. matrix: its matrix in the world."""
        medium = self._medium(owner, matrix)
        if medium is None:
            return
        key = name
        while key in self.media:
            key += "_"
        self.media[key] = medium
        self.materials[f"{key} (volume)"] = {"type": "dielectric", "ior": 1, "medium": key}
        lows, highs = ([f(c[axis] for c in owner.bound_box) for axis in range(3)] for f in (min, max))
        sizes = [max((high - low) / 2, 1e-6) for low, high in zip(lows, highs)]
        box = [{"scale": sizes}, {"translate": [(low + high) / 2 for low, high in zip(lows, highs)]}]
        transform = [*box, transforms.step(matrix)]
        self.shapes.append({"type": "cube", "name": name, "material": f"{key} (volume)", "transform": transform})

    def _medium(self, owner, matrix):
        about = f"object {owner.name}"
        grids = owner.data.grids
        if not grids.load() or not grids.frame_filepath:
            self._report.warn(about, f"its volume cannot be read and is left out: {grids.error_message or 'no file'}")
            return None
        shader = self._shader(owner, about)
        if shader is None:
            return None
        scale = 1.0
        if owner.data.render.space == "OBJECT":
            # The object's own unit, as the world has it.
            scale = abs(matrix.to_3x3().determinant()) ** (1 / 3)
        file = {"type": "grid", "file": grids.frame_filepath}
        medium = _Medium(shader, {grid.name for grid in grids}, file, self._report, about).convert(max(scale, 1e-9))
        if "volume" in medium:
            medium["volume"]["transform"] = transforms.step(matrix)
        return medium

    def _shader(self, owner, about):
        slots = owner.material_slots
        material = slots[0].material if len(slots) else None
        tree = material.node_tree if material and uses_nodes(material) else None
        output = tree and (tree.get_output_node("CYCLES") or tree.get_output_node("ALL"))
        source = origin(output.inputs["Volume"]) if output else None
        if source is None or source.node.type not in SHADERS:
            what = f"its volume shader {source.node.bl_label}" if source else "it has no volume shader and"
            self._report.warn(about, f"{what} is left out")
            return None
        return source.node


class _Medium:
    """The medium of one shader node."""

    def __init__(self, node, grids, file, report, about):
        self._node, self._grids, self._file = node, grids, file
        self._report, self._about = report, about

    def convert(self, scale):
        """The medium, with the length of the object's unit in the world."""
        node = self._node
        density, grid = self._factor("Density")
        color = [min(max(c, 0.0), 1.0) for c in self._value("Color").rgb()]
        scattering, absorption, volume = [0.0] * 3, [0.0] * 3, {}
        if node.type == "VOLUME_ABSORPTION":
            absorption = [1 - c for c in color]
        else:
            scattering = color
        if node.type == "PRINCIPLED_VOLUME":
            # As in Cycles: what is not scattered is absorbed, but for the root of the absorption colour.
            tint = [min(max(c, 0.0), 1.0) ** 0.5 for c in self._value("Absorption Color").rgb()]
            absorption = [(1 - c) * (1 - t) for c, t in zip(color, tint)]
            grid = node.inputs["Density Attribute"].default_value or grid
        if grid in self._grids:
            volume = {key: {**self._file, "grid": grid} for key in ("scattering", "absorption")}
        elif node.type == "PRINCIPLED_VOLUME" and grid:
            self._warn(f"its file has no grid {grid}: it is empty")
            density = 0.0
        medium = {
            "scattering": [c * density / scale for c in scattering],
            "absorption": [c * density / scale for c in absorption],
        }
        if "Anisotropy" in node.inputs and node.type != "VOLUME_ABSORPTION":
            g = min(max(self._value("Anisotropy").number(), -0.99), 0.99)
            medium["phase"] = {"type": "henyey_greenstein", "g": g}
        if getattr(node, "phase", "HENYEY_GREENSTEIN") not in ("HENYEY_GREENSTEIN", "RAYLEIGH"):
            self._warn(f"the phase function {node.phase} is rendered as Henyey and Greenstein's")
        if getattr(node, "phase", "") == "RAYLEIGH":
            medium["phase"] = {"type": "rayleigh"}
        if node.type == "PRINCIPLED_VOLUME":
            self._emit(medium, volume, scale)
        return {**medium, "volume": volume} if volume else medium

    def _emit(self, medium, volume, scale):
        node = self._node
        strength, glow = self._value("Emission Strength").number(), self._value("Blackbody Intensity").number()
        color = self._value("Emission Color").rgb()
        heat, grid = self._value("Temperature").number(), node.inputs["Temperature Attribute"].default_value
        if strength > 0 and any(color) and glow > 0:
            self._warn("of its emission and its black body only the latter shines")
        if glow > 0 and heat > 0 and grid in self._grids:
            medium["emission"] = [max(c, 0.0) * glow / scale for c in self._value("Blackbody Tint").rgb()]
            volume["temperature"], volume["temperature_scale"] = {**self._file, "grid": grid}, heat
        elif glow > 0:
            self._warn("its black body is left out: its file has no grid of temperatures")
        elif strength > 0:
            medium["emission"] = [max(c, 0.0) * strength / scale for c in color]

    def _factor(self, name):
        """The number of a socket, and the grid that it is read from or multiplied with."""
        socket = self._node.inputs[name]
        source = origin(socket)
        if source is None:
            return max(float(socket.default_value), 0.0), None
        node = source.node
        if node.type == "MATH" and node.operation == "MULTIPLY":
            for number, other in ((0, 1), (1, 0)):
                grid = self._grid(origin(node.inputs[other]))
                if grid and origin(node.inputs[number]) is None:
                    return max(float(node.inputs[number].default_value), 0.0), grid
        grid = self._grid(source)
        if grid is None:
            self._warn(f"what is linked to {name} is left out")
            return max(float(socket.default_value), 0.0), None
        return 1.0, grid

    def _grid(self, source):
        """The grid that an output shows."""
        if source is None:
            return None
        if source.node.type == "ATTRIBUTE":
            return source.node.attribute_name
        return source.name.lower() if source.node.type == "VOLUME_INFO" else None

    def _value(self, name):
        socket = self._node.inputs[name]
        if socket.is_linked:
            self._warn(f"what is linked to {name} is left out")
        return constant(socket.default_value)

    def _warn(self, message):
        self._report.warn(self._about, f"node {self._node.name}: {message}")
