//! Embree: triangle meshes natively on the geometry's own buffers, analytic shapes as user geometry, objects as instanced scenes.
//!
//! The only home of `unsafe`. Every scene has the ROBUST flag: without it about a tenth of grazing rays pass between triangles.

mod callbacks;
mod device;
mod query;
mod scene;
mod sys;

pub use device::EmbreeInfo;

use device::Device;
use query::LANES;
use scene::CommittedScene;

use super::{Accelerator, Coherence};
use crate::error::Result;
use crate::geometry::{Geometry, Hit};
use crate::math::{Aabb, Ray};

/// Embree over a geometry. It borrows the geometry, so shared buffers and user data can neither move nor vanish while it lives.
pub struct EmbreeAccel<'g> {
    // Released before the device.
    scene: CommittedScene,
    device: Device,
    geometry: &'g Geometry,
    /// Instances have the ids from here on.
    first_instance: u32,
}

impl<'g> EmbreeAccel<'g> {
    /// Builds with the given number of threads (0: all).
    ///
    /// # Errors
    /// The first error that Embree reports, such as a lack of memory.
    pub fn new(geometry: &'g Geometry, threads: usize) -> Result<Self> {
        let device = Device::new(threads)?;
        let scene = scene::build(&device, geometry)?;
        Ok(Self { scene, device, geometry, first_instance: geometry.shapes.len() as u32 })
    }
}

impl Accelerator for EmbreeAccel<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        query::intersect(&self.scene, self.first_instance, ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        query::occluded(&self.scene, ray)
    }

    fn intersect_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>], coherence: Coherence) {
        let coherent = coherence == Coherence::Coherent;
        for (rays, hits) in rays.chunks(LANES).zip(hits.chunks_mut(LANES)) {
            query::intersect_packet(&self.scene, self.first_instance, rays, hits, coherent);
        }
    }

    fn occluded_batch(&self, rays: &[Ray], occluded: &mut [bool], coherence: Coherence) {
        let coherent = coherence == Coherence::Coherent;
        for (rays, occluded) in rays.chunks(LANES).zip(occluded.chunks_mut(LANES)) {
            query::occluded_packet(&self.scene, rays, occluded, coherent);
        }
    }

    fn bounds(&self) -> Aabb {
        self.geometry.bounds()
    }

    fn memory_bytes(&self) -> usize {
        self.device.memory_bytes()
    }

    fn description(&self) -> String {
        let info = self.device.info();
        format!("Embree {} ({}, single rays and packets of {LANES})", info.version, info.isa)
    }
}
