//! Parts of a scene by their paths, such as `materials.gold.roughness`, `camera.position` or `shapes[2].radius`.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::Renderer;
use super::assignment::assign;
use crate::desc::SceneDesc;
use crate::error::{Error, Result};
use crate::suggestion::did_you_mean;

/// The parts of a scene that have parameters.
const PARTS: [&str; 11] = [
    "camera",
    "film",
    "sampler",
    "integrator",
    "materials",
    "textures",
    "media",
    "lights",
    "shapes",
    "instances",
    "objects",
];

/// A part of a scene, and the keys within it.
struct Place {
    part: String,
    /// The name or number of the entry, in parts that have several.
    entry: Option<String>,
    keys: Vec<String>,
}

impl Place {
    fn parse(path: &str) -> Option<Self> {
        let path = path.replace('[', ".").replace(']', "");
        let mut keys = path.split('.').map(str::to_owned);
        let part = keys.next().filter(|part| PARTS.contains(&part.as_str()))?;
        let is_single = ["camera", "film", "sampler", "integrator"].contains(&part.as_str());
        let entry = if is_single { None } else { Some(keys.next()?) };
        let keys: Vec<String> = keys.collect();
        keys.iter().all(|key| !key.is_empty()).then_some(Self { part, entry, keys })
    }
}

impl Renderer {
    /// The value at a path of the scene: `camera.position`, `materials.gold`, `lights[0].radiance`. Paths are those of
    /// the scene format; what has its default may be missing.
    ///
    /// # Errors
    /// [`Error::Scene`] if the scene has no such part or key.
    pub fn parameter(&self, path: &str) -> Result<Value> {
        let place = self.place(path)?;
        let part = self.part(&place, path)?;
        let mut value = &part;
        for key in &place.keys {
            let inner = match value {
                Value::Array(list) => key.parse::<usize>().ok().and_then(|i| list.get(i)),
                value => value.get(key),
            };
            value = inner.ok_or_else(|| self.fault(path, "the scene does not set it"))?;
        }
        Ok(value.clone())
    }

    /// Changes the value at a path of the scene. The next render compiles what depends on it; see
    /// [`scene_mut`](Self::scene_mut) and [`set_camera`](Self::set_camera) for what is kept.
    ///
    /// ```
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # use steradian::desc::{CameraDesc, LightDesc, MaterialDesc, SceneDesc, ShapeDesc};
    /// # let scene = SceneDesc::default().with_camera(CameraDesc::at([0.0, 0.0, 5.0], [0.0; 3]))
    /// #     .with_material("red", MaterialDesc::diffuse([0.7, 0.1, 0.05]))
    /// #     .with_shape(ShapeDesc::sphere(1.0).with_material("red"))
    /// #     .with_light(LightDesc::environment([1.0; 3]));
    /// # let mut renderer = steradian::Renderer::from_desc(scene).size(8, 8).spp(1);
    /// renderer.change("materials.red.albedo", 0.2)?;
    /// renderer.change("camera.position", vec![0.0, 2.0, 5.0])?;
    /// renderer.render()?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Error::Scene`] if the scene has no such part, or the scene format does not allow the value there.
    pub fn change(&mut self, path: &str, value: impl Into<Value>) -> Result<()> {
        let place = self.place(path)?;
        let part = if place.keys.is_empty() { Value::Null } else { self.part(&place, path)? };
        let mut wrapped = serde_json::json!({ "part": part });
        let keys: Vec<&str> = std::iter::once("part").chain(place.keys.iter().map(String::as_str)).collect();
        assign(&mut wrapped, &keys, value.into());
        let replaced = replace(&mut self.imported.desc, &place, wrapped["part"].take());
        replaced.map_err(|message| self.fault(path, &message))?;
        let changes = self.changed();
        match (place.part.as_str(), place.entry) {
            // Subdivision follows the camera's pixels.
            ("camera" | "film", _) => changes.camera = true,
            ("sampler", _) => {}
            ("materials", Some(name)) => drop(changes.materials.insert(name)),
            ("lights", Some(number)) => drop(number.parse().map(|number| changes.lights.insert(number))),
            _ => changes.others = true,
        }
        Ok(())
    }

