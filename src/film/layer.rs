//! The layers of a picture: one table from kind to name, channels and what fills them.

use serde::{Deserialize, Serialize};

use super::{LightAov, SurfaceSample};
use crate::color::Rgb;
use crate::desc::LayerKind;

/// Where a layer's numbers come from.
#[derive(Clone, Copy, Debug)]
pub enum LayerSource {
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
    while i < LayerInfo::ALL.len() {
        if let LayerSource::Surface(_, other) = LayerInfo::ALL[i].source
            && other as u8 == filtering as u8
        {
            total += LayerInfo::ALL[i].channels.len();
        }
        i += 1;
    }
    total
}

/// Most layers of surfaces that are averaged: each has three channels.
pub(super) const MAX_MEANS: usize = channels_of(Filtering::Mean) / 3;

/// How the values of samples become the channels of layers of surfaces.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfaceChannels {
    layers: [Option<&'static LayerInfo>; LayerInfo::ALL.len()],
    channels: usize,
}

impl SurfaceChannels {
    /// Those of a set that are filtered so, in the table's order.
    pub fn new(set: LayerSet, filtering: Filtering) -> Self {
        let mut layers = [None; LayerInfo::ALL.len()];
        layers.iter_mut().zip(set.surfaces(filtering)).for_each(|(layer, info)| *layer = Some(info));
        Self { layers, channels: set.surfaces(filtering).map(|info| info.channels.len()).sum() }
    }

    /// How many there are.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// How the channels of each layer are read.
    #[inline]
    pub fn readers(&self) -> impl Iterator<Item = fn(&SurfaceSample, &mut [f32])> {
        self.layers.iter().map_while(|info| *info).filter_map(|info| match info.source {
            LayerSource::Surface(read, _) => Some(read),
            _ => None,
        })
    }

    /// Reads those of a sample; `out` has room for all of them.
    #[inline]
    pub fn read(&self, surface: &SurfaceSample, mut out: &mut [f32]) {
        for (info, read) in self.layers.iter().flatten().zip(self.readers()) {
            let (values, rest) = out.split_at_mut(info.channels.len());
            read(surface, values);
            out = rest;
        }
    }

    /// Reads those of layers that are averaged; layers that there are not are black.
    #[inline]
    pub fn means(&self, surface: &SurfaceSample) -> [Rgb; MAX_MEANS] {
        let mut means = [[0.0; 3]; MAX_MEANS];
        means.iter_mut().zip(self.readers()).for_each(|(mean, read)| read(surface, mean));
        means.map(Rgb::from)
    }
}

/// A row of the table of layers.
#[derive(Clone, Copy, Debug)]
pub struct LayerInfo {
    /// Which layer.
    pub kind: LayerKind,
    /// Its name in scene files and on the command line.
    pub name: &'static str,
    /// Its channels' full names in a file, in the order of the pixel data; of groups of lights what follows their
    /// layers' names; none of layers made from [coverage](LayerSource::Coverage).
    pub channels: &'static [&'static str],
    /// Stored as 32-bit floats whatever the pixel type: 16 bits would spoil it.
    pub always_float: bool,
    /// Its description in the file's comment.
    pub comment: &'static str,
    /// Where its numbers come from.
    #[doc(hidden)]
    pub source: LayerSource,
}

impl LayerInfo {
    const fn new(
        kind: LayerKind,
        name: &'static str,
        channels: &'static [&'static str],
        source: LayerSource,
        comment: &'static str,
    ) -> Self {
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
            LayerSource::LightAov(LightAov::$part),
            concat!($name, ": ", $comment),
        )
    };
}

