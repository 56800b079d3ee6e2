//! Random walks below surfaces, as a segment of their paths.

use super::Context;
use super::block::Vertices;
use super::materials::set_diffuse;
use super::media::{Purpose, random};
use super::wave::Wave;
use crate::color::Rgb;
use crate::integrator::dimensions;
use crate::integrator::subsurface::{Walk, WalkStart};
use crate::math::rows::BATCH;
use crate::sampling::PixelSeed;

/// The walk of the path that goes on from a vertex, if it enters the surface.
pub(super) fn after(context: &Context, vertices: &Vertices, lane: usize) -> Option<Walk> {
    let bsdf = vertices.enters(context.scene, lane)?;
    let (at, direction) = (vertices.interaction(lane), vertices.rows.direction.get(lane));
    let id = context.scene.met_material_id(&at, direction);
    let subsurface = context.scene.subsurface[id.index()]?;
    Some(Walk::new(&subsurface, bsdf.base_color(), &at, direction))
}

/// Takes every path that has entered a surface to where it leaves it, as if it had met that point from outside; the
/// result is how many rays that took. What does not come out has no throughput left.
#[inline(never)]
pub(super) fn walk(context: &Context, wave: &mut Wave) -> u64 {
    let mut traced = 0;
    for index in 0..wave.count {
        let Some(walk) = &wave.walks[index] else { continue };
        let (block, i) = (index / BATCH, index % BATCH);
        let Wave { paths, rays, hits, .. } = wave;
        let paths = &mut paths[block];
        let (seed, sample, carried) = (paths.seed[i], paths.sample[i], paths.throughput.get(i));
        let start = WalkStart {
            ray: rays[block].get(i),
            hit: hits[block].get(i),
            carried,
            u: context.config.sampler.sample_4d(PixelSeed(seed), sample, dimensions::medium(context.bounce)),
            random: random(context, seed, sample, Purpose::Walk),
        };
        let (end, rays_of_walk) = context.world.walk(walk, start);
        traced += rays_of_walk;
        hits[block].set(i, end.as_ref().map(|end| end.hit));
        paths.throughput.set(i, end.as_ref().map_or(Rgb::BLACK, |end| carried * end.weight));
        if let Some(end) = end {
            rays[block].set(i, &end.ray);
        }
    }
    traced
}

/// Makes the vertices of a block where walks end white diffuse surfaces that emit nothing.
pub(super) fn leave(wave: &mut Wave, block: usize) {
    let Wave { vertices, walks, .. } = wave;
    if walks.is_empty() {
        return;
    }
    for lane in 0..vertices.count {
        if vertices.is_miss(lane) || walks[block * BATCH + vertices.path(lane)].is_none() {
            continue;
        }
        vertices.emitters.retain(|&other| usize::from(other) != lane);
        vertices.non_diffuse.retain(|&other| usize::from(other) != lane);
        vertices.rows.flags[lane] = 0;
        set_diffuse(vertices, lane, Rgb::WHITE);
    }
}
