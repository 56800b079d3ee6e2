//! The layers of a picture: one table from kind to name, channels and what fills them.

use serde::{Deserialize, Serialize};

use super::{LightAov, SurfaceSample};
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
    /// Geometric normal, world.
    Ng,
    /// Position, world.
    P,
    /// Surface parameters.
    Uv,
    /// Motion in the picture.
    Motion,
    /// Fraction of light scattered.
    Albedo,
    /// [`LightAov::DiffuseDirect`].
    DiffuseDirect,
    /// [`LightAov::DiffuseIndirect`].
    DiffuseIndirect,
    /// [`LightAov::SpecularDirect`].
    SpecularDirect,
    /// [`LightAov::SpecularIndirect`].
    SpecularIndirect,
    /// [`LightAov::TransmissionDirect`].
    TransmissionDirect,
    /// [`LightAov::TransmissionIndirect`].
    TransmissionIndirect,
    /// [`LightAov::Emission`].
    Emission,
    /// [`LightAov::Background`].
    Background,
    /// What each group of lights gives to the picture: a layer for each.
    LightGroups,
    /// Variance of the picture.
    Variance,
    /// Number of samples.
    Samples,
    /// Albedo of the first surface that is no mirror and no clear glass, for denoisers.
    FeatureAlbedo,
    /// Normal of that surface, for denoisers.
    FeatureNormal,
    /// The picture before it was denoised.
    Noisy,
    /// Number of the object that covers most of the pixel.
    ObjectId,
    /// Number of the material that covers most of the pixel.
    MaterialId,
    /// Number of the instance that covers most of the pixel.
    InstanceId,
    /// Cryptomatte of objects.
    CryptoObject,
    /// Cryptomatte of materials.
    CryptoMaterial,
    /// Cryptomatte of assets.
    CryptoAsset,
}

/// Where a layer's numbers come from.
#[derive(Clone, Copy, Debug)]
pub enum Source {
    /// The picture itself.
    Color,
    /// First surfaces: how a sample's values are read, one for each channel, and how those of samples are put together.
    Surface(fn(&SurfaceSample, &mut [f32]), Filtering),
    /// A part of the radiance.
    LightAov(LightAov),
    /// The parts by groups of lights.
    LightGroups,
    /// Counts of the film.
    Film,
    /// Which shapes cover the pixel: made when a file is written.
    Coverage,
    /// A denoiser.
    Denoiser,
}

/// How a pixel's value comes from those of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filtering {
    /// The value of the nearest surface that the pixel's own samples hit: data that has no meaningful mean.
    Nearest,
    /// The mean that the pixel filter gives, as of the picture.
    Mean,
}

/// Channels of all layers of surfaces that are filtered so.
pub(super) const fn channels_of(filtering: Filtering) -> usize {
    let (mut total, mut i) = (0, 0);
    while i < LayerKind::ALL.len() {
        if let Source::Surface(_, other) = LayerKind::ALL[i].source
            && other as u8 == filtering as u8
        {
            total += LayerKind::ALL[i].channels.len();
        }
        i += 1;
    }
    total
}

/// How the values of samples become the channels of layers of surfaces.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceChannels {
    layers: [Option<&'static LayerInfo>; LayerKind::ALL.len()],
    channels: usize,
}

impl SurfaceChannels {
    /// Those of a set that are filtered so, in the table's order.
    pub fn new(set: LayerSet, filtering: Filtering) -> Self {
        let mut layers = [None; LayerKind::ALL.len()];
        layers.iter_mut().zip(set.surfaces(filtering)).for_each(|(layer, info)| *layer = Some(info));
        Self { layers, channels: set.surfaces(filtering).map(|info| info.channels.len()).sum() }
    }

    /// How many there are.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Reads those of a sample; `out` has room for all of them.
    #[inline]
    pub fn read(&self, surface: &SurfaceSample, out: &mut [f32]) {
        let mut start = 0;
        for info in self.layers.iter().map_while(|info| *info) {
            if let Source::Surface(read, _) = info.source {
                read(surface, &mut out[start..start + info.channels.len()]);
            }
            start += info.channels.len();
        }
    }
}

