#!/usr/bin/env python3
"""Renders the pictures of the book into src/pictures: the rooms of the tutorial, one scene for each example of a shape, a material, subdivision and displacement, and the gallery.

    docs/book/render.py                              all pictures
    docs/book/render.py material_mix gallery_pool    these only; gallery.py has more options for those of the gallery

The program is $STERADIAN, or `steradian` of the PATH; Intel Open Image Denoise is needed ($STERADIAN_OIDN), and Pillow for the JPEG files."""

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

BOOK = Path(__file__).resolve().parent
ROOT = BOOK.parents[1]
PICTURES = BOOK / "src/pictures"
STAGE = json.loads((BOOK / "stage.json").read_text())


def examples():
    text = (ROOT / "crates/cli/src/manual/examples.txt").read_text()
    for block in text.split("\n# ")[1:]:
        head, body = block.split("\n", 1)
        kind, _, name = head.strip().partition(" ")
        kind = kind.removesuffix("Desc")
        if kind in ("Shape", "Material", "Subdivision", "Displacement"):
            yield kind.lower(), name, json.loads(body)


def render(scene, name, folder, *options):
    program = os.environ.get("STERADIAN", "steradian")
    png = folder / f"{name}.png"
    subprocess.run([program, "render", scene, "-q", "--denoise", "-o", png, *options], check=True)
    Image.open(png).convert("RGB").save(PICTURES / f"{name}.jpg", quality=85)
    print(name)


def main(wanted):
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        for part in ("meshes", "textures", "measured"):
            (folder / part).symlink_to(ROOT / "scenes" / part)
        for scene in sorted((BOOK / "scenes").glob("room_*.json")):
            if not wanted or scene.stem in wanted:
                render(scene, scene.stem, folder, "--spp", "128")
        for kind, name, entry in examples():
            picture = f"{kind}_{name}" if name else kind
            if wanted and picture not in wanted:
                continue
            stage = json.loads(json.dumps(STAGE))
            if kind == "material":
                stage["materials"]["shown"] = entry
                entry = {"type": "sphere", "radius": 0.8, "material": "shown", "transform": [{"translate": [0, 0.8, 0]}]}
            stage["shapes"].append(entry)
            scene = folder / f"{picture}.json"
            scene.write_text(json.dumps(stage))
            render(scene, picture, folder, "--spp", "128", "--size", "256x256")
    gallery = [name.removeprefix("gallery_") for name in wanted if name.startswith("gallery_")]
    if gallery or not wanted:
        subprocess.run([sys.executable, BOOK / "gallery.py", *gallery], check=True)


main(sys.argv[1:])