    fn place(&self, path: &str) -> Result<Place> {
        Place::parse(path).ok_or_else(|| {
            let part = path.split(['.', '[']).next().unwrap_or_default();
            let hint = did_you_mean(part, PARTS, ["", ""]);
            let message = format!("no parameter of a scene{hint}: paths begin with one of {}", PARTS.join(", "));
            self.fault(path, &message)
        })
    }

    /// A part of the scene as JSON.
    fn part(&self, place: &Place, path: &str) -> Result<Value> {
        let desc = &self.imported.desc;
        let entry = place.entry.as_deref().unwrap_or_default();
        let number = || entry.parse::<usize>().unwrap_or(usize::MAX);
        let found = match place.part.as_str() {
            "camera" => json(&desc.camera),
            "film" => json(&desc.film),
            "sampler" => json(&desc.sampler),
            "integrator" => json(&desc.integrator),
            "materials" => desc.materials.get(entry).and_then(json),
            "textures" => desc.textures.get(entry).and_then(json),
            "media" => desc.media.get(entry).and_then(json),
            "objects" => desc.objects.get(entry).and_then(json),
            "lights" => desc.lights.get(number()).and_then(json),
            "shapes" => desc.shapes.get(number()).and_then(json),
            _ => desc.instances.get(number()).and_then(json),
        };
        found.ok_or_else(|| {
            let names: Vec<&str> = match place.part.as_str() {
                "materials" => desc.materials.keys().map(String::as_str).collect(),
                "textures" => desc.textures.keys().map(String::as_str).collect(),
                "media" => desc.media.keys().map(String::as_str).collect(),
                "objects" => desc.objects.keys().map(String::as_str).collect(),
                _ => Vec::new(),
            };
            let hint = did_you_mean(entry, names, ["\"", "\""]);
            self.fault(path, &format!("the scene has no \"{entry}\" in its {}{hint}", place.part))
        })
    }

    fn fault(&self, path: &str, message: &str) -> Error {
        Error::Scene { file: self.scene_file.clone(), path: path.to_owned(), message: message.to_owned() }
    }
}

fn json<T: Serialize>(part: &T) -> Option<Value> {
    serde_json::to_value(part).ok()
}

fn read<T: DeserializeOwned>(value: Value) -> Result<T, String> {
    serde_path_to_error::deserialize(value).map_err(|e| e.inner().to_string())
}

/// Replaces a part of a scene, or adds one that has a name.
fn replace(desc: &mut SceneDesc, place: &Place, value: Value) -> Result<(), String> {
    let entry = place.entry.clone().unwrap_or_default();
    let number = || entry.parse::<usize>().unwrap_or(usize::MAX);
    let missing = || format!("the scene has no number {entry} in its {}", place.part);
    match place.part.as_str() {
        "camera" => desc.camera = read(value)?,
        "film" => desc.film = read(value)?,
        "sampler" => desc.sampler = read(value)?,
        "integrator" => desc.integrator = read(value)?,
        "materials" => drop(desc.materials.insert(entry, read(value)?)),
        "textures" => drop(desc.textures.insert(entry, read(value)?)),
        "media" => drop(desc.media.insert(entry, read(value)?)),
        "objects" => drop(desc.objects.insert(entry, read(value)?)),
        "lights" => *desc.lights.get_mut(number()).ok_or_else(missing)? = read(value)?,
        "shapes" => *desc.shapes.get_mut(number()).ok_or_else(missing)? = read(value)?,
        _ => *desc.instances.get_mut(number()).ok_or_else(missing)? = read(value)?,
    }
    Ok(())
}
