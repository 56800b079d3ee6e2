//! What comes before the world: film, filter, sampler, integrator.

use super::params::Params;
use crate::desc::{AutoDesc, FilterDesc, IntegratorDesc, MAX_SIDE, OutputDesc, PixelTypeDesc};
use crate::error::Result;
use crate::import::foreign::draft::SOBOL_FOR_INDEPENDENT;
use crate::import::foreign::{Draft, Outcome};

/// A directive with a type: `Film "rgb" ...`.
#[derive(Clone, Debug)]
pub struct Typed {
    /// The type.
    pub kind: String,
    /// The parameters.
    pub params: Params,
}

/// Sets the film's size and output.
pub fn set_film(draft: &mut Draft, film: Option<&Typed>) -> Result<()> {
    let (mut width, mut height) = (1280, 720);
    if let Some(Typed { kind, params }) = film {
        let side = |name: &str, default: i64| match params.integer_or(name, default)? {
            side if (1..=i64::from(MAX_SIDE)).contains(&side) => Ok(side as u32),
            side => Err(params.error(format!("{name} must be from 1 to {MAX_SIDE}, not {side}"))),
        };
        (width, height) = (side("xresolution", 1280)?, side("yresolution", 720)?);
        if kind != "rgb" {
            draft.approximated(&params.place, &params.element, "", "written as red, green and blue");
        }
        draft.desc.film.crop = crop(params, [width, height])?;
        if let Some(file) = params.string("filename")? {
            let lower = file.to_lowercase();
            if lower.ends_with(".exr") || lower.ends_with(".png") {
                let mut output = OutputDesc::new(file);
                if !params.bool_or("savefp16", true)? {
                    output.pixel_type = PixelTypeDesc::Float;
                }
                draft.desc.outputs.push(output);
            } else {
                params.ignore("filename", "pictures are written as .exr and .png");
            }
        }
        params.bool_or("savefp16", true)?;
        params.ignore("diagonal", "only lens systems need it");
        params.ignore("maxcomponentvalue", "samples are not cut off");
        if params.string("sensor")?.is_some_and(|sensor| sensor != "cie1931") {
            params.approximate("sensor", "the colours of the CIE observer in place of the sensor's");
        }
        if params.number_or("whitebalance", 0.0)? != 0.0 {
            params.ignore("whitebalance", "colours are not balanced");
        }
        // What [`exposure`] reads.
        params.number("iso")?;
        params.report(draft);
    }
    (draft.desc.film.width, draft.desc.film.height) = (width, height);
    Ok(())
}

fn crop(params: &Params, [width, height]: [u32; 2]) -> Result<Option<[u32; 4]>> {
    let size = [width, height].map(f64::from);
    // Like pbrt: pixels whose lower corner is at or above the bound.
    let bounds = match (params.array("pixelbounds")?, params.array::<4>("cropwindow")?) {
        (_, Some([a, b, c, d])) => {
            let at = |share: f64, side: f64| (share.clamp(0.0, 1.0) * side).ceil();
            [at(a.min(b), size[0]), at(a.max(b), size[0]), at(c.min(d), size[1]), at(c.max(d), size[1])]
        }
        (Some([a, b, c, d]), None) => [a.max(0.0), b.min(size[0]), c.max(0.0), d.min(size[1])],
        (None, None) => return Ok(None),
    };
    let [x0, x1, y0, y1] = bounds.map(|x| x as u32);
    if x1 <= x0 || y1 <= y0 {
        return Err(params.error("no pixel is within the crop window"));
    }
    let whole = [0, 0, width, height];
    let crop = [x0, y0, x1 - x0, y1 - y0];
    Ok((crop != whole).then_some(crop))
}

/// By how much the film brightens light: pbrt's imaging ratio, `exposure time * iso / 100`.
pub fn exposure(film: Option<&Typed>, shutter: [f64; 2]) -> Result<f64> {
    let iso = film.map_or(Ok(100.0), |film| film.params.positive_or("iso", 100.0))?;
    Ok((shutter[1] - shutter[0]) * iso / 100.0)
}

