"""The parts of the add-on by themselves, and the engine without a display."""

import math
import threading
import tomllib
from pathlib import Path

import bpy
import numpy as np
import pytest
import scenes
import steradian
from bl_ext.user_default.steradian import camera, engine, fields, lights, meshes, passes, session, settings
from bl_ext.user_default.steradian.export import Export
from bl_ext.user_default.steradian.images import linear
from bl_ext.user_default.steradian.report import Report


def export(folder):
    """The scene as Steradian's, and the warnings."""
    found = Export(bpy.context.evaluated_depsgraph_get(), folder)
    return found.scene(), found.report.lines


def test_the_manifest_names_the_wheel_inside():
    folder = Path(engine.__file__).parent
    manifest = tomllib.loads((folder / "blender_manifest.toml").read_text())
    (wheel,) = manifest["wheels"]
    assert (folder / wheel).is_file() and manifest["version"] == steradian.__version__


def test_corners_that_agree_share_a_vertex():
    # Two triangles with an edge in common; at vertex 1 their second attributes differ.
    vertices = np.array([0, 1, 2, 2, 1, 3])
    normals = np.zeros((6, 3), np.float32)
    uvs = np.array([[0, 0], [1, 0], [0, 1], [0, 1], [0.5, 0], [1, 1]], np.float32)
    corners, vertex = meshes.shared_corners(vertices, [normals, uvs])
    assert len(corners) == 5 and vertex[2] == vertex[3] and vertex[1] != vertex[4]
    assert np.array_equal(vertices[corners[vertex]], vertices) and np.array_equal(uvs[corners[vertex]], uvs)


def test_meshes_are_arrays_with_few_vertices():
    ball = scenes.ball(1)
    (smooth,) = meshes.arrays(ball.to_mesh()).values()
    assert smooth["triangles"].shape == (48 * 22 * 2 + 96, 3) and smooth["normals"].shape == smooth["positions"].shape
    # One seam of uv, and a corner for each triangle at the poles.
    assert len(smooth["positions"]) < 1.15 * len(ball.data.vertices)
    ball.data.shade_flat()
    (flat,) = meshes.arrays(ball.to_mesh()).values()
    assert "normals" not in flat
    for array in smooth.values():
        assert isinstance(array, np.ndarray)


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_viewports_see_what_cameras_see(kind):
    found = scenes.camera((1, -5, 2), (0, 0, 0.5), type=kind, lens=40, shift_x=0.1, shift_y=-0.2, ortho_scale=5)
    scene, depsgraph = bpy.context.scene, bpy.context.evaluated_depsgraph_get()
    window = found.calc_matrix_camera(depsgraph, x=96, y=72)
    view = camera.of_view(found.matrix_world.inverted(), window)
    expected = camera.convert(scene, found.matrix_world, found, Report())
    for key in ("vertical_fov_degrees", "view_height", "shift"):
        assert view.get(key) == (pytest.approx(expected[key], rel=1e-4) if key in expected else None)


def test_spots_have_the_flux_of_cycles():
    assert lights.flux_beam(0.6, 0.0) == pytest.approx(0.6, abs=1e-3)
    wide, narrow = lights.flux_beam(0.6, 0.2), lights.flux_beam(0.6, 0.9)
    assert 0 < narrow < wide < 0.6


def test_shared_meshes_are_there_once(tmp_path):
    ball = scenes.ball(0.3, material=scenes.diffuse((0.7, 0.3, 0.2)))
    for i in range(5):
        scenes.link(ball.data, f"copy {i}", (i, 0, 0))
    other = scenes.link(ball.data, "other", (0, 2, 0))
    other.material_slots[0].link = "OBJECT"
    other.material_slots[0].material = scenes.diffuse((0, 0, 1), "blue")
    scenes.camera((0, -5, 2), (0, 0, 0))
    scene, warnings = export(tmp_path)
    assert len(scene["objects"]) == 1 and len(scene["instances"]) == 6 and not warnings
    assert [shape["name"] for shape in scene["shapes"]] == ["other"]
    assert {each["name"] for each in scene["instances"]} == {"ball", *(f"copy {i}" for i in range(5))}


