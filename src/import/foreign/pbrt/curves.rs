//! Curves.

use super::params::Params;
use crate::desc::{CurveBasisDesc, CurveKindDesc, CurvesDesc, ShapeDesc};
use crate::error::Result;
use crate::math::DVec3;

/// Reads a curve: Bezier or B-spline of degree 2 or 3, whose width runs from `width0` to `width1`. It becomes joined
/// cubic Bezier curves.
pub fn curve(params: &Params) -> Result<CurvesDesc> {
    let Some(points) = params.wide_groups::<3>("P")? else { return Err(params.error("needs control points P")) };
    let points: Vec<DVec3> = points.into_iter().map(DVec3::from).collect();
    let degree = params.integer_or("degree", 3)?;
    let basis = params.string("basis")?.unwrap_or("bezier");
    let segments: Vec<[DVec3; 4]> = match (basis, degree) {
        ("bezier", 2) => beziers(params, &points, 2)?.map(|p| elevated([p[0], p[1], p[2]])).collect(),
        ("bezier", 3) => beziers(params, &points, 3)?.map(|p| [p[0], p[1], p[2], p[3]]).collect(),
        ("bspline", 2) => {
            points.windows(3).map(|p| elevated([0.5 * (p[0] + p[1]), p[1], 0.5 * (p[1] + p[2])])).collect()
        }
        ("bspline", 3) => points.windows(4).map(|p| uniform_spline([p[0], p[1], p[2], p[3]])).collect(),
        ("bezier" | "bspline", _) => return Err(params.error(format!("the degree of curves is 2 or 3, not {degree}"))),
        _ => return Err(params.error(format!("unknown basis \"{basis}\""))),
    };
    if segments.is_empty() {
        return Err(params.error(format!("{} control points are too few", points.len())));
    }
    let kind = match params.string("type")?.unwrap_or("flat") {
        "flat" => CurveKindDesc::Flat,
        "cylinder" => CurveKindDesc::Cylinder,
        "ribbon" => {
            params.approximate("type", "a ribbon that faces each ray, not turned by normals");
            CurveKindDesc::Flat
        }
        other => return Err(params.error(format!("unknown type \"{other}\" of curves"))),
    };
    params.ignore("N", "ribbons face each ray");
    params.ignore("splitdepth", "curves are halved as far as needed");
    let width = params.number_or("width", 1.0)?;
    let ends = [params.number_or("width0", width)?, params.number_or("width1", width)?];
    let count = segments.len() as f64;
    let radius = |at: f64| 0.5 * (ends[0] + (ends[1] - ends[0]) * at / count).max(0.0);
    let mut strand = Vec::with_capacity(3 * segments.len() + 1);
    for (i, segment) in segments.iter().enumerate() {
        for (k, p) in segment.iter().enumerate().skip(usize::from(i > 0)) {
            strand.push([p.x, p.y, p.z, radius(i as f64 + k as f64 / 3.0)]);
        }
    }
    Ok(CurvesDesc::new(None, Some(vec![strand]), CurveBasisDesc::Bezier, kind, 1.0, None, None))
}

/// The joined Bezier curves of a degree.
fn beziers<'p>(params: &Params, points: &'p [DVec3], degree: usize) -> Result<impl Iterator<Item = &'p [DVec3]>> {
    if points.len() <= degree || !(points.len() - 1).is_multiple_of(degree) {
        return Err(params.error(format!(
            "{} control points: Bezier curves of degree {degree} need a multiple of {degree} and one more",
            points.len()
        )));
    }
    Ok(points.windows(degree + 1).step_by(degree))
}

/// A quadratic Bezier curve as a cubic one.
fn elevated([a, b, c]: [DVec3; 3]) -> [DVec3; 4] {
    [a, a.lerp(b, 2.0 / 3.0), c.lerp(b, 2.0 / 3.0), c]
}

/// A segment of a uniform cubic B-spline.
fn uniform_spline([a, b, c, d]: [DVec3; 4]) -> [DVec3; 4] {
    [(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0]
}

/// Adds the strands of curves to those before them, if they are alike in all else: scenes have a shape for each hair.
/// False if they are not.
pub fn joined(before: Option<&mut ShapeDesc>, shape: &mut ShapeDesc) -> bool {
    let (Some(ShapeDesc::Curves(before)), ShapeDesc::Curves(curves)) = (before, shape) else { return false };
    let alike = before.kind == curves.kind
        && before.material == curves.material
        && format!("{:?}", before.transform) == format!("{:?}", curves.transform)
        && format!("{:?}", before.motion) == format!("{:?}", curves.motion)
        && format!("{:?}", before.opacity) == format!("{:?}", curves.opacity);
    if let (true, Some(strands), Some(more)) = (alike, &mut before.strands, &mut curves.strands) {
        strands.append(more);
    }
    alike
}

/// Adds a shape to those of an object.
pub fn push(shapes: &mut Vec<(String, ShapeDesc)>, place: String, mut shape: ShapeDesc) {
    if !joined(shapes.last_mut().map(|(_, last)| last), &mut shape) {
        shapes.push((place, shape));
    }
}