impl LayerInfo {
    /// Every layer, in the order of files and of memory.
    pub const ALL: [Self; 30] = [
        Self::new(LayerKind::Color, "color", &["R", "G", "B", "A"], LayerSource::Color, ""),
        Self::new(
            LayerKind::Z,
            "Z",
            &["Z"],
            LayerSource::Surface(|s, out| out[0] = s.depth, Filtering::Nearest),
            "Z: depth along the view axis of the nearest sample; 1e10 where nothing was hit",
        )
        .float(),
        Self::new(
            LayerKind::N,
            "N",
            &["N.X", "N.Y", "N.Z"],
            LayerSource::Surface(|s, out| out.copy_from_slice(&s.normal.to_array()), Filtering::Nearest),
            "N: shading normal of the nearest sample, world; 0 where nothing was hit",
        ),
        Self::new(
            LayerKind::Ng,
            "Ng",
            &["Ng.X", "Ng.Y", "Ng.Z"],
            LayerSource::Surface(|s, out| out.copy_from_slice(&s.geometric_normal.to_array()), Filtering::Nearest),
            "Ng: geometric normal of the nearest sample, world; 0 where nothing was hit",
        ),
        Self::new(
            LayerKind::P,
            "P",
            &["P.X", "P.Y", "P.Z"],
            LayerSource::Surface(|s, out| out.copy_from_slice(&s.position.to_array()), Filtering::Nearest),
            "P: position of the nearest sample, world; 0 where nothing was hit",
        )
        .float(),
        Self::new(
            LayerKind::Uv,
            "uv",
            &["uv.U", "uv.V"],
            LayerSource::Surface(|s, out| out.copy_from_slice(&s.uv), Filtering::Nearest),
            "uv: surface parameters of the nearest sample; 0 where nothing was hit",
        )
        .float(),
        Self::new(
            LayerKind::Motion,
            "motion",
            &["motion.X", "motion.Y"],
            LayerSource::Surface(|s, out| out.copy_from_slice(&s.motion), Filtering::Nearest),
            "motion: of the nearest sample, from where the surface is when the shutter opens to where it is when it \
             closes, in pixels to the right and down; without a surface, that of a point infinitely far away",
        )
        .float(),
        Self::new(
            LayerKind::Albedo,
            "albedo",
            &["albedo.R", "albedo.G", "albedo.B"],
            LayerSource::Surface(|s, out| out.copy_from_slice(&s.albedo.to_array()), Filtering::Mean),
            "albedo: fraction of light scattered by the first surface",
        ),
        part!(DiffuseDirect, "diffuse_direct", "light scattered once, by diffuse reflection"),
        part!(DiffuseIndirect, "diffuse_indirect", "light scattered more than once, last by diffuse reflection"),
        part!(SpecularDirect, "specular_direct", "light scattered once, by specular reflection"),
        part!(SpecularIndirect, "specular_indirect", "light scattered more than once, last by specular reflection"),
        part!(TransmissionDirect, "transmission_direct", "light scattered once, through a surface"),
        part!(TransmissionIndirect, "transmission_indirect", "light scattered more than once, last through a surface"),
        part!(VolumeDirect, "volume_direct", "light scattered once, by a medium"),
        part!(VolumeIndirect, "volume_indirect", "light scattered more than once, last by a medium"),
        part!(Emission, "emission", "light emitted by what is seen; sums with the nine others to RGB"),
        part!(Background, "background", "light from infinity that is seen directly"),
        Self::new(
            LayerKind::LightGroups,
            "light_groups",
            &["R", "G", "B"],
            LayerSource::LightGroups,
            "light_*: what each group of lights gives; they sum to RGB",
        ),
        Self::new(
            LayerKind::Variance,
            "variance",
            &["variance.R", "variance.G", "variance.B"],
            LayerSource::Film,
            "variance: of the filtered picture's R, G and B, their expected squared error",
        )
        .float(),
        Self::new(
            LayerKind::Samples,
            "samples",
            &["stats.samples"],
            LayerSource::Film,
            "stats.samples: samples of the pixel",
        )
        .float(),
        Self::new(
            LayerKind::FeatureAlbedo,
            "feature_albedo",
            &["feature_albedo.R", "feature_albedo.G", "feature_albedo.B"],
            LayerSource::Surface(|s, out| out.copy_from_slice(&s.feature_albedo.to_array()), Filtering::Mean),
            "feature_albedo: fraction of light scattered by the first surface that is no mirror and no clear glass",
        ),
        Self::new(
            LayerKind::FeatureNormal,
            "feature_normal",
            &["feature_normal.X", "feature_normal.Y", "feature_normal.Z"],
            LayerSource::Surface(|s, out| out.copy_from_slice(&s.feature_normal.to_array()), Filtering::Mean),
            "feature_normal: mean shading normal of that surface, world, not of unit length",
        ),
        Self::new(
            LayerKind::Noisy,
            "noisy",
            &["noisy.R", "noisy.G", "noisy.B", "noisy.A"],
            LayerSource::Denoiser,
            "noisy: the picture before it was denoised",
        ),
        Self::new(
            LayerKind::ObjectId,
            "object_id",
            &["object_id.id"],
            LayerSource::Coverage,
            "object_id: the object that covers most of the pixel",
        )
        .float(),
        Self::new(
            LayerKind::MaterialId,
            "material_id",
            &["material_id.id"],
            LayerSource::Coverage,
            "material_id: the material that covers most of the pixel",
        )
        .float(),
        Self::new(
            LayerKind::InstanceId,
            "instance_id",
            &["instance_id.id"],
            LayerSource::Coverage,
            "instance_id: the instance that covers most of the pixel",
        )
        .float(),
        Self::new(LayerKind::CryptoObject, "crypto_object", &[], LayerSource::Coverage, "").float(),
        Self::new(LayerKind::CryptoMaterial, "crypto_material", &[], LayerSource::Coverage, "").float(),
        Self::new(LayerKind::CryptoAsset, "crypto_asset", &[], LayerSource::Coverage, "").float(),
    ];

