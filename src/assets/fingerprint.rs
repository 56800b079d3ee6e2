//! BLAKE3 hashes of assets.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::mtl_maps::take_maps;
use super::{AssetError, Assets, IesData, MeshData, ObjMap, RgbImage, VolumeData};
use crate::image_data::{ImageData, Samples};

/// Whether a file is an OBJ by its extension.
pub fn is_obj(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj"))
}

/// The hashes of a file and of those that it names itself.
pub fn file_hashes(folder: &Path, name: &str) -> Result<Vec<(String, String)>, AssetError> {
    let path = folder.join(name);
    let mut hashes = vec![(name.to_owned(), file_hash(&path)?)];
    if is_obj(&path) {
        for file in files_of_obj(&path)? {
            let named = file.strip_prefix(folder).unwrap_or(&file).to_string_lossy().into_owned();
            hashes.push((named, file_hash(&file)?));
        }
    }
    Ok(hashes)
}

fn file_hash(path: &Path) -> Result<String, AssetError> {
    let missing = |e: std::io::Error| AssetError::missing(path, &e);
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(crate::file::open(path).map_err(missing)?).map_err(missing)?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// The MTL files that an OBJ names and their images, as far as they exist.
pub fn files_of_obj(path: &Path) -> Result<BTreeSet<PathBuf>, AssetError> {
    let read =
        |path: &Path| crate::file::read(path).map(crate::file::without_mark).map_err(|e| AssetError::missing(path, &e));
    let obj = read(path)?;
    let mut files = BTreeSet::new();
    for line in obj.split(|&byte| byte == b'\n').filter(|line| line.trim_ascii_start().starts_with(b"mtllib")) {
        let line = String::from_utf8_lossy(line);
        let name = line.trim().strip_prefix("mtllib").unwrap_or_default().trim();
        let mtl = path.parent().unwrap_or(Path::new("")).join(name);
        if !mtl.is_file() {
            continue;
        }
        let text = read(&mtl)?;
        // A malformed one is rejected when the scene is compiled.
        let maps =
            take_maps(&String::from_utf8_lossy(&text), mtl.parent().unwrap_or(Path::new(""))).map(|(_, maps)| maps);
        for maps in maps.unwrap_or_default().into_values() {
            let all = [maps.diffuse, maps.bump, maps.normal, maps.opacity, maps.specular, maps.emission];
            files.extend(all.into_iter().flatten().map(|ObjMap { file, .. }| file).filter(|file| file.is_file()));
        }
        files.insert(mtl);
    }
    Ok(files)
}

impl Assets {
    /// The hash of an asset that is no file.
    pub(crate) fn hash(&self, name: &str) -> Option<String> {
        let mut hash = Hash::default();
        if let Some(mesh) = self.meshes.get(name) {
            hash.mesh(mesh);
        } else if let Some(image) = self.images.get(name) {
            hash.image(image);
        } else if let Some(VolumeData { resolution, channels, values }) = self.volumes.get(name) {
            hash.numbers(resolution.iter().chain([channels]).copied(), u32::to_le_bytes);
            hash.numbers(values.iter().copied(), f32::to_le_bytes);
        } else if let Some(IesData { vertical, horizontal, candela }) = self.profiles.get(name) {
            for numbers in [vertical, horizontal, candela] {
                hash.numbers(numbers.iter().copied(), f32::to_le_bytes);
            }
        } else {
            let RgbImage { width, height, pixels } = self.environments.get(name)?;
            hash.numbers([*width as u64, *height as u64], u64::to_le_bytes);
            hash.numbers(pixels.as_flattened().iter().copied(), f32::to_le_bytes);
        }
        Some(hash.finish())
    }
}

/// A hash of values, each with its length, so that no two lists of values have the same bytes.
#[derive(Default)]
pub struct Hash {
    hasher: blake3::Hasher,
    buffer: Vec<u8>,
}

impl Hash {
    /// Adds a text.
    pub fn text(&mut self, text: &str) {
        self.hasher.update(&(text.len() as u64).to_le_bytes());
        self.hasher.update(text.as_bytes());
    }

    fn numbers<T, const N: usize>(&mut self, numbers: impl IntoIterator<Item = T>, bytes: impl Fn(T) -> [u8; N]) {
        self.buffer.clear();
        self.buffer.extend(numbers.into_iter().flat_map(bytes));
        self.hasher.update(&(self.buffer.len() as u64).to_le_bytes());
        self.hasher.update(&self.buffer);
    }

    fn mesh(&mut self, mesh: &MeshData) {
        let MeshData { positions, triangles, faces, normals, uvs, attributes, origin } = mesh;
        self.numbers(triangles.as_flattened().iter().copied(), u32::to_le_bytes);
        let triples = [Some(positions), normals.as_ref()].map(|list| list.map(|list| list.as_flattened()));
        let pairs = uvs.as_ref().map(|list| list.as_flattened());
        for list in triples.into_iter().chain([pairs]) {
            self.hasher.update(&[u8::from(list.is_some())]);
            self.numbers(list.unwrap_or_default().iter().copied(), f32::to_le_bytes);
        }
        for (name, values) in attributes {
            self.text(name);
            self.numbers([values.channels() as u64], u64::to_le_bytes);
            self.numbers(values.numbers().iter().copied(), f32::to_le_bytes);
        }
        if *origin != [0.0; 3] {
            self.numbers(origin.iter().copied(), f64::to_le_bytes);
        }
        if !faces.is_empty() {
            self.numbers(faces.iter().copied(), u32::to_le_bytes);
        }
    }

    fn image(&mut self, image: &ImageData) {
        self.numbers([image.width, image.height, image.channels].map(|n| n as u64), u64::to_le_bytes);
        match &image.samples {
            Samples::U8(samples) => self.numbers(samples.iter().copied(), u8::to_le_bytes),
            Samples::U16(samples) => self.numbers(samples.iter().copied(), u16::to_le_bytes),
            Samples::F16(samples) => self.numbers(samples.iter().copied(), half::f16::to_le_bytes),
            Samples::F32(samples) => self.numbers(samples.iter().copied(), f32::to_le_bytes),
        }
    }

    /// The hash in hexadecimal digits.
    pub fn finish(self) -> String {
        self.hasher.finalize().to_hex().to_string()
    }
}
