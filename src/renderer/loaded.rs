//! A compiled scene together with the accelerator over its geometry.

use std::sync::Arc;
use std::time::Instant;

use self_cell::self_cell;

use crate::accel::{self, AccelKind, Accelerator};
use crate::error::Result;
use crate::geometry::Geometry;
use crate::render::Settings;
use crate::scene::Scene;

type BoxedAccel<'g> = Box<dyn Accelerator + 'g>;

self_cell!(
    /// An accelerator with the geometry that it borrows.
    struct OwnedAccel {
        owner: Arc<Geometry>,
        #[covariant]
        dependent: BoxedAccel,
    }
);

/// A scene that can be rendered any number of times.
pub struct LoadedScene {
    pub scene: Scene,
    accel: OwnedAccel,
    kind: AccelKind,
    /// Whether the lens of the camera was removed.
    pub is_in_focus: bool,
    /// Seconds to read and compile the scene.
    pub load_seconds: f64,
    /// Seconds to build the accelerator; 0 if one of before serves.
    pub build_seconds: f64,
}

impl LoadedScene {
    /// Builds the accelerator of a scene, unless that of `before` serves: then it is kept with its geometry.
    pub fn new(mut scene: Scene, before: Option<Self>, settings: &Settings, load_seconds: f64) -> Result<Self> {
        let kept = before.filter(|before| {
            before.kind == settings.accel
                && (Arc::ptr_eq(&before.scene.geometry, &scene.geometry)
                    || before.scene.geometry.is_same(&scene.geometry))
        });
        let start = Instant::now();
        let (accel, build_seconds) = match kept {
            Some(before) => {
                scene.geometry = Arc::clone(&before.scene.geometry);
                (before.accel, 0.0)
            }
            None => {
                let accel = OwnedAccel::try_new(Arc::clone(&scene.geometry), |geometry| {
                    accel::build(settings.accel, geometry, settings.threads)
                })?;
                (accel, start.elapsed().as_secs_f64())
            }
        };
        let mut loaded = Self { scene, accel, kind: settings.accel, is_in_focus: false, load_seconds, build_seconds };
        loaded.adapt_lens(settings);
        Ok(loaded)
    }

    /// Removes the lens if nothing is to be out of focus.
    pub fn adapt_lens(&mut self, settings: &Settings) {
        self.is_in_focus = !settings.depth_of_field;
        if self.is_in_focus {
            self.scene.camera.remove_lens();
        }
    }

    /// Whether settings need nothing else of the scene.
    pub fn suits(&self, settings: &Settings) -> bool {
        self.kind == settings.accel && self.is_in_focus != settings.depth_of_field
    }

    pub fn accel(&self) -> &dyn Accelerator {
        &**self.accel.borrow_dependent()
    }
}
