//! Files with random changes: whatever a reader is given, it ends in data or in an error.

use std::path::Path;
use std::time::Instant;

use super::{Effort, Faults, Outcome};
use crate::compile;
use crate::render::{Overrides, Settings};
use crate::stability::geometry::Rng;
use crate::{assets, import};

/// What is mutated: scenes of the gallery, which between them use most of what there is.
const SCENES: [&str; 6] = [
    include_str!("../../../scenes/cornell.json"),
    include_str!("../../../scenes/glass.json"),
    include_str!("../../../scenes/motion.json"),
    include_str!("../../../scenes/analytic.json"),
    include_str!("../../../scenes/shapes.json"),
    include_str!("../../../scenes/depth_of_field.json"),
];

const OBJ: &str = "mtllib a.mtl\no cube\nv 0 0 0 1 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 0 1 0\nv 0 1 0 0 0 1\nvn 0 0 1\n\
                   vt 0 0\nvt 1 1\nusemtl red\n\
                   f 1/1/1 2/2/1 3/1/1\nf -4//1 -2//1 -1//1\nl 1 2 3\np 1\ng other\ns off\nf 1 2 3 4\n";

const PLY: &str = "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\n\
                   property float z\nproperty float u\n\
                   property float v\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0 0\n\
                   1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n\
                   3 0 1 2\n4 0 1 2 3\n";

const IES: &str = "IESNA:LM-63-2002\n[TEST] 1\n[MANUFAC] none\nTILT=NONE\n1 1000 1 3 2 1 2 0.1 0.1 0\n1 1 50\n0 45 90\n\
                   0 90\n10 8 0\n9 7 0\n";

/// What is put in place of numbers and between bytes.
const WORDS: [&str; 24] = [
    "0",
    "-1",
    "1e999",
    "-1e308",
    "1e-320",
    "NaN",
    "inf",
    "4294967295",
    "4294967296",
    "-2147483649",
    "18446744073709551616",
    "0.1e",
    "null",
    "true",
    "[]",
    "{}",
    "[[[[[[[[",
    "}",
    "\"",
    "\\u0000",
    "//",
    "/*",
    "\u{feff}",
    "\n",
];

/// One random change.
fn mutate(rng: &mut Rng, bytes: &mut Vec<u8>) {
    if bytes.is_empty() {
        bytes.push(b'0');
    }
    let at = rng.below(bytes.len());
    let span = at..(at + 1 + rng.below(40)).min(bytes.len());
    let word = WORDS[rng.below(WORDS.len())].bytes();
    match rng.below(18) {
        0 => bytes[at] ^= 1 << rng.below(8),
        1 => bytes[at] = rng.bits() as u8,
        2 => drop(bytes.drain(span)),
        3 => {
            let copy = bytes[span].to_vec();
            bytes.splice(at..at, copy);
        }
        4 => drop(bytes.splice(at..at, word)),
        5 => bytes.truncate(at),
        6..=11 => {
            // One digit, or the sign, of the number that follows.
            let is_part = |b: &u8| b.is_ascii_digit() || *b == b'-';
            let place = at + bytes[at..].iter().position(is_part).unwrap_or(0);
            bytes[place] = b"0123456789-"[rng.below(11)];
        }
        _ => {
            // The number, or what else is a word, that follows.
            let is_part = |b: &u8| b.is_ascii_alphanumeric() || b"+-.".contains(b);
            let start = at + bytes[at..].iter().position(is_part).unwrap_or(0);
            let end = start + bytes[start..].iter().take_while(|b| is_part(b)).count();
            bytes.splice(start..end, word);
        }
    }
}

/// What reads a file's bytes; the error is its text.
type Reader<'a> = dyn Fn(&[u8]) -> Result<(), String> + 'a;

/// What became of mutated files of one kind.
#[derive(Default)]
struct Tally {
    read: usize,
    refused: usize,
    /// Refused without a reason.
    silent: Faults,
    /// Refused without a mutation.
    unread: Faults,
    slowest: f64,
}

