//! The file itself: GLB chunks, JSON, version, extensions.

use std::path::Path;

use gltf::json::mesh::Semantic;
use gltf::json::validation::{Checked, Error as Flaw, Validate};
use gltf::json::{Path as JsonPath, Root};
use serde::Deserialize;

use crate::error::{Error, Result};
use crate::import::Draft;

/// The JSON of a file, its indices checked, and the binary chunk of a GLB.
#[derive(Debug)]
pub(crate) struct Document<'a> {
    pub root: Root,
    pub bin: Option<&'a [u8]>,
}

/// Extensions that are read here, so that files may require them.
const READ: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_materials_volume_scatter",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// What must be known before the rest can be understood.
#[derive(Deserialize)]
struct Head {
    asset: Asset,
    #[serde(default, rename = "extensionsRequired")]
    required: Vec<String>,
}

#[derive(Deserialize)]
struct Asset {
    version: String,
    #[serde(default, rename = "minVersion")]
    min_version: Option<String>,
}

const NO_ELEMENT: &str = "no element of this index";

/// Splits and parses the bytes of a file.
pub fn parse<'a>(file: &Path, bytes: &'a [u8]) -> Result<Document<'a>> {
    let fault = |path: &str, message: String| Error::Scene { file: file.into(), path: path.into(), message };
    let (json, bin) =
        if bytes.starts_with(b"glTF") { split(bytes).map_err(|message| fault("GLB", message))? } else { (bytes, None) };
    let json = json.strip_prefix(crate::file::MARK).unwrap_or(json);
    let misread = |e: serde_json::Error| {
        let text = e.to_string();
        let message = text.rsplit_once(" at line ").map_or(text.as_str(), |(message, _)| message);
        Error::Parse {
            file: file.into(),
            line: e.line().max(1),
            column: e.column().max(1),
            message: message.replace("index into child of root", "an index"),
        }
    };

    let head: Head = serde_json::from_slice(json).map_err(misread)?;
    let needs = head.asset.min_version.as_ref().unwrap_or(&head.asset.version);
    if needs.split('.').next() != Some("2") || head.asset.min_version.as_ref().is_some_and(|v| v != "2.0") {
        return Err(fault("asset", format!("the file is glTF {needs}; 2.0 is read")));
    }
    let unread: Vec<&str> = head.required.iter().map(String::as_str).filter(|name| !READ.contains(name)).collect();
    if !unread.is_empty() {
        return Err(fault(
            "extensionsRequired",
            format!("the file cannot be read without {}, which is not supported", unread.join(", ")),
        ));
    }

    let root: Root = serde_json::from_slice(json).map_err(misread)?;
    check_positions(&root).map_err(|path| fault(&path, NO_ELEMENT.into()))?;
    let mut flaws = Vec::new();
    root.validate(&root, JsonPath::new, &mut |path, flaw| {
        // Bounds of accessors are not needed; required extensions have been checked.
        let path = path().0;
        let is_bound = flaw == Flaw::Missing && (path.ends_with(".min") || path.ends_with(".max"));
        if !is_bound && flaw != Flaw::Unsupported && flaws.len() < 10 {
            flaws.push((path, flaw));
        }
    });
    match flaws.into_iter().next() {
        None => Ok(Document { root, bin }),
        Some((path, flaw)) => Err(fault(
            &path,
            match flaw {
                Flaw::IndexOutOfBounds => NO_ELEMENT.into(),
                Flaw::Missing => "is needed, but not there".into(),
                Flaw::Oversize => "is too large".into(),
                _ => "the value is not one of glTF".into(),
            },
        )),
    }
}

/// That the accessors of positions are there: validation reads them before it checks this. The error is the place.
fn check_positions(root: &Root) -> Result<(), String> {
    for (i, mesh) in root.meshes.iter().enumerate() {
        for (k, primitive) in mesh.primitives.iter().enumerate() {
            let index = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            if index.is_some_and(|index| index.value() >= root.accessors.len()) {
                return Err(format!("meshes[{i}].primitives[{k}].attributes.POSITION"));
            }
        }
    }
    Ok(())
}

/// The JSON and the binary chunk of a GLB file.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err("the file is cut short within its header".into());
    };
    if version != 2 {
        return Err(format!("the container has version {version}; 2 is read"));
    }
    if length as usize > bytes.len() {
        return Err(format!("the file is cut short: it has {} of {length} bytes", bytes.len()));
    }
    let (mut json, mut bin) = (None, None);
    let mut at = 12;
    while at < length as usize {
        let chunk = word(at).and_then(|size| bytes.get(at + 8..(at + 8).checked_add(size as usize)?));
        let (Some(chunk), Some(kind)) = (chunk, bytes.get(at + 4..at + 8)) else {
            return Err(format!("the chunk at byte {at} reaches beyond the end of the file"));
        };
        match kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            _ if json.is_none() => return Err("the first chunk is not the JSON".into()),
            b"BIN\0" if bin.is_none() => bin = Some(chunk),
            _ => {}
        }
        at += 8 + chunk.len();
    }
    Ok((json.ok_or("no JSON chunk")?, bin))
}

/// Reports which extensions of the file are not read.
pub fn report_extensions(root: &Root, draft: &mut Draft) {
    for name in &root.extensions_used {
        if READ.contains(&name.as_str()) {
            draft.mapped("extensionsUsed", &format!("extension {name}"), "");
        } else {
            draft.ignored(
                "extensionsUsed",
                &format!("extension {name}"),
                "",
                "unsupported; the rest of the file is read without it",
            );
        }
    }
}
