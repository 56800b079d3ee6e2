//! What a channel holds, by its name: what may be rounded to 16 bits, what may be compressed with loss.

use super::cryptomatte;

/// What a channel holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Light or reflectance: 16 bits do, and a little loss is not seen.
    Color,
    /// Coverage.
    Alpha,
    /// Components of unit vectors: 16 bits do, loss does not.
    Direction,
    /// Depth, position, coordinates, counts, variance: numbers that need 32 bits.
    Precise,
    /// Numbers of objects or materials, which must be exact.
    Id,
    /// Ids and coverages of Cryptomatte, which must be exact.
    Crypto,
}

/// Passes by their names in lower case without spaces, hyphens and underscores.
const IDS: &[&str] = &[
    "id",
    "objectid",
    "materialid",
    "instanceid",
    "primitiveid",
    "primid",
    "objectindex",
    "materialindex",
    "indexob",
    "indexma",
];
const PRECISE: &[&str] = &[
    "z",
    "depth",
    "denoisingdepth",
    "p",
    "pworld",
    "position",
    "worldposition",
    "uv",
    "st",
    "motion",
    "motionvector",
    "motionvectors",
    "vector",
    "forward",
    "velocity",
    "samples",
    "stats",
    "samplecount",
    "debugsamplecount",
    "variance",
    "relativevariance",
];
const DIRECTIONS: &[&str] = &[
    "n",
    "ng",
    "ns",
    "normal",
    "normals",
    "geometricnormal",
    "shadingnormal",
    "featurenormal",
    "denoisingnormal",
    "tangent",
];

impl Role {
    /// The role of a channel of this full name.
    pub fn of(channel: &str) -> Self {
        let (path, suffix) = channel.rsplit_once('.').unwrap_or(("", channel));
        let pass = path.rsplit('.').next().unwrap_or_default();
        if is_crypto_pass(pass) {
            return Self::Crypto;
        }
        let word: String = pass.chars().filter(|c| !" -_".contains(*c)).flat_map(char::to_lowercase).collect();
        let is = |list: &[&str]| list.contains(&word.as_str());
        match suffix {
            _ if is(IDS) => Self::Id,
            "A" | "a" if !is(PRECISE) => Self::Alpha,
            _ if is(PRECISE) => Self::Precise,
            _ if is(DIRECTIONS) => Self::Direction,
            "Z" | "U" | "V" | "u" | "v" | "samples" if path.is_empty() => Self::Precise,
            "U" | "V" | "samples" => Self::Precise,
            "X" | "Y" | "Z" | "W" if !path.is_empty() => Self::Direction,
            "X" | "dzdx" | "dzdy" => Self::Direction,
            _ => Self::Color,
        }
    }

    /// Whether the channel is neither colour nor coverage: no lossy compression, no colour space.
    pub fn is_data(self) -> bool {
        !matches!(self, Self::Color | Self::Alpha)
    }
}

/// Whether a pass holds ranks of Cryptomatte: `CryptoObject00` and the like.
fn is_crypto_pass(pass: &str) -> bool {
    let name = pass.trim_end_matches(|c: char| c.is_ascii_digit());
    name.len() + 2 <= pass.len() && name.to_ascii_lowercase().contains("crypto")
        || cryptomatte::TYPES.iter().any(|kind| kind.eq_ignore_ascii_case(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_many_programs_are_known() {
        for (role, names) in [
            (Role::Color, "R G B Y albedo.R diffuse_direct.G View.Combined.B light_key.R beauty.red Ci.g RY"),
            (Role::Alpha, "A View.Combined.A albedo.a"),
            (Role::Direction, "N.X Ng.Z feature_normal.Y ViewLayer.Normal.X Ns.Y Tangent.X"),
            (
                Role::Precise,
                "Z P.X uv.U uv.V UV.A motion.X forward.u ViewLayer.Depth.Z Vector.W stats.samples variance.R \
                 Variance.G u v depth.Z",
            ),
            (Role::Id, "object_id.id material_id.id ViewLayer.Object Index.X IndexOB.X instance_id.id"),
            (
                Role::Crypto,
                "CryptoObject00.r ViewLayer.CryptoMaterial02.a cryptoAsset01.R CryptoObject.r uCryptoMine00.g",
            ),
        ] {
            for name in names.replace("Object Index", "Object_Index").split(' ') {
                assert_eq!(Role::of(name), role, "{name}");
            }
        }
        assert_eq!(Role::of("ViewLayer.Object Index.X"), Role::Id);
    }
}
