"""Renders a scene of Mitsuba 3 (XML) with the variant llvm_ad_rgb, its own integrator and sampler."""

import glob
import re


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
start = now()
image = mi.render(scene, spp=arguments.spp, seed=arguments.seed)
dr.eval(image)
dr.sync_thread()
end = now()
mi.Bitmap(image).write(arguments.out)
report([b - a for a, b in zip(start, end)])
