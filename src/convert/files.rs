//! The files of a scene that is written elsewhere.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufWriter, Cursor, Read, Write};
use std::path::{Path, PathBuf};

use super::{Originals, folder_of, write_ply};
use crate::assets::{Assets, RgbImage, TENSOR_MAGIC, VDB_MAGICS, ies_bytes, vol_bytes};
use crate::error::{Error, Result};
use crate::file::{self, MARK, write_atomically};
use crate::image_data::{ImageData, Samples};
use crate::import::Imported;
use crate::output::FileUses;

/// Copies files to the folder beside a scene.
pub struct AssetCopier<'a> {
    assets: &'a Assets,
    source: &'a Path,
    target_folder: PathBuf,
    /// Name of the folder beside the scene.
    folder: String,
    originals: Originals,
    /// The name in the target for a name of the source.
    copied: BTreeMap<String, String>,
    /// Files in the folder beside the scene.
    count: usize,
    /// If there are any, files are only compared with these: nothing is written.
    uses: Option<FileUses>,
}

impl<'a> AssetCopier<'a> {
    pub fn new(imported: &'a Imported, source: &'a Path, target: &Path, originals: Originals) -> Self {
        let stem = target.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy().into_owned());
        Self {
            assets: &imported.assets,
            source,
            target_folder: folder_of(target),
            folder: format!("{stem}_files"),
            originals,
            copied: BTreeMap::new(),
            count: 0,
            uses: None,
        }
    }

    /// To find out what would be read and written.
    pub fn with_uses(self, uses: FileUses) -> Self {
        Self { uses: Some(uses), ..self }
    }

    /// Files written beside the scene.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether a file, or data in place of one, exists.
    pub fn is_there(&self, name: &str) -> bool {
        self.assets.contains(name) || folder_of(self.source).join(name).is_file()
    }

    /// Copies a file; the result is its name relative to the target. `path` is where the scene names it.
    pub fn add(&mut self, path: &str, name: &str) -> Result<String> {
        if let Some(done) = self.copied.get(name) {
            return Ok(done.clone());
        }
        let new = if self.assets.contains(name) {
            let new = self.free_name(Path::new(name));
            self.write_asset(path, name, &new)?;
            new
        } else {
            let original = folder_of(self.source).join(name);
            let missing = |e: std::io::Error| Error::Missing {
                file: original.clone(),
                message: format!("{e} (named by {}: {path})", self.source.display()),
            };
            let real = original.canonicalize().map_err(missing)?;
            if let Some(uses) = &mut self.uses {
                uses.read(&original, path)?;
            }
            match self.originals {
                Originals::Link => self.relative(&real),
                Originals::Copy => {
                    let new = self.free_name(&original);
                    if is_obj(&original) {
                        self.copy_obj(path, &original, &new)?;
                    } else {
                        self.copy(path, &original, &new)?;
                    }
                    new
                }
            }
        };
        self.copied.insert(name.to_owned(), new.clone());
        Ok(new)
    }

    /// A name in the folder beside the scene that nothing else has. An OBJ, which names further files, has a folder of
    /// its own.
    fn free_name(&self, original: &Path) -> String {
        let is_obj = is_obj(original);
        let file = original.file_name().map_or("file".into(), |name| name.to_string_lossy().into_owned());
        let (stem, extension) = file.rsplit_once('.').unwrap_or((&file, ""));
        let taken = |name: &String| self.copied.values().any(|other| other == name);
        let name = |n: usize| match (is_obj, n) {
            (true, 1) => format!("{}/{stem}/{file}", self.folder),
            (true, n) => format!("{}/{stem}_{n}/{file}", self.folder),
            (false, 1) => format!("{}/{file}", self.folder),
            (false, n) => format!("{}/{stem}_{n}.{extension}", self.folder),
        };
        (1..).map(name).find(|name| !taken(name)).unwrap_or_default()
    }

    /// Where `new`, which comes of `original` at `path` in the scene, is to be written, with its folder made; `None` if
    /// it is there already, or nothing is written.
    fn place(&mut self, path: &str, original: Option<&Path>, new: &str) -> Result<Option<PathBuf>> {
        let place = self.target_folder.join(new);
        if let Some(original) = original
            && place.canonicalize().is_ok_and(|place| original.canonicalize().is_ok_and(|original| original == place))
        {
            return Ok(None);
        }
        if let Some(uses) = &mut self.uses {
            original.map_or(Ok(()), |original| uses.read(original, path))?;
            return uses.write(&place, format!("a copy of {path}")).map(|()| None);
        }
        let folder = folder_of(&place);
        fs::create_dir_all(&folder).map_err(|e| Error::Output { file: folder, message: e.to_string() })?;
        self.count += 1;
        Ok(Some(place))
    }

    fn copy(&mut self, path: &str, original: &Path, new: &str) -> Result<()> {
        let Some(place) = self.place(path, Some(original), new)? else { return Ok(()) };
        let missing = |e: std::io::Error| Error::Missing { file: original.into(), message: e.to_string() };
        let mut reader = file::open(original).map_err(missing)?;
        let mut start = Vec::new();
        Read::by_ref(&mut reader).take(START).read_to_end(&mut start).map_err(missing)?;
        check_kind(original, &start)?;
        let mut reader = Cursor::new(start).chain(reader);
        write_atomically(&place, |out| std::io::copy(&mut reader, out).map(drop).map_err(|e| e.to_string()))
    }

    /// Copies an OBJ with its MTLs and their images, all into one folder.
    fn copy_obj(&mut self, path: &str, original: &Path, new: &str) -> Result<()> {
        let folder = new.rsplit_once('/').map_or("", |(folder, _)| folder).to_owned();
        let mut names = Names::default();
        let mut libraries = Vec::new();
        self.copy_text(path, original, new, |key, rest| {
            let name = (key == "mtllib").then(|| names.of(rest))?;
            libraries.push((folder_of(original).join(rest), name.clone()));
            Some(name)
        })?;
        let mut images = Vec::new();
        for (mtl, name) in libraries.iter().filter(|(mtl, _)| mtl.is_file()) {
            let start = file::read(mtl).map_err(|e| Error::Missing { file: mtl.clone(), message: e.to_string() })?;
            check_kind(&mtl.with_extension("mtl"), &start).map_err(|_| not_a(mtl, "MTL"))?;
            self.copy_text(path, mtl, &format!("{folder}/{name}"), |key, rest| {
                let is_map = key.starts_with("map_") || ["norm", "bump", "disp", "decal"].contains(&key);
                // Options stand before the name of the file.
                let (options, file) = rest.rsplit_once(char::is_whitespace).unwrap_or(("", rest));
                let name = is_map.then(|| names.of(file))?;
                images.push((folder_of(mtl).join(file), name.clone()));
                Some(format!("{options} {name}").trim().to_owned())
            })?;
        }
        images.sort();
        images.dedup();
        for (image, name) in images.iter().filter(|(image, _)| image.is_file()) {
            self.copy(path, image, &format!("{folder}/{name}"))?;
        }
        Ok(())
    }

    /// Copies a text; `change` gives what stands behind a line's first word in place of what does, if that changes.
    fn copy_text(
        &mut self,
        path: &str,
        original: &Path,
        new: &str,
        mut change: impl FnMut(&str, &str) -> Option<String>,
    ) -> Result<()> {
        let bytes =
            file::read(original).map_err(|e| Error::Missing { file: original.into(), message: e.to_string() })?;
        let mut copy = Vec::with_capacity(bytes.len());
        for line in bytes.split_inclusive(|&byte| byte == b'\n') {
            let changed = std::str::from_utf8(line).ok().and_then(|line| {
                let (key, rest) = line.trim().split_once(char::is_whitespace)?;
                Some(format!("{key} {}\n", change(&key.to_lowercase(), rest.trim())?))
            });
            copy.extend_from_slice(changed.as_ref().map_or(line, |line| line.as_bytes()));
        }
        let Some(place) = self.place(path, Some(original), new)? else { return Ok(()) };
        write_atomically(&place, |out| out.write_all(&copy).map_err(|e| e.to_string()))
    }

    fn write_asset(&mut self, path: &str, name: &str, new: &str) -> Result<()> {
        let Some(place) = self.place(path, None, new)? else { return Ok(()) };
        let assets = self.assets;
        if let Some(mesh) = assets.meshes.get(name) {
            write_atomically(&place, |out| write_ply(mesh, out).map_err(|e| e.to_string()))?;
        } else if let Some(image) = assets.images.get(name) {
            write_atomically(&place, |out| write_image(image, out))?;
        } else if let Some(image) = assets.environments.get(name) {
            write_atomically(&place, |out| write_environment(image, out))?;
        } else if let Some(volume) = assets.volumes.get(name) {
            write_atomically(&place, |out| out.write_all(&vol_bytes(volume)).map_err(|e| e.to_string()))?;
        } else if let Some(profile) = assets.profiles.get(name) {
            write_atomically(&place, |out| out.write_all(&ies_bytes(profile)).map_err(|e| e.to_string()))?;
        }
        Ok(())
    }

    /// A path as seen from the target's folder, by `..` where they have a folder in common, else absolute.
    fn relative(&self, real: &Path) -> String {
        let Ok(from) = self.target_folder.canonicalize() else { return real.to_string_lossy().into_owned() };
        let common = from.components().zip(real.components()).take_while(|(a, b)| a == b).count();
        if common <= 1 {
            return real.to_string_lossy().into_owned();
        }
        let up = from.components().skip(common).map(|_| Path::new(".."));
        let path: PathBuf = up.chain(real.components().skip(common).map(|c| Path::new(c.as_os_str()))).collect();
        path.to_string_lossy().into_owned()
    }
}

