//! Shapes, groups and instances.

use std::collections::BTreeSet;

use super::element::Element;
use super::textures::UvOrigin;
use super::tree::PluginId;
use super::{Reader, meshes, serialized, values};
use crate::desc::{
    CylinderDesc, DiskDesc, InstanceDesc, MeshDesc, MeshShadingDesc, OpacityDesc, QuadDesc, ShapeDesc, SmoothByDesc,
    SphereDesc, TransformDesc, TransformStepDesc,
};
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3};

/// A shape without its look.
struct Form {
    shape: ShapeDesc,
    map: DAffine3,
    uv: UvOrigin,
    /// Whether its front is behind when nothing flips it.
    reversed: bool,
}

/// A map as the scene description has it.
pub(super) fn steps(map: &DAffine3) -> TransformDesc {
    if *map == DAffine3::IDENTITY {
        TransformDesc::default()
    } else {
        TransformDesc(vec![TransformStepDesc::Matrix(values::rows(map))])
    }
}

impl<'a> Reader<'a> {
    /// Reads a shape of the scene.
    pub(super) fn world_shape(&mut self, id: PluginId) -> Result<()> {
        match self.document.plugins[id.0].kind.as_str() {
            // It is drawn where instances place it.
            "shapegroup" => Ok(()),
            "instance" => self.instance(id),
            _ => {
                for (place, shape) in self.shapes(id)? {
                    self.draft.add_shape(&place, shape);
                }
                Ok(())
            }
        }
    }

    /// The shapes of a plugin, with their places.
    fn shapes(&mut self, id: PluginId) -> Result<Vec<(String, ShapeDesc)>> {
        self.guard(id)?;
        let kind = self.document.plugins[id.0].kind.as_str();
        let shapes = match kind {
            "merge" => {
                let mut element = Element::new(self.document, id);
                let mut shapes = Vec::new();
                for (part, _) in element.all("shape")? {
                    shapes.extend(self.shapes(part)?);
                }
                element.finish(&mut self.draft);
                shapes
            }
            "instance" | "shapegroup" => {
                self.whole(id, "an instance or a group inside of another group is left out");
                Vec::new()
            }
            _ => self.shape(id)?.into_iter().collect(),
        };
        self.open.pop();
        Ok(shapes)
    }

    fn instance(&mut self, id: PluginId) -> Result<()> {
        let mut element = Element::new(self.document, id);
        let map = element.transform("to_world")?;
        let group = element.one("shape")?.ok_or_else(|| element.place().error("an instance needs a shapegroup"))?;
        if self.document.plugins[group.0].kind != "shapegroup" {
            return Err(element.place().error("an instance needs a shapegroup, not another shape"));
        }
        let object = self.group(group)?;
        let place = element.place().to_string();
        let name = Some(element.plugin.id.clone()).filter(|id| !id.is_empty());
        element.finish(&mut self.draft);
        if let Some(object) = object {
            self.draft.add_instance(&place, InstanceDesc { object, name, transform: steps(&map), motion: Vec::new() });
        }
        Ok(())
    }

    /// The object of a group; none if it is empty.
    fn group(&mut self, id: PluginId) -> Result<Option<String>> {
        if let Some(object) = self.groups.get(&id) {
            return Ok(object.clone());
        }
        let mut element = Element::new(self.document, id);
        let mut shapes = Vec::new();
        for (part, _) in element.all("shape")? {
            shapes.extend(self.shapes(part)?);
        }
        let place = element.place().to_string();
        let name = if element.plugin.id.is_empty() { "group" } else { &element.plugin.id };
        let object = (!shapes.is_empty()).then(|| self.draft.add_object(name, &place, shapes, Vec::new()));
        element.finish(&mut self.draft);
        self.groups.insert(id, object.clone());
        Ok(object)
    }

