"""Tests of the installed package: `python/test.sh` builds the wheel and runs them in a new environment."""

import gc
import json
import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import steradian as st

SCENES = Path(__file__).resolve().parents[2] / "scenes"


def ball(**changes):
    scene = {
        "camera": {"position": [0, 1, 6], "look_at": [0, 0, 0], "vertical_fov_degrees": 35},
        "film": {"width": 48, "height": 32},
        "materials": {"red": {"type": "diffuse", "albedo": [0.7, 0.1, 0.05]}},
        "shapes": [
            {"type": "sphere", "material": "red"},
            {"type": "quad", "origin": [-5, -1, 5], "edge_u": [10, 0, 0], "edge_v": [0, 0, -10]},
        ],
        "lights": [{"type": "environment", "radiance": [1, 1, 1]}],
    }
    return {**scene, **changes}


def tetrahedron():
    positions = np.array([[0, 0, 1], [1, 0, -1], [-1, 0, -1], [0, 1.5, 0]], np.float32)
    triangles = np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]], np.int64)
    return positions, triangles


def test_a_render_is_an_array():
    image = st.render(st.load_dict(ball(), spp=16))
    color = image["color"]
    assert color.shape == image.shape == (32, 48, 4) and color.dtype == np.float32
    red, green, blue, alpha = color[16, 24]
    assert red > 2 * green > 2 * blue > 0 and alpha == 1
    assert image.layers == ["color"] and "color" in image and "N" not in image and list(image) == ["color"]
    assert np.array_equal(np.asarray(image), color)
    assert image.statistics["spp"] == 16 and "48x32" in repr(image)
    with pytest.raises(KeyError, match="the picture has color"):
        image["Z"]


def test_layers_share_the_memory_of_the_image_and_keep_it_alive():
    image = st.render(st.load_dict(ball()), spp=1, layers=["N", "Z"])
    assert image.layers == ["color", "Z", "N"] and image.channels("N") == ["N.X", "N.Y", "N.Z"]
    first, second = image["N"], image["N"]
    assert np.shares_memory(first, second) and not first.flags.writeable and not first.flags.owndata
    copy = first.copy()
    del image, second
    gc.collect()
    np.zeros((64, 64, 64)).sum()
    assert np.array_equal(first, copy) and first.shape == (32, 48, 3)
    lengths = np.linalg.norm(first, axis=2)
    assert np.all((lengths == 0) | (abs(lengths - 1) < 1e-3))
    assert len(st.render(st.load_dict(ball()), spp=1, layers="all").layers) > 15


def test_settings_of_a_render_do_not_stay():
    scene = st.load_dict(ball(), spp=4, size=(20, 10))
    assert scene.settings == {"spp": 4, "size": [20, 10]}
    assert st.render(scene, spp=2).statistics["spp"] == 2
    assert st.render(scene).statistics["spp"] == 4
    assert st.render(scene, set={"film.width": 7, "film.height": 5}, size=None).shape == (5, 7, 4)
    normals = st.render(scene, integrator="normal")["color"]
    assert not np.array_equal(normals, st.render(scene)["color"])


def test_the_picture_depends_on_the_seed_and_not_on_threads():
    scene = st.load_dict(ball(), spp=4)
    one, two = st.render(scene, threads=1)["color"], st.render(scene, threads=3)["color"]
    assert np.array_equal(one, two)
    assert not np.array_equal(one, st.render(scene, seed=1)["color"])


def test_changes_give_the_picture_of_a_new_scene_and_keep_the_accelerator():
    scene = st.load_dict(ball(), spp=4, accel="embree")
    first = st.render(scene)
    scene["materials.red.albedo"] = np.array([0.1, 0.2, 0.8])
    scene["camera.position"] = (1, 2, 6)
    changed = st.render(scene)
    assert changed.statistics["build_seconds"] == 0 and first.statistics["build_seconds"] > 0
    other = ball(materials={"red": {"type": "diffuse", "albedo": [0.1, 0.2, 0.8]}})
    other["camera"]["position"] = [1, 2, 6]
    assert np.array_equal(changed["color"], st.render(st.load_dict(other), spp=4, accel="embree")["color"])
    assert scene["camera.position"] == [1, 2, 6]
    scene["shapes[0].radius"] = 0.5
    assert st.render(scene)["color"][16, 24, 2] < changed["color"][16, 24, 2]
    with pytest.raises(st.SceneError, match='did you mean "red"'):
        scene["materials.rad.albedo"] = 1
    with pytest.raises(st.SceneError, match="unknown field"):
        scene["materials.red.albdo"] = 1


