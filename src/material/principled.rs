//! Parameters of the principled model from textures.

use super::{ColorInput, RangedInput, ScalarInput};
use crate::bsdf::{BsdfFlags, PrincipledModel, PrincipledParameters};
use crate::desc::principled_parameters;
use crate::id::TextureId;
use crate::texture::{Footprint, Texture};

/// The type of a parameter, its value over a footprint, and its texture.
macro_rules! input {
    (color) => { ColorInput };
    (scalar) => { ScalarInput };
    (specular) => { Option<ScalarInput> };
    (ior) => { RangedInput };
    (flag) => { bool };
    (model) => { PrincipledModel };
    (flag $input:expr, $($at:expr),*) => { $input };
    (model $input:expr, $($at:expr),*) => { $input };
    (specular $input:expr, $($at:expr),*) => { $input.map(|input| input.at($($at),*)) };
    ($kind:ident $input:expr, $($at:expr),*) => { $input.at($($at),*) };
    (flag $input:expr) => { None };
    (model $input:expr) => { None };
    (specular $input:expr) => { $input.and_then(|input| input.texture()) };
    ($kind:ident $input:expr) => { $input.texture() };
}

macro_rules! inputs {
    ($($(#[doc = $doc:literal])* $(#[serde $serde:tt])? $name:ident: $kind:ident = $default:tt,)*) => {
        /// What [`PrincipledParameters`] are made of.
        #[derive(Clone, Debug, PartialEq)]
        pub struct PrincipledInputs {
            $($(#[doc = $doc])* pub $name: input!($kind),)*
            /// As [`PrincipledParameters::random_walk`].
            pub random_walk: bool,
        }

        impl PrincipledInputs {
            pub(super) fn parameters(&self, textures: &[Texture], footprint: &Footprint) -> PrincipledParameters {
                PrincipledParameters {
                    $($name: input!($kind self.$name, textures, footprint),)*
                    random_walk: self.random_walk,
                }
            }

            pub(super) fn textures(&self) -> Vec<TextureId> {
                let textures: &[Option<TextureId>] = &[$(input!($kind self.$name),)*];
                textures.iter().copied().flatten().collect()
            }
        }
    };
}
principled_parameters!(inputs);

impl PrincipledInputs {
    pub(super) fn flags(&self) -> BsdfFlags {
        let mut flags = BsdfFlags::DIFFUSE | BsdfFlags::GLOSSY | BsdfFlags::REFLECTION;
        flags.set(BsdfFlags::TRANSMISSION, !self.transmission.is_zero() || !self.diffuse_transmission.is_zero());
        flags.set(BsdfFlags::ANISOTROPIC, !self.anisotropic.is_zero());
        flags
    }

    /// Whether light enters the surface for a random walk, for some values of its textures.
    pub(super) fn has_walk(&self) -> bool {
        self.random_walk && !self.subsurface.is_zero()
    }
}