def test_images_on_disk_are_not_copied(tmp_path):
    image = scenes.image(np.full((4, 4, 3), 0.5, np.float32), "disk")
    image.filepath_raw, image.file_format = str(tmp_path / "disk.png"), "PNG"
    image.save()
    material, node = scenes.shader("ShaderNodeBsdfPrincipled")
    scenes.image_node(node, "Base Color", bpy.data.images.load(str(tmp_path / "disk.png")))
    scenes.plane(1, material=material)
    scenes.camera((0, -5, 2), (0, 0, 0))
    scene, _ = export(tmp_path)
    (texture,) = scene["textures"].values()
    assert texture["file"] == str(tmp_path / "disk.png") and texture["color_space"] == "srgb"


def test_what_has_no_counterpart_is_named_once(tmp_path):
    material, node = scenes.shader("ShaderNodeBsdfPrincipled", Sheen_Weight=1.0, Subsurface_Weight=0.5)
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    material.node_tree.links.new(noise.outputs["Color"], node.inputs["Base Color"])
    toon, _ = scenes.shader("ShaderNodeBsdfToon", "toon")
    for place, each in ((0, material), (1, material), (2, toon)):
        scenes.plane(1, (place, 0, 0), each)
    lamp = scenes.lamp("AREA", (0, 0, 3), spread=1.0)
    scenes.camera((0, -5, 2), (0, 0, 0))
    _, warnings = export(tmp_path)
    expected = [
        "material material: node Principled BSDF: Subsurface Weight is left out",
        "material material: node Noise Texture: nodes of type Noise Texture are left out; Base Color has its own value",
        "material material: node Principled BSDF: its sheen is that of Disney's model",
        "material toon: node Toon BSDF: shaders of type Toon BSDF are left out, as diffuse grey",
        f"light {lamp.name}: its spread is left out: it shines in all directions",
    ]
    assert sorted(warnings) == sorted(expected)


def test_volumes_are_boxes_with_media(tmp_path):
    values = {"Color": (0.8, 0.6, 0.2), "Density": 3.0, "Anisotropy": 0.25, "Absorption_Color": (0.25, 0.0, 0.0)}
    heat = {"Blackbody_Intensity": 0.5, "Temperature": 1500.0}
    material, _ = scenes.volume("ShaderNodeVolumePrincipled", **values, **heat)
    found = scenes.smoke(material, location=(1, 2, 3))
    found.scale = (2, 2, 2)
    scenes.camera((0, -5, 2), (0, 0, 0))
    scene, warnings = export(tmp_path)
    assert not warnings
    medium = scene["media"]["smoke"]
    # Twice the size, half the density; what is not scattered is absorbed, times 1 - sqrt(0.25) of red.
    assert medium["scattering"] == pytest.approx([1.2, 0.9, 0.3])
    assert medium["absorption"] == pytest.approx([0.2 * 0.5 * 1.5, 0.4 * 1.5, 0.8 * 1.5])
    assert medium["emission"] == pytest.approx([0.25] * 3)
    assert medium["phase"] == {"type": "henyey_greenstein", "g": pytest.approx(0.25)}
    volume = medium["volume"]
    assert {key: volume[key]["grid"] for key in ("scattering", "absorption", "temperature")} == {
        "scattering": "density",
        "absorption": "density",
        "temperature": "temperature",
    }
    assert volume["scattering"]["file"].endswith("fire.vdb") and volume["temperature_scale"] == 1500
    assert volume["transform"]["matrix"][0] == pytest.approx([2, 0, 0, 1])
    (shape,) = scene["shapes"]
    assert shape["type"] == "cube" and shape["name"] == "smoke"
    assert scene["materials"][shape["material"]] == {"type": "dielectric", "ior": 1, "medium": "smoke"}
    corner = [t.get("translate") for t in shape["transform"]][1]
    low, high = (np.array(found.bound_box).min(axis=0), np.array(found.bound_box).max(axis=0))
    assert corner == pytest.approx(list((low + high) / 2)) and shape["transform"][0]["scale"] == pytest.approx(
        list((high - low) / 2)
    )


