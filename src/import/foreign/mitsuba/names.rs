//! Names in Mitsuba 3: plugins and indices of refraction.

use crate::suggestion::did_you_mean;

/// Plugins of Mitsuba 3.9 by class; names of Mitsuba 0.6 that it still reads included.
const PLUGINS: &[(&str, &[&str])] = &[
    (
        "integrator",
        &[
            "path",
            "direct",
            "volpath",
            "volpathmis",
            "moment",
            "aov",
            "depth",
            "ptracer",
            "stokes",
            "prb",
            "prb_basic",
            "prbvolpath",
            "direct_projective",
            "prb_projective",
            "emission_direct",
            "volprim_rf_basic",
        ],
    ),
    ("sensor", &["perspective", "thinlens", "orthographic", "radiancemeter", "irradiancemeter", "distant", "batch"]),
    ("film", &["hdrfilm", "specfilm"]),
    ("sampler", &["independent", "multijitter", "stratified", "orthogonal", "ldsampler"]),
    ("rfilter", &["box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"]),
    (
        "bsdf",
        &[
            "diffuse",
            "conductor",
            "roughconductor",
            "dielectric",
            "roughdielectric",
            "thindielectric",
            "plastic",
            "roughplastic",
            "principled",
            "principledthin",
            "twosided",
            "mask",
            "normalmap",
            "bumpmap",
            "blendbsdf",
            "null",
            "measured",
            "measured_polarized",
            "circular",
            "hair",
            "polarizer",
            "retarder",
            "pplastic",
        ],
    ),
    (
        "emitter",
        &[
            "area",
            "point",
            "spot",
            "directional",
            "directionalarea",
            "constant",
            "envmap",
            "projector",
            "sunsky",
            "timed_sunsky",
            "sky",
            "sun",
        ],
    ),
    (
        "shape",
        &[
            "obj",
            "ply",
            "serialized",
            "rectangle",
            "cube",
            "sphere",
            "disk",
            "cylinder",
            "instance",
            "shapegroup",
            "merge",
            "blender",
            "bsplinecurve",
            "linearcurve",
            "sdfgrid",
            "ellipsoids",
            "ellipsoidsmesh",
        ],
    ),
    ("texture", &["bitmap", "checkerboard", "rawconstant", "mesh_attribute", "volume"]),
    ("volume", &["constvolume", "gridvolume"]),
    ("medium", &["homogeneous", "heterogeneous"]),
    ("phase", &["isotropic", "hg", "rayleigh", "sggx", "tabphase", "blendphase"]),
    ("spectrum", &["uniform", "regular", "irregular", "srgb", "d65", "blackbody", "rawconstant"]),
];

/// Rejects the name of a plugin that does not exist, with an error message.
pub fn check(class: &str, kind: &str) -> Result<(), String> {
    let known = PLUGINS.iter().find(|(name, _)| *name == class).map_or(&[][..], |(_, kinds)| *kinds);
    if known.contains(&kind) {
        return Ok(());
    }
    let hint = did_you_mean(kind, known.iter().copied(), ["\"", "\""]);
    Err(format!("Mitsuba has no {class} of the type \"{kind}\"{hint}"))
}

/// Indices of refraction that Mitsuba has names for (Hecht, Optics, at 589 nm).
pub const INDICES: &[(&str, f64)] = &[
    ("vacuum", 1.0),
    ("helium", 1.000036),
    ("hydrogen", 1.000132),
    ("air", 1.000277),
    ("carbon dioxide", 1.00045),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.52045),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

/// The index of refraction of a name; or an error message.
pub fn index(name: &str) -> Result<f64, String> {
    let lower = name.to_lowercase();
    let found = INDICES.iter().find(|(known, _)| *known == lower).map(|(_, index)| *index);
    let hint = || did_you_mean(name, INDICES.iter().map(|(known, _)| *known), ["\"", "\""]);
    found.ok_or_else(|| format!("no index of refraction is known for \"{name}\"{}", hint()))
}
