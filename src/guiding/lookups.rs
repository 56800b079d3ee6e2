//! Lookups in the distributions of many vertices at once: all arithmetic in vector code, and searches that wait for
//! memory together.

use super::directions::{Cell, CurvePoint, DirectionDistribution, LightPoint, SearchTree};
use crate::math::Vec3;
use crate::math::rows::{BATCH, Row, Vec3Rows, soa, whole_vectors};
use crate::math::vectorize::vectorize;

/// The distribution to look up in each lane, if any.
pub type Distributions<'a> = [Option<&'a DirectionDistribution>; BATCH];

soa! {
    /// What is looked up, and the cells that were found.
    struct LookupRows {
        /// The key that is searched for: a place on the curve, or an amount of light.
        number: u32,
        /// As in [`CurvePoint`].
        per_angle: f32,
        /// As in [`LightPoint`].
        fraction: f32,
        /// As in [`Cell`].
        start: u32,
        end: u32,
        light_before: u32,
        light: u32,
    }
}

soa! {
    /// Sampled directions.
    pub struct GuideSampleRows {
        /// Unit, in the world.
        direction: Vec3,
        /// Density per solid angle; zero where there is no sample.
        pdf: f32,
    }
}

/// Lookups of a block of vertices.
#[derive(Default)]
pub struct DirectionLookups {
    rows: LookupRows,
}

impl DirectionLookups {
    /// The densities per solid angle with which distributions choose these directions; zero where there is none.
    pub fn find_pdfs(&mut self, distributions: &Distributions, directions: &Vec3Rows, pdf: &mut Row, count: usize) {
        let rows = &mut self.rows;
        vectorize!(find_curve_points(directions, rows, count));
        vectorize!(search(distributions, SearchTree::Places, rows, count));
        vectorize!(find_densities(rows, pdf, count));
    }

    /// A direction from each distribution by two random numbers in `[0, 1)`.
    pub fn sample(
        &mut self,
        distributions: &Distributions,
        [u, v]: [&Row; 2],
        samples: &mut GuideSampleRows,
        count: usize,
    ) {
        let rows = &mut self.rows;
        vectorize!(find_light_points(u, rows, count));
        vectorize!(search(distributions, SearchTree::Light, rows, count));
        vectorize!(place_samples(rows, v, &mut samples.direction, count));
        vectorize!(find_densities(rows, &mut samples.pdf, count));
    }
}

#[inline(always)]
fn find_curve_points(directions: &Vec3Rows, rows: &mut LookupRows, count: usize) {
    for i in 0..whole_vectors(count) {
        let point = CurvePoint::of(directions.get(i));
        (rows.number[i], rows.per_angle[i]) = (point.place, point.per_angle);
    }
}

#[inline(always)]
fn find_light_points(u: &Row, rows: &mut LookupRows, count: usize) {
    for (i, &u) in u.iter().enumerate().take(whole_vectors(count)) {
        let point = LightPoint::of(u);
        (rows.number[i], rows.fraction[i]) = (point.light, point.fraction);
    }
}

/// Finds the cell of each lane; one without light where there is no distribution.
#[inline(always)]
fn search(distributions: &Distributions, tree: SearchTree, rows: &mut LookupRows, count: usize) {
    let mut begun = [0; BATCH];
    for i in 0..count.min(BATCH) {
        if let Some(distribution) = distributions[i] {
            begun[i] = distribution.begin(tree, rows.number[i]);
        }
    }
    for i in 0..count.min(BATCH) {
        let cell = match distributions[i] {
            Some(distribution) => distribution.finish(tree, rows.number[i], begun[i]),
            None => Cell::UNLIT,
        };
        (rows.start[i], rows.end[i]) = (cell.start, cell.end);
        (rows.light_before[i], rows.light[i]) = (cell.light_before, cell.light);
    }
}

#[inline(always)]
fn cell(rows: &LookupRows, i: usize) -> Cell {
    Cell { start: rows.start[i], end: rows.end[i], light_before: rows.light_before[i], light: rows.light[i] }
}

#[inline(always)]
fn find_densities(rows: &LookupRows, pdf: &mut Row, count: usize) {
    for (i, pdf) in pdf.iter_mut().enumerate().take(whole_vectors(count)) {
        let density = cell(rows, i).density();
        // Directions that are not looked up may have no density per angle.
        *pdf = if density > 0.0 { density * rows.per_angle[i] } else { 0.0 };
    }
}

#[inline(always)]
fn place_samples(rows: &mut LookupRows, v: &Row, directions: &mut Vec3Rows, count: usize) {
    for (i, &v) in v.iter().enumerate().take(whole_vectors(count)) {
        let point = LightPoint { light: rows.number[i], fraction: rows.fraction[i] };
        let (direction, per_angle) = cell(rows, i).direction(point, v);
        directions.set(i, direction);
        rows.per_angle[i] = per_angle;
    }
}
