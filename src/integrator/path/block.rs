//! The vertices of one block of paths, in structures of arrays.

use super::Context;
use super::materials::BsdfTable;
use super::splitting::SplitRows;
use crate::bsdf::{Bsdf, BsdfEval, Lambert, Principled};
use crate::color::Rgb;
use crate::geometry::{Hit, SpawnPoint, SurfaceInteraction, WorldNormalRows, WorldPointRows};
use crate::id::{InstanceId, PrimId, ShapeId};
use crate::integrator::light_events::LobeWeights;
use crate::light::{LightSampleContext, LightSampleRows};
use crate::math::rows::{BATCH, Row, soa};
use crate::math::{DVec3, Frame, RayRows, Vec2, Vec3};
use crate::sampling::{SampleIdRows, SampleRows};
use crate::scene::Scene;

/// Bits of a vertex's `flags`.
pub(super) mod vertex_flags {
    /// Every lobe is a delta: light sampling is pointless.
    pub const DELTA: u32 = 1;
    /// Light may cross the surface.
    pub const TRANSMITS: u32 = 2;
    /// There is no surface, although the accelerator found a hit.
    pub const MISS: u32 = 4;
    /// A medium scatters here, whose id is in place of the shape's.
    pub const MEDIUM: u32 = 8;
    /// No shadow ray from here reaches a light.
    pub const ENCLOSED: u32 = 16;
    /// Specular reflection is one of several lobes.
    pub const MIXED_SPECULAR: u32 = 32;
    /// All lobes are near specular: photons are scattered here, not gathered.
    pub const NEAR_SPECULAR: u32 = 64;
    /// Where no photons are gathered.
    pub const UNGATHERED: u32 = DELTA | MISS | NEAR_SPECULAR;
    /// Where no light is sampled.
    pub const UNSAMPLED: u32 = DELTA | MISS | ENCLOSED;
}

/// What has become of a ray that a vertex was to spawn.
pub(super) mod spawn {
    /// There is none.
    pub const NONE: u32 = 0;
    /// It is there.
    pub const SPAWNED: u32 = 1;
    /// The shading normal sees its direction, the facet hides it.
    pub const BELOW_FACET: u32 = 2;

    #[inline(always)]
    pub fn status(is_spawned: bool, is_below: bool) -> u32 {
        if is_spawned {
            SPAWNED
        } else if is_below {
            BELOW_FACET
        } else {
            NONE
        }
    }
}

soa! {
    /// Triangles that rays hit.
    pub(super) struct TriangleRows {
        /// The ray, in the space of the triangle.
        origin: Vec3,
        direction: Vec3,
        /// Indices of the corners.
        a_index: u32,
        b_index: u32,
        c_index: u32,
        /// The corners and their normals.
        a: Vec3,
        b: Vec3,
        c: Vec3,
        n_a: Vec3,
        n_b: Vec3,
        n_c: Vec3,
        /// Their uv.
        uv_a: Vec2,
        uv_b: Vec2,
        uv_c: Vec2,
        u: f32,
        v: f32,
    }
}

soa! {
    /// The vertices of a block's paths.
    pub(super) struct VertexRows {
        /// Index of the path in the block.
        path: u32,
        /// The next four as in [`PathRows`](super::wave::PathRows).
        slot: u32,
        seed: u32,
        sample: u32,
        path_flags: u32,
        /// Direction of the ray that arrives.
        direction: Vec3,
        time: f32,
        shape: u32,
        prim: u32,
        instance: u32,
        /// The next four as in [`SurfaceInteraction`].
        t: f32,
        error: f32,
        n_g: Vec3,
        n_s: Vec3,
        dp_du: Vec3,
        uv: Vec2,
        /// Of a triangle found in rows, as [`Geometry::uv_density`](crate::geometry::Geometry::uv_density); else zero.
        uv_density: f32,
        /// The area of the footprint in uv, where the material has textures.
        texture_area: f32,
        /// Whether the point is still to be found by [`World::resolve`](crate::integrator::World::resolve).
        is_unresolved: u32,
        flags: u32,
        throughput: Rgb,
        /// As in `PathRows`.
        rr_scale: f32,
        /// Of diffuse surfaces, else zero.
        albedo: Rgb,
        /// The shading frame.
        frame_x: Vec3,
        frame_y: Vec3,
        n: Vec3,
        is_consistent: u32,
        /// The normal on the side of the path, or zero where light may cross.
        light_context_n: Vec3,
        /// The direction back, in the frame.
        wo: Vec3,
        /// Cosine of the direction back with the geometric normal.
        cos_geometric: f32,
        /// Cosine of the shading and the geometric normal where a normal or bump map makes them differ, else zero.
        cos_normals: f32,
    }
}

soa! {
    /// The BSDFs of vertices for directions that were chosen elsewhere.
    pub(super) struct EvalRows {
        /// The direction, in the frame.
        wi: Vec3,
        value: Rgb,
        /// The density with which scattering chooses the direction.
        pdf: f32,
    }
}

