//! Steradian: a fast, accurate CPU renderer.
//!
//! Data flows one way; a later stage never reads an earlier one:
//!
//! ```text
//! scene.json -- import --> desc::SceneDesc --+-- compile --> scene::Scene --+--> accel::build(kind, &scene.geometry)
//! .xml .gltf        (plain serde data)       |   (indices only)             +--> World { &scene, &accel }
//! .obj .ply .exr -- assets (plain buffers) --+                                   --> integrator --> PixelSample
//!                                                                                --> Film --> output::{exr, png}
//! ```
//!
//! A module imports only from lower layers (`tests/tidy.rs` enforces the table):
//!
//! | # | modules |
//! |---|---|
//! | 0 | `id`, `error`, `memory`, `metal`, `printable`, `suggestion`, `bytes` |
//! | 1 | `math`, `desc`, `file`, `attribute`, `image_data` |
//! | 2 | `color`, `sampling`, `config`, `subdivision` |
//! | 3 | `assets`, `geometry`, `texture`, `bsdf`, `camera`, `film`, `guiding` |
//! | 4 | `accel`, `material`, `medium`, `opacity`, `normal_perturbation`, `light`, `output` |
//! | 5 | `scene`, `denoise` |
//! | 6 | `import`, `integrator`, `compile` |
//! | 7 | `render`, `convert` |
//! | 8 | `bench`, `farm`, `live`, `renderer` |
//! | 9 | `bin/steradian` |

// Checks of numerical stability use parts that a render does not.
#![cfg_attr(not(feature = "bench"), allow(dead_code, unused_imports))]

pub mod accel;
pub mod assets;
pub mod attribute;
#[cfg(feature = "bench")]
pub mod bench;
pub mod bsdf;
mod bytes;
pub mod camera;
pub mod color;
pub mod compile;
pub mod config;
pub mod convert;
pub mod denoise;
pub mod desc;
pub mod error;
pub mod farm;
pub mod file;
pub mod film;
pub mod geometry;
pub mod guiding;
pub mod id;
pub mod image_data;
pub mod import;
pub mod integrator;
pub mod light;
pub mod live;
pub mod material;
pub mod math;
pub mod medium;
pub mod memory;
pub mod metal;
pub mod normal_perturbation;
pub mod opacity;
pub mod output;
pub mod printable;
pub mod render;
mod renderer;
pub mod sampling;
pub mod scene;
mod subdivision;
pub mod suggestion;
pub mod texture;

pub use error::{Error, ErrorKind, Result};
pub use renderer::{
    Assignment, LayerView, PreparedRender, Renderer, Rendering, StateOptions, StopHandle, Watch, changed_settings,
    default_outputs, layers_of,
};
