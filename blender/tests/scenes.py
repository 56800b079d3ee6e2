"""Scenes made by script, and their pictures by both engines."""

import math
import os
import tempfile
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

FOLDER = Path(tempfile.mkdtemp(prefix="steradian_test_"))


def reset():
    """An empty scene with a black world, 96 x 72 pixels."""
    for collection in (
        bpy.data.objects,
        bpy.data.meshes,
        bpy.data.materials,
        bpy.data.lights,
        bpy.data.cameras,
        bpy.data.images,
        bpy.data.worlds,
        bpy.data.curves,
        bpy.data.hair_curves,
        bpy.data.volumes,
    ):
        for block in list(collection):
            collection.remove(block)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 72, 100
    scene.render.pixel_aspect_x = scene.render.pixel_aspect_y = 1
    scene.render.use_border = scene.render.film_transparent = scene.render.use_motion_blur = False
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.view_settings.view_transform = "Raw"
    scene.cycles.device = "CPU"
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    for kind in ("max", "diffuse", "glossy", "transmission", "volume", "transparent_max"):
        setattr(scene.cycles, f"{kind}_bounces", 64)
    scene.cycles.blur_glossy = 0
    scene.cycles.sample_clamp_indirect = 0
    for name in (
        "use_pass_z",
        "use_pass_normal",
        "use_pass_position",
        "use_pass_cryptomatte_object",
        "use_pass_cryptomatte_material",
        "use_pass_cryptomatte_asset",
    ):
        setattr(bpy.context.view_layer, name, False)
    for name in scene.steradian.bl_rna.properties.keys():
        scene.steradian.property_unset(name)
    bpy.context.view_layer.steradian.layers = set()
    scene.world = bpy.data.worlds.new("World")
    with_nodes(scene.world)
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (1, 1, 1, 1), 0
    return scene


def with_nodes(owner):
    """Makes a material or world one of nodes, as all are from Blender 5 on."""
    if bpy.app.version < (5, 0, 0):
        owner.use_nodes = True


def link(data, name="thing", location=(0, 0, 0)):
    """An object of this data in the scene."""
    found = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(found)
    found.location = location
    return found


def aim(found, target):
    """Turns an object so that it looks at a point along its -z."""
    away = Vector(target) - found.location
    found.rotation_euler = away.to_track_quat("-Z", "Y").to_euler()
    return found


def camera(location, target, **values):
    """The scene's camera."""
    data = bpy.data.cameras.new("camera")
    for name, value in values.items():
        setattr(data, name, value)
    found = aim(link(data, "camera", location), target)
    bpy.context.scene.camera = found
    return found


def lamp(kind, location, target=(0, 0, 0), **values):
    """A lamp."""
    data = bpy.data.lights.new("lamp", kind)
    for name, value in values.items():
        setattr(data, name, value)
    return aim(link(data, "lamp", location), target)


def sky(strength, color=(1, 1, 1)):
    """A constant world."""
    background = bpy.context.scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*color, 1)
    background.inputs["Strength"].default_value = strength


def shader(kind, name="material", **values):
    """A material of one shader node: (material, node). Values are those of its inputs."""
    material = bpy.data.materials.new(name)
    with_nodes(material)
    tree = material.node_tree
    tree.nodes.clear()
    node, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    fill(node, **values)
    return material, node


def fill(node, **values):
    """Sets inputs of a node by their names, with underscores for spaces."""
    for key, value in values.items():
        socket = node.inputs[key.replace("_", " ")]
        socket.default_value = (*value, 1) if socket.type == "RGBA" else value


def diffuse(color, name="material"):
    """A diffuse material."""
    return shader("ShaderNodeBsdfDiffuse", name, Color=color)[0]


def smoke(material, file="fire", location=(0, 0, 0)):
    """A volume object of a file of the tests, about 5 units wide around (-5, -8, -2.5)."""
    data = bpy.data.volumes.new("smoke")
    data.filepath = str(Path(__file__).parents[2] / f"tests/regressions/vdb/{file}.vdb")
    data.materials.append(material)
    return link(data, "smoke", location)


