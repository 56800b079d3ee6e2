//! Shapes.

use std::collections::BTreeSet;
use std::path::Path;

use super::area_light::{AreaLight, Extent};
use super::bilinear::Patches;
use super::colors::Colors;
use super::curves::curve;
use super::media::MediumTable;
use super::params::Params;
use super::state::{Ctm, Graphics, ShapeMaterial, World};
use super::textures::Textures;
use super::triangles;
use crate::assets::{MeshData, read_ply_attributes};
use crate::desc::{CurvesDesc, CylinderDesc, DiskDesc, MaterialDesc, MeshDesc, ShapeDesc, SphereDesc};
use crate::error::Result;
use crate::import::foreign::Draft;
use crate::math::{DAffine3, DVec3};
use crate::subdivision::{Cage, Refinement, Scheme, UvRule, refine, triangle_count};

/// Meshes of more triangles are kept apart from the scene's text.
const MAX_INLINE: usize = 64;

/// What a shape is made from.
pub struct Shapes<'a> {
    /// Textures of opacities.
    pub textures: &'a Textures,
    /// How colours are read.
    pub colors: Colors<'a>,
    /// The map from pbrt's world to Steradian's; not mirrored within an object.
    pub world: World,
    /// The scene file.
    pub scene: &'a Path,
    /// Whether it is part of an object, where nothing can emit light.
    pub in_object: bool,
}

/// The directive of a shape.
#[derive(Clone, Copy)]
pub struct Directive<'a> {
    /// The kind of shape.
    pub kind: &'a str,
    /// Its parameters.
    pub params: &'a Params,
}

/// A shape's form.
enum Form {
    /// A Steradian shape, after a transform of its own; pbrt turns its normals inside out where the transform mirrors.
    Analytic { shape: Box<ShapeDesc>, inner: DAffine3, area: f64 },
    /// Triangles, and as how many shapes pbrt counts them.
    Mesh(MeshData, usize),
    /// Triangles of a file that can stay there.
    File(String),
    /// A curve.
    Curves(CurvesDesc),
}

/// Reports that curves emit no light; false.
fn no_light(draft: &mut Draft, params: &Params) -> bool {
    draft.ignored(&params.place, &params.element, "AreaLightSource", "curves emit no light");
    false
}

/// The transforms of a shape; what emits light does not move.
fn still_if_lit(draft: &mut Draft, params: &Params, mut ctm: Ctm, is_light: bool) -> Ctm {
    if is_light && ctm.is_moving() {
        let how = "what emits light stands still where it is at first";
        draft.approximated(&params.place, &params.element, "transform", how);
        ctm.0[1] = ctm.0[0];
    }
    ctm
}

/// The material of a shape that has a medium inside.
fn container(draft: &mut Draft, media: &mut MediumTable, params: &Params, graphics: &Graphics) -> Option<String> {
    let own = match graphics.material.as_deref() {
        Some(ShapeMaterial::Interface) => None,
        Some(ShapeMaterial::Material(material)) => Some(material.name.as_str()),
        // Diffuse.
        None => Some(""),
    };
    media.container(draft, params, &graphics.media, own)
}

/// The name of a shape's material; black for what emits light at an interface.
fn material_name(draft: &mut Draft, params: &Params, graphics: &Graphics) -> Option<String> {
    match graphics.material.as_deref()? {
        ShapeMaterial::Interface => {
            let how = "black, for what emits light is no mere boundary";
            draft.approximated(&params.place, &params.element, "Material", how);
            Some(black(draft, &params.place))
        }
        ShapeMaterial::Material(material) => Some(material.name.clone()),
    }
}

