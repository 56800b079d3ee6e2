#!/usr/bin/env python3
"""Writes small files of measured BRDFs, tests/regressions/measured, and prints what Mitsuba makes of them.

    tools/measured_files.py write FOLDER
    tools/measured_files.py example FILE       # scenes/measured/metal.bsdf
    tools/measured_files.py mitsuba FOLDER     # needs Mitsuba 3: pip install mitsuba

The BRDFs are metals of separable GGX microfacets. The last command prints the constants of tests/measured_materials.rs.
"""

import math
import pathlib
import struct
import sys

UINT8, FLOAT32 = 1, 10


class Metal:
    """GGX microfacets whose axes are turned about the normal."""

    def __init__(self, alpha, turned=0.0):
        self.alpha, self.turned = alpha, turned

    def local(self, w):
        c, s = math.cos(self.turned), math.sin(self.turned)
        return (c * w[0] + s * w[1], c * w[1] - s * w[0], w[2])

    def d(self, m):
        x, y, z = self.local(m)
        a, b = self.alpha
        return 1 / (math.pi * a * b * ((x / a) ** 2 + (y / b) ** 2 + z**2) ** 2)

    def sigma(self, w):
        """Projected area: the cosine over the masking."""
        x, y, z = self.local(w)
        a, b = self.alpha
        return 0.5 * (z + math.sqrt((a * x) ** 2 + (b * y) ** 2 + z**2))

    def masking(self, w):
        return w[2] / self.sigma(w) if w[2] > 0 else 0.0