/// Bytes at the start of a file that its type is detected from.
const START: u64 = 1 << 16;

/// Rejects files whose content does not match their extension: a scene of a stranger could name any file, and the copy
/// would disclose it.
fn check_kind(path: &Path, start: &[u8]) -> Result<()> {
    let kind = path.extension().map(|e| e.to_string_lossy().to_uppercase()).unwrap_or_default();
    let start = start.strip_prefix(MARK).unwrap_or(start);
    let has_line = |word: &str| {
        start.split(|byte| *byte == b'\n').any(|line| line.trim_ascii_start().starts_with(word.as_bytes()))
    };
    let is_image = || image::guess_format(start).is_ok();
    let is_so = match kind.as_str() {
        "OBJ" => ["v ", "v\t", "mtllib ", "o ", "g "].iter().any(|word| has_line(word)),
        "MTL" => has_line("newmtl"),
        "PLY" => start.starts_with(b"ply"),
        "IES" => has_line("TILT=") || has_line("IESNA"),
        "PFM" => start.starts_with(b"PF") || start.starts_with(b"Pf"),
        "VOL" => start.starts_with(b"VOL"),
        "VDB" | "NVDB" => VDB_MAGICS.iter().any(|magic| start.starts_with(magic)),
        "BSDF" => start.starts_with(TENSOR_MAGIC),
        "SERIALIZED" => start.starts_with(&[0x1c, 0x04]),
        // These have no mark, but a kind of image and a depth from a short list.
        "TGA" => {
            is_image()
                || matches!(
                    start,
                    [_, 0 | 1, 1..=3 | 9..=11, _, _, _, _, _, _, _, _, _, _, _, _, _, 8 | 15 | 16 | 24 | 32, ..]
                )
        }
        _ => is_image(),
    };
    if is_so { Ok(()) } else { Err(not_a(path, if kind.is_empty() { "image" } else { &kind })) }
}