impl Shapes<'_> {
    /// Reads a shape; `None` if nothing of it can be seen.
    pub fn read(
        &self,
        draft: &mut Draft,
        media: &mut MediumTable,
        Directive { kind, params }: Directive,
        graphics: &Graphics,
    ) -> Result<Option<ShapeDesc>> {
        let mut light = graphics.area_light.as_deref();
        if light.is_some() && self.in_object {
            draft.ignored(&params.place, &params.element, "AreaLightSource", "instances emit no light, as in pbrt");
            light = None;
        }
        let container = if light.is_none() { container(draft, media, params, graphics) } else { None };
        if light.is_none()
            && container.is_none()
            && matches!(graphics.material.as_deref(), Some(ShapeMaterial::Interface))
        {
            params.report(draft);
            return Ok(None);
        }
        let material = container.or_else(|| material_name(draft, params, graphics));
        let alpha = self.textures.number(params, &self.colors, "alpha", 1.0)?;
        if light.is_some() && params.has("alpha") {
            params.ignore("alpha", "what emits light has no holes");
        }
        let opacity = if light.is_none() { alpha.opacity(draft, &params.place) } else { None };
        let needs = self.needs(graphics, light, matches!(&opacity, Some(crate::desc::OpacityDesc::Texture { .. })));

        let Some(form) = self.form(draft, kind, params, needs)? else { return Ok(None) };
        let mut reverse = graphics.reverse_orientation;
        let map = graphics.ctm.0[0];
        let (mut shape, inner, extent) = match form {
            Form::Analytic { shape, inner, area } => {
                if graphics.ctm.swaps_handedness() {
                    reverse = !reverse;
                }
                (*shape, inner, Some(Extent { count: 1, area }))
            }
            Form::Mesh(mesh, count) => {
                let extent = Extent { count, area: triangles::area(&mesh, &map) };
                (self.mesh_shape(draft, kind, mesh), DAffine3::IDENTITY, Some(extent))
            }
            Form::File(file) => (ShapeDesc::Mesh(MeshDesc::from_file(file)), DAffine3::IDENTITY, None),
            Form::Curves(curves) => {
                (reverse, light) = (false, light.filter(|_| no_light(draft, params)));
                (ShapeDesc::Curves(curves), DAffine3::IDENTITY, None)
            }
        };
        let ctm = still_if_lit(draft, params, graphics.ctm, light.is_some());
        let common = shape.common_mut();
        (*common.transform, *common.motion) = self.world.place(&ctm, inner);
        *common.material = material;
        *common.opacity = opacity;
        *common.emission = light.and_then(|light| light.emission(extent));
        *common.reverse_normal = reverse;
        params.report(draft);
        Ok(Some(shape))
    }

    fn needs(&self, graphics: &Graphics, light: Option<&AreaLight>, cut_out: bool) -> Needs {
        let material = match graphics.material.as_deref() {
            Some(ShapeMaterial::Material(material)) => Some(material),
            _ => None,
        };
        Needs {
            uvs: cut_out
                || light.is_some_and(AreaLight::is_textured)
                || material.is_some_and(|material| material.is_textured),
            sides: light.is_some()
                || !graphics.media.inside.is_empty()
                || material.is_some_and(|material| material.has_inside),
            extent: light.is_some_and(AreaLight::needs_extent),
        }
    }

    fn mesh_shape(&self, draft: &mut Draft, kind: &str, mesh: MeshData) -> ShapeDesc {
        if mesh.triangles.len() > MAX_INLINE {
            return ShapeDesc::Mesh(MeshDesc::from_file(
                draft.keep_mesh(&format!("{kind}_{}", draft.assets.meshes.len()), mesh),
            ));
        }
        ShapeDesc::Mesh(MeshDesc {
            positions: Some(mesh.written_positions()),
            triangles: Some(mesh.triangles),
            normals: mesh.normals,
            uvs: mesh.uvs,
            ..MeshDesc::empty()
        })
    }

    fn form(&self, draft: &mut Draft, kind: &str, params: &Params, needs: Needs) -> Result<Option<Form>> {
        let mut patches = None;
        let mesh = match kind {
            "sphere" | "disk" | "cylinder" => {
                let form = analytic(kind, params)?;
                if form.is_none() {
                    draft.ignored(&params.place, &params.element, "", "it has no area");
                }
                return Ok(form);
            }
            "curve" => return Ok(Some(Form::Curves(curve(params)?))),
            "plymesh" => return self.ply(params, needs).map(Some),
            "trianglemesh" => triangle_mesh(params)?,
            "bilinearmesh" => {
                let (mesh, count) = bilinear_mesh(draft, params)?;
                patches = Some(count);
                mesh
            }
            "loopsubdiv" => {
                let levels = params.integer_or("levels", 3)?.clamp(0, 64) as u32;
                params.string("scheme")?;
                let positions = params.groups("P")?.ok_or_else(|| params.error("needs positions P"))?;
                let indices =
                    params.indices("indices", positions.len())?.ok_or_else(|| params.error("needs indices"))?;
                let (mesh, made) = loop_surface(&positions, &indices, levels);
                if made < levels {
                    params.approximate("levels", "fewer, for there would be too many triangles");
                }
                mesh
            }
            other => return Err(params.error(format!("unknown shape \"{other}\""))),
        };
        let mut mesh = mesh;
        if mesh.triangles.is_empty() {
            draft.ignored(&params.place, &params.element, "", "it has no triangles");
            return Ok(None);
        }
        triangles::orient(&mut mesh);
        if needs.uvs {
            triangles::give_uvs(&mut mesh);
        }
        let count = patches.unwrap_or(mesh.triangles.len());
        Ok(Some(Form::Mesh(mesh, count)))
    }

    /// A PLY stays a file where nothing has to be known of it or changed.
    fn ply(&self, params: &Params, needs: Needs) -> Result<Form> {
        let Some(file) = params.string("filename")? else { return Err(params.error("needs a filename")) };
        params.ignore("displacement", "surfaces are not displaced");
        params.ignore("edgelength", "surfaces are not displaced");
        if !(needs.uvs || needs.sides || needs.extent) {
            return Ok(Form::File(file.into()));
        }
        let asset = self.colors.folder.join(file);
        let mut mesh = read_ply_attributes(&asset, Some(&BTreeSet::new()))
            .map_err(|error| error.at(self.scene, &format!("{}: {}", params.place, params.element), &asset))?;
        let mut changed = needs.sides && triangles::orient(&mut mesh);
        if needs.uvs && mesh.uvs.is_none() {
            triangles::give_uvs(&mut mesh);
            changed = true;
        }
        let count = mesh.triangles.len();
        Ok(if changed || needs.extent { Form::Mesh(mesh, count) } else { Form::File(file.into()) })
    }
}

