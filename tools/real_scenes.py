#!/usr/bin/env python3
"""Scenes of other renderers, each rendered by Steradian and by Mitsuba 3, and by Steradian from its other formats: ratios of means.

usage: PYTHON tools/real_scenes.py FOLDER [--spp 64] [--scale 0.25] [--steradian target/release/steradian] [--only NAME,...] [--plain]

FOLDER has a folder for each scene, such as those of Benedikt Bitterli's "Rendering Resources" (https://benedikt-bitterli.me/resources), with scene_mitsuba3.xml, scene-v4.pbrt or *.gltf, and perhaps
reference/*.exr. With --plain both get the XML with smooth metals in place of rough ones and diffuse surfaces in place of plastics, whose models
differ: what remains must agree. PYTHON has numpy and mitsuba (DRJIT_LIBLLVM_PATH set if need be). Prints a table in Markdown: for each scene the ratio of the
means (red, green, blue) to Mitsuba's picture of the same XML, with its standard error from blocks, and the time of each.
"""
import argparse, json, os, re, subprocess, sys, tempfile, time
import numpy as np
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")


def read(path, size=None):
    image = np.array(mi.Bitmap(path).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
    if size is not None and image.shape[:2] != (size[1], size[0]):
        image = np.array(mi.Bitmap(image).resample(list(size)))
    return image


def ours(program, scene, spp, size, folder):
    out, stats = os.path.join(folder, "ours.exr"), os.path.join(folder, "stats.json")
    size = f"{size[0]}x{size[1]}"
    command = [program, "render", scene, "--spp", str(spp), "--size", size, "--float", "-q", "-o", out, "--stats", stats]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        return None, done.stderr.strip()
    return read(out), json.load(open(stats))


def mitsuba(scene, spp, scale):
    loaded = mi.load_file(scene)
    params = mi.traverse(loaded)
    size = next(key for key in params.keys() if key.endswith("film.size"))
    full = np.array(params[size]).astype(int)
    small = [max(int(round(n * scale)), 16) for n in full]
    params[size] = small
    crop = size.replace("film.size", "film.crop_size")
    if crop in params:
        params[crop] = small
    params.update()
    start = time.time()
    image = np.array(mi.render(loaded, spp=spp))[..., :3]
    return image, small, time.time() - start


def plain(xml, folder):
    """The scene without rough metals and plastics, its files by their full names."""
    text = open(xml).read()
    here = os.path.dirname(os.path.abspath(xml))
    text = re.sub(r'(name="filename"\s+value=")([^"/][^"]*)"', lambda m: m[1] + os.path.join(here, m[2]) + '"', text)
    text = text.replace('type="roughconductor"', 'type="conductor"').replace('name="diffuse_reflectance"', 'name="reflectance"')
    text = re.sub(r'type="(rough)?plastic"', 'type="diffuse"', text)
    # Parameters unknown to the new types would be errors in Mitsuba.
    text = re.sub(r'<(float|string|boolean|rgb) name="(alpha|distribution|nonlinear|int_ior|ext_ior|specular_reflectance)"[^>]*/>', "", text)
    out = os.path.join(folder, "plain.xml")
    open(out, "w").write(text)
    return out


def ratio(test, reference, block=16):
    """Ratio of means, and its standard error from blocks."""
    h, w = (n // block * block for n in reference.shape[:2])
    sums = lambda image: image[:h, :w].reshape(h // block, block, w // block, block, 3).sum((1, 3)).reshape(-1, 3)
    a, b = sums(test), sums(reference)
    mean = a.sum(0) / b.sum(0)
    error = np.sqrt(((a - mean * b) ** 2).sum(0)) / b.sum(0)
    return mean, error


def text(test, reference):
    if test is None:
        return "-"
    mean, error = ratio(test, reference)
    return " ".join(f"{m:.4f}" for m in mean) + f" ± {error.max():.4f}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--scale", type=float, default=0.25)
    parser.add_argument("--steradian", default="target/release/steradian")
    parser.add_argument("--only", default="")
    parser.add_argument("--plain", action="store_true")
    arguments = parser.parse_args()
    print("| scene | XML against Mitsuba, r g b | other format against our XML | Mitsuba against the reference | XML against the reference | seconds: ours, Mitsuba |")
    print("|---|---|---|---|---|---|")
    for name in sorted(os.listdir(arguments.folder)):
        folder = os.path.join(arguments.folder, name)
        xml = os.path.join(folder, "scene_mitsuba3.xml")
        if not os.path.isfile(xml) or (arguments.only and not any(part in name for part in arguments.only.split(","))):
            continue
        with tempfile.TemporaryDirectory() as temporary:
            if arguments.plain:
                xml = plain(xml, temporary)
            theirs, size, seconds = mitsuba(xml, arguments.spp, arguments.scale)
            image, stats = ours(arguments.steradian, xml, arguments.spp, size, temporary)
            if image is None:
                print(f"| {name} | {stats} | | | | |", flush=True)
                continue
            other = next((f for f in sorted(os.listdir(folder)) if f.endswith((".pbrt", ".gltf", ".glb"))), None) if not arguments.plain else None
            second = ours(arguments.steradian, os.path.join(folder, other), arguments.spp, size, temporary) if other else (None, "")
            other_text = "-" if other is None else second[1] if second[0] is None else f"{os.path.splitext(other)[1]}: {text(second[0], image)}"
            references = os.path.join(folder, "reference")
            exr = next((f for f in sorted(os.listdir(references)) if f.endswith(".exr")), None) if os.path.isdir(references) and not arguments.plain else None
            reference = read(os.path.join(references, exr), size) if exr else None
            against = ["-", "-"] if reference is None else [text(theirs, reference), text(image, reference)]
            print(f"| {name} | {text(image, theirs)} | {other_text} | {against[0]} | {against[1]} | {stats['render_seconds']:.1f}, {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    sys.exit(main())
