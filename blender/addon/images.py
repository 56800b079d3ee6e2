"""Images as files that Steradian reads: those on disk as they are, all others through a temporary folder."""

import re
from pathlib import Path

import numpy as np
import steradian

READABLE = {"PNG": ".png", "JPEG": ".jpg", "TARGA": ".tga", "HDR": ".hdr", "OPEN_EXR": ".exr"}
LINEAR = {"Non-Color", "Linear", "Linear Rec.709", "Raw", "Generic Data"}


def linear(values):
    """Linear values of ones that are encoded by the sRGB curve."""
    return np.where(values <= 0.04045, values / 12.92, ((np.maximum(values, 0) + 0.055) / 1.055) ** 2.4)


class Images:
    """The files of a scene's images. folder: where those go that are on no disk."""

    def __init__(self, folder, report):
        self._folder, self._report = Path(folder), report
        self._files = {}
        self._pixels = {}

    def is_linear(self, image):
        """Whether the colours of an image are taken as they are; warns of colour spaces that are not known."""
        space = image.colorspace_settings.name
        if space != "sRGB" and space not in LINEAR:
            self._report.warn(f"image {image.name}", f"the colour space {space} is taken as sRGB")
        return space in LINEAR

    def pixels(self, image):
        """Linear pixels, an array of shape (height, width, 4) whose row 0 is at the top; None if there are none."""
        key = image.name_full
        if key not in self._pixels:
            width, height = image.size
            if width * height == 0:
                self._report.warn(f"image {image.name}", "it cannot be read")
                return None
            values = np.empty(width * height * 4, np.float32)
            image.pixels.foreach_get(values)
            values = values.reshape(height, width, 4)[::-1]
            if not image.is_float and not self.is_linear(image):
                values = np.concatenate([linear(values[..., :3]), values[..., 3:]], axis=2)
            self._pixels[key] = np.ascontiguousarray(values, np.float32)
        return self._pixels[key]

    def file(self, image, extensions=tuple(READABLE)):
        """The name of a file with the image; None if it cannot be read.

        extensions: the formats that may stay as they are.
        """
        key = (image.name_full, extensions)
        if key not in self._files:
            self._files[key] = self._find(image, extensions)
        return self._files[key]

    def _find(self, image, extensions):
        if image.source == "TILED":
            self._report.warn(f"image {image.name}", "of its tiles only the first is shown")
        as_it_is = image.source == "FILE" and image.file_format in extensions and not image.is_dirty
        if as_it_is and image.packed_file is not None:
            path = self._path(image.name, READABLE[image.file_format])
            path.write_bytes(image.packed_file.data)
            return str(path)
        if as_it_is:
            path = Path(image.filepath_from_user())
            if path.is_file() and path.suffix.lower() in (*READABLE.values(), ".jpeg"):
                return str(path)
        pixels = self.pixels(image)
        return None if pixels is None else self.write(image.name, pixels)

    def write(self, name, pixels):
        """Writes linear pixels to a new file and returns its name."""
        path = self._path(name, ".exr")
        steradian.write(path, pixels, float=True)
        return str(path)

    def _path(self, name, extension):
        stem = re.sub(r"[^A-Za-z0-9_-]", "_", name)[:40]
        number = 0
        while (path := self._folder / f"{stem}_{number}{extension}").exists():
            number += 1
        return path
