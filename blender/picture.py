"""Renders one scene by Steradian and by Cycles and puts the pictures side by side.

    STERADIAN_ZIP=target/blender/steradian-0.1.0.zip PYTHON blender/picture.py FILE.jpg [SAMPLES]

PYTHON is one with `bpy`, as `blender/test.sh` makes it.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "tests"))

import bpy  # noqa: E402
import conftest  # noqa: E402
import numpy as np  # noqa: E402

conftest.install()

import scenes  # noqa: E402


def principled(name, **values):
    return scenes.shader("ShaderNodeBsdfPrincipled", name, **values)[0]


def floor():
    """A checkered floor, half a mirror."""
    material, node = scenes.shader("ShaderNodeBsdfPrincipled", "floor", Roughness=0.25)
    tree = material.node_tree
    checker, coordinates = tree.nodes.new("ShaderNodeTexChecker"), tree.nodes.new("ShaderNodeTexCoord")
    scenes.fill(checker, Color1=(0.45, 0.42, 0.38), Color2=(0.12, 0.13, 0.16), Scale=24.0)
    tree.links.new(coordinates.outputs["UV"], checker.inputs["Vector"])
    tree.links.new(checker.outputs["Color"], node.inputs["Base Color"])
    return material


def build():
    scenes.reset()
    scenes.plane(12, material=floor())
    balls = [
        principled("lacquer", Base_Color=(0.55, 0.03, 0.03), Roughness=0.5, Coat_Weight=1.0, Coat_Roughness=0.03),
        principled("brass", Base_Color=(0.9, 0.62, 0.25), Metallic=1.0, Roughness=0.25),
        principled("glass", Base_Color=(0.85, 0.97, 0.92), Transmission_Weight=1.0, Roughness=0.0, IOR=1.5),
        principled("clay", Base_Color=(0.25, 0.35, 0.6), Roughness=0.8),
    ]
    for i, material in enumerate(balls):
        scenes.ball(0.55, (1.25 * (i - 1.5), 0.25 * (i % 2), 0.55), material, material.name)
    place = np.random.default_rng(7)
    pebble = scenes.ball(
        0.12, (-2.2, -0.8, 0.12), principled("pebble", Base_Color=(0.35, 0.5, 0.2), Roughness=0.4), "pebble"
    )
    for i in range(60):
        copy = scenes.link(pebble.data, f"pebble {i}", (place.uniform(-3, 3), place.uniform(0.9, 4), 0.12))
        copy.scale = (place.uniform(0.6, 1.4),) * 3
    scenes.lamp("AREA", (2.5, -2.5, 3.5), (0, 0, 0.3), energy=260, size=1.2, color=(1, 0.9, 0.75))
    scenes.lamp("AREA", (-3, 1, 2.5), (0, 0, 0.3), energy=90, shape="DISK", size=0.8, color=(0.6, 0.75, 1))
    scenes.sky(0.25, (0.5, 0.65, 1))
    found = scenes.camera((0.3, -5.2, 1.9), (0, 0.2, 0.45), lens=42)
    found.data.dof.use_dof, found.data.dof.focus_distance, found.data.dof.aperture_fstop = True, 5.2, 0.4
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 480, 360


def main(file, samples):
    build()
    pair = [scenes.picture(engine, samples) for engine in ("STERADIAN", "CYCLES")]
    ratio, block = scenes.spread(*pair)
    print(f"mean {ratio:.4f}, block {block:.4f}")
    gap = np.ones((pair[0].shape[0], 8, 4))
    both = np.concatenate([pair[0], gap, pair[1]], axis=1)[::-1]
    image = bpy.data.images.new("both", both.shape[1], both.shape[0], float_buffer=True)
    image.pixels.foreach_set(both.astype(np.float32).ravel())
    scene = bpy.context.scene
    scene.view_settings.view_transform = "AgX"
    scene.render.image_settings.file_format, scene.render.image_settings.quality = "JPEG", 88
    image.save_render(file, scene=scene)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 256)