def test_parameters_have_the_verbs_of_mitsuba():
    scene = st.load_dict(ball(), spp=1)
    parameters = st.traverse(scene)
    assert "materials.red.albedo" in parameters and "shapes[0].radius" in parameters.keys()
    parameters["materials.red.albedo"] = 0.3
    parameters.update({"camera.vertical_fov_degrees": 50.0})
    parameters.update()
    assert scene["camera.vertical_fov_degrees"] == 50.0 and scene["materials.red.albedo"] == pytest.approx(0.3)
    assert "camera.vertical_fov_degrees = 50.0" in repr(parameters)


def test_meshes_of_arrays_are_those_of_lists():
    positions, triangles = tetrahedron()
    colors = np.linspace(0.1, 0.9, 12, dtype=np.float32).reshape(4, 3)
    arrays = {"type": "mesh", "positions": positions, "triangles": triangles, "colors": colors}
    lists = {**arrays, "positions": positions.tolist(), "triangles": triangles.tolist(), "colors": colors.tolist()}
    pictures = [st.render(st.load_dict(ball(shapes=[mesh])), spp=4)["color"] for mesh in (arrays, lists)]
    assert np.array_equal(*pictures) and pictures[0][..., :3].std() > 0.01


def test_numbers_are_read_as_the_nearest(tmp_path):
    digits = np.random.default_rng(3)
    numbers = (digits.uniform(1, 10, 3000) * 10.0 ** digits.integers(-30, 30, 3000)).tolist()
    mesh = {"type": "mesh", "positions": [[x, 0, 0] for x in numbers], "triangles": [[0, 1, 2]]}
    file = tmp_path / "scene.json"
    file.write_text(json.dumps(ball(shapes=[mesh])))
    assert [x for x, _, _ in st.load(file)["shapes[0].positions"]] == numbers


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"positions": np.zeros((4, 2))}, r"positions has the shape \[4, 2\]"),
        ({"triangles": np.array([[0, 1, 4]])}, "triangles\\[0\\]"),
        ({"triangles": np.array([[0, 1, -1]])}, "triangles\\[0\\]"),
        ({"triangles": np.array([[0, 1, 2**32]])}, "triangles\\[0\\]"),
        ({"triangles": np.array([[0.0, 1.0, 2.0]])}, "whole numbers"),
        ({"normals": np.zeros((4, 4))}, "normals has the shape"),
    ],
)
def test_faulty_arrays_are_refused(change, message):
    positions, triangles = tetrahedron()
    mesh = {"type": "mesh", "positions": positions, "triangles": triangles, **change}
    with pytest.raises(ValueError, match=message):
        st.load_dict(ball(shapes=[mesh]))


def test_errors_have_classes_and_the_messages_of_the_library():
    with pytest.raises(FileNotFoundError, match="none.json"):
        st.load("none.json")
    with pytest.raises(st.SceneError, match='unknown key "shaeps" \\(did you mean "shapes"'):
        st.load_dict({**ball(), "shaeps": []})
    with pytest.raises(st.SettingError, match="`spp` 0"):
        st.load_dict(ball(), spp=0)
    with pytest.raises(ValueError, match="sp"):
        st.load_dict(ball(), sp=4)
    with pytest.raises(st.SettingError, match="layers"):
        st.render(st.load_dict(ball()), layers=["normls"])
    scene = st.load_dict(ball(materials={"red": {"type": "diffuse", "albedo": 3}}))
    for _ in range(2):
        with pytest.raises(st.SceneError, match="materials.red.albedo"):
            st.render(scene)
    with pytest.raises(OSError, match="cannot write"):
        st.render(st.load_dict(ball()), spp=1).save("/nowhere/a.exr")
    with pytest.raises(TypeError, match="no part of a scene"):
        st.load_dict(ball(comment=object()))
    assert issubclass(st.SettingError, st.SteradianError)


