//! Bidirectional path tracing: paths from the lights, whose vertices paths from the camera connect to.
//!
//! The vertices of many light paths are stored; every vertex of a camera path is connected to one of them, chosen by
//! [`ConnectionTables`] ("light vertex cache": Davidovič, Křivánek, Hašan and Slusallek 2014). Multiple importance
//! sampling weighs connections against light sampling and against meeting lights by chance (Veach 1997, chapter 10),
//! with the sums over strategies kept along both paths (Georgiev, "Implementing Vertex Connection and Merging", 2012).
//! There are no connections to the camera itself.
//!
//! The sample index of a camera path decides on the light paths that it is connected to: each epoch of [`EPOCH`]
//! samples has its own, which depend on the seed and on the epoch alone.
//!
//! [`EPOCH`]: super::EPOCH

mod connection_tables;
mod distant;
mod emitters;

pub use connection_tables::{ChosenVertex, ClusteredVertices, ConnectionPilot, ConnectionTables};
pub use distant::DistantRay;
pub use emitters::Emitters;

use crate::bsdf::Bsdf;
use crate::color::Rgb;
use crate::geometry::SpawnPoint;
use crate::id::LightId;
use crate::math::{Frame, Vec3};

/// Connections of a vertex of a camera path over the light paths' vertices per path, as MIS weights take them: any
/// constant is unbiased.
pub const CONNECTIONS_PER_VERTEX: f64 = 1.5;

/// Where a light path meets a surface. Aligned, so that it is in two lines of the caches.
#[derive(Clone, Debug)]
#[repr(align(128))]
pub struct LightVertex {
    /// The point, with its geometric normal.
    pub point: SpawnPoint,
    /// The shading normal.
    pub n: Vec3,
    /// Cosine of the direction to where the light comes from with the geometric normal.
    pub cos_geometric: f32,
    /// The same with the shading normal.
    pub cos_shading: f32,
    /// Cosine of the shading and the geometric normal where a normal or bump map makes them differ, else zero.
    pub cos_normals: f32,
    /// Flux that arrives, times the number of light paths; at diffuse surfaces that which leaves them.
    pub flux: Rgb,
    /// How light is scattered; `None` at diffuse surfaces.
    pub scattering: Option<Box<Scattering>>,
    /// The light that it comes from.
    pub light: LightId,
    /// Segments from the light.
    pub segments: u32,
    /// What other strategies weigh.
    pub mis: PartialMis,
    /// The part of it that is not of connections, but of light and BSDF sampling.
    pub unconnected: PartialMis,
}

/// How light is scattered at a vertex.
#[derive(Clone, Debug)]
pub struct Scattering {
    /// The shading frame.
    pub frame: Frame,
    /// Unit direction to where the light comes from, in the frame.
    pub wi: Vec3,
    /// The BSDF.
    pub bsdf: Bsdf,
}

/// Sums of the squared densities of other strategies over that of a path's own, as of its last vertex (dVCM and dVC of
/// Georgiev 2012).
#[derive(Clone, Copy, Debug, Default)]
pub struct PartialMis {
    /// Of the strategy that ends this path one vertex before, without the factor of the vertex to come.
    pub d_vcm: f64,
    /// Of those that end it earlier, likewise.
    pub d_vc: f64,
}

impl PartialMis {
    /// The sum of all, where scattering chooses the direction back with this density.
    #[inline(always)]
    pub fn sum(self, reversed_pdf: f32) -> f64 {
        self.d_vcm + self.d_vc * squared(reversed_pdf)
    }
}

/// The light paths of an epoch.
#[derive(Debug)]
pub struct LightPaths<'a> {
    /// Where they start.
    pub emitters: &'a Emitters,
    /// Their vertices.
    pub vertices: &'a [LightVertex],
    /// By which they are chosen.
    pub tables: &'a ConnectionTables,
    /// The same vertices by cluster.
    pub clustered: &'a ClusteredVertices,
    /// The number of paths.
    pub traced: u32,
    /// Whether [`Workspace::pilot_moments`](super::Workspace::pilot_moments) are wanted.
    pub has_moments: bool,
}

/// A sum of squared densities of other strategies, for a weight of `1 / (1 + sum)`: finite, and 0 where it is not a
/// number, as where one density overflows and another is 0.
#[inline(always)]
pub fn bounded(sum: f64) -> f64 {
    if sum > 0.0 { sum.min(f64::MAX) } else { 0.0 }
}

/// The square, in which densities are compared (power heuristic).
#[inline(always)]
pub fn squared(ratio: f32) -> f64 {
    let ratio = f64::from(ratio);
    ratio * ratio
}
