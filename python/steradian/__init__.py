"""Steradian: a fast, accurate CPU renderer.

    import steradian as st

    scene = st.load("scene.xml", spp=64)     # .json, .xml (Mitsuba 3), .pbrt, .gltf, .glb
    image = st.render(scene)
    image["color"]                           # NumPy array (height, width, 4), linear, without a copy
    image.save("picture.exr")

    scene["materials.gold.roughness"] = 0.1  # the accelerator is kept
    image = st.render(scene, progress=True)
"""

from __future__ import annotations

from typing import Any, Callable, Iterator

from . import _progress
from ._errors import (
    CheckpointError,
    InternalError,
    MissingFileError,
    OutOfMemoryError,
    OutputError,
    SceneError,
    SettingError,
    SteradianError,
    UsageError,
)
from ._steradian import Image, Scene, __version__, compare, load, load_dict, read, schema, write
from ._steradian import render as _render

__all__ = [
    "CheckpointError",
    "Image",
    "InternalError",
    "MissingFileError",
    "OutOfMemoryError",
    "OutputError",
    "Parameters",
    "Scene",
    "SceneError",
    "SettingError",
    "SteradianError",
    "UsageError",
    "__version__",
    "bench",
    "compare",
    "load",
    "load_dict",
    "read",
    "render",
    "schema",
    "traverse",
    "write",
]


def render(
    scene: Scene,
    *,
    progress: bool | Callable[[float], Any] = False,
    picture: Callable[[Image, int], Any] | None = None,
    picture_every: float = 1.0,
    **settings: Any,
) -> Image:
    """Render a scene. Other threads run meanwhile; Ctrl-C ends the render with KeyboardInterrupt.

    progress: True shows a bar, in terminals and notebooks; a function is called with the share done, from 0 to 1. If it
    returns False the render ends, and the result is the picture of the samples so far; an exception ends the render too.

    picture: a function that is called with the picture so far and its samples per pixel, at most every `picture_every`
    seconds, in the thread that called `render`.

    Settings replace those of the scene for this render. They have the names of the options of `steradian render`:
    spp, size=(width, height), crop=(x, y, width, height), seed, threads, integrator="path", max_depth,
    layers=["N", "albedo"] or "all", time_limit (seconds), target_error, accel="embree", guiding, caustics="photons",
    bidirectional=True, roulette="auto", clamp, denoise=True, oidn_library, set={"film.filter.type": "box"} and so on.
    """
    if progress is True:
        with _progress.Bar() as bar:
            return _render(scene, progress=bar, picture=picture, picture_every=picture_every, **settings)
    return _render(scene, progress=progress or None, picture=picture, picture_every=picture_every, **settings)


def bench(scene: Scene, *, seconds: float = 2.0, **settings: Any) -> dict[str, Any]:
    """Render for some seconds; the result has the speed: "msamples_per_second", "mrays_per_second", ..."""
    settings = {"spp": 1 << 20, **settings, "time_limit": seconds}
    return render(scene, **settings).statistics


class Parameters:
    """The parameters of a scene by their paths, as `mitsuba.traverse` has them. Changes count from the next render on."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene

    def __getitem__(self, path: str) -> Any:
        return self._scene[path]

    def __setitem__(self, path: str, value: Any) -> None:
        self._scene[path] = value

    def __iter__(self) -> Iterator[str]:
        parts = self._scene.to_dict()
        for part in ("camera", "film", "sampler", "integrator", "materials", "textures", "media", "lights", "shapes"):
            yield from _paths(part, parts.get(part, {}))

    def __contains__(self, path: object) -> bool:
        return any(path == known for known in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def keys(self) -> list[str]:
        """All paths whose values are set."""
        return list(self)

    def update(self, values: dict[str, Any] | None = None) -> None:
        """Set several values. Without any, do nothing: changes need no update."""
        for path, value in (values or {}).items():
            self[path] = value

    def __repr__(self) -> str:
        return "\n".join(f"{path} = {self[path]!r}" for path in self)


def _paths(path: str, value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _paths(f"{path}.{key}", inner)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for i, inner in enumerate(value):
            yield from _paths(f"{path}[{i}]", inner)
    else:
        yield path


def traverse(scene: Scene) -> Parameters:
    """The parameters of a scene."""
    return Parameters(scene)
