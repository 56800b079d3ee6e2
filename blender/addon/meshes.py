"""Meshes as arrays: corners that agree in all attributes share a vertex."""

import numpy as np


def _read(collection, name, count, columns, kind=np.float32):
    values = np.empty(count * columns, kind)
    collection.foreach_get(name, values)
    return values.reshape(count, columns)


def _corner_attribute(mesh, name, columns):
    """The values of a layer of UVs or colours for each corner; None if the mesh lacks it."""
    attribute = mesh.attributes.get(name)
    if attribute is None:
        return None
    key = {"FLOAT2": "vector", "FLOAT_COLOR": "color", "BYTE_COLOR": "color"}.get(attribute.data_type)
    width = {"FLOAT2": 2, "FLOAT_COLOR": 4, "BYTE_COLOR": 4}.get(attribute.data_type)
    if key is None:
        return None
    values = _read(attribute.data, key, len(attribute.data), width)[:, :columns]
    if attribute.domain == "POINT":
        return values[_read(mesh.loops, "vertex_index", len(mesh.loops), 1, np.int32)[:, 0]]
    return values if attribute.domain == "CORNER" else None


def shared_corners(vertex_of_corner, attributes):
    """Vertices for corners: those of one vertex with the same attributes are one.

    vertex_of_corner: (corners,) indices. attributes: arrays of shape (corners, n).
    Returns (corner of each vertex, vertex of each corner).
    """
    count = len(vertex_of_corner)
    first = np.full(vertex_of_corner.max(initial=-1) + 1, -1, np.int64)
    first[vertex_of_corner[::-1]] = np.arange(count - 1, -1, -1)
    same = np.ones(count, bool)
    for values in attributes:
        same &= (values == values[first[vertex_of_corner]]).all(axis=1)
    used = np.flatnonzero(first >= 0)
    number = np.full(len(first), -1, np.int64)
    number[used] = np.arange(len(used))
    others = np.flatnonzero(~same)
    vertex = number[vertex_of_corner]
    vertex[others] = len(used) + np.arange(len(others))
    return np.concatenate([first[used], others]), vertex


def arrays(mesh, uv_name=None, color_name=None):
    """The triangles of a mesh by material slot: {slot: {"positions": ..., "triangles": ..., "normals": ..., ...}}.

    uv_name, color_name: layers to take in place of those that are active for renders.
    """
    mesh.calc_loop_triangles()
    count, corners = len(mesh.loop_triangles), len(mesh.loops)
    if count == 0:
        return {}
    triangles = _read(mesh.loop_triangles, "loops", count, 3, np.int32)
    slots = _read(mesh.loop_triangles, "material_index", count, 1, np.int32)[:, 0]
    vertex_of_corner = _read(mesh.loops, "vertex_index", corners, 1, np.int32)[:, 0]
    positions = _read(mesh.vertices, "co", len(mesh.vertices), 3)
    layers = {}
    if mesh.normals_domain != "FACE":
        layers["normals"] = _read(mesh.corner_normals, "vector", corners, 3)
    uv_layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    uvs = _corner_attribute(mesh, uv_name or (uv_layer.name if uv_layer else ""), 2)
    if uvs is not None:
        layers["uvs"] = uvs
    active = mesh.color_attributes.active_color if mesh.color_attributes else None
    colors = _corner_attribute(mesh, color_name or (active.name if active else ""), 3)
    if colors is not None:
        layers["colors"] = colors
    corner_of_vertex, vertex = shared_corners(vertex_of_corner, layers.values())
    triangles = vertex[triangles]
    found = {}
    for slot in np.unique(slots):
        used, inverse = np.unique(triangles[slots == slot], return_inverse=True)
        chosen = corner_of_vertex[used]
        part = {name: np.ascontiguousarray(values[chosen]) for name, values in layers.items()}
        found[int(slot)] = {
            "positions": positions[vertex_of_corner[chosen]],
            "triangles": inverse.reshape(-1, 3),
            **part,
        }
    return found
