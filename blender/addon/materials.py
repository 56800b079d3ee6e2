"""Shader nodes as materials, emission and opacity."""

import math
from dataclasses import replace

import numpy as np

from .fields import LUMINANCE, Field, Fields, Unsupported, constant, grey, origin, uses_nodes
from .surface import Look, Surface

# What Blender has where no material is.
DIFFUSE = {"type": "diffuse", "albedo": 0.8}
BLACK = {"type": "diffuse", "albedo": 0.0}


class Materials:
    """The materials and textures of a scene, in its format."""

    def __init__(self, images, report):
        self.materials, self.textures = {}, {}
        self._images, self._report = images, report
        self._looks = {}

    def look(self, material):
        """The look of a material of Blender; None: no material."""
        key = material.name_full if material else None
        if key not in self._looks:
            self._looks[key] = _Translation(self, self._images, self._report, material).look()
        return self._looks[key]

    def texture(self, texture, name):
        """The name of a texture with this description."""
        for known, description in self.textures.items():
            if description == texture:
                return known
        number = len(self.textures)
        self.textures[f"{name} {number}"] = texture
        return f"{name} {number}"


class _Translation:
    """One material on its way."""

    def __init__(self, owner, images, report, material):
        self._owner, self._images, self._report = owner, images, report
        self._material = material
        self._name = material.name_full if material else "(no material)"
        self._about = f"material {self._name}"
        self._fields = Fields(images, report, self._about)
        self._look = Look()
        self._count = 0

    def look(self):
        if self._material is None:
            self._owner.materials[self._name] = dict(DIFFUSE)
            self._look.keys["material"] = self._name
            return self._look
        surface = self._surface()
        keys = self._look.keys
        keys["material"] = self._finish(surface)
        emission = self._emission(surface)
        if emission is not None:
            keys["emission"] = emission
        opacity = self._opacity(surface)
        if opacity is not None and emission is None:
            keys["opacity"] = opacity
        elif opacity is not None:
            self._warn("what emits light is opaque")
        return self._look

    def _warn(self, message):
        self._report.warn(self._about, message)

    def _surface(self):
        material = self._material
        tree = material.node_tree if uses_nodes(material) else None
        if tree is None:
            return Surface(self._add(self._plain(material)))
        output = tree.get_output_node("CYCLES") or tree.get_output_node("ALL")
        if output is None:
            return Surface()
        for name in ("Volume", "Displacement"):
            if output.inputs[name].is_linked:
                self._warn(f"node {output.name}: what is linked to {name} is left out")
        return self._shader(output.inputs["Surface"])

    def _plain(self, material):
        color = list(material.diffuse_color)[:3]
        return {
            "type": "principled",
            "base_color": color,
            "roughness": material.roughness,
            "metallic": material.metallic,
        }

    def _finish(self, surface):
        """The material under the material's own name, so that mattes show it."""
        named = self._owner.materials.pop(surface.material) if surface.material else dict(BLACK)
        if surface.relief is not None:
            named = {"type": "relief", "material": self._add(named), **surface.relief}
        self._owner.materials[self._name] = named
        return self._name

    def _add(self, description):
        self._count += 1
        name = f"{self._name} part {self._count}"
        self._owner.materials[name] = description
        return name

    # Values.

    def _texture(self, value):
        """The name of the texture of a field that is no constant."""
        self._layer("uv", value.uv)
        if value.texture is not None:
            texture = dict(value.texture)
            if texture["type"] == "vertex_color":
                self._layer("color", texture.pop("layer") or None)
            else:
                self._look.needs_uv = True
            return self._owner.texture(texture, self._name)
        self._look.needs_uv = True
        texture = {"type": "image", **(value.mapping or {})}
        if value.image is not None:
            file = self._images.file(value.image)
            if file is None:
                return None
            texture["file"] = file
            if not file.lower().endswith((".exr", ".hdr")):
                texture["color_space"] = "linear" if self._images.is_linear(value.image) else "srgb"
        else:
            texture["file"] = self._images.write(self._name, value.values)
        if value.channel:
            texture["channel"] = value.channel
        return self._owner.texture(texture, self._name)

    def _layer(self, name, value):
        known = getattr(self._look, name)
        if value is not None and known not in (None, value):
            self._warn(f"of the layers {known} and {value} only the first is used")
        elif value is not None:
            setattr(self._look, name, value)

    def _color(self, value, largest=1.0):
        if value.is_constant:
            rgb = value.rgb()
            if not all(0 <= c <= largest for c in rgb):
                self._warn(f"the colour {[round(c, 3) for c in rgb]} is limited to 0 to {largest:g}")
            return [min(max(c, 0.0), largest) for c in rgb]
        name = self._texture(value)
        return 0.0 if name is None else {"texture": name}

    def _scalar(self, value):
        if value.is_constant:
            return min(max(value.number(), 0.0), 1.0)
        name = self._texture(value)
        return 0.0 if name is None else {"texture": name}

    def _constant(self, node, name):
        """A number that cannot be a texture here."""
        socket = node.inputs.get(name)
        if socket is None:
            return None
        value = self._fields.socket(socket)
        if value.is_constant:
            return value.number()
        self._warn(f"node {node.name}: {name} has no texture here, but its own value")
        return constant(socket.default_value).number()

    # Shaders.

    def _shader(self, socket):
        source = origin(socket)
        if source is None:
            return Surface()
        node = source.node
        function = _SHADERS.get(node.type)
        if function is None:
            self._warn(f"node {node.name}: shaders of type {node.bl_label} are left out, as diffuse grey")
            return Surface(self._add(dict(DIFFUSE)))
        return function(self, node)

    def _relief(self, node):
        """The relief that is linked to a node's normal."""
        socket = node.inputs.get("Normal")
        source = origin(socket) if socket else None
        if source is None:
            return None
        of = source.node
        if of.type == "NORMAL_MAP" and of.space == "TANGENT":
            strength = self._constant(of, "Strength")
            field_of_normals = self._fields.socket(of.inputs["Color"])
            if field_of_normals.is_constant:
                return None
            if field_of_normals.image is not None and not self._images.is_linear(field_of_normals.image):
                self._warn(f"node {of.name}: its image is no colour, so it is read as linear data")
            texture = self._texture(field_of_normals)
            if texture is None:
                return None
            self._layer("uv", of.uv_map or None)
            if "color_space" in self._owner.textures[texture]:
                self._owner.textures[texture]["color_space"] = "linear"
            return {"normal_map": {"texture": texture, "strength": min(max(strength, 0.0), 16.0)}}
        if of.type == "BUMP":
            height = self._fields.socket(of.inputs["Height"])
            if height.is_constant:
                return None
            texture = self._texture(height)
            strength = self._constant(of, "Strength")
            if strength != 1:
                self._warn(f"node {of.name}: its strength scales the height")
            sign = -1 if of.invert else 1
            return texture and {
                "bump_map": {"texture": texture, "height": sign * strength * self._constant(of, "Distance")}
            }
        self._warn(f"node {of.name}: normals of {of.bl_label} are left out")
        return None

    def _mixed(self, first, second, amount):
        """The name of a mix of two materials; names may be None for black."""
        if first == second:
            return first
        names = [name or self._add(dict(BLACK)) for name in (first, second)]
        return self._add({"type": "mix", "materials": names, "amount": self._scalar(amount)})

    def _scaled(self, emission, share):
        """Emission times a field."""
        if emission is None:
            return None
        color, factor = emission
        return self._fields.apply(lambda x, t: x * np.clip(t[..., :1], 0, 1), color, share), factor

    def _complement(self, share):
        return self._fields.apply(lambda t: 1 - np.clip(t, 0, 1), share)

    def _mix(self, node):
        share = self._fields.socket(node.inputs[0])
        if share.is_constant and share.number() in (0.0, 1.0):
            return self._shader(node.inputs[1 + int(share.number())])
        first, second = self._shader(node.inputs[1]), self._shader(node.inputs[2])
        try:
            return self._mix_of(node, share, first, second)
        except Unsupported as error:
            self._warn(f"node {node.name}: {error}; its first shader is taken")
            return first

    def _mix_of(self, node, share, first, second):
        if first.opacity is _CLEAR or second.opacity is _CLEAR:
            shown, opacity = (second, share) if first.opacity is _CLEAR else (first, None)
            if shown.opacity is not None:
                raise Unsupported("of two transparent shaders one is used")
            return replace(shown, opacity=opacity or self._complement(share))
        if first.opacity is not None or second.opacity is not None:
            self._warn(f"node {node.name}: what is mixed with a transparent shader is opaque")
        emission = self._scaled(first.emission, self._complement(share)) if first.emission else None
        if second.emission:
            emission = self._sum(node, emission, self._scaled(second.emission, share))
        if first.relief and second.relief and first.relief != second.relief:
            self._warn(f"node {node.name}: one of two normals is used")
        relief = first.relief or second.relief
        return Surface(self._mixed(first.material, second.material, share), emission, None, relief)

    def _sum(self, node, first, second):
        if first is None or second is None:
            return first or second
        if first[0].is_constant and second[0].is_constant:
            values = first[0].values * first[1] + second[0].values * second[1]
            return Field(values.astype(np.float32)), 1.0
        self._warn(f"node {node.name}: one of two textured emissions is used")
        return first

    def _add_shaders(self, node):
        first, second = self._shader(node.inputs[0]), self._shader(node.inputs[1])
        if first.material and second.material:
            self._warn(f"node {node.name}: of two surfaces that are added the first is used")
        emission = self._sum(node, first.emission, second.emission)
        return Surface(first.material or second.material, emission, None, first.relief or second.relief)

    def _diffuse(self, node):
        color, roughness = self._fields.named(node, "Color", "Roughness")
        albedo, rough = self._color(color), self._scalar(roughness)
        return Surface(self._add({"type": "diffuse", "albedo": albedo, "roughness": rough}), relief=self._relief(node))

    def _translucent(self, node):
        (color,) = self._fields.named(node, "Color")
        both = {"reflectance": 0.0, "transmittance": self._color(color)}
        return Surface(self._add({"type": "diffuse_transmission", **both}), relief=self._relief(node))

    def _transparent(self, node):
        (color,) = self._fields.named(node, "Color")
        if color.is_constant and all(c >= 1 for c in color.rgb()):
            return Surface(None, opacity=_CLEAR)
        pane = {"type": "thin_dielectric", "ior": 1.0, "transmission_tint": self._color(color)}
        return Surface(self._add(pane))

    def _microfacets(self, node):
        """Keys of a distribution of microfacets."""
        kinds = {
            "BECKMANN": {"distribution": "beckmann"},
            "GGX": {"multiscatter": False},
            "MULTI_GGX": {},
        }
        if node.distribution not in kinds:
            self._warn(f"node {node.name}: the distribution {node.distribution} is rendered as GGX")
        return kinds.get(node.distribution, {})

    def _glossy(self, node):
        color, roughness = self._fields.named(node, "Color", "Roughness")
        anisotropy = self._constant(node, "Anisotropy") or 0.0
        rough = self._scalar(roughness)
        if anisotropy and isinstance(rough, float):
            self._warn(f"node {node.name}: highlights are stretched along u")
            aspect = math.sqrt(1 - 0.9 * min(abs(anisotropy), 1)) ** 0.5
            rough = [rough / aspect, rough * aspect] if anisotropy > 0 else [rough * aspect, rough / aspect]
            rough = [min(r, 1.0) for r in rough]
        # An index that reflects everything.
        metal = {"eta": [1e-5] * 3, "k": [1.0] * 3, "tint": self._color(color), "roughness": rough}
        return Surface(self._add({"type": "conductor", **metal, **self._microfacets(node)}), relief=self._relief(node))

    def _glass(self, node):
        color, roughness = self._fields.named(node, "Color", "Roughness")
        tint = self._color(color)
        glass = {"type": "dielectric", "ior": self._ior(node), "reflection_tint": tint, "transmission_tint": tint}
        if node.type == "BSDF_REFRACTION":
            glass["reflection_tint"] = 0.0
            self._warn(f"node {node.name}: refraction is that of glass that reflects nothing")
        rough = self._scalar(roughness)
        if rough != 0.0:
            glass |= {"roughness": rough, **self._microfacets(node)}
        return Surface(self._add(glass), relief=self._relief(node))

    def _ior(self, node):
        ior = self._constant(node, "IOR")
        limited = min(max(ior, 0.1), 10.0)
        if limited != ior:
            self._warn(f"node {node.name}: the IOR {ior:g} is limited to {limited:g}")
        return limited

    def _emitter(self, node):
        color, strength = self._fields.named(node, "Color", "Strength")
        return Surface(None, self._emitted(color, strength))

    def _emitted(self, color, strength):
        """Emission of a colour times a strength, fields both; None if there is none."""
        if strength.is_constant:
            number = strength.number()
            dark = number <= 0 or (color.is_constant and not any(c > 0 for c in color.rgb()))
            return None if dark else (color, number)
        return self._fields.apply(lambda x, s: x * s[..., :1], color, strength), 1.0

    def _emission(self, surface):
        if surface.emission is None:
            return None
        color, factor = surface.emission
        if color.is_constant:
            radiance = [max(c * factor, 0.0) for c in color.rgb()]
            return {"radiance": radiance, "two_sided": True} if any(radiance) else None
        texture = self._texture(color)
        return texture and {"radiance": [factor] * 3, "texture": texture, "two_sided": True}

    def _opacity(self, surface):
        opacity = surface.opacity
        if opacity is _CLEAR:
            return 0.0
        if opacity is None or opacity.is_constant or opacity.texture or opacity.channel:
            return None if opacity is None else self._scalar(opacity)
        # An opacity without a channel would be the alpha of the image.
        numbers = self._fields.apply(lambda x: grey(x[..., :3] @ LUMINANCE), opacity)
        return self._scalar(replace(numbers, channel="r"))

    # The principled shader.

    def _principled(self, node):
        for name in ("Subsurface Weight", "Thin Film Thickness", "Anisotropic Rotation"):
            if self._constant(node, name):
                self._warn(f"node {node.name}: {name} is left out")
        for name in ("Coat Normal", "Tangent"):
            if node.inputs[name].is_linked:
                self._warn(f"node {node.name}: what is linked to {name} is left out")
        fields = self._fields
        metallic, transmission, coat = fields.named(node, "Metallic", "Transmission Weight", "Coat Weight")
        is_metal = metallic.is_constant and metallic.number() >= 1
        is_glass = transmission.is_constant and transmission.number() >= 1
        below = None
        if not is_metal:
            below = self._principled_glass(node) if is_glass else self._principled_base(node)
            if not is_glass and not (transmission.is_constant and transmission.number() <= 0):
                below = self._mixed(below, self._principled_glass(node), transmission)
        if is_metal:
            below = self._principled_metal(node)
        elif not (metallic.is_constant and metallic.number() <= 0):
            below = self._mixed(below, self._principled_metal(node), metallic)
        if not (coat.is_constant and coat.number() <= 0):
            opaque = is_metal or (transmission.is_constant and transmission.number() <= 0)
            below = self._coated(node, below, coat, opaque)
        emission = self._emitted(*fields.named(node, "Emission Color", "Emission Strength"))
        (alpha,) = fields.named(node, "Alpha")
        opaque = alpha.is_constant and alpha.number() >= 1
        return Surface(below, emission, None if opaque else alpha, self._relief(node))

    def _principled_base(self, node):
        """A diffuse base under a dielectric coat."""
        color, roughness, rough_base = self._fields.named(node, "Base Color", "Roughness", "Roughness")
        if "Diffuse Roughness" in node.inputs:
            (rough_base,) = self._fields.named(node, "Diffuse Roughness")
        else:
            rough_base = constant(0)
        sheen = self._constant(node, "Sheen Weight")
        albedo, ior = self._color(color), self._specular_ior(node)
        if sheen:
            self._warn(f"node {node.name}: its sheen is that of Disney's model")
            layer = {"specular": min(((ior - 1) / (ior + 1)) ** 2 / 0.08, 1.0)}
            layer |= {"sheen": min(sheen, 1.0), "sheen_tint": 0.0, "roughness": self._scalar(roughness)}
            return self._add({"type": "principled", "base_color": albedo, **layer})
        diffuse = {"type": "diffuse", "albedo": albedo, "roughness": self._scalar(rough_base)}
        if ior <= 1:
            return self._add(diffuse)
        coat = {"ior": ior, "roughness": self._scalar(roughness)}
        if not (rough_base.is_constant and rough_base.number() <= 0):
            return self._add({"type": "coated", "base": self._add(diffuse), **coat})
        return self._add({"type": "plastic", "albedo": albedo, **coat})

    def _specular_ior(self, node):
        """The index of refraction that has the reflectance which the specular level scales."""
        ior, level = self._ior(node), self._constant(node, "Specular IOR Level")
        tint = self._fields.socket(node.inputs["Specular Tint"])
        if not tint.is_constant or any(c != 1 for c in tint.rgb()):
            self._warn(f"node {node.name}: Specular Tint is left out")
        root = min(math.sqrt(max(2 * level, 0)) * abs(ior - 1) / (ior + 1), 0.81)
        return (1 + root) / (1 - root)

    def _principled_metal(self, node):
        color, roughness, anisotropic = self._fields.named(node, "Base Color", "Roughness", "Anisotropic")
        stretch = self._scalar(anisotropic)
        if stretch:
            self._warn(f"node {node.name}: highlights are stretched along u")
        keys = {"base_color": self._color(color), "roughness": self._scalar(roughness), "anisotropic": stretch}
        return self._add({"type": "principled", "metallic": 1.0, **keys, **self._lossy(node)})

    def _lossy(self, node):
        return {"multiscatter": False} if node.distribution == "GGX" else {}

    def _principled_glass(self, node):
        """Glass whose colour is that of light that has gone in and out."""
        color, roughness = self._fields.named(node, "Base Color", "Roughness")
        tint = self._color(self._fields.apply(lambda x: np.sqrt(np.clip(x, 0, 1)), color))
        glass = {"type": "dielectric", "ior": self._ior(node), "transmission_tint": tint}
        rough = self._scalar(roughness)
        if rough != 0.0:
            glass |= {"roughness": rough, **self._lossy(node)}
        return self._add(glass)

    def _coated(self, node, below, weight, opaque):
        if not opaque:
            self._warn(f"node {node.name}: the coat of what transmits light is left out")
            return below
        roughness, tint = self._fields.named(node, "Coat Roughness", "Coat Tint")
        ior = min(max(self._constant(node, "Coat IOR"), 1.0), 10.0)
        coat = {"ior": ior, "roughness": self._scalar(roughness), "tint": self._color(tint)}
        coated = self._add({"type": "coated", "base": below, **coat})
        return coated if weight.is_constant and weight.number() >= 1 else self._mixed(below, coated, weight)

    def _hair(self, node):
        """Principled hair, by its colour or its absorption."""
        if node.model != "CHIANG" or node.parametrization not in ("COLOR", "ABSORPTION"):
            self._warn(f"node {node.name}: hair of {node.model}, {node.parametrization}, has the default colour")
            return Surface(self._add({"type": "hair"}))
        rough, radial, ior = (self._constant(node, name) for name in ("Roughness", "Radial Roughness", "IOR"))
        keys = {"longitudinal_roughness": rough, "azimuthal_roughness": radial, "ior": ior}
        keys["scale_tilt_degrees"] = math.degrees(self._constant(node, "Offset"))
        if node.parametrization == "COLOR":
            keys["color"] = self._color(self._fields.socket(node.inputs["Color"]))
        else:
            keys["sigma_a"] = list(node.inputs["Absorption Coefficient"].default_value)
        return Surface(self._add({"type": "hair", **keys}))


# The opacity of a transparent shader alone.
_CLEAR = constant(0)

_SHADERS = {
    "BSDF_PRINCIPLED": _Translation._principled,
    "BSDF_DIFFUSE": _Translation._diffuse,
    "BSDF_TRANSLUCENT": _Translation._translucent,
    "BSDF_TRANSPARENT": _Translation._transparent,
    "BSDF_GLOSSY": _Translation._glossy,
    "BSDF_ANISOTROPIC": _Translation._glossy,
    "BSDF_GLASS": _Translation._glass,
    "BSDF_REFRACTION": _Translation._glass,
    "BSDF_HAIR_PRINCIPLED": _Translation._hair,
    "EMISSION": _Translation._emitter,
    "MIX_SHADER": _Translation._mix,
    "ADD_SHADER": _Translation._add_shaders,
}