fn not_a(path: &Path, kind: &str) -> Error {
    Error::Malformed {
        file: path.to_owned(),
        message: format!("this is no {kind} file, and is not copied (--link names the files where they are)"),
    }
}

fn is_obj(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj"))
}

/// Names of files that come from many folders into one.
#[derive(Default)]
struct Names(BTreeMap<String, String>);

impl Names {
    /// The name for what was called `original`.
    fn of(&mut self, original: &str) -> String {
        if let Some(name) = self.0.get(original) {
            return name.clone();
        }
        let file = Path::new(&original.replace('\\', "/"))
            .file_name()
            .map_or("file".into(), |name| name.to_string_lossy().into_owned());
        let is_taken = |name: &String| self.0.values().any(|other| other == name);
        let (stem, extension) = file.rsplit_once('.').unwrap_or((&file, "bin"));
        let other = |n: usize| if n == 1 { file.clone() } else { format!("{stem}_{n}.{extension}") };
        let name = (1..).map(other).find(|name| !is_taken(name)).unwrap_or_default();
        self.0.insert(original.to_owned(), name.clone());
        name
    }
}

fn write_image(image: &ImageData, out: &mut BufWriter<&mut fs::File>) -> Result<(), String> {
    let (width, height) = (image.width as u32, image.height as u32);
    let color = |is_wide| match (image.channels, is_wide) {
        (1, false) => image::ExtendedColorType::L8,
        (2, false) => image::ExtendedColorType::La8,
        (3, false) => image::ExtendedColorType::Rgb8,
        (_, false) => image::ExtendedColorType::Rgba8,
        (1, true) => image::ExtendedColorType::L16,
        (2, true) => image::ExtendedColorType::La16,
        (3, true) => image::ExtendedColorType::Rgb16,
        (_, true) => image::ExtendedColorType::Rgba16,
    };
    let encode = |bytes: &[u8], color, out: &mut BufWriter<&mut fs::File>| {
        let encoder = image::codecs::png::PngEncoder::new(out);
        image::ImageEncoder::write_image(encoder, bytes, width, height, color).map_err(|e| e.to_string())
    };
    let floats: Vec<f32> = match &image.samples {
        Samples::U8(samples) => return encode(samples, color(false), out),
        Samples::U16(samples) => {
            let bytes: Vec<u8> = samples.iter().flat_map(|s| s.to_ne_bytes()).collect();
            return encode(&bytes, color(true), out);
        }
        Samples::F16(samples) => samples.iter().map(|s| s.to_f32()).collect(),
        Samples::F32(samples) => samples.clone(),
    };
    let channels = image.channels;
    let plane = |channel: usize| floats.iter().skip(channel).step_by(channels).copied().collect::<Vec<f32>>();
    let names = if channels < 3 { ["R", "G", "B"].map(|name| (name, 0)) } else { [("R", 0), ("G", 1), ("B", 2)] };
    let alpha = (channels.is_multiple_of(2)).then_some(("A", channels - 1));
    let planes = names.into_iter().chain(alpha).map(|(name, channel)| (name, plane(channel))).collect();
    write_exr(image.width, image.height, planes, out)
}

