//! Texture maps of MTL files.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::str::SplitWhitespace;

/// An image that an MTL names, with the options that count.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjMap {
    /// The file.
    pub file: PathBuf,
    /// `-s`, factor on u and v.
    pub scale: [f32; 2],
    /// `-o`, added to u and v.
    pub offset: [f32; 2],
    /// `-clamp on`: the image is not repeated.
    pub clamp: bool,
    /// `-bm`, factor on heights.
    pub height: f32,
    /// `-imfchan`: `r`, `g`, `b`, `m` (the opacity), `l` (the luminance) or `z`.
    pub channel: Option<char>,
}

/// The maps of a material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjMaps {
    /// `map_Kd`, factor on the diffuse colour.
    pub diffuse: Option<ObjMap>,
    /// `bump` or `map_Bump`: heights, or (by custom) normals.
    pub bump: Option<ObjMap>,
    /// `norm`, normals.
    pub normal: Option<ObjMap>,
    /// `map_d`, opacity.
    pub opacity: Option<ObjMap>,
    /// `map_Ks`, factor on the specular colour.
    pub specular: Option<ObjMap>,
    /// `map_Ke`, factor on the light emitted.
    pub emission: Option<ObjMap>,
    /// Other maps, by their keys.
    pub unused: Vec<String>,
}

/// Takes the maps out of the text of an MTL: what is left for the parser, line by line, and the maps by material.
///
/// # Errors
/// The line and what is wrong with it.
pub fn take_maps(text: &str, folder: &Path) -> Result<(String, HashMap<String, ObjMaps>), String> {
    let mut rest = String::with_capacity(text.len());
    let mut all: HashMap<String, ObjMaps> = HashMap::new();
    let mut material = String::new();
    for (i, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let key = words.next().unwrap_or("");
        let lower = key.to_lowercase();
        if lower == "newmtl" {
            material = line.trim()[key.len()..].trim().to_owned();
        }
        if !(lower.starts_with("map_") || ["bump", "norm", "disp", "decal", "refl"].contains(&lower.as_str())) {
            rest.extend([line, "\n"]);
            continue;
        }
        rest.push('\n');
        let maps = all.entry(material.clone()).or_default();
        let place = match lower.as_str() {
            "map_kd" => &mut maps.diffuse,
            "bump" | "map_bump" => &mut maps.bump,
            "norm" => &mut maps.normal,
            "map_d" => &mut maps.opacity,
            "map_ks" => &mut maps.specular,
            "map_ke" => &mut maps.emission,
            _ => {
                maps.unused.push(key.to_owned());
                continue;
            }
        };
        *place = Some(parse_map(words, line, folder).map_err(|fault| format!("line {}: {key}: {fault}", i + 1))?);
    }
    Ok((rest, all))
}

/// A map's options and file; the file's name is all that follows the options, blanks included.
fn parse_map(words: SplitWhitespace, line: &str, folder: &Path) -> Result<ObjMap, String> {
    let mut map =
        ObjMap { file: PathBuf::new(), scale: [1.0; 2], offset: [0.0; 2], clamp: false, height: 1.0, channel: None };
    let mut words = words.peekable();
    while let Some(word) = words.next_if(|word| word.starts_with('-') && word.len() > 1) {
        let mut numbers = |most: usize| -> Vec<f32> {
            let mut found = Vec::new();
            while found.len() < most
                && let Some(number) = words.peek().and_then(|word| word.parse::<f32>().ok())
            {
                found.push(number);
                words.next();
            }
            found
        };
        match word {
            "-s" | "-o" => {
                let found = numbers(3);
                let first = *found.first().ok_or_else(|| format!("{word} needs numbers"))?;
                let pair = if word == "-s" { &mut map.scale } else { &mut map.offset };
                *pair = [first, found.get(1).copied().unwrap_or(pair[1])];
            }
            "-bm" => map.height = *numbers(1).first().ok_or("-bm needs a number")?,
            "-t" | "-mm" | "-boost" | "-texres" => drop(numbers(3)),
            "-clamp" => map.clamp = words.next() == Some("on"),
            "-imfchan" => map.channel = words.next().and_then(|word| word.chars().next()),
            // One word each: -blendu, -blendv, -cc, -type.
            _ => drop(words.next()),
        }
    }
    let first = words.next().ok_or("no file is named")?;
    // A word of the rest may also stand among the options: the name starts at its last occurrence that the rest of the
    // words follow.
    let rest: Vec<&str> = std::iter::once(first).chain(words).collect();
    let start =
        line.rmatch_indices(first).map(|(at, _)| at).find(|&at| line[at..].split_whitespace().eq(rest.iter().copied()));
    let name = line[start.unwrap_or(0)..].trim().replace('\\', "/");
    map.file = folder.join(name);
    if !map.scale.iter().chain(&map.offset).chain([&map.height]).all(|x| x.is_finite()) {
        return Err("an option is not finite".into());
    }
    Ok(map)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn maps(line: &str) -> ObjMaps {
        let (_, all) = take_maps(&format!("newmtl a b\n{line}\n"), Path::new("textures")).unwrap();
        all["a b"].clone()
    }

    #[test]
    fn files_and_options_are_distinguished() {
        let plain = maps("  map_Kd wall.png").diffuse.unwrap();
        assert_eq!((plain.file, plain.scale, plain.clamp), ("textures/wall.png".into(), [1.0; 2], false));
        let all =
            maps("map_Kd -blendu on -s 2 3 1 -o 0.5 -clamp on -imfchan r -mm 0 1 old\\my wall.png").diffuse.unwrap();
        assert_eq!((all.file, all.scale, all.offset), ("textures/old/my wall.png".into(), [2.0, 3.0], [0.5, 0.0]));
        assert_eq!((all.clamp, all.channel), (true, Some('r')));
        let bump = maps("map_Bump -bm 0.25 b.png");
        assert_eq!(bump.bump.unwrap().height, 0.25);
        assert_eq!(maps("norm n.png").normal.unwrap().file, Path::new("textures/n.png"));
        assert_eq!(maps("map_d on on").opacity.unwrap().file, Path::new("textures/on on"));
        assert_eq!(maps("map_Ka a.png\nmap_Ns n.png").unused, ["map_Ka", "map_Ns"]);
    }

    #[test]
    fn maps_leave_the_other_lines_where_they_are() {
        let (rest, all) =
            take_maps("newmtl a\nKd 1 1 1\nmap_Kd x.png\nnewmtl b\nbump y.png\nNs 3\n", Path::new("")).unwrap();
        assert_eq!(rest, "newmtl a\nKd 1 1 1\n\nnewmtl b\n\nNs 3\n");
        assert!(all["a"].bump.is_none() && all["b"].bump.is_some());
    }

    #[test]
    fn maps_that_make_no_sense_have_their_line() {
        for line in ["map_Kd", "map_Kd -s x.png", "bump -bm x.png", "map_d -o", "map_Kd -s 1e39 1 x.png"] {
            let fault = take_maps(&format!("newmtl a\n{line}\n"), Path::new("")).unwrap_err();
            assert!(fault.starts_with("line 2: "), "{line}: {fault}");
        }
    }
}
