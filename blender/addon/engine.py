"""The render engine: final renders and viewports."""

import tempfile
from pathlib import Path

import bpy
import steradian

from . import camera, passes, settings
from .export import Export
from .session import Session


def denoiser():
    """The Open Image Denoise that comes with Blender; None where the renderer is to look for one itself."""
    for folder in (Path(bpy.app.binary_path or bpy.__file__).parent, Path(bpy.utils.resource_path("LOCAL")).parent):
        found = sorted(folder.glob("lib/libOpenImageDenoise.so*"))
        if found:
            return str(found[0])
    return None


class Engine(bpy.types.RenderEngine):
    bl_idname = "STERADIAN"
    bl_label = "Steradian"
    bl_use_preview = True
    bl_use_eevee_viewport = True
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self._session = self._folder = None
        self._view = self._texture = self._shown = None

    def __del__(self):
        if getattr(self, "_session", None) is not None:
            self._session.stop()
        if getattr(self, "_folder", None) is not None:
            self._folder.cleanup()

    # Final renders.

    def update_render_passes(self, scene=None, renderlayer=None):
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        every = passes.chosen(renderlayer) + sum(passes.matte_passes(renderlayer).values(), [])
        for each in every:
            self.register_pass(scene, renderlayer, each.name, len(each.channels), each.channels, each.kind)

    def render(self, depsgraph):
        with tempfile.TemporaryDirectory(prefix="steradian_") as folder:
            try:
                self._render(depsgraph, folder)
            except (steradian.SteradianError, ValueError) as error:
                self.report({"ERROR"}, str(error))

    def _render(self, depsgraph, folder):
        scene, view_layer = depsgraph.scene, depsgraph.view_layer
        self.update_stats("", "Reading the scene")
        export = Export(depsgraph, folder, self._frames(scene))
        described = export.scene()
        for line in export.report.lines:
            self.report({"WARNING"}, line)
        chosen = settings.of_render(scene, in_viewport=self.is_preview)
        chosen["layers"] = passes.layers(view_layer)
        width, height = camera.size(scene.render)
        crop = camera.crop(scene.render, width, height)
        if crop is not None:
            chosen["crop"] = crop
        if scene.steradian.denoise and not self.is_preview:
            chosen |= {"denoise": True, "oidn_library": denoiser()}
        self.update_stats("", "Loading")
        loaded = steradian.load_dict(described, **chosen)
        loaded.build()
        self._trace(loaded, view_layer, crop[2:] if crop else (width, height))

    def _trace(self, loaded, view_layer, size):
        for each in passes.chosen(view_layer) + sum(passes.matte_passes(view_layer).values(), []):
            self.add_pass(each.name, len(each.channels), each.channels, layer=view_layer.name)
        result = self.begin_result(0, 0, *size, layer=view_layer.name)

        def progress(share):
            self.update_progress(share)
            return not self.test_break()

        def picture(image, samples):
            self.update_stats("", f"Sample {samples}/{loaded.settings['spp']}")
            passes.store_all(result, view_layer, image)
            self.update_result(result)

        try:
            image = steradian.render(loaded, progress=progress, picture=picture, picture_every=2.0)
            passes.store_all(result, view_layer, image)
            passes.store_mattes(result, self.get_result(), view_layer, image)
        finally:
            self.end_result(result)

    def _frames(self, scene):
        """A function that shows the scene at a share of the shutter interval; None without motion blur."""
        if not scene.render.use_motion_blur or self.is_preview:
            return None
        shutter = scene.render.motion_blur_shutter
        begin = {"START": 0.0, "CENTER": -0.5, "END": -1.0}[scene.render.motion_blur_position] * shutter
        now = scene.frame_current + scene.frame_subframe

        def show(share):
            frame = now if share is None else now + begin + share * shutter
            self.frame_set(int(frame // 1), frame % 1)

        return show

    # Viewports.

    def view_update(self, context, depsgraph):
        if self._session is None:
            self._session = Session(self.tag_redraw)
            self._folder = tempfile.TemporaryDirectory(prefix="steradian_")
        self._session.stop()
        self._view = self._view_of(context)
        export = Export(depsgraph, self._folder.name)
        try:
            described = export.scene(view_camera=self._view[0])
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return
        self._session.start(described, size=self._view[1], **settings.of_render(depsgraph.scene, in_viewport=True))

    def _view_of(self, context):
        view = context.region_data
        size = (max(1, context.region.width), max(1, context.region.height))
        return camera.of_view(view.view_matrix, view.window_matrix), size

    def view_draw(self, context, depsgraph):
        if self._session is None:
            return
        view = self._view_of(context)
        if view != self._view:
            self._view = view
            self._session.move(view[0], size=view[1], **settings.of_render(depsgraph.scene, in_viewport=True))
        picture, samples = self._session.latest()
        total = depsgraph.scene.steradian.viewport_samples
        self.update_stats(self._session.error or "", f"Sample {samples}/{total}")
        if picture is not None:
            self._draw(context, depsgraph.scene, picture)

    def _draw(self, context, scene, picture):
        import gpu
        from gpu_extras.presets import draw_texture_2d

        if picture is not self._shown:
            height, width = picture.shape[:2]
            pixels = gpu.types.Buffer("FLOAT", picture.size, picture[::-1].ravel())
            self._texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=pixels)
            self._shown = picture
        gpu.state.blend_set("ALPHA_PREMULT")
        self.bind_display_space_shader(scene)
        draw_texture_2d(self._texture, (0, 0), context.region.width, context.region.height)
        self.unbind_display_space_shader()
        gpu.state.blend_set("NONE")


def register():
    bpy.utils.register_class(Engine)


def unregister():
    bpy.utils.unregister_class(Engine)
