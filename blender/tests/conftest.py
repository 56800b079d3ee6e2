"""Blender as a module, with the add-on installed as users install it: `blender/test.sh` runs these tests."""

import os
import sys
from pathlib import Path

import bpy
import pytest

sys.path.insert(0, str(Path(__file__).parent))


def install():
    """Installs the file of the add-on and enables it."""
    archive = os.environ["STERADIAN_ZIP"]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.extensions.package_install_files(repo="user_default", filepath=archive, enable_on_install=True)


def pytest_sessionstart(session):
    install()


@pytest.fixture(autouse=True)
def empty_scene():
    """Every test begins with an empty scene."""
    import scenes

    scenes.reset()
