//! Shapes of the scene file: loaded and checked once, placed once or (emitters of objects) once per instance.

use super::curves::StrandSource;
use super::materials::MaterialBinding;
use super::normals::Smoothing;
use super::planes::{self, Plane};
use super::{Builder, meshes, shapes};
use crate::assets::MeshData;
use crate::color::Rgb;
use crate::desc::{MeshDesc, MeshShadingDesc, ShapeCommon, ShapeDesc};
use crate::error::Result;
use crate::film::ShapeIdentity;
use crate::geometry::{Analytic, Shape, TransformedShape};
use crate::id::{LightGroupId, ShapeId};
use crate::light::{AreaLight, Emission, Light};
use crate::material::ColorInput;
use crate::math::{Bounds, DAffine3, Motion, RenderSpace, Transform};
use crate::scene::Surface;

/// A shape complete but for its final transform.
#[derive(Clone, Debug)]
pub struct PreparedShape {
    form: ShapeSource,
    /// The shape's own transform.
    map: DAffine3,
    /// How it moves, its own transform included.
    pub motion: Option<Motion>,
    reverse_normal: bool,
    pub surface: PreparedSurface,
    /// Where the scene has it.
    path: String,
}

/// The surface of a shape.
#[derive(Clone, Copy, Debug)]
pub struct PreparedSurface {
    pub binding: MaterialBinding,
    /// Light that it emits, not black.
    pub emission: Option<PreparedEmission>,
    /// What it is called.
    pub identity: ShapeIdentity,
}

/// The least size of a mesh in render space: below, cross products of its edges leave `f32`.
const SMALLEST_MESH: f64 = 1.0 / (1u64 << 40) as f64;

/// Light emitted, and the group it belongs to.
#[derive(Clone, Copy, Debug)]
pub struct PreparedEmission {
    /// The light.
    pub emission: Emission,
    /// Whether the shape is hidden from the camera.
    pub hidden: bool,
    group: Option<LightGroupId>,
}

/// Where a shape stands and how it moves.
struct PlacedBy {
    map: DAffine3,
    motion: Option<Motion>,
}

impl PlacedBy {
    /// Where it stands when the shutter opens.
    fn at_first(&self) -> DAffine3 {
        self.motion.as_ref().map_or(self.map, |motion| motion.map_at(0.0))
    }
}

#[derive(Clone, Debug)]
enum ShapeSource {
    Analytic(Analytic),
    /// Placed when everything else has been.
    Plane(Plane),
    /// Curves or points.
    Strands(StrandSource),
    Mesh {
        data: MeshData,
        shading: MeshShadingDesc,
        smoothing: Smoothing,
        /// Its vertices at later times.
        later: Vec<MeshData>,
        /// Where it was read, relative to the scene.
        file: Option<String>,
    },
}

/// Why a shape cannot be placed.
const TOO_LARGE: &str = "the shape reaches to infinity: its size or place is too large for 32-bit numbers";

impl PreparedShape {
    /// Whether its extent depends on that of everything else.
    pub fn is_plane(&self) -> bool {
        matches!(self.form, ShapeSource::Plane(_))
    }

    /// Where the scene has it.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Bounds in the space that it is placed in; at rest if it moves, as [`Builder::place`] leaves it.
    pub fn bounds_at_rest(&self) -> Bounds {
        let own = match &self.form {
            ShapeSource::Analytic(surface) => surface.bounds(),
            ShapeSource::Plane(_) => Bounds::EMPTY,
            ShapeSource::Strands(strands) => strands.bounds(),
            ShapeSource::Mesh { data, later, .. } => {
                std::iter::once(data).chain(later).map(MeshData::bounds).fold(Bounds::EMPTY, |all, b| all.union(&b))
            }
        };
        if self.motion.is_some() { own } else { own.transformed(&self.map) }
    }

    /// Bounds in the space that it is placed in, over the whole shutter interval.
    pub fn bounds(&self) -> Bounds {
        let at_rest = self.bounds_at_rest();
        self.motion.as_ref().map_or(at_rest, |motion| motion.bounds(&at_rest))
    }
}

