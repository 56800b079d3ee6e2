#!/usr/bin/env python3
"""Writes and renders the scenes of the gallery.

    docs/book/gallery.py                    all pictures, into docs/book/src/pictures
    docs/book/gallery.py pool chess         these only
    docs/book/gallery.py --spp 256 pool     with more samples than the scene has
    docs/book/gallery.py --draft DIR pool   small and noisy, into DIR
    docs/book/gallery.py --write DIR pool   the scene file with its meshes and images in DIR/pool, without rendering

The program is $STERADIAN, or `steradian` of the PATH; Intel Open Image Denoise is needed ($STERADIAN_OIDN), and NumPy and Pillow."""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

BOOK = Path(__file__).resolve().parent
sys.path.insert(0, str(BOOK / "gallery"))
import glass  # noqa: E402
import indoors  # noqa: E402
import outdoors  # noqa: E402
import studio  # noqa: E402

PICTURES = BOOK / "src/pictures"
SCENES = {function.__name__: function for function in indoors.SCENES + glass.SCENES + studio.SCENES + outdoors.SCENES}
# Largest size of a picture's file.
MAX_BYTES = 400_000


def write(name, folder):
    """Writes a scene and the files that it names into a folder; the path of the scene."""
    folder.mkdir(parents=True, exist_ok=True)
    for part in ("meshes", "textures"):
        if not (folder / part).exists():
            (folder / part).symlink_to(BOOK.parents[1] / "scenes" / part)
    scene = folder / f"{name}.json"
    scene.write_text(json.dumps(SCENES[name](folder), default=float))
    return scene


def render(scene, png, *options):
    program = os.environ.get("STERADIAN", "steradian")
    exposure = json.loads(scene.read_text())["outputs"][0].get("exposure", 0)
    command = [program, "render", scene, "-q", "--denoise", f"--exposure={exposure}", "-o", png, *options]
    subprocess.run(command, check=True)


def save(png, jpg):
    """As JPEG of the best quality that is small enough."""
    for quality in range(92, 50, -3):
        Image.open(png).convert("RGB").save(jpg, quality=quality, optimize=True, progressive=True)
        if jpg.stat().st_size <= MAX_BYTES:
            return


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(SCENES))
    parser.add_argument("--spp", metavar="N")
    parser.add_argument("--draft", type=Path, metavar="DIR")
    parser.add_argument("--write", type=Path, metavar="DIR")
    args = parser.parse_args()
    for name in args.names or SCENES:
        if args.write:
            print(write(name, args.write / name))
            continue
        with tempfile.TemporaryDirectory() as folder:
            scene, png = write(name, Path(folder)), Path(folder) / f"{name}.png"
            if args.draft:
                render(scene, png, "--size", "640x360", "--spp", "6")
                args.draft.mkdir(parents=True, exist_ok=True)
                Image.open(png).save(args.draft / f"{name}.png")
            else:
                render(scene, png, *(["--spp", args.spp] if args.spp else []))
                save(png, PICTURES / f"gallery_{name}.jpg")
        print(name)


main()