/// What has to be known of a mesh.
#[derive(Clone, Copy, Debug)]
struct Needs {
    /// Its uv.
    uvs: bool,
    /// Which side is its front.
    sides: bool,
    /// How large it is.
    extent: bool,
}

/// A material for shapes that only shine.
fn black(draft: &mut Draft, place: &str) -> String {
    let roughness = crate::desc::ScalarDesc::Constant(0.0);
    draft.add_material("black", place, MaterialDesc::Diffuse { albedo: crate::desc::ColorDesc::Grey(0.0), roughness })
}

/// A sphere, disk or cylinder; `None` if it has no area.
fn analytic(kind: &str, params: &Params) -> Result<Option<Form>> {
    let radius = if params.number("radius")? == Some(0.0) { 0.0 } else { params.positive_or("radius", 1.0)? };
    let phi_max = params.number_or("phimax", 360.0)?.clamp(0.0, 360.0);
    let raised = |z: f64| DAffine3::from_translation(DVec3::new(0.0, 0.0, z));
    let turn = phi_max.to_radians();
    let form = match kind {
        "disk" => {
            let inner_radius = params.number_or("innerradius", 0.0)?.abs();
            let area = 0.5 * turn * (radius * radius - inner_radius * inner_radius);
            let shape = Box::new(ShapeDesc::Disk(DiskDesc::new(radius, inner_radius, phi_max)));
            Form::Analytic { shape, inner: raised(params.number_or("height", 0.0)?), area }
        }
        "cylinder" => {
            let (a, b) = (params.number_or("zmin", -1.0)?, params.number_or("zmax", 1.0)?);
            let height = (b - a).abs();
            let shape = Box::new(ShapeDesc::Cylinder(CylinderDesc::new(radius, height, phi_max)));
            Form::Analytic { shape, inner: raised(a.min(b)), area: turn * radius * height }
        }
        _ => {
            let (a, b) = (params.number_or("zmin", -radius)?, params.number_or("zmax", radius)?);
            let (low, high) = (a.min(b).clamp(-radius, radius), a.max(b).clamp(-radius, radius));
            let (z_min, z_max) = ((low > -radius).then_some(low), (high < radius).then_some(high));
            let shape = Box::new(ShapeDesc::Sphere(SphereDesc::new(radius, z_min, z_max, phi_max)));
            Form::Analytic { shape, inner: DAffine3::IDENTITY, area: turn * radius * (high - low) }
        }
    };
    Ok(Some(form).filter(|form| !matches!(form, Form::Analytic { area, .. } if *area <= 0.0)))
}