def test_other_volume_shaders_and_what_they_lack(tmp_path):
    scatter, node = scenes.volume("ShaderNodeVolumeScatter", "scatter", Color=(0.5, 0.5, 0.5))
    info, half = (scatter.node_tree.nodes.new(kind) for kind in ("ShaderNodeVolumeInfo", "ShaderNodeMath"))
    half.operation, half.inputs[1].default_value = "MULTIPLY", 4.0
    scatter.node_tree.links.new(info.outputs["Density"], half.inputs[0])
    scatter.node_tree.links.new(half.outputs[0], node.inputs["Density"])
    absorb, _ = scenes.volume("ShaderNodeVolumeAbsorption", "absorb", Color=(0.75, 0.5, 1.0), Density=2.0)
    first, second = scenes.smoke(scatter), scenes.smoke(absorb)
    scenes.smoke(scenes.diffuse((1, 1, 1)))
    gone = scenes.smoke(scatter)
    gone.data.filepath = "/nowhere/gone.vdb"
    scenes.camera((0, -5, 2), (0, 0, 0))
    scene, warnings = export(tmp_path)
    grid = scene["media"][first.name]["volume"]["scattering"]
    assert scene["media"][first.name]["scattering"] == [2.0] * 3 and grid["grid"] == "density"
    assert scene["media"][second.name]["absorption"] == [0.5, 1.0, 0.0] and len(scene["media"]) == 2
    assert "volume" not in scene["media"][second.name]
    assert len(warnings) == 2
    assert "it has no volume shader and is left out" in warnings[0]
    assert "its volume cannot be read and is left out" in warnings[1]


def test_constants_are_computed(tmp_path):
    material, node = scenes.shader("ShaderNodeBsdfDiffuse")
    tree = material.node_tree
    gamma = tree.nodes.new("ShaderNodeGamma")
    scenes.fill(gamma, Color=(0.5, 0.25, 1.0), Gamma=2.0)
    tree.links.new(gamma.outputs[0], node.inputs["Color"])
    scenes.plane(1, material=material)
    scenes.camera((0, -5, 2), (0, 0, 0))
    scene, _ = export(tmp_path)
    assert scene["materials"]["material"]["albedo"] == pytest.approx([0.25, 0.0625, 1.0])


def test_colors_are_linear_in_images():
    values = np.array([0.0, 0.04, 0.5, 1.0], np.float32)
    assert linear(values) == pytest.approx([0, 0.04 / 12.92, 0.21404, 1], abs=1e-5)
    assert fields.constant((0.2, 0.4, 0.6)).number() == pytest.approx(0.2 * 0.2126 + 0.4 * 0.7152 + 0.6 * 0.0722)


def multilayer(path):
    """Renders the scene to an EXR file with all passes and returns its bytes."""
    scene = bpy.context.scene
    scene.render.engine, scene.steradian.samples = "STERADIAN", 4
    output = scene.render.image_settings
    if hasattr(output, "media_type"):
        output.media_type = "MULTI_LAYER_IMAGE"
    output.file_format = "OPEN_EXR_MULTILAYER"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    if hasattr(output, "media_type"):
        output.media_type = "IMAGE"
    output.file_format = "OPEN_EXR"
    return path.read_bytes()


def test_passes_and_mattes_are_in_the_result(tmp_path):
    scenes.room()
    scenes.lamp("AREA", (0, 0, 2.9), energy=60, size=1)
    layer = bpy.context.view_layer
    for name in ("z", "normal", "position", "cryptomatte_object", "cryptomatte_material"):
        setattr(layer, f"use_pass_{name}", True)
    layer.steradian.layers = {"albedo", "diffuse_direct"}
    data = multilayer(tmp_path / "all.exr")
    for name in (
        "Depth.Z",
        "Normal.X",
        "Position.Y",
        "Steradian Albedo.G",
        "Steradian Diffuse Direct.R",
        "CryptoObject00.R",
        "CryptoMaterial00.A",
    ):
        assert f"{layer.name}.{name}\0".encode() in data or f"{layer.name}.{name.lower()}\0".encode() in data, name
    for text in (b"cryptomatte/", b"MurmurHash3_32", b'"block":"', b'"red":"', f"{layer.name}.CryptoObject".encode()):
        assert text in data, text


