//! What the user wrote to a scene ready to render: names become ids, meshes are loaded and placed, and whatever is
//! invalid is rejected with its place. The only module that sees both [`SceneDesc`] and [`Scene`].

mod attributes;
mod camera;
mod changes;
mod check;
mod coincident;
mod composites;
mod curves;
mod dicing;
mod displacement;
mod faults;
mod file_cache;
mod hair;
mod identities;
mod keyframes;
mod lights;
mod materials;
mod measured;
mod media;
mod meshes;
mod mtl;
mod nesting;
mod normal_perturbations;
mod normals;
mod objects;
mod opacity;
mod planes;
mod plastic;
mod prepared;
mod principled;
mod settings;
mod shapes;
mod subdivision;
mod summary;
mod textures;
mod transforms;
mod volume_places;
mod volumes;

pub use changes::SceneChanges;
pub use file_cache::FileCache;
pub use settings::{CheckedScene, check_film_and_integrator};
pub use summary::Summary;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::assets::{AssetError, SceneSource};
use crate::camera::Camera;
use crate::desc::{CausticsDesc, IntegratorDesc, SceneDesc};
use crate::error::{Error, Result};
use crate::geometry::{Geometry, Shape};
use crate::id::TextureId;
use crate::math::{Bounds, RenderSpace};
use crate::medium::{Medium, Subsurface};
use crate::scene::{Scene, SceneFeatures, Surface};
use crate::suggestion::did_you_mean;
use crate::texture::Texture;

use dicing::Dicing;
use faults::Faults;
use identities::IdentityTable;
use lights::LightTable;
use materials::MaterialTable;
use meshes::MeshStore;
use objects::PreparedWorld;
use transforms::Shutter;

/// Compiles a scene; the files it names are looked up beside `scene_file`.
///
/// # Errors
/// [`Error::Scene`], [`Error::Asset`] or [`Error::Missing`], each with the place in the scene.
pub fn compile(desc: &SceneDesc, scene_file: &Path) -> Result<Scene> {
    compile_from(desc, SceneSource::new(scene_file))
}

/// Compiles a scene that was read from a file of any kind; errors name the places in that file.
///
/// # Errors
/// As [`compile`].
pub fn compile_from(desc: &SceneDesc, source: SceneSource) -> Result<Scene> {
    CheckedScene::new(desc, source)?.compile()
}

/// What is wrong with the settings of a scene, its names and the files that it names.
pub fn find_faults(desc: &SceneDesc, source: SceneSource) -> Option<Error> {
    let checked = match CheckedScene::new(desc, source) {
        Ok(checked) => checked,
        Err(error) => return Some(error),
    };
    let mut faults = Faults::default();
    Builder::read(desc, checked.files, &checked.camera, &mut faults);
    faults.into_result().err()
}

impl CheckedScene<'_> {
    /// Compiles the scene.
    ///
    /// # Errors
    /// As [`compile`].
    pub fn compile(self) -> Result<Scene> {
        let Self { desc, files, camera } = self;
        let mut faults = Faults::default();
        let (mut builder, prepared) = Builder::read(desc, files, &camera, &mut faults);
        faults.into_result()?;
        builder.add_world(desc, prepared)?;
        builder.warn_of_coincident();
        let mut faults = Faults::default();
        for (i, light) in desc.lights.iter().enumerate() {
            let path = format!("lights[{i}]");
            let group = builder.lights.group(&builder.files, &path, light.group())?;
            let light = lights::compile(&builder.files, &path, light, &builder.space, &builder.materials.textures);
            builder.lights.add(faults.keep(light), group);
        }
        faults.into_result()?;
        let camera = camera::place_in(&builder.files, &desc.camera, camera, builder.space)?;
        builder.finish(desc, camera)
    }
}

/// Why a transform cannot place anything.
const SINGULAR: &str = "the transform is singular: it flattens the shape, or is not finite";

/// Lists of names in messages are no longer than this.
const MAX_LISTED: usize = 12;

/// Where the scene comes from; makes errors and warnings.
#[derive(Clone, Debug)]
struct CompileContext {
    source: SceneSource,
    /// Files that were read before, if they are kept.
    cache: Option<Arc<FileCache>>,
}

impl From<SceneSource> for CompileContext {
    fn from(source: SceneSource) -> Self {
        Self { source, cache: None }
    }
}

impl CompileContext {
    /// A scene whose assets are all files.
    fn new(scene: impl Into<PathBuf>) -> Self {
        SceneSource::new(scene).into()
    }

    /// An error at a place of the scene.
    fn error(&self, path: &str, message: impl Into<String>) -> Error {
        Error::Scene { file: self.source.file.clone(), path: self.source.place(path), message: message.into() }
    }

