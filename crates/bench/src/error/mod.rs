//! Error against time: variants of a render, and other renderers, beside a reference, in one run.
//!
//! Repeats go over all variants in turn, each with a seed of its own, so that whatever else the machine does falls on
//! all alike.

mod bias;
mod external;
mod peers;
mod plan;
mod report;
mod summary;
mod tax;
mod viewer;

pub use external::External;
pub use peers::{Peer, PeerOptions};
pub use plan::{Budget, ErrorOptions, Standard, Subject, Variant};
pub use summary::{Bias, EqualError, ErrorReport, Point, ReferenceInfo, Run, VariantReport};
pub use tax::TaxReport;
pub use viewer::Pictures;

use std::sync::atomic::AtomicBool;

use self::bias::Blocks;
use self::plan::{Measured, Program};
use super::{Machine, Watch};
use crate::film::Image;
use crate::output::{Comparison, compare};
use crate::scene::Scene;
use steradian::{Error, Result};

/// Seeds of repeats follow one another; those of the halves that stand in for a reference are this far away.
const HALVES_SEED: u64 = 1 << 32;

/// What is rendered against.
struct Reference {
    image: Image,
    info: ReferenceInfo,
    /// Errors of the reference itself, subtracted from those measured: MSE, relMSE, trimmed relMSE.
    floor: [f64; 3],
}

/// Measures the error of every variant with every budget. `after` is given what there is after each repeat; a run that
/// is ended early gives what there is.
///
/// # Errors
/// If a render or an external command fails, or a picture is of another size than the reference.
pub fn bench_error(
    scene: &Scene,
    options: &ErrorOptions,
    watch: &dyn Watch,
    stop: &AtomicBool,
    mut after: impl FnMut(&ErrorReport) -> Result<()>,
) -> Result<ErrorReport> {
    if options.tax {
        tax::subject(options)?;
    }
    let machine = Machine::here();
    let mut program = Program::new(scene, options, stop)?;
    let mut report = ErrorReport::new(machine, options);
    for (v, variant) in options.variants.iter().enumerate() {
        if !watch.is_stopped() {
            watch.step(&format!("{}: warming up", variant.name));
            program.warm_up(v)?;
        }
    }
    let Some(reference) = reference(&program, options, watch)? else {
        report.interrupted = true;
        return Ok(report);
    };
    report.reference = reference.info.clone();
    report.pictures = Pictures::new(&reference.image)?;
    let all_fit = report.pictures.fit(options.variants.len() * options.budgets.len());
    let mut blocks = vec![vec![Blocks::default(); options.budgets.len()]; options.variants.len()];
    'all: for repeat in 0..options.repeats {
        for (b, budget) in options.budgets.iter().enumerate() {
            for (v, variant) in options.variants.iter().enumerate() {
                watch.step(&format!("repeat {} of {}: {budget}, {}", repeat + 1, options.repeats, variant.name));
                let seed = options.seed.wrapping_add(repeat as u64);
                let Some(measured) = program.render(v, *budget, seed)? else { break 'all };
                let mut run = judge(&reference, &measured, &variant.name)?;
                if repeat == 0 {
                    if all_fit || Some(*budget) == options.largest_budget() {
                        report.pictures.add(v, b, &measured.image);
                    }
                    let name = (Some(*budget) == options.largest_budget()).then_some(variant.name.as_str());
                    run.flip = Some(report.pictures.flip(&reference.image, &measured.image, name)?);
                }
                if measured.process_seconds.is_none() {
                    report.spent.add(measured.spent);
                }
                blocks[v][b].add(&reference.image, &measured.image);
                report.add(v, b, Run { repeat, seed, ..run });
            }
        }
        report.summarize(&blocks);
        after(&report)?;
    }
    report.summarize(&blocks);
    if options.tax && !watch.is_stopped() {
        report.tax = tax::bench_tax(scene, options, watch, stop)?;
    }
    report.interrupted = report.runs() < options.runs() || options.tax && report.tax.is_none();
    Ok(report)
}

/// The reference of the options, or the mean of two renders with the largest budget; `None` if interrupted.
fn reference(program: &Program, options: &ErrorOptions, watch: &dyn Watch) -> Result<Option<Reference>> {
    if let Standard::File(path, image) = &options.reference {
        let info = ReferenceInfo { file: Some(path.display().to_string()), halves_spp: None, noise_relmse: None };
        return Ok(Some(Reference { image: image.clone(), info, floor: [0.0; 3] }));
    }
    let Some(budget) = options.largest_budget() else { return Ok(None) };
    let mut halves = Vec::new();
    for half in 0..2 {
        watch.step(&format!(
            "no reference: half {} of 2, {budget}, {}",
            half + 1,
            options.variants.first().map_or("", |v| &v.name)
        ));
        let Some(measured) = program.render(0, budget, options.seed.wrapping_add(HALVES_SEED + half))? else {
            return Ok(None);
        };
        halves.push(measured);
    }
    let [a, b] = &halves[..] else { return Ok(None) };
    let (mean, differences) = mean_of_halves(&a.image, &b.image)?;
    let info = ReferenceInfo {
        file: None,
        halves_spp: a.spp.zip(b.spp).map(|(a, b)| a.midpoint(b)),
        noise_relmse: Some(differences[1]),
    };
    Ok(Some(Reference { image: mean, info, floor: differences }))
}

/// The mean of two pictures, and its errors (MSE, relMSE, trimmed relMSE): independent halves differ by four times its
/// variance.
fn mean_of_halves(a: &Image, b: &Image) -> Result<(Image, [f64; 3])> {
    let mut mean = a.clone();
    for (layer, other) in mean.layers.iter_mut().zip(&b.layers) {
        for (x, y) in layer.data.iter_mut().zip(&other.data) {
            *x = 0.5 * (*x + *y);
        }
    }
    // The first half differs from the mean by half of the difference.
    let c = compare(&mean, a)?;
    Ok((mean, [c.mse, c.relmse, c.relmse_trimmed]))
}

/// The figures of one picture.
fn judge(reference: &Reference, measured: &Measured, name: &str) -> Result<Run> {
    let [r, t] = [reference.image.crop, measured.image.crop];
    if [r.width, r.height] != [t.width, t.height] {
        return Err(Error::Usage(format!(
            "{name}: the picture has {}x{} pixels, the reference {}x{}",
            t.width, t.height, r.width, r.height
        )));
    }
    let Comparison { mse, relmse, relmse_trimmed, mean_ratio, nan, inf, .. } =
        compare(&reference.image, &measured.image)?;
    let [mse, relmse, relmse_trimmed] =
        [mse - reference.floor[0], relmse - reference.floor[1], relmse_trimmed - reference.floor[2]];
    let efficiency = (relmse > 0.0 && measured.seconds > 0.0).then(|| 1.0 / (relmse * measured.seconds));
    Ok(Run {
        repeat: 0,
        seed: 0,
        spp: measured.spp,
        seconds: measured.seconds,
        process_seconds: measured.process_seconds,
        processor_seconds: measured.spent.processor_seconds,
        mse,
        relmse,
        relmse_trimmed,
        flip: None,
        mean_ratio,
        not_finite: nan + inf + measured.dropped,
        msamples_per_second: measured.samples.map(|n| n as f64 / measured.seconds.max(1e-9) * 1e-6),
        mrays_per_second: measured.rays.map(|n| n as f64 / measured.seconds.max(1e-9) * 1e-6),
        efficiency,
    })
}

#[cfg(test)]
mod tests;
