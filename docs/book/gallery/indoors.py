"""Scenes under lamps and in studios."""

import math

import numpy as np

from parts import *


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


def chess(folder):
    """An endgame by a window: exact surfaces of revolution, and a lens with six blades."""
    rng = np.random.default_rng(5)
    rings = lambda seed, tone, dark: (lambda n: np.clip(tone * (1 + dark * (np.sin(40 * (n + np.linspace(0, 3, 512)[None, :])) * 0.35 + 0.9 * n))[..., None], 0, 1))(noise((256, 512), (2, 9), seed, 5, 0.55))
    write_png(folder / "light.png", rings(1, np.array([0.86, 0.70, 0.48]), 0.10))
    write_png(folder / "dark.png", rings(2, np.array([0.40, 0.22, 0.12]), 0.28))
    write_png(folder / "table.png", rings(3, np.array([0.33, 0.20, 0.12]), 0.30))
    base = [[0, 0], [0.30, 0], [0.36, 0.0], [0.385, 0.03], [0.385, 0.09], [0.36, 0.115], [0.345, 0.12], [0.345, 0.15], [0.35, 0.17], [0.31, 0.20], [0.25, 0.25]]
    collar = lambda y, r: [[r - 0.03, y - 0.05], [r + 0.10, y - 0.015], [r + 0.125, y + 0.005], [r + 0.125, y + 0.03], [r + 0.09, y + 0.05], [r - 0.02, y + 0.06]]
    profiles = {
        "pawn": base + [[0.15, 0.42], [0.12, 0.58]] + collar(0.68, 0.11) + [[0.12, 0.77], [0.19, 0.84], [0.215, 0.94], [0.18, 1.07], [0.09, 1.13], [0, 1.135]],
        "rook": base + [[0.21, 0.42], [0.19, 0.66]] + collar(0.80, 0.18) + [[0.17, 0.90], [0.18, 0.96], [0.27, 1.0], [0.285, 1.02], [0.285, 1.2], [0.275, 1.22], [0.215, 1.22], [0.205, 1.2], [0.20, 1.12], [0.15, 1.10], [0, 1.10]],
        "bishop": base + [[0.17, 0.45], [0.13, 0.75]] + collar(0.98, 0.12) + [[0.10, 1.07], [0.18, 1.15], [0.205, 1.27], [0.16, 1.42], [0.06, 1.53], [0.03, 1.55], [0.055, 1.57], [0.07, 1.60], [0.05, 1.65], [0, 1.66]],
        "queen": base + [[0.20, 0.5], [0.14, 0.95]] + collar(1.18, 0.14) + [[0.13, 1.29], [0.16, 1.4], [0.26, 1.58], [0.265, 1.61], [0.225, 1.615], [0.19, 1.60], [0.13, 1.66], [0.05, 1.70], [0.04, 1.72], [0.075, 1.745], [0.08, 1.79], [0.05, 1.83], [0, 1.835]],
        "king": base + [[0.21, 0.5], [0.15, 1.0]] + collar(1.28, 0.15) + [[0.14, 1.39], [0.17, 1.50], [0.265, 1.68], [0.27, 1.72], [0.22, 1.75], [0.10, 1.79], [0.05, 1.82], [0.04, 1.84], [0, 1.845]],
    }
    shapes = []

    def piece(kind, color, file, rank, lying=None):
        x, z = file - 3.5, 3.5 - rank
        steps = [turn(0 if kind == "king" else rng.uniform(0, 360)), move(x + rng.uniform(-0.05, 0.05), 0.001, z + rng.uniform(-0.05, 0.05))]
        if lying is not None:
            steps = [turn(-86.5, (0, 0, 1)), turn(lying), move(x, 0.385, z)]
        shapes.append(turned(color, profiles[kind], *steps, v="height"))
        if kind == "king":
            place = lambda half, y: {"type": "cube", "material": color, "transform": [{"scale": half}, move(0, y, 0), *steps]}
            shapes.extend([place([0.032, 0.11, 0.028], 1.94), place([0.085, 0.03, 0.0279], 1.955)])

    for kind, color, file, rank in [
        ("king", "white", 4, 1), ("queen", "white", 3, 2), ("rook", "white", 5, 0), ("bishop", "white", 2.0, 3), ("pawn", "white", 5, 2), ("pawn", "white", 6, 1),
        ("pawn", "white", 7, 2), ("pawn", "black", 5, 4), ("pawn", "black", 6, 5), ("pawn", "black", 1, 5), ("queen", "black", 4, 6), ("rook", "black", 6, 7),
        ("bishop", "black", 2, 6), ("pawn", "black", 7, 5), ("pawn", "white", 1, 2), ("pawn", "white", 0, 1),
    ]:
        piece(kind, color, file, rank)
    piece("king", "black", 3.0, 4.1, lying=155)
    for i in range(8):
        for j in range(8):
            name = "maple" if (i + j) % 2 else "walnut"
            shapes.append(box(name, [i - 3.5, -0.08, 3.5 - j], [0.497, 0.08, 0.497]))
    for x, z, a, b in [(0, 4.45, 4.9, 0.45), (0, -4.45, 4.9, 0.45), (4.45, 0, 0.45, 4.0), (-4.45, 0, 0.45, 4.0)]:
        shapes.append(box("walnut", [x, -0.095, z], [a, 0.105, b]))
    shapes += [
        box("table", [0, -0.5, 0], [14, 0.3, 9]),
        lamp([-9, 1.0, -5], [0, 0, 8], [0, 6, 0], [14, 15, 17]),
        lamp([8, 1.5, -6], [0, 0, 3], [0, 4, 0], [16, 10, 5]),
        quad("wall", [-30, -8, -16], [60, 0, 0], [0, 30, 0]),
    ]
    for _ in range(60):
        x, y = rng.uniform(-8, 7), rng.uniform(0.2, 4.2)
        tone = np.array([1.0, rng.uniform(0.45, 0.75), rng.uniform(0.12, 0.4)]) * rng.uniform(8, 40)
        shapes.append(ball("lamp", [x, y, -14.5 + rng.uniform(-1, 3)], rng.uniform(0.05, 0.11), emission={"radiance": list(np.round(tone, 2))}))
    wood = lambda file: {"type": "image", "file": file}
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {"position": [1.9, 1.9, 7.4], "look_at": [0.25, 0.86, -0.3], "vertical_fov_degrees": 27,
                   "lens": {"radius": 0.11, "focus_point": [0.5, 1.2, 2.45], "blades": {"count": 6, "rotation_degrees": 12}}},
        "integrator": {"type": "path", "max_depth": 12},
        "sampler": {"spp": 20},
        "textures": {"light": wood("light.png"), "dark": wood("dark.png"), "table": {"type": "image", "file": "table.png", "scale": [3, 2]},
                     "board": {"type": "image", "file": "light.png", "scale": [0.5, 0.8]}, "board2": {"type": "image", "file": "dark.png", "scale": [0.5, 0.8]}},
        "materials": LAMP | {
            "white": {"type": "plastic", "albedo": {"texture": "light"}, "roughness": 0.25}, "black": {"type": "plastic", "albedo": [0.022, 0.017, 0.015], "roughness": 0.22},
            "maple": {"type": "plastic", "albedo": {"texture": "board"}, "roughness": 0.3}, "walnut": {"type": "plastic", "albedo": {"texture": "board2"}, "roughness": 0.3},
            "table": {"type": "plastic", "albedo": {"texture": "table"}, "roughness": 0.4}, "wall": {"type": "diffuse", "albedo": [0.05, 0.042, 0.04]},
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "radiance": [0.10, 0.085, 0.07]}],
        "outputs": [{"file": "chess.png", "exposure": 0.35}],
    }