def test_files_come_back(tmp_path):
    image = st.render(st.load_dict(ball(), spp=4), layers=["N", "crypto_object"])
    image.save(tmp_path / "a.exr", float=True)
    again = st.read(tmp_path / "a.exr")
    assert np.array_equal(again["color"], image["color"]) and again.statistics is None
    assert b"CryptoObject00" in (tmp_path / "a.exr").read_bytes()
    image.save(tmp_path / "a.png", exposure=1, view="srgb")
    assert (tmp_path / "a.png").read_bytes()[:4] == image._repr_png_()[:4] == b"\x89PNG"
    ramp = np.linspace(0, 2, 60, dtype=np.float64).reshape(4, 5, 3)
    st.write(tmp_path / "b.exr", ramp, float=True)
    assert np.array_equal(st.read(tmp_path / "b.exr")["color"][..., :3], ramp.astype(np.float32))
    with pytest.raises(ValueError, match="3 or 4 channels"):
        st.write(tmp_path / "c.exr", np.zeros((4, 5, 2)))


def test_pictures_are_compared():
    scene = st.load_dict(ball(), spp=64)
    reference, test = st.render(scene), st.render(scene, spp=2, seed=1)
    errors = st.compare(reference, test)
    expected = np.mean((test["color"][..., :3].astype(float) - reference["color"][..., :3]) ** 2)
    assert errors["mse"] == pytest.approx(expected, rel=1e-6) and 0 < errors["flip"] < 1
    same = st.compare(reference["color"], reference)
    assert same["mse"] == 0 and same["flip"] == 0 and same["psnr"] is None
    with pytest.raises(ValueError, match="differ in size"):
        st.compare(reference, st.render(scene, size=(8, 8), spp=1))


def test_progress_is_reported_and_ends_at_one():
    shares = []
    st.render(st.load_dict(ball(), spp=64), progress=shares.append)
    assert shares[-1] == 1 and shares == sorted(shares)

    def fail(share):
        raise RuntimeError("enough")

    scene = st.load_dict(ball(), spp=1 << 24)
    with pytest.raises(RuntimeError, match="enough"):
        st.render(scene, progress=fail)
    assert st.render(scene, spp=1, progress=True).statistics["spp"] == 1


def test_false_ends_a_render_with_the_picture_so_far():
    scene = st.load_dict(ball(), spp=1 << 24)
    image = st.render(scene, progress=lambda share: share == 0)
    assert image.statistics["interrupted"] and 0 < image.statistics["spp"] < 1 << 24
    assert st.render(scene, spp=1, progress=lambda share: None).statistics["spp"] == 1


def test_pictures_on_the_way_are_handed_over():
    scene, found = st.load_dict(ball(), spp=1 << 24, layers=["N"]), []
    image = st.render(
        scene, picture=lambda image, samples: found.append((image, samples)), picture_every=0,
        progress=lambda share: len(found) < 3,
    )
    samples = [count for _, count in found]
    assert len(found) >= 3 and samples == sorted(samples) and samples[0] > 0
    for partial, _ in found:
        assert partial.layers == ["color", "N"] and partial.statistics is None
        assert partial["color"].mean() == pytest.approx(image["color"].mean(), rel=0.05)
    with pytest.raises(st.SettingError, match="picture_every"):
        st.render(scene, picture=print, picture_every=-1)


def test_cryptomatte_is_an_array_with_its_names():
    scene = st.load_dict(ball(), spp=4)
    matte = st.render(scene, layers=["crypto_material"]).cryptomatte("crypto_material", depth=4)
    assert matte["channels"][:5] == [f"CryptoMaterial00.{c}" for c in "rgba"] + ["CryptoMaterial01.r"]
    assert matte["data"].shape == (32, 48, 8)
    names = json.loads(next(text for key, text in matte["metadata"].items() if key.endswith("/manifest")))
    red = np.array([int(names["red"], 16)], np.uint32).view(np.float32)[0]
    assert matte["data"][16, 24, 0] == red and matte["data"][16, 24, 1] == 1
    assert {key.split("/")[2] for key in matte["metadata"]} == {"name", "hash", "conversion", "manifest"}
    image = st.render(scene, spp=1)
    for layer, depth, message in (("crypto_object", 6, "no Cryptomatte"), ("N", 6, "no Cryptomatte"), ("crypto_object", 3, "even")):
        with pytest.raises(st.SteradianError, match=message):
            image.cryptomatte(layer, depth=depth)