    /// A shape that is not one of several.
    fn shape(&mut self, id: PluginId) -> Result<Option<(String, ShapeDesc)>> {
        let mut element = Element::new(self.document, id);
        let place = element.place().to_string();
        let Some(Form { mut shape, map, uv, reversed }) = self.form(&mut element)? else {
            let why = match element.kind() {
                "sphere" | "cylinder" => "it has no area",
                _ => "unsupported shape: it is left out of the picture",
            };
            self.whole(id, why);
            return Ok(None);
        };
        let flipped = element.boolean("flip_normals", false)?;
        let (bsdf, emitter) = (element.one("bsdf")?, element.one("emitter")?);
        let (mut material, mut opacity) = match (bsdf, emitter) {
            // Mitsuba's default of a shape that emits reflects nothing.
            (None, Some(_)) => (self.black(&place), None),
            _ => self.surface(bsdf, &place, uv)?,
        };
        let interface = self.medium_interface(&mut element)?;
        if let Some(container) = self.container(bsdf, &material, &interface) {
            (material, opacity) = (container, None);
            self.media_inside.extend(interface.inside);
        } else if interface.inside.is_some() {
            element.ignored("interior", "what is within an opaque surface cannot be seen");
        }
        if let ShapeDesc::Mesh(mesh) = &mut shape
            && self.has_image(id, &mut BTreeSet::new())
        {
            self.give_uvs(mesh, uv, &place);
        }
        let emission = match emitter {
            Some(emitter) => self.emission(emitter, uv)?,
            None => None,
        };
        if emission.is_some() && opacity.take().is_some() {
            element.ignored("", "what emits light has no holes");
        }
        element.ignored_plugins("sensor", "a sensor on a shape is no camera")?;
        // How often silhouettes are sampled for derivatives.
        element.float("silhouette_sampling_weight")?;
        if uv == UvOrigin::Swapped && bsdf.is_some_and(|bsdf| self.has_direction(bsdf, &mut BTreeSet::new())) {
            element.approximated("", "u and v of a disk are swapped: what depends on their directions looks different");
        }
        let common = shape.common_mut();
        *common.name = Some(element.plugin.id.clone()).filter(|id| !id.is_empty());
        *common.material = Some(material);
        *common.transform = steps(&map);
        *common.opacity = opacity.filter(|opacity| !matches!(opacity, OpacityDesc::Number(v) if *v >= 1.0));
        *common.emission = emission;
        *common.reverse_normal = flipped != reversed;
        if let ShapeDesc::Curves(curves) = &mut shape
            && (std::mem::take(&mut curves.reverse_normal) || curves.emission.take().is_some())
        {
            element.ignored("", "curves have no other side and emit no light");
        }
        element.finish(&mut self.draft);
        Ok(Some((place, shape)))
    }

    /// Whether a plugin or a part of it has a texture that is looked up by uv; `seen` are parts that have none.
    fn has_image(&self, id: PluginId, seen: &mut BTreeSet<PluginId>) -> bool {
        let plugin = &self.document.plugins[id.0];
        if !seen.insert(id) || seen.len() > super::MAX_REFERENCES {
            return false;
        }
        let mut parts =
            plugin.properties.iter().filter_map(|property| self.document.plugin_of(property).ok().flatten());
        matches!(plugin.kind.as_str(), "bitmap" | "checkerboard") || parts.any(|part| self.has_image(part, seen))
    }

