//! What is traced from the lights.

use serde::{Deserialize, Serialize};

/// What is traced from the lights, beside paths from the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightTracing {
    /// Nothing.
    #[default]
    Off,
    /// Photons of caustics, which paths gather.
    Photons,
    /// Light paths, whose vertices paths are connected to.
    Bidirectional,
}
