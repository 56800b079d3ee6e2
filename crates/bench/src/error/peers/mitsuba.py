"""Renders a scene of Mitsuba 3 (XML) with the variant llvm_ad_rgb, its own integrator and sampler."""

import argparse
import glob
import json
import os
import re
import resource
import time


def find_llvm():
    """The newest LLVM of the system that Dr.Jit takes: 17 or later."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return
    found = {}
    for path in glob.glob("/usr/lib/*-linux-gnu/libLLVM*.so*") + glob.glob("/usr/lib/llvm-*/lib/libLLVM*.so*"):
        version = re.search(r"libLLVM[-.a-z]*(\d+)", path)
        if version and int(version[1]) >= 17:
            found[int(version[1])] = path
    if found:
        os.environ["DRJIT_LIBLLVM_PATH"] = found[max(found)]


def processor_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


parser = argparse.ArgumentParser()
parser.add_argument("scene")
parser.add_argument("--spp", type=int)
parser.add_argument("--seed", type=int)
parser.add_argument("--threads", type=int)
parser.add_argument("--size", type=int, nargs=2)
parser.add_argument("--define", action="append", default=[])
parser.add_argument("--out")
arguments = parser.parse_args()

find_llvm()
import mitsuba as mi  # noqa: E402

mi.set_variant("llvm_ad_rgb")
import drjit as dr  # noqa: E402

if arguments.threads:
    dr.set_thread_count(arguments.threads)
scene = mi.load_file(arguments.scene, **dict(item.split("=", 1) for item in arguments.define))
if arguments.size:
    parameters = mi.traverse(scene.sensors()[0])
    parameters["film.size"] = arguments.size
    parameters.update()
# The first render compiles the kernels.
dr.eval(mi.render(scene, spp=1, seed=2**31))
dr.sync_thread()
start, before = time.monotonic(), processor_seconds()
image = mi.render(scene, spp=arguments.spp, seed=arguments.seed)
dr.eval(image)
dr.sync_thread()
spent = {"render_seconds": time.monotonic() - start, "processor_seconds": processor_seconds() - before}
mi.Bitmap(image).write(arguments.out)
print(json.dumps(spent))
