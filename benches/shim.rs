//! Embree through this crate, on rays recorded in a file, for comparison with bare loops in C: see `bare_embree.sh`,
//! which runs both.
//!
//! `shim dump FOLDER RESOLUTION` writes a file for each model; `shim trace FILE PASSES` prints
//! `set query ns_per_ray hits checksum` a line, timed as in C: the sum over blocks of rays of the smallest time of all
//! passes, which other load on the machine hardly touches.

use std::error::Error;
use std::hint::black_box;
use std::io::{self, Read, Write};
use std::path::Path;
use std::time::Instant;
use std::{env, fs};

use steradian::internal::accel::{Accelerator, AnyHitRays, Coherence, EmbreeAccel, HitRows};
use steradian::internal::geometry::{Geometry, Hit, Mesh, Shape};
use steradian::internal::id::ShapeId;
use steradian::internal::math::rows::BATCH;
use steradian::internal::math::{Ray, RayRows, Vec3};
use steradian_benches::models;
use steradian_benches::rays::ray_sets;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).filter(|a| a != "--bench").collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["dump", folder, resolution] => dump(Path::new(folder), resolution.parse()?),
        ["trace", file, passes] => trace(Path::new(file), passes.parse()?),
        _ => {
            println!("usage: shim dump FOLDER RESOLUTION | shim trace FILE PASSES; benches/bare_embree.sh runs both");
            Ok(())
        }
    }
}

fn dump(folder: &Path, resolution: usize) -> Result<(), Box<dyn Error>> {
    for model in [models::hare(94), models::hills(361)].into_iter().chain(models::scans()) {
        let accel = EmbreeAccel::new(&model.geometry, 0)?;
        let sets = ray_sets(&model, &accel, resolution);
        let mesh = model.mesh();
        let mut file = io::BufWriter::new(fs::File::create(folder.join(model.name).with_extension("rays"))?);
        for count in [mesh.positions().len(), mesh.triangles().len(), sets.len()] {
            file.write_all(&u32::try_from(count)?.to_le_bytes())?;
        }
        for number in mesh.positions().iter().flatten() {
            file.write_all(&number.to_le_bytes())?;
        }
        for index in mesh.triangles().iter().flatten() {
            file.write_all(&index.to_le_bytes())?;
        }
        for set in sets {
            let mut name = [0; 8];
            name[..set.name.len()].copy_from_slice(set.name.as_bytes());
            file.write_all(&name)?;
            file.write_all(&u32::try_from(set.rays.len())?.to_le_bytes())?;
            for ray in &set.rays {
                let [o, d] = [ray.origin, ray.direction];
                for number in [o.x, o.y, o.z, ray.t_min, d.x, d.y, d.z, ray.t_max, ray.time] {
                    file.write_all(&number.to_le_bytes())?;
                }
            }
        }
        file.flush()?;
    }
    Ok(())
}

/// Reads little-endian words.
struct Words(Box<dyn Read>);

impl Words {
    fn array<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.0.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    fn index(&mut self) -> io::Result<u32> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn number(&mut self) -> io::Result<f32> {
        Ok(f32::from_le_bytes(self.array()?))
    }

    fn vector(&mut self) -> io::Result<Vec3> {
        Ok(Vec3::new(self.number()?, self.number()?, self.number()?))
    }

    fn ray(&mut self) -> io::Result<Ray> {
        let (origin, t_min) = (self.vector()?, self.number()?);
        let (direction, t_max) = (self.vector()?, self.number()?);
        Ok(Ray { origin, t_min, direction, t_max, time: self.number()? })
    }
}

fn trace(file: &Path, passes: usize) -> Result<(), Box<dyn Error>> {
    let mut words = Words(Box::new(io::BufReader::new(fs::File::open(file)?)));
    let [vertices, triangles, sets] = [words.index()?, words.index()?, words.index()?];
    let positions = (0..vertices).map(|_| Ok(words.vector()?.to_array())).collect::<io::Result<_>>()?;
    let triangles =
        (0..triangles).map(|_| Ok([words.index()?, words.index()?, words.index()?])).collect::<io::Result<_>>()?;
    let shape = Shape::Mesh(Mesh::new(positions, triangles, None, None)?);
    let geometry = Geometry { shapes: vec![shape], world: vec![ShapeId(0)], ..Geometry::default() };
    let accel = EmbreeAccel::new(&geometry, 1)?;
    for _ in 0..sets {
        let name = String::from_utf8(words.array::<8>()?.into_iter().take_while(|&c| c != 0).collect())?;
        let count = words.index()?;
        let rays: Vec<Ray> = (0..count).map(|_| words.ray()).collect::<io::Result<_>>()?;
        measure(&accel, &name, &rays[..rays.len() / BLOCK * BLOCK], passes);
    }
    Ok(())
}

/// The query of every ray.
#[derive(Clone, Copy)]
enum Query {
    Closest(Option<Coherence>),
    Any(Option<Coherence>),
}