/// Sets the pixel filter.
pub fn set_filter(draft: &mut Draft, filter: Option<&Typed>) -> Result<()> {
    let Some(Typed { kind, params }) = filter else {
        draft.desc.film.filter = FilterDesc::Gaussian { radius: 1.5, sigma: 0.5, samples: None };
        return Ok(());
    };
    let radius = |default: f64| -> Result<f32> {
        let [x, y] = [params.positive_or("xradius", default)?, params.positive_or("yradius", default)?];
        if x != y {
            params.approximate("xradius", "the mean of both radii along both axes");
            params.approximate("yradius", "the mean of both radii along both axes");
        }
        Ok((0.5 * (x + y)) as f32)
    };
    draft.desc.film.filter = match kind.as_str() {
        "box" => FilterDesc::Box { radius: radius(0.5)?, samples: None },
        "triangle" => FilterDesc::Tent { radius: radius(2.0)?, samples: None },
        "gaussian" => FilterDesc::Gaussian {
            radius: radius(1.5)?,
            sigma: params.positive_or("sigma", 0.5)? as f32,
            samples: None,
        },
        "mitchell" => FilterDesc::Mitchell {
            radius: radius(2.0)?,
            b: params.number_or("B", 1.0 / 3.0)? as f32,
            c: params.number_or("C", 1.0 / 3.0)? as f32,
            samples: None,
        },
        "sinc" => {
            draft.approximated(&params.place, &params.element, "", "a Mitchell filter of radius 2");
            radius(4.0)?;
            for name in ["xradius", "yradius", "tau"] {
                params.ignore(name, "a Mitchell filter in place of sinc");
            }
            FilterDesc::Mitchell { radius: 2.0, b: 1.0 / 3.0, c: 1.0 / 3.0, samples: None }
        }
        other => return Err(params.error(format!("unknown pixel filter \"{other}\""))),
    };
    params.report(draft);
    Ok(())
}

/// Sets the number of samples.
pub fn set_sampler(draft: &mut Draft, sampler: Option<&Typed>) -> Result<()> {
    draft.desc.sampler.spp = 16;
    let Some(Typed { kind, params }) = sampler else { return Ok(()) };
    let strata = params.integer_or("xsamples", 4)?.clamp(1, 4096) * params.integer_or("ysamples", 4)?.clamp(1, 4096);
    let default = if kind == "stratified" { strata } else { 16 };
    let spp = params.integer_or("pixelsamples", default)?;
    if !(1..=1 << 30).contains(&spp) {
        return Err(params.error(format!("pixelsamples must be at least 1, not {spp}")));
    }
    draft.desc.sampler.spp = spp as u32;
    if kind == "independent" {
        draft.note(&params.place, &params.element, "", Outcome::Mapped, SOBOL_FOR_INDEPENDENT.into());
    }
    draft.desc.sampler.seed = params.integer_or("seed", 0)?.unsigned_abs();
    params.map_as("randomization", "points are Owen-scrambled, with the same mean");
    params.map_as("jitter", "points are always jittered, with the same mean");
    params.report(draft);
    Ok(())
}

/// Sets the integrator: all that look for light are path tracing.
pub fn set_integrator(draft: &mut Draft, integrator: Option<&Typed>) -> Result<()> {
    let (mut max_depth, mut choice) = (5, AutoDesc::default());
    if let Some(Typed { kind, params }) = integrator {
        max_depth = params.integer_or("maxdepth", 5)?;
        if kind == "ambientocclusion" || kind == "ao" {
            let distance = params.number("maxdistance")?.filter(|distance| *distance > 0.0);
            draft.desc.integrator =
                IntegratorDesc::AmbientOcclusion { distance: distance.map(|distance| distance as f32) };
            params.report(draft);
            return Ok(());
        }
        match kind.as_str() {
            "path" | "volpath" | "simplevolpath" => {}
            "bdpt" => {
                choice = AutoDesc::On;
                let note = "bidirectional path tracing without connections to the camera";
                draft.note(&params.place, &params.element, "", Outcome::Mapped, note.into());
            }
            "mlt" | "sppm" | "simplepath" | "lightpath" | "randomwalk" => {
                draft.approximated(
                    &params.place,
                    &params.element,
                    "",
                    "path tracing, which converges to the same picture",
                );
            }
            other => {
                draft.approximated(&params.place, &params.element, "", format!("path tracing in place of \"{other}\""));
            }
        }
        for name in ["lightsampler", "rrthreshold", "samplelights", "samplebsdf"] {
            params.map_as(name, "it changes the noise only");
        }
        for name in ["visualizestrategies", "visualizeweights"] {
            params.ignore(name, "the picture is rendered, not how it is sampled");
        }
        params.ignore("regularize", "paths are not regularised");
        params.report(draft);
    }
    // pbrt counts bounces, we count segments: one bounce is the light that arrives over two.
    let max_depth = u32::try_from(max_depth.max(0)).unwrap_or(u32::MAX).saturating_add(1);
    draft.desc.integrator = IntegratorDesc::path(max_depth, None);
    if let IntegratorDesc::Path { bidirectional, .. } = &mut draft.desc.integrator {
        *bidirectional = choice;
    }
    Ok(())
}
