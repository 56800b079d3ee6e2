"""The render engine Steradian for Blender."""

from . import engine, settings


def register():
    settings.register()
    engine.register()


def unregister():
    engine.unregister()
    settings.unregister()
