#!/usr/bin/env python3
"""Mitsuba 3's own render tests, rendered by Steradian and judged as Mitsuba judges itself.

usage: PYTHON tools/mitsuba_tests.py FOLDER [--steradian target/release/steradian] [--spp N] [--only NAME,...]

FOLDER is `tests/scenes` of https://github.com/mitsuba-renderer/mitsuba-data (the data of Mitsuba's render tests): it has NAME/test_*.xml and NAME/refs/test_*_ref_rgb.exr with
..._ref_rgb_var.exr, the variance of one sample. PYTHON has numpy and mitsuba. For each pixel and channel in XYZ a z-test against the
reference (variance at least 1e-4), at the level 0.01 corrected by Šidák for the number of pixels; a picture passes if 99.75 % do.
"""
import argparse, glob, os, re, subprocess, sys, tempfile
import numpy as np
import mitsuba as mi
from statistics import NormalDist

mi.set_variant("scalar_rgb")


def xyz(path):
    return np.array(mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.XYZ, mi.Struct.Type.Float32, False)).astype(np.float64)


def samples(scene):
    """Samples per pixel of the scene or a file it includes."""
    text = open(scene).read()
    for include in re.findall(r'<include filename="([^"]+)"', text):
        text += open(os.path.join(os.path.dirname(scene), include)).read()
    value = re.search(r'name="sample_count" value="(\$?\w+)"', text)
    if value and value[1].startswith("$"):
        value = re.search(rf'<default name="{value[1][1:]}" value="(\d+)"', text)
    return int(value[1]) if value else 4


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder")
    parser.add_argument("--steradian", default="target/release/steradian")
    parser.add_argument("--spp", type=int)
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    print("| test | pixels that pass | Y over the reference's | not mapped |")
    print("|---|---|---|---|")
    for scene in sorted(glob.glob(os.path.join(arguments.folder, "*", "test_*.xml"))):
        name = os.path.splitext(os.path.basename(scene))[0]
        if arguments.only and not any(part in scene for part in arguments.only.split(",")):
            continue
        base = os.path.join(os.path.dirname(scene), "refs", re.sub("_[a-z]+$", "", name) + "_ref_rgb")
        if not os.path.isfile(base + ".exr"):
            continue
        reference, variance = xyz(base + ".exr"), np.array(mi.Bitmap(base + "_var.exr").convert(mi.Bitmap.PixelFormat.XYZ, mi.Struct.Type.Float32, False))
        with tempfile.TemporaryDirectory() as folder:
            out, report = os.path.join(folder, "o.exr"), os.path.join(folder, "r.json")
            size = f"{reference.shape[1]}x{reference.shape[0]}"
            spp = arguments.spp or samples(scene)
            command = [arguments.steradian, "render", scene, "--spp", str(spp), "--size", size, "--float", "-o", out, "--sampler", "independent"]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode:
                print(f"| {name} | - | - | {done.stderr.strip().splitlines()[-1]} |", flush=True)
                continue
            image = xyz(out)
        notes = "; ".join(re.sub(r" \([^()]*\)$", "", line.strip()) for line in done.stderr.splitlines() if line.strip().startswith(("approximated", "ignored")))
        z = np.abs(image - reference) * np.sqrt(spp / np.maximum(variance, 1e-4))
        level = 1 - (1 - 0.01) ** (1 / (reference.shape[0] * reference.shape[1]))
        passed = (z < NormalDist().inv_cdf(1 - level / 2)).mean()
        verdict = "" if passed >= 0.9975 else " (fails)"
        print(f"| {name} | {100 * passed:.2f} %{verdict} | {image[..., 1].mean() / reference[..., 1].mean():.4f} | {notes} |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
