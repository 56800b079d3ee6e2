//! Colour spaces by the names of the attribute `colorInteropID` (Color Interop Forum), with their primaries and whites.

use exr::math::Vec2;
use exr::meta::attribute::Chromaticities;

/// The attribute's name.
pub const INTEROP_ID: &str = "colorInteropID";
/// The name for what is no colour.
pub const DATA: &str = "data";
/// The name of the space that pictures are rendered in.
pub const SCENE_LINEAR: &str = "lin_rec709_scene";

/// Rec.709 primaries and white, as OpenEXR assumes without the attribute `chromaticities`.
pub const REC709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};
const AP1: Chromaticities = Chromaticities {
    red: Vec2(0.713, 0.293),
    green: Vec2(0.165, 0.830),
    blue: Vec2(0.128, 0.044),
    white: Vec2(0.32168, 0.33767),
};
const AP0: Chromaticities = Chromaticities {
    red: Vec2(0.7347, 0.2653),
    green: Vec2(0.0, 1.0),
    blue: Vec2(0.0001, -0.0770),
    white: Vec2(0.32168, 0.33767),
};
const REC2020: Chromaticities = Chromaticities {
    red: Vec2(0.708, 0.292),
    green: Vec2(0.170, 0.797),
    blue: Vec2(0.131, 0.046),
    white: Vec2(0.3127, 0.3290),
};

/// The scene-linear spaces that the attribute may name.
pub const COLOR_SPACES: &[(&str, Chromaticities)] =
    &[(SCENE_LINEAR, REC709), ("lin_ap1_scene", AP1), ("lin_ap0_scene", AP0), ("lin_rec2020_scene", REC2020)];

/// The eight numbers of chromaticities.
pub fn chromaticity_values(c: &Chromaticities) -> [f32; 8] {
    [c.red.0, c.red.1, c.green.0, c.green.1, c.blue.0, c.blue.1, c.white.0, c.white.1]
}
