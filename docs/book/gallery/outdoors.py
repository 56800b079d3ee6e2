"""Scenes under a sky."""

import json
import math
from pathlib import Path

import numpy as np

from parts import *


def pool(folder):
    """A swimming pool in the sun: caustics by photons."""
    rng = np.random.default_rng(3)
    # Water: waves of many directions, shorter ones lower.
    rows, columns = 320, 512
    x, z = np.meshgrid(np.linspace(-6, 6, columns), np.linspace(-4, 4, rows))
    height = np.zeros_like(x)
    for _ in range(70):
        length = rng.uniform(0.35, 1.7)
        angle, phase = rng.uniform(0, 2 * math.pi), rng.uniform(0, 2 * math.pi)
        height += 0.0021 * length**1.15 * np.sin(2 * math.pi / length * (x * math.cos(angle) + z * math.sin(angle)) + phase)
    height_field(folder / "water.ply", height - 0.14, (12, 8))
    # Mosaic: 16 x 16 tiles an image.
    tiles = rng.normal(0, 0.05, (16, 16, 1)) + np.array([0.33, 0.72, 0.80])
    image = np.kron(tiles, np.ones((32, 32, 1)))
    joint = np.arange(512) % 32 < 2
    image[joint[:, None] | joint[None, :]] = [0.80, 0.88, 0.88]
    write_png(folder / "tiles.png", image)
    stone = 0.80 + 0.035 * noise((512, 512), (6, 6), 5, 6)[..., None] * np.array([1, 1, 1.15]) + np.array([0.03, 0.0, -0.05])
    joint = np.arange(512) % 256 < 3
    stone[joint[:, None] | joint[None, :]] *= 0.72
    write_png(folder / "stone.png", stone)
    stripes = np.zeros((64, 384, 3))
    for k, color in enumerate([(0.95, 0.95, 0.93), (0.93, 0.30, 0.25), (0.95, 0.95, 0.93), (0.98, 0.75, 0.15), (0.95, 0.95, 0.93), (0.10, 0.42, 0.70)]):
        stripes[:, 64 * k : 64 * (k + 1)] = color
    write_png(folder / "stripes.png", stripes)
    float_ring = np.ones((64, 512, 3)) * [0.97, 0.96, 0.95]
    for k in range(8):
        float_ring[:, 64 * k : 64 * k + 32] = [0.96, 0.36, 0.42]
    write_png(folder / "ring.png", float_ring)
    write_sky(folder / "sky.hdr", [0.20, 0.42, 0.90], [0.75, 0.9, 1.05], [0.5, 0.5, 0.48], [0.6, 0.55, 0.4], (0.5, 0.75, -0.45))
    depth = 1.5
    wall = {"material": "tiles"}
    shapes = [
        mesh("water", "water.ply", name="water"),
        quad(origin=[-6, -depth, 4], u=[12, 0, 0], v=[0, 0, -8], **wall),
        quad(origin=[-6, -depth, -4], u=[12, 0, 0], v=[0, depth, 0], **wall),
        quad(origin=[-6, -depth, 4], u=[0, 0, -8], v=[0, depth, 0], **wall),
        quad(origin=[6, -depth, -4], u=[0, 0, 8], v=[0, depth, 0], **wall),
        quad(origin=[6, -depth, 4], u=[-12, 0, 0], v=[0, depth, 0], **wall),
        # The deck around it, with a coping that overhangs.
        box("stone", [0, -0.05, -8.0], [14, 0.05, 3.95]),
        box("stone", [0, -0.05, 8.0], [14, 0.05, 3.95]),
        box("stone", [-10.0, -0.05, 0], [3.95, 0.05, 4.06]),
        box("stone", [10.0, -0.05, 0], [3.95, 0.05, 4.06]),
        # A ring and a ball that float.
        ring("ring", 0.52, 0.19, turn(4, (1, 0, 0)), turn(25), move(-1.55, -0.09, 0.55), name="ring"),
        ball("ball", [1.9, 0.07, -1.5], 0.24, name="ball"),
    ]
    shapes[-1]["transform"] = [turn(55, (1, 0, 0.4)), move(1.9, 0.05, -1.4)]
    # Steps in the far corner.
    for k in range(4):
        shapes.append(box("tiles", [5.0 - 0.0 * k, -0.35 - 0.3 * k - 0.6, -3.6 + 0.38 * k], [1.0, 0.6, 0.38]))
    # A ladder of steel.
    for side in (-0.27, 0.27):
        bend = [
            (-3.2 + side, -1.1, -3.8),
            (-3.2 + side, 0.1, -3.8),
            (-3.2 + side, 0.62, -3.86),
            (-3.2 + side, 0.82, -4.1),
            (-3.2 + side, 0.80, -4.4),
            (-3.2 + side, 0.55, -4.6),
            (-3.2 + side, 0.0, -4.62),
        ]
        shapes.append(tube("steel", bend, 0.026))
    for k in range(3):
        shapes.append(box("steel", [-3.2, -0.45 - 0.28 * k, -3.8], [0.26, 0.012, 0.05]))
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {"position": [0.3, 3.4, 6.3], "look_at": [0.1, -0.75, -0.6], "vertical_fov_degrees": 40},
        "integrator": {"type": "path", "max_depth": 16, "caustics": "photons"},
        "sampler": {"spp": 48},
        "textures": {
            "tiles": {"type": "image", "file": "tiles.png", "scale": [9, 6]},
            "stone": {"type": "image", "file": "stone.png", "scale": [10, 3]},
            "stripes": {"type": "image", "file": "stripes.png"},
            "ring": {"type": "image", "file": "ring.png"},
        },
        "materials": {
            "tiles": {"type": "diffuse", "albedo": {"texture": "tiles"}},
            "stone": {"type": "diffuse", "albedo": {"texture": "stone"}},
            "water": {"type": "dielectric", "ior": 1.33},
            "steel": {"type": "conductor", "metal": "chromium", "roughness": 0.15},
            "ring": {"type": "plastic", "albedo": {"texture": "ring"}, "roughness": 0.25},
            "ball": {"type": "plastic", "albedo": {"texture": "stripes"}, "roughness": 0.2},
        },
        "shapes": shapes,
        "lights": [
            {"type": "environment", "file": "sky.hdr", "scale": 0.7},
            {"type": "directional", "direction": [-0.5, -0.85, 0.42], "irradiance": [3.6, 3.35, 2.9], "angular_diameter_degrees": 0.53},
        ],
        "outputs": [{"file": "pool.png", "exposure": 0.1}],
    }


