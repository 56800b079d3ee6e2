"""Renders a scene of Blender (.blend) or glTF with Cycles on the CPU.

Every pixel has the same number of samples; nothing is denoised."""

import sys

import bpy

if arguments.scene.endswith(".blend"):
    bpy.ops.wm.open_mainfile(filepath=arguments.scene, use_scripts=False)
else:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=arguments.scene, export_import_convert_lighting_mode="SPEC")
scene = bpy.context.scene
if scene.camera is None:
    cameras = [thing for thing in scene.objects if thing.type == "CAMERA"]
    if not cameras:
        sys.exit(f"{arguments.scene}: the scene has no camera")
    scene.camera = cameras[0]
scene.render.engine = "CYCLES"
scene.cycles.device = "CPU"
scene.cycles.use_adaptive_sampling = False
scene.cycles.use_denoising = False
scene.cycles.seed = arguments.seed % 2**31
scene.render.use_border = False
scene.render.resolution_percentage = 100
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.use_file_extension = False
scene.render.filepath = arguments.out
if arguments.size:
    scene.render.resolution_x, scene.render.resolution_y = arguments.size
if arguments.threads:
    scene.render.threads_mode = "FIXED"
    scene.render.threads = arguments.threads


def spent(samples):
    """Seconds and processor seconds of a render, with what comes before its first sample."""
    scene.cycles.samples = samples
    start = now()
    bpy.ops.render.render(write_still=True)
    return [b - a for a, b in zip(start, now())]


# A first render loads what Cycles needs. The second and the third differ by samples alone, which takes out what comes
# before.
spent(1)
first = spent(1)
whole = spent(arguments.spp)
if arguments.spp > 1:
    scale = arguments.spp / (arguments.spp - 1)
    whole = [max((b - a) * scale, 0) or b for a, b in zip(first, whole)]
report(whole)
