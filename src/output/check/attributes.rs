//! Rules about colour spaces and the standard attributes.

use exr::meta::attribute::{AttributeValue, Chromaticities};

use super::Fault;
use super::file::{ExrFile, utf8};
use crate::output::color_space::{COLOR_SPACES, DATA, INTEROP_ID, chromaticity_values};
use crate::output::matrices::{Matrix, centre_and_axes};
use crate::output::role::Role;

/// Whether a part holds colour, and whether it holds anything else (coverage belongs to both).
fn contents(file: &ExrFile, part: usize) -> [bool; 2] {
    let holds = |test: fn(Role) -> bool| file.channels().any(|channel| channel.part == part && test(channel.role));
    [holds(|role| role == Role::Color), holds(Role::is_data)]
}

fn parts(file: &ExrFile, what: impl Fn(usize) -> Option<String>) -> Vec<Fault> {
    (0..file.headers.len()).filter_map(|part| what(part).map(|what| Fault::part(part, what))).collect()
}

fn chromaticities(file: &ExrFile, part: usize) -> Option<Chromaticities> {
    file.headers[part].shared_attributes.chromaticities
}

pub fn color_unknown(file: &ExrFile) -> Vec<Fault> {
    parts(file, |part| {
        let silent = chromaticities(file, part).is_none() && file.text(part, INTEROP_ID).is_none();
        (silent && contents(file, part)[0]).then(|| "colour without chromaticities and colorInteropID".to_owned())
    })
}

pub fn color_contradiction(file: &ExrFile) -> Vec<Fault> {
    parts(file, |part| {
        let (id, written) = (file.text(part, INTEROP_ID)?, chromaticities(file, part)?);
        let (_, expected) = COLOR_SPACES.iter().find(|(name, _)| *name == id)?;
        let [a, b] = [chromaticity_values(&written), chromaticity_values(expected)];
        let differ = a.iter().zip(b).any(|(a, b)| (a - b).abs() > 0.002);
        differ.then(|| format!("colorInteropID is {id}, whose primaries and white are not those of the chromaticities"))
    })
}

pub fn color_id(file: &ExrFile) -> Vec<Fault> {
    parts(file, |part| {
        let id = file.text(part, INTEROP_ID)?;
        let known = id == DATA || id == "unknown" || COLOR_SPACES.iter().any(|(name, _)| *name == id);
        (!known).then(|| format!("colorInteropID is {id}"))
    })
}

pub fn color_of_data(file: &ExrFile) -> Vec<Fault> {
    parts(file, |part| {
        let id = file.text(part, INTEROP_ID)?;
        match contents(file, part) {
            [true, _] if id == DATA => Some("colorInteropID is data, but there is colour".to_owned()),
            [false, true] if id != DATA && id != "unknown" => {
                Some(format!("colorInteropID is {id}, but there is no colour"))
            }
            _ => None,
        }
    })
}

/// Attributes that the format gives a type, as it is written in files.
const TYPES: &[(&str, &str)] = &[
    ("chromaticities", "chromaticities"),
    ("colorInteropID", "string"),
    ("whiteLuminance", "float"),
    ("owner", "string"),
    ("comments", "string"),
    ("capDate", "string"),
    ("expTime", "float"),
    ("isoSpeed", "float"),
    ("aperture", "float"),
    ("focus", "float"),
    ("framesPerSecond", "rational"),
    ("worldToCamera", "m44f"),
    ("worldToNDC", "m44f"),
    ("originalDataWindow", "box2i"),
    ("utcOffset", "float"),
    ("xDensity", "float"),
    ("multiView", "stringvector"),
    ("view", "string"),
    ("timeCode", "timecode"),
];

pub fn types(file: &ExrFile) -> Vec<Fault> {
    let mut faults = Vec::new();
    for part in 0..file.headers.len() {
        for (name, expected) in TYPES {
            // Only what has another type is not in its fixed place; the identifier has none.
            let wrong = match file.attribute(part, name) {
                None | Some(AttributeValue::Text(_)) if *name == "colorInteropID" => None,
                other => other,
            };
            if let Some(value) = wrong {
                let kind = value.kind_name();
                faults.push(Fault::part(
                    part,
                    format!("{name} has the type {}, not {expected}", String::from_utf8_lossy(kind)),
                ));
            }
        }
    }
    faults
}

pub fn capture_date(file: &ExrFile) -> Vec<Fault> {
    let fits = |date: &str| {
        let pattern = "0000:00:00 00:00:00";
        date.len() == pattern.len()
            && date.chars().zip(pattern.chars()).all(|(c, p)| if p == '0' { c.is_ascii_digit() } else { c == p })
    };
    parts(file, |part| {
        let date = utf8(file.headers[part].own_attributes.capture_date.as_ref()?);
        (!fits(&date)).then(|| format!("capDate is \"{date}\""))
    })
}

fn matrices(file: &ExrFile, part: usize) -> [Option<Matrix>; 2] {
    let own = &file.headers[part].own_attributes;
    [own.world_to_camera, own.world_to_normalized_device].map(|matrix| matrix.map(Matrix::from_flat))
}

pub fn matrix_rows(file: &ExrFile) -> Vec<Fault> {
    parts(file, |part| {
        let [camera, _] = matrices(file, part);
        (!camera?.is_affine()).then(|| "the last column of worldToCamera is not 0, 0, 0, 1".to_owned())
    })
}

pub fn ndc(file: &ExrFile) -> Vec<Fault> {
    parts(file, |part| {
        let [camera, ndc] = matrices(file, part);
        let (camera, ndc) = (camera.filter(Matrix::is_affine)?, ndc?);
        let [centre, right, up] = centre_and_axes(&camera, &ndc)?;
        if right[0] <= centre[0] {
            return Some("worldToNDC is mirrored: what is to the right of the camera has the smaller x".to_owned());
        }
        if up[1] >= centre[1] {
            return Some("worldToNDC has y up: what is above the camera has the larger y".to_owned());
        }
        let centred = centre.iter().all(|x| x.abs() < 1e-3);
        centred.then(|| "worldToNDC maps the view axis to 0, 0, the upper left corner of the display window".to_owned())
    })
}