def direction(theta, phi):
    return (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def of_square(u, v, azimuth=0.0):
    return direction(u * u * math.pi / 2, (2 * v - 1) * math.pi + azimuth)


def cumulative(values):
    sums = [0.0]
    for a, b in zip(values, values[1:]):
        sums.append(sums[-1] + 0.5 * (a + b))
    return sums


def trapezoid(sums, values, target):
    """Where the integral of straight lines between values is the target, in steps."""
    target *= sums[-1]
    i = max(k for k in range(len(values) - 1) if sums[k] <= target)
    a, b, rest = values[i], values[i + 1], target - sums[i]
    root = a + math.sqrt(max(a * a + 2 * (b - a) * rest, 0.0))
    return i + (min(2 * rest / root, 1.0) if root > 0 else 0.0)


def warp(table, u, v):
    """The place of the pair of uniform numbers."""
    rows = [cumulative(row)[-1] for row in table]
    y = trapezoid(cumulative(rows), rows, v)
    i = min(int(y), len(table) - 2)
    row = [p + (q - p) * (y - i) for p, q in zip(table[i], table[i + 1])]
    x = trapezoid(cumulative(row), row, u)
    return x / (len(row) - 1), y / (len(table) - 1)


def grid(n, value):
    """By rows, the second coordinate."""
    return [[value(x / (n - 1), y / (n - 1)) for x in range(n)] for y in range(n)]


def flat(values):
    for value in values:
        if isinstance(value, list):
            yield from flat(value)
        else:
            yield value


def shape(values):
    return [len(values), *shape(values[0])] if isinstance(values, list) else []


def measure(metal, phis, thetas, n, jacobian=True):
    """The fields of a file."""
    isotropic = len(phis) <= 2
    vndf, luminance, rgb = [], [], []
    for phi in phis:
        for tables in (vndf, luminance, rgb):
            tables.append([])
        for theta in thetas:
            o, turned = direction(theta, phi), phi if isotropic else 0.0

            def visible(u, v):
                m = of_square(u, v, turned)
                area = 2 * math.pi**2 * u * math.hypot(m[0], m[1])
                return metal.d(m) * max(dot(m, o), 0) / metal.sigma(o) * area

            table = grid(n, visible)

            def reflected(u, v):
                m = of_square(*warp(table, u, v), turned)
                d = dot(m, o)
                i = tuple(2 * d * a - b for a, b in zip(m, o))
                schlick = (1 - max(d, 0)) ** 5
                scale = metal.masking(i) * (1.0 if jacobian else metal.d(m) / (4 * metal.sigma(o)))
                return [scale * (f + (1 - f) * schlick) for f in (0.9, 0.6, 0.25)]

            colors = grid(n, reflected)
            vndf[-1].append(table)
            luminance[-1].append([[0.2126 * r + 0.7152 * g + 0.0722 * b + 0.01 for r, g, b in row] for row in colors])
            rgb[-1].append([[[c[k] for c in row] for row in colors] for k in range(3)])
    return {
        "description": (UINT8, list(b"made by tools/measured_files.py")),
        "jacobian": (UINT8, [int(jacobian)]),
        "phi_i": (FLOAT32, list(phis)),
        "theta_i": (FLOAT32, list(thetas)),
        "ndf": (FLOAT32, grid(9, lambda u, v: metal.d(of_square(u, v)))),
        "sigma": (FLOAT32, grid(9, lambda u, v: metal.sigma(of_square(u, v)))),
        "vndf": (FLOAT32, vndf),
        "luminance": (FLOAT32, luminance),
        "rgb": (FLOAT32, rgb),
    }


def file_bytes(fields):
    shapes = {name: shape(values) for name, (_, values) in fields.items()}
    offset = 18 + sum(2 + len(name) + 11 + 8 * len(shapes[name]) for name in fields)
    header, data = b"tensor_file\0" + bytes([1, 0]) + struct.pack("<I", len(fields)), b""
    for name, (kind, values) in fields.items():
        numbers = list(flat(values))
        header += struct.pack("<H", len(name)) + name.encode()
        header += struct.pack("<HBQ", len(shapes[name]), kind, offset + len(data))
        header += struct.pack(f"<{len(shapes[name])}Q", *shapes[name])
        data += struct.pack(f"<{len(numbers)}{'B' if kind == UINT8 else 'f'}", *numbers)
    return header + data


def files():
    """The names and fields of all files."""
    pi = math.pi
    turned = Metal((0.5, 0.2), 0.4)
    spectral = measure(Metal((0.4, 0.4)), [0.0], [0.0, 1.0], 4)
    # One value for all wavelengths, so that colours are grey.
    greens = [[[thetas[1]] * 4 for thetas in slices] for slices in spectral.pop("rgb")[1]]
    spectral |= {"wavelengths": (FLOAT32, [350.0, 500.0, 600.0, 900.0]), "spectra": (FLOAT32, greens)}
    return {
        "isotropic": measure(Metal((0.35, 0.35)), [0.0], [0.0, 0.4, 0.8, 1.1, 1.5], 11),
        "mirrors": measure(Metal((0.5, 0.2)), [-pi, -0.8 * pi, -0.5 * pi], [0.1, 0.7, 1.3], 9),
        "half_turn": measure(turned, [-pi, -0.7 * pi, -0.3 * pi, 0.0], [0.1, 0.9], 9),
        "whole": measure(turned, [-pi, -0.4 * pi, 0.1 * pi, pi], [0.2, 1.0], 8, jacobian=False),
        "spectral": spectral,
    }


def print_values(folder):
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    print("// mitsuba", mi.__version__, mi.variant())
    eyes = [(0.35, 0.3), (0.9, -2.0), (1.2, 2.4), (0.02, 1.0)]
    lights = [(0.5, -2.5), (0.7, 1.1), (1.1, -0.9), (0.3, 2.0)]
    numbers = [(0.2, 0.7), (0.55, 0.1), (0.93, 0.4), (0.4, 0.95)]
    si = mi.SurfaceInteraction3f()
    for name in ("isotropic", "mirrors", "half_turn", "whole"):
        bsdf = mi.load_dict({"type": "measured", "filename": str(folder / f"{name}.bsdf")})
        for eye, light, u in zip(eyes, lights, numbers):
            si.wi, wo = mi.Vector3f(*direction(*eye)), mi.Vector3f(*direction(*light))
            context = mi.BSDFContext()
            value, pdf = bsdf.eval(context, si, wo), bsdf.pdf(context, si, wo)
            sample, weight = bsdf.sample(context, si, 0.5, mi.Point2f(u[1], u[0]))
            lists = [eye, light, [*value, pdf], u, [*sample.wo, *weight, sample.pdf]]
            text = ", ".join("[" + ", ".join(f"{x:.7g}" for x in numbers) + "]" for numbers in lists)
            print(f'("{name}", {text}),')


def main():
    command, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    if command == "example":
        thetas = [0.0, 0.3, 0.6, 0.9, 1.2, 1.35, 1.5]
        folder.write_bytes(file_bytes(measure(Metal((0.3, 0.3)), [0.0], thetas, 16)))
    elif command == "write":
        for name, fields in files().items():
            (folder / f"{name}.bsdf").write_bytes(file_bytes(fields))
    else:
        print_values(folder)


main()