def lanterns(folder):
    """Hundreds of paper lanterns over a lake at nightfall: a tree chooses among the lights."""
    rng = np.random.default_rng(11)
    rows = columns = 512
    slopes = np.dstack([noise((rows, columns), (10, 24), seed, 4, 0.55) for seed in (1, 2)]) * 0.35
    normal = np.dstack([slopes, np.ones((rows, columns))])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    write_png(folder / "waves.png", normal / 2 + 0.5)
    write_sky(folder / "sky.hdr", [0.002, 0.006, 0.030], [0.022, 0.022, 0.070], [0.004, 0.004, 0.01], [0.13, 0.045, 0.03], (-0.25, 0.0, -1), 10)
    # Ridges of hills, one behind another.
    shapes = [quad("lake", [-400, 0, 60], [800, 0, 0], [0, 0, -560])]
    for k, (z, top, seed) in enumerate([(-150, 17, 21), (-220, 33, 22), (-330, 60, 23)]):
        profile = top * (0.55 + 0.45 * noise((600,), (5,), seed, 7, 0.5)) * np.clip(1.1 - np.exp(-np.linspace(-3, 3, 600) ** 2 * 1.2) * 0.75, 0.2, 2)
        depth = np.sin(np.linspace(0, math.pi, 40)) ** 0.8
        height_field(folder / f"ridge{k}.ply", depth[:, None] * profile[None, :] - 0.5, (520 + 150 * k, 60))
        shapes.append(mesh(f"ridge{k}", f"ridge{k}.ply", move(0, 0, z)))
    # A lantern: a shade of paper with an open lower end, and a flame inside that is only seen through it.
    spots = []
    while len(spots) < 330:
        far = rng.uniform(0, 1) ** 1.6
        z = 2 - 118 * far
        y = rng.uniform(1.2, 5 + 26 * far + 7 * rng.uniform() ** 2)
        x = rng.normal(0, 0.55) * (7 + 50 * far)
        if all((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2 > 3.2 for a, b, c in spots) and not (z > -7 and y < 5 and abs(x) < 2.5):
            spots.append((x, y, z))
    floating = []
    while len(floating) < 120:
        z = 1 - 95 * rng.uniform() ** 1.3
        x = rng.normal(0, 1) * (3 + 0.30 * (6 - z))
        if all((x - a) ** 2 + (z - c) ** 2 > 1.4 for a, c in floating):
            floating.append((x, z))
    for x, y, z in spots:
        warm = rng.uniform(0.75, 1.2)
        shade = np.array([1.0, 0.30 + 0.04 * rng.normal(), 0.045]) * warm
        size = rng.uniform(0.42, 0.55)
        tilt = [{"scale": size}, turn(rng.normal(0, 7), (1, 0, 0)), turn(rng.normal(0, 7), (0, 0, 1)), move(x, y, z)]
        shapes.append(
            turned(
                "paper",
                [[0.62, -0.9], [0.70, -0.5], [0.86, 0.1], [0.88, 0.6], [0.70, 0.92], [0.35, 1.04], [0.0, 1.07]],
                *tilt,
                emission={"radiance": list(np.round(1.15 * shade, 3)), "texture": "glow", "two_sided": True},
            )
        )
    for x, z in floating:
        warm = rng.uniform(0.7, 1.2)
        s = rng.uniform(0.20, 0.27)
        shapes.append(
            {
                "type": "cylinder",
                "material": "paper",
                "radius": s,
                "height": 1.7 * s,
                "transform": [UPRIGHT, move(x, 0.03, z)],
                "emission": {"radiance": list(np.round(np.array([1.3, 0.40, 0.06]) * warm, 3)), "texture": "glow", "two_sided": True},
            }
        )
        shapes.append(disk("wood", [x, 0.035, z], 1.5 * s))
    v = np.linspace(0, 1, 256)[:, None]
    glow = np.clip(1.0 - 0.75 * v, 0, 1)[::-1] * np.ones((1, 64))
    write_png(folder / "glow.png", np.dstack([glow] * 3))
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {"position": [0, 2.3, 15], "look_at": [0, 6.2, -18], "vertical_fov_degrees": 42},
        "integrator": {"type": "path", "max_depth": 6},
        "sampler": {"spp": 64},
        "textures": {
            "waves": {"type": "image", "file": "waves.png", "color_space": "linear", "scale": [90, 60]},
            "glow": {"type": "image", "file": "glow.png", "color_space": "linear"},
        },
        "materials": {
            "paper": {"type": "diffuse", "albedo": [0.5, 0.35, 0.2]},
            "wood": {"type": "diffuse", "albedo": [0.05, 0.03, 0.02]},
            "still": {"type": "plastic", "albedo": [0.002, 0.004, 0.008], "ior": 1.33, "roughness": 0.08},
            "lake": {"type": "relief", "material": "still", "normal_map": {"texture": "waves", "strength": 0.25}},
            "ridge0": {"type": "diffuse", "albedo": [0.012, 0.016, 0.03]},
            "ridge1": {"type": "diffuse", "albedo": [0.05, 0.06, 0.11]},
            "ridge2": {"type": "diffuse", "albedo": [0.13, 0.13, 0.22]},
        },
        "shapes": shapes,
        "lights": [{"type": "environment", "file": "sky.hdr"}],
        "outputs": [{"file": "lanterns.png", "exposure": 0.5}],
    }


