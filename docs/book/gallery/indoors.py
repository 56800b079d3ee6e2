"""Scenes in rooms."""

import math

import numpy as np

from parts import *


def loft(folder):
    """A living room in the afternoon."""
    rng = np.random.default_rng(2)
    planks = np.zeros((1024, 1024, 3))
    for k in range(12):
        rows = slice(k * 1024 // 12, (k + 1) * 1024 // 12)
        grain = noise((rows.stop - rows.start, 1024), (6, 2), 60 + k, 6, 0.6)
        tone = np.array([0.60, 0.44, 0.30]) * rng.uniform(0.86, 1.08)
        planks[rows] = tone * (1 + 0.10 * np.sin(22 * grain) * 0.5 + 0.12 * grain)[..., None]
        planks[rows.start : rows.start + 3] *= 0.5
        joint = rng.integers(0, 1024)
        planks[rows, joint : joint + 3] *= 0.5
    write_png(folder / "planks.png", planks)
    weave = 0.05 * noise((512, 512), (128, 128), 1, 2)[..., None]
    write_png(folder / "weave.png", np.array([0.78, 0.74, 0.68]) * (0.95 + weave) ** 1.0)
    rug = np.ones((512, 768, 3)) * [0.86, 0.82, 0.75] * (1 + 0.06 * noise((512, 768), (90, 130), 4, 3)[..., None])
    yy, xx = np.mgrid[0:512, 0:768]
    diamond = np.abs((xx % 192) - 96) / 96 + np.abs((yy % 170) - 85) / 85
    rug[(diamond > 0.80) & (diamond < 0.92)] = [0.30, 0.25, 0.22]
    write_png(folder / "rug.png", rug)
    art = np.ones((640, 480, 3)) * [0.93, 0.90, 0.84]
    yy, xx = np.mgrid[0:640, 0:480]
    art[(xx - 300) ** 2 + (yy - 210) ** 2 < 118**2] = [0.80, 0.36, 0.20]
    art[(xx - 175) ** 2 + (yy - 470) ** 2 < 150**2] = [0.16, 0.29, 0.32]
    art[(np.abs(yy - 330 - 30 * np.sin(xx / 60)) < 7)] = [0.12, 0.11, 0.10]
    write_png(folder / "art0.png", art)
    art = np.ones((640, 480, 3)) * [0.90, 0.87, 0.80]
    for k, color in enumerate([(0.85, 0.65, 0.35), (0.72, 0.42, 0.26), (0.40, 0.34, 0.30), (0.18, 0.26, 0.30)]):
        art[yy > 250 + 90 * k + 34 * np.sin(xx / (60 + 16 * k) + 1.7 * k)] = color
    art[(xx - 330) ** 2 + (yy - 150) ** 2 < 52**2] = [0.87, 0.52, 0.28]
    write_png(folder / "art1.png", art)
    for name, half, radius, puff in [
        ("seat", [0.70, 0.13, 0.46], 0.10, 0.05),
        ("back", [0.69, 0.33, 0.13], 0.11, 0.06),
        ("arm", [0.13, 0.31, 0.50], 0.09, 0.0),
        ("base", [1.42, 0.13, 0.50], 0.05, 0.0),
        ("cushion", [0.26, 0.26, 0.055], 0.05, 0.085),
        ("ottoman", [0.36, 0.19, 0.36], 0.11, 0.05),
    ]:
        rounded_box(folder / f"{name}.ply", half, radius, puff)
    # A curtain hangs in folds.
    u = np.linspace(0, 1, 240)
    folds = 0.05 * np.sin(u * 2 * math.pi * 9 + 1.2 * np.sin(u * 9)) + 0.02 * np.sin(u * 2 * math.pi * 17)
    height_field(folder / "curtain.ply", np.tile(folds, (2, 1)), (1.0, 2.62))
    W, D, H = 3.4, 2.6, 2.8
    curtain = lambda z: mesh("linen", "curtain.ply", turn(90, (1, 0, 0)), turn(90), move(-W + 0.16, 1.36, z), name="curtain")
    shapes = [
        quad("planks", [-W, 0, 6], [2 * W, 0, 0], [0, 0, -6 - D]),
        quad("wall", [-W, 0, -D], [2 * W, 0, 0], [0, H, 0]),
        quad("white", [-W, H, 6], [2 * W, 0, 0], [0, 0, -6 - D], reverse_normal=True),
        quad("wall", [W, 0, -D], [0, 0, 6 + D], [0, H, 0]),
        quad("wall", [-W, 0, 6], [2 * W, 0, 0], [0, H, 0]),
        # The left wall has two windows down to the floor.
        box("wall", [-W - 0.1, 1.4, -2.25], [0.1, 1.4, 0.35]),
        box("wall", [-W - 0.1, 1.4, -0.1], [0.1, 1.4, 0.2]),
        box("wall", [-W - 0.1, 1.4, 3.9], [0.1, 1.4, 2.2]),
        box("wall", [-W - 0.1, 2.65, 0], [0.1, 0.15, 6]),
        box("white", [W - 0.02, 0.06, 1.7], [0.015, 0.06, 4.3]),
        box("white", [0, 0.06, -D + 0.015], [W, 0.06, 0.015]),
        quad("rug", [-1.75, 0.012, 1.55], [3.1, 0, 0], [0, 0, -2.2]),
        mesh("cloth", "base.ply", move(0.25, 0.30, -1.75), name="sofa"),
        mesh("cloth", "arm.ply", move(-1.30, 0.44, -1.75), name="sofa"),
        mesh("cloth", "arm.ply", move(1.80, 0.44, -1.75), name="sofa"),
        box("cloth", [0.25, 0.55, -2.17], [1.42, 0.30, 0.08], name="sofa"),
        curtain(-1.72),
        curtain(1.55),
        curtain(-0.15),
    ]
    for x in (-0.46, 0.96):
        shapes += [
            mesh("cloth", "seat.ply", move(x, 0.545, -1.70), name="sofa"),
            mesh("cloth", "back.ply", turn(-9, (1, 0, 0)), move(x, 0.93, -2.02), name="sofa"),
        ]
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
        {"type": "cylinder", "material": "oak", "radius": 0.50, "height": 0.035, "transform": [UPRIGHT, move(-0.25, 0.36, 0.35)]},
        disk("oak", [-0.25, 0.395, 0.35], 0.50),
        disk("oak", [-0.25, 0.36, 0.35], 0.50),
        turned(
            "clay",
            [[0, 0], [0.06, 0], [0.09, 0.03], [0.125, 0.12], [0.11, 0.22], [0.045, 0.30], [0.04, 0.34], [0.055, 0.37], [0.045, 0.37], [0.03, 0.34]],
            move(-0.38, 0.395, 0.28),
        ),
        turned("glaze", [[0, 0.02], [0.05, 0.0], [0.12, 0.03], [0.16, 0.085], [0.165, 0.09], [0.15, 0.085], [0.10, 0.04], [0, 0.035]], move(0.02, 0.395, 0.48)),
        box("ink", [-0.32, 0.41, 0.62], [0.13, 0.014, 0.095], turn(20)),
        box("sand", [-0.31, 0.437, 0.615], [0.12, 0.012, 0.085], turn(10)),
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
            shapes.append(
                {
                    "type": "sphere",
                    "material": "leaf",
                    "transform": [{"scale": [0.030, 0.006, 0.016]}, turn(rng.uniform(-50, 50), (0, 0, 1)), turn(rng.uniform(0, 360)), move(*at)],
                }
            )
    # A floor lamp with a globe, lit, and a pendant.
    shapes += [
        cylinder("brass", [2.72, 0.0, -1.9], 0.012, 1.55),
        cylinder("brass", [2.72, 0.0, -1.9], 0.15, 0.02),
        disk("brass", [2.72, 0.02, -1.9], 0.15),
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
        path = [
            (0.03 * c, 0.30, 0.03 * d, 0.012),
            (0.03 * c, 0.30, 0.03 * d, 0.012),
            (0.25 * spread * c, 0.3 + 0.55 * top, 0.25 * spread * d, 0.024),
            (0.65 * spread * c, 0.92 * top, 0.65 * spread * d, 0.026),
            (spread * c, top * 0.82, spread * d, 0.010),
            (1.15 * spread * c, top * 0.66, 1.15 * spread * d, 0.001),
            (1.15 * spread * c, top * 0.66, 1.15 * spread * d, 0.001),
        ]
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
        "textures": {
            "planks": image("planks.png", (2, 2.6)),
            "rug": image("rug.png"),
            "weave": image("weave.png"),
            "art0": image("art0.png"),
            "art1": image("art1.png"),
        },
        "materials": LAMP
        | {
            "planks": {"type": "plastic", "albedo": {"texture": "planks"}, "roughness": 0.4},
            "wall": {"type": "diffuse", "albedo": [0.80, 0.77, 0.72]},
            "white": {"type": "diffuse", "albedo": 0.85},
            "rug": {"type": "diffuse", "albedo": {"texture": "rug"}},
            "cloth": cloth(0.50, 0.52, 0.49),
            "rust": cloth(0.52, 0.19, 0.08),
            "ink": cloth(0.06, 0.12, 0.15),
            "sand": cloth(0.72, 0.62, 0.47),
            "linen": {"type": "diffuse_transmission", "reflectance": [0.48, 0.46, 0.43], "transmittance": [0.42, 0.40, 0.36]},
            "oak": {"type": "plastic", "albedo": [0.42, 0.27, 0.15], "roughness": 0.4},
            "black": {"type": "plastic", "albedo": 0.02, "roughness": 0.4},
            "brass": {"type": "conductor", "metal": "brass", "roughness": 0.25},
            "art0": {"type": "diffuse", "albedo": {"texture": "art0"}},
            "art1": {"type": "diffuse", "albedo": {"texture": "art1"}},
            "clay": {"type": "diffuse", "albedo": [0.60, 0.42, 0.32], "roughness": 0.6},
            "glaze": {"type": "plastic", "albedo": [0.10, 0.22, 0.24], "roughness": 0.1},
            "globe": {"type": "diffuse", "albedo": 0.7},
            "shade": {"type": "two_sided", "front": "black", "back": "inner"},
            "inner": {"type": "conductor", "metal": "brass", "roughness": 0.35},
            "twig": {"type": "diffuse", "albedo": [0.20, 0.13, 0.08]},
            "leaf": {"type": "diffuse_transmission", "reflectance": [0.09, 0.17, 0.06], "transmittance": [0.06, 0.12, 0.02]},
        },
        "shapes": shapes,
        "lights": [
            {"type": "environment", "file": "sky.hdr", "scale": 1.3},
            {"type": "directional", "direction": [0.80, -0.52, -0.34], "irradiance": [17, 13.5, 9.5], "angular_diameter_degrees": 0.53},
        ],
        "outputs": [{"file": "loft.png", "exposure": 1.15}],
    }


def chess(folder):
    """An endgame by a window: exact surfaces of revolution, and a lens with six blades."""
    rng = np.random.default_rng(5)
    rings = lambda seed, tone, dark: (
        lambda n: np.clip(tone * (1 + dark * (np.sin(40 * (n + np.linspace(0, 3, 512)[None, :])) * 0.35 + 0.9 * n))[..., None], 0, 1)
    )(noise((256, 512), (2, 9), seed, 5, 0.55))
    write_png(folder / "light.png", rings(1, np.array([0.86, 0.70, 0.48]), 0.10))
    write_png(folder / "dark.png", rings(2, np.array([0.40, 0.22, 0.12]), 0.28))
    write_png(folder / "table.png", rings(3, np.array([0.33, 0.20, 0.12]), 0.30))
    base = [[0, 0], [0.30, 0], [0.36, 0.0], [0.385, 0.03], [0.385, 0.09], [0.36, 0.115], [0.345, 0.12], [0.345, 0.15], [0.35, 0.17], [0.31, 0.20], [0.25, 0.25]]
    collar = lambda y, r: [
        [r - 0.03, y - 0.05],
        [r + 0.10, y - 0.015],
        [r + 0.125, y + 0.005],
        [r + 0.125, y + 0.03],
        [r + 0.09, y + 0.05],
        [r - 0.02, y + 0.06],
    ]
    profiles = {
        "pawn": base + [[0.15, 0.42], [0.12, 0.58]] + collar(0.68, 0.11) + [[0.12, 0.77], [0.19, 0.84], [0.215, 0.94], [0.18, 1.07], [0.09, 1.13], [0, 1.135]],
        "rook": base
        + [[0.21, 0.42], [0.19, 0.66]]
        + collar(0.80, 0.18)
        + [
            [0.17, 0.90],
            [0.18, 0.96],
            [0.27, 1.0],
            [0.285, 1.02],
            [0.285, 1.2],
            [0.275, 1.22],
            [0.215, 1.22],
            [0.205, 1.2],
            [0.20, 1.12],
            [0.15, 1.10],
            [0, 1.10],
        ],
        "bishop": base
        + [[0.17, 0.45], [0.13, 0.75]]
        + collar(0.98, 0.12)
        + [[0.10, 1.07], [0.18, 1.15], [0.205, 1.27], [0.16, 1.42], [0.06, 1.53], [0.03, 1.55], [0.055, 1.57], [0.07, 1.60], [0.05, 1.65], [0, 1.66]],
        "queen": base
        + [[0.20, 0.5], [0.14, 0.95]]
        + collar(1.18, 0.14)
        + [
            [0.13, 1.29],
            [0.16, 1.4],
            [0.26, 1.58],
            [0.265, 1.61],
            [0.225, 1.615],
            [0.19, 1.60],
            [0.13, 1.66],
            [0.05, 1.70],
            [0.04, 1.72],
            [0.075, 1.745],
            [0.08, 1.79],
            [0.05, 1.83],
            [0, 1.835],
        ],
        "king": base
        + [[0.21, 0.5], [0.15, 1.0]]
        + collar(1.28, 0.15)
        + [[0.14, 1.39], [0.17, 1.50], [0.265, 1.68], [0.27, 1.72], [0.22, 1.75], [0.10, 1.79], [0.05, 1.82], [0.04, 1.84], [0, 1.845]],
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
        ("king", "white", 4, 1),
        ("queen", "white", 3, 2),
        ("rook", "white", 5, 0),
        ("bishop", "white", 2.0, 3),
        ("pawn", "white", 5, 2),
        ("pawn", "white", 6, 1),
        ("pawn", "white", 7, 2),
        ("pawn", "black", 5, 4),
        ("pawn", "black", 6, 5),
        ("pawn", "black", 1, 5),
        ("queen", "black", 4, 6),
        ("rook", "black", 6, 7),
        ("bishop", "black", 2, 6),
        ("pawn", "black", 7, 5),
        ("pawn", "white", 1, 2),
        ("pawn", "white", 0, 1),
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
        "camera": {
            "position": [1.9, 1.9, 7.4],
            "look_at": [0.25, 0.86, -0.3],
            "vertical_fov_degrees": 27,
            "lens": {"radius": 0.11, "focus_point": [0.5, 1.2, 2.45], "blades": {"count": 6, "rotation_degrees": 12}},
        },
        "integrator": {"type": "path", "max_depth": 12},
        "sampler": {"spp": 64},
        "textures": {
            "light": wood("light.png"),
            "dark": wood("dark.png"),
            "table": {"type": "image", "file": "table.png", "scale": [3, 2]},
            "board": {"type": "image", "file": "light.png", "scale": [0.5, 0.8]},
            "board2": {"type": "image", "file": "dark.png", "scale": [0.5, 0.8]},
        },
        "materials": LAMP
        | {
            "white": {"type": "plastic", "albedo": {"texture": "light"}, "roughness": 0.25},
            "black": {"type": "plastic", "albedo": [0.022, 0.017, 0.015], "roughness": 0.22},
            "maple": {"type": "plastic", "albedo": {"texture": "board"}, "roughness": 0.3},
            "walnut": {"type": "plastic", "albedo": {"texture": "board2"}, "roughness": 0.3},
            "table": {"type": "plastic", "albedo": {"texture": "table"}, "roughness": 0.4},
            "wall": {"type": "diffuse", "albedo": [0.05, 0.042, 0.04]},
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "radiance": [0.10, 0.085, 0.07]}],
        "outputs": [{"file": "chess.png", "exposure": 0.35}],
    }


SCENES = [loft, chess]
