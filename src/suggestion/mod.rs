//! What the user may have meant by a name that does not exist.

mod synonyms;

pub use synonyms::elsewhere;
use synonyms::synonym;
#[cfg(test)]
pub use synonyms::targets;

/// Longer names, in characters, are compared with none: that would take the square of their length.
const MAX_NAME: usize = 128;

/// Names that one is compared with, of those of about its length.
const MAX_CANDIDATES: usize = 10_000;

/// The end of a message about `name`: ` (did you mean NEAR?)` with the nearest candidate between `quotes`, or nothing
/// if none is near. The candidate for a word of another program is the one that stands for it here.
pub fn did_you_mean<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>, [open, close]: [&str; 2]) -> String {
    nearest(name, candidates).map_or(String::new(), |near| format!(" (did you mean {open}{near}{close}?)"))
}

/// The candidate that [`did_you_mean`] names.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let candidates: Vec<&str> = candidates.into_iter().collect();
    synonym(name, &candidates).or_else(|| closest_name(name, candidates))
}

/// The candidate that `name` is most likely a slip of, if any is near.
fn closest_name<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = |text: &str| text.chars().take(MAX_NAME + 1).count();
    let own = length(name);
    if own > MAX_NAME {
        return None;
    }
    let lower = name.to_lowercase();
    let most = 1 + own / 4;
    candidates
        .into_iter()
        .filter(|candidate| length(candidate).abs_diff(own) <= most)
        .take(MAX_CANDIDATES)
        .map(|candidate| (strsim::damerau_levenshtein(&lower, &candidate.to_lowercase()), candidate))
        .filter(|(distance, _)| *distance <= most)
        .min()
        .map(|(_, candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_matched_regardless_of_case() {
        assert_eq!(closest_name("gold", ["Silver", "Gold"]), Some("Gold"));
        assert_eq!(closest_name("gold", ["Silver", "Chrome"]), None);
    }
}
