#!/usr/bin/env python3
"""Reads the EXR files of every profile with the programs that they are made for, and prints a table.

    pip install openimageio bpy        # bpy is Blender as a module; what is not installed is left out
    tools/interop_exr.py [--program target/release/steradian] [--scene scenes/shapes.json] [--out FOLDER]

Checks: order and types of channels in OpenImageIO (alpha is channel 3, depth channel 4), equal pixels in all profiles (idiff), passes and
Cryptomatte in Blender, and `steradian check-exr`. Ends with 1 if anything is not as it should be.
"""

import argparse
import pathlib
import shutil
import subprocess
import sys
import tempfile

LAYERS = (
    "Z,N,Ng,P,uv,motion,albedo,diffuse_direct,diffuse_indirect,specular_direct,specular_indirect,transmission_direct,"
    "transmission_indirect,emission,background,light_groups,variance,samples,feature_albedo,feature_normal,object_id,"
    "material_id,instance_id,crypto_object,crypto_material,crypto_asset"
)
PROFILES = ["default", "nuke", "blender", "multipart"]
# Passes that a Blender file has to hold, and the kinds of their sockets.
PASSES = {
    "Combined": "RGBA", "Alpha": "VALUE", "Depth": "VALUE", "Normal": "VECTOR", "Position": "VECTOR", "UV": "VECTOR",
    "Diffuse Direct": "RGBA", "Diffuse Indirect": "RGBA", "Glossy Direct": "RGBA", "Glossy Indirect": "RGBA",
    "Transmission Direct": "RGBA", "Transmission Indirect": "RGBA", "Emission": "RGBA", "Environment": "RGBA",
    "Object Index": "VALUE", "Material Index": "VALUE", "Denoising Albedo": "RGBA", "Denoising Normal": "VECTOR",
    "CryptoObject00": "RGBA", "CryptoMaterial02": "RGBA",
}

rows = []


def row(program, profile, what, good, note=""):
    rows.append((program, profile, what, "yes" if good else "NO", note))


def check(program, folder):
    for profile in PROFILES:
        command = [program, "check-exr", folder / f"{profile}.exr", "--profile", profile, "--fail-on-warning"]
        done = subprocess.run(command, capture_output=True, text=True)
        row("check-exr", profile, "clean", done.returncode == 0, done.stdout.splitlines()[0] if done.returncode else "")


def openimageio(folder):
    try:
        import OpenImageIO as oiio
    except ImportError:
        return row("OpenImageIO", "-", "installed", True, "left out: not installed")
    version = oiio.VERSION_STRING
    for profile in PROFILES:
        file = oiio.ImageInput.open(str(folder / f"{profile}.exr"))
        spec = file.spec()
        names = list(spec.channelnames)
        depth = {"multipart": None, "blender": None}.get(profile, "Z")
        expected = ["R", "G", "B", "A"] + (["Z"] if depth == "Z" else [])
        row(f"OpenImageIO {version}", profile, "R, G, B, A(, Z) come first", names[: len(expected)] == expected, " ".join(names[:6]))
        row(f"OpenImageIO {version}", profile, "alpha is channel 3", spec.alpha_channel == 3, str(spec.alpha_channel))
        if depth:
            row(f"OpenImageIO {version}", profile, "depth is found", names[spec.z_channel] == depth, str(spec.z_channel))
        types = dict(zip(names, spec.channelformats or [spec.format] * len(names)))
        row(f"OpenImageIO {version}", profile, "R is half", str(types["R"]) == "half", str(types["R"]))
        parts = 1
        while file.seek_subimage(parts, 0):
            parts += 1
        row(f"OpenImageIO {version}", profile, "parts", parts == (3 if profile == "multipart" else 1), str(parts))
        file.close()


def pixels(folder):
    if not shutil.which("idiff"):
        return row("idiff", "-", "installed", True, "left out: not installed")
    for profile in PROFILES[1:]:
        flat = folder / f"{profile}.tif"
        pick = ["oiiotool", folder / f"{profile}.exr", "--ch", "R,G,B,A", "-d", "float", "-o", flat]
        own = ["oiiotool", folder / "default.exr", "--ch", "R,G,B,A", "-d", "float", "-o", folder / "default.tif"]
        read = all(subprocess.run(command, capture_output=True).returncode == 0 for command in (own, pick))
        same = subprocess.run(["idiff", "-q", "-fail", "0", folder / "default.tif", flat], capture_output=True)
        row("idiff", profile, "equals the default file", read and same.returncode == 0)


def blender(folder):
    script = pathlib.Path(__file__).resolve()
    done = subprocess.run([sys.executable, script, "--blender", folder], capture_output=True, text=True)
    lines = [line.split("\t") for line in done.stdout.splitlines() if line.startswith("ROW\t")]
    if not lines:
        return row("Blender", "-", "installed", True, "left out: no module bpy")
    for _, program, profile, what, good, note in lines:
        row(program, profile, what, good == "True", note)


def inside_blender(folder):
    import bpy

    program = f"Blender {bpy.app.version_string}"
    for profile in ["blender", "default"]:
        image = bpy.data.images.load(str(folder / f"{profile}.exr"))
        tree = bpy.data.node_groups.new("tree", "CompositorNodeTree")
        node = tree.nodes.new("CompositorNodeImage")
        node.image = image
        sockets = {socket.name: socket.type for socket in node.outputs}
        if profile == "blender":
            wrong = [name for name, kind in PASSES.items() if sockets.get(name) != kind]
            print("ROW", program, profile, f"{len(PASSES)} passes by name and kind", not wrong, ", ".join(wrong), sep="\t")
        else:
            print("ROW", program, profile, "Combined and Depth", sockets.get("Combined") == "RGBA" and "Depth" in sockets, "", sep="\t")
        matte = tree.nodes.new("CompositorNodeCryptomatteV2")
        matte.source = "IMAGE"
        matte.image = image
        print("ROW", program, profile, "Cryptomatte node finds the mattes", matte.layer_name == "CryptoObject", matte.layer_name, sep="\t")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default="target/release/steradian")
    parser.add_argument("--scene", default="scenes/shapes.json")
    parser.add_argument("--out")
    parser.add_argument("--blender", type=pathlib.Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.blender:
        return inside_blender(arguments.blender)
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(arguments.out or scratch).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        for profile in PROFILES:
            command = [arguments.program, "render", arguments.scene, "-q", "--spp", "4", "--size", "160x120"]
            command += ["--layers", LAYERS, "--exr", f"profile={profile}", "-o", folder / f"{profile}.exr"]
            subprocess.run(command, check=True)
        check(arguments.program, folder)
        openimageio(folder)
        pixels(folder)
        blender(folder)
    widths = [max(len(str(line[i])) for line in rows) for i in range(4)]
    for line in rows:
        print("  ".join(str(cell).ljust(width) for cell, width in zip(line, widths + [0])).rstrip())
    sys.exit(any(line[3] == "NO" for line in rows))


main()
