//! Which files a command reads and writes, so that none is overwritten that is needed.

use std::collections::HashMap;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Component, Path, PathBuf};

use crate::error::{Error, Result};

/// The files that a command reads and writes. A written file is neither read nor written by another name, be it by
/// symbolic or hard links.
#[derive(Clone, Debug, Default)]
pub struct FileUses {
    uses: HashMap<Identity, Use>,
}

/// What makes two names those of one file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Identity {
    /// Device and inode of a file that is there.
    File(u64, u64),
    /// The place of one that is not.
    Place(PathBuf),
}

/// The first use of a file.
#[derive(Clone, Debug)]
struct Use {
    path: PathBuf,
    purpose: String,
    written: bool,
}

impl FileUses {
    /// A file that is read, for a purpose such as `lights[0].file`.
    ///
    /// # Errors
    /// [`Error::Usage`] naming both uses if it is written.
    pub fn read(&mut self, path: &Path, purpose: impl Into<String>) -> Result<()> {
        self.insert(Use { path: path.to_owned(), purpose: purpose.into(), written: false })
    }

    /// A file that is written, for a purpose such as `--output`.
    ///
    /// # Errors
    /// [`Error::Usage`] naming both uses if it is read or written for another purpose.
    pub fn write(&mut self, path: &Path, purpose: impl Into<String>) -> Result<()> {
        self.insert(Use { path: path.to_owned(), purpose: purpose.into(), written: true })
    }

    fn insert(&mut self, new: Use) -> Result<()> {
        let Some(identity) = identity(&new.path) else { return Ok(()) };
        let Some(known) = self.uses.get(&identity) else {
            self.uses.insert(identity, new);
            return Ok(());
        };
        if !known.written && !new.written {
            return Ok(());
        }
        let name = |file: &Use| format!("{} ({})", file.path.display(), file.purpose);
        let (known, new) = if known.written && !new.written { (&new, known) } else { (known, &new) };
        let why = if known.written {
            "both would be written to one file"
        } else {
            "the one is read and the other would overwrite it"
        };
        Err(Error::Usage(format!("{} and {}: {why}; choose another name", name(known), name(new))))
    }
}

/// Which file a name means; `None` if it is a device, a pipe or the like, which writing does not overwrite.
fn identity(path: &Path) -> Option<Identity> {
    if let Ok(found) = fs::metadata(path) {
        return (found.is_file() || found.is_dir()).then(|| Identity::File(found.dev(), found.ino()));
    }
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    // As much of it as is there; of a link that leads nowhere, the link itself, which is what writing replaces.
    let there = absolute.ancestors().skip(1).find_map(|folder| Some((folder, folder.canonicalize().ok()?)));
    Some(Identity::Place(match there {
        Some((folder, real)) => without_dots(&real, absolute.strip_prefix(folder).unwrap_or(&absolute)),
        None => absolute,
    }))
}

/// A path below a folder, both of names that are not there yet, without `.` and `..`.
fn without_dots(folder: &Path, path: &Path) -> PathBuf {
    path.components().fold(folder.to_owned(), |mut place, part| {
        match part {
            Component::ParentDir => drop(place.pop()),
            Component::CurDir => {}
            part => place.push(part),
        }
        place
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    fn clash(folder: &Path, a: &str, b: &str) -> bool {
        let mut uses = FileUses::default();
        uses.read(&folder.join(a), "the scene").unwrap();
        let read = uses.write(&folder.join(b), "--output").map_err(|e| e.to_string());
        let mut uses = FileUses::default();
        uses.write(&folder.join(b), "--output").unwrap();
        let reversed = uses.read(&folder.join(a), "the scene").map_err(|e| e.to_string());
        assert_eq!(read, reversed);
        let mut uses = FileUses::default();
        uses.write(&folder.join(a), "--json").unwrap();
        let written = uses.write(&folder.join(b), "--output");
        assert_eq!(read.is_err(), written.is_err());
        if let (Err(read), Err(written)) = (&read, written) {
            for part in [format!("{a} (the scene)"), format!("{b} (--output)"), "overwrite".to_owned()] {
                assert!(read.contains(&part), "{read}");
            }
            assert!(
                matches!(
                    &written, Error::Usage(message) if message.contains("(--json)") && message.contains("(--output)")
                ),
                "{written}"
            );
        }
        read.is_err()
    }

    #[test]
    fn one_file_has_many_names() {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path();
        fs::create_dir(dir.join("sub")).unwrap();
        fs::write(dir.join("a"), "").unwrap();
        fs::write(dir.join("other"), "").unwrap();
        symlink("a", dir.join("link")).unwrap();
        symlink(dir.join("sub"), dir.join("folder")).unwrap();
        fs::hard_link(dir.join("a"), dir.join("hard")).unwrap();
        for name in ["a", "./a", "sub/../a", "folder/../a", "link", "hard"] {
            assert!(clash(dir, "a", name), "{name}");
            assert!(!clash(dir, "other", name), "{name}");
        }
        // Files that are not there yet, in folders that are there or not.
        for (a, b) in
            [("new", "./new"), ("sub/new", "folder/new"), ("none/new", "./none/new"), ("none/new", "none/x/../new")]
        {
            assert!(clash(dir, a, b), "{a} {b}");
        }
        for (a, b) in [("new", "sub/new"), ("new", "New"), ("none/new", "none/new2")] {
            assert!(!clash(dir, a, b), "{a} {b}");
        }
        // What is read may be read again, and devices may be written twice.
        let mut uses = FileUses::default();
        uses.read(&dir.join("a"), "a").and_then(|()| uses.read(&dir.join("link"), "b")).unwrap();
        uses.write(Path::new("/dev/null"), "a").and_then(|()| uses.write(Path::new("/dev/null"), "b")).unwrap();
    }
}
