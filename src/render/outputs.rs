//! The files that a picture is written to: those of the scene file, and the overrides of the caller.

use super::settings::refused;
use super::{ExrOverrides, Overrides};
use crate::desc::{IntegratorDesc, OutputDesc, PixelTypeDesc, SceneDesc};
use crate::error::Result;
use crate::output::check_output;

/// The files, in their order; an error for overrides that none of them could have.
pub(super) fn outputs(desc: &SceneDesc, overrides: &Overrides, integrator: &IntegratorDesc) -> Result<Vec<OutputDesc>> {
    let by_name = |names: &[String]| -> Vec<OutputDesc> { names.iter().map(OutputDesc::new).collect() };
    let mut outputs = if !overrides.outputs.is_empty() {
        by_name(&overrides.outputs)
    } else if !desc.outputs.is_empty() {
        desc.outputs.clone()
    } else {
        by_name(&overrides.default_outputs)
    };
    let has_extension = |output: &OutputDesc, extension: &str| output.file.to_ascii_lowercase().ends_with(extension);
    let needs = |setting: &'static str, given: bool, extension: &str| {
        if given && !outputs.iter().any(|output| has_extension(output, extension)) {
            return Err(refused(setting, format!(" has no effect: no output is an {extension} file")));
        }
        Ok(())
    };
    needs("layers", !overrides.layers.is_empty(), ".exr")?;
    needs("float", overrides.float.is_some(), ".exr")?;
    // The frame rate of a sequence is there in any case.
    let exr = ExrOverrides { frames_per_second: None, ..overrides.exr.clone() };
    needs("exr", exr != ExrOverrides::default(), ".exr")?;
    needs("exposure", overrides.exposure.is_some(), ".png")?;
    needs("view", overrides.view.is_some(), ".png")?;
    if overrides.exposure.is_some_and(|stops| !stops.is_finite()) {
        return Err(refused("exposure", ": a finite number of stops"));
    }
    for output in &mut outputs {
        if has_extension(output, ".exr") {
            if !overrides.layers.is_empty() {
                output.layers.clone_from(&overrides.layers);
            }
            if let Some(float) = overrides.float {
                output.pixel_type = if float { PixelTypeDesc::Float } else { PixelTypeDesc::Half };
            }
            overrides.exr.apply(output);
            check_output(output)?;
        }
        if has_extension(output, ".png") {
            output.exposure = overrides.exposure.unwrap_or(output.exposure);
            output.view = overrides.view.or(output.view).or(Some(integrator.view()));
        }
    }
    Ok(outputs)
}