fn write_environment(image: &RgbImage, out: &mut BufWriter<&mut fs::File>) -> Result<(), String> {
    let plane = |channel: usize| image.pixels.iter().map(|pixel| pixel[channel]).collect::<Vec<f32>>();
    write_exr(image.width, image.height, vec![("R", plane(0)), ("G", plane(1)), ("B", plane(2))], out)
}

/// Writes planes of floats by the names of their channels.
fn write_exr(
    width: usize,
    height: usize,
    planes: Vec<(&str, Vec<f32>)>,
    out: &mut BufWriter<&mut fs::File>,
) -> Result<(), String> {
    use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, WritableImage};
    let channels = planes.into_iter().map(|(name, samples)| AnyChannel::new(name, FlatSamples::F32(samples))).collect();
    let image = Image::from_channels((width, height), AnyChannels::sort(channels));
    // The writer goes back to fill in tables of offsets, so the file is made in memory first.
    let mut buffer = Cursor::new(Vec::new());
    image.write().to_buffered(&mut buffer).map_err(|e| e.to_string())?;
    out.write_all(buffer.get_ref()).map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::{read_image, read_rgb_image};

    fn file(
        name: &str,
        write: impl FnOnce(&mut BufWriter<&mut fs::File>) -> Result<(), String>,
    ) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        write_atomically(&path, write).unwrap();
        (folder, path)
    }

    #[test]
    fn images_come_back_as_they_were() {
        for channels in 1..=4 {
            let count = 3 * 2 * channels;
            let image = |samples| ImageData { width: 3, height: 2, channels, samples };
            let small = image(Samples::U8((0..count).map(|i| i as u8 * 7).collect()));
            let wide = image(Samples::U16((0..count).map(|i| i as u16 * 999).collect()));
            for image in [small, wide] {
                let (_folder, path) = file("a.png", |out| write_image(&image, out));
                assert_eq!(read_image(&path).unwrap(), image);
            }
        }
        let floats = ImageData {
            width: 2,
            height: 1,
            channels: 4,
            samples: Samples::F32(vec![1e-3, 2.5, 1e9, 0.25, -1.0, 3.0, 4.0, 1.0]),
        };
        let (_folder, path) = file("a.exr", |out| write_image(&floats, out));
        assert_eq!(read_image(&path).unwrap(), floats);
    }

    #[test]
    fn environments_come_back_as_they_were() {
        let image = RgbImage { width: 2, height: 2, pixels: (0..4).map(|i| [i as f32, 1e5, 0.1]).collect() };
        let (_folder, path) = file("a.exr", |out| write_environment(&image, out));
        assert_eq!(read_rgb_image(&path).unwrap(), image);
    }
}
