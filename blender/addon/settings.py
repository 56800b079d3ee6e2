"""Settings of the engine, and their panels."""

import bpy

LAYERS = [
    ("albedo", "Albedo", "Fraction of light scattered by the first surface"),
    ("diffuse_direct", "Diffuse Direct", "Light scattered once, by diffuse reflection, with the surface's colour"),
    ("diffuse_indirect", "Diffuse Indirect", "Light scattered more than once, last by diffuse reflection"),
    ("specular_direct", "Specular Direct", "Light scattered once, by specular reflection"),
    ("specular_indirect", "Specular Indirect", "Light scattered more than once, last by specular reflection"),
    ("transmission_direct", "Transmission Direct", "Light scattered once, through a surface"),
    ("transmission_indirect", "Transmission Indirect", "Light scattered more than once, last through a surface"),
    ("emission", "Emission", "Light emitted by the surface that is seen"),
    ("background", "Background", "Light of the world that is seen directly"),
]


class Settings(bpy.types.PropertyGroup):
    """Settings of a scene."""

    samples: bpy.props.IntProperty(name="Samples", description="Samples per pixel", default=128, min=1, max=1 << 24)
    viewport_samples: bpy.props.IntProperty(
        name="Viewport Samples", description="Samples per pixel in the viewport", default=64, min=1, max=1 << 24
    )
    target_error: bpy.props.FloatProperty(
        name="Target Error",
        description="Render until the picture's relative squared error is below this, with samples where they are "
        "needed; 0.001 is a good picture. 0: the same samples everywhere",
        default=0.0,
        min=0.0,
        max=1.0,
        precision=4,
    )
    time_limit: bpy.props.FloatProperty(
        name="Time Limit",
        description="Seconds after which a render ends; 0: none",
        default=0.0,
        min=0.0,
        subtype="TIME_ABSOLUTE",
    )
    max_depth: bpy.props.IntProperty(
        name="Max Depth",
        description="Largest number of segments of a path; 1 shows only what emits light",
        default=64,
        min=1,
        max=100000,
    )
    roulette: bpy.props.EnumProperty(
        name="Roulette",
        description="Which paths and shadow rays Russian roulette terminates",
        items=[
            ("auto", "Automatic", "By what the path may add to its pixel and by what it costs"),
            ("throughput", "Throughput", "By the throughput of the path"),
            ("shadow_rays", "Shadow rays", "Shadow rays by what they carry; no paths"),
            ("off", "Off", "Never"),
        ],
    )
    caustics: bpy.props.EnumProperty(
        name="Caustics",
        description="How light that mirrors and glass throw on other surfaces is found",
        items=[
            ("paths", "Paths", "By chance: unbiased, with much noise"),
            ("photons", "Photons", "Also by photons from the lights: little noise"),
        ],
    )
    guiding: bpy.props.EnumProperty(
        name="Path Guiding",
        description="Whether paths learn where light comes from",
        items=[
            ("auto", "Automatic", "If a pilot and the first samples show that it pays; from 128 samples on"),
            ("on", "On", "As long as it pays"),
            ("off", "Off", "Never"),
        ],
    )
    clamp: bpy.props.FloatProperty(
        name="Clamp", description="The most that a scattered path may add to a pixel; 0: no limit", default=0.0, min=0.0
    )
    denoise: bpy.props.BoolProperty(name="Denoise", description="Denoise with Intel Open Image Denoise")
    seed: bpy.props.IntProperty(name="Seed", description="Another seed gives other noise", default=0, min=0)


class LayerSettings(bpy.types.PropertyGroup):
    """Settings of a view layer."""

    layers: bpy.props.EnumProperty(
        name="Layers", description="Layers of Steradian", items=LAYERS, options={"ENUM_FLAG"}, default=set()
    )


def of_render(scene, in_viewport=False):
    """The settings of `steradian.render` for a scene."""
    chosen, threads = scene.steradian, scene.render.threads
    found = {
        "spp": chosen.viewport_samples if in_viewport else chosen.samples,
        "max_depth": chosen.max_depth,
        # Without the pilot of `auto`, a change shows sooner.
        "roulette": "throughput" if in_viewport else chosen.roulette,
        "caustics": chosen.caustics,
        "guiding": "off" if in_viewport else chosen.guiding,
        "seed": chosen.seed,
    }
    if scene.render.threads_mode == "FIXED":
        found["threads"] = threads
    for name in ("clamp", "target_error", "time_limit"):
        if getattr(chosen, name) > 0 and not in_viewport:
            found[name] = getattr(chosen, name)
    return found


class Panel:
    """A panel among the properties of renders and view layers."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"

    @classmethod
    def poll(cls, context):
        return context.engine == "STERADIAN"

    def column(self):
        """A column of properties with their names beside them."""
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        return self.layout.column()


class STERADIAN_PT_sampling(Panel, bpy.types.Panel):
    bl_label = "Sampling"
    bl_context = "render"

    def draw(self, context):
        column = self.column()
        for name in ("samples", "viewport_samples", "target_error", "time_limit", "denoise", "seed"):
            column.prop(context.scene.steradian, name)


class STERADIAN_PT_paths(Panel, bpy.types.Panel):
    bl_label = "Light Paths"
    bl_context = "render"

    def draw(self, context):
        column = self.column()
        for name in ("max_depth", "roulette", "caustics", "guiding", "clamp"):
            column.prop(context.scene.steradian, name)


class STERADIAN_PT_threads(Panel, bpy.types.Panel):
    bl_label = "Threads"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        column = self.column()
        column.prop(context.scene.render, "threads_mode")
        if context.scene.render.threads_mode == "FIXED":
            column.prop(context.scene.render, "threads")


class STERADIAN_PT_passes(Panel, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context):
        column, view_layer = self.column(), context.view_layer
        for name in ("use_pass_z", "use_pass_normal", "use_pass_position"):
            column.prop(view_layer, name)
        column.prop(view_layer.steradian, "layers")
        for name in ("object", "material", "asset"):
            column.prop(view_layer, f"use_pass_cryptomatte_{name}")
        column.prop(view_layer, "pass_cryptomatte_depth")


CLASSES = (
    Settings,
    LayerSettings,
    STERADIAN_PT_sampling,
    STERADIAN_PT_paths,
    STERADIAN_PT_threads,
    STERADIAN_PT_passes,
)


def _shared_panels():
    """Panels of Blender that fit any engine with its materials, lamps and cameras."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines and engines & {"BLENDER_EEVEE", "BLENDER_EEVEE_NEXT"}:
            if not panel.__name__.startswith(("RENDER_PT_eevee", "VIEWLAYER_PT", "RENDER_PT_gpencil")):
                yield panel


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.steradian = bpy.props.PointerProperty(type=Settings)
    bpy.types.ViewLayer.steradian = bpy.props.PointerProperty(type=LayerSettings)
    for panel in _shared_panels():
        panel.COMPAT_ENGINES.add("STERADIAN")


def unregister():
    for panel in _shared_panels():
        panel.COMPAT_ENGINES.discard("STERADIAN")
    del bpy.types.ViewLayer.steradian
    del bpy.types.Scene.steradian
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
