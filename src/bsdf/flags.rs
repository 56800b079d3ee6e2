//! What kinds of lobes a BSDF has.

bitflags::bitflags! {
    /// Kinds of lobes, as in pbrt, whether any of them is anisotropic, and whether they are those of a fibre.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct BsdfFlags: u8 {
        /// Light stays on its side of the surface.
        const REFLECTION = 1;
        /// Light may cross the surface.
        const TRANSMISSION = 1 << 1;
        /// Diffuse lobes.
        const DIFFUSE = 1 << 2;
        /// Rough lobes that are not diffuse.
        const GLOSSY = 1 << 3;
        /// Delta lobes.
        const SPECULAR = 1 << 4;
        /// Scattering depends on the direction of the frame's tangents.
        const ANISOTROPIC = 1 << 5;
        /// Scattering of a whole fibre, with the first tangent along it.
        const FIBER = 1 << 6;
    }
}

impl BsdfFlags {
    /// Whether all lobes are deltas: light sampling is then pointless.
    #[inline]
    pub fn is_delta(self) -> bool {
        self.contains(Self::SPECULAR) && !self.intersects(Self::DIFFUSE | Self::GLOSSY)
    }

    /// Whether light may cross the surface; otherwise nothing arrives but from the side of `wo`.
    #[inline]
    pub fn transmits(self) -> bool {
        self.contains(Self::TRANSMISSION)
    }

    /// Whether scattering depends on the direction of the frame's tangents.
    #[inline]
    pub fn is_anisotropic(self) -> bool {
        self.contains(Self::ANISOTROPIC)
    }
}
