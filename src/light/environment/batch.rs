//! Many directions of an image at once: what is computed is computed in rows, and what waits for memory is nothing but
//! copies, which do not wait for one another.

use super::{BandRows, CellDensity, EnvironmentMap, Location};
use crate::color::{Rgb, RgbRows};
use crate::light::{InfiniteLightEvalRows, MisCompensation};
use crate::math::Vec3;
use crate::math::rows::{BATCH, Row, Vec3Rows, soa, whole_vectors};
use crate::math::vectorize::vectorize;
use crate::sampling::{PiecewiseCellRows, PiecewiseScratch};

soa! {
    /// As [`Location`].
    struct LocationRows {
        x: u32,
        y: u32,
        s: f32,
        t: f32,
    }
}

soa! {
    /// The texels at the corners of cells.
    struct CornerRows {
        upper_left: Rgb,
        upper_right: Rgb,
        lower_left: Rgb,
        lower_right: Rgb,
    }
}

soa! {
    /// Light samples from infinity.
    pub struct InfiniteLightSampleRows {
        /// Unit direction to the light.
        wi: Vec3,
        /// Radiance that arrives.
        radiance: Rgb,
        /// Density per solid angle.
        pdf: f32,
    }
}

/// Buffers for many directions of an image.
#[derive(Default)]
pub struct EnvironmentScratch {
    locations: LocationRows,
    corners: CornerRows,
    chosen: PiecewiseScratch,
    cells: PiecewiseCellRows,
    bands: BandRows,
}

impl LocationRows {
    #[inline(always)]
    fn get(&self, i: usize) -> Location {
        Location { x: self.x[i], y: self.y[i], within: [self.s[i], self.t[i]] }
    }

    #[inline(always)]
    fn set(&mut self, i: usize, at: Location) {
        (self.x[i], self.y[i]) = (at.x, at.y);
        [self.s[i], self.t[i]] = at.within;
    }
}

impl CornerRows {
    /// As [`EnvironmentMap::corners`].
    #[inline(always)]
    fn of_cell(&self, i: usize) -> [Rgb; 4] {
        [self.upper_left.get(i), self.upper_right.get(i), self.lower_left.get(i), self.lower_right.get(i)]
    }
}

impl EnvironmentScratch {
    /// [`Environment::eval`](super::Environment::eval) for the first `count` unit directions, at most [`BATCH`]; the
    /// densities only if `compensation` is given.
    pub fn eval(
        &mut self,
        map: &EnvironmentMap,
        directions: &Vec3Rows,
        count: usize,
        compensation: Option<MisCompensation>,
        evals: &mut InfiniteLightEvalRows,
    ) {
        let Self { locations, corners, .. } = self;
        vectorize!(locate(map, directions, locations, count));
        for (&x, &y) in locations.x.iter().zip(&locations.y).take(count) {
            map.prefetch_corners(x as usize, y as usize);
        }
        look_up(map, locations, count, corners, &mut evals.radiance);
        let Some(compensation) = compensation else { return };
        match map.density(compensation) {
            None => evals.pdf = [0.0; BATCH],
            Some(density) => vectorize!(find_pdfs(density, corners, &mut evals.pdf, count)),
        }
    }

    /// [`Environment::sample`](super::Environment::sample) with the first `count` pairs of numbers, at most [`BATCH`];
    /// `false` if there is nothing to find.
    pub fn sample(
        &mut self,
        map: &EnvironmentMap,
        u: &[[f32; 2]; BATCH],
        count: usize,
        compensation: MisCompensation,
        samples: &mut InfiniteLightSampleRows,
    ) -> bool {
        let Some(density) = map.density(compensation) else { return false };
        self.chosen.sample_cells(&density.cells, u, count, &mut self.cells);
        for (i, (&x, &y)) in self.cells.x.iter().zip(&self.cells.y).enumerate().take(count) {
            self.bands.set(i, &map.bands[y as usize]);
            map.prefetch_corners(x as usize, y as usize);
        }
        vectorize!(self.find_directions(map, samples, count));
        look_up(map, &self.locations, count, &mut self.corners, &mut samples.radiance);
        true
    }

    #[inline(always)]
    fn find_directions(&mut self, map: &EnvironmentMap, samples: &mut InfiniteLightSampleRows, count: usize) {
        for i in 0..whole_vectors(count) {
            let (cell, band) = (self.cells.get(i), self.bands.get(i));
            let (wi, at) = map.direction_in(&cell, &band);
            self.locations.set(i, at);
            samples.wi.set(i, wi);
            samples.pdf[i] = cell.pmf * band.inverse_solid_angle;
        }
    }
}

/// The radiance at locations.
fn look_up(
    map: &EnvironmentMap,
    locations: &LocationRows,
    count: usize,
    corners: &mut CornerRows,
    radiance: &mut RgbRows,
) {
    for i in 0..count.min(BATCH) {
        let [a, b, c, d] = map.corners(locations.x[i] as usize, locations.y[i] as usize);
        corners.upper_left.set(i, a);
        corners.upper_right.set(i, b);
        corners.lower_left.set(i, c);
        corners.lower_right.set(i, d);
    }
    vectorize!(interpolate_rows(locations, corners, radiance, count));
}

#[inline(always)]
fn locate(map: &EnvironmentMap, directions: &Vec3Rows, locations: &mut LocationRows, count: usize) {
    for i in 0..whole_vectors(count) {
        locations.set(i, map.locate(directions.get(i)));
    }
}

#[inline(always)]
fn interpolate_rows(locations: &LocationRows, corners: &CornerRows, radiance: &mut RgbRows, count: usize) {
    for i in 0..whole_vectors(count) {
        radiance.set(i, super::interpolate(corners.of_cell(i), locations.get(i).within));
    }
}

#[inline(always)]
fn find_pdfs(density: &CellDensity, corners: &CornerRows, pdfs: &mut Row, count: usize) {
    for (i, pdf) in pdfs[..whole_vectors(count)].iter_mut().enumerate() {
        *pdf = density.pdf(corners.of_cell(i));
    }
}