impl Builder {
    /// Loads and checks one shape of the scene file, that with this number of its list; an OBJ file may contain
    /// several. Where it is not used, its files are not read.
    pub(super) fn prepare(
        &mut self,
        path: &str,
        number: usize,
        desc: &ShapeDesc,
        is_used: bool,
    ) -> Result<Vec<PreparedShape>> {
        let common = desc.common();
        let identity = self.identities.shape(&self.files, number, desc);
        let mut binding = self.materials.find(&self.files, path, common.material)?;
        let place = format!("{path}.transform");
        let map = self.files.transform(&place, common.transform, &DAffine3::IDENTITY)?.world_from_object;
        let motion = self.files.motion(&format!("{path}.motion"), common.motion, &map, self.shutter)?;
        let (map, motion) = motion.as_constant().map_or((map, Some(motion)), |rest| (rest, None));
        let emission = self.emission(path, &common)?;
        binding.opacity = self.opacity(path, &common)?;
        if motion.is_some() && emission.is_some() {
            return Err(self.files.error(&format!("{path}.motion"), "a shape that emits light cannot move"));
        }
        let surface = PreparedSurface { binding, emission, identity };
        if let ShapeDesc::Curves(_) | ShapeDesc::Points(_) = desc {
            return self.prepare_strands(path, desc, is_used, PlacedBy { map, motion }, surface);
        }
        if !matches!(desc, ShapeDesc::Mesh(_)) {
            self.check_attributes(path, None, &surface, common.material, None)?;
        }
        let form = match desc {
            ShapeDesc::Mesh(mesh) if !is_used && mesh.file.is_some() => {
                self.smoothing(path, mesh)?;
                let later =
                    mesh.deform_files.iter().enumerate().map(|(i, file)| (format!("{path}.deform_files[{i}]"), file));
                for (path, file) in mesh.file.iter().map(|file| (format!("{path}.file"), file)).chain(later) {
                    self.files.warn_of_missing(&path, file);
                }
                return Ok(Vec::new());
            }
            ShapeDesc::Mesh(mesh) => return self.prepare_mesh(path, mesh, &PlacedBy { map, motion }, surface),
            ShapeDesc::Cube(_) => ShapeSource::Mesh {
                data: meshes::cube(),
                shading: MeshShadingDesc::Flat,
                smoothing: Smoothing::default(),
                later: Vec::new(),
                file: None,
            },
            ShapeDesc::Plane(plane) => ShapeSource::Plane(planes::compile(&self.files, path, plane, &common)?),
            _ => match shapes::compile(&self.files, path, desc)? {
                Some(surface) => ShapeSource::Analytic(surface),
                None => return Ok(Vec::new()),
            },
        };
        let reverse_normal = common.reverse_normal;
        Ok(vec![PreparedShape { form, map, motion, reverse_normal, surface, path: path.into() }])
    }

    fn prepare_mesh(
        &mut self,
        path: &str,
        desc: &MeshDesc,
        placed: &PlacedBy,
        surface: PreparedSurface,
    ) -> Result<Vec<PreparedShape>> {
        let smoothing = self.smoothing(path, desc)?;
        let mut prepared = Vec::new();
        for mut loaded in self.meshes.take(&self.files, path, desc)? {
            let moves = placed.motion.is_some() || !loaded.later.is_empty();
            let PreparedSurface { mut binding, mut emission, mut identity } = surface;
            let has_uvs = loaded.data.uvs.is_some();
            if let Some(mtl) = &loaded.material {
                identity.material = self.identities.name(&mtl.name);
                let from_mtl = self.mtl_binding(path, desc.file.as_deref(), mtl, has_uvs)?;
                // The shape's own keys override the MTL.
                let given = if desc.opacity.is_some() { binding.opacity } else { from_mtl.binding.opacity };
                binding = MaterialBinding { opacity: given, ..from_mtl.binding };
                emission = emission.or(from_mtl.emission.map(|emission| PreparedEmission {
                    emission,
                    group: None,
                    hidden: false,
                }));
            }
            if !has_uvs && self.materials.needs_uv(&binding) {
                return Err(meshes::refusal(
                    &self.files,
                    path,
                    desc.file.as_deref(),
                    "the material or the opacity has textures, but the mesh has no uv".into(),
                ));
            }
            let surface = PreparedSurface { binding, emission, identity };
            let attributes = &mut loaded.data.attributes;
            self.check_attributes(path, desc.file.as_deref(), &surface, desc.material.as_deref(), Some(attributes))?;
            if moves && emission.is_some() {
                return Err(self.files.error(path, "a shape that emits light cannot move"));
            }
            let places = self.dicing.places(path, placed.at_first());
            let sharing = self.subdivide(path, desc, &mut loaded, &places)?;
            self.displace(path, desc, &mut loaded, sharing)?;
            prepared.push(PreparedShape {
                form: ShapeSource::Mesh {
                    data: loaded.data,
                    shading: desc.shading,
                    smoothing,
                    later: loaded.later,
                    file: desc.file.clone(),
                },
                map: placed.map,
                motion: placed.motion.clone(),
                reverse_normal: desc.reverse_normal,
                surface,
                path: path.into(),
            });
        }
        Ok(prepared)
    }