soa! {
    /// Direct light at vertices, and the shadow rays to it.
    pub(super) struct DirectRows {
        /// See [`spawn`].
        status: u32,
        shadow_origin: Vec3,
        shadow_direction: Vec3,
        shadow_end: f32,
        contribution: Rgb,
    }
}

soa! {
    /// Directions sampled at vertices, and the rays along them.
    pub(super) struct ScatterRows {
        /// The direction, in the frame.
        wi: Vec3,
        weight: Rgb,
        pdf: f32,
        /// Factor on `rr_scale`.
        rr_factor: f32,
        is_valid: u32,
        is_delta: u32,
        is_transmission: u32,
        /// See [`spawn`].
        status: u32,
        origin: Vec3,
        direction: Vec3,
        throughput: Rgb,
        rr_scale: f32,
        /// As in `PathRows`.
        path_flags: u32,
        /// Factor on what roulette decides by: the value of going on from the vertex.
        continuation: f32,
    }
}

soa! {
    /// Points in `f64`, apart from rows of 32 bits.
    pub(super) struct PointRows {
        /// Of vertices.
        p: DVec3,
        /// Of sampled lights.
        target_p: DVec3,
    }
}

/// Hits on analytic shapes.
pub(super) struct AnalyticScratch {
    /// Of the rays of all vertices.
    pub t_min: Row,
    pub t: Row,
    /// Hits on one shape.
    pub rays: RayRows,
    pub ray_t: Row,
    pub points: WorldPointRows,
    pub normals: WorldNormalRows,
}

impl Default for AnalyticScratch {
    fn default() -> Self {
        Self {
            t_min: [0.0; BATCH],
            t: [0.0; BATCH],
            rays: RayRows::default(),
            ray_t: [0.0; BATCH],
            points: WorldPointRows::default(),
            normals: WorldNormalRows::default(),
        }
    }
}

/// The vertices of one block.
#[derive(Default)]
pub(super) struct Vertices {
    pub count: usize,
    pub rows: VertexRows,
    pub triangles: TriangleRows,
    pub points: PointRows,
    pub analytic: AnalyticScratch,
    pub light_samples: LightSampleRows,
    /// For the directions of `light_samples`.
    pub light_evals: EvalRows,
    pub direct: DirectRows,
    /// Whether the light of `direct` leaves by specular reflection.
    pub is_direct_specular: bool,
    pub scatter: ScatterRows,
    /// Paths of the block that leave the scene.
    pub misses: Vec<u8>,
    /// Vertices on triangles of instances.
    pub instanced: Vec<u8>,
    /// Vertices on emitters.
    pub emitters: Vec<u8>,
    /// Vertices on surfaces that are not diffuse.
    pub non_diffuse: Vec<u8>,
    /// Vertices whose materials have textures.
    pub textured: Vec<u8>,
    pub bsdfs: BsdfTable,
    pub splits: SplitRows,
    /// Vertices where paths may be split.
    pub split_lanes: Vec<u8>,
    pub requests: SampleIdRows,
    /// Choice of a light (two) and a point of it (two).
    pub u_light: SampleRows,
    /// Choice of a lobe (one), a direction (two), roulette (one).
    pub u_bsdf: SampleRows,
}

impl Vertices {
    /// The albedo of a diffuse surface.
    pub fn albedo(&self, lane: usize) -> Rgb {
        self.rows.albedo.get(lane)
    }

    /// Index in the block of the path of a vertex.
    #[inline(always)]
    pub fn path(&self, lane: usize) -> usize {
        self.rows.path[lane] as usize % BATCH
    }

    /// The point, with its parametrisation where the scene needs that.
    pub fn interaction(&self, lane: usize) -> SurfaceInteraction {
        let rows = &self.rows;
        SurfaceInteraction {
            p: self.points.p.get(lane),
            t: rows.t[lane],
            error: rows.error[lane],
            n_g: rows.n_g.get(lane),
            n_s: rows.n_s.get(lane),
            dp_du: rows.dp_du.get(lane),
            uv: rows.uv.get(lane),
            shape: ShapeId(rows.shape[lane]),
            prim: PrimId(rows.prim[lane]),
            instance: InstanceId(rows.instance[lane]),
            time: rows.time[lane],
        }
    }

    /// Sets what [`interaction`](Self::interaction) returns.
    pub fn set_interaction(&mut self, lane: usize, at: &SurfaceInteraction) {
        let rows = &mut self.rows;
        self.points.p.set(lane, at.p);
        (rows.t[lane], rows.error[lane]) = (at.t, at.error);
        rows.n_g.set(lane, at.n_g);
        rows.n_s.set(lane, at.n_s);
        rows.dp_du.set(lane, at.dp_du);
        rows.uv.set(lane, at.uv);
        rows.uv_density[lane] = 0.0;
        (rows.shape[lane], rows.prim[lane], rows.instance[lane]) = (at.shape.0, at.prim.0, at.instance.0);
    }

