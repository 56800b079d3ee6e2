//! The layers of a picture: one table from kind to name, channels and what fills them.

use super::SurfaceSample;
use crate::desc::LayerDesc;

/// A layer of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LayerKind {
    /// The picture: radiance, premultiplied by coverage, and coverage.
    Color,
    /// Depth along the view axis.
    Z,
    /// Shading normal, world.
    N,
    /// Position, world.
    P,
    /// Fraction of light scattered.
    Albedo,
    /// Variance of the picture.
    Variance,
    /// Number of samples.
    Samples,
}

/// What the table says of a layer.
#[derive(Clone, Copy, Debug)]
pub struct LayerInfo {
    /// Which layer.
    pub kind: LayerKind,
    /// The name users ask for it by.
    pub name: &'static str,
    /// Its channels' full names in a file, in the order of the pixel data.
    pub channels: &'static [&'static str],
    /// Stored as 32-bit floats whatever the pixel type: 16 bits would spoil it.
    pub always_float: bool,
    /// What the file's comment says of it.
    pub comment: &'static str,
    /// Writes a sample's values, one for each channel; absent where samples have none.
    pub(super) read: Option<fn(&SurfaceSample, &mut [f32])>,
}

impl LayerKind {
    /// Every layer, in the order of files and of memory.
    pub const ALL: [LayerInfo; 7] = [
        LayerInfo { kind: Self::Color, name: "color", channels: &["R", "G", "B", "A"], always_float: false, comment: "", read: None },
        LayerInfo {
            kind: Self::Z,
            name: "Z",
            channels: &["Z"],
            always_float: true,
            comment: "Z: depth along the view axis; 1e10 where nothing was hit",
            read: Some(|s, out| out[0] = s.depth),
        },
        LayerInfo {
            kind: Self::N,
            name: "N",
            channels: &["N.X", "N.Y", "N.Z"],
            always_float: false,
            comment: "N: shading normal, world; 0 where nothing was hit",
            read: Some(|s, out| out.copy_from_slice(&s.normal.to_array())),
        },
        LayerInfo {
            kind: Self::P,
            name: "P",
            channels: &["P.X", "P.Y", "P.Z"],
            always_float: true,
            comment: "P: position, world; 0 where nothing was hit",
            read: Some(|s, out| out.copy_from_slice(&s.position.to_array())),
        },
        LayerInfo {
            kind: Self::Albedo,
            name: "albedo",
            channels: &["albedo.R", "albedo.G", "albedo.B"],
            always_float: false,
            comment: "albedo: fraction of light scattered by the first surface",
            read: Some(|s, out| out.copy_from_slice(&s.albedo.to_array())),
        },
        LayerInfo {
            kind: Self::Variance,
            name: "variance",
            channels: &["variance.R", "variance.G", "variance.B"],
            always_float: true,
            comment: "variance: of the picture's R, G and B, their expected squared error",
            read: None,
        },
        LayerInfo {
            kind: Self::Samples,
            name: "samples",
            channels: &["stats.samples"],
            always_float: true,
            comment: "stats.samples: samples of the pixel",
            read: None,
        },
    ];

    /// What the table says of this layer.
    #[inline]
    pub const fn info(self) -> &'static LayerInfo {
        // The table is in the order of the variants; a test holds it to that.
        &Self::ALL[self as usize]
    }
}

impl From<LayerDesc> for LayerKind {
    fn from(desc: LayerDesc) -> Self {
        match desc {
            LayerDesc::Z => Self::Z,
            LayerDesc::N => Self::N,
            LayerDesc::P => Self::P,
            LayerDesc::Albedo => Self::Albedo,
            LayerDesc::Variance => Self::Variance,
            LayerDesc::Samples => Self::Samples,
        }
    }
}

/// A set of layers. The colour is always part of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LayerSet {
    bits: u8,
}

impl LayerSet {
    /// Only the colour.
    pub const COLOR: Self = Self { bits: 0 };
    /// Every layer.
    pub const FULL: Self = Self { bits: (1 << LayerKind::ALL.len()) - 1 };

    /// Adds a layer.
    pub const fn insert(&mut self, kind: LayerKind) {
        self.bits |= 1 << kind as u8;
    }

    /// Whether the layer is part of the set.
    #[inline]
    pub const fn contains(self, kind: LayerKind) -> bool {
        matches!(kind, LayerKind::Color) || self.bits & (1 << kind as u8) != 0
    }

    /// Whether any layer is part of the set that [`SurfaceSample`] is needed for.
    #[inline]
    pub const fn needs_surface(self) -> bool {
        const OF_SURFACES: u8 = {
            let (mut bits, mut i) = (0, 0);
            while i < LayerKind::ALL.len() {
                bits |= (LayerKind::ALL[i].read.is_some() as u8) << i;
                i += 1;
            }
            bits
        };
        self.bits & OF_SURFACES != 0
    }

    /// The layers that samples have values for beside the colour, in the table's order.
    pub fn of_surfaces(self) -> impl Iterator<Item = &'static LayerInfo> {
        LayerKind::ALL.iter().filter(move |info| info.read.is_some() && self.contains(info.kind))
    }

    /// All layers, in the table's order.
    pub fn iter(self) -> impl Iterator<Item = &'static LayerInfo> {
        LayerKind::ALL.iter().filter(move |info| self.contains(info.kind))
    }
}

impl FromIterator<LayerKind> for LayerSet {
    fn from_iter<I: IntoIterator<Item = LayerKind>>(kinds: I) -> Self {
        let mut set = Self::default();
        for kind in kinds {
            set.insert(kind);
        }
        set
    }
}

impl<'a> FromIterator<&'a LayerDesc> for LayerSet {
    fn from_iter<I: IntoIterator<Item = &'a LayerDesc>>(descs: I) -> Self {
        descs.into_iter().map(|desc| LayerKind::from(*desc)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_the_order_of_the_variants() {
        for (i, info) in LayerKind::ALL.iter().enumerate() {
            assert_eq!(info.kind as usize, i);
            assert_eq!(info.kind.info().name, info.name);
        }
    }

    #[test]
    fn a_set_holds_what_was_put_in_and_always_the_colour() {
        let set: LayerSet = [LayerKind::P, LayerKind::Z].into_iter().collect();
        assert_eq!(set.iter().map(|info| info.kind).collect::<Vec<_>>(), [LayerKind::Color, LayerKind::Z, LayerKind::P]);
        assert!(set.needs_surface() && !LayerSet::COLOR.needs_surface());
        assert!(LayerSet::COLOR.contains(LayerKind::Color));
        assert_eq!([LayerDesc::Albedo, LayerDesc::Samples].iter().collect::<LayerSet>().of_surfaces().count(), 1);
        assert!(!LayerSet::from_iter(&[LayerDesc::Variance, LayerDesc::Samples]).needs_surface());
        assert_eq!(LayerSet::FULL.iter().count(), LayerKind::ALL.len());
    }
}