const QUERIES: [(&str, Query); 6] = [
    ("closest_1", Query::Closest(None)),
    ("closest_16", Query::Closest(Some(Coherence::Incoherent))),
    ("closest_16_coherent", Query::Closest(Some(Coherence::Coherent))),
    ("any_1", Query::Any(None)),
    ("any_16", Query::Any(Some(Coherence::Incoherent))),
    ("any_16_coherent", Query::Any(Some(Coherence::Coherent))),
];

/// Rays that are timed together.
const BLOCK: usize = 1024;

fn measure(accel: &dyn Accelerator, name: &str, rays: &[Ray], passes: usize) {
    let mut found =
        Found { hits: vec![HitRows::default(); BLOCK / BATCH], occluded: vec![[false; BATCH]; BLOCK / BATCH] };
    let rows: Vec<RayRows> = rays.chunks(BATCH).map(RayRows::of).collect();
    let mut best = vec![[f64::INFINITY; QUERIES.len()]; rays.len() / BLOCK];
    let mut answers = [Answer::default(); QUERIES.len()];
    for pass in 0..=passes {
        answers = Default::default();
        for (i, (_, query)) in QUERIES.iter().enumerate() {
            for (((block, rays), rows), best) in
                rays.chunks(BLOCK).enumerate().zip(rows.chunks(BLOCK / BATCH)).zip(&mut best)
            {
                let (first, answer) = (block * BLOCK, &mut answers[i]);
                let start = Instant::now();
                run(*query, black_box(accel), (rays, rows), first, &mut found, answer);
                let time = start.elapsed().as_nanos() as f64;
                // The first pass warms up.
                if pass > 0 {
                    best[i] = best[i].min(time);
                }
                gather(*query, first, &found, answer);
            }
        }
    }
    for (i, ((query, _), Answer { number, sum })) in QUERIES.iter().zip(answers).enumerate() {
        let time = best.iter().map(|best| best[i]).sum::<f64>() / rays.len() as f64;
        println!("{name} {query} {time:.2} {number} {sum}");
    }
}

/// The number of hits, and a sum that depends on every number of every hit and on their order.
#[derive(Clone, Copy, Default)]
struct Answer {
    number: u64,
    sum: u64,
}

impl Answer {
    #[inline(always)]
    fn take(&mut self, ray: usize, hit: &Hit) {
        let Hit { t, u, v, shape, prim, instance } = hit;
        let words = [t.to_bits(), u.to_bits(), v.to_bits(), prim.0, shape.0, instance.0].map(u64::from);
        self.add(ray, words.iter().sum());
    }

    #[inline(always)]
    fn add(&mut self, ray: usize, term: u64) {
        self.number += 1;
        self.sum = self.sum.wrapping_add(term.wrapping_mul(ray as u64 + 1));
    }
}

/// What batches find.
struct Found {
    hits: Vec<HitRows>,
    occluded: Vec<[bool; BATCH]>,
}

/// Traces a block of rays from number `first` on: hits of single rays are taken into the answer at once, those of
/// batches go to `found`.
#[inline(never)]
fn run(
    query: Query,
    accel: &dyn Accelerator,
    (rays, rows): (&[Ray], &[RayRows]),
    first: usize,
    found: &mut Found,
    answer: &mut Answer,
) {
    match query {
        Query::Closest(None) => {
            for (i, ray) in rays.iter().enumerate() {
                if let Some(hit) = accel.intersect(ray) {
                    answer.take(first + i, &hit);
                }
            }
        }
        Query::Any(None) => {
            for (i, ray) in rays.iter().enumerate() {
                if accel.occluded(ray) {
                    answer.add(first + i, 1);
                }
            }
        }
        Query::Closest(Some(coherence)) => {
            rows.iter()
                .zip(&mut found.hits)
                .for_each(|(rows, hits)| accel.intersect_rows(rows, BATCH, hits, coherence));
        }
        Query::Any(Some(coherence)) => {
            rows.iter()
                .zip(&mut found.occluded)
                .for_each(|(rows, occluded)| accel.occluded_rows(AnyHitRays::new(rows, BATCH), occluded, coherence));
        }
    }
}

/// Takes what batches have found.
fn gather(query: Query, first: usize, found: &Found, answer: &mut Answer) {
    match query {
        Query::Closest(Some(_)) => {
            let hits = found.hits.iter().flat_map(|hits| (0..BATCH).map(|lane| hits.get(lane)));
            hits.enumerate().filter_map(|(i, hit)| Some((i, hit?))).for_each(|(i, hit)| answer.take(first + i, &hit));
        }
        Query::Any(Some(_)) => {
            let occluded = found.occluded.iter().flatten();
            occluded.enumerate().filter(|(_, occluded)| **occluded).for_each(|(i, _)| answer.add(first + i, 1));
        }
        Query::Closest(None) | Query::Any(None) => {}
    }
}
