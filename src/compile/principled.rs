//! The principled material: its parameters checked.

use super::materials::Compiler;
use crate::bsdf::PrincipledModel;
use crate::desc::{PrincipledDesc, PrincipledModelDesc, principled_parameters};
use crate::error::Result;
use crate::material::{PrincipledInputs, RangedInput, ScalarInput};

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
        Ok(inputs)
    }
}
