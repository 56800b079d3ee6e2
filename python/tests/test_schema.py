"""`steradian.schema()` accepts the scenes that `load_dict` accepts, and refuses the mistakes that it refuses."""

import copy
import json
from pathlib import Path

import jsonschema
import pytest
import steradian as st

SCENES = Path(__file__).resolve().parents[2] / "scenes"
VALIDATOR = jsonschema.Draft202012Validator(json.loads(st.schema()))

# Shapes, lights and materials of many kinds, instances of instances.
SCENE = {
    "film": {"width": 64, "height": 32, "crop": [8, 8, 16, 16], "filter": {"type": "gaussian"}},
    "camera": {
        "position": [0, 1, 5],
        "look_at": [0, 1, 0],
        "up": [0, 1, 0],
        "vertical_fov_degrees": 30,
        "lens": {"radius": 0.1, "focus_distance": 4},
    },
    "integrator": {"type": "path"},
    "sampler": {"spp": 4},
    "textures": {
        "tiles": {"type": "checker", "scale": [2, 2]},
        "grey": {"type": "constant", "color": [0.5, 0.5, 0.5]},
    },
    "materials": {
        "gold": {"type": "conductor", "metal": "gold", "roughness": 0.3},
        "tiled": {"type": "diffuse", "albedo": {"texture": "tiles"}},
        "glass": {"type": "dielectric", "ior": 1.5},
        "paint": {"type": "plastic", "albedo": [0.1, 0.2, 0.3], "alpha": [0.1, 0.2]},
        "mirror": {"type": "mirror", "reflectance": {"texture": "grey"}},
    },
    "shapes": [
        {"type": "sphere", "material": "gold", "radius": 1, "transform": [{"translate": [0, 1, 0]}]},
        {
            "type": "mesh",
            "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
            "triangles": [[0, 1, 2]],
            "emission": {"radiance": [1, 1, 1]},
        },
        {"type": "quad", "material": "tiled"},
        {"type": "disk"},
        {"type": "cylinder"},
        {"type": "cone"},
        {"type": "revolution", "profile": {"bezier": [[1, 0], [1, 1], [1, 2], [1, 3]]}},
        {"type": "cube", "material": "paint"},
    ],
    "objects": {
        "lamp": {
            "shapes": [{"type": "disk", "material": "glass"}, {"type": "sphere", "emission": {"radiance": [1, 2, 3]}}]
        },
        "pair": {"instances": [{"object": "lamp"}, {"object": "lamp", "transform": [{"translate": [2, 0, 0]}]}]},
    },
    "instances": [{"object": "pair", "transform": [{"scale": 2}]}],
    "lights": [
        {"type": "point", "position": [0, 5, 0], "intensity": [1, 1, 1]},
        {"type": "spot", "position": [0, 5, 0], "look_at": [0, 0, 0], "intensity": [1, 1, 1]},
        {"type": "directional", "direction": [0, -1, 0], "irradiance": [1, 1, 1], "angular_diameter_degrees": 0.5},
        {"type": "environment", "radiance": [0.1, 0.1, 0.1]},
    ],
    "outputs": [{"file": "out.exr", "layers": ["Z", "albedo"]}],
}


def changed(path, value):
    """The scene with the member at `path`, keys and indices, set; `None` removes it."""
    scene = copy.deepcopy(SCENE)
    *parents, last = path
    node = scene
    for key in parents:
        node = node[key]
    if value is None:
        del node[last]
    else:
        node[last] = value
    return scene


def faults(scene):
    return [error.message for error in VALIDATOR.iter_errors(scene)]


def test_the_schema_is_valid():
    jsonschema.Draft202012Validator.check_schema(json.loads(st.schema()))


# Short forms of lists and colours.
@pytest.mark.parametrize(
    "path, value",
    [
        (["camera", "position"], [0, 1, 5]),
        (["shapes"], {"type": "cube"}),
        (["shapes", 0, "transform"], {"scale": 2}),
        (["lights"], {"type": "environment", "radiance": 1}),
        (["lights", 0, "intensity"], 3.5),
        (["textures", "tiles", "scale"], 2),
        (["instances"], {"object": "pair"}),
        (["outputs"], {"file": "a.exr", "layers": "albedo"}),
    ],
)
def test_scenes_are_valid_and_compile(path, value):
    scene = changed(path, value)
    assert faults(scene) == []
    st.load_dict(scene)


@pytest.mark.parametrize(
    "path, value",
    [
        (["shaeps"], []),
        (["camera", "postion"], [0, 0, 0]),
        (["shapes", 0, "raduis"], 1),
        (["shapes", 0, "type"], "shpere"),
        (["shapes", 0, "radius"], "one"),
        (["materials", "gold", "roughnes"], 0.1),
        (["materials", "tiled", "albedo"], "red"),
        (["shapes", 0, "transform"], [{"trnslate": [0, 0, 0]}]),
        (["lights", 0, "intensity"], [1, 1]),
        (["film", "filter", "sgima"], 1),
        (["integrator"], {"type": "normal", "max_depth": 3}),
        (["camera"], None),
    ],
)
def test_mistakes_are_refused_by_the_schema_and_by_the_loader(path, value):
    scene = changed(path, value)
    assert faults(scene)
    with pytest.raises(st.SteradianError):
        st.load_dict(scene)


@pytest.mark.parametrize("file", sorted(SCENES.glob("*.json")), ids=lambda file: file.stem)
def test_the_scenes_of_the_project_are_valid(file):
    # Comments have lines of their own there.
    lines = [line for line in file.read_text().splitlines() if not line.lstrip().startswith("//")]
    assert faults(json.loads("\n".join(lines))) == []
