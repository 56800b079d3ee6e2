//! Words of other programs for types, keys and names of scene files.

/// A word of other programs, and those of the scene format that it may stand for, the likeliest first.
type Synonym = (&'static str, &'static [&'static str]);

/// Types, values and keys, in lower case without `_`, `-` and spaces.
const SYNONYMS: &[Synonym] = &[
    // Materials.
    ("glass", &["dielectric"]),
    ("roughglass", &["dielectric"]),
    ("roughdielectric", &["dielectric"]),
    ("water", &["dielectric"]),
    ("refractive", &["dielectric"]),
    ("thinglass", &["thin_dielectric"]),
    ("metal", &["conductor", "metallic"]),
    ("metallic", &["conductor"]),
    ("roughconductor", &["conductor"]),
    ("coatedconductor", &["coated"]),
    ("coateddiffuse", &["plastic"]),
    ("gold", &["conductor"]),
    ("silver", &["conductor"]),
    ("copper", &["conductor"]),
    ("brass", &["conductor"]),
    ("aluminium", &["conductor"]),
    ("roughplastic", &["plastic"]),
    ("glossy", &["plastic"]),
    ("matte", &["diffuse"]),
    ("lambert", &["diffuse"]),
    ("lambertian", &["diffuse"]),
    ("orennayar", &["diffuse"]),
    ("translucent", &["diffuse_transmission"]),
    ("specular", &["mirror"]),
    ("reflective", &["mirror"]),
    ("disney", &["principled"]),
    ("principledbsdf", &["principled"]),
    ("pbr", &["principled"]),
    ("standard", &["principled"]),
    ("uber", &["principled"]),
    ("clearcoat", &["coated"]),
    ("blend", &["mix"]),
    ("bumpmap", &["bump_map", "relief"]),
    ("normalmap", &["normal_map", "relief"]),
    ("twosided", &["two_sided"]),
    ("blinn", &["phong"]),
    // Shapes.
    ("rectangle", &["quad"]),
    ("square", &["quad"]),
    ("rect", &["quad"]),
    ("parallelogram", &["quad"]),
    ("box", &["cube"]),
    ("ring", &["disk"]),
    ("circle", &["disk"]),
    ("ball", &["sphere"]),
    ("obj", &["mesh"]),
    ("ply", &["mesh"]),
    ("trianglemesh", &["mesh"]),
    ("trimesh", &["mesh"]),
    ("plymesh", &["mesh"]),
    ("bilinearmesh", &["mesh"]),
    ("model", &["mesh"]),
    ("triangle", &["mesh"]),
    ("lathe", &["revolution"]),
    ("ground", &["plane"]),
    ("floor", &["plane"]),
    // Lights.
    ("envmap", &["environment"]),
    ("environmentmap", &["environment"]),
    ("constant", &["environment"]),
    ("hdri", &["environment"]),
    ("hdr", &["environment"]),
    ("infinite", &["environment"]),
    ("sky", &["environment"]),
    ("skybox", &["environment"]),
    ("dome", &["environment"]),
    ("background", &["environment"]),
    ("sun", &["directional"]),
    ("distant", &["directional"]),
    ("parallel", &["directional"]),
    ("omni", &["point"]),
    ("pointlight", &["point"]),
    ("spotlight", &["spot"]),
    ("directionallight", &["directional"]),
    ("sunlight", &["directional"]),
    // Textures.
    ("bitmap", &["image"]),
    ("imagemap", &["image"]),
    ("checkerboard", &["checker"]),
    ("multiply", &["product"]),
    // Cameras, integrators and samplers.
    ("pinhole", &["perspective"]),
    ("thinlens", &["perspective"]),
    ("ortho", &["orthographic"]),
    ("spherical", &["environment"]),
    ("pathtracer", &["path"]),
    ("pt", &["path"]),
    ("volpath", &["path"]),
    ("ao", &["ambient_occlusion"]),
    ("normals", &["normal", "shading_normal"]),
    ("random", &["independent"]),
    ("halton", &["sobol"]),
    ("stratified", &["sobol"]),
    // Keys of the camera and of the picture.
    ("fov", &["vertical_fov_degrees"]),
    ("vfov", &["vertical_fov_degrees"]),
    ("fovy", &["vertical_fov_degrees"]),
    ("yfov", &["vertical_fov_degrees"]),
    ("verticalfov", &["vertical_fov_degrees"]),
    ("fieldofview", &["vertical_fov_degrees"]),
    ("angle", &["vertical_fov_degrees", "cutoff_angle_degrees", "rotation_degrees"]),
    ("eye", &["position"]),
    ("origin", &["position", "transform"]),
    ("from", &["position"]),
    ("location", &["position"]),
    ("pos", &["position", "transform", "point"]),
    ("target", &["look_at"]),
    ("lookat", &["look_at"]),
    ("to", &["look_at"]),
    ("upvector", &["up"]),
    ("at", &["look_at"]),
    ("aperture", &["radius", "lens"]),
    ("lensradius", &["radius", "lens"]),
    ("focaldistance", &["focus_distance", "lens"]),
    ("fstop", &["f_number", "lens"]),
    ("resolution", &["width"]),
    ("size", &["width", "radius", "scale", "transform"]),
    ("samples", &["spp"]),
    ("samplesperpixel", &["spp"]),
    ("samplecount", &["spp"]),
    ("depth", &["max_depth", "Z"]),
    ("position", &["P"]),
    ("normal", &["N"]),
    ("bounces", &["max_depth"]),
    ("maxbounces", &["max_depth"]),
    ("background", &["lights"]),
    ("objects", &["shapes"]),
    ("geometry", &["shapes"]),
    ("primitives", &["shapes"]),
    ("meshes", &["shapes"]),
    ("emitters", &["lights"]),
    ("bsdfs", &["materials"]),
    ("sensor", &["camera"]),
    ("output", &["outputs"]),
    // Keys of shapes and lights.
    ("center", &["position", "transform", "point"]),
    ("centre", &["position", "transform", "point"]),
    ("position", &["transform", "origin", "point"]),
    ("min", &["transform"]),
    ("max", &["transform"]),
    ("u", &["edge_u"]),
    ("v", &["edge_v"]),
    ("translate", &["transform"]),
    ("translation", &["transform"]),
    ("rotate", &["transform", "rotation_degrees"]),
    ("rotation", &["transform", "rotation_degrees"]),
    ("scale", &["transform"]),
    ("bsdf", &["material"]),
    ("shader", &["material"]),
    ("mat", &["material"]),
    ("emit", &["emission"]),
    ("emissive", &["emission"]),
    ("emitter", &["emission"]),
    ("light", &["emission", "lights"]),
    ("vertices", &["positions"]),
    ("points", &["positions"]),
    ("indices", &["triangles"]),
    ("faces", &["triangles"]),
    ("texcoords", &["uvs"]),
    ("uv", &["uvs"]),
    ("filename", &["file"]),
    ("path", &["file"]),
    ("src", &["file"]),
    ("url", &["file"]),
    ("power", &["intensity", "irradiance", "radiance", "scale"]),
    ("strength", &["intensity", "irradiance", "radiance", "scale"]),
    ("energy", &["intensity", "irradiance", "radiance", "scale"]),
    ("intensity", &["irradiance", "radiance", "scale"]),
    ("radiance", &["intensity", "irradiance"]),
    ("image", &["file", "texture"]),
    ("direction", &["look_at"]),
    // Keys of materials.
    ("color", &["albedo", "base_color", "reflectance", "radiance", "intensity", "irradiance", "tint", "material"]),
    ("colour", &["albedo", "base_color", "reflectance", "color", "radiance", "intensity", "irradiance", "material"]),
    ("basecolor", &["albedo", "reflectance"]),
    ("diffuse", &["albedo", "base_color"]),
    ("diffusecolor", &["albedo", "base_color"]),
    ("kd", &["albedo", "diffuse"]),
    ("ks", &["specular"]),
    ("albedo", &["base_color", "reflectance", "tint"]),
    ("reflectance", &["albedo", "base_color", "tint"]),
    ("rgb", &["albedo", "base_color", "reflectance", "color"]),
    ("tint", &["reflection_tint", "transmission_tint"]),
    ("eta", &["ior"]),
    ("intior", &["ior"]),
    ("index", &["ior"]),
    ("refractiveindex", &["ior"]),
    ("material", &["metal"]),
    ("name", &["metal"]),
    ("preset", &["metal"]),
    ("tiling", &["scale"]),
    ("repeat", &["scale"]),
    // Metals.
    ("aluminum", &["aluminium", "conductor"]),
    ("alu", &["aluminium"]),
    ("al", &["aluminium"]),
    ("ag", &["silver"]),
    ("au", &["gold"]),
    ("cu", &["copper"]),
    ("fe", &["iron"]),
    ("steel", &["iron", "conductor"]),
    ("cr", &["chromium"]),
    ("chrome", &["chromium", "conductor"]),
    ("ti", &["titanium"]),
    ("w", &["tungsten"]),
];

/// Words of other programs for what is written elsewhere, and where.
const ELSEWHERE: &[(&str, &str)] = &[
    ("area", AREA_LIGHT),
    ("arealight", AREA_LIGHT),
    ("quadlight", AREA_LIGHT),
    ("rectlight", AREA_LIGHT),
    ("emission", AREA_LIGHT),
    ("emissive", AREA_LIGHT),
    ("emitter", AREA_LIGHT),
    ("light", AREA_LIGHT),
    ("diffuselight", AREA_LIGHT),
];

const AREA_LIGHT: &str = "a shape is a light by its key `emission`";

/// All words of the scene format that a synonym leads to.
#[cfg(test)]
pub fn targets() -> impl Iterator<Item = &'static str> {
    SYNONYMS.iter().flat_map(|(_, own)| *own).copied()
}

/// Where that is written which a type or key of another program means.
pub fn elsewhere(word: &str) -> Option<&'static str> {
    let plain = plain(word);
    ELSEWHERE.iter().find(|(foreign, _)| *foreign == plain).map(|(_, text)| *text)
}

/// Lower case without `_`, `-` and spaces.
fn plain(word: &str) -> String {
    word.chars().filter(|c| !"_- ".contains(*c)).flat_map(char::to_lowercase).collect()
}

/// The first of the words that the scene format has in place of another program's, among those allowed here.
pub fn synonym<'a>(word: &str, allowed: &[&'a str]) -> Option<&'a str> {
    let plain = plain(word);
    SYNONYMS
        .iter()
        .filter(|(foreign, _)| *foreign == plain)
        .flat_map(|(_, own)| *own)
        .find_map(|own| allowed.iter().copied().find(|allowed| allowed == own))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_other_programs_have_one_here() {
        assert_eq!(synonym("rough_glass", &["diffuse", "dielectric"]), Some("dielectric"));
        assert_eq!(synonym("Color", &["radiance", "base_color"]), Some("base_color"));
        assert_eq!(synonym("color", &["radius"]), None);
        assert_eq!(synonym("hair", &["dielectric"]), None);
    }
}
