"""Scenes before a studio's backdrop."""

import math

import numpy as np

from parts import *


def cradle(folder):
    """Newton's cradle with an open shutter: motion blur."""
    rounded_box(folder / "base.ply", [1.9, 0.14, 1.05], 0.06)
    wood = noise((256, 512), (2, 8), 3, 6, 0.55)
    write_png(folder / "wood.png", np.clip(np.array([0.36, 0.21, 0.13]) * (1 + 0.28 * np.sin(30 * wood) * 0.5 + 0.25 * wood)[..., None], 0, 1))
    shapes = sweep(folder, "wall", back=-3.5, front=7)
    shapes.append(mesh("wood", "base.ply", move(0, 0.14, 0), name="base"))
    top, length, radius = 3.0, 2.1, 0.30
    for z in (-0.8, 0.8):
        frame = [
            (-1.65, 0.28, z),
            (-1.65, 1.5, z),
            (-1.65, top - 0.25, z),
            (-1.58, top - 0.07, z),
            (-1.4, top, z),
            (0, top, z),
            (1.4, top, z),
            (1.58, top - 0.07, z),
            (1.65, top - 0.25, z),
            (1.65, 1.5, z),
            (1.65, 0.28, z),
        ]
        shapes.append(tube("chrome", frame, 0.05))
    objects = {
        "pendulum": {
            "shapes": [
                ball("chrome", [0, -length, 0], radius),
                tube("thread", [(0, 0, -0.8), (0, -length * 0.5, -0.4), (0, -length + radius * 0.9, -0.04)], 0.008),
                tube("thread", [(0, 0, 0.8), (0, -length * 0.5, 0.4), (0, -length + radius * 0.9, 0.04)], 0.008),
            ]
        }
    }
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
        lamp([-5.5, 1.0, -2.5], [0, 0, 6], [1.0, 5, 0], [5.5, 5.8, 6.4]),
        lamp([8.2, 1.5, -2.4], [0, 0, 2.0], [-0.4, 5.2, 0], [19, 15, 11]),
        lamp([-2.0, 7.0, -1.5], [4, 0, 0], [0, 0, 2.2], [6, 5.8, 5.5]),
    ]
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {
            "position": [-2.2, 2.2, 8.2],
            "look_at": [0.42, 1.42, 0],
            "vertical_fov_degrees": 26,
            "lens": {"radius": 0.05, "focus_point": [0, 1.0, 0.3]},
        },
        "integrator": {"type": "path", "max_depth": 16},
        "sampler": {"spp": 64},
        "textures": {"wood": {"type": "image", "file": "wood.png", "scale": [0.35, 0.35]}},
        "materials": LAMP
        | {
            "wall": {"type": "plastic", "albedo": [0.05, 0.17, 0.19], "roughness": 0.55},
            "wood": {"type": "plastic", "albedo": {"texture": "wood"}, "roughness": 0.2},
            "chrome": {"type": "conductor", "metal": "chromium", "roughness": 0.06, "tint": 1},
            "thread": {"type": "diffuse", "albedo": [0.6, 0.58, 0.55]},
        },
        "shapes": shapes,
        "objects": objects,
        "instances": instances,
        "lights": [{"type": "environment", "radiance": [0.12, 0.13, 0.14]}],
        "outputs": [{"file": "cradle.png", "exposure": 0.3}],
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
        free = (
            lambda n: all(np.linalg.norm(n - np.array([side * eye[0], eye[1], eye[2]]) / np.linalg.norm(eye)) > 0.235 for side in (-1, 1))
            and np.linalg.norm(n - np.array([0, -0.05, 1])) > 0.16
        )
        fur(f"{name}.strands", 26000, [0, 1, 0], np.array([0.98, 0.95, 0.98]), 0.42, 0.0095, free)
        fur(f"{name}_feet.strands", 4000, [0, 0, 0], np.array([0.20, 0.13, 0.27]), 0.13, 0.007, lambda n: n[1] > -0.4)
        place = [{"scale": s}, turn(look), move(at[0], 0, at[1])]
        part = lambda shape: {**shape, "transform": shape.get("transform", []) + place}
        parts = [part(ball("skin " + coat, [0, 1, 0], 0.97)), part({"type": "curves", "material": coat, "file": f"{name}.strands", "basis": "b_spline"})]
        for side in (-1, 1):
            e = np.array([side * 0.305, 1.235, 0.90])
            parts += [
                part(ball("white", e, 0.225)),
                part(ball("iris", e + [-0.012 * side, 0.0, 0.088], 0.162)),
                part(ball("pupil", e + [-0.016 * side, 0, 0.152], 0.106)),
                part(ball("cornea", e + [0, 0, 0.012], 0.245)),
            ]
            parts.append(
                part({"type": "curves", "material": coat, "file": f"{name}_feet.strands", "basis": "b_spline", "transform": [move(side * 0.40, 0.13, 0.72)]})
            )
            parts.append(
                part(
                    {
                        **ball("horn", [0, 0, 0], 1),
                        "type": "cone",
                        "radius": 0.11,
                        "height": 0.34,
                        "transform": [UPRIGHT, turn(-24 * side, (0, 0, 1)), move(side * 0.42, 1.82, 0.1)],
                    }
                )
            )
            parts[-1].pop("z_min", None)
        parts.append(part({**ball("nose", [0, 0, 0], 1), "transform": [{"scale": [0.115, 0.085, 0.08]}, move(0, 1.0, 1.05)]}))
        return parts

    shapes = sweep(folder, "floor", back=-4.5, front=8)
    shapes += creature("big", (-0.78, -0.25), 1.0, "teal", 14) + creature("small", (1.25, 0.55), 0.66, "peach", -16)
    for x, z, r, m in [
        (2.45, -0.5, 0.34, "candy0"),
        (-2.35, 0.75, 0.20, "candy1"),
        (0.22, 1.55, 0.11, "candy2"),
        (-1.85, 1.45, 0.12, "candy0"),
        (2.25, 1.15, 0.15, "candy2"),
        (-2.75, -0.9, 0.42, "candy2"),
        (3.1, 0.6, 0.12, "candy1"),
    ]:
        shapes.append(ball(m, [x, r, z], r))
    shapes += [
        lamp([-5, 2.2, 2.5], [0, 0, 3.2], [1.4, 3.2, 0], [9, 8.6, 8.2]),
        lamp([4.8, 2.5, -3.4], [0, 0, 2], [-0.8, 3.4, 0], [17, 13, 11]),
        lamp([-1.5, 6.5, -2.5], [3, 0, 0], [0, 0, 2.4], [6, 6, 6.4]),
    ]
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {
            "position": [0.15, 1.55, 8.4],
            "look_at": [0.15, 1.02, 0],
            "vertical_fov_degrees": 23,
            "lens": {"radius": 0.06, "focus_point": [-0.3, 1.2, 0.8]},
        },
        "integrator": {"type": "path", "max_depth": 6},
        "sampler": {"spp": 24},
        "materials": LAMP
        | {
            "floor": {"type": "diffuse", "albedo": [0.80, 0.62, 0.30]},
            "teal": {"type": "hair", "color": [0.05, 0.42, 0.46], "azimuthal_roughness": 0.35, "longitudinal_roughness": 0.35},
            "peach": {"type": "hair", "color": [0.88, 0.40, 0.30], "azimuthal_roughness": 0.35, "longitudinal_roughness": 0.35},
            "skin teal": {"type": "diffuse", "albedo": [0.02, 0.15, 0.17]},
            "skin peach": {"type": "diffuse", "albedo": [0.5, 0.18, 0.13]},
            "white": {"type": "diffuse", "albedo": 0.85},
            "iris": {"type": "diffuse", "albedo": [0.30, 0.13, 0.03]},
            "pupil": {"type": "diffuse", "albedo": 0.01},
            "cornea": {"type": "thin_dielectric"},
            "horn": {"type": "plastic", "albedo": [0.85, 0.76, 0.6], "roughness": 0.25},
            "nose": {"type": "plastic", "albedo": [0.08, 0.03, 0.03], "roughness": 0.12},
            "candy0": {"type": "plastic", "albedo": [0.85, 0.12, 0.16], "roughness": 0.1},
            "candy1": {"type": "plastic", "albedo": [0.12, 0.35, 0.65], "roughness": 0.1},
            "candy2": {"type": "plastic", "albedo": [0.92, 0.86, 0.78], "roughness": 0.1},
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
        {
            "type": "curves",
            "material": "gold",
            "basis": "catmull_rom",
            "strands": [[[*np.round(point, 4), 0.02] for point in points]],
            "transform": [turn(28)],
            "name": "wire",
        },
        {"type": "cylinder", "material": "plinth", "radius": 1.05, "height": 0.32, "transform": [UPRIGHT]},
        disk("plinth", [0, 0.32, 0], 1.05),
        lamp([-8.0, 0.6, -1.0], [0, 0, 5], [1.6, 6.0, 0], [8, 9, 11]),
        lamp([8.0, 0.6, -3.2], [0, 0, 3.0], [0, 6.4, 0], [20, 12.5, 7]),
        lamp([-1.4, 6.6, -1.2], [2.8, 0, 0], [0, 0, 2.6], [8, 7.4, 7]),
    ]
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {"position": [0.5, 2.6, 9.2], "look_at": [0, 1.95, 0], "vertical_fov_degrees": 29, "lens": {"radius": 0.05, "focus_distance": 8.9}},
        "integrator": {"type": "path", "max_depth": 12},
        "sampler": {"spp": 64},
        "materials": LAMP
        | {
            "floor": {"type": "plastic", "albedo": [0.012, 0.014, 0.02], "roughness": 0.28},
            "plinth": {"type": "plastic", "albedo": [0.02, 0.02, 0.024], "roughness": 0.2},
            "gold": {"type": "conductor", "metal": "gold", "roughness": 0.22},
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "radiance": [0.012, 0.014, 0.02]}],
        "outputs": [{"file": "attractor.png", "exposure": 0.3}],
    }


SCENES = [cradle, fluffy, attractor]
