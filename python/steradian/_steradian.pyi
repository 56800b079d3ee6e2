from os import PathLike
from typing import Any, Callable, Iterator

import numpy
from numpy.typing import ArrayLike, NDArray

__version__: str

class Scene:
    """A scene with the settings of its render."""

    @property
    def file(self) -> str:
        """The scene's file."""
    @property
    def settings(self) -> dict[str, Any]:
        """The settings that replace the scene's."""
    @property
    def report(self) -> list[str]:
        """What of another renderer's scene was not mapped exactly, one line each."""
    def to_dict(self) -> dict[str, Any]:
        """The scene in the scene format."""
    def build(self) -> None:
        """Read what the scene names and build the accelerator."""
    def __getitem__(self, path: str) -> Any: ...
    def __setitem__(self, path: str, value: Any) -> None: ...

class Layer:
    @property
    def __array_interface__(self) -> dict[str, Any]: ...

class Image:
    """A picture with its layers."""

    @property
    def layers(self) -> list[str]:
        """Names of the layers, "color" first."""
    @property
    def width(self) -> int:
        """Width in pixels."""
    @property
    def height(self) -> int:
        """Height in pixels."""
    @property
    def shape(self) -> tuple[int, int, int]:
        """(height, width, channels) of the colour."""
    @property
    def statistics(self) -> dict[str, Any]:
        """Time, rays, samples and memory of the render; None of a picture that was read."""
    def channels(self, layer: str) -> list[str]:
        """Names of a layer's channels."""
    def cryptomatte(self, layer: str, *, depth: int = 6) -> dict[str, Any]:
        """A layer of Cryptomatte: "channels" (names), "data" (an array) and "metadata" (attributes for EXR files)."""
    def save(
        self, file: str | PathLike[str], *, exposure: float = 0.0, view: str | None = None, float: bool = False
    ) -> None:
        """Write an .exr or .png file."""
    def __getitem__(self, layer: str) -> NDArray[numpy.float32]: ...
    def __contains__(self, layer: object) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def __len__(self) -> int: ...
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]: ...
    def _repr_png_(self) -> bytes: ...

def load(
    file: str | PathLike[str],
    *,
    defines: dict[str, Any] | None = None,
    time: float = 0.0,
    allow_missing: bool = False,
    **settings: Any,
) -> Scene: ...
def load_dict(scene: dict[str, Any], *, folder: str | PathLike[str] | None = None, **settings: Any) -> Scene: ...
def render(
    scene: Scene,
    *,
    progress: Callable[[float], Any] | None = None,
    picture: Callable[[Image, int], Any] | None = None,
    picture_every: float = 1.0,
    **settings: Any,
) -> Image: ...
def read(file: str | PathLike[str]) -> Image: ...
def write(
    file: str | PathLike[str],
    image: Image | ArrayLike,
    *,
    exposure: float = 0.0,
    view: str | None = None,
    float: bool = False,
) -> None: ...
def compare(reference: Image | ArrayLike | str | PathLike[str], test: Image | ArrayLike | str | PathLike[str]) -> dict[str, Any]: ...
def schema() -> str: ...
