//! The principled material: its parameters checked.

use super::materials::Compiler;
use crate::bsdf::PrincipledModel;
use crate::color::Rgb;
use crate::desc::{CoefficientDesc, PrincipledDesc, PrincipledModelDesc, ScalarDesc, principled_parameters};
use crate::error::Result;
use crate::material::{PrincipledInputs, RangedInput, ScalarInput};
use crate::medium::Subsurface;

/// The radii of red, green and blue where none are given: Blender's.
const DEFAULT_RADIUS: [f32; 3] = [1.0, 0.2, 0.1];

/// The range of radii and of their factor.
const MIN_RADIUS: f64 = 1e-12;
const MAX_RADIUS: f64 = 1e12;

/// The largest mean cosine of a scattering below a surface.
const MAX_ANISOTROPY: f64 = 0.9;

impl Compiler<'_> {
    pub(super) fn principled(&self, path: &str, desc: &PrincipledDesc) -> Result<PrincipledInputs> {
        if desc.specular.is_some() && desc.ior.is_some() {
            return Err(self.files.error(path, "give either `specular` or `ior`"));
        }
        macro_rules! input {
            (color $desc:expr, $path:expr, $default:tt) => {
                self.color($path, &$desc)?
            };
            (scalar $desc:expr, $path:expr, $default:tt) => {
                self.scalar($path, &$desc)?
            };
            (specular $desc:expr, $path:expr, $default:tt) => {
                $desc.as_ref().map(|desc| self.scalar($path, desc)).transpose()?
            };
            (ior $desc:expr, $path:expr, $default:tt) => {
                $desc.as_ref().map_or(Ok(RangedInput::Constant($default)), |desc| self.ior(path, desc, 1.0))?
            };
            (flag $desc:expr, $path:expr, $default:tt) => {
                $desc
            };
            (model $desc:expr, $path:expr, $default:tt) => {
                match $desc {
                    PrincipledModelDesc::Burley => PrincipledModel::Burley,
                    PrincipledModelDesc::Mitsuba => PrincipledModel::Mitsuba,
                }
            };
        }
        macro_rules! inputs {
            ($($(#[doc = $doc:literal])* $(#[serde $serde:tt])? $name:ident: $kind:ident = $default:tt,)*) => {
                PrincipledInputs {
                    $($name: input!($kind desc.$name, &format!("{path}.{}", stringify!($name)), $default),)*
                    random_walk: false,
                }
            };
        }
        let inputs = principled_parameters!(inputs);
        if !desc.thin && inputs.diffuse_transmission != ScalarInput::Constant(0.0) {
            return Err(self
                .files
                .error(&format!("{path}.diffuse_transmission"), "needs `thin`: a solid has no other side here"));
        }
        if !desc.thin && !inputs.transmission.is_zero() {
            let textured = [
                ("specular", matches!(inputs.specular, Some(ScalarInput::Texture(_)))),
                ("ior", matches!(inputs.ior, RangedInput::Texture { .. })),
            ];
            if let Some((key, _)) = textured.into_iter().find(|(_, is_textured)| *is_textured) {
                let message = "cannot come from a texture with `transmission`, unless `thin`: what is inside has one \
                               index of refraction";
                return Err(self.files.error(&format!("{path}.{key}"), message));
            }
        }
        self.check_random_walk(path, desc)?;
        Ok(PrincipledInputs { random_walk: !desc.subsurface_method.is_flat(), ..inputs })
    }

    /// Refuses a random walk together with what has none.
    fn check_random_walk(&self, path: &str, desc: &PrincipledDesc) -> Result<()> {
        if desc.subsurface_method.is_flat() {
            let keys = [
                ("subsurface_radius", desc.subsurface_radius.is_some()),
                ("subsurface_scale", desc.subsurface_scale.is_some()),
                ("subsurface_anisotropy", desc.subsurface_anisotropy.is_some()),
            ];
            return match keys.into_iter().find(|(_, is_given)| *is_given) {
                Some((key, _)) => Err(self.files.error(
                    &format!("{path}.{key}"),
                    "needs the `subsurface_method` \"random_walk\": the flat lobe has none",
                )),
                None => Ok(()),
            };
        }
        let message = if desc.thin {
            "\"random_walk\" cannot be `thin`: a thin sheet has no inside"
        } else if desc.model == PrincipledModelDesc::Mitsuba {
            "\"random_walk\" is not of the `model` \"mitsuba\""
        } else {
            return Ok(());
        };
        Err(self.files.error(&format!("{path}.subsurface_method"), message))
    }

    /// How light is scattered below the surface, if the material has a random walk.
    pub(super) fn subsurface(&self, path: &str, desc: &PrincipledDesc) -> Result<Option<Subsurface>> {
        if desc.subsurface_method.is_flat() {
            return Ok(None);
        }
        let radius = desc.subsurface_radius.map_or(DEFAULT_RADIUS, CoefficientDesc::to_array);
        for value in radius {
            self.files.within(&format!("{path}.subsurface_radius"), f64::from(value), MIN_RADIUS, MAX_RADIUS)?;
        }
        let scale = desc.subsurface_scale.unwrap_or(1.0);
        self.files.within(&format!("{path}.subsurface_scale"), f64::from(scale), MIN_RADIUS, MAX_RADIUS)?;
        let anisotropy = desc.subsurface_anisotropy.unwrap_or(0.0);
        let place = format!("{path}.subsurface_anisotropy");
        self.files.within(&place, f64::from(anisotropy), -MAX_ANISOTROPY, MAX_ANISOTROPY)?;
        let is_there = !matches!(desc.subsurface, ScalarDesc::Constant(0.0));
        Ok(is_there.then(|| Subsurface { radius: Rgb::from(radius) * scale, anisotropy }))
    }
}
