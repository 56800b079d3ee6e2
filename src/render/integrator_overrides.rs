//! Settings that change the integrator.

use super::Overrides;
use super::settings::refused;
use crate::desc::{AutoDesc, CausticsDesc, DEFAULT_RR_DEPTH, IntegratorDesc, RouletteDesc, SceneDesc, StrategyDesc};
use crate::error::Result;

/// The integrator of a scene, with the parameters that settings change.
pub(super) fn integrator(desc: &SceneDesc, overrides: &Overrides) -> Result<IntegratorDesc> {
    let mut integrator = match overrides.integrator {
        Some(chosen) if std::mem::discriminant(&chosen) != std::mem::discriminant(&desc.integrator) => chosen,
        _ => desc.integrator,
    };
    if let Some(depth) = overrides.max_depth {
        match &mut integrator {
            IntegratorDesc::Path { max_depth, .. } | IntegratorDesc::Whitted { max_depth, .. } if depth > 0 => {
                *max_depth = depth;
            }
            IntegratorDesc::Path { .. } | IntegratorDesc::Whitted { .. } => {
                return Err(refused("max_depth", " 0: depth counts from 1, directly visible light"));
            }
            _ => {
                return Err(refused(
                    "max_depth",
                    ": only the integrators path and whitted follow light over several segments",
                ));
            }
        }
    }
    if let Some(chosen) = overrides.strategy {
        let IntegratorDesc::Path { strategy, .. } = &mut integrator else {
            return Err(refused("strategy", ": only the integrator path has strategies"));
        };
        *strategy = chosen;
    }
    set_roulette(&mut integrator, overrides)?;
    if let Some(limit) = overrides.clamp {
        let IntegratorDesc::Path { clamp, .. } = &mut integrator else {
            return Err(refused("clamp", ": only the integrator path can be clamped"));
        };
        if !(limit > 0.0) {
            return Err(refused("clamp", format!(" {limit}: a number above 0, or inf for no limit")));
        }
        *clamp = Some(limit).filter(|limit| limit.is_finite());
    }
    if let Some(alpha) = overrides.regularize {
        let IntegratorDesc::Path { regularize, .. } = &mut integrator else {
            return Err(refused("regularize", ": only the integrator path makes surfaces rougher"));
        };
        if !(0.0..=1.0).contains(&alpha) {
            return Err(refused("regularize", format!(" {alpha}: an alpha within 0 and 1, 0 for none")));
        }
        *regularize = Some(alpha).filter(|&alpha| alpha > 0.0);
    }
    set_guiding(&mut integrator, overrides)?;
    set_caustics(&mut integrator, overrides)?;
    set_bidirectional(&mut integrator, overrides)?;
    Ok(integrator)
}

fn set_roulette(integrator: &mut IntegratorDesc, overrides: &Overrides) -> Result<()> {
    if let Some(chosen) = overrides.roulette {
        let IntegratorDesc::Path { roulette, rr_depth, .. } = integrator else {
            return Err(refused("roulette", ": only the integrator path plays Russian roulette"));
        };
        *roulette = Some(chosen);
        // Scenes of other renderers disable roulette by a depth that no path reaches.
        if chosen == RouletteDesc::Throughput {
            *rr_depth = rr_depth.map(|depth| depth.min(DEFAULT_RR_DEPTH));
        }
    }
    Ok(())
}

fn set_guiding(integrator: &mut IntegratorDesc, overrides: &Overrides) -> Result<()> {
    if let Some(chosen) = overrides.guiding {
        match integrator {
            IntegratorDesc::Path { guiding, .. } => *guiding = chosen,
            _ if chosen == AutoDesc::On => {
                return Err(refused("guiding", ": only the integrator path can be guided"));
            }
            _ => {}
        }
    }
    if overrides.guide.is_some() {
        let IntegratorDesc::Path { guiding, .. } = integrator else {
            return Err(refused("guide", ": only the integrator path can be guided"));
        };
        // The guide is not trained further, whatever the scene says.
        *guiding = AutoDesc::Off;
    }
    if matches!(integrator, IntegratorDesc::Path { guiding: AutoDesc::On, .. }) && overrides.target_error.is_some() {
        return Err(refused(
            "target_error",
            ": not with guiding; give `guide`, `guiding` off, or `spp` or `time_limit` in its place",
        ));
    }
    Ok(())
}

fn set_caustics(integrator: &mut IntegratorDesc, overrides: &Overrides) -> Result<()> {
    let unsupported = unsupported_with_photons(integrator, overrides.guide.is_some(), overrides.target_error.is_some());
    let IntegratorDesc::Path { caustics, .. } = integrator else {
        return match overrides.caustics {
            Some(CausticsDesc::Photons) => {
                Err(refused("caustics", " photons: only the integrator path traces photons"))
            }
            _ => Ok(()),
        };
    };
    *caustics = overrides.caustics.unwrap_or(*caustics);
    match (*caustics, unsupported) {
        (CausticsDesc::Photons, Some(option)) => {
            Err(refused("caustics", format!(" photons: unsupported with {option}; give `caustics` paths")))
        }
        (CausticsDesc::Auto, Some(_)) => {
            *caustics = CausticsDesc::Paths;
            Ok(())
        }
        _ => Ok(()),
    }
}

fn set_bidirectional(integrator: &mut IntegratorDesc, overrides: &Overrides) -> Result<()> {
    if let Some(chosen) = overrides.bidirectional {
        match integrator {
            IntegratorDesc::Path { bidirectional, .. } => *bidirectional = chosen,
            _ if chosen == AutoDesc::On => {
                return Err(refused("bidirectional", ": only the integrator path traces light paths"));
            }
            _ => {}
        }
    }
    let unsupported =
        unsupported_with_light_paths(integrator, overrides.guide.is_some(), overrides.target_error.is_some());
    let IntegratorDesc::Path { bidirectional, .. } = integrator else { return Ok(()) };
    match unsupported {
        Some(option) if *bidirectional == AutoDesc::On => {
            Err(refused("bidirectional", format!(": unsupported with {option}; give `bidirectional` off")))
        }
        Some(_) => {
            *bidirectional = AutoDesc::Off;
            Ok(())
        }
        None => Ok(()),
    }
}

/// The first option that is unsupported with connections to light paths.
pub(super) fn unsupported_with_light_paths(
    integrator: &IntegratorDesc,
    has_guide: bool,
    has_target: bool,
) -> Option<&'static str> {
    match integrator {
        IntegratorDesc::Path { caustics: CausticsDesc::Photons, .. } => Some("`caustics` photons"),
        _ => unsupported_with_photons(integrator, has_guide, has_target),
    }
}

/// The first option that is unsupported with photons.
pub(super) fn unsupported_with_photons(
    integrator: &IntegratorDesc,
    has_guide: bool,
    has_target: bool,
) -> Option<&'static str> {
    let IntegratorDesc::Path { strategy, regularize, guiding, .. } = integrator else { return None };
    let options = [
        (*strategy != StrategyDesc::Mis, "`strategy` other than mis"),
        (regularize.is_some(), "`regularize`"),
        (*guiding == AutoDesc::On, "`guiding` on"),
        (has_guide, "`guide`"),
        (has_target, "`target_error`"),
    ];
    options.into_iter().find_map(|(is_given, option)| is_given.then_some(option))
}
