//! Curves and points: from files or the scene itself to placed, checked shapes.

use std::collections::{BTreeMap, BTreeSet};

use super::attributes;
use super::meshes::refusal;
use super::{Builder, CompileContext};
use crate::assets::{self, StrandData};
use crate::attribute::{AttributeValues, VERTEX_COLOR};
use crate::bsdf::BsdfFlags;
use crate::desc::{CurveBasisDesc, CurveKindDesc, CurvesDesc, PointsDesc, ShapeCommon};
use crate::error::Result;
use crate::geometry::{CurveBasis, CurveKind, Curves, CurvesError, Points, Shape, Strands};
use crate::math::{Bounds, DVec3, Transform};

/// Curves or points before they are placed.
#[derive(Clone, Debug)]
pub(super) struct StrandSource {
    /// Positions and radii.
    points: Vec<[f32; 4]>,
    /// What the positions are relative to.
    origin: [f64; 3],
    /// Of curves; points have none.
    strands: Option<StrandForm>,
    file: Option<String>,
}

#[derive(Clone, Debug)]
struct StrandForm {
    counts: Vec<u32>,
    basis: CurveBasis,
    kind: CurveKind,
    root_uvs: Option<Vec<[f32; 2]>>,
    attributes: BTreeMap<String, AttributeValues>,
}

impl StrandSource {
    /// The attributes that it has.
    pub fn attributes_mut(&mut self) -> Option<&mut BTreeMap<String, AttributeValues>> {
        self.strands.as_mut().map(|strands| &mut strands.attributes)
    }

    /// Bounds of all spheres, those of NaN left out.
    pub fn bounds(&self) -> Bounds {
        let origin = DVec3::from(self.origin);
        self.points.iter().map(|p| p.map(f64::from)).fold(Bounds::EMPTY, |bounds, [x, y, z, r]| {
            let p = DVec3::new(x, y, z) + origin;
            bounds.extended(p - r).extended(p + r)
        })
    }
}

impl Builder {
    /// Reads curves. `scatters_as_fiber` is whether their material is that of a whole fibre.
    pub(super) fn curves(&self, path: &str, desc: &CurvesDesc, scatters_as_fiber: bool) -> Result<StrandSource> {
        let files = &self.files;
        let (StrandData { mut points, counts }, origin) = match (&desc.file, &desc.strands) {
            (Some(file), None) => (self.strand_file(path, file)?, [0.0; 3]),
            (None, Some(strands)) => inline(strands),
            _ => return Err(files.error(path, "curves need either `file` or `strands`")),
        };
        scale_radii(files, &format!("{path}.radius_scale"), desc.radius_scale, &mut points)?;
        let mut attributes = BTreeMap::new();
        if let Some(colors) = &desc.colors {
            if colors.len() != counts.len() && colors.len() != points.len() {
                let message =
                    format!("{} for {} strands of {} control points", colors.len(), counts.len(), points.len());
                return Err(files.error(&format!("{path}.colors"), message));
            }
            attributes.insert(VERTEX_COLOR.to_owned(), AttributeValues::Colors(colors.clone()));
        }
        let basis = match desc.basis {
            CurveBasisDesc::Linear => CurveBasis::Linear,
            CurveBasisDesc::Bezier => CurveBasis::Bezier,
            CurveBasisDesc::BSpline => CurveBasis::BSpline,
            CurveBasisDesc::CatmullRom => CurveBasis::CatmullRom,
        };
        let kind = match desc.kind {
            CurveKindDesc::Round => CurveKind::Round,
            // Where a ray meets a fibre is known from the normal.
            CurveKindDesc::Flat if scatters_as_fiber => CurveKind::Cylinder,
            CurveKindDesc::Flat => CurveKind::Flat,
            CurveKindDesc::Cylinder => CurveKind::Cylinder,
        };
        let strands = Some(StrandForm { counts, basis, kind, root_uvs: desc.root_uvs.clone(), attributes });
        Ok(StrandSource { points, origin, strands, file: desc.file.clone() })
    }

    fn strand_file(&self, path: &str, file: &str) -> Result<StrandData> {
        let asset = self.files.source.asset(file);
        assets::read_strands(&asset).map_err(|e| self.files.asset_error(&format!("{path}.file"), &asset, e))
    }