/// What the table says of a layer.
#[derive(Clone, Copy, Debug)]
pub struct LayerInfo {
    /// Which layer.
    pub kind: LayerKind,
    /// The name users ask for it by.
    pub name: &'static str,
    /// Its channels' full names in a file, in the order of the pixel data; of groups of lights what follows their layers' names; none of
    /// layers made from [coverage](Source::Coverage).
    pub channels: &'static [&'static str],
    /// Stored as 32-bit floats whatever the pixel type: 16 bits would spoil it.
    pub always_float: bool,
    /// What the file's comment says of it.
    pub comment: &'static str,
    /// Where its numbers come from.
    pub source: Source,
}

impl LayerInfo {
    const fn new(kind: LayerKind, name: &'static str, channels: &'static [&'static str], source: Source, comment: &'static str) -> Self {
        Self { kind, name, channels, always_float: false, comment, source }
    }

    const fn float(self) -> Self {
        Self { always_float: true, ..self }
    }
}

/// A table's row for a part of the radiance.
macro_rules! part {
    ($part:ident, $name:literal, $comment:literal) => {
        LayerInfo::new(
            LayerKind::$part,
            $name,
            &[concat!($name, ".R"), concat!($name, ".G"), concat!($name, ".B")],
            Source::LightAov(LightAov::$part),
            concat!($name, ": ", $comment),
        )
    };
}

impl LayerKind {
    /// Every layer, in the order of files and of memory.
    pub const ALL: [LayerInfo; 28] = [
        LayerInfo::new(Self::Color, "color", &["R", "G", "B", "A"], Source::Color, ""),
        LayerInfo::new(
            Self::Z,
            "Z",
            &["Z"],
            Source::Surface(|s, out| out[0] = s.depth, Filtering::Nearest),
            "Z: depth along the view axis of the nearest sample; 1e10 where nothing was hit",
        )
        .float(),
        LayerInfo::new(
            Self::N,
            "N",
            &["N.X", "N.Y", "N.Z"],
            Source::Surface(|s, out| out.copy_from_slice(&s.normal.to_array()), Filtering::Nearest),
            "N: shading normal of the nearest sample, world; 0 where nothing was hit",
        ),
        LayerInfo::new(
            Self::Ng,
            "Ng",
            &["Ng.X", "Ng.Y", "Ng.Z"],
            Source::Surface(|s, out| out.copy_from_slice(&s.geometric_normal.to_array()), Filtering::Nearest),
            "Ng: geometric normal of the nearest sample, world; 0 where nothing was hit",
        ),
        LayerInfo::new(
            Self::P,
            "P",
            &["P.X", "P.Y", "P.Z"],
            Source::Surface(|s, out| out.copy_from_slice(&s.position.to_array()), Filtering::Nearest),
            "P: position of the nearest sample, world; 0 where nothing was hit",
        )
        .float(),
        LayerInfo::new(
            Self::Uv,
            "uv",
            &["uv.U", "uv.V"],
            Source::Surface(|s, out| out.copy_from_slice(&s.uv), Filtering::Nearest),
            "uv: surface parameters of the nearest sample; 0 where nothing was hit",
        )
        .float(),
        LayerInfo::new(
            Self::Motion,
            "motion",
            &["motion.X", "motion.Y"],
            Source::Surface(|s, out| out.copy_from_slice(&s.motion), Filtering::Nearest),
            "motion: of the nearest sample, from where the surface is when the shutter opens to where it is when it closes, in pixels to the right and down; without a \
             surface, that of a point infinitely far away",
        )
        .float(),
        LayerInfo::new(
            Self::Albedo,
            "albedo",
            &["albedo.R", "albedo.G", "albedo.B"],
            Source::Surface(|s, out| out.copy_from_slice(&s.albedo.to_array()), Filtering::Mean),
            "albedo: fraction of light scattered by the first surface",
        ),
        part!(DiffuseDirect, "diffuse_direct", "light scattered once, by diffuse reflection"),
        part!(DiffuseIndirect, "diffuse_indirect", "light scattered more than once, last by diffuse reflection"),
        part!(SpecularDirect, "specular_direct", "light scattered once, by specular reflection"),
        part!(SpecularIndirect, "specular_indirect", "light scattered more than once, last by specular reflection"),
        part!(TransmissionDirect, "transmission_direct", "light scattered once, through a surface"),
        part!(TransmissionIndirect, "transmission_indirect", "light scattered more than once, last through a surface"),
        part!(Emission, "emission", "light given off by what is seen; sums with the seven others to RGB"),
        part!(Background, "background", "light from infinity that is seen directly"),
        LayerInfo::new(
            Self::LightGroups,
            "light_groups",
            &["R", "G", "B"],
            Source::LightGroups,
            "light_*: what each group of lights gives; they sum to RGB",
        ),
        LayerInfo::new(
            Self::Variance,
            "variance",
            &["variance.R", "variance.G", "variance.B"],
            Source::Film,
            "variance: of the filtered picture's R, G and B, their expected squared error",
        )
        .float(),
        LayerInfo::new(Self::Samples, "samples", &["stats.samples"], Source::Film, "stats.samples: samples of the pixel").float(),
        LayerInfo::new(
            Self::FeatureAlbedo,
            "feature_albedo",
            &["feature_albedo.R", "feature_albedo.G", "feature_albedo.B"],
            Source::Surface(|s, out| out.copy_from_slice(&s.feature_albedo.to_array()), Filtering::Mean),
            "feature_albedo: fraction of light scattered by the first surface that is no mirror and no clear glass",
        ),
        LayerInfo::new(
            Self::FeatureNormal,
            "feature_normal",
            &["feature_normal.X", "feature_normal.Y", "feature_normal.Z"],
            Source::Surface(|s, out| out.copy_from_slice(&s.feature_normal.to_array()), Filtering::Mean),
            "feature_normal: mean shading normal of that surface, world, not of unit length",
        ),
        LayerInfo::new(
            Self::Noisy,
            "noisy",
            &["noisy.R", "noisy.G", "noisy.B", "noisy.A"],
            Source::Denoiser,
            "noisy: the picture before it was denoised",
        ),
        LayerInfo::new(
            Self::ObjectId,
            "object_id",
            &["object_id.id"],
            Source::Coverage,
            "object_id: the object that covers most of the pixel",
        )
        .float(),
        LayerInfo::new(
            Self::MaterialId,
            "material_id",
            &["material_id.id"],
            Source::Coverage,
            "material_id: the material that covers most of the pixel",
        )
        .float(),
        LayerInfo::new(
            Self::InstanceId,
            "instance_id",
            &["instance_id.id"],
            Source::Coverage,
            "instance_id: the instance that covers most of the pixel",
        )
        .float(),
        LayerInfo::new(Self::CryptoObject, "crypto_object", &[], Source::Coverage, "").float(),
        LayerInfo::new(Self::CryptoMaterial, "crypto_material", &[], Source::Coverage, "").float(),
        LayerInfo::new(Self::CryptoAsset, "crypto_asset", &[], Source::Coverage, "").float(),
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
            LayerDesc::Ng => Self::Ng,
            LayerDesc::P => Self::P,
            LayerDesc::Uv => Self::Uv,
            LayerDesc::Motion => Self::Motion,
            LayerDesc::Albedo => Self::Albedo,
            LayerDesc::DiffuseDirect => Self::DiffuseDirect,
            LayerDesc::DiffuseIndirect => Self::DiffuseIndirect,
            LayerDesc::SpecularDirect => Self::SpecularDirect,
            LayerDesc::SpecularIndirect => Self::SpecularIndirect,
            LayerDesc::TransmissionDirect => Self::TransmissionDirect,
            LayerDesc::TransmissionIndirect => Self::TransmissionIndirect,
            LayerDesc::Emission => Self::Emission,
            LayerDesc::Background => Self::Background,
            LayerDesc::LightGroups => Self::LightGroups,
            LayerDesc::Variance => Self::Variance,
            LayerDesc::Samples => Self::Samples,
            LayerDesc::FeatureAlbedo => Self::FeatureAlbedo,
            LayerDesc::FeatureNormal => Self::FeatureNormal,
            LayerDesc::ObjectId => Self::ObjectId,
            LayerDesc::MaterialId => Self::MaterialId,
            LayerDesc::InstanceId => Self::InstanceId,
            LayerDesc::CryptoObject => Self::CryptoObject,
            LayerDesc::CryptoMaterial => Self::CryptoMaterial,
            LayerDesc::CryptoAsset => Self::CryptoAsset,
        }
    }
}

