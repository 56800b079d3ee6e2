"""Cameras: sensor fit, shift, lens."""

import math

from . import transforms


def size(render):
    """Width and height of a picture in pixels."""
    scale = render.resolution_percentage / 100
    return max(1, int(render.resolution_x * scale)), max(1, int(render.resolution_y * scale))


def crop(render, width, height):
    """The border that is rendered, as x, y, width and height from the upper left corner; None for all of it."""
    if not render.use_border:
        return None
    left, right = int(render.border_min_x * width), int(render.border_max_x * width)
    bottom, top = int(render.border_min_y * height), int(render.border_max_y * height)
    if right <= left or top <= bottom:
        return None
    return left, height - top, right - left, top - bottom


def _fits_width(fit, width, height):
    return fit == "HORIZONTAL" or (fit == "AUTO" and width >= height)


def _panorama(data):
    # Blender 5 has it in the camera, Blender 4 in the settings of Cycles.
    owner = data if hasattr(data, "panorama_type") else getattr(data, "cycles", None)
    return getattr(owner, "panorama_type", "")


def convert(scene, matrix, camera, report):
    """The camera object as a camera of the scene format. matrix: its matrix in the world."""
    data, render = camera.data, scene.render
    width, height = size(render)
    pixel_aspect = render.pixel_aspect_x / render.pixel_aspect_y
    shown = (width * render.pixel_aspect_x, height * render.pixel_aspect_y)
    horizontal = _fits_width(data.sensor_fit, *shown)
    fitted = shown[0] if horizontal else shown[1]
    found = {"transform": transforms.rigid(matrix), "near": data.clip_start}
    if data.type == "PANO":
        if _panorama(data) != "EQUIRECTANGULAR":
            report.warn(f"camera {camera.name}", f"the panorama {_panorama(data)} is rendered as equirectangular")
        return {**found, "type": "environment"}
    if pixel_aspect != 1:
        found["pixel_aspect"] = pixel_aspect
    if data.shift_x or data.shift_y:
        found["shift"] = [data.shift_x * fitted / shown[0], data.shift_y * fitted / shown[1]]
    if data.type == "ORTHO":
        return {**found, "type": "orthographic", "view_height": data.ortho_scale * shown[1] / fitted}
    sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
    half = sensor / (2 * data.lens) * shown[1] / fitted
    found["vertical_fov_degrees"] = math.degrees(2 * math.atan(half))
    if data.dof.use_dof:
        found["lens"] = _lens(data, matrix, camera, report)
    return found


def of_view(view_matrix, window_matrix):
    """The camera of a viewport. view_matrix: world to camera. window_matrix: its projection, OpenGL's."""
    found = {"transform": transforms.rigid(view_matrix.inverted())}
    across, up = window_matrix[0], window_matrix[1]
    if window_matrix[3][3] == 0:
        found["vertical_fov_degrees"] = math.degrees(2 * math.atan(1 / up[1]))
        shift = [across[2] / 2, up[2] / 2]
    else:
        found |= {"type": "orthographic", "view_height": 2 / up[1]}
        shift = [-across[3] / 2, -up[3] / 2]
    return {**found, "shift": shift}


def _lens(data, matrix, camera, report):
    distance = data.dof.focus_distance
    if data.dof.focus_object is not None:
        away = data.dof.focus_object.matrix_world.translation - matrix.translation
        distance = abs(away.dot(matrix.normalized().col[2].xyz))
    lens = {"radius": data.lens * 1e-3 / (2 * data.dof.aperture_fstop), "focus_distance": max(distance, 1e-4)}
    if data.dof.aperture_blades >= 3:
        degrees = math.degrees(data.dof.aperture_rotation)
        lens["blades"] = {"count": data.dof.aperture_blades, "rotation_degrees": degrees}
    if data.dof.aperture_ratio != 1:
        report.warn(f"camera {camera.name}", "the aperture ratio is left out: the aperture is as wide as high")
    return lens