fn triangle_mesh(params: &Params) -> Result<MeshData> {
    let Some(positions) = params.wide_groups("P")? else { return Err(params.error("needs positions P")) };
    let (positions, origin) = MeshData::rounded(&positions);
    let count = positions.len();
    let triangles = match params.indices("indices", count)? {
        Some(triangles) => triangles,
        None if count == 3 => vec![[0, 1, 2]],
        None => return Err(params.error("needs indices")),
    };
    params.ignore("S", "tangents follow from uv");
    params.ignore("faceIndices", "faces have no numbers");
    let normals = match params.groups::<3>("N")? {
        Some(normals) if normals.len() != count => {
            params.ignore("N", "there is not one for each vertex");
            None
        }
        normals => normals,
    };
    let uvs = match params.groups::<2>("uv")? {
        Some(uvs) if uvs.len() != count => {
            params.ignore("uv", "there is not one for each vertex");
            None
        }
        uvs => uvs,
    };
    Ok(MeshData { positions, triangles, normals, uvs, origin, ..MeshData::default() })
}

/// More triangles than this are not made of a surface.
const MAX_SUBDIVIDED: u64 = 1 << 20;

/// The limit surface of triangles by Loop's scheme, without triangles that have a vertex twice, and its levels.
fn loop_surface(positions: &[[f32; 3]], triangles: &[[u32; 3]], levels: u32) -> (MeshData, u32) {
    let corners: Vec<u32> =
        triangles.iter().filter(|[a, b, c]| a != b && b != c && c != a).flatten().copied().collect();
    let cage = Cage {
        sizes: vec![3; corners.len() / 3],
        vertices: corners.clone(),
        points: corners,
        positions: vec![positions.iter().map(|p| DVec3::from(p.map(f64::from))).collect()],
        ..Cage::default()
    };
    let scheme = Scheme::LoopWarren;
    let is_possible = |levels: &u32| triangle_count(scheme, 0, triangles.len() as u64, *levels) <= MAX_SUBDIVIDED;
    let levels = (0..=levels).rev().find(is_possible).unwrap_or(0);
    let how = Refinement { scheme, uv_rule: UvRule::Linear, levels, is_too_long: None, max_triangles: MAX_SUBDIVIDED };
    let mut refined = refine(cage, &how);
    let mesh = MeshData {
        positions: refined.positions.pop().unwrap_or_default(),
        triangles: refined.triangles,
        normals: refined.normals.pop(),
        ..MeshData::default()
    };
    (mesh, levels)
}

/// The triangles, and how many patches they are.
fn bilinear_mesh(draft: &mut Draft, params: &Params) -> Result<(MeshData, usize)> {
    let Some(positions) = params.groups::<3>("P")? else { return Err(params.error("needs positions P")) };
    let count = positions.len();
    let corners = match params.indices("indices", count)? {
        Some(corners) => corners,
        None if count == 4 => vec![[0, 1, 2, 3]],
        None => return Err(params.error("needs indices")),
    };
    params.ignore("emissionfilename", "images of emission belong to the light");
    params.ignore("faceIndices", "faces have no numbers");
    let patches = Patches {
        normals: params.groups("N")?.filter(|normals: &Vec<[f32; 3]>| normals.len() == count),
        uvs: params.groups("uv")?.filter(|uvs: &Vec<[f32; 2]>| uvs.len() == count),
        positions,
        corners,
    };
    let (mesh, curved) = patches.triangulate();
    if curved > 0 {
        draft.approximated(&params.place, &params.element, "", "curved patches become a grid of triangles");
    }
    Ok((mesh, patches.corners.len()))
}