def test_the_picture_is_that_of_the_wheel(tmp_path):
    scenes.room()
    scenes.lamp("AREA", (0, 0, 2.9), energy=60, size=1)
    ours = scenes.picture("STERADIAN", 4)
    scene, _ = export(tmp_path)
    chosen = settings.of_render(bpy.context.scene)
    direct = steradian.render(steradian.load_dict(scene), **chosen)["color"]
    assert np.array_equal(ours.astype(np.float32), direct)


def test_the_denoiser_of_blender_is_used():
    scenes.room()
    scenes.lamp("AREA", (0, 0, 2.9), energy=60, size=1)
    noisy = scenes.picture("STERADIAN", 4)
    bpy.context.scene.steradian.denoise = True
    clean = scenes.picture("STERADIAN", 4)
    roughness = [np.abs(np.diff(each[..., 0], axis=1)).mean() for each in (noisy, clean)]
    assert roughness[1] < 0.5 * roughness[0] and clean.mean() == pytest.approx(noisy.mean(), rel=0.02)


def test_errors_are_reported_and_nothing_is_rendered():
    bpy.context.scene.render.engine = "STERADIAN"
    scenes.plane(1)
    with pytest.raises(RuntimeError, match="camera"):
        bpy.ops.render.render()


class Listener:
    """What a render needs of an engine, with a cancel after the first report."""

    def __init__(self):
        self.shares, self.ended, self.is_cancelled = [], 0, False
        self.layer = type("Layer", (), {"passes": {}})

    def add_pass(self, *arguments, **names):
        pass

    def begin_result(self, *arguments, **names):
        return type("Result", (), {"layers": [self.layer]})

    def get_result(self):
        return None

    def end_result(self, result):
        self.ended += 1

    def update_result(self, result):
        pass

    def update_stats(self, *texts):
        pass

    def update_progress(self, share):
        self.shares.append(share)

    def test_break(self):
        return bool(self.shares)


def test_a_render_reports_progress_and_is_cancelled(tmp_path):
    scenes.room()
    scenes.lamp("AREA", (0, 0, 2.9), energy=60, size=1)
    scene, _ = export(tmp_path)
    listener = Listener()
    engine.Engine._trace(listener, steradian.load_dict(scene, spp=1 << 20), bpy.context.view_layer, (96, 72))
    assert listener.ended == 1 and listener.shares and max(listener.shares) < 1


def test_a_viewport_is_rendered_in_passes_and_moves(tmp_path):
    scenes.room()
    scenes.lamp("AREA", (0, 0, 2.9), energy=60, size=1)
    scene, _ = export(tmp_path)
    first = threading.Event()
    view = session.Session(first.set)
    view.start(scene, spp=1 << 20, size=(32, 24))
    assert first.wait(60)
    picture, samples = view.latest()
    assert picture.shape == (24, 32, 4) and 0 < samples < 1 << 20 and not view.is_done
    moved = {**scene["camera"], "vertical_fov_degrees": 20.0}
    view.move(moved, spp=8, size=(32, 24))
    view.wait()
    after, samples = view.latest()
    assert samples == 8 and view.is_done and view.error is None
    expected = steradian.render(steradian.load_dict({**scene, "camera": moved}), spp=8, size=(32, 24))["color"]
    assert np.array_equal(after, expected)
    view.start({**scene, "camera": {"vertical_fov_degrees": -1}}, spp=1)
    view.wait()
    assert "vertical_fov_degrees" in view.error
    view.stop()


def test_every_pass_has_a_layer():
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_cryptomatte_object = True
    layer.steradian.layers = {name for name, _, _ in settings.LAYERS}
    assert passes.layers(layer)[0] == "Z" and passes.layers(layer)[-1] == "crypto_object"
    assert len(passes.layers(layer)) == len(settings.LAYERS) + 2
    layer.pass_cryptomatte_depth = 4
    assert [each.name for each in passes.matte_passes(layer)["object"]] == ["CryptoObject00", "CryptoObject01"]


def test_disabling_leaves_nothing_behind():
    import addon_utils

    name = "bl_ext.user_default.steradian"
    addon_utils.disable(name)
    assert not hasattr(bpy.types.Scene, "steradian")
    addon_utils.enable(name)
    assert bpy.context.scene.steradian.samples == 128
    assert math.isclose(bpy.context.scene.steradian.clamp, 0)