def jewels(folder):
    """A ring and cut stones with dispersion."""
    rng = np.random.default_rng(6)
    brilliant(folder / "brilliant.ply")
    # A step cut: octagons that grow and shrink.
    octagon = lambda a, b, c, y: [(x, y, z) for x, z in [(a, b - c), (a - c, b), (c - a, b), (-a, b - c), (-a, c - b), (c - a, -b), (a - c, -b), (a, c - b)]]
    step = octagon(0.62, 0.42, 0.12, 0.30) + octagon(0.82, 0.61, 0.16, 0.20) + octagon(0.95, 0.73, 0.2, 0.05) + octagon(0.95, 0.73, 0.2, -0.02)
    step += octagon(0.72, 0.52, 0.15, -0.33) + octagon(0.42, 0.24, 0.09, -0.60) + [(0.26, -0.74, 0), (-0.26, -0.74, 0)]
    convex(folder / "step.ply", step)
    stone = lambda material, file, size, x, z, tilt, angle, y=None: mesh(
        material, file, {"scale": size}, turn(tilt, (1, 0, 0)), turn(angle), move(x, y if y is not None else 0.6 * size, z), shading="flat", name=material)
    shapes = sweep(folder, "silk", back=-9, front=6)
    # The ring stands, leaning back a little; a solitaire in six prongs, and small stones in a row.
    lean = [turn(90, (1, 0, 0)), turn(0, (0, 0, 1)), move(0, 1.06, 0)]
    pose = [turn(-9, (1, 0, 0)), turn(24), move(-0.25, 0.0, 0)]
    shapes.append(ring("gold", 0.98, 0.085, {"scale": [1, 1.35, 1]}, *lean, *pose))
    shapes.append(mesh("diamond", "brilliant.ply", {"scale": 0.46}, move(0, 2.55, 0), *pose, shading="flat", name="solitaire"))
    for k in range(6):
        a = math.radians(60 * k + 30)
        c, s = math.cos(a), math.sin(a)
        shapes.append({"type": "curves", "material": "gold", "basis": "catmull_rom", "strands": [[
            [0.08 * c, 2.0, 0.08 * s, 0.035], [0.08 * c, 2.0, 0.08 * s, 0.035], [0.25 * c, 2.25, 0.25 * s, 0.035], [0.45 * c, 2.52, 0.45 * s, 0.03], [0.455 * c, 2.62, 0.455 * s, 0.03], [0.43 * c, 2.645, 0.43 * s, 0.028], [0.43 * c, 2.645, 0.43 * s, 0.02]]],
            "transform": pose})
    shapes.append(ring("gold", 0.24, 0.03, move(0, 2.25, 0), *pose))
    for side in (-1, 1):
        for k in range(6):
            a = side * (15 + 11.0 * k)
            shapes.append(mesh("diamond", "brilliant.ply", {"scale": 0.078 - 0.003 * k}, move(0, 1.12, 0), turn(-a, (0, 0, 1)), move(0, 1.06, 0), *pose, shading="flat"))
    shapes += [
        stone("emerald", "step.ply", 0.52, 1.55, 0.85, 32, -25, 0.40), stone("sapphire", "brilliant.ply", 0.50, -1.75, 0.75, 47, 35, 0.385), stone("ruby", "brilliant.ply", 0.36, 0.62, 1.45, 47, -50, 0.275),
        stone("diamond", "brilliant.ply", 0.30, -0.72, 1.6, 47, 120, 0.23), stone("diamond", "brilliant.ply", 0.40, 1.5, -0.75, 47, 190, 0.31), stone("ruby", "step.ply", 0.30, -2.55, 1.45, 32, 65, 0.23),
        stone("sapphire", "step.ply", 0.36, 2.5, 0.15, 32, 55, 0.28), stone("diamond", "brilliant.ply", 0.20, 2.2, 1.5, 47, 20, 0.155), stone("diamond", "brilliant.ply", 0.17, -1.5, 1.95, 47, 80, 0.13),
        stone("emerald", "brilliant.ply", 0.30, -2.2, -0.45, 47, 260, 0.23),
    ]
    for _ in range(12):
        a, b = rng.uniform(0, 2 * math.pi), rng.uniform(0.25, 1.2)
        at = np.array([math.cos(a) * math.cos(b), math.sin(b), math.sin(a) * math.cos(b)]) * 9
        shapes.append(ball("lamp", at, 0.16, emission={"radiance": [90, 84, 76]}))
    shapes += [
        lamp([-6.5, 2.0, -1], [0, 0, 5], [1.2, 4.5, 0], [4.2, 4.3, 4.8]), lamp([6.5, 3.0, -3.5], [0, 0, 1.6], [-1, 4.0, 0], [9, 8.2, 7.2]), lamp([-2.5, 7, -3], [5, 0, 0], [0, 0.8, 3], [3, 3, 3]),
    ]
    gem = lambda ior, color, abbe: {"type": "dielectric", "ior": ior, "abbe": abbe, "absorption": {"color": color, "distance": 0.35}, "priority": 1}
    return {
        "film": {"width": 1280, "height": 800},
        "camera": {"position": [0.3, 2.7, 8.3], "look_at": [0.05, 1.12, 0.2], "vertical_fov_degrees": 24, "lens": {"radius": 0.05, "focus_point": [-0.1, 1.9, 0.4]}},
        "integrator": {"type": "path", "max_depth": 40, "rr_depth": 20, "clamp": 12},
        "sampler": {"spp": 20},
        "materials": LAMP | {
            "silk": {"type": "principled", "base_color": [0.035, 0.03, 0.06], "roughness": 0.38, "sheen": 0.6, "specular": 0.5},
            "gold": {"type": "conductor", "metal": "gold", "roughness": 0.09},
            "diamond": {"type": "dielectric", "ior": 2.417, "abbe": 40, "priority": 1},
            "ruby": gem(1.77, [0.95, 0.05, 0.12], 60), "sapphire": gem(1.77, [0.06, 0.16, 0.90], 60), "emerald": gem(1.58, [0.04, 0.75, 0.30], 60),
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "radiance": [0.10, 0.10, 0.12]}],
        "outputs": [{"file": "jewels.png", "exposure": 0.4}],
    }