    /// Gives a mesh of a file the uv that Mitsuba gives it if the file has none: each triangle's barycentric
    /// coordinates. What is wrong with the file is found when the scene is compiled.
    fn give_uvs(&mut self, desc: &mut MeshDesc, uv: UvOrigin, place: &str) {
        let Some(file) = desc.file.clone() else { return };
        let path = self.scene.parent().unwrap_or(std::path::Path::new("")).join(&file);
        let kept = self.draft.assets.meshes.get(&file).filter(|mesh| mesh.uvs.is_none()).cloned();
        let Some(mut mesh) = kept.or_else(|| meshes::without_uvs(&path)) else { return };
        mesh.give_uvs(if uv == UvOrigin::Upward {
            [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]
        } else {
            [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
        });
        self.draft.mapped(place, "shape", "uv");
        desc.file = Some(self.draft.keep_mesh(&file, mesh));
        // Triangles no longer share vertices.
        desc.smooth_by = SmoothByDesc::Position;
    }

    /// Whether a BSDF or a part of it looks different along u and along v; `seen` are parts that do not.
    fn has_direction(&self, id: PluginId, seen: &mut BTreeSet<PluginId>) -> bool {
        let plugin = &self.document.plugins[id.0];
        if !seen.insert(id) || seen.len() > super::MAX_REFERENCES {
            return false;
        }
        let directed = |name: &str| matches!(name, "alpha_u" | "alpha_v" | "anisotropic");
        let mut parts =
            plugin.properties.iter().filter_map(|property| self.document.plugin_of(property).ok().flatten());
        plugin.kind == "normalmap"
            || plugin.properties.iter().any(|property| directed(&property.name))
            || parts.any(|part| self.has_direction(part, seen))
    }

    /// The surface of a shape; none if it is one that does not exist here, or has no area.
    fn form(&mut self, element: &mut Element<'a>) -> Result<Option<Form>> {
        let kind = element.kind();
        let form = |shape, map, uv| Form { shape, map, uv, reversed: false };
        Ok(Some(match kind {
            "obj" | "ply" | "serialized" => self.mesh(element)?,
            "rectangle" => {
                let quad = QuadDesc::new([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
                form(ShapeDesc::Quad(quad), element.transform("to_world")?, UvOrigin::Mitsuba)
            }
            "cube" => form(ShapeDesc::Mesh(meshes::cube()), element.transform("to_world")?, UvOrigin::Mitsuba),
            "disk" => {
                form(ShapeDesc::Disk(DiskDesc::new(1.0, 0.0, 360.0)), element.transform("to_world")?, UvOrigin::Swapped)
            }
            "sphere" => {
                let center = DVec3::from(element.vector("center")?.unwrap_or_default());
                let radius = element.float("radius")?.unwrap_or(1.0);
                if radius == 0.0 {
                    return Ok(None);
                }
                let map = element.transform("to_world")? * DAffine3::from_translation(center);
                // A mirrored sphere is inside out in Mitsuba, and so is one of negative radius.
                let reversed = (map.matrix3.determinant() < 0.0) != (radius < 0.0);
                let sphere = SphereDesc::new(radius.abs(), None, None, 360.0);
                Form { shape: ShapeDesc::Sphere(sphere), map, uv: UvOrigin::Upward, reversed }
            }
            "cylinder" => {
                let p0 = DVec3::from(element.vector("p0")?.unwrap_or_default());
                let p1 = DVec3::from(element.vector("p1")?.unwrap_or([0.0, 0.0, 1.0]));
                let radius = element.float("radius")?.unwrap_or(1.0);
                let axis = p1 - p0;
                let (Some(z), true) = (axis.try_normalize(), radius != 0.0) else { return Ok(None) };
                let (x, y) = values::tangents(z);
                let frame = DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation: p0 };
                let cylinder = CylinderDesc::new(radius.abs(), axis.length(), 360.0);
                form(ShapeDesc::Cylinder(cylinder), element.transform("to_world")? * frame, UvOrigin::Mitsuba)
            }
            "bsplinecurve" | "linearcurve" => {
                let curves = self.curves(element)?;
                form(ShapeDesc::Curves(curves), element.transform("to_world")?, UvOrigin::Mitsuba)
            }
            _ => return Ok(None),
        }))
    }

    fn mesh(&mut self, element: &mut Element<'a>) -> Result<Form> {
        let kind = element.kind();
        let file = element.file("filename", self.scene)?;
        let file = file.ok_or_else(|| element.place().error(format!("the shape {kind} needs \"filename\"")))?;
        let is_flat = element.boolean("face_normals", false)?;
        // Mitsuba's images have their origin at the top; those of OBJ files at the bottom.
        let flips = if kind == "serialized" { false } else { element.boolean("flip_tex_coords", kind == "obj")? };
        let uv = if flips { UvOrigin::Upward } else { UvOrigin::Mitsuba };
        let map = element.transform("to_world")?;
        let path = self.scene.parent().unwrap_or(std::path::Path::new("")).join(&file);
        self.draft.files.insert(path.clone());
        let (file, has_normals) = if kind == "serialized" {
            let index = element.count("shape_index", 0)?.unwrap_or(0);
            let mesh = serialized::read(&path, index)
                .map_err(|e| e.at(self.scene, &element.place_of("filename").to_string(), &path))?;
            let has_normals = mesh.normals.is_some();
            (self.draft.keep_mesh(&format!("{file}_{index}"), mesh), has_normals)
        } else {
            let mirrors = map.matrix3.determinant() < 0.0;
            (file, mirrors && !is_flat && meshes::has_normals(&path))
        };
        let mut desc = MeshDesc::from_file(file);
        // Vertices of an OBJ come from indices of positions and uv: their seams are smoothed over.
        if kind == "obj" && !is_flat && meshes::smooths_over_seams(&path) {
            element.approximated("", "normals are smoothed across seams of uv, where Mitsuba's have edges");
        }
        desc.smooth_by = if kind == "obj" { SmoothByDesc::Position } else { SmoothByDesc::Index };
        desc.shading = if is_flat { MeshShadingDesc::Flat } else { MeshShadingDesc::Smooth };
        // Mitsuba leaves the order of the corners as it is: given normals keep their side, found ones turn with the
        // mirrored faces.
        let reversed = map.matrix3.determinant() < 0.0 && (is_flat || !has_normals);
        Ok(Form { shape: ShapeDesc::Mesh(desc), map, uv, reversed })
    }
}