    /// Reads points.
    pub(super) fn points(&self, path: &str, desc: &PointsDesc) -> Result<StrandSource> {
        let files = &self.files;
        let (positions, radii, origin) = match (&desc.file, &desc.centers) {
            (Some(file), None) if desc.radii.is_none() => {
                let asset = files.source.asset(file);
                let requested = BTreeSet::from([RADIUS.to_owned()]);
                let mut mesh = assets::read_ply_attributes(&asset, Some(&requested))
                    .map_err(|e| files.asset_error(&format!("{path}.file"), &asset, e))?;
                let radii = match mesh.attributes.remove(RADIUS) {
                    Some(AttributeValues::Numbers(radii)) => Some(radii),
                    _ => None,
                };
                (mesh.positions, radii, mesh.origin)
            }
            (None, Some(centers)) => {
                let (positions, origin) = assets::MeshData::rounded(centers);
                (positions, desc.radii.clone(), origin)
            }
            _ => {
                return Err(files.error(path, "points need either `file`, or `centers` (with optional `radii`)"));
            }
        };
        if let Some(radii) = radii.as_ref().filter(|radii| radii.len() != positions.len()) {
            let message = format!("{} for {} centers", radii.len(), positions.len());
            return Err(files.error(&format!("{path}.radii"), message));
        }
        let radius = |i: usize| radii.as_ref().map_or(1.0, |radii| radii[i]);
        let mut points: Vec<[f32; 4]> =
            positions.iter().enumerate().map(|(i, &[x, y, z])| [x, y, z, radius(i)]).collect();
        scale_radii(files, &format!("{path}.radius"), desc.radius, &mut points)?;
        Ok(StrandSource { points, origin, strands: None, file: desc.file.clone() })
    }

    /// Rejects what curves and points cannot do.
    pub(super) fn check_strands(
        &self,
        path: &str,
        common: &ShapeCommon,
        material: crate::id::MaterialId,
    ) -> Result<()> {
        if common.emission.is_some() {
            let message = "curves and points cannot emit light; use a mesh or an analytic shape";
            return Err(self.files.error(&format!("{path}.emission"), message));
        }
        if common.reverse_normal {
            return Err(self.files.error(&format!("{path}.reverse_normal"), "curves and points have no other side"));
        }
        if self.materials.medium(material).is_some() {
            let message = "a medium cannot fill curves or points, whose surfaces may overlap or are met from outside \
                           only; use a mesh";
            return Err(self.files.error(&format!("{path}.material"), message));
        }
        Ok(())
    }

    /// Whether a material scatters light as a whole fibre.
    pub(super) fn is_fiber(&self, material: crate::id::MaterialId) -> bool {
        self.materials.any_part(material, &|id| self.materials.materials[id.index()].flags().contains(BsdfFlags::FIBER))
    }

    /// Places curves or points.
    pub(super) fn placed_strands(&self, path: &str, source: StrandSource, transform: &Transform) -> Result<Shape> {
        let StrandSource { mut points, origin, strands, file } = source;
        let refuse = |error: CurvesError| refusal(&self.files, path, file.as_deref(), error.to_string());
        if *transform != Transform::IDENTITY || origin != [0.0; 3] {
            let scale = transform.uniform_scale().ok_or_else(|| {
                let message = "curves and points stay round: the scale must be the same along all axes, without shear";
                self.files.error(&format!("{path}.transform"), message)
            })?;
            for point in &mut points {
                let [x, y, z, radius] = point.map(f64::from);
                let p = transform.point(DVec3::new(x, y, z) + DVec3::from(origin)).as_vec3();
                *point = [p.x, p.y, p.z, (radius * scale) as f32];
            }
        }
        let Some(StrandForm { counts, basis, kind, root_uvs, attributes }) = strands else {
            return Ok(Shape::Points(Box::new(Points::new(points).map_err(refuse)?)));
        };
        let per_strand = counts.len();
        let mut curves = Curves::new(Strands { points, counts }, basis, kind).map_err(refuse)?;
        if let Some(uvs) = root_uvs {
            curves = curves.with_root_uvs(uvs).map_err(refuse)?;
        }
        let mut attributes = attributes::placed(attributes, &self.materials.textures.attributes, None, None);
        attributes.iter_mut().for_each(|attribute| attribute.of_faces = attribute.values.len() == per_strand);
        Ok(Shape::Curves(Box::new(curves.with_attributes(attributes))))
    }
}

/// The attribute of a PLY file that has the radii of points.
const RADIUS: &str = "vertex_radius";

/// Strands of a scene file, from an origin where they are far away.
fn inline(strands: &[Vec<[f64; 4]>]) -> (StrandData, [f64; 3]) {
    let points = || strands.iter().flatten();
    let positions: Vec<[f64; 3]> = points().map(|&[x, y, z, _]| [x, y, z]).collect();
    let (positions, origin) = assets::MeshData::rounded(&positions);
    let points = positions.into_iter().zip(points()).map(|([x, y, z], p)| [x, y, z, p[3] as f32]).collect();
    (StrandData { points, counts: strands.iter().map(|strand| strand.len() as u32).collect() }, origin)
}

fn scale_radii(files: &CompileContext, path: &str, scale: f64, points: &mut [[f32; 4]]) -> Result<()> {
    let is_sound = scale > 0.0 && scale.is_finite();
    if !is_sound {
        return Err(files.error(path, format!("must be finite and above 0, not {scale}")));
    }
    if scale != 1.0 {
        points.iter_mut().for_each(|p| p[3] = (f64::from(p[3]) * scale) as f32);
    }
    Ok(())
}