def flacon(folder):
    """A product shot: a bottle of scent between softboxes."""
    rounded_box(folder / "outer.ply", [0.80, 1.0, 0.36], 0.10)
    rounded_box(folder / "inner.ply", [0.64, 0.78, 0.22], 0.09)
    rounded_box(folder / "liquid.ply", [0.66, 0.63, 0.24], 0.10)
    rounded_box(folder / "cap.ply", [0.34, 0.30, 0.25], 0.035)
    rounded_box(folder / "plinth.ply", [1.5, 0.35, 1.0], 0.03)
    marble = noise((512, 512), (3, 3), 9, 7, 0.55)
    veins = np.exp(-np.abs(noise((512, 512), (2, 3), 10, 6, 0.6)) * 14)[..., None]
    write_png(folder / "marble.png", np.clip(np.array([0.91, 0.87, 0.85]) + 0.03 * marble[..., None] - 0.34 * veins * np.array([0.8, 0.95, 0.95]), 0, 1))
    label = np.zeros((256, 256))
    yy, xx = np.mgrid[-1:1:256j, -1:1:256j]
    radius = np.hypot(xx, yy)
    label[(np.abs(radius - 0.86) < 0.02) | (np.abs(radius - 0.78) < 0.008)] = 1
    # A star of eight petals.
    petals = 0.52 * np.abs(np.cos(4 * np.arctan2(yy, xx))) ** 0.8 + 0.08
    label[radius < petals] = 1
    write_png(folder / "label.png", np.dstack([label] * 3))
    y = 1.0
    shapes = sweep(folder, "paper", back=-4.5, front=7)
    shapes += [
        mesh("marble", "plinth.ply", turn(-14), move(0, 0.35, 0), name="plinth"),
        mesh("glass", "outer.ply", turn(-14), move(0, 0.70 + y, 0), name="bottle"),
        mesh("air", "inner.ply", turn(-14), move(0, 0.70 + y + 0.06, 0), name="hollow"),
        mesh("scent", "liquid.ply", turn(-14), move(0, 0.70 + y - 0.11, 0), name="scent"),
        {"type": "cylinder", "material": "gold", "radius": 0.17, "height": 0.22, "transform": [UPRIGHT, move(0, 0.70 + 2.0, 0)]},
        ring("gold", 0.20, 0.035, move(0, 0.70 + 2.06, 0)),
        mesh("black", "cap.ply", turn(-14), move(0, 0.70 + 2.47, 0), name="cap"),
        mesh("gold", "cap.ply", {"scale": [1.012, 0.09, 1.012]}, turn(-14), move(0, 0.70 + 2.22, 0), name="band"),
        tube("cord", [(0, 2.72, 0), (0.01, 2.2, 0), (0.02, 1.5, 0), (0.10, 0.98, 0.02)], 0.018),
        # A pearl or two, and petals of glass.
        ball("pearl", [1.02, 0.82, 0.55], 0.12), ball("pearl", [1.22, 0.79, 0.28], 0.09), ball("pearl", [-1.12, 0.80, 0.62], 0.10),
        {"type": "quad", "material": "gold", "opacity": {"texture": "label"}, "transform": [{"scale": 0.36}, move(0, 0, 0.366), turn(-14), move(0, 1.72, 0)]},
        lamp([-4.2, 0.6, -1.0], [0, 0, 3.0], [0, 4.4, 0], [7.5, 7.2, 7.0]), lamp([4.2, 0.9, -2.2], [0, 0, 1.0], [0, 4.2, 0], [13, 11.5, 10.5]),
        lamp([-1.4, 6.2, -1.8], [2.8, 0, 0], [0, 0.3, 2.0], [6, 5.6, 5.4]),
        {"type": "disk", "material": "lamp", "radius": 1.5, "transform": [move(0.1, 2.0, -4.2)], "emission": {"radiance": [2.6, 1.55, 1.25]}},
    ]
    # The disk of light behind is seen through the glass, blurred by the lens.
    return {
        "film": {"width": 1280, "height": 1024},
        "camera": {"position": [0, 2.05, 9.2], "look_at": [0, 1.78, 0], "vertical_fov_degrees": 23, "lens": {"radius": 0.09, "focus_point": [0, 1.7, 0.35]}},
        "integrator": {"type": "path", "max_depth": 32, "rr_depth": 16, "clamp": 10},
        "sampler": {"spp": 16},
        "textures": {"marble": {"type": "image", "file": "marble.png", "scale": [0.45, 0.45]}, "label": {"type": "image", "file": "label.png", "filter": "bilinear"}},
        "materials": LAMP | {
            "paper": {"type": "diffuse", "albedo": [0.62, 0.40, 0.35]},
            "marble": {"type": "plastic", "albedo": {"texture": "marble"}, "roughness": 0.15},
            "glass": {"type": "dielectric", "ior": 1.5, "priority": 1, "absorption": {"color": [0.98, 0.97, 0.96], "distance": 1}},
            "air": {"type": "dielectric", "ior": 1, "priority": 2},
            "scent": {"type": "dielectric", "ior": 1.37, "priority": 3, "absorption": {"color": [0.97, 0.62, 0.36], "distance": 0.6}},
            "gold": {"type": "conductor", "metal": "gold", "roughness": 0.2},
            "black": {"type": "coated", "base": "ink", "roughness": 0.05}, "ink": {"type": "diffuse", "albedo": [0.025, 0.018, 0.018]},
            "cord": {"type": "diffuse", "albedo": [0.8, 0.78, 0.75]},
            "pearl": {"type": "principled", "base_color": [0.90, 0.84, 0.80], "roughness": 0.22, "specular": 0.7, "clearcoat": 0.6, "sheen": 0.3},
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "radiance": [0.30, 0.25, 0.24]}],
        "outputs": [{"file": "flacon.png", "exposure": 0.0}],
    }


