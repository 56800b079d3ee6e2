"""Hair curves as files of strands."""

import struct

import numpy as np


def write(curves, path):
    """Writes the strands of a Curves data block in binary form. Returns whether there are any.

    Blender's curves pass through all their points as Catmull-Rom splines do, so the ends are doubled.
    """
    strands, points = len(curves.curves), len(curves.points)
    if strands == 0 or points == 0:
        return False
    positions, radii = np.empty(points * 3, np.float32), np.full(points, 0.005, np.float32)
    curves.points.foreach_get("position", positions)
    if "radius" in curves.attributes:
        curves.points.foreach_get("radius", radii)
    rows = np.concatenate([positions.reshape(-1, 3), np.maximum(radii, 0)[:, None]], axis=1)
    first = np.empty(strands, np.int32)
    counts = np.empty(strands, np.int32)
    curves.curves.foreach_get("first_point_index", first)
    curves.curves.foreach_get("points_length", counts)
    kept = counts >= 2
    order = [
        np.concatenate([[start], np.arange(start, start + count), [start + count - 1]])
        for start, count in zip(first[kept], counts[kept])
    ]
    if not order:
        return False
    rows = rows[np.concatenate(order)]
    with open(path, "wb") as file:
        file.write(b"STRANDS1" + struct.pack("<II", len(order), len(rows)))
        file.write((counts[kept] + 2).astype("<u4").tobytes())
        file.write(rows.astype("<f4").tobytes())
    return True
