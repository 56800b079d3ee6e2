//! Skins: joints that carry the vertices of a mesh.

use gltf::json::Index;
use gltf::json::accessor::Type;
use gltf::json::skin::Skin;

use super::GltfSource;
use super::accessors::AccessorUse;
use super::nodes::Pose;
use crate::error::Result;
use crate::math::{DAffine3, DMat3, DVec3};

/// World from mesh by each joint of a skin.
pub fn joints(source: GltfSource, index: Index<Skin>, pose: &Pose) -> Result<Vec<DAffine3>> {
    let path = format!("skins[{}]", index.value());
    let skin = source.root.get(index).ok_or_else(|| source.fault(&path, "no such skin"))?;
    let binds = match skin.inverse_bind_matrices {
        Some(accessor) => {
            Some(source.column(&format!("{path}.inverseBindMatrices"), accessor, &[Type::Mat4], AccessorUse::Floats)?)
        }
        None => None,
    };
    if let Some(binds) = binds.as_ref().filter(|binds| binds.count() < skin.joints.len()) {
        return Err(source.fault(&path, format!("has {} joints, but {} matrices", skin.joints.len(), binds.count())));
    }
    let mut joints = Vec::with_capacity(skin.joints.len());
    for (k, joint) in skin.joints.iter().enumerate() {
        let place = format!("{path}.joints[{k}]");
        let world = pose.world.get(joint.value()).ok_or_else(|| source.fault(&place, "no such node"))?;
        let bind = binds.as_ref().map_or(DAffine3::IDENTITY, |binds| {
            let m = binds.floats::<16>(k).map(f64::from);
            let column = |i: usize| DVec3::new(m[i], m[i + 1], m[i + 2]);
            DAffine3 { matrix3: DMat3::from_cols(column(0), column(4), column(8)), translation: column(12) }
        });
        let joint = *world * bind;
        if !joint.is_finite() {
            return Err(source.fault(&place, "the matrix is not finite"));
        }
        joints.push(joint);
    }
    Ok(joints)
}

/// The weighted sum of joints; `None` if the weights sum to nothing.
pub fn blend(joints: &[DAffine3], carried: impl Iterator<Item = (usize, f64)>) -> Option<DAffine3> {
    let mut sum = DAffine3::ZERO;
    let mut total = 0.0;
    for (joint, weight) in carried.filter(|(_, weight)| *weight > 0.0) {
        let joint = joints.get(joint)?;
        sum.matrix3 += joint.matrix3 * weight;
        sum.translation += joint.translation * weight;
        total += weight;
    }
    (total > 0.0).then(|| DAffine3 { matrix3: sum.matrix3 * (1.0 / total), translation: sum.translation / total })
}
