//! The baked numbers: where each block lies in the file, and how it is read between its nodes.

/// Nodes along alpha, at equal steps of its square root.
pub const ALPHAS: usize = 24;
/// Nodes along the smaller alpha over the larger, at equal steps of its square root.
pub const ASPECTS: usize = 11;
/// Nodes along the index of refraction, at equal steps of the fourth root of the reflectance ahead.
pub const IORS: usize = 16;
/// Nodes along the cosine, at equal steps of [`cosine_axis`].
pub const COSINES: usize = 32;
/// Nodes along the roughness of the diffuse lobes and the gloss of the clear coat of the principled model.
pub const SHAPES: usize = 8;

/// Nodes along the cosine for a coat, at equal steps of its square root.
pub const COAT_NODES: usize = 32;

/// Largest index of refraction.
pub const MAX_IOR: f32 = 10.0;

static DATA: &[u8; 2 * TOTAL] = include_bytes!("tables.bin");

/// Fractions of 1, in units of 1/65535, from one place of the file on.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    start: usize,
    len: usize,
    low: f32,
    scale: f32,
}

impl Block {
    const fn new(start: usize, len: usize, low: f32, high: f32) -> Self {
        Self { start, len, low, scale: (high - low) / 65_535.0 }
    }

    const fn end(&self) -> usize {
        self.start + self.len
    }

    /// Entries.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Difference between neighbouring values that it can hold.
    #[cfg(test)]
    pub fn step(&self) -> f32 {
        self.scale
    }

    /// Appends values in the form of the file.
    pub fn encode(&self, values: &[f32], file: &mut Vec<u8>) {
        assert_eq!((file.len(), values.len()), (2 * self.start, self.len));
        for value in values {
            let steps = ((value - self.low) / self.scale).round();
            assert!((0.0..=65_535.0).contains(&steps), "{value} is out of the range of {self:?}");
            file.extend((steps as u16).to_le_bytes());
        }
    }

    /// The value at a node.
    #[inline(always)]
    pub fn at(&self, node: usize) -> f32 {
        let at = 2 * (self.start + node);
        self.low + self.scale * f32::from(u16::from_le_bytes([DATA[at], DATA[at + 1]]))
    }

    /// Between two neighbouring nodes.
    #[inline(always)]
    pub fn linear(&self, node: usize, part: f32) -> f32 {
        let (before, after) = (self.at(node), self.at(node + 1));
        before + (after - before) * part
    }

    /// Between nodes of two axes, the second with `columns` nodes, in the part of the block that begins at `start`.
    #[inline(always)]
    pub fn bilinear_from(&self, start: usize, columns: usize, first: TableCoordinate, second: TableCoordinate) -> f32 {
        let at = start + first.node * columns + second.node;
        let (before, after) = (self.linear(at, second.part), self.linear(at + columns, second.part));
        before + (after - before) * first.part
    }

    /// Square of the value between nodes of two axes, linear in the squares.
    #[inline]
    pub fn bilinear_square(
        &self,
        start: usize,
        columns: usize,
        first: TableCoordinate,
        second: TableCoordinate,
    ) -> f32 {
        let square = |node: usize| self.at(node) * self.at(node);
        let row = |node: usize| {
            let at = start + node * columns + second.node;
            square(at) + (square(at + 1) - square(at)) * second.part
        };
        let (before, after) = (row(first.node), row(first.node + 1));
        before + (after - before) * first.part
    }

    /// Between nodes of three axes.
    #[inline(always)]
    pub fn trilinear(&self, start: usize, counts: [usize; 2], places: [TableCoordinate; 3]) -> f32 {
        let plane = counts[0] * counts[1];
        let at = start + places[0].node * plane;
        let before = self.bilinear_from(at, counts[1], places[1], places[2]);
        let after = self.bilinear_from(at + plane, counts[1], places[1], places[2]);
        before + (after - before) * places[0].part
    }
}

