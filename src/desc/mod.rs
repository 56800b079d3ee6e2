//! What the user writes: the scene file as plain data. The doc comments here are the manual of the format, and its JSON
//! Schema (`steradian schema`) is made from the same types.
//!
//! World: right-handed, +Y up by custom; the camera looks along its local -Z with +Y up. Angles are in degrees, as
//! their names end. Colours are linear Rec.709. Unknown keys are errors. Comments (`//` and `/* */`) and
//! commas behind the last entry are allowed; a list of one entry may be the entry alone, a grey one number.

mod build;
mod camera;
mod curves;
mod files;
mod hair;
mod light;
mod lists;
mod material;
mod medium;
mod mesh;
mod output;
mod principled;
mod relief;
mod settings;
mod shape;
mod subdivision;
mod texture;
mod transform;
mod used;

pub use camera::{BladesDesc, CameraDesc, CameraKindDesc, LensDesc};
pub use curves::{CurveBasisDesc, CurveKindDesc};
pub use files::NamedFile;
pub use hair::{HairDesc, HairIor, HairRoughness, HairTilt};
pub use light::{
    DirectionalLightDesc, EmissionDesc, EnvironmentLightDesc, IesLightDesc, LightDesc, LightSamplerDesc,
    PointLightDesc, ProjectorLightDesc, SpotLightDesc,
};
pub use material::{
    ColorDesc, DielectricDesc, DistributionDesc, MaterialDesc, PhongLobeDesc, PlasticDesc, RangedDesc, RoughnessDesc,
    ScalarDesc,
};
pub use medium::{AbsorptionDesc, BorderDesc, CoefficientDesc, MediumDesc, MediumVolumeDesc, PhaseDesc, VolumeDesc};
pub use mesh::{AttributeDesc, MeshShadingDesc, NormalWeightDesc, SmoothByDesc};
pub use output::{CompressionDesc, CryptoManifestDesc, ExrProfileDesc, LayerKind, OutputDesc, PixelTypeDesc, ViewDesc};
pub(crate) use principled::principled_parameters;
pub use principled::{PrincipledDesc, PrincipledModelDesc, SubsurfaceMethodDesc};
pub use relief::{BumpMapDesc, NormalMapDesc};
pub use settings::{
    AutoDesc, CausticsDesc, DEFAULT_RR_DEPTH, FilmDesc, FilterDesc, FilterSamplesDesc, IntegratorDesc,
    MAX_FILTER_RADIUS, MAX_SIDE, RouletteDesc, SamplerDesc, SamplerKindDesc, StrategyDesc,
};
pub use shape::{
    ConeDesc, CubeDesc, CurvesDesc, CylinderDesc, DiskDesc, InstanceDesc, MeshDesc, ObjectDesc, OpacityDesc, PlaneDesc,
    PointsDesc, ProfileDesc, ProfileParameterDesc, QuadDesc, RevolutionDesc, ShapeCommon, ShapeCommonMut, ShapeDesc,
    SphereDesc,
};
pub use subdivision::{
    BoundaryDesc, CornerDesc, CreaseDesc, DisplacementDesc, DisplacementSpaceDesc, SubdivisionDesc,
    SubdivisionSchemeDesc, SubdivisionUvsDesc,
};
pub use texture::{ChannelDesc, ColorSpaceDesc, TextureDesc, TextureFilterDesc, WrapDesc, WrapModeDesc};
pub use transform::{KeyframeDesc, ScaleDesc, TransformDesc, TransformStepDesc};
pub use used::UsedNames;

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use schemars::JsonSchema;
use serde::de::{Error as _, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use lists::{OneOrMore, object, one_or_more};

/// A scene: what to render, how, and where to write it.
#[derive(Clone, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneDesc {
    /// Link to the JSON Schema, for editors; not used otherwise.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Free text.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
    /// Size of the picture and the pixel filter.
    #[serde(default, deserialize_with = "object")]
    pub film: FilmDesc,
    /// The camera.
    #[serde(deserialize_with = "object")]
    pub camera: CameraDesc,
    /// The algorithm.
    #[serde(default)]
    pub integrator: IntegratorDesc,
    /// Samples per pixel and how they are chosen.
    #[serde(default, deserialize_with = "object")]
    pub sampler: SamplerDesc,
    /// Textures by name.
    #[serde(default, deserialize_with = "unique_names", skip_serializing_if = "BTreeMap::is_empty")]
    pub textures: BTreeMap<String, TextureDesc>,
    /// Materials by name.
    #[serde(default, deserialize_with = "unique_names", skip_serializing_if = "BTreeMap::is_empty")]
    pub materials: BTreeMap<String, MaterialDesc>,
    /// Participating media by name.
    #[serde(default, deserialize_with = "unique_names", skip_serializing_if = "BTreeMap::is_empty")]
    pub media: BTreeMap<String, MediumDesc>,
    /// The medium that is around everything, by its name in `media`: fog, water, air. Of lights at infinity nothing
    /// gets through it, unless it absorbs and scatters nothing. Default: empty space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub medium: Option<String>,
    /// Shapes in the world.
    #[serde(default, deserialize_with = "one_or_more", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "OneOrMore<ShapeDesc>")]
    pub shapes: Vec<ShapeDesc>,
    /// Objects by name: groups of shapes that are drawn only where an instance places them.
    #[serde(default, deserialize_with = "unique_names", skip_serializing_if = "BTreeMap::is_empty")]
    pub objects: BTreeMap<String, ObjectDesc>,
    /// Placements of objects in the world.
    #[serde(default, deserialize_with = "one_or_more", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "OneOrMore<InstanceDesc>")]
    pub instances: Vec<InstanceDesc>,
    /// Lights that are not shapes. (A shape becomes a light by its `emission`.)
    #[serde(default, deserialize_with = "one_or_more", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "OneOrMore<LightDesc>")]
    pub lights: Vec<LightDesc>,
    /// How one light among several is chosen for a light sample. Default: tree.
    #[serde(default, skip_serializing_if = "LightSamplerDesc::is_default")]
    pub light_sampler: LightSamplerDesc,
    /// Files to write, each by its name alone or with more keys; the command line's `-o` replaces them.
    #[serde(default, deserialize_with = "output::outputs", skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "OneOrMore<output::OutputEntrySchema>")]
    pub outputs: Vec<OutputDesc>,
}

impl SceneDesc {
    /// The shapes of the world and of all objects that are used, each with its place.
    pub fn used_shapes<'a>(&'a self, used: &'a UsedNames) -> impl Iterator<Item = (String, &'a ShapeDesc)> {
        let world = self.shapes.iter().enumerate().map(|(i, shape)| (format!("shapes[{i}]"), shape));
        let objects =
            self.objects.iter().filter(|(name, _)| used.objects.contains(*name)).flat_map(|(name, object)| {
                object.shapes.iter().enumerate().map(move |(i, shape)| (format!("objects.{name}.shapes[{i}]"), shape))
            });
        world.chain(objects)
    }
}

/// A map whose names differ; JSON itself would let the last of two win.
fn unique_names<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<BTreeMap<String, T>, D::Error> {
    struct Names<T>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>> Visitor<'de> for Names<T> {
        type Value = BTreeMap<String, T>;

        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            f.write_str("an object of names")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
            let mut map = BTreeMap::new();
            while let Some(name) = entries.next_key::<String>()? {
                let value = entries.next_value()?;
                if map.contains_key(&name) {
                    return Err(A::Error::custom(format_args!("the name \"{name}\" is given twice")));
                }
                map.insert(name, value);
            }
            Ok(map)
        }
    }

    deserializer.deserialize_map(Names(PhantomData))
}
