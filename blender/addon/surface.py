"""What shaders and materials mean for shapes."""

from dataclasses import dataclass, field
from typing import Any


@dataclass
class Surface:
    """What a shader means for a shape.

    material: the name of a material; None scatters nothing. emission: (colour field, factor) or None. opacity: a field,
    or None for 1. relief: the keys of a relief material, or None.
    """

    material: Any = None
    emission: Any = None
    opacity: Any = None
    relief: Any = None


@dataclass
class Look:
    """What shapes of one material have: keys of the shape, and layers of the mesh that textures take."""

    keys: dict = field(default_factory=dict)
    uv: Any = None
    color: Any = None
    needs_uv: bool = False
