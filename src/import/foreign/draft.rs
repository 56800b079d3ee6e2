//! A scene of the native format while a reader fills it.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::PathBuf;
use std::sync::Arc;

use super::{ImportReport, Imported, Outcome, ReportEntry};
use crate::assets::{Assets, IesData, MeshData, RgbImage, VolumeData};
use crate::desc::{
    CameraDesc, InstanceDesc, KeyframeDesc, LightDesc, MaterialDesc, MediumDesc, ObjectDesc, SceneDesc, ShapeDesc,
    TextureDesc, TransformDesc, TransformStepDesc,
};
use crate::image_data::ImageData;
use crate::math::{DAffine3, DMat3, DVec3, Transform};

/// What becomes of samplers of independent numbers: another set of points changes no mean, so they count as mapped.
pub const SOBOL_FOR_INDEPENDENT: &str =
    "Sobol points, with the same mean and less noise (--sampler independent for independent numbers)";

/// A scene under construction: names are made unique, and the places where things come from are kept for messages.
#[derive(Debug, Default)]
pub struct Draft {
    /// Film, integrator, sampler, camera, and all that is added.
    pub desc: SceneDesc,
    /// Meshes and images without files.
    pub assets: Assets,
    /// What became of the parameters.
    pub report: ImportReport,
    /// The files that were read beside the scene's own.
    pub files: BTreeSet<PathBuf>,
    places: BTreeMap<String, String>,
    numbers: Numbers,
}

impl Draft {
    /// An empty scene, for which these files were read.
    pub fn of_files(files: &[PathBuf]) -> Self {
        Self { files: files.iter().cloned().collect(), ..Self::default() }
    }

    /// Adds a texture under `name` or one like it; the result is its name.
    pub fn add_texture(&mut self, name: &str, place: &str, texture: TextureDesc) -> String {
        let name = self.numbers.unique("texture", name, |name| self.desc.textures.contains_key(name));
        self.places.insert(format!("textures.{name}"), place.into());
        self.desc.textures.insert(name.clone(), texture);
        name
    }

    /// Adds a material under `name` or one like it; the result is its name.
    pub fn add_material(&mut self, name: &str, place: &str, material: MaterialDesc) -> String {
        let name = self.numbers.unique("material", name, |name| self.desc.materials.contains_key(name));
        self.places.insert(format!("materials.{name}"), place.into());
        self.desc.materials.insert(name.clone(), material);
        name
    }

    /// Adds a medium under `name` or one like it; the result is its name.
    pub fn add_medium(&mut self, name: &str, place: &str, medium: MediumDesc) -> String {
        let name = self.numbers.unique("medium", name, |name| self.desc.media.contains_key(name));
        self.places.insert(format!("media.{name}"), place.into());
        self.desc.media.insert(name.clone(), medium);
        name
    }

    /// Adds an object under `name` or one like it, its shapes with their places; the result is its name.
    pub fn add_object(
        &mut self,
        name: &str,
        place: &str,
        shapes: Vec<(String, ShapeDesc)>,
        instances: Vec<InstanceDesc>,
    ) -> String {
        let name = self.numbers.unique("object", name, |name| self.desc.objects.contains_key(name));
        self.places.insert(format!("objects.{name}"), place.into());
        let mut object = ObjectDesc { shapes: Vec::new(), instances };
        for (place, shape) in shapes {
            let common = shape.common();
            if self.is_placed(&place, "shape", common.transform, common.motion) {
                self.places.insert(format!("objects.{name}.shapes[{}]", object.shapes.len()), place);
                object.shapes.push(shape);
            }
        }
        self.desc.objects.insert(name.clone(), object);
        name
    }

    /// Whether something stands anywhere; reports it as ignored if a transform leaves nothing of it.
    fn is_placed(&mut self, place: &str, element: &str, transform: &TransformDesc, motion: &[KeyframeDesc]) -> bool {
        let flat = std::iter::once(transform).chain(motion.iter().map(|keyframe| &keyframe.transform)).any(flattens);
        if flat {
            self.ignored(place, element, "transform", "it is singular: nothing that has a volume or an area is left");
        }
        !flat
    }

    /// Adds a shape to the world.
    pub fn add_shape(&mut self, place: &str, shape: ShapeDesc) {
        let common = shape.common();
        if !self.is_placed(place, "shape", common.transform, common.motion) {
            return;
        }
        self.places.insert(format!("shapes[{}]", self.desc.shapes.len()), place.into());
        self.desc.shapes.push(shape);
    }

    /// Places an object in the world.
    pub fn add_instance(&mut self, place: &str, instance: InstanceDesc) {
        if !self.is_placed(place, "instance", &instance.transform, &instance.motion) {
            return;
        }
        self.places.insert(format!("instances[{}]", self.desc.instances.len()), place.into());
        self.desc.instances.push(instance);
    }

    /// Adds a light that is no shape.
    pub fn add_light(&mut self, place: &str, light: LightDesc) {
        self.places.insert(format!("lights[{}]", self.desc.lights.len()), place.into());
        self.desc.lights.push(light);
    }

    /// Sets the camera.
    pub fn set_camera(&mut self, place: &str, camera: CameraDesc) {
        self.places.insert("camera".into(), place.into());
        self.desc.camera = camera;
    }