    fn prepare_strands(
        &mut self,
        path: &str,
        desc: &ShapeDesc,
        is_used: bool,
        PlacedBy { map, motion }: PlacedBy,
        surface: PreparedSurface,
    ) -> Result<Vec<PreparedShape>> {
        let common = desc.common();
        let material = surface.binding.material;
        self.check_strands(path, &common, material)?;
        let (file, is_fiber) = match desc {
            ShapeDesc::Curves(curves) => (curves.file.as_deref(), self.is_fiber(material)),
            ShapeDesc::Points(points) => (points.file.as_deref(), false),
            _ => return Ok(Vec::new()),
        };
        if let Some(file) = file.filter(|_| !is_used) {
            self.files.warn_of_missing(&format!("{path}.file"), file);
            return Ok(Vec::new());
        }
        let mut strands = match desc {
            ShapeDesc::Curves(curves) => self.curves(path, curves, is_fiber)?,
            ShapeDesc::Points(points) => self.points(path, points)?,
            _ => return Ok(Vec::new()),
        };
        self.check_attributes(path, file, &surface, common.material, strands.attributes_mut())?;
        let form = ShapeSource::Strands(strands);
        Ok(vec![PreparedShape { form, map, motion, reverse_normal: false, surface, path: path.into() }])
    }

    fn smoothing(&self, path: &str, desc: &MeshDesc) -> Result<Smoothing> {
        let crease = desc.crease_angle_degrees;
        let crease = crease
            .map(|angle| self.files.within(&format!("{path}.crease_angle_degrees"), angle, 0.0, 180.0))
            .transpose()?;
        // A rounding must not make creases where triangles are coplanar or the angle is that of all edges.
        let crease_cosine = crease.filter(|&angle| angle < 180.0).map(|angle| angle.to_radians().cos() - 1e-6);
        Ok(Smoothing { weight: desc.normal_weight, crease_cosine, by: desc.smooth_by })
    }

    fn emission(&mut self, path: &str, common: &ShapeCommon) -> Result<Option<PreparedEmission>> {
        let Some(desc) = common.emission else {
            return Ok(None);
        };
        let path = format!("{path}.emission");
        let radiance = Rgb::from(self.files.emitted(&format!("{path}.radiance"), desc.radiance)?);
        let group = self.lights.group(&self.files, &path, desc.group.as_deref())?;
        let input = match &desc.texture {
            None => ColorInput::Constant(Rgb::WHITE),
            Some(name) => self.materials.textures.radiance(&self.files, &format!("{path}.texture"), name)?,
        };
        let (radiance, texture) = match input {
            ColorInput::Constant(color) => (radiance * color, None),
            ColorInput::Texture(id) => (radiance, Some(id)),
        };
        let brightest = texture.map_or(1.0, |id| self.materials.textures.get(id).range()[1]);
        self.files.emitted(&format!("{path}.radiance"), (radiance * brightest).to_array())?;
        let emission = Emission { radiance, two_sided: desc.two_sided, texture, opacity: None };
        Ok((!radiance.is_black()).then_some(PreparedEmission { emission, group, hidden: desc.hidden }))
    }