    /// A warning about a place of the scene.
    fn warn(&self, path: &str, message: fmt::Arguments) {
        tracing::warn!("{}: {}: {message}", self.source.file.display(), self.source.place(path));
    }

    /// Warns of a file that is not there and that nothing uses.
    fn warn_of_missing(&self, path: &str, name: &str) {
        if !self.source.assets.contains(name) && !self.source.asset(name).is_file() {
            self.warn(path, format_args!("no file {name}; nothing uses it"));
        }
    }

    /// An error about a scene of this format that is surely a mistake; a warning where the renderer that a scene was
    /// written for renders it.
    fn refuse_own(&self, path: &str, message: &str) -> Result<()> {
        if self.source.places.is_empty() {
            return Err(self.error(path, message));
        }
        self.warn(path, format_args!("{message}"));
        Ok(())
    }

    /// An error about an asset that `path` names.
    fn asset_error(&self, path: &str, asset: &Path, error: AssetError) -> Error {
        error.at(&self.source.file, &self.source.place(path), asset)
    }

    /// The error for a name that does not exist, with a suggestion or a list of the names.
    fn unknown<'a>(&self, path: &str, what: &str, name: &str, known: impl IntoIterator<Item = &'a str>) -> Error {
        let known: Vec<&str> = known.into_iter().collect();
        let hint = did_you_mean(name, known.iter().copied(), ["\"", "\""]);
        let list = match known.len() {
            0 => format!(": the scene has no {what}s"),
            1..=MAX_LISTED if hint.is_empty() => {
                let mut names = known;
                names.sort_unstable();
                format!(": use one of {}", names.join(", "))
            }
            _ => String::new(),
        };
        self.error(path, format!("no {what} named \"{name}\"{hint}{list}"))
    }
}

/// A scene under construction.
struct Builder {
    files: CompileContext,
    /// Read, and not placed yet.
    meshes: MeshStore,
    shutter: Shutter,
    /// Beyond this, planes reach: bounds of the camera's places and, in the end, of all other shapes.
    surroundings: Bounds,
    dicing: Dicing,
    materials: MaterialTable,
    geometry: Geometry,
    /// By shape.
    surfaces: Vec<Surface>,
    /// How much of each shape is there, if not all of it, by shape.
    opacities: Vec<Option<TextureId>>,
    /// Where the scene has each shape.
    paths: Vec<String>,
    lights: LightTable,
    identities: IdentityTable,
    /// Where everything is placed, once all shapes are known.
    space: RenderSpace,
    /// The spaces in which objects are, by object.
    object_spaces: Vec<RenderSpace>,
}

