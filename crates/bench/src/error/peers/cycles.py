"""Renders a scene of Blender (.blend) or glTF with Cycles on the CPU.

Every pixel has the same number of samples; nothing is denoised."""

import argparse
import json
import os
import resource
import sys
import time

import bpy


def processor_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


parser = argparse.ArgumentParser()
parser.add_argument("scene")
parser.add_argument("--spp", type=int)
parser.add_argument("--seed", type=int)
parser.add_argument("--threads", type=int)
parser.add_argument("--size", type=int, nargs=2)
parser.add_argument("--define", action="append", default=[], help="not used")
parser.add_argument("--out")
arguments = parser.parse_args()

# Blender writes messages to standard output, which is for the figures.
figures = os.dup(1)
os.dup2(2, 1)
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
    start, before = time.monotonic(), processor_seconds()
    bpy.ops.render.render(write_still=True)
    return [time.monotonic() - start, processor_seconds() - before]


# A first render loads what Cycles needs. The second and the third differ by samples alone, which takes out what comes
# before.
spent(1)
first = spent(1)
all_samples = spent(arguments.spp)
if arguments.spp > 1:
    scale = arguments.spp / (arguments.spp - 1)
    all_samples = [max((full - one) * scale, 0) or full for full, one in zip(all_samples, first)]
os.write(figures, json.dumps(dict(zip(("render_seconds", "processor_seconds"), all_samples))).encode() + b"\n")
