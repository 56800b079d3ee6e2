//! Ray cones.

/// A cone around a ray: the width of the beam that the ray represents.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RayCone {
    /// Width at the ray's origin, in world units.
    pub width: f32,
    /// By how much the width grows per unit of distance.
    pub spread: f32,
}

impl RayCone {
    /// Its width at a distance from the ray's origin.
    #[inline]
    pub fn width_at(&self, distance: f32) -> f32 {
        self.width + self.spread * distance
    }

    /// The cone of a ray that starts at a distance from this one's origin and spreads as much.
    #[inline]
    #[must_use]
    pub fn moved(self, distance: f32) -> Self {
        Self { width: self.width_at(distance), ..self }
    }
}