impl Builder {
    /// Reads and checks what a scene has and the files that it names. The world is complete if no fault is found.
    fn read<'a>(
        desc: &'a SceneDesc,
        files: CompileContext,
        camera: &Camera,
        faults: &mut Faults,
    ) -> (Self, PreparedWorld<'a>) {
        let used = desc.used_names();
        let materials = MaterialTable::new(&files, desc, &used, faults);
        let mut builder = Self {
            meshes: MeshStore::read(&files, desc, &used),
            files,
            shutter: Shutter::from(camera.shutter()),
            surroundings: camera.places(),
            dicing: Dicing {
                camera: camera.clone(),
                size: [desc.film.width, desc.film.height],
                instances: BTreeMap::new(),
            },
            materials,
            geometry: Geometry::default(),
            surfaces: Vec::new(),
            opacities: Vec::new(),
            paths: Vec::new(),
            lights: LightTable::default(),
            identities: IdentityTable::new(desc),
            space: RenderSpace::WORLD,
            object_spaces: Vec::new(),
        };
        let prepared = builder.prepare_world(desc, &used, faults);
        if !faults.is_empty() {
            // The faults of lights are reported with those of materials and shapes.
            for (i, light) in desc.lights.iter().enumerate() {
                let path = format!("lights[{i}]");
                let textures = &builder.materials.textures;
                faults.keep(lights::compile(&builder.files, &path, light, &RenderSpace::WORLD, textures));
            }
        }
        (builder, prepared)
    }

    /// The media of all surfaces, and what is around them.
    fn media_in_use(&self) -> Vec<Medium> {
        let media = &self.materials.media;
        let of_surfaces = self.surfaces.iter().filter_map(|surface| surface.medium).collect::<BTreeSet<_>>();
        of_surfaces.into_iter().map(|id| media.get(id)).chain(media.surroundings()).copied().collect()
    }

    fn finish(mut self, desc: &SceneDesc, camera: Camera) -> Result<Scene> {
        let files = &self.files;
        self.identities.add_media(&self.materials.media_names);
        if !self.space.is_world() {
            self.materials.media.place(&self.space);
            for perturbation in &mut self.materials.normal_perturbations {
                perturbation.rescale(self.space.scale());
            }
        }
        let boundary_masks = self.alpha_masks(true);
        self.geometry.cutouts = self.alpha_masks(false);
        let in_use = self.media_in_use();
        let light_groups = self.lights.groups();
        let lights = lights::light_set(self.lights.lights, &self.geometry, desc.light_sampler);
        let sky = !lights.at_infinity().is_empty();
        let has_fog = self.materials.media.surroundings().is_some_and(Medium::is_participating);
        check_visible(files, &self.geometry, sky || has_fog)?;
        check_light(files, &desc.integrator, lights.shines(), &in_use)?;
        let part_normal_perturbations = self.materials.part_normal_perturbations();
        let subsurface = self.materials.subsurface(&self.space);
        let plain_materials = self.materials.plain();
        let materials = self.materials.materials;
        let normal_perturbations = !part_normal_perturbations.is_empty()
            || self.surfaces.iter().any(|surface| surface.normal_perturbation.is_some());
        let mut features = SceneFeatures {
            lights: !lights.is_empty(),
            hidden_emitters: self.surfaces.iter().any(|surface| surface.hidden),
            environment: sky,
            analytic_shapes: self.geometry.shapes.iter().any(|s| matches!(s, Shape::Analytic(_))),
            instances: !self.geometry.instances.is_empty(),
            attributes: self.geometry.shapes.iter().any(Shape::has_attributes),
            image_textures: self.materials.textures.textures.iter().any(Texture::has_image),
            normal_perturbations,
            shading_normals: normal_perturbations || self.geometry.shapes.iter().any(is_smooth),
            media: !in_use.is_empty(),
            participating_media: in_use.iter().any(Medium::is_participating),
            subsurface: check_walks(files, &desc.integrator, &subsurface)?,
            lens: camera.lens().is_some(),
            motion: self.geometry.is_moving() || camera.is_moving(),
            ..SceneFeatures::default()
        };
        features.set_materials(&materials, &self.materials.textures.textures);
        Ok(Scene {
            geometry: Arc::new(self.geometry),
            boundary_masks,
            surfaces: self.surfaces,
            materials,
            plain_materials,
            normal_perturbations: self.materials.normal_perturbations,
            media: self.materials.media,
            part_normal_perturbations,
            subsurface,
            textures: self.materials.textures.textures,
            lights,
            light_groups,
            camera,
            features,
            identities: self.identities.finish(),
        })
    }
}

fn is_smooth(shape: &Shape) -> bool {
    matches!(shape, Shape::Mesh(mesh) if mesh.has_normals())
}

/// Refuses a scene in which nothing can be seen.
fn check_visible(files: &CompileContext, geometry: &Geometry, has_surroundings: bool) -> Result<()> {
    if geometry.world.is_empty() && geometry.instances.is_empty() && !has_surroundings {
        files.refuse_own("shapes", "there is nothing to see: no shapes, no instances and no environment")?;
    }
    Ok(())
}

/// Whether light is scattered below some surface; refuses photons, which are not traced there.
fn check_walks(files: &CompileContext, integrator: &IntegratorDesc, subsurface: &[Option<Subsurface>]) -> Result<bool> {
    if has_photons(integrator) && !subsurface.is_empty() {
        let message = "photons are not traced below surfaces: `subsurface_method` \"random_walk\"";
        return Err(files.error("integrator.caustics", message));
    }
    Ok(!subsurface.is_empty())
}

/// Refuses a scene without light, and photons where they would have to be traced through media that scatter.
fn check_light(files: &CompileContext, integrator: &IntegratorDesc, lights: bool, media: &[Medium]) -> Result<()> {
    let gives_off = media.iter().any(|medium| !medium.emission.is_black());
    if !lights && !gives_off && needs_light(integrator) {
        let message = "the scene has no light: give a shape an `emission`, or add an environment, point, spot or \
                       directional light";
        files.refuse_own("lights", message)?;
    }
    if has_photons(integrator) && media.iter().any(Medium::is_participating) {
        return Err(files.error("integrator.caustics", "photons are not traced through media that scatter"));
    }
    Ok(())
}

/// Whether an integrator traces photons.
fn has_photons(integrator: &IntegratorDesc) -> bool {
    matches!(integrator, IntegratorDesc::Path { caustics: CausticsDesc::Photons, .. })
}

/// Whether an integrator shows nothing without a light.
fn needs_light(integrator: &IntegratorDesc) -> bool {
    match integrator {
        IntegratorDesc::Path { .. } => true,
        IntegratorDesc::Whitted { ambient, .. } => ambient.iter().all(|&a| a == 0.0),
        IntegratorDesc::Normal
        | IntegratorDesc::ShadingNormal
        | IntegratorDesc::Uv
        | IntegratorDesc::Depth
        | IntegratorDesc::PrimitiveId
        | IntegratorDesc::AmbientOcclusion { .. } => false,
    }
}
