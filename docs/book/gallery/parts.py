"""What the gallery's scenes are made of: meshes, images and short forms of shapes."""

import math
import struct

import numpy as np
from PIL import Image

# Files.


def write_ply(path, positions, triangles, normals=None, uvs=None, colors=None):
    """A binary PLY file; colours are linear floats."""
    columns, names = [np.asarray(positions, "<f4")], ["x", "y", "z"]
    for values, own in [(normals, ["nx", "ny", "nz"]), (uvs, ["u", "v"]), (colors, ["red", "green", "blue"])]:
        if values is not None:
            columns.append(np.asarray(values, "<f4"))
            names += own
    triangles = np.asarray(triangles, "<i4")
    faces = np.empty(len(triangles), [("n", "u1"), ("corners", "<i4", 3)])
    faces["n"], faces["corners"] = 3, triangles
    with open(path, "wb") as file:
        head = [f"element vertex {len(columns[0])}"] + [f"property float {name}" for name in names]
        head += [f"element face {len(triangles)}", "property list uchar int vertex_indices"]
        file.write(("ply\nformat binary_little_endian 1.0\n" + "\n".join(head) + "\nend_header\n").encode())
        file.write(np.hstack(columns).astype("<f4").tobytes())
        file.write(faces.tobytes())


def write_points(path, centers):
    """A PLY file for shapes of type `points`."""
    write_ply(path, centers, np.zeros((0, 3)))


def write_strands(path, strands):
    """Strands as an array `[strand, point, (x, y, z, radius)]`, in the binary form of `curves`."""
    strands = np.asarray(strands, "<f4")
    with open(path, "wb") as file:
        file.write(b"STRANDS1" + struct.pack("<II", len(strands), strands.shape[0] * strands.shape[1]))
        file.write(np.full(len(strands), strands.shape[1], "<u4").tobytes())
        file.write(strands.tobytes())


def write_png(path, colors):
    """sRGB values from 0 to 1."""
    Image.fromarray((np.clip(colors, 0, 1) * 255 + 0.5).astype(np.uint8)).save(path)