def cradle(folder):
    """Newton's cradle with an open shutter: motion blur."""
    rounded_box(folder / "base.ply", [1.9, 0.14, 1.05], 0.06)
    wood = noise((256, 512), (2, 8), 3, 6, 0.55)
    write_png(folder / "wood.png", np.clip(np.array([0.36, 0.21, 0.13]) * (1 + 0.28 * np.sin(30 * wood) * 0.5 + 0.25 * wood)[..., None], 0, 1))
    shapes = sweep(folder, "wall", back=-3.5, front=7)
    shapes.append(mesh("wood", "base.ply", move(0, 0.14, 0), name="base"))
    top, length, radius = 3.0, 2.1, 0.30
    for z in (-0.8, 0.8):
        frame = [(-1.65, 0.28, z), (-1.65, 1.5, z), (-1.65, top - 0.25, z), (-1.58, top - 0.07, z), (-1.4, top, z), (0, top, z), (1.4, top, z), (1.58, top - 0.07, z), (1.65, top - 0.25, z), (1.65, 1.5, z), (1.65, 0.28, z)]
        shapes.append(tube("chrome", frame, 0.05))
    objects = {"pendulum": {"shapes": [
        ball("chrome", [0, -length, 0], radius),
        tube("thread", [(0, 0, -0.8), (0, -length * 0.5, -0.4), (0, -length + radius * 0.9, -0.04)], 0.008),
        tube("thread", [(0, 0, 0.8), (0, -length * 0.5, 0.4), (0, -length + radius * 0.9, 0.04)], 0.008),
    ]}}
    instances = []
    for k in range(5):
        at = (k - 2) * 2 * radius * 1.003
        instance = {"object": "pendulum", "transform": [move(at, top, 0)]}
        if k == 4:
            # The last one swings out while the shutter is open.
            swing = lambda degrees: [move(-at, -top, 0), turn(degrees, (0, 0, 1)), move(at, top, 0)]
            instance["motion"] = [{"time": 0, "transform": swing(19)}, {"time": 0.72, "transform": swing(38)}, {"time": 1, "transform": swing(39.5)}]
        instances.append(instance)
    shapes += [
        lamp([-5.5, 1.0, -2.5], [0, 0, 6], [1.0, 5, 0], [5.5, 5.8, 6.4]), lamp([8.2, 1.5, -2.4], [0, 0, 2.0], [-0.4, 5.2, 0], [19, 15, 11]),
        lamp([-2.0, 7.0, -1.5], [4, 0, 0], [0, 0, 2.2], [6, 5.8, 5.5]),
    ]
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {"position": [-2.2, 2.2, 8.2], "look_at": [0.42, 1.42, 0], "vertical_fov_degrees": 26, "lens": {"radius": 0.05, "focus_point": [0, 1.0, 0.3]}},
        "integrator": {"type": "path", "max_depth": 16},
        "sampler": {"spp": 24},
        "textures": {"wood": {"type": "image", "file": "wood.png", "scale": [0.35, 0.35]}},
        "materials": LAMP | {
            "wall": {"type": "plastic", "albedo": [0.05, 0.17, 0.19], "roughness": 0.55},
            "wood": {"type": "plastic", "albedo": {"texture": "wood"}, "roughness": 0.2},
            "chrome": {"type": "conductor", "metal": "chromium", "roughness": 0.06, "tint": 1}, "thread": {"type": "diffuse", "albedo": [0.6, 0.58, 0.55]},
        },
        "shapes": shapes, "objects": objects, "instances": instances,
        "lights": [{"type": "environment", "radiance": [0.12, 0.13, 0.14]}],
        "outputs": [{"file": "cradle.png", "exposure": 0.3}],
    }



def drinks(folder):
    """Glasses before a bright field, as photographers light them: dark edges, clear drinks."""
    rng = np.random.default_rng(12)
    rounded_box(folder / "ice.ply", [0.17, 0.16, 0.17], 0.045)
    yy, xx = np.mgrid[-1:1:512j, -1:1:512j]
    radius, angle = np.hypot(xx, yy), np.arctan2(yy, xx)
    flesh = 0.75 + 0.14 * noise((512, 512), (40, 40), 2, 3)
    image = np.dstack([np.clip(flesh * 1.25, 0, 1), flesh * 0.62, flesh * 0.07])
    spoke = np.abs((angle / (2 * math.pi) * 10) % 1 - 0.5) * radius
    image[(spoke > 0.5 * radius - 0.025) | (radius < 0.07) | (radius > 0.86)] = [0.98, 0.88, 0.62]
    image[radius > 0.94] = [0.96, 0.50, 0.03]
    write_png(folder / "orange.png", image)
    write_png(folder / "slice.png", np.dstack([radius < 0.995] * 3))
    tumbler = lambda r, h: [[0, 0], [r - 0.1, 0], [r - 0.04, 0.0], [r - 0.005, 0.03], [r, 0.1], [r + 0.02, h * 0.5], [r + 0.04, h - 0.02], [r + 0.035, h + 0.01], [r + 0.005, h + 0.01], [r, h - 0.02],
                            [r - 0.02, h * 0.5], [r - 0.04, 0.2], [r - 0.06, 0.16], [r - 0.12, 0.14], [0, 0.14]]
    inside = lambda r, h, level: [[0, 0.10], [r - 0.14, 0.10], [r - 0.03, 0.16], [r - 0.022, 0.22], [r + 0.0, h * 0.5], [r + 0.012, level - 0.02], [r + 0.012, level], [r + 0.012, level], [r - 0.1, level], [0, level]]
    coupe = [[0, 0.03], [0.15, 0.025], [0.42, 0.0], [0.45, 0.0], [0.45, 0.018], [0.36, 0.04], [0.12, 0.07], [0.045, 0.14], [0.036, 0.3], [0.036, 0.75], [0.042, 0.95], [0.10, 1.03], [0.40, 1.12], [0.60, 1.30], [0.635, 1.52],
             [0.63, 1.545], [0.615, 1.545], [0.60, 1.50], [0.565, 1.31], [0.38, 1.15], [0.09, 1.075], [0, 1.07]]
    coupe_fill = [[0, 1.055], [0.08, 1.06], [0.39, 1.135], [0.58, 1.30], [0.592, 1.36], [0.594, 1.38], [0.594, 1.38], [0.5, 1.38], [0, 1.38]]
    flute = [[0, 0.03], [0.12, 0.025], [0.33, 0.0], [0.36, 0.0], [0.36, 0.018], [0.28, 0.04], [0.1, 0.07], [0.045, 0.14], [0.036, 0.3], [0.036, 0.72], [0.05, 0.82], [0.18, 1.0], [0.255, 1.3], [0.265, 1.7], [0.235, 2.18],
             [0.228, 2.2], [0.215, 2.2], [0.212, 2.17], [0.24, 1.7], [0.23, 1.31], [0.155, 1.02], [0.05, 0.90], [0, 0.88]]
    flute_fill = [[0, 0.86], [0.05, 0.88], [0.168, 1.01], [0.243, 1.3], [0.253, 1.68], [0.24, 1.90], [0.239, 1.93], [0.239, 1.93], [0.15, 1.93], [0, 1.93]]
    shapes = [
        quad("table", [-12, 0, 9], [24, 0, 0], [0, 0, -14]),
        turned("glass", tumbler(0.46, 1.05), move(-1.62, 0.001, 0.35)), turned("amber", inside(0.46, 1.05, 0.72), move(-1.62, 0.001, 0.35)),
        turned("glass", coupe, move(0.05, 0.001, 0.15)), turned("rose", coupe_fill, move(0.05, 0.001, 0.15)),
        turned("glass", tumbler(0.36, 1.75), move(1.52, 0.001, 0.30)), turned("lime", inside(0.36, 1.75, 1.50), move(1.52, 0.001, 0.30)),
        turned("glass", flute, move(-0.78, 0.001, -0.75)), turned("sparkling", flute_fill, move(-0.78, 0.001, -0.75)),
        turned("glass", flute, move(2.42, 0.001, -0.65)), turned("sparkling", flute_fill, move(2.42, 0.001, -0.65)),
    ]
    for x, y, z, a, b in [(-1.72, 0.42, 0.32, 20, 8), (-1.48, 0.62, 0.40, 60, 25), (1.47, 0.45, 0.31, 10, 12), (1.56, 0.80, 0.28, 50, -16), (1.45, 1.12, 0.33, 75, 20), (1.56, 1.42, 0.30, 15, 30)]:
        shapes.append(mesh("ice", "ice.ply", turn(b, (0.3, 0, 1)), turn(a), move(x, y, z)))
    # Bubbles rise in the flutes.
    for at in (-0.78, 2.42):
        for _ in range(110):
            y = rng.uniform(0.95, 1.92)
            r = min(0.2, 0.03 + 0.35 * (y - 0.88)) * math.sqrt(rng.uniform()) * 0.85
            a = rng.uniform(0, 2 * math.pi)
            shapes.append(ball("bubble", [at + r * math.cos(a), y, (-0.75 if at < 0 else -0.65) + r * math.sin(a)], rng.uniform(0.007, 0.014)))
    # A slice of orange on the tumbler's rim, cherries beside, and a straw.
    for flip in (0, 180):
        shapes.append({"type": "quad", "material": "orange", "opacity": {"texture": "slice"}, "transform": [{"scale": 0.30}, move(0, 0, 0.0175), turn(flip), turn(20), move(-1.18, 1.14, 0.46)]})
    shapes.append({"type": "cylinder", "material": "peel", "radius": 0.30, "height": 0.035, "transform": [move(0, 0, -0.0175), turn(20), move(-1.18, 1.14, 0.46)]})
    for x, z, r in [(-0.52, 1.05, 0.15), (-0.20, 1.22, 0.14), (0.62, 1.15, 0.145)]:
        shapes.append(ball("cherry", [x, r, z], r))
        shapes.append(tube("stem", [(x, 1.9 * r, z), (x + 0.02, 0.42, z), (x + 0.14, 0.66, z - 0.06)], 0.012))
    shapes.append({"type": "cylinder", "material": "straw", "radius": 0.028, "height": 2.3, "transform": [UPRIGHT, turn(-11, (0, 0, 1)), move(1.36, 0.2, 0.30)]})
    v = np.linspace(-1, 1, 256)
    field = np.exp(-1.5 * (v[None, :] * 1.05) ** 2 - 1.3 * ((v[:, None] + 0.1)) ** 2)
    write_png(folder / "field.png", np.dstack([field] * 3))
    shapes += [
        {"type": "quad", "material": "lamp", "origin": [-6.5, -0.4, -5], "edge_u": [13, 0, 0], "edge_v": [0, 6.4, 0], "emission": {"radiance": [3.4, 2.55, 1.95], "texture": "field"}},
        lamp([-6, 1.0, 1.0], [0, 0, 2.5], [0.6, 3.6, 0], [3.0, 3.0, 3.2]), lamp([-1.5, 6.2, 0.5], [3, 0, 0], [0, 0, 2.2], [3.5, 3.4, 3.3]),
    ]
    drink = lambda ior, color, distance: {"type": "dielectric", "ior": ior, "priority": 1, "absorption": {"color": color, "distance": distance}}
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {"position": [0.42, 1.35, 8.4], "look_at": [0.42, 1.06, 0], "vertical_fov_degrees": 22.5, "lens": {"radius": 0.04, "focus_point": [0, 1, 0.4]}},
        "integrator": {"type": "path", "max_depth": 48, "rr_depth": 16, "clamp": 8},
        "sampler": {"spp": 12},
        "textures": {"orange": {"type": "image", "file": "orange.png", "filter": "bilinear"}, "slice": {"type": "image", "file": "slice.png", "filter": "bilinear"}, "field": {"type": "image", "file": "field.png", "color_space": "linear"}},
        "materials": LAMP | {
            "table": {"type": "plastic", "albedo": [0.035, 0.025, 0.022], "roughness": 0.12},
            "glass": {"type": "dielectric", "ior": 1.5, "priority": 3}, "ice": {"type": "dielectric", "ior": 1.31, "priority": 2, "roughness": 0.1}, "bubble": {"type": "dielectric", "ior": 1, "priority": 2},
            "amber": drink(1.36, [0.86, 0.33, 0.03], 0.55), "rose": drink(1.35, [0.93, 0.16, 0.20], 0.6), "lime": drink(1.34, [0.70, 0.93, 0.42], 0.5), "sparkling": drink(1.34, [0.96, 0.80, 0.38], 0.5),
            "orange": {"type": "diffuse", "albedo": {"texture": "orange"}}, "peel": {"type": "plastic", "albedo": [0.95, 0.36, 0.02], "roughness": 0.4},
            "cherry": {"type": "plastic", "albedo": [0.42, 0.01, 0.02], "roughness": 0.08}, "stem": {"type": "diffuse", "albedo": [0.25, 0.18, 0.07]}, "straw": {"type": "plastic", "albedo": [0.75, 0.10, 0.16], "roughness": 0.3},
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "radiance": [0.05, 0.045, 0.05]}],
        "outputs": [{"file": "drinks.png", "exposure": 0.3}],
    }