/// Single-scattering albedo of microfacets that reflect all: aspect, axis above which the direction is, alpha, cosine.
pub const REFLECTION: Block = Block::new(0, ASPECTS * 2 * ALPHAS * COSINES, 0.0, 1.0);
/// Square root of what its mean under diffuse light lacks of 1: aspect, alpha.
pub const REFLECTION_AVERAGE: Block = Block::new(REFLECTION.end(), ASPECTS * ALPHAS, 0.0, 1.0);
/// The same for microfacets that reflect `(1 - cos)^5`, less that of [`smoothed`] `cos`: alpha, cosine.
pub const SCHLICK: Block = Block::new(REFLECTION_AVERAGE.end(), ALPHAS * COSINES, -1.0, 1.0);
/// What dielectric microfacets reflect and refract together: seen from outside or inside, alpha, index, cosine.
pub const GLASS: Block = Block::new(SCHLICK.end(), 2 * ALPHAS * IORS * COSINES, 0.0, 1.0);
/// Square root of what its mean lacks of 1: seen from outside or inside, alpha, index.
pub const GLASS_AVERAGE: Block = Block::new(GLASS.end(), 2 * ALPHAS * IORS, 0.0, 1.0);
/// Albedo of the principled model's white diffuse lobe and of its flat one: which, roughness, cosine.
pub const DIFFUSE: Block = Block::new(GLASS_AVERAGE.end(), 2 * SHAPES * COSINES, 0.0, 2.0);
/// Albedo of its sheen: cosine.
pub const SHEEN: Block = Block::new(DIFFUSE.end(), COSINES, 0.0, 1.0);
/// Albedo of its clear coat: gloss, cosine.
pub const CLEAR_COAT: Block = Block::new(SHEEN.end(), SHAPES * COSINES, 0.0, 1.0);
/// Albedo of a dielectric coat seen from outside: alpha, index, cosine.
pub const COAT: Block = Block::new(CLEAR_COAT.end(), ALPHAS * IORS * COAT_NODES, 0.0, 1.0);
/// Its mean under diffuse light: alpha, index.
pub const COAT_AVERAGE: Block = Block::new(COAT.end(), ALPHAS * IORS, 0.0, 1.0);
const TOTAL: usize = COAT_AVERAGE.end();

/// A place between two nodes of an axis.
#[derive(Clone, Copy, Debug)]
pub struct TableCoordinate {
    /// The node before.
    pub node: usize,
    /// How far it is to the next node, within `[0, 1]`.
    pub part: f32,
}

impl TableCoordinate {
    /// On an axis of `count` nodes, where `x` runs from 0 to 1.
    #[inline(always)]
    pub fn new(x: f32, count: usize) -> Self {
        let at = x * (count - 1) as f32;
        let node = (at as i32).clamp(0, count as i32 - 2) as usize;
        Self { node, part: (at - node as f32).clamp(0.0, 1.0) }
    }

    /// On the axis of alpha.
    #[inline(always)]
    pub fn of_alpha(alpha: f32) -> Self {
        Self::new(alpha.sqrt(), ALPHAS)
    }

    /// On the axis of the index of refraction, at least 1.
    #[inline(always)]
    pub fn of_ior(ior: f32) -> Self {
        const LAST: f32 = (MAX_IOR + 1.0) / (MAX_IOR - 1.0);
        Self::new(((ior - 1.0) / (ior + 1.0) * LAST).max(0.0).sqrt(), IORS)
    }

    /// On the axis of the cosine.
    #[inline(always)]
    pub fn of_cosine(cos: f32, alpha: f32) -> Self {
        Self::new(cosine_axis(cos, alpha), COSINES)
    }
}

/// Where a cosine lies on its axis: half of the nodes follow its square root; the others are dense where the cosine is
/// of the order of alpha, since there masking sets in.
#[inline(always)]
pub fn cosine_axis(cos: f32, alpha: f32) -> f32 {
    0.5 * (cos * (1.0 + alpha) / (cos + alpha).max(f32::MIN_POSITIVE) + cos.sqrt())
}

/// How far a direction is from the plane of the larger alpha to that of the smaller, within `[0, 1]`: for the squared
/// cosine and sine of its azimuth from that plane, and the smaller alpha over the larger. At equal masking the albedo
/// changes close to the second plane, the closer the smaller the aspect; the power is fitted so that it is linear in
/// this to a hundredth, and hardly ever less.
#[inline]
pub fn across(cos_squared: f32, sin_squared: f32, aspect: f32) -> f32 {
    let shrunk = sin_squared * aspect.powf(1.95 - 1.6 * aspect);
    if cos_squared + shrunk > 0.0 { shrunk / (cos_squared + shrunk) } else { 0.5 }
}

/// A cosine that stays away from grazing by about alpha, where microfacets are not seen at grazing angles: what is left
/// to tabulate after Fresnel's reflectance there is smooth.
#[inline(always)]
pub fn smoothed(cos: f32, alpha: f32) -> f32 {
    let apart = 2.25 * alpha * alpha;
    ((cos * cos + apart) / (1.0 + apart)).sqrt().min(1.0)
}

/// `(1 - cos)^5`.
#[inline(always)]
pub fn schlick_weight(cos: f32) -> f32 {
    let rest = 1.0 - cos;
    let squared = rest * rest;
    squared * squared * rest
}