/// A set of layers. The colour is always part of it. Serialized as the list of their names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "Vec<&'static str>", try_from = "Vec<String>")]
pub struct LayerSet {
    bits: u32,
}

/// The layers, as bits, whose source a test accepts.
macro_rules! layers_from {
    ($source:pat) => {{
        let (mut bits, mut i) = (0u32, 0);
        while i < LayerKind::ALL.len() {
            bits |= (matches!(LayerKind::ALL[i].source, $source) as u32) << i;
            i += 1;
        }
        bits
    }};
}

impl LayerSet {
    /// Only the colour.
    pub const COLOR: Self = Self { bits: 0 };
    /// Every layer that a render fills.
    pub const FULL: Self = Self { bits: ((1 << LayerKind::ALL.len()) - 1) & !layers_from!(Source::Denoiser) & !Self::COLOR_BIT };
    /// Never set, so that equal sets have equal bits.
    const COLOR_BIT: u32 = 1 << LayerKind::Color as u32;

    /// Adds a layer.
    pub const fn insert(&mut self, kind: LayerKind) {
        self.bits |= (1 << kind as u32) & !Self::COLOR_BIT;
    }

    /// Whether the layer is part of the set.
    #[inline]
    pub const fn contains(self, kind: LayerKind) -> bool {
        matches!(kind, LayerKind::Color) || self.bits & (1 << kind as u32) != 0
    }

