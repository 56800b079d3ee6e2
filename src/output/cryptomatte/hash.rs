//! Names to ids: MurmurHash3 of 32 bits (Austin Appleby, public domain) with the seed 0, bent so that its bits are an
//! ordinary `f32`.

/// The id of a name, as bits of a float. Exponents of all zeros or all ones, which encode zero, denormals,
/// infinities and NaN, have their lowest bit flipped.
pub fn id_bits(name: &str) -> u32 {
    ordinary(murmur3_32(name.as_bytes()))
}

/// The id of a name as pixels hold it; 0 means no object and belongs to no name.
pub fn id(name: &str) -> f32 {
    f32::from_bits(id_bits(name))
}

/// The key of a type's metadata: the first seven hexadecimal digits of its name's id.
pub fn metadata_key(type_name: &str) -> String {
    let mut digits = format!("{:08x}", id_bits(type_name));
    digits.truncate(7);
    digits
}

/// Whether bits can be an id: those of a float that is neither zero nor denormal nor infinite nor NaN.
pub const fn is_ordinary(bits: u32) -> bool {
    let exponent = bits >> 23 & 0xff;
    exponent != 0 && exponent != 0xff
}

/// The conversion `uint32_to_float32`.
const fn ordinary(hash: u32) -> u32 {
    if is_ordinary(hash) { hash } else { hash ^ 1 << 23 }
}

fn murmur3_32(bytes: &[u8]) -> u32 {
    let mix = |block: u32| block.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let mut hash = 0u32;
    let mut blocks = bytes.chunks_exact(4);
    for block in &mut blocks {
        let word = u32::from_le_bytes([block[0], block[1], block[2], block[3]]);
        hash = (hash ^ mix(word)).rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    let tail = blocks.remainder().iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
    // Lengths beyond 32 bits wrap, as in the reference.
    hash ^= mix(tail) ^ bytes.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85eb_ca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values that other implementations give.
    #[test]
    fn names_have_the_ids_that_readers_expect() {
        let known = [
            ("torus", 0xf19c_73fd),
            ("равнина", 0x9623_511e),
            ("bunny", 0x1385_1a76),
            ("default", 0x42c9_679f),
            ("bunny_porcelain_mat", 0xb24b_26d4),
            ("Cube", 0xa8fc_e865),
            ("hello", 0x248b_fa47),
        ];
        for (name, bits) in known {
            assert_eq!(id_bits(name), bits, "{name}");
            assert_eq!(murmur3_32(name.as_bytes()), bits, "{name}");
        }
        assert!((f64::from(id("torus")) + 1.549_436_248_32e30).abs() < 1e19);
        assert_eq!(murmur3_32(b""), 0);
    }

    #[test]
    fn ids_are_ordinary_floats() {
        assert_eq!((murmur3_32(b"obj45"), id_bits("obj45")), (0x0073_4d5c, 0x00f3_4d5c));
        assert_eq!((murmur3_32(b"obj520"), id_bits("obj520")), (0x7fbb_01ed, 0x7f3b_01ed));
        for i in 0..100_000 {
            let id = id(&format!("object {i}"));
            assert!(id.is_normal(), "{i}");
        }
        assert!(
            !is_ordinary(0)
                && !is_ordinary(1)
                && !is_ordinary(f32::INFINITY.to_bits())
                && !is_ordinary(f32::NAN.to_bits())
        );
    }

    #[test]
    fn keys_are_those_of_the_specification() {
        let keys = ["CryptoObject", "CryptoMaterial", "CryptoAsset"].map(metadata_key);
        assert_eq!(keys, ["3ae39a5", "be359d6", "f42029d"]);
        // A prefix is part of the name.
        assert_eq!(metadata_key("ViewLayer.CryptoObject"), "542cafa");
    }
}
