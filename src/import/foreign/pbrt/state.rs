//! The graphics state: the current transforms and attributes, and the stack of those before.

use std::collections::BTreeMap;
use std::rc::Rc;

use super::area_light::AreaLight;
use super::colors::ColorSpace;
use super::media::MediumInterface;
use super::params::Param;
use crate::desc::{KeyframeDesc, TransformDesc, TransformStepDesc};
use crate::math::{DAffine3, DMat3, DVec3};

/// As deep as attributes may be nested.
pub const MAX_DEPTH: usize = 10_000;

/// A transform when the shutter opens and one when it closes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ctm(pub [DAffine3; 2]);

impl Default for Ctm {
    fn default() -> Self {
        Self([DAffine3::IDENTITY; 2])
    }
}

impl Ctm {
    /// Whether it moves.
    pub fn is_moving(&self) -> bool {
        self.0[0] != self.0[1]
    }

    /// Whether it turns a right-handed frame into a left-handed one, at the start.
    pub fn swaps_handedness(&self) -> bool {
        self.0[0].matrix3.determinant() < 0.0
    }

    /// The inverse; `None` if it is singular.
    pub fn inverse(&self) -> Option<Self> {
        let regular = self.0.iter().all(|map| map.matrix3.determinant().abs() > 0.0);
        let inverse = self.0.map(|map| map.inverse());
        (regular && inverse.iter().all(DAffine3::is_finite)).then_some(Self(inverse))
    }
}

/// The material of a shape.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ShapeMaterial {
    /// A material of the scene.
    Material(Material),
    /// Nothing: a boundary of media only.
    Interface,
}

/// A material of the scene and what it requires of shapes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Material {
    /// Its name in the scene.
    pub name: String,
    /// Whether it needs uv.
    pub is_textured: bool,
    /// Whether the two sides of a surface differ.
    pub has_inside: bool,
}

/// What attributes and transforms are in force.
#[derive(Clone, Debug)]
pub struct Graphics {
    /// The current transforms.
    pub ctm: Ctm,
    /// Which of the two are changed.
    pub active: [bool; 2],
    /// Whether surfaces' fronts are turned.
    pub reverse_orientation: bool,
    /// The material of shapes; `None` is pbrt's default, diffuse of 0.5.
    pub material: Option<Rc<ShapeMaterial>>,
    /// What shapes emit.
    pub area_light: Option<Rc<AreaLight>>,
    /// Of `rgb` parameters.
    pub color_space: ColorSpace,
    /// Parameters of `Attribute`, by the kind of directive.
    pub attributes: Rc<BTreeMap<String, Vec<Param>>>,
    /// Of shapes, and of the camera.
    pub media: Rc<MediumInterface>,
}

impl Default for Graphics {
    fn default() -> Self {
        Self {
            ctm: Ctm::default(),
            active: [true; 2],
            reverse_orientation: false,
            material: None,
            area_light: None,
            color_space: ColorSpace::default(),
            attributes: Rc::default(),
            media: Rc::default(),
        }
    }
}

impl Graphics {
    /// Lets `map` act before the current transforms, as all transform directives do.
    pub fn concatenate(&mut self, map: DAffine3) {
        self.change(|ctm| ctm * map);
    }

    /// Changes the active ones of the current transforms.
    pub fn change(&mut self, change: impl Fn(DAffine3) -> DAffine3) {
        for (ctm, _) in self.ctm.0.iter_mut().zip(self.active).filter(|(_, active)| *active) {
            *ctm = change(*ctm);
        }
    }
}

/// The map from pbrt's world to Steradian's.
///
/// pbrt's camera space is left-handed (x right, y up, z forward), Steradian's right-handed (z backward). Where the
/// camera's transform has no mirror in it, the world is left-handed too and all of it is mirrored: pictures stay the
/// same.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct World {
    /// Whether x is negated.
    pub mirrored: bool,
    /// When `Ctm`'s two transforms hold.
    pub times: Times,
}

/// When the two transforms hold.
#[derive(Clone, Copy, Debug)]
pub struct Times(pub [f64; 2]);

impl Default for Times {
    fn default() -> Self {
        Self([0.0, 1.0])
    }
}

impl World {
    /// Into the world.
    pub fn mirror(&self) -> DAffine3 {
        let x = if self.mirrored { -1.0 } else { 1.0 };
        DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(x, 1.0, 1.0)))
    }

    /// A place in the world, and the motion after it.
    pub fn place(&self, ctm: &Ctm, inner: DAffine3) -> (TransformDesc, Vec<KeyframeDesc>) {
        let mirror = self.mirror();
        if !ctm.is_moving() {
            return (matrix(&(mirror * ctm.0[0] * inner)), Vec::new());
        }
        // Keyframes have no mirror in them: it goes before the motion.
        let flip = Self { mirrored: self.mirrored != ctm.swaps_handedness(), ..*self }.mirror();
        let keyframe =
            |i: usize| KeyframeDesc { time: self.times.0[i], transform: matrix(&(mirror * ctm.0[i] * flip)) };
        (matrix(&(flip * inner)), vec![keyframe(0), keyframe(1)])
    }
}

/// A map as a transform of the scene; no steps if it is the identity.
pub fn matrix(map: &DAffine3) -> TransformDesc {
    if *map == DAffine3::IDENTITY {
        return TransformDesc::default();
    }
    let m = map.matrix3.transpose();
    let row = |r: DVec3, t: f64| [r.x, r.y, r.z, t];
    let t = map.translation;
    TransformDesc(vec![TransformStepDesc::Matrix([
        row(m.x_axis, t.x),
        row(m.y_axis, t.y),
        row(m.z_axis, t.z),
        [0.0, 0.0, 0.0, 1.0],
    ])])
}

/// The rotation nearest to a map that ought to be one, and its scale: x and y are turned least where they are not at
/// right angles to z. `None` if it is singular.
pub fn rotation_and_scale(map: &DMat3) -> Option<(DMat3, f64)> {
    let z = map.z_axis.try_normalize()?;
    let y = (map.y_axis - z * map.y_axis.dot(z)).try_normalize()?;
    let x = y.cross(z) * map.determinant().signum();
    let scale = map.determinant().abs().cbrt();
    (scale > 0.0 && scale.is_finite()).then_some((DMat3::from_cols(x, y, z), scale))
}

/// Whether a map is a rotation (or mirrored one) times a scale, within the precision of six digits in a file.
pub fn is_similar(map: &DMat3) -> bool {
    let Some((rotation, scale)) = rotation_and_scale(map) else { return false };
    let error = (0..3).map(|i| (map.col(i) / scale - rotation.col(i)).length()).fold(0.0, f64::max);
    error < 1e-3
}