def test_a_hidden_lamp_is_seen_in_mirrors_alone():
    lamp = {"type": "sphere", "radius": 0.3, "transform": {"translate": [0, 0, 3]}, "emission": {"radiance": 9}}
    wall = {"type": "quad", "origin": [-5, -5, 0], "edge_u": [10, 0, 0], "edge_v": [0, 10, 0], "material": "mirror"}
    camera = {"position": [0, 0, 6], "look_at": [0, 0, 0]}
    scene = st.load_dict(ball(camera=camera, materials={"mirror": {"type": "mirror"}}, shapes=[lamp, wall], lights=[]), spp=1)
    assert st.render(scene)["color"][16, 24, 0] == pytest.approx(9, rel=1e-5)
    scene["shapes[0].emission.hidden"] = True
    # The mirror shows it at the same place, farther away.
    hidden = st.render(scene)["color"][..., 0]
    assert hidden[16, 24] > 7 and (hidden > 0).sum() < hidden.size / 20


def test_other_threads_run_during_a_render():
    scene, count = st.load_dict(ball(), spp=1 << 24), 0
    worker = threading.Thread(target=st.render, args=(scene,), kwargs={"time_limit": 1.0})
    worker.start()
    start = time.monotonic()
    while worker.is_alive() and time.monotonic() - start < 60:
        count += 1
        time.sleep(0.01)
    worker.join()
    # One without the lock would see at most one turn.
    assert count >= 10
    assert st.render(scene, spp=1).statistics["spp"] == 1


def test_a_scene_is_rendered_by_one_thread_at_a_time():
    scene, failures = st.load_dict(ball(), spp=1 << 24), []
    worker = threading.Thread(target=st.render, args=(scene,), kwargs={"time_limit": 1.0})
    worker.start()
    while worker.is_alive():
        try:
            scene["materials.red.albedo"] = 0.1
        except RuntimeError as error:
            failures.append(str(error))
        time.sleep(0.05)
    assert failures and "another thread" in failures[0]


def test_an_interrupt_ends_a_render_soon():
    scene = st.load_dict(ball(), spp=1 << 24)
    timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        st.render(scene)
    # The pass under way takes half a second, and is cancelled after one.
    assert time.monotonic() - start < 30
    assert st.render(scene, spp=1).statistics["spp"] == 1


def test_speed_is_measured():
    result = st.bench(st.load_dict(ball()), seconds=0.2)
    assert result["time_limited"] and result["msamples_per_second"] > 0 and result["mrays_per_second"] > 0


@pytest.mark.skipif(not SCENES.is_dir(), reason="a checkout of the repository is needed")
def test_scene_files_are_read_with_what_they_name(tmp_path):
    scene = st.load(SCENES / "cornell.json", size=(16, 16), spp=1)
    image = st.render(scene)
    assert scene.file.endswith("cornell.json") and image.shape == (16, 16, 4)
    xml = tmp_path / "a.xml"
    xml.write_text(
        '<scene version="3.0.0"><sensor type="perspective"><transform name="to_world"><lookat origin="0,0,5" '
        'target="0,0,0" up="0,1,0"/></transform></sensor><shape type="sphere"/><emitter type="constant"/></scene>'
    )
    assert st.render(st.load(xml, size=(8, 8)), spp=1)["color"].max() > 0


def test_the_schema_describes_scenes():
    assert '"vertical_fov_degrees"' in st.schema()


def test_the_package_is_typed():
    folder = Path(st.__file__).parent
    assert (folder / "py.typed").exists() and (folder / "_steradian.pyi").exists()
    for name in st.__all__:
        assert getattr(st, name) is not None
    for function in (st.load, st.load_dict, st.render, st.read, st.write, st.compare, st.Scene, st.Image):
        assert function.__doc__