def shrine(_):
    """The forest of instances of `scenes/shrine.json` on an evening."""
    lines = (Path(__file__).resolve().parents[3] / "scenes/shrine.json").read_text().splitlines()
    scene = json.loads("\n".join(line for line in lines if not line.strip().startswith("//")))
    scene["film"] = {"width": 1280, "height": 720}
    scene["camera"] = {"position": [-6.0, 2.0, 39], "look_at": [1.2, 6.4, 0], "vertical_fov_degrees": 29}
    scene["sampler"] = {"spp": 24}
    scene["lights"] = [
        {"type": "environment", "file": "textures/sky.exr", "scale": 0.55},
        {"type": "directional", "direction": [0.80, -0.26, -0.50], "irradiance": [5.2, 3.1, 1.5], "angular_diameter_degrees": 0.53},
    ]
    scene["outputs"] = [{"file": "shrine.png", "exposure": 0.15}]
    return scene


def cumulus(folder):
    """Clouds over the sea before sunset: a grid of density, many scatterings."""
    rng = np.random.default_rng(12)
    # x from -10 to 10, y from 0 to 4.4 above the clouds' base, z from -4 to 1.6.
    nx, ny, nz = 640, 160, 192
    low, high = np.array([-10.0, 1.15, -4.4]), np.array([10.0, 6.15, 1.6])
    axes = [np.linspace(a, b, n, dtype=np.float32) for a, b, n in zip(low, high, (nx, ny, nz))]
    x, y, z = np.meshgrid(*axes, indexing="ij", sparse=True)
    body = np.full((nx, ny, nz), -9.0, np.float32)

    def puff(a, b, c, r):
        near = [slice(*np.searchsorted(axis, [at - 2 * r, at + 2 * r])) for axis, at in zip(axes, (a, b, c))]
        distance = np.sqrt((x[near[0]] - a) ** 2 + (y[:, near[1]] - b) ** 2 + (z[:, :, near[2]] - c) ** 2)
        body[tuple(near)] = np.maximum(body[tuple(near)], 1 - distance / r)

    # Towers of puffs that become smaller upwards: x, z, half the width, height.
    for a, c, width, top in [(2.1, -0.6, 1.75, 3.3), (-4.6, -2.6, 1.5, 1.5), (-7.6, -1.6, 1.1, 0.9), (7.4, -2.4, 1.7, 1.9), (-1.7, -3.4, 0.9, 0.6), (5.0, -3.7, 0.7, 0.45), (-3.2, 0.4, 0.5, 0.3)]:
        for k in range(int(46 * width)):
            up = rng.uniform() ** 1.4
            reach = width * (1 - up) ** 0.65
            turn, out = rng.uniform(0, 2 * math.pi), math.sqrt(rng.uniform())
            size = rng.uniform(0.20, 0.36) * width * (1 - 0.45 * up)
            puff(a + reach * out * math.cos(turn), low[1] + 0.16 + up * top, c + 0.6 * reach * out * math.sin(turn), size)
    # Billows: creases where noise is zero.
    cells = np.array([40, 10, 12])
    billow = sum(0.6**k * np.abs(noise((nx, ny, nz), cells * 2**k, 50 + k, 1)) for k in range(5))
    floor = np.clip((y - low[1] - 0.12 - 0.1 * noise((nx, 1, nz), (24, 1, 8), 60, 3)) / 0.14, 0, 1)
    density = np.clip((body + 0.85 * (billow - 0.72)) * 9, 0, 1) * floor
    density[0], density[-1], density[:, -1], density[:, :, 0], density[:, :, -1] = 0, 0, 0, 0, 0
    density.transpose(2, 1, 0).astype("<f4").tofile(folder / "cloud.raw")
    # Waves of many lengths about one direction of the wind, near enough to be seen one by one.
    x, z = np.meshgrid(np.linspace(-45, 45, 1100, dtype=np.float32), np.linspace(-40, 40, 1600, dtype=np.float32))
    height = np.zeros_like(x)
    for _ in range(90):
        length = 0.28 * 11 ** rng.uniform()
        angle, phase = rng.normal(math.pi / 2 + 0.3, 0.6), rng.uniform(0, 2 * math.pi)
        height += 0.0036 * length**0.9 * np.sin(2 * math.pi / length * (x * math.cos(angle) + z * math.sin(angle)) + phase)
    height_field(folder / "sea.ply", height, (90, 80))
    sun = np.array([-0.34, 0.165, -1])
    write_sky(folder / "sky.hdr", [0.05, 0.14, 0.38], [0.62, 0.36, 0.22], [0.04, 0.06, 0.12], [3.4, 1.35, 0.40], sun, 30)
    middle, half = (low + high) / 2, (high - low) / 2 - 0.002
    return {
        "film": {"width": 1280, "height": 720},
        "camera": {"position": [0, 0.75, 9.0], "look_at": [0, 2.2, 0], "vertical_fov_degrees": 34},
        "integrator": {"type": "path", "max_depth": 64, "rr_depth": 16},
        "sampler": {"spp": 48},
        "media": {
            "cloud": {
                "scattering": 42,
                "absorption": 0.01,
                "phase": {"type": "henyey_greenstein", "g": 0.72},
                "volume": {"density": {"type": "grid", "file": "cloud.raw", "resolution": [nx, ny, nz]}, "bounds": [low.tolist(), high.tolist()]},
            }
        },
        "materials": {
            "sea": {"type": "plastic", "albedo": [0.004, 0.012, 0.022], "ior": 1.33, "roughness": 0.08},
            "far_sea": {"type": "plastic", "albedo": [0.004, 0.012, 0.022], "ior": 1.33, "roughness": 0.3},
            "cloud": {"type": "dielectric", "ior": 1, "medium": "cloud"},
        },
        "shapes": [
            quad("far_sea", [-300, -0.2, -20], [600, 0, 0], [0, 0, -600]),
            mesh("sea", "sea.ply", move(0, 0, -30)),
            box("cloud", middle.tolist(), half.tolist()),
        ],
        "lights": [
            {"type": "environment", "file": "sky.hdr", "scale": 0.6},
            {"type": "directional", "direction": (-sun).tolist(), "irradiance": [13, 6.6, 2.6], "angular_diameter_degrees": 0.53},
        ],
        "outputs": [{"file": "cumulus.png", "exposure": 0.0}],
    }


SCENES = [lanterns, pool, shrine, cumulus]
