"""A scene of Blender as one of Steradian: what the renderer takes, independent of the engine."""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from mathutils import Matrix

from . import camera, hair, lights, meshes, transforms, world
from .images import Images
from .materials import Materials
from .report import Report
from .volumes import Volumes

SURFACES = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


@dataclass
class Placement:
    """Where a geometry stands. motion: matrices at the opening, the middle and the closing of the shutter."""

    name: str
    matrix: Matrix
    motion: list = field(default_factory=list)


@dataclass
class Geometry:
    """The shapes of one mesh or set of curves with its materials, and its placements."""

    shapes: list
    name: str
    placements: list = field(default_factory=list)


class Export:
    """The scene of an evaluated dependency graph.

    folder: where files go that the renderer reads. frames: for motion blur, a function that shows the scene at a share
    of the shutter interval, from 0 to 1, or as it was for None; without it nothing moves.
    """

    def __init__(self, depsgraph, folder, frames=None):
        self.report = Report()
        self._depsgraph, self._folder, self._frames = depsgraph, Path(folder), frames
        self._images = Images(folder, self.report)
        self._materials = Materials(self._images, self.report)
        self._volumes = Volumes(self.report)
        self._geometries, self._lights, self._lamps = {}, [], []

    def scene(self, view_camera=None):
        """The scene as a dictionary in the scene format.

        view_camera: a camera of the scene format, in place of the scene's own.
        """
        evaluated = self._depsgraph.scene_eval
        for instance in self._depsgraph.object_instances:
            self._add(instance)
        if self._frames is not None:
            self._follow()
        background = world.convert(evaluated.world, self._images, self.report)
        found = {
            "camera": view_camera or self._camera(evaluated),
            "film": self._film(evaluated),
            "materials": {**self._materials.materials, **self._volumes.materials},
            "media": self._volumes.media,
            "textures": self._materials.textures,
            "lights": self._lights + ([background] if background else []),
            "shapes": self._lamps + self._volumes.shapes,
            "objects": {},
            "instances": [],
        }
        if self._lamps:
            found["materials"][lights.CLEAR] = dict(lights.CLEAR_MATERIAL)
        for geometry in self._geometries.values():
            self._place(geometry, found)
        return {key: value for key, value in found.items() if value not in ([], {})}

    def _camera(self, scene):
        owner = scene.camera
        if owner is None:
            raise ValueError("the scene has no camera")
        owner = owner.evaluated_get(self._depsgraph)
        return camera.convert(scene, owner.matrix_world, owner, self.report)

    def _film(self, scene):
        width, height = camera.size(scene.render)
        film = {"width": width, "height": height}
        if scene.render.film_transparent:
            film["transparent"] = True
        return film

    def _add(self, instance):
        owner = instance.object
        if owner.type == "LIGHT" and instance.show_self:
            lamps, shapes = lights.convert(owner, instance.matrix_world.copy(), self.report)
            self._lights += lamps
            self._lamps += shapes
        elif instance.show_self and (owner.type in SURFACES or owner.type == "CURVES"):
            geometry = self._geometry(owner)
            if geometry is not None:
                geometry.placements.append(Placement(_name(instance), instance.matrix_world.copy()))
        elif owner.type == "VOLUME" and instance.show_self:
            self._volumes.add(owner, instance.matrix_world.copy(), _name(instance))
        elif owner.type in ("POINTCLOUD", "GREASEPENCIL"):
            self.report.warn(f"object {owner.name}", f"objects of type {owner.type} are left out")
        if instance.show_particles and any(s.settings.type == "HAIR" for s in owner.particle_systems):
            self.report.warn(f"object {owner.name}", "particle hair is left out; convert it to curves")

    def _geometry(self, owner):
        slots = tuple(slot.material.name_full if slot.material else None for slot in owner.material_slots)
        key = (owner.data.as_pointer() if owner.type in ("MESH", "CURVES") else owner.as_pointer(), slots)
        if key not in self._geometries:
            shapes = self._curves(owner) if owner.type == "CURVES" else self._mesh(owner)
            self._geometries[key] = Geometry(shapes, owner.name)
            kinds = ("camera", "diffuse", "glossy", "shadow")
            hidden = [kind for kind in kinds if not getattr(owner, f"visible_{kind}")]
            if hidden:
                self.report.warn(f"object {owner.name}", f"it is visible to {', '.join(hidden)} rays too")
        return self._geometries[key] if self._geometries[key].shapes else None

    def _look(self, owner, slot):
        slots = owner.material_slots
        material = slots[min(slot, len(slots) - 1)].material if len(slots) else None
        return self._materials.look(material)

    def _mesh(self, owner):
        mesh = owner.to_mesh()
        if mesh is None:
            return []
        looks = [self._look(owner, slot) for slot in range(max(1, len(owner.material_slots)))]
        uv = next((look.uv for look in looks if look.uv), None)
        color = next((look.color for look in looks if look.color), None)
        shapes = []
        for slot, arrays in meshes.arrays(mesh, uv, color).items():
            look = self._look(owner, slot)
            if look.needs_uv and "uvs" not in arrays:
                self.report.warn(f"object {owner.name}", "it has no UVs for its textures: all are 0")
                arrays["uvs"] = arrays["positions"][:, :2] * 0
            shapes.append({"type": "mesh", **arrays, **look.keys})
        owner.to_mesh_clear()
        return shapes

    def _curves(self, owner):
        path = self._folder / f"strands_{len(self._geometries)}.bin"
        if not hair.write(owner.data, path):
            return []
        keys = {key: value for key, value in self._look(owner, 0).keys.items() if key != "emission"}
        return [{"type": "curves", "file": str(path), "basis": "catmull_rom", **keys}]

    def _follow(self):
        """Matrices of all placements over the shutter interval, as far as the same ones are there."""
        for share in (0.0, 0.5, 1.0):
            self._frames(share)
            seen = Counter()
            for instance in self._depsgraph.object_instances:
                owner = instance.object
                if not instance.show_self or not (owner.type in SURFACES or owner.type == "CURVES"):
                    continue
                self._move(owner, instance, seen)
        self._frames(None)
        for geometry in self._geometries.values():
            for placement in geometry.placements:
                moves = any(matrix != placement.motion[0] for matrix in placement.motion[1:])
                placement.motion = placement.motion if moves and len(placement.motion) == 3 else []

    def _move(self, owner, instance, seen):
        name = _name(instance)
        for geometry in self._geometries.values():
            if geometry.name != owner.name:
                continue
            same = [placement for placement in geometry.placements if placement.name == name]
            index = seen[(owner.name, name)]
            if index < len(same):
                same[index].motion.append(instance.matrix_world.copy())
            seen[(owner.name, name)] += 1
            return

    def _place(self, geometry, found):
        if len(geometry.placements) == 1:
            placement = geometry.placements[0]
            for shape in geometry.shapes:
                found["shapes"].append({**shape, "name": placement.name, **_where(placement)})
            return
        name = geometry.name
        while name in found["objects"]:
            name += "_"
        found["objects"][name] = {"shapes": [{**shape, "name": geometry.name} for shape in geometry.shapes]}
        for placement in geometry.placements:
            found["instances"].append({"object": name, "name": placement.name, **_where(placement)})


def _name(instance):
    """The name of an object, or of what it is an instance by."""
    return instance.parent.name if instance.is_instance and instance.parent else instance.object.name


def _where(placement):
    """Transform and motion."""
    if not placement.motion:
        return {"transform": transforms.step(placement.matrix)}
    times = zip((0.0, 0.5, 1.0), placement.motion)
    return {"motion": [{"time": time, "transform": transforms.step(matrix)} for time, matrix in times]}
