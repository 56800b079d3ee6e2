//! Grids by name.

use crate::printable;

/// A grid as its file announces it.
#[derive(Clone, Debug, PartialEq)]
pub struct Listed {
    /// Its name, which others may have, too,
    pub name: String,
    /// and that with its number among these: `density[1]`.
    pub unique: String,
    /// The type of its values, such as `float`.
    pub kind: String,
}

/// Which grid of a file.
#[derive(Clone, Copy, Debug)]
pub struct GridChoice<'a> {
    /// By name.
    pub name: Option<&'a str>,
    /// Without one: the grid of this name, or the only one of the file.
    pub default: &'a str,
}

/// The longest list of grids in a message.
const MAX_LISTED: usize = 20;

/// The number of the grid that is chosen.
pub fn choose(grids: &[Listed], choice: GridChoice) -> Result<usize, String> {
    let name = choice.name.unwrap_or(choice.default);
    if let Some(numbered) = grids.iter().position(|grid| grid.unique == name && grid.name != name) {
        return Ok(numbered);
    }
    let has_name: Vec<usize> = (0..grids.len()).filter(|&i| grids[i].name == name).collect();
    match has_name[..] {
        [only] => return Ok(only),
        [] if choice.name.is_none() && grids.len() == 1 => return Ok(0),
        [] => (),
        _ => {
            let which = list(has_name.into_iter().map(|i| &grids[i]));
            return Err(format!("the file has several grids named \"{name}\": `grid` must be one of {which}"));
        }
    }
    if grids.is_empty() {
        return Err("the file has no grids".into());
    }
    let all = list(grids.iter());
    Err(match choice.name {
        Some(name) => format!("the file has no grid named \"{name}\", but {all}"),
        None => format!("the file has no grid named \"{name}\": `grid` must be one of {all}"),
    })
}

/// The grids by name, with their types.
fn list<'a>(grids: impl ExactSizeIterator<Item = &'a Listed>) -> String {
    let more = grids.len().saturating_sub(MAX_LISTED);
    let names = grids.take(MAX_LISTED).map(|Listed { unique, kind, .. }| format!("\"{unique}\" ({kind})"));
    let names = names.collect::<Vec<_>>().join(", ");
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    printable::line(&format!("{names}{more}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grids(names: &[&str]) -> Vec<Listed> {
        let listed = |unique: &&str| {
            let name = unique.split('[').next().unwrap_or_default().to_owned();
            Listed { name, unique: (*unique).to_owned(), kind: "float".into() }
        };
        names.iter().map(listed).collect()
    }

    #[test]
    fn grids_are_chosen_by_name_or_because_there_is_no_other() {
        let density = |name| GridChoice { name, default: "density" };
        let chosen = |names: &[&str], name| choose(&grids(names), density(name));
        assert_eq!(chosen(&["heat", "density"], None), Ok(1));
        assert_eq!(chosen(&["heat"], None), Ok(0));
        assert_eq!(chosen(&["heat", "density"], Some("heat")), Ok(0));
        assert_eq!(chosen(&["density[0]", "density[1]"], Some("density[1]")), Ok(1));
        assert_eq!(chosen(&["[0]"], None), Ok(0));
        for (names, name, expected) in [
            (&["a", "b"][..], None, "`grid` must be one of \"a\" (float), \"b\" (float)"),
            (&["a"], Some("b"), "no grid named \"b\", but \"a\" (float)"),
            (
                &["density[0]", "density[1]"],
                None,
                "several grids named \"density\": `grid` must be one of \"density[0]\"",
            ),
            (&["density", "density"], None, "several"),
            (&[], None, "no grids"),
            (&["\u{1b}[2J"], Some("b"), "\"\\u001b[2J\""),
        ] {
            let error = chosen(names, name).unwrap_err();
            assert!(error.contains(expected), "{error}");
        }
        let many: Vec<String> = (0..30).map(|i| format!("g{i}")).collect();
        let many: Vec<&str> = many.iter().map(String::as_str).collect();
        assert!(chosen(&many, None).unwrap_err().ends_with("\"g19\" (float) and 10 more"));
    }
}
