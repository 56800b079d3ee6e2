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
//! | 1 | `math`, `desc`, `file`, `attribute`, `image_data`, `measured`, `spectrum` |
//! | 2 | `color`, `sampling`, `config`, `subdivision` |
//! | 3 | `assets`, `geometry`, `texture`, `bsdf`, `camera`, `film`, `guiding` |
//! | 4 | `accel`, `material`, `medium`, `opacity`, `normal_perturbation`, `light`, `output` |
//! | 5 | `scene`, `denoise` |
//! | 6 | `import`, `integrator`, `compile` |
//! | 7 | `render`, `convert`, `loading` |
//! | 8 | `farm`, `live`, `renderer` |

mod accel;
mod assets;
mod attribute;
mod bsdf;
mod bytes;
mod camera;
mod color;
mod compile;
mod config;
mod convert;
mod denoise;
pub mod desc;
mod error;
mod farm;
mod file;
mod film;
mod geometry;
mod guiding;
mod id;
mod image_data;
mod import;
mod integrator;
mod light;
mod live;
mod loading;
mod material;
mod math;
mod measured;
mod medium;
mod memory;
mod metal;
mod normal_perturbation;
mod opacity;
mod output;
mod printable;
mod render;
mod renderer;
mod sampling;
mod scene;
mod spectrum;
mod subdivision;
mod suggestion;
mod texture;

pub use accel::{AccelKind, BvhOptions, EmbreeOptions, EmbreeQuality, KdTreeOptions};
pub use assets::MeshData;
pub use attribute::AttributeValues;
pub use error::{Error, ErrorKind, Result};
pub use film::{Crop, DroppedSample, Image, Layer, LayerInfo, LayerSet};
pub use import::{ImportOptions, ImportReport, Outcome, ReportEntry};
pub use integrator::RayCounts;
pub use output::Matte;
pub use render::{ExrOverrides, Overrides, Progress, Settings, Shard, Stats, TrainedGuide};
pub use renderer::{
    Assignment, ExrChanges, LayerView, PreparedRender, Renderer, Rendering, StateOptions, StopHandle, Watch,
    changed_settings, default_outputs, layers_of,
};
pub use sampling::SamplerKind;

/// What the packages of this repository need beyond the library's interface: it may change with every version.
#[doc(hidden)]
pub mod internal {
    macro_rules! open {
        ($($module:ident),* $(,)?) => { $(pub mod $module { pub use crate::$module::*; })* };
    }

    open!(
        accel,
        assets,
        attribute,
        bsdf,
        camera,
        color,
        compile,
        config,
        convert,
        denoise,
        farm,
        file,
        film,
        geometry,
        guiding,
        id,
        image_data,
        import,
        integrator,
        light,
        live,
        loading,
        material,
        math,
        medium,
        memory,
        metal,
        normal_perturbation,
        opacity,
        output,
        printable,
        render,
        sampling,
        scene,
        suggestion,
        texture,
    );
}
