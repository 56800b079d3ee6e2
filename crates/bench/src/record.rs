//! Rays recorded from a render, by kind.

use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::observed::{Call, Observed, Observer};
use crate::accel::{Accelerator, Coherence};
use crate::desc::IntegratorDesc;
use crate::film::Crop;
use crate::math::Ray;
use crate::render::{self, Settings, Silent};
use crate::scene::Scene;
use steradian::Result;

/// Rays that belong together: neighbours of a packet.
const RUN: usize = 16;

/// What rays are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RayKind {
    /// From the camera.
    Camera,
    /// From a surface towards a light; any hit.
    Shadow,
    /// From the first surface on, in a direction chosen by its material.
    FirstBounce,
    /// From later surfaces on.
    DeepBounce,
    /// From the first surface, without an end, in directions chosen by the cosine; any hit.
    AmbientOcclusion,
}

impl RayKind {
    /// Every kind.
    pub const ALL: [Self; 5] =
        [Self::Camera, Self::Shadow, Self::FirstBounce, Self::DeepBounce, Self::AmbientOcclusion];

    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Shadow => "shadow",
            Self::FirstBounce => "first bounce",
            Self::DeepBounce => "deep bounce",
            Self::AmbientOcclusion => "ambient occlusion",
        }
    }

    /// Whether the question is for any hit rather than for the closest.
    pub fn is_any_hit(self) -> bool {
        matches!(self, Self::Shadow | Self::AmbientOcclusion)
    }
}

/// Rays of one kind, in the order in which the render traced them.
#[derive(Clone, Debug)]
pub struct RaySet {
    /// What they are for.
    pub kind: RayKind,
    /// The rays.
    pub rays: Vec<Ray>,
}

/// Renders the scene with one sample a pixel on one thread and keeps up to about `count` rays of each kind, taken
/// evenly in runs of 16 from the whole picture. Kinds that do not occur are left out. The rays depend on the scene and
/// on `count` alone.
///
/// # Errors
/// As a render.
pub fn record(scene: &Scene, accel: &dyn Accelerator, settings: &Settings, count: usize) -> Result<Vec<RaySet>> {
    let [width, height] = settings.size.map(f64::from);
    // About as many pixels as rays are requested, with the picture's aspect ratio.
    let scale = (count as f64 / (width * height)).sqrt();
    let size = [width, height].map(|side| ((side * scale).round() as u32).clamp(1, 1 << 15));
    let mut settings = Settings {
        size,
        crop: Crop { x: 0, y: 0, width: size[0], height: size[1] },
        spp: 1,
        threads: 1,
        time_limit: None,
        ..settings.clone()
    };
    if !matches!(settings.integrator, IntegratorDesc::Path { .. }) {
        settings.integrator = IntegratorDesc::default();
    }
    let mut found = render_recorded(scene, accel, &settings)?;
    settings.integrator = IntegratorDesc::AmbientOcclusion { distance: None };
    let occlusion = render_recorded(scene, accel, &settings)?;
    found.extend(
        occlusion
            .into_iter()
            .filter(|set| set.kind == RayKind::Shadow)
            .map(|set| RaySet { kind: RayKind::AmbientOcclusion, ..set }),
    );
    found.retain(|set| !set.rays.is_empty());
    for set in &mut found {
        set.rays = thin(&set.rays, count);
    }
    Ok(found)
}

fn render_recorded(scene: &Scene, accel: &dyn Accelerator, settings: &Settings) -> Result<Vec<RaySet>> {
    let observed = Observed { inner: accel, observer: Recorder::default() };
    render::render(scene, &observed, settings, &Silent, &AtomicBool::new(false))?;
    let state = observed.observer.0.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let kinds = [RayKind::Camera, RayKind::Shadow, RayKind::FirstBounce, RayKind::DeepBounce];
    Ok(kinds.into_iter().zip(state.rays).map(|(kind, rays)| RaySet { kind, rays }).collect())
}

/// Whole runs, evenly chosen, `count` rays or a few less; all if there are no more.
fn thin(rays: &[Ray], count: usize) -> Vec<Ray> {
    if rays.len() <= count {
        return rays.to_vec();
    }
    let (runs, selected) = (rays.len() / RUN, (count / RUN).max(1));
    (0..selected).flat_map(|i| rays[i * runs / selected * RUN..].iter().take(RUN)).copied().collect()
}

/// Keeps a copy of the rays. One thread at a time: which bounce a batch belongs to follows from the batches before it.
#[derive(Default)]
struct Recorder(Mutex<State>);

#[derive(Default)]
struct State {
    /// Closest-hit batches since the last one from the camera.
    bounce: usize,
    /// Camera, shadow, first bounce, deep bounce.
    rays: [Vec<Ray>; 4],
}

impl Observer for Recorder {
    fn observe(&self, call: &Call, trace: &mut dyn FnMut()) {
        let mut state = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let slot = match call.coherence {
            _ if call.any_hit => Some(1),
            // Single rays for the closest hit look again after a rounding artefact.
            None => None,
            Some(coherence) => {
                state.bounce = if coherence == Coherence::Coherent { 0 } else { state.bounce + 1 };
                Some([0, 2, 3][state.bounce.min(2)])
            }
        };
        if let Some(slot) = slot {
            state.rays[slot].extend(call.rays.iter().filter(|ray| ray.is_valid()));
        }
        drop(state);
        trace();
    }
}
