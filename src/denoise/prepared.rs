//! The filters of one picture: features first, if they are noisy, then everything that is denoised with their help.

use std::time::Instant;

use super::clean::{neighbours, replace_non_finite};
use super::noise::Mosaic;
use super::oidn::{Inputs, Triple};
use super::split::scale_to_sum;
use super::{Denoiser, Feature, Report};
use crate::error::Result;

/// A picture's features without noise, and what was done so far.
pub struct Prepared<'d> {
    denoiser: &'d Denoiser,
    size: [usize; 2],
    albedo: Option<Vec<Triple>>,
    normal: Option<Vec<Triple>>,
    report: Report,
    start: Instant,
}

impl<'d> Prepared<'d> {
    /// Takes the features of a picture of `size` (width, height) pixels, row by row, and denoises those that are noisy.
    /// Albedo is cut to 0..1, normals to -1..1. Features that are 0 everywhere hold no information and are left out, as
    /// are normals without albedo, which the library has no use for.
    pub fn new(
        denoiser: &'d Denoiser,
        size: [usize; 2],
        albedo: Option<Vec<Triple>>,
        normal: Option<Vec<Triple>>,
    ) -> Result<Self> {
        let report = Report { version: denoiser.version(), ..Report::default() };
        let mut prepared = Self { denoiser, size, albedo: None, normal: None, report, start: Instant::now() };
        let is_not_black = |pixels: &Vec<Triple>| pixels.as_flattened().iter().any(|v| *v != 0.0);
        let Some(albedo) = albedo.filter(is_not_black) else { return Ok(prepared) };
        let (albedo, use_of_albedo) =
            prepared.feature(albedo, 0.0, |albedo| Inputs { albedo: Some(albedo), ..Inputs::default() })?;
        (prepared.albedo, prepared.report.albedo) = (Some(albedo), use_of_albedo);
        if let Some(normal) = normal.filter(is_not_black) {
            let (normal, use_of_normal) =
                prepared.feature(normal, -1.0, |normal| Inputs { normal: Some(normal), ..Inputs::default() })?;
            (prepared.normal, prepared.report.normal) = (Some(normal), use_of_normal);
        }
        Ok(prepared)
    }

    /// A feature between `least` and 1, denoised if it is noisy.
    fn feature(
        &mut self,
        mut pixels: Vec<Triple>,
        least: f32,
        inputs: impl Fn(&[Triple]) -> Inputs,
    ) -> Result<(Vec<Triple>, Feature)> {
        self.clean(&mut pixels);
        pixels.as_flattened_mut().iter_mut().for_each(|v| *v = v.clamp(least, 1.0));
        if let Some(mosaic) = Mosaic::of_noisiest(&pixels, self.size) {
            let filtered = self.filter(mosaic.size, inputs(&mosaic.pixels))?;
            if !mosaic.is_noisy(&filtered) {
                return Ok((pixels, Feature::Clean));
            }
        }
        let filtered = self.filter(self.size, inputs(&pixels))?;
        Ok((filtered, Feature::Prefiltered))
    }

    /// Denoises the picture: linear colours of any size; negative ones count as 0.
    pub fn picture(&mut self, name: &str, mut color: Vec<Triple>) -> Result<Vec<Triple>> {
        self.clean(&mut color);
        self.report.negative += color.iter().filter(|pixel| pixel.iter().any(|v| *v < 0.0)).count() as u64;
        self.report.layers.push(name.to_owned());
        self.color(&color)
    }

    /// Denoises layers that add up to the picture, and scales them so that they add up to `total`, the picture
    /// denoised.
    pub fn parts(&mut self, total: &[Triple], names: &[String], parts: Vec<Vec<Triple>>) -> Result<Vec<Vec<Triple>>> {
        let mut denoised = Vec::with_capacity(parts.len());
        for mut part in parts {
            self.clean(&mut part);
            denoised.push(self.color(&part)?);
        }
        scale_to_sum(total, &mut denoised.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
        self.report.layers.extend_from_slice(names);
        Ok(denoised)
    }

    /// Denoises alpha, unless it has no value but 0 and 1. Pixels that are 0 like all around them stay 0, those that
    /// are 1 stay 1.
    pub fn alpha(&mut self, alpha: &[f32]) -> Result<Vec<f32>> {
        let mut noisy: Vec<Triple> = alpha.iter().map(|&a| [a; 3]).collect();
        self.clean(&mut noisy);
        noisy.as_flattened_mut().iter_mut().for_each(|v| *v = v.clamp(0.0, 1.0));
        if noisy.iter().all(|[a, ..]| *a == 0.0 || *a == 1.0) {
            return Ok(noisy.iter().map(|[a, ..]| *a).collect());
        }
        let denoised = self.filter(self.size, self.with_features(&noisy))?;
        let width = self.size[0];
        Ok((0..noisy.len())
            .map(|i| {
                let [own, ..] = noisy[i];
                let flat = (own == 0.0 || own == 1.0) && neighbours(i, width, noisy.len()).all(|j| noisy[j][0] == own);
                if flat { own } else { denoised[i].iter().sum::<f32>() / 3.0 }
            })
            .collect())
    }

    /// What was done, with the time since the start.
    pub fn finish(mut self) -> Report {
        self.report.seconds = self.start.elapsed().as_secs_f64();
        self.report
    }

    fn with_features<'a>(&'a self, color: &'a [Triple]) -> Inputs<'a> {
        let clean_features = self.albedo.is_some();
        Inputs {
            color: Some(color),
            albedo: self.albedo.as_deref(),
            normal: self.normal.as_deref(),
            clean_features,
            ..Inputs::default()
        }
    }

    fn color(&self, color: &[Triple]) -> Result<Vec<Triple>> {
        if color.as_flattened().iter().all(|v| *v <= 0.0) {
            return Ok(vec![[0.0; 3]; color.len()]);
        }
        self.filter(self.size, Inputs { hdr: true, ..self.with_features(color) })
    }

    fn filter(&self, size: [usize; 2], inputs: Inputs) -> Result<Vec<Triple>> {
        let mut output = vec![[0.0; 3]; size[0] * size[1]];
        self.denoiser.device.filter(size, inputs, &mut output)?;
        Ok(output)
    }

    fn clean(&mut self, pixels: &mut [Triple]) {
        self.report.cleaned += replace_non_finite(pixels, self.size[0]);
    }
}
