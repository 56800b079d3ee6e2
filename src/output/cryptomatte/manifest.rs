//! The names behind the ids: a JSON object from name to eight hexadecimal digits.

use std::collections::BTreeMap;

use super::hash::{id_bits, is_ordinary};

/// A manifest of these names, sorted.
pub fn manifest<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let ids: BTreeMap<&str, String> = names.into_iter().map(|name| (name, format!("{:08x}", id_bits(name)))).collect();
    // A map of strings always has a JSON form.
    serde_json::to_string(&ids).unwrap_or_default()
}

/// The names and ids of a manifest, in the order of the names.
///
/// # Errors
/// What is wrong with the text: it is not JSON, not an object, or an id has not eight hexadecimal digits of an ordinary
/// float.
pub fn parse_manifest(text: &str) -> Result<BTreeMap<String, u32>, String> {
    let entries: BTreeMap<String, serde_json::Value> =
        serde_json::from_str(text).map_err(|e| format!("it is no JSON object: {e}"))?;
    entries
        .into_iter()
        .map(|(name, value)| {
            let digits = value.as_str().filter(|digits| digits.len() == 8);
            let bits = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
            match bits {
                Some(bits) => Ok((name, bits)),
                None => {
                    Err(format!("the id of \"{name}\" is {value}, which is not a string of eight hexadecimal digits"))
                }
            }
        })
        .collect()
}

/// What is wrong with a name's id, if anything.
pub fn id_fault(name: &str, bits: u32) -> Option<String> {
    let expected = id_bits(name);
    if bits == expected {
        return None;
    }
    let raw = if is_ordinary(bits) { "" } else { ", the hash without its conversion" };
    Some(format!("\"{name}\" has the id {bits:08x}{raw}; its name gives {expected:08x}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn manifests_come_back() {
        let text = manifest(["torus", "равнина", "a \"b\"\n", "torus", "obj45"]);
        assert!(text.starts_with(r#"{"a \"b\"\n":""#) && text.contains(r#""obj45":"00f34d5c""#), "{text}");
        let read = parse_manifest(&text).unwrap();
        assert_eq!(read.len(), 4);
        assert!(read.iter().all(|(name, bits)| id_fault(name, *bits).is_none()));
        assert_eq!(manifest([]), "{}");
    }

    #[test]
    fn faults_of_manifests_are_named() {
        for (text, part) in [
            ("", "no JSON"),
            ("[1]", "no JSON object"),
            (r#"{"a": 7}"#, "\"a\""),
            (r#"{"a": "12"}"#, "eight"),
            (r#"{"a": "1234567x"}"#, "eight"),
        ] {
            let fault = parse_manifest(text).unwrap_err();
            assert!(fault.contains(part), "{fault}");
        }
        let raw = id_fault("obj520", 0x7fbb_01ed).unwrap();
        assert!(raw.contains("without its conversion") && raw.ends_with("7f3b01ed"), "{raw}");
        assert!(id_fault("torus", 1 << 25).unwrap().contains("f19c73fd"));
    }
}