def write_hdr(path, colors):
    """Linear radiance as a Radiance file without run lengths."""
    colors = np.maximum(np.asarray(colors, float), 1e-9)
    exponent = np.ceil(np.log2(colors.max(axis=2)))
    mantissa = np.clip(colors / 2.0 ** exponent[..., None] * 256, 0, 255)
    pixels = np.dstack([mantissa, exponent + 128]).astype(np.uint8)
    with open(path, "wb") as file:
        file.write(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {colors.shape[0]} +X {colors.shape[1]}\n".encode())
        file.write(pixels.tobytes())


def write_sky(path, zenith, horizon, ground, glow=None, toward=(0, 0, -1), sharpness=8.0):
    """A sky from zenith to horizon, with a glow about a direction."""
    height, width = 256, 512
    polar = (np.arange(height) + 0.5) / height * math.pi
    azimuth = (np.arange(width) + 0.5) / width * 2 * math.pi
    y = np.cos(polar)[:, None] * np.ones(width)
    # The middle column is -Z, +X lies at three quarters of the width.
    x, z = np.sin(polar)[:, None] * np.sin(azimuth - math.pi), -np.sin(polar)[:, None] * np.cos(azimuth - math.pi)
    up = np.clip(y, 0, 1)[..., None] ** 0.5
    sky = np.array(horizon) * (1 - up) + np.array(zenith) * up
    if glow is not None:
        to = np.array(toward, float) / np.linalg.norm(toward)
        near = np.clip(x * to[0] + y * to[1] + z * to[2], 0, 1) ** sharpness
        sky += near[..., None] * np.array(glow)
    below = np.clip(y * 40, -1, 0)[..., None]
    write_hdr(path, sky * (1 + below) - below * np.array(ground))


# Noise.


def noise(shape, cells, seed, octaves=5, gain=0.5):
    """Periodic value noise of any number of axes, from about -1 to 1."""
    rng = np.random.default_rng(seed)
    total, weight = np.zeros(shape), 1.0
    for octave in range(octaves):
        count = [max(int(c * 2**octave), 1) for c in cells]
        lattice = rng.uniform(-1, 1, count)
        for axis, (n, size) in enumerate(zip(count, shape)):
            at = (np.arange(size) + 0.5) / size * n
            low = np.floor(at).astype(int) % n
            t = at - np.floor(at)
            t = (t * t * (3 - 2 * t)).reshape([-1 if a == axis else 1 for a in range(len(shape))])
            lattice = np.take(lattice, low, axis) * (1 - t) + np.take(lattice, (low + 1) % n, axis) * t
        total += weight * lattice
        weight *= gain
    return total


# Meshes.


def grid(columns, rows):
    """Triangles of a grid of vertices, row by row."""
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    return np.vstack([np.column_stack([a, a + 1, a + columns + 1]), np.column_stack([a, a + columns + 1, a + columns])])


def height_field(path, height, size, color=None, tiles=(1, 1)):
    """A mesh over a rectangle of the xz plane about the origin; `height[z, x]`."""
    rows, columns = height.shape
    x = np.linspace(-size[0] / 2, size[0] / 2, columns)
    z = np.linspace(-size[1] / 2, size[1] / 2, rows)
    dz, dx = np.gradient(height, z, x)
    normals = np.dstack([-dx, np.ones_like(dx), -dz])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    positions = np.dstack(np.broadcast_arrays(x[None, :], height, z[:, None]))
    uvs = np.dstack(np.broadcast_arrays(np.linspace(0, tiles[0], columns)[None, :], np.linspace(tiles[1], 0, rows)[:, None]))
    colors = None if color is None else color.reshape(-1, 3)
    triangles = grid(columns, rows)[:, [0, 2, 1]]
    write_ply(path, positions.reshape(-1, 3), triangles, normals.reshape(-1, 3), uvs.reshape(-1, 2), colors)


def rounded_box(path, half, radius, puff=0.0, steps=6, inner=10):
    """A box with round edges; `puff` is how far its faces swell, as those of a cushion."""
    half = np.array(half, float)
    positions, normals, uvs, triangles = [], [], [], []
    edge = 1 - np.cos(np.linspace(0, math.pi / 2, steps + 1))
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        lines = []
        for a in (u, v):
            flat = half[a] - radius
            lines.append(
                np.concatenate(
                    [
                        -half[a] + radius * (1 - np.cos(np.linspace(0, math.pi / 2, steps + 1)))[:-1] ** 1.0,
                        np.linspace(-flat, flat, inner),
                        half[a] - radius * edge[:-1][::-1],
                    ]
                )
            )
        for side in (-1, 1):
            p = np.zeros((len(lines[1]), len(lines[0]), 3))
            p[..., axis], p[..., u], p[..., v] = side * half[axis], lines[0][None, :], lines[1][:, None]
            q = np.clip(p, -(half - radius), half - radius)
            n = p - q
            n /= np.linalg.norm(n, axis=2, keepdims=True)
            swell = np.prod([1 - np.clip(p[..., a] / half[a], -1, 1) ** 2 for a in (u, v)], axis=0)
            p = q + n * (radius + puff * swell[..., None])
            first = sum(len(part) for part in positions)
            order = [0, 1, 2] if side > 0 else [0, 2, 1]
            triangles.append(grid(len(lines[0]), len(lines[1]))[:, order] + first)
            positions.append(p.reshape(-1, 3))
            normals.append(n.reshape(-1, 3))
            st = np.dstack(np.broadcast_arrays(lines[0][None, :], lines[1][:, None])).reshape(-1, 2)
            uvs.append(st)
    if puff:
        normals = None
    write_ply(path, np.vstack(positions), np.vstack(triangles), None if normals is None else np.vstack(normals), np.vstack(uvs))


def convex(path, points):
    """The convex hull's facets of a small set of points, flat: cut stones."""
    points = np.asarray(points, float)
    middle, corners, done = points.mean(axis=0), [], set()
    for i in range(len(points)):
        for j in range(i + 1, len(points)):
            for k in range(j + 1, len(points)):
                n = np.cross(points[j] - points[i], points[k] - points[i])
                length = np.linalg.norm(n)
                if length < 1e-9:
                    continue
                n /= length
                if n @ (points[i] - middle) < 0:
                    n = -n
                distance = points @ n - points[i] @ n
                key = tuple(np.round(np.append(n, points[i] @ n), 5))
                if distance.max() > 1e-6 or key in done:
                    continue
                done.add(key)
                on = points[np.abs(distance) <= 1e-6]
                center = on.mean(axis=0)
                e = on[0] - center
                angle = np.arctan2((on - center) @ np.cross(n, e), (on - center) @ e)
                on = on[np.argsort(angle)]
                corners += [(on[0], on[m], on[m + 1]) for m in range(1, len(on) - 1)]
    corners = np.array(corners).reshape(-1, 3)
    write_ply(path, corners, np.arange(len(corners)).reshape(-1, 3))


def brilliant(path):
    """A round brilliant of diameter 2: 57 facets by Tolkowsky's angles, its culet at the lowest point."""
    points = []
    ring = lambda radius, y, count, turn: [
        (radius * math.cos(2 * math.pi * (k + turn) / count), y, radius * math.sin(2 * math.pi * (k + turn) / count)) for k in range(count)
    ]
    crown, pavilion, girdle = math.radians(34.5), math.radians(40.75), 0.03
    table = 0.56
    top = (1 - table) * math.tan(crown)
    points += ring(table, girdle + top, 8, 0)
    # Where stars meet bezels: below the bezel planes.
    star = 0.78
    points += ring(star, girdle + (1 - star * math.cos(math.pi / 8) * 1.0) * math.tan(crown) * 0.985, 8, 0.5)
    points += ring(1, girdle, 16, 0)
    points += ring(1, -girdle, 16, 0)
    points += ring(0.24, -girdle - 0.76 * math.tan(pavilion) * 0.985, 8, 0.5)
    points += [(0, -girdle - math.tan(pavilion), 0)]
    convex(path, points)


# Short forms of shapes.

UPRIGHT = {"rotate": {"axis": [1, 0, 0], "degrees": -90}}


def move(x, y, z):
    return {"translate": [x, y, z]}


def turn(degrees, axis=(0, 1, 0)):
    return {"rotate": {"axis": list(axis), "degrees": degrees}}


def box(material, center, half, *steps, **more):
    return {"type": "cube", "material": material, "transform": [{"scale": list(half)}, *steps, move(*center)], **more}


def ball(material, center, radius, **more):
    return {"type": "sphere", "material": material, "radius": radius, "transform": [move(*center)], **more}


def mesh(material, file, *steps, **more):
    return {"type": "mesh", "material": material, "file": file, "transform": list(steps), **more}


def quad(material, origin, u, v, **more):
    return {"type": "quad", "material": material, "origin": list(origin), "edge_u": list(u), "edge_v": list(v), **more}


def cylinder(material, base, radius, height, **more):
    return {"type": "cylinder", "material": material, "radius": radius, "height": height, "transform": [UPRIGHT, move(*base)], **more}


def disk(material, center, radius, **more):
    return {"type": "disk", "material": material, "radius": radius, "transform": [UPRIGHT, move(*center)], **more}


def turned(material, points, *steps, **more):
    """A surface of revolution of a B-spline that reaches its end points."""
    points = [points[0]] * 2 + [list(point) for point in points] + [points[-1]] * 2
    return {"type": "revolution", "material": material, "profile": {"b_spline": points}, "transform": list(steps), **more}


def ring(material, radius, tube, *steps, **more):
    """A torus about +y, of four Bezier curves."""
    k = 0.5523 * tube
    circle = [
        [radius - tube, 0],
        [radius - tube, -k],
        [radius - k, -tube],
        [radius, -tube],
        [radius + k, -tube],
        [radius + tube, -k],
        [radius + tube, 0],
        [radius + tube, k],
        [radius + k, tube],
        [radius, tube],
        [radius - k, tube],
        [radius - tube, k],
        [radius - tube, 0],
    ]
    return {"type": "revolution", "material": material, "profile": {"bezier": circle}, "transform": list(steps), **more}


def tube(material, points, radius, **more):
    """A round wire through points."""
    points = [points[0], *points, points[-1]]
    return {"type": "curves", "material": material, "basis": "catmull_rom", "strands": [[[*point, radius] for point in points]], **more}


def lamp(origin, u, v, radiance, **more):
    """A quad that shines on both sides."""
    return quad("lamp", origin, u, v, emission={"radiance": radiance, "two_sided": True, **more})


LAMP = {"lamp": {"type": "diffuse", "albedo": 0}}


def sweep(folder, material, width=14.0, back=-4.0, height=9.0, front=8.0, bend=2.5):
    """A studio's backdrop: a floor that bends upward into a wall."""
    angle = np.linspace(0, math.pi / 2, 40)
    z = np.concatenate([[front], back + bend - bend * np.sin(angle), [back]])
    y = np.concatenate([[0], bend - bend * np.cos(angle), [height]])
    ny = np.concatenate([[1], np.cos(angle), [0]])
    nz = np.concatenate([[0], np.sin(angle), [1]])
    points = np.array([[x, b, c] for b, c in zip(y, z) for x in (-width, width)])
    normals = np.array([[0, b, c] for b, c in zip(ny, nz) for _ in range(2)])
    write_ply(folder / "sweep.ply", points, grid(2, len(z)), normals)
    return [mesh(material, "sweep.ply", name="backdrop")]
