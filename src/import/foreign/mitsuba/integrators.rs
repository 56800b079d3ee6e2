//! Integrators.

use super::Reader;
use super::element::Element;
use super::tree::PluginId;
use crate::desc::IntegratorDesc;
use crate::error::Result;

/// The depth for paths of any length.
const UNLIMITED: u32 = 65_536;

/// Mitsuba's default: a file that states it is read like one without it.
const DEFAULT_RR_DEPTH: u32 = 5;

/// What a scene without an integrator is rendered with.
pub(super) fn unlimited_path() -> IntegratorDesc {
    IntegratorDesc::path(UNLIMITED, None)
}

impl Reader<'_> {
    /// Reads an integrator.
    pub(super) fn integrator(&mut self, id: PluginId) -> Result<()> {
        self.guard(id)?;
        self.integrator_within(id)?;
        self.open.pop();
        Ok(())
    }

    fn integrator_within(&mut self, id: PluginId) -> Result<()> {
        let mut element = Element::new(self.document, id);
        let kind = element.kind();
        match kind {
            "moment" | "aov" | "stokes" => {
                match element.one("integrator")? {
                    Some(inner) => self.integrator(inner)?,
                    None => {
                        return Err(element.place().error(format!("the integrator {kind} needs another one inside")));
                    }
                }
                // Moments are beside the picture, which is that of the integrator inside.
                if kind != "moment" {
                    element.approximated("", "only the integrator inside is read; layers are selected by outputs");
                }
                element.finish(&mut self.draft);
                return Ok(());
            }
            "path" | "prb" | "prb_basic" | "direct_projective" | "prb_projective" => {
                self.draft.desc.integrator = path(&mut element)?;
                if kind != "path" {
                    element.approximated("", "path tracing, without derivatives");
                }
            }
            "volpath" | "volpathmis" | "prbvolpath" => {
                self.draft.desc.integrator = path(&mut element)?;
                if kind == "prbvolpath" {
                    element.approximated("", "path tracing, without derivatives");
                }
            }
            "ptracer" => {
                self.draft.desc.integrator = path(&mut element)?;
                element.approximated(
                    "",
                    "path tracing from the camera, which has the same mean, in place of light tracing",
                );
            }
            "direct" | "emission_direct" => {
                self.draft.desc.integrator = IntegratorDesc::path(2, None);
                for name in ["shading_samples", "emitter_samples", "bsdf_samples"] {
                    if element.take(name).is_some() {
                        element.approximated(name, "one sample of each, more samples per pixel have the same mean");
                    }
                }
            }
            "depth" => {
                self.draft.desc.integrator = IntegratorDesc::Depth;
                element.approximated("", "depth along the view axis in place of the length of the ray");
            }
            other => element.ignored("", format!("unsupported integrator {other}: path tracing in its place")),
        }
        if element.boolean("hide_emitters", false)? {
            match &mut self.draft.desc.integrator {
                IntegratorDesc::Path { hide_emitters, .. } => *hide_emitters = true,
                _ => element.ignored("hide_emitters", "surfaces are shown whether or not they emit light"),
            }
        }
        element.finish(&mut self.draft);
        Ok(())
    }
}

/// A path tracer with the depths of an integrator.
fn path(element: &mut Element) -> Result<IntegratorDesc> {
    let max_depth = element.integer("max_depth")?.unwrap_or(-1);
    // A path of no segments sees nothing; the shortest one here sees what emits light.
    let max_depth = u32::try_from(max_depth).unwrap_or(UNLIMITED);
    if max_depth == 0 {
        element.approximated("max_depth", "1 in place of 0: what emits light is seen");
    }
    let rr_depth = element.count("rr_depth", 1)?.filter(|&depth| depth != DEFAULT_RR_DEPTH);
    Ok(IntegratorDesc::path(max_depth.max(1), rr_depth))
}