    /// The row of a layer.
    #[inline]
    pub const fn of(kind: LayerKind) -> &'static Self {
        // The table is in the order of the variants; a test holds it to that.
        &Self::ALL[kind as usize]
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
        while i < LayerInfo::ALL.len() {
            bits |= (matches!(LayerInfo::ALL[i].source, $source) as u32) << i;
            i += 1;
        }
        bits
    }};
}

impl LayerSet {
    /// Only the colour.
    pub const COLOR: Self = Self { bits: 0 };
    /// Every layer that a render fills.
    pub const FULL: Self =
        Self { bits: ((1 << LayerInfo::ALL.len()) - 1) & !layers_from!(LayerSource::Denoiser) & !Self::COLOR_BIT };
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
        self.bits & layers_from!(LayerSource::Surface(..) | LayerSource::Coverage) != 0
    }

    /// Whether any layer is part of the set that needs the shapes that samples show.
    #[inline]
    pub const fn needs_coverage(self) -> bool {
        self.bits & layers_from!(LayerSource::Coverage) != 0
    }

    /// Whether any layer is part of the set that is a [`LightAov`] of the radiance.
    #[inline]
    pub const fn needs_light_aovs(self) -> bool {
        self.bits & layers_from!(LayerSource::LightAov(_)) != 0
    }

    /// The layers of first surfaces that are filtered so, in the table's order.
    #[doc(hidden)]
    pub fn surfaces(self, filtering: Filtering) -> impl Iterator<Item = &'static LayerInfo> {
        self.iter().filter(move |info| matches!(info.source, LayerSource::Surface(_, other) if other == filtering))
    }

    /// All layers, in the table's order.
    pub fn iter(self) -> impl Iterator<Item = &'static LayerInfo> {
        LayerInfo::ALL.iter().filter(move |info| self.contains(info.kind))
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
            let info = LayerInfo::ALL.iter().find(|info| info.name == name);
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

impl<'a> FromIterator<&'a LayerKind> for LayerSet {
    fn from_iter<I: IntoIterator<Item = &'a LayerKind>>(descs: I) -> Self {
        descs.into_iter().copied().collect()
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
        for (i, info) in LayerInfo::ALL.iter().enumerate() {
            assert_eq!(info.kind as usize, i);
            assert_eq!(LayerInfo::of(info.kind).name, info.name);
            // Scenes do not name the others.
            if !matches!(info.source, LayerSource::Color | LayerSource::Denoiser) {
                assert_eq!(serde_json::to_value(info.kind).unwrap(), info.name);
            }
        }
    }

    #[test]
    fn a_set_holds_what_was_put_in_and_always_the_colour() {
        let set: LayerSet = [LayerKind::P, LayerKind::Z].into_iter().collect();
        assert_eq!(
            set.iter().map(|info| info.kind).collect::<Vec<_>>(),
            [LayerKind::Color, LayerKind::Z, LayerKind::P]
        );
        assert!(set.needs_surface() && !LayerSet::COLOR.needs_surface());
        assert!(LayerSet::COLOR.contains(LayerKind::Color));
        assert_eq!(
            [LayerKind::Albedo, LayerKind::Samples].iter().collect::<LayerSet>().surfaces(Filtering::Mean).count(),
            1
        );
        assert!(!LayerSet::from_iter(&[LayerKind::Variance, LayerKind::Samples]).needs_surface());
        assert_eq!(LayerSet::FULL.iter().count(), LayerInfo::ALL.len() - 1);
        assert!(LayerSet::from_iter(&[LayerKind::CryptoObject]).needs_coverage() && !set.needs_coverage());
        assert!(LayerSet::from_iter(&[LayerKind::Emission]).needs_light_aovs() && !set.needs_light_aovs());
    }
}