    /// Keeps a mesh that has no file; the result is used in place of its file's name.
    pub fn keep_mesh(&mut self, name: &str, mesh: MeshData) -> String {
        let file = self.numbers.unique_file(name, "ply", &self.assets);
        self.assets.meshes.insert(file.clone(), mesh);
        file
    }

    /// Keeps an image of a texture that has no file; the result is used in place of its file's name.
    pub fn keep_image(&mut self, name: &str, image: ImageData) -> String {
        let file = self.numbers.unique_file(name, if image.is_float() { "exr" } else { "png" }, &self.assets);
        self.assets.images.insert(file.clone(), image);
        file
    }

    /// Keeps an image of an environment that has no file; the result is used in place of its file's name.
    pub fn keep_environment(&mut self, name: &str, image: RgbImage) -> String {
        let file = self.numbers.unique_file(name, "exr", &self.assets);
        self.assets.environments.insert(file.clone(), image);
        file
    }

    /// Keeps a volume that has no file; the result is used in place of its file's name.
    pub fn keep_volume(&mut self, name: &str, volume: VolumeData) -> String {
        let file = self.numbers.unique_file(name, "vol", &self.assets);
        self.assets.volumes.insert(file.clone(), volume);
        file
    }

    /// Keeps a light's intensity by direction; the result is used in place of its file's name.
    pub fn keep_profile(&mut self, name: &str, profile: IesData) -> String {
        let file = self.numbers.unique_file(name, "ies", &self.assets);
        self.assets.profiles.insert(file.clone(), profile);
        file
    }

    /// Reports that a parameter of an element means the same in the scene.
    pub fn mapped(&mut self, place: &str, element: &str, parameter: &str) {
        self.note(place, element, parameter, Outcome::Mapped, String::new());
    }

    /// Reports how a parameter of an element was approximated.
    pub fn approximated(&mut self, place: &str, element: &str, parameter: &str, how: impl Into<String>) {
        self.note(place, element, parameter, Outcome::Approximated, how.into());
    }

    /// Reports why a parameter of an element was ignored.
    pub fn ignored(&mut self, place: &str, element: &str, parameter: &str, why: impl Into<String>) {
        self.note(place, element, parameter, Outcome::Ignored, why.into());
    }

    /// Reports what became of a parameter of an element, with a note.
    pub fn note(&mut self, place: &str, element: &str, parameter: &str, outcome: Outcome, note: String) {
        self.report.entries.push(ReportEntry {
            place: place.into(),
            element: element.into(),
            parameter: parameter.into(),
            outcome,
            note,
        });
    }

    /// The scene.
    pub fn finish(self) -> Imported {
        let Self { desc, assets, report, files, places, .. } = self;
        Imported { desc, assets: Arc::new(assets), report, files: Arc::new(files), places: Arc::new(places) }
    }
}

/// Whether a transform has a finite matrix that is singular. Importers write matrices only.
fn flattens(transform: &TransformDesc) -> bool {
    transform.0.iter().any(|step| match step {
        TransformStepDesc::Matrix(m) => {
            let column = |c: usize| DVec3::new(m[0][c], m[1][c], m[2][c]);
            let map = DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) };
            map.is_finite() && Transform::new(map).is_none()
        }
        _ => false,
    })
}

/// The next number of each name that was taken, by what it names: looking for it from the start would take the square
/// of their count.
#[derive(Clone, Debug, Default)]
struct Numbers(HashMap<(&'static str, String), u64>);

impl Numbers {
    /// `name`, or the first of `name_2`, `name_3`, ... that is not taken.
    fn unique(&mut self, kind: &'static str, name: &str, is_taken: impl Fn(&str) -> bool) -> String {
        let name = if name.is_empty() { "unnamed" } else { name };
        if !is_taken(name) {
            return name.into();
        }
        let next = self.0.entry((kind, name.to_owned())).or_insert(2);
        loop {
            let numbered = format!("{name}_{next}");
            *next += 1;
            if !is_taken(&numbered) {
                return numbered;
            }
        }
    }

    /// As [`unique`](Self::unique), for a file that any system can write.
    fn unique_file(&mut self, name: &str, extension: &'static str, assets: &Assets) -> String {
        let plain: String =
            name.chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' }).take(60).collect();
        let stem = self.unique(extension, &plain, |stem| assets.contains(&format!("{stem}.{extension}")));
        format!("{stem}.{extension}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_files_are_plain() {
        let mut draft = Draft::default();
        let names: Vec<String> =
            (0..3).map(|_| draft.add_texture("a", "x:1", TextureDesc::Constant { color: [0.0; 3] })).collect();
        assert_eq!(names, ["a", "a_2", "a_3"]);
        // One that has the next number of its own.
        draft.add_texture("a_4", "x:1", TextureDesc::Constant { color: [0.0; 3] });
        assert_eq!(draft.add_texture("a", "x:1", TextureDesc::Constant { color: [0.0; 3] }), "a_5");
        // The square of this number would take minutes.
        let last = (0..50_000)
            .map(|_| {
                draft.add_material("", "x:1", MaterialDesc::Mirror { reflectance: crate::desc::ColorDesc::Grey(1.0) })
            })
            .last();
        assert_eq!(last.as_deref(), Some("unnamed_50000"));
        let files: Vec<String> = (0..2).map(|_| draft.keep_mesh("../ä b", MeshData::default())).collect();
        assert_eq!(files, ["___ä_b.ply", "___ä_b_2.ply"]);
    }
}