def fluffy(folder):
    """Two creatures of fur: 60,000 strands."""
    rng = np.random.default_rng(7)

    def fur(file, count, center, radii, length, thickness, keep=lambda n: True, droop=0.35):
        strands = []
        while len(strands) < count:
            n = rng.normal(size=3)
            n /= np.linalg.norm(n)
            if not keep(n):
                continue
            root = np.array(center) + n * radii
            out = n / np.array(radii)
            out /= np.linalg.norm(out)
            side = np.cross(out, rng.normal(size=3))
            side /= np.linalg.norm(side)
            # Tufts: neighbours curl the same way.
            lean = 0.45 * np.array([math.sin(9 * n[0] + 4 * n[1]), math.sin(7 * n[1] + 5 * n[2]), math.sin(8 * n[2] + 3 * n[0])]) + 0.35 * side
            l = length * rng.uniform(0.6, 1.15)
            points = []
            for t in (0, 0.25, 0.5, 0.75, 1.0):
                p = root + l * (out * t * (1 - 0.25 * t) + lean * t * t * 0.75 + np.array([0, -droop * t * t, 0]))
                points.append([*p, thickness * (1 - 0.85 * t)])
            strands.append([points[0]] + points + [points[-1]])
        write_strands(folder / file, strands)

    def creature(name, at, s, coat, look):
        """A round body with eyes; its fur leaves the face free."""
        eye = np.array([0.30, 0.22, 0.90])
        free = lambda n: all(np.linalg.norm(n - np.array([side * eye[0], eye[1], eye[2]]) / np.linalg.norm(eye)) > 0.235 for side in (-1, 1)) and np.linalg.norm(n - np.array([0, -0.05, 1])) > 0.16
        fur(f"{name}.strands", 26000, [0, 1, 0], np.array([0.98, 0.95, 0.98]), 0.42, 0.0095, free)
        fur(f"{name}_feet.strands", 4000, [0, 0, 0], np.array([0.20, 0.13, 0.27]), 0.13, 0.007, lambda n: n[1] > -0.4)
        place = [{"scale": s}, turn(look), move(at[0], 0, at[1])]
        part = lambda shape: {**shape, "transform": shape.get("transform", []) + place}
        parts = [part(ball("skin " + coat, [0, 1, 0], 0.97)), part({"type": "curves", "material": coat, "file": f"{name}.strands", "basis": "b_spline"})]
        for side in (-1, 1):
            e = np.array([side * 0.305, 1.235, 0.90])
            parts += [part(ball("white", e, 0.225)), part(ball("iris", e + [-0.012 * side, 0.0, 0.088], 0.162)), part(ball("pupil", e + [-0.016 * side, 0, 0.152], 0.106)), part(ball("cornea", e + [0, 0, 0.012], 0.245))]
            parts.append(part({"type": "curves", "material": coat, "file": f"{name}_feet.strands", "basis": "b_spline", "transform": [move(side * 0.40, 0.13, 0.72)]}))
            parts.append(part({**ball("horn", [0, 0, 0], 1), "type": "cone", "radius": 0.11, "height": 0.34, "transform": [UPRIGHT, turn(-24 * side, (0, 0, 1)), move(side * 0.42, 1.82, 0.1)]}))
            parts[-1].pop("z_min", None)
        parts.append(part({**ball("nose", [0, 0, 0], 1), "transform": [{"scale": [0.115, 0.085, 0.08]}, move(0, 1.0, 1.05)]}))
        return parts

    shapes = sweep(folder, "floor", back=-4.5, front=8)
    shapes += creature("big", (-0.78, -0.25), 1.0, "teal", 14) + creature("small", (1.25, 0.55), 0.66, "peach", -16)
    for x, z, r, m in [(2.45, -0.5, 0.34, "candy0"), (-2.35, 0.75, 0.20, "candy1"), (0.22, 1.55, 0.11, "candy2"), (-1.85, 1.45, 0.12, "candy0"), (2.25, 1.15, 0.15, "candy2"), (-2.75, -0.9, 0.42, "candy2"), (3.1, 0.6, 0.12, "candy1")]:
        shapes.append(ball(m, [x, r, z], r))
    shapes += [lamp([-5, 2.2, 2.5], [0, 0, 3.2], [1.4, 3.2, 0], [9, 8.6, 8.2]), lamp([4.8, 2.5, -3.4], [0, 0, 2], [-0.8, 3.4, 0], [17, 13, 11]), lamp([-1.5, 6.5, -2.5], [3, 0, 0], [0, 0, 2.4], [6, 6, 6.4])]
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {"position": [0.15, 1.55, 8.4], "look_at": [0.15, 1.02, 0], "vertical_fov_degrees": 23, "lens": {"radius": 0.06, "focus_point": [-0.3, 1.2, 0.8]}},
        "integrator": {"type": "path", "max_depth": 12},
        "sampler": {"spp": 4},
        "materials": LAMP | {
            "floor": {"type": "diffuse", "albedo": [0.80, 0.62, 0.30]},
            "teal": {"type": "hair", "color": [0.05, 0.42, 0.46], "azimuthal_roughness": 0.35, "longitudinal_roughness": 0.35}, "peach": {"type": "hair", "color": [0.88, 0.40, 0.30], "azimuthal_roughness": 0.35, "longitudinal_roughness": 0.35},
            "skin teal": {"type": "diffuse", "albedo": [0.02, 0.15, 0.17]}, "skin peach": {"type": "diffuse", "albedo": [0.5, 0.18, 0.13]},
            "white": {"type": "diffuse", "albedo": 0.85}, "iris": {"type": "diffuse", "albedo": [0.30, 0.13, 0.03]}, "pupil": {"type": "diffuse", "albedo": 0.01}, "cornea": {"type": "thin_dielectric"},
            "horn": {"type": "plastic", "albedo": [0.85, 0.76, 0.6], "roughness": 0.25}, "nose": {"type": "plastic", "albedo": [0.08, 0.03, 0.03], "roughness": 0.12},
            "candy0": {"type": "plastic", "albedo": [0.85, 0.12, 0.16], "roughness": 0.1}, "candy1": {"type": "plastic", "albedo": [0.12, 0.35, 0.65], "roughness": 0.1}, "candy2": {"type": "plastic", "albedo": [0.92, 0.86, 0.78], "roughness": 0.1},
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "radiance": [0.32, 0.34, 0.38]}],
        "outputs": [{"file": "fluffy.png", "exposure": 0.3}],
    }


