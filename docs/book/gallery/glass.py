"""Things of glass."""

import math

import numpy as np

from parts import *


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
    tumbler = lambda r, h: [
        [0, 0],
        [r - 0.1, 0],
        [r - 0.04, 0.0],
        [r - 0.005, 0.03],
        [r, 0.1],
        [r + 0.02, h * 0.5],
        [r + 0.04, h - 0.02],
        [r + 0.035, h + 0.01],
        [r + 0.005, h + 0.01],
        [r, h - 0.02],
        [r - 0.02, h * 0.5],
        [r - 0.04, 0.2],
        [r - 0.06, 0.16],
        [r - 0.12, 0.14],
        [0, 0.14],
    ]
    inside = lambda r, h, level: [
        [0, 0.10],
        [r - 0.14, 0.10],
        [r - 0.03, 0.16],
        [r - 0.022, 0.22],
        [r + 0.0, h * 0.5],
        [r + 0.012, level - 0.02],
        [r + 0.012, level],
        [r + 0.012, level],
        [r - 0.1, level],
        [0, level],
    ]
    coupe = [
        [0, 0.03],
        [0.15, 0.025],
        [0.42, 0.0],
        [0.45, 0.0],
        [0.45, 0.018],
        [0.36, 0.04],
        [0.12, 0.07],
        [0.045, 0.14],
        [0.036, 0.3],
        [0.036, 0.75],
        [0.042, 0.95],
        [0.10, 1.03],
        [0.40, 1.12],
        [0.60, 1.30],
        [0.635, 1.52],
        [0.63, 1.545],
        [0.615, 1.545],
        [0.60, 1.50],
        [0.565, 1.31],
        [0.38, 1.15],
        [0.09, 1.075],
        [0, 1.07],
    ]
    coupe_fill = [[0, 1.055], [0.08, 1.06], [0.39, 1.135], [0.58, 1.30], [0.592, 1.36], [0.594, 1.38], [0.594, 1.38], [0.5, 1.38], [0, 1.38]]
    flute = [
        [0, 0.03],
        [0.12, 0.025],
        [0.33, 0.0],
        [0.36, 0.0],
        [0.36, 0.018],
        [0.28, 0.04],
        [0.1, 0.07],
        [0.045, 0.14],
        [0.036, 0.3],
        [0.036, 0.72],
        [0.05, 0.82],
        [0.18, 1.0],
        [0.255, 1.3],
        [0.265, 1.7],
        [0.235, 2.18],
        [0.228, 2.2],
        [0.215, 2.2],
        [0.212, 2.17],
        [0.24, 1.7],
        [0.23, 1.31],
        [0.155, 1.02],
        [0.05, 0.90],
        [0, 0.88],
    ]
    flute_fill = [[0, 0.86], [0.05, 0.88], [0.168, 1.01], [0.243, 1.3], [0.253, 1.68], [0.24, 1.90], [0.239, 1.93], [0.239, 1.93], [0.15, 1.93], [0, 1.93]]
    shapes = [
        quad("table", [-12, 0, 9], [24, 0, 0], [0, 0, -14]),
        turned("glass", tumbler(0.46, 1.05), move(-1.62, 0.001, 0.35)),
        turned("amber", inside(0.46, 1.05, 0.72), move(-1.62, 0.001, 0.35)),
        turned("glass", coupe, move(0.05, 0.001, 0.15)),
        turned("rose", coupe_fill, move(0.05, 0.001, 0.15)),
        turned("glass", tumbler(0.36, 1.75), move(1.52, 0.001, 0.30)),
        turned("lime", inside(0.36, 1.75, 1.50), move(1.52, 0.001, 0.30)),
        turned("glass", flute, move(-0.78, 0.001, -0.75)),
        turned("sparkling", flute_fill, move(-0.78, 0.001, -0.75)),
        turned("glass", flute, move(2.42, 0.001, -0.65)),
        turned("sparkling", flute_fill, move(2.42, 0.001, -0.65)),
    ]
    for x, y, z, a, b in [
        (-1.72, 0.42, 0.32, 20, 8),
        (-1.48, 0.62, 0.40, 60, 25),
        (1.47, 0.45, 0.31, 10, 12),
        (1.56, 0.80, 0.28, 50, -16),
        (1.45, 1.12, 0.33, 75, 20),
        (1.56, 1.42, 0.30, 15, 30),
    ]:
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
        shapes.append(
            {
                "type": "quad",
                "material": "orange",
                "opacity": {"texture": "slice"},
                "transform": [{"scale": 0.30}, move(0, 0, 0.0175), turn(flip), turn(20), move(-1.18, 1.14, 0.46)],
            }
        )
    shapes.append(
        {"type": "cylinder", "material": "peel", "radius": 0.30, "height": 0.035, "transform": [move(0, 0, -0.0175), turn(20), move(-1.18, 1.14, 0.46)]}
    )
    for x, z, r in [(-0.52, 1.05, 0.15), (-0.20, 1.22, 0.14), (0.62, 1.15, 0.145)]:
        shapes.append(ball("cherry", [x, r, z], r))
        shapes.append(tube("stem", [(x, 1.9 * r, z), (x + 0.02, 0.42, z), (x + 0.14, 0.66, z - 0.06)], 0.012))
    shapes.append(
        {"type": "cylinder", "material": "straw", "radius": 0.028, "height": 2.3, "transform": [UPRIGHT, turn(-11, (0, 0, 1)), move(1.36, 0.2, 0.30)]}
    )
    v = np.linspace(-1, 1, 256)
    field = np.exp(-1.5 * (v[None, :] * 1.05) ** 2 - 1.3 * ((v[:, None] + 0.1)) ** 2)
    write_png(folder / "field.png", np.dstack([field] * 3))
    shapes += [
        {
            "type": "quad",
            "material": "lamp",
            "origin": [-6.5, -0.4, -5],
            "edge_u": [13, 0, 0],
            "edge_v": [0, 6.4, 0],
            "emission": {"radiance": [3.4, 2.55, 1.95], "texture": "field"},
        },
        lamp([-6, 1.0, 1.0], [0, 0, 2.5], [0.6, 3.6, 0], [3.0, 3.0, 3.2]),
        lamp([-1.5, 6.2, 0.5], [3, 0, 0], [0, 0, 2.2], [3.5, 3.4, 3.3]),
    ]
    drink = lambda ior, color, distance: {"type": "dielectric", "ior": ior, "priority": 1, "absorption": {"color": color, "distance": distance}}
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {
            "position": [0.42, 1.35, 8.4],
            "look_at": [0.42, 1.06, 0],
            "vertical_fov_degrees": 22.5,
            "lens": {"radius": 0.04, "focus_point": [0, 1, 0.4]},
        },
        "integrator": {"type": "path", "max_depth": 48, "rr_depth": 16, "clamp": 8},
        "sampler": {"spp": 64},
        "textures": {
            "orange": {"type": "image", "file": "orange.png", "filter": "bilinear"},
            "slice": {"type": "image", "file": "slice.png", "filter": "bilinear"},
            "field": {"type": "image", "file": "field.png", "color_space": "linear"},
        },
        "materials": LAMP
        | {
            "table": {"type": "plastic", "albedo": [0.035, 0.025, 0.022], "roughness": 0.12},
            "glass": {"type": "dielectric", "ior": 1.5, "priority": 3},
            "ice": {"type": "dielectric", "ior": 1.31, "priority": 2, "roughness": 0.1},
            "bubble": {"type": "dielectric", "ior": 1, "priority": 2},
            "amber": drink(1.36, [0.86, 0.33, 0.03], 0.55),
            "rose": drink(1.35, [0.93, 0.16, 0.20], 0.6),
            "lime": drink(1.34, [0.70, 0.93, 0.42], 0.5),
            "sparkling": drink(1.34, [0.96, 0.80, 0.38], 0.5),
            "orange": {"type": "diffuse", "albedo": {"texture": "orange"}},
            "peel": {"type": "plastic", "albedo": [0.95, 0.36, 0.02], "roughness": 0.4},
            "cherry": {"type": "plastic", "albedo": [0.42, 0.01, 0.02], "roughness": 0.08},
            "stem": {"type": "diffuse", "albedo": [0.25, 0.18, 0.07]},
            "straw": {"type": "plastic", "albedo": [0.75, 0.10, 0.16], "roughness": 0.3},
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "radiance": [0.05, 0.045, 0.05]}],
        "outputs": [{"file": "drinks.png", "exposure": 0.3}],
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
        material, file, {"scale": size}, turn(tilt, (1, 0, 0)), turn(angle), move(x, y if y is not None else 0.6 * size, z), shading="flat", name=material
    )
    shapes = sweep(folder, "silk", back=-9, front=6)
    # The ring stands, leaning back a little; a solitaire in six prongs, and small stones in a row.
    lean = [turn(90, (1, 0, 0)), turn(0, (0, 0, 1)), move(0, 1.06, 0)]
    pose = [turn(-9, (1, 0, 0)), turn(24), move(-0.25, 0.0, 0)]
    shapes.append(ring("gold", 0.98, 0.085, {"scale": [1, 1.35, 1]}, *lean, *pose))
    shapes.append(mesh("diamond", "brilliant.ply", {"scale": 0.46}, move(0, 2.55, 0), *pose, shading="flat", name="solitaire"))
    for k in range(6):
        a = math.radians(60 * k + 30)
        c, s = math.cos(a), math.sin(a)
        shapes.append(
            {
                "type": "curves",
                "material": "gold",
                "basis": "catmull_rom",
                "strands": [
                    [
                        [0.08 * c, 2.0, 0.08 * s, 0.035],
                        [0.08 * c, 2.0, 0.08 * s, 0.035],
                        [0.25 * c, 2.25, 0.25 * s, 0.035],
                        [0.45 * c, 2.52, 0.45 * s, 0.03],
                        [0.455 * c, 2.62, 0.455 * s, 0.03],
                        [0.43 * c, 2.645, 0.43 * s, 0.028],
                        [0.43 * c, 2.645, 0.43 * s, 0.02],
                    ]
                ],
                "transform": pose,
            }
        )
    shapes.append(ring("gold", 0.24, 0.03, move(0, 2.25, 0), *pose))
    for side in (-1, 1):
        for k in range(6):
            a = side * (15 + 11.0 * k)
            shapes.append(
                mesh("diamond", "brilliant.ply", {"scale": 0.078 - 0.003 * k}, move(0, 1.12, 0), turn(-a, (0, 0, 1)), move(0, 1.06, 0), *pose, shading="flat")
            )
    shapes += [
        stone("emerald", "step.ply", 0.52, 1.55, 0.85, 32, -25, 0.40),
        stone("sapphire", "brilliant.ply", 0.50, -1.75, 0.75, 47, 35, 0.385),
        stone("ruby", "brilliant.ply", 0.36, 0.62, 1.45, 47, -50, 0.275),
        stone("diamond", "brilliant.ply", 0.30, -0.72, 1.6, 47, 120, 0.23),
        stone("diamond", "brilliant.ply", 0.40, 1.5, -0.75, 47, 190, 0.31),
        stone("ruby", "step.ply", 0.30, -2.55, 1.45, 32, 65, 0.23),
        stone("sapphire", "step.ply", 0.36, 2.5, 0.15, 32, 55, 0.28),
        stone("diamond", "brilliant.ply", 0.20, 2.2, 1.5, 47, 20, 0.155),
        stone("diamond", "brilliant.ply", 0.17, -1.5, 1.95, 47, 80, 0.13),
        stone("emerald", "brilliant.ply", 0.30, -2.2, -0.45, 47, 260, 0.23),
    ]
    for _ in range(12):
        a, b = rng.uniform(0, 2 * math.pi), rng.uniform(0.25, 1.2)
        at = np.array([math.cos(a) * math.cos(b), math.sin(b), math.sin(a) * math.cos(b)]) * 9
        shapes.append(ball("lamp", at, 0.16, emission={"radiance": [90, 84, 76]}))
    shapes += [
        lamp([-6.5, 2.0, -1], [0, 0, 5], [1.2, 4.5, 0], [4.2, 4.3, 4.8]),
        lamp([6.5, 3.0, -3.5], [0, 0, 1.6], [-1, 4.0, 0], [9, 8.2, 7.2]),
        lamp([-2.5, 7, -3], [5, 0, 0], [0, 0.8, 3], [3, 3, 3]),
    ]
    gem = lambda ior, color, abbe: {"type": "dielectric", "ior": ior, "abbe": abbe, "absorption": {"color": color, "distance": 0.35}, "priority": 1}
    return {
        "film": {"width": 1280, "height": 800},
        "camera": {
            "position": [0.3, 2.7, 8.3],
            "look_at": [0.05, 1.12, 0.2],
            "vertical_fov_degrees": 24,
            "lens": {"radius": 0.05, "focus_point": [-0.1, 1.9, 0.4]},
        },
        "integrator": {"type": "path", "max_depth": 40, "rr_depth": 20, "clamp": 12},
        "sampler": {"spp": 96},
        "materials": LAMP
        | {
            "silk": {"type": "principled", "base_color": [0.035, 0.03, 0.06], "roughness": 0.38, "sheen": 0.6, "specular": 0.5},
            "gold": {"type": "conductor", "metal": "gold", "roughness": 0.09},
            "diamond": {"type": "dielectric", "ior": 2.417, "abbe": 40, "priority": 1},
            "ruby": gem(1.77, [0.95, 0.05, 0.12], 60),
            "sapphire": gem(1.77, [0.06, 0.16, 0.90], 60),
            "emerald": gem(1.58, [0.04, 0.75, 0.30], 60),
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
        ball("pearl", [1.02, 0.82, 0.55], 0.12),
        ball("pearl", [1.22, 0.79, 0.28], 0.09),
        ball("pearl", [-1.12, 0.80, 0.62], 0.10),
        {"type": "quad", "material": "gold", "opacity": {"texture": "label"}, "transform": [{"scale": 0.36}, move(0, 0, 0.366), turn(-14), move(0, 1.72, 0)]},
        lamp([-4.2, 0.6, -1.0], [0, 0, 3.0], [0, 4.4, 0], [7.5, 7.2, 7.0]),
        lamp([4.2, 0.9, -2.2], [0, 0, 1.0], [0, 4.2, 0], [13, 11.5, 10.5]),
        lamp([-1.4, 6.2, -1.8], [2.8, 0, 0], [0, 0.3, 2.0], [6, 5.6, 5.4]),
        {"type": "disk", "material": "lamp", "radius": 1.5, "transform": [move(0.1, 2.0, -4.2)], "emission": {"radiance": [2.6, 1.55, 1.25]}},
    ]
    # The disk of light behind is seen through the glass, blurred by the lens.
    return {
        "film": {"width": 1280, "height": 1024},
        "camera": {"position": [0, 2.05, 9.2], "look_at": [0, 1.78, 0], "vertical_fov_degrees": 23, "lens": {"radius": 0.09, "focus_point": [0, 1.7, 0.35]}},
        "integrator": {"type": "path", "max_depth": 32, "rr_depth": 16, "clamp": 10},
        "sampler": {"spp": 64},
        "textures": {
            "marble": {"type": "image", "file": "marble.png", "scale": [0.45, 0.45]},
            "label": {"type": "image", "file": "label.png", "filter": "bilinear"},
        },
        "materials": LAMP
        | {
            "paper": {"type": "diffuse", "albedo": [0.62, 0.40, 0.35]},
            "marble": {"type": "plastic", "albedo": {"texture": "marble"}, "roughness": 0.15},
            "glass": {"type": "dielectric", "ior": 1.5, "priority": 1, "absorption": {"color": [0.98, 0.97, 0.96], "distance": 1}},
            "air": {"type": "dielectric", "ior": 1, "priority": 2},
            "scent": {"type": "dielectric", "ior": 1.37, "priority": 3, "absorption": {"color": [0.97, 0.62, 0.36], "distance": 0.6}},
            "gold": {"type": "conductor", "metal": "gold", "roughness": 0.2},
            "black": {"type": "coated", "base": "ink", "roughness": 0.05},
            "ink": {"type": "diffuse", "albedo": [0.025, 0.018, 0.018]},
            "cord": {"type": "diffuse", "albedo": [0.8, 0.78, 0.75]},
            "pearl": {"type": "principled", "base_color": [0.90, 0.84, 0.80], "roughness": 0.22, "specular": 0.7, "clearcoat": 0.6, "sheen": 0.3},
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "radiance": [0.30, 0.25, 0.24]}],
        "outputs": [{"file": "flacon.png", "exposure": 0.0}],
    }


SCENES = [drinks, jewels, flacon]
