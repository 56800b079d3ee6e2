//! What is traced from the lights for an epoch of samples, side by side.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::TILE_SIZE;
use super::tile_renderer::TileWorkspace;
use crate::integrator::{RayCounts, Workspace};

/// All that `trace` appends for parts of the first `count` indices, in their order, and the rays traced.
pub(super) fn trace_parts<T: Send>(
    count: u32,
    workspaces: &[Mutex<TileWorkspace>],
    trace: impl Fn(Range<u32>, &mut Workspace, &mut Vec<T>) + Sync,
) -> (Vec<T>, RayCounts) {
    let chunk = TILE_SIZE * TILE_SIZE;
    let parts: Vec<(Vec<T>, RayCounts)> = (0..count.div_ceil(chunk))
        .into_par_iter()
        .map(|i| {
            let thread = rayon::current_thread_index().unwrap_or(0) % workspaces.len();
            let mut workspace = workspaces[thread].lock().unwrap_or_else(PoisonError::into_inner);
            let mut found = Vec::new();
            trace(i * chunk..((i + 1) * chunk).min(count), &mut workspace.integrator, &mut found);
            (found, std::mem::take(&mut workspace.integrator.counts))
        })
        .collect();
    let mut counts = RayCounts::default();
    parts.iter().for_each(|(_, part)| counts.add(part));
    (parts.into_iter().flat_map(|(found, _)| found).collect(), counts)
}