    /// The normal on the side of the path.
    #[inline(always)]
    pub fn facing_normal(&self, lane: usize) -> Vec3 {
        self.rows.n.get(lane) * 1f32.copysign(self.rows.wo.0[2][lane])
    }

    /// The point and the side of it that light must reach.
    #[inline(always)]
    pub fn light_context(&self, lane: usize) -> LightSampleContext {
        LightSampleContext { p: self.points.p.get(lane), n: self.rows.light_context_n.get(lane) }
    }

    #[inline(always)]
    pub fn frame(&self, lane: usize) -> Frame {
        Frame { x: self.rows.frame_x.get(lane), y: self.rows.frame_y.get(lane), z: self.rows.n.get(lane) }
    }

    /// Whether there is no surface, although the accelerator found a hit.
    #[inline(always)]
    pub fn is_miss(&self, lane: usize) -> bool {
        self.rows.flags[lane] & vertex_flags::MISS != 0
    }

    /// Whether there is a point of a medium in place of a surface.
    #[inline(always)]
    pub fn is_medium(&self, lane: usize) -> bool {
        self.rows.instance[lane] == Hit::MEDIUM.0
    }

    /// The BSDF and its density for the local direction `wi`.
    pub fn eval(&self, scene: &Scene, lane: usize, wi: Vec3) -> BsdfEval {
        let wo = self.rows.wo.get(lane);
        match self.bsdfs.get(scene, lane) {
            None => Lambert { albedo: self.albedo(lane) }.eval(wo, wi),
            Some(bsdf) => bsdf.eval(wo, wi),
        }
    }

    /// The BSDF and its density for the directions of [`eval`](Self::eval) exchanged.
    pub fn reversed_eval(&self, scene: &Scene, lane: usize, wi: Vec3) -> BsdfEval {
        let wo = self.rows.wo.get(lane);
        match self.bsdfs.get(scene, lane) {
            None => Lambert { albedo: self.albedo(lane) }.eval(wi, wo),
            Some(bsdf) => bsdf.eval(wi, wo),
        }
    }

    /// How the light of `direct` leaves a vertex along its path.
    pub fn direct_lobes(&self, scene: &Scene, lane: usize) -> LobeWeights {
        if self.is_direct_specular {
            LobeWeights::Reflected { diffuse: Rgb::BLACK }
        } else {
            self.lobes(scene, lane, self.light_evals.wi.get(lane))
        }
    }

    /// How light from the local direction `wi` leaves a vertex along its path.
    pub fn lobes(&self, scene: &Scene, lane: usize, wi: Vec3) -> LobeWeights {
        match self.bsdfs.get(scene, lane) {
            None => LobeWeights::DIFFUSE,
            Some(bsdf) => LobeWeights::between(bsdf, self.rows.wo.get(lane), wi),
        }
    }

    /// How light from the sampled direction leaves a vertex along its path.
    pub fn sampled_lobes(&self, scene: &Scene, lane: usize) -> LobeWeights {
        match (self.scatter.is_delta[lane] != 0, self.scatter.is_transmission[lane] != 0) {
            (true, true) if self.enters(scene, lane).is_some() => LobeWeights::DIFFUSE,
            (true, true) => LobeWeights::Transmitted,
            (true, false) => LobeWeights::Reflected { diffuse: Rgb::BLACK },
            (false, _) => self.lobes(scene, lane, self.scatter.wi.get(lane)),
        }
    }

    /// The material whose surface the sampled direction enters for a random walk: it has no other delta lobe.
    pub fn enters<'a>(&'a self, scene: &'a Scene, lane: usize) -> Option<&'a Principled> {
        match self.bsdfs.get(scene, lane) {
            Some(Bsdf::Principled(bsdf)) if self.scatter.is_delta[lane] != 0 => Some(bsdf),
            _ => None,
        }
    }

    /// What a mirror or clear glass leaves of features behind it; `None` for all other scattering.
    pub fn feature_factor(&self, lane: usize) -> Option<Rgb> {
        let is_smooth = self.rows.flags[lane] & vertex_flags::DELTA != 0 && self.scatter.is_delta[lane] != 0;
        // Radiance is scaled by refraction, albedo is not, and a path that was split has all features of its sample.
        let factor = self.scatter.rr_factor[lane] / self.splits.remaining(lane);
        is_smooth.then(|| self.scatter.weight.get(lane) * factor)
    }

    /// Clamps what shadow rays contribute.
    pub fn clamp_direct(&mut self, context: &Context) {
        for lane in 0..self.count {
            let contribution = self.direct.contribution.get(lane);
            self.direct.contribution.set(lane, context.config.clamped(contribution, context.bounce + 1));
        }
    }

    /// The target of the light sample of a vertex.
    #[inline(always)]
    pub fn light_target(&self, lane: usize) -> SpawnPoint {
        SpawnPoint {
            p: self.points.target_p.get(lane),
            n: self.light_samples.target_n.get(lane),
            error: self.light_samples.target_error[lane],
        }
    }
}