def volume(kind, name="material", **values):
    """A material of one volume shader: (material, node)."""
    material, node = shader(kind, name, **values)
    tree = material.node_tree
    output = tree.get_output_node("ALL")
    tree.links.remove(output.inputs["Surface"].links[0])
    tree.links.new(node.outputs[0], output.inputs["Volume"])
    return material, node


def box(size, location=(0, 0, 0), material=None, inside=False, name="box"):
    """A box; `inside` turns its normals inward."""
    x, y, z = (s / 2 for s in size)
    corners = [(a, b, c) for a in (-x, x) for b in (-y, y) for c in (-z, z)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], [face[::-1] if inside else face for face in faces])
    if material:
        mesh.materials.append(material)
    return link(mesh, name, location)


def plane(size, location=(0, 0, 0), material=None, name="plane"):
    """A square that faces up, with uv."""
    bpy.ops.mesh.primitive_plane_add(size=size, location=location)
    found = bpy.context.object
    found.name = name
    if material:
        found.data.materials.append(material)
    return found


def ball(radius, location=(0, 0, 0), material=None, name="ball"):
    """A smooth sphere with uv."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=radius, location=location)
    found = bpy.context.object
    found.name = name
    found.data.shade_smooth()
    if material:
        found.data.materials.append(material)
    return found


def image(pixels, name="image", space="sRGB"):
    """An image of pixels, an array (height, width, 3) whose row 0 is at the bottom."""
    height, width = pixels.shape[:2]
    found = bpy.data.images.new(name, width, height)
    found.colorspace_settings.name = space
    values = np.ones((height, width, 4), np.float32)
    values[..., :3] = pixels
    found.pixels.foreach_set(values.ravel())
    found.update()
    return found


def image_node(node, socket, found):
    """Links an image to a socket of a node."""
    tree = node.id_data
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = found
    tree.links.new(texture.outputs["Color"], node.inputs[socket])
    return texture


def room():
    """A diffuse room with a box in it and a lamp below its ceiling."""
    box((4, 4, 3), (0, 0, 1.5), diffuse((0.7, 0.7, 0.7)), inside=True, name="room")
    box((1, 1, 1.4), (0.7, 0.5, 0.7), diffuse((0.6, 0.15, 0.1), "red"), name="block")
    camera((-0.3, -1.9, 1.5), (0.2, 1, 1), lens=20)


def picture(engine, samples, name="picture"):
    """The picture of the scene: linear, an array (height, width, 4) with row 0 at the top."""
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.cycles.samples = samples
    scene.steradian.samples = samples
    scene.render.filepath = str(FOLDER / f"{name}_{engine}.exr")
    bpy.ops.render.render(write_still=True)
    found = bpy.data.images.load(scene.render.filepath)
    values = np.array(found.pixels[:], np.float64).reshape(found.size[1], found.size[0], 4)[::-1]
    bpy.data.images.remove(found)
    os.remove(scene.render.filepath)
    return values


def both(steradian=64, cycles=96):
    """The pictures by Steradian and by Cycles."""
    return picture("STERADIAN", steradian), picture("CYCLES", cycles)


def spread(steradian, cycles, blocks=4):
    """Mean of Steradian's picture over that of Cycles, and the largest difference of a block's mean, as a share of the
    picture's."""
    ratio = steradian[..., :3].mean() / cycles[..., :3].mean()
    height, width = (side // blocks * blocks for side in steradian.shape[:2])

    def means(values):
        return (
            values[:height, :width, :3].reshape(blocks, height // blocks, blocks, width // blocks, 3).mean(axis=(1, 3))
        )

    difference = np.abs(means(steradian) - means(cycles)).max() / cycles[..., :3].mean()
    return ratio, difference


def degrees(value):
    """Radians of degrees."""
    return math.radians(value)