def attractor(_):
    """A wire along Lorenz' attractor: one strand of 6,200 segments."""
    p, points = np.array([0.1, 0.0, 20.0]), []
    for i in range(6500):
        for _ in range(4):
            x, y, z = p
            p = p + 0.0019 * np.array([10 * (y - x), x * (28 - z) - y, x * y - 8 / 3 * z])
        if i >= 300:
            points.append([p[0] * 0.105, (p[2] - 25) * 0.088 + 2.14, p[1] * 0.075])
    shapes = [
        quad("floor", [-30, 0, 20], [60, 0, 0], [0, 0, -40]),
        {"type": "curves", "material": "gold", "basis": "catmull_rom", "strands": [[[*np.round(point, 4), 0.02] for point in points]], "transform": [turn(28)], "name": "wire"},
        {"type": "cylinder", "material": "plinth", "radius": 1.05, "height": 0.32, "transform": [UPRIGHT]},
        disk("plinth", [0, 0.32, 0], 1.05),
        lamp([-8.0, 0.6, -1.0], [0, 0, 5], [1.6, 6.0, 0], [8, 9, 11]), lamp([8.0, 0.6, -3.2], [0, 0, 3.0], [0, 6.4, 0], [20, 12.5, 7]), lamp([-1.4, 6.6, -1.2], [2.8, 0, 0], [0, 0, 2.6], [8, 7.4, 7]),
    ]
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {"position": [0.5, 2.6, 9.2], "look_at": [0, 1.95, 0], "vertical_fov_degrees": 29, "lens": {"radius": 0.05, "focus_distance": 8.9}},
        "integrator": {"type": "path", "max_depth": 12},
        "sampler": {"spp": 20},
        "materials": LAMP | {
            "floor": {"type": "plastic", "albedo": [0.012, 0.014, 0.02], "roughness": 0.28}, "plinth": {"type": "plastic", "albedo": [0.02, 0.02, 0.024], "roughness": 0.2},
            "gold": {"type": "conductor", "metal": "gold", "roughness": 0.22},
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "radiance": [0.012, 0.014, 0.02]}],
        "outputs": [{"file": "attractor.png", "exposure": 0.3}],
    }