    /// Whether any layer is part of the set that [`SurfaceSample`] is needed for.
    #[inline]
    pub const fn needs_surface(self) -> bool {
        self.bits & layers_from!(Source::Surface(..) | Source::Coverage) != 0
    }

    /// Whether any layer is part of the set that needs the shapes that samples show.
    #[inline]
    pub const fn needs_coverage(self) -> bool {
        self.bits & layers_from!(Source::Coverage) != 0
    }

    /// Whether any layer is part of the set that is a [`LightAov`] of the radiance.
    #[inline]
    pub const fn needs_light_aovs(self) -> bool {
        self.bits & layers_from!(Source::LightAov(_)) != 0
    }

    /// The layers of first surfaces that are filtered so, in the table's order.
    pub fn surfaces(self, filtering: Filtering) -> impl Iterator<Item = &'static LayerInfo> {
        self.iter().filter(move |info| matches!(info.source, Source::Surface(_, other) if other == filtering))
    }

    /// All layers, in the table's order.
    pub fn iter(self) -> impl Iterator<Item = &'static LayerInfo> {
        LayerKind::ALL.iter().filter(move |info| self.contains(info.kind))
    }
}

impl From<LayerSet> for Vec<&'static str> {
    fn from(set: LayerSet) -> Self {
        set.iter().map(|info| info.name).collect()
    }
}

impl TryFrom<Vec<String>> for LayerSet {
    type Error = String;

    fn try_from(names: Vec<String>) -> Result<Self, String> {
        let kind = |name: String| {
            let info = LayerKind::ALL.iter().find(|info| info.name == name);
            info.map(|info| info.kind).ok_or_else(|| format!("unknown layer `{name}`"))
        };
        names.into_iter().map(kind).collect()
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
    fn sets_come_back_from_their_names() {
        for set in [LayerSet::COLOR, LayerSet::FULL, [LayerKind::Color, LayerKind::Z].into_iter().collect()] {
            let value = serde_json::to_value(set).unwrap();
            assert_eq!(serde_json::from_value::<LayerSet>(value).unwrap(), set);
        }
        assert_eq!([LayerKind::Color].into_iter().collect::<LayerSet>(), LayerSet::COLOR);
        assert!(serde_json::from_str::<LayerSet>(r#"["none"]"#).is_err());
    }

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
        assert_eq!([LayerDesc::Albedo, LayerDesc::Samples].iter().collect::<LayerSet>().surfaces(Filtering::Mean).count(), 1);
        assert!(!LayerSet::from_iter(&[LayerDesc::Variance, LayerDesc::Samples]).needs_surface());
        assert_eq!(LayerSet::FULL.iter().count(), LayerKind::ALL.len() - 1);
        assert!(LayerSet::from_iter(&[LayerDesc::CryptoObject]).needs_coverage() && !set.needs_coverage());
        assert!(LayerSet::from_iter(&[LayerDesc::Emission]).needs_light_aovs() && !set.needs_light_aovs());
    }
}