    /// Rejects a placed shape that is too large or too small for `f32`.
    fn check_size(&self, path: &str, shape: &Shape, space: &RenderSpace) -> Result<()> {
        let bounds = shape.bounds();
        if !bounds.min.is_finite() || !bounds.max.is_finite() {
            return Err(self.files.error(path, TOO_LARGE));
        }
        let size = f64::from(bounds.size().max_element());
        if matches!(shape, Shape::Mesh(_)) && size > 0.0 && size < SMALLEST_MESH {
            let [size, least] = [size, SMALLEST_MESH].map(|length| space.world_length(length));
            let message =
                format!("the mesh measures {size:e}: beside the rest of the scene, at least {least:e} can be rendered");
            return Err(self.files.error(path, message));
        }
        Ok(())
    }

    /// A shape by its transform into the scene; `None` if it is a mesh of which nothing has an area.
    fn placed_form(
        &self,
        form: ShapeSource,
        transform: &Transform,
        reverse_normal: bool,
        surface: &PreparedSurface,
        path: &str,
    ) -> Result<Option<Shape>> {
        let analytic = |surface: Analytic| {
            let mut placed = TransformedShape::new(surface, *transform);
            placed.reverse_normal = reverse_normal;
            Shape::Analytic(placed)
        };
        Ok(Some(match form {
            ShapeSource::Analytic(surface) => analytic(surface),
            ShapeSource::Strands(strands) => self.placed_strands(path, strands, transform)?,
            ShapeSource::Plane(plane) => {
                let quad = planes::square(&plane, &transform.world_from_object, &self.surroundings);
                analytic(Analytic::Quad(quad.ok_or_else(|| self.files.error(path, TOO_LARGE))?))
            }
            ShapeSource::Mesh { data, shading, smoothing, later, file } => {
                let placement = meshes::Placement {
                    file: file.as_deref(),
                    transform,
                    shading,
                    smoothing,
                    reverse_normal,
                    emits: surface.emission.is_some(),
                    attributes: &self.materials.textures.attributes,
                };
                let Some(mesh) = meshes::place(&self.files, path, data, later, placement)? else {
                    return Ok(None);
                };
                Shape::Mesh(if self.materials.has_normal_map(&surface.binding) { mesh.with_tangents() } else { mesh })
            }
        }))
    }

    /// Adds a shape to the scene, placed by its own transform, by `outer` and into `space`; `None` if it is a mesh of
    /// which nothing has an area. One that emits must end up in the world's.
    pub(super) fn place(
        &mut self,
        prepared: PreparedShape,
        outer: &DAffine3,
        space: &RenderSpace,
    ) -> Result<Option<ShapeId>> {
        let PreparedShape { form, map, motion, reverse_normal, surface, path } = prepared;
        // What moves is placed by its instance.
        let map = if motion.is_some() { DAffine3::IDENTITY } else { map };
        let transform = Transform::new(space.place(&(*outer * map)))
            .ok_or_else(|| self.files.error(&format!("{path}.transform"), super::SINGULAR))?;
        let Some(shape) = self.placed_form(form, &transform, reverse_normal, &surface, &path)? else {
            return Ok(None);
        };
        self.check_size(&path, &shape, space)?;
        self.geometry.shapes.push(shape);
        let PreparedSurface { binding, emission, identity } = surface;
        let id = ShapeId::new(self.geometry.shapes.len() - 1);
        let medium = self.materials.medium(binding.material);
        if medium.is_some() && emission.is_some() {
            return Err(self
                .files
                .error(&path, "the surface of a medium cannot emit light: it may turn out to be no boundary"));
        }
        let (material, normal_perturbation) = (binding.material, binding.normal_perturbation);
        let mut surface =
            Surface { material, normal_perturbation, medium, first_light: None, single_light: false, hidden: false };
        if let Some(PreparedEmission { emission, group, hidden }) = emission {
            let emission = Emission { opacity: binding.opacity, ..emission };
            let lights = AreaLight::for_shape(id, emission, &self.geometry, &self.materials.textures.textures);
            if lights.iter().any(|light| light.area() > 0.0) {
                surface.single_light = lights.len() == 1;
                surface.hidden = hidden;
                surface.first_light = Some(self.lights.add(lights.into_iter().map(Light::Area), group));
            } else {
                self.files.warn(&format!("{path}.emission"), format_args!("the shape is too small to emit light"));
            }
        }
        self.surfaces.push(surface);
        self.identities.add_shape(identity);
        self.opacities.push(binding.opacity);
        self.paths.push(path);
        Ok(Some(id))
    }
}