impl Tally {
    /// Feeds `count` mutations of `seeds` to a reader.
    fn of(rng: &mut Rng, count: usize, seeds: &[&str], read: &Reader<'_>) -> Self {
        let mut tally = Self::default();
        for seed in seeds {
            if let Err(message) = read(seed.as_bytes()) {
                tally.unread.add(1, || format!("{message}: {seed}"));
            }
        }
        for i in 0..count {
            let mut bytes = seeds[i % seeds.len()].as_bytes().to_vec();
            for _ in 0..=rng.below(3) {
                mutate(rng, &mut bytes);
            }
            let start = Instant::now();
            match read(&bytes) {
                Ok(()) => tally.read += 1,
                Err(message) => {
                    tally.refused += 1;
                    tally.silent.require(!message.trim().is_empty(), || String::from_utf8_lossy(&bytes).into_owned());
                }
            }
            tally.slowest = tally.slowest.max(start.elapsed().as_secs_f64());
        }
        tally
    }

    fn report(&self, outcome: Outcome, what: &str) -> Outcome {
        outcome
            .record(format!("{what} read"), self.read as f64)
            .record(format!("{what} refused"), self.refused as f64)
            .none(format!("{what} refused as they are"), self.unread.clone())
            .none(format!("{what} refused without a reason"), self.silent.clone())
            .record(format!("seconds of the slowest of {what}"), self.slowest)
    }
}

/// Reads and compiles a scene; images and meshes that it names are not there.
fn read_scene(bytes: &[u8], path: &Path) -> Result<(), String> {
    let desc = import::parse_scene(&String::from_utf8_lossy(bytes), path).map_err(|e| e.to_string())?;
    Settings::new(&desc, &Overrides::default()).map_err(|e| e.to_string())?;
    compile::compile(&desc, path).map_err(|e| e.to_string()).map(drop)
}

pub(super) fn e10_mutated_files(effort: Effort) -> Outcome {
    let Ok(folder) = tempfile::tempdir() else { return Outcome::new() };
    let file = folder.path().join("mutated");
    let through_file = |bytes: &[u8], read: &dyn Fn(&Path) -> Result<(), assets::AssetError>| {
        std::fs::write(&file, bytes).map_err(|e| e.to_string())?;
        read(&file).map_err(|e| e.to_string())
    };
    let mut rng = Rng::new(101);
    let scene = |bytes: &[u8]| read_scene(bytes, &folder.path().join("scene.json"));
    let obj = |bytes: &[u8]| through_file(bytes, &|path| assets::read_obj(path, false).map(drop));
    let ply = |bytes: &[u8]| through_file(bytes, &|path| assets::read_ply(path).map(drop));
    let ies = |bytes: &[u8]| through_file(bytes, &|path| assets::read_ies(path).map(drop));
    let parts: [(&str, usize, &[&str], &Reader<'_>); 4] = [
        ("scenes", effort.pick(300, 8_000), &SCENES, &scene),
        ("OBJ files", effort.pick(200, 8_000), &[OBJ], &obj),
        ("PLY files", effort.pick(200, 8_000), &[PLY], &ply),
        ("IES files", effort.pick(200, 8_000), &[IES], &ies),
    ];
    parts.into_iter().fold(Outcome::new(), |outcome, (what, count, seeds, read)| {
        Tally::of(&mut rng, count, seeds, read).report(outcome, what)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_without_a_reason_and_one_without_a_mutation_are_counterexamples() {
        let silent = |bytes: &[u8]| if bytes == b"seed" { Ok(()) } else { Err(String::new()) };
        let tally = Tally::of(&mut Rng::new(1), 20, &["seed"], &silent);
        assert!(tally.silent.count > 0 && tally.silent.first.is_some_and(|text| text != "seed"));
        assert_eq!(tally.unread.count, 0);
        let strict = |_: &[u8]| Err("no".to_owned());
        let tally = Tally::of(&mut Rng::new(1), 20, &["seed"], &strict);
        assert_eq!((tally.unread.first.as_deref(), tally.silent.count), (Some("no: seed"), 0));
    }
}
