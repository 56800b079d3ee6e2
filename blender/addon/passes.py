"""Layers of Steradian as passes of Blender."""

from dataclasses import dataclass

import numpy as np

from .settings import LAYERS

MATTES = {"object": "crypto_object", "material": "crypto_material", "asset": "crypto_asset"}
TITLES = {"object": "CryptoObject", "material": "CryptoMaterial", "asset": "CryptoAsset"}


@dataclass(frozen=True)
class Pass:
    """A pass of Blender: its name, the names of its channels, its type, and the layer that it shows."""

    name: str
    channels: str
    kind: str
    layer: str


def chosen(view_layer):
    """The passes of a view layer beside the combined one, without Cryptomatte."""
    found = []
    if view_layer.use_pass_z:
        found.append(Pass("Depth", "Z", "VALUE", "Z"))
    if view_layer.use_pass_normal:
        found.append(Pass("Normal", "XYZ", "VECTOR", "N"))
    if view_layer.use_pass_position:
        found.append(Pass("Position", "XYZ", "VECTOR", "P"))
    names = {name: title for name, title, _ in LAYERS}
    found += [
        Pass(f"Steradian {names[name]}", "RGB", "COLOR", name) for name in names if name in view_layer.steradian.layers
    ]
    return found


def chosen_mattes(view_layer):
    """The kinds of Cryptomatte of a view layer."""
    return [kind for kind in MATTES if getattr(view_layer, f"use_pass_cryptomatte_{kind}")]


def matte_passes(view_layer):
    """The passes of Cryptomatte of a view layer, by their kinds."""
    count = matte_depth(view_layer) // 2
    return {
        kind: [Pass(f"{TITLES[kind]}{i:02}", "RGBA", "COLOR", MATTES[kind]) for i in range(count)]
        for kind in chosen_mattes(view_layer)
    }


def matte_depth(view_layer):
    """The ranks of Cryptomatte, an even number."""
    return max(2, view_layer.pass_cryptomatte_depth + view_layer.pass_cryptomatte_depth % 2)


def layers(view_layer):
    """The layers that a render needs."""
    return [each.layer for each in chosen(view_layer)] + [MATTES[kind] for kind in chosen_mattes(view_layer)]


def store(layer, name, pixels):
    """Puts pixels, an array of shape (height, width, channels) with row 0 at the top, into a pass of a result."""
    found = layer.passes.get(name)
    if found is not None:
        found.rect.foreach_set(np.ascontiguousarray(pixels[::-1], np.float32).ravel())


def store_all(result, view_layer, image):
    """Puts a picture and all passes into a result."""
    layer = result.layers[0]
    store(layer, "Combined", image["color"])
    for each in chosen(view_layer):
        store(layer, each.name, image[each.layer])


def store_mattes(result, whole, view_layer, image):
    """Puts Cryptomatte into a result, and its names into the metadata of the whole one."""
    layer = result.layers[0]
    for kind, found in matte_passes(view_layer).items():
        matte = image.cryptomatte(MATTES[kind], depth=matte_depth(view_layer))
        for i, each in enumerate(found):
            store(layer, each.name, matte["data"][..., 4 * i : 4 * i + 4])
        for key, value in matte["metadata"].items():
            # Blender names mattes after the view layer.
            text = f"{view_layer.name}.{value}" if key.endswith("/name") else value
            whole.stamp_data_add_field(key, text)