def loft(folder):
    """A living room in the afternoon."""
    rng = np.random.default_rng(2)
    planks = np.zeros((1024, 1024, 3))
    for k in range(12):
        rows = slice(k * 1024 // 12, (k + 1) * 1024 // 12)
        grain = noise((rows.stop - rows.start, 1024), (6, 2), 60 + k, 6, 0.6)
        tone = np.array([0.60, 0.44, 0.30]) * rng.uniform(0.86, 1.08)
        planks[rows] = tone * (1 + 0.10 * np.sin(22 * grain) * 0.5 + 0.12 * grain)[..., None]
        planks[rows.start:rows.start + 3] *= 0.5
        joint = rng.integers(0, 1024)
        planks[rows, joint:joint + 3] *= 0.5
    write_png(folder / "planks.png", planks)
    weave = 0.05 * noise((512, 512), (128, 128), 1, 2)[..., None]
    write_png(folder / "weave.png", np.array([0.78, 0.74, 0.68]) * (0.95 + weave) ** 1.0)
    rug = np.ones((512, 768, 3)) * [0.86, 0.82, 0.75] * (1 + 0.06 * noise((512, 768), (90, 130), 4, 3)[..., None])
    yy, xx = np.mgrid[0:512, 0:768]
    diamond = (np.abs((xx % 192) - 96) / 96 + np.abs((yy % 170) - 85) / 85)
    rug[(diamond > 0.80) & (diamond < 0.92)] = [0.30, 0.25, 0.22]
    write_png(folder / "rug.png", rug)
    art = np.ones((640, 480, 3)) * [0.93, 0.90, 0.84]
    yy, xx = np.mgrid[0:640, 0:480]
    art[(xx - 300) ** 2 + (yy - 210) ** 2 < 118 ** 2] = [0.80, 0.36, 0.20]
    art[(xx - 175) ** 2 + (yy - 470) ** 2 < 150 ** 2] = [0.16, 0.29, 0.32]
    art[(np.abs(yy - 330 - 30 * np.sin(xx / 60)) < 7)] = [0.12, 0.11, 0.10]
    write_png(folder / "art0.png", art)
    art = np.ones((640, 480, 3)) * [0.90, 0.87, 0.80]
    for k, color in enumerate([(0.85, 0.65, 0.35), (0.72, 0.42, 0.26), (0.40, 0.34, 0.30), (0.18, 0.26, 0.30)]):
        art[yy > 250 + 90 * k + 34 * np.sin(xx / (60 + 16 * k) + 1.7 * k)] = color
    art[(xx - 330) ** 2 + (yy - 150) ** 2 < 52 ** 2] = [0.87, 0.52, 0.28]
    write_png(folder / "art1.png", art)
    for name, half, radius, puff in [("seat", [0.70, 0.13, 0.46], 0.10, 0.05), ("back", [0.69, 0.33, 0.13], 0.11, 0.06), ("arm", [0.13, 0.31, 0.50], 0.09, 0.0), ("base", [1.42, 0.13, 0.50], 0.05, 0.0),
                                     ("cushion", [0.26, 0.26, 0.055], 0.05, 0.085), ("ottoman", [0.36, 0.19, 0.36], 0.11, 0.05)]:
        rounded_box(folder / f"{name}.ply", half, radius, puff)
    # A curtain hangs in folds.
    u = np.linspace(0, 1, 240)
    folds = 0.05 * np.sin(u * 2 * math.pi * 9 + 1.2 * np.sin(u * 9)) + 0.02 * np.sin(u * 2 * math.pi * 17)
    height_field(folder / "curtain.ply", np.tile(folds, (2, 1)), (1.0, 2.62))
    W, D, H = 3.4, 2.6, 2.8
    curtain = lambda z: mesh("linen", "curtain.ply", turn(90, (1, 0, 0)), turn(90), move(-W + 0.16, 1.36, z), name="curtain")
    shapes = [
        quad("planks", [-W, 0, 6], [2 * W, 0, 0], [0, 0, -6 - D]), quad("wall", [-W, 0, -D], [2 * W, 0, 0], [0, H, 0]), quad("white", [-W, H, 6], [2 * W, 0, 0], [0, 0, -6 - D], reverse_normal=True),
        quad("wall", [W, 0, -D], [0, 0, 6 + D], [0, H, 0]), quad("wall", [-W, 0, 6], [2 * W, 0, 0], [0, H, 0]),
        # The left wall has two windows down to the floor.
        box("wall", [-W - 0.1, 1.4, -2.25], [0.1, 1.4, 0.35]), box("wall", [-W - 0.1, 1.4, -0.1], [0.1, 1.4, 0.2]), box("wall", [-W - 0.1, 1.4, 3.9], [0.1, 1.4, 2.2]), box("wall", [-W - 0.1, 2.65, 0], [0.1, 0.15, 6]),
        box("white", [W - 0.02, 0.06, 1.7], [0.015, 0.06, 4.3]), box("white", [0, 0.06, -D + 0.015], [W, 0.06, 0.015]),
        quad("rug", [-1.75, 0.012, 1.55], [3.1, 0, 0], [0, 0, -2.2]),
        mesh("cloth", "base.ply", move(0.25, 0.30, -1.75), name="sofa"), mesh("cloth", "arm.ply", move(-1.30, 0.44, -1.75), name="sofa"), mesh("cloth", "arm.ply", move(1.80, 0.44, -1.75), name="sofa"),
        box("cloth", [0.25, 0.55, -2.17], [1.42, 0.30, 0.08], name="sofa"),
        curtain(-1.72), curtain(1.55), curtain(-0.15),
    ]
    for x in (-0.46, 0.96):
        shapes += [mesh("cloth", "seat.ply", move(x, 0.545, -1.70), name="sofa"), mesh("cloth", "back.ply", turn(-9, (1, 0, 0)), move(x, 0.93, -2.02), name="sofa")]
    for x in (-1.05, 1.55):
        for z in (-1.35, -2.12):
            shapes.append(cylinder("oak", [x, 0, z], 0.025, 0.2))
    for m, x, t, a in [("rust", -0.92, -18, 12), ("ink", -0.48, -20, -8), ("sand", 1.42, -18, -14), ("rust", 1.02, -22, 9)]:
        shapes.append(mesh(m, "cushion.ply", turn(8 * (1 if a > 0 else -1), (0, 0, 1)), turn(t, (1, 0, 0)), turn(a), move(x, 0.90, -1.70), name="cushion"))
    # Windows' frames.
    for z0, z1 in [(-1.9, -0.3), (0.1, 1.7)]:
        for z in (z0 + 0.03, (z0 + z1) / 2, z1 - 0.03):
            shapes.append(box("black", [-W - 0.1, 1.25, z], [0.03, 1.25, 0.025]))
        shapes += [box("black", [-W - 0.1, y, (z0 + z1) / 2], [0.03, 0.025, (z1 - z0) / 2]) for y in (0.03, 1.70, 2.47)]
    # Pictures.
    for k, x in enumerate((-0.25, 0.80)):
        shapes += [box("oak", [x, 1.92, -D + 0.02], [0.36, 0.47, 0.02]), quad(f"art{k}", [x - 0.33, 1.48, -D + 0.042], [0.66, 0, 0], [0, 0.88, 0])]
    # A round table with a vase, a bowl and books.
    shapes += [
        {"type": "cylinder", "material": "oak", "radius": 0.50, "height": 0.035, "transform": [UPRIGHT, move(-0.25, 0.36, 0.35)]}, disk("oak", [-0.25, 0.395, 0.35], 0.50), disk("oak", [-0.25, 0.36, 0.35], 0.50),
        turned("clay", [[0, 0], [0.06, 0], [0.09, 0.03], [0.125, 0.12], [0.11, 0.22], [0.045, 0.30], [0.04, 0.34], [0.055, 0.37], [0.045, 0.37], [0.03, 0.34]], move(-0.38, 0.395, 0.28)),
        turned("glaze", [[0, 0.02], [0.05, 0.0], [0.12, 0.03], [0.16, 0.085], [0.165, 0.09], [0.15, 0.085], [0.10, 0.04], [0, 0.035]], move(0.02, 0.395, 0.48)),
        box("ink", [-0.32, 0.41, 0.62], [0.13, 0.014, 0.095], turn(20)), box("sand", [-0.31, 0.437, 0.615], [0.12, 0.012, 0.085], turn(10)),
        mesh("rust", "ottoman.ply", move(1.75, 0.2, 0.55), name="ottoman"),
    ]
    for a in (40, 160, 280):
        c, d = math.cos(math.radians(a)), math.sin(math.radians(a))
        shapes.append(tube("oak", [(-0.25 + 0.40 * c, 0.0, 0.35 + 0.40 * d), (-0.25 + 0.30 * c, 0.36, 0.35 + 0.30 * d)], 0.02))
    # Branches in the vase, with leaves as small ellipsoids.
    for k in range(7):
        a, b = rng.uniform(0, 2 * math.pi), rng.uniform(0.10, 0.26)
        tip = (-0.38 + b * math.cos(a), 1.08 + rng.uniform(0, 0.22), 0.28 + b * math.sin(a))
        middle = (-0.38 + 0.35 * b * math.cos(a), 0.92, 0.28 + 0.35 * b * math.sin(a))
        shapes.append(tube("twig", [(-0.38, 0.70, 0.28), middle, tip], 0.004))
        for t in np.linspace(0.15, 1, 11):
            at = np.array(middle) * (1 - t) + np.array(tip) * t + rng.normal(0, 0.022, 3)
            shapes.append({"type": "sphere", "material": "leaf", "transform": [{"scale": [0.030, 0.006, 0.016]}, turn(rng.uniform(-50, 50), (0, 0, 1)), turn(rng.uniform(0, 360)), move(*at)]})
    # A floor lamp with a globe, lit, and a pendant.
    shapes += [
        cylinder("brass", [2.72, 0.0, -1.9], 0.012, 1.55), cylinder("brass", [2.72, 0.0, -1.9], 0.15, 0.02), disk("brass", [2.72, 0.02, -1.9], 0.15),
        ball("globe", [2.72, 1.68, -1.9], 0.15, emission={"radiance": [5.5, 3.7, 2.0]}),
        cylinder("black", [-0.25, 2.1, 0.35], 0.004, 0.7),
        turned("shade", [[0.03, 0.30], [0.05, 0.29], [0.10, 0.20], [0.26, 0.04], [0.30, 0.0]], move(-0.25, 1.86, 0.35)),
    ]
    # A plant in a pot.
    shapes += [turned("clay", [[0, 0], [0.15, 0], [0.19, 0.04], [0.21, 0.34], [0.20, 0.36], [0.17, 0.36], [0.165, 0.30], [0, 0.30]], move(-2.45, 0, -1.95))]
    blades = []
    for k in range(46):
        a, spread, top = rng.uniform(0, 2 * math.pi), rng.uniform(0.15, 0.72), rng.uniform(0.85, 1.75)
        c, d = math.cos(a), math.sin(a)
        path = [(0.03 * c, 0.30, 0.03 * d, 0.012), (0.03 * c, 0.30, 0.03 * d, 0.012), (0.25 * spread * c, 0.3 + 0.55 * top, 0.25 * spread * d, 0.024), (0.65 * spread * c, 0.92 * top, 0.65 * spread * d, 0.026), (spread * c, top * 0.82, spread * d, 0.010), (1.15 * spread * c, top * 0.66, 1.15 * spread * d, 0.001), (1.15 * spread * c, top * 0.66, 1.15 * spread * d, 0.001)]
        blades.append([list(np.round(q, 4)) for q in path])
    shapes.append({"type": "curves", "kind": "flat", "material": "leaf", "basis": "catmull_rom", "strands": blades, "transform": [move(-2.45, 0, -1.95)]})
    write_sky(folder / "sky.hdr", [0.35, 0.55, 0.95], [0.95, 1.0, 1.05], [0.35, 0.36, 0.30], [0.5, 0.4, 0.25], (-1, 0.5, 0.4))
    image = lambda file, scale=(1, 1): {"type": "image", "file": file, "scale": list(scale)}
    cloth = lambda r, g, b: {"type": "principled", "base_color": [r, g, b], "roughness": 0.85, "specular": 0.2, "sheen": 0.7}
    return {
        "film": {"width": 1280, "height": 800},
        "camera": {"position": [0.75, 1.32, 5.2], "look_at": [0.10, 1.10, -1.5], "vertical_fov_degrees": 35},
        "integrator": {"type": "path", "max_depth": 14, "clamp": 10},
        "sampler": {"spp": 40},
        "textures": {"planks": image("planks.png", (2, 2.6)), "rug": image("rug.png"), "weave": image("weave.png"), "art0": image("art0.png"), "art1": image("art1.png")},
        "materials": LAMP | {
            "planks": {"type": "plastic", "albedo": {"texture": "planks"}, "roughness": 0.4}, "wall": {"type": "diffuse", "albedo": [0.80, 0.77, 0.72]}, "white": {"type": "diffuse", "albedo": 0.85},
            "rug": {"type": "diffuse", "albedo": {"texture": "rug"}}, "cloth": cloth(0.50, 0.52, 0.49), "rust": cloth(0.52, 0.19, 0.08), "ink": cloth(0.06, 0.12, 0.15), "sand": cloth(0.72, 0.62, 0.47),
            "linen": {"type": "diffuse_transmission", "reflectance": [0.48, 0.46, 0.43], "transmittance": [0.42, 0.40, 0.36]},
            "oak": {"type": "plastic", "albedo": [0.42, 0.27, 0.15], "roughness": 0.4}, "black": {"type": "plastic", "albedo": 0.02, "roughness": 0.4}, "brass": {"type": "conductor", "metal": "brass", "roughness": 0.25},
            "art0": {"type": "diffuse", "albedo": {"texture": "art0"}}, "art1": {"type": "diffuse", "albedo": {"texture": "art1"}},
            "clay": {"type": "diffuse", "albedo": [0.60, 0.42, 0.32], "roughness": 0.6}, "glaze": {"type": "plastic", "albedo": [0.10, 0.22, 0.24], "roughness": 0.1}, "globe": {"type": "diffuse", "albedo": 0.7},
            "shade": {"type": "two_sided", "front": "black", "back": "inner"}, "inner": {"type": "conductor", "metal": "brass", "roughness": 0.35},
            "twig": {"type": "diffuse", "albedo": [0.20, 0.13, 0.08]}, "leaf": {"type": "diffuse_transmission", "reflectance": [0.09, 0.17, 0.06], "transmittance": [0.06, 0.12, 0.02]},
        },
        "shapes": shapes,
        "lights": [
            {"type": "environment", "file": "sky.hdr", "scale": 1.3},
            {"type": "directional", "direction": [0.80, -0.52, -0.34], "irradiance": [17, 13.5, 9.5], "angular_diameter_degrees": 0.53},
        ],
        "outputs": [{"file": "loft.png", "exposure": 1.15}],
    }


SCENES = [loft, chess, drinks, jewels, flacon, cradle, fluffy, attractor]
