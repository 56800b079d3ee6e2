//! A file that is written beside its place: without a name where the file system has such files, so that nothing stays
//! of a killed process; else under a name that the next writer of the same file on the same machine removes.

use std::fs::{self, File};
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use rustix::fs::{AtFlags, CWD, OFlags, linkat};

use super::folder_of;

/// The most writers of a file at a time, and the most files left behind where the file system has no locks.
const MOST_NAMES: usize = 100;

/// Errors of file systems, or kernels, that have no files without a name.
const NO_UNNAMED: [i32; 4] = [
    rustix::io::Errno::OPNOTSUPP.raw_os_error(),
    rustix::io::Errno::ISDIR.raw_os_error(),
    rustix::io::Errno::INVAL.raw_os_error(),
    rustix::io::Errno::NOENT.raw_os_error(),
];

/// A file under way to `target`; gone if it is dropped.
pub struct Aside {
    file: File,
    target: PathBuf,
    /// Its own name, if it has one.
    name: Option<PathBuf>,
}

impl Aside {
    /// Makes the file, readable and writable, in the folder of `target`, which has no links.
    pub fn create(target: &Path) -> io::Result<Self> {
        match Self::unnamed(target) {
            Err(e) if e.raw_os_error().is_some_and(|code| NO_UNNAMED.contains(&code)) => Self::named(target),
            other => other,
        }
    }

    fn unnamed(target: &Path) -> io::Result<Self> {
        let mut options = File::options();
        let file = options
            .read(true)
            .write(true)
            .mode(0o666)
            .custom_flags(OFlags::TMPFILE.bits() as i32)
            .open(folder_of(target))?;
        // It gets its name through /proc, which may be missing.
        fs::metadata(path_of(&file))?;
        // Held until it is in its place, so that nobody takes its short-lived name for left over.
        let _ = file.try_lock();
        Ok(Self { file, target: target.to_owned(), name: None })
    }

    fn named(target: &Path) -> io::Result<Self> {
        let create = |name: &Path| {
            let file = File::options().read(true).write(true).create_new(true).mode(0o666).open(name)?;
            let _ = file.try_lock();
            // Before it was locked, another process may have taken it for left over.
            if is_at(&file, name) { Ok(file) } else { Err(io::ErrorKind::AlreadyExists.into()) }
        };
        let (file, name) = with_free_name(target, create)?;
        Ok(Self { file, target: target.to_owned(), name: Some(name) })
    }

    /// The file.
    pub fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Puts the file in its place, and whatever was there goes.
    pub fn commit(mut self) -> io::Result<()> {
        let unnamed = path_of(&self.file);
        let link = |name: &Path| linkat(CWD, &unnamed, CWD, name, AtFlags::SYMLINK_FOLLOW).map_err(io::Error::from);
        if self.name.is_none() {
            match link(&self.target) {
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                other => return other,
            }
            self.name = Some(with_free_name(&self.target, link)?.1);
        }
        if let Some(name) = &self.name {
            fs::rename(name, &self.target)?;
            self.name = None;
        }
        Ok(())
    }
}

impl Drop for Aside {
    fn drop(&mut self) {
        // The first error is the one to report.
        let _ = self.name.take().map(fs::remove_file);
    }
}

/// Where the system shows an open file.
fn path_of(file: &File) -> PathBuf {
    format!("/proc/self/fd/{}", file.as_raw_fd()).into()
}

/// Whether `name` is this very file.
fn is_at(file: &File, name: &Path) -> bool {
    let id = |metadata: &fs::Metadata| (metadata.dev(), metadata.ino());
    matches!((file.metadata(), fs::symlink_metadata(name)), (Ok(a), Ok(b)) if id(&a) == id(&b))
}

/// The names for files on their way to `target`: the same ones in every run on a machine, and others on other machines,
/// whose locks some network file systems do not show.
fn names(target: &Path) -> impl Iterator<Item = PathBuf> {
    let host = fs::read("/proc/sys/kernel/hostname").unwrap_or_default();
    let mut hasher = blake3::Hasher::new();
    hasher.update(&host).update(&[0]).update(target.file_name().unwrap_or_default().as_encoded_bytes());
    let hash = hasher.finalize().to_hex();
    let folder = folder_of(target).to_owned();
    (0..MOST_NAMES).map(move |i| folder.join(format!(".steradian-{}-{i}", &hash[..16])))
}

/// Makes a file by the first name that is free.
fn with_free_name<T>(target: &Path, mut make: impl FnMut(&Path) -> io::Result<T>) -> io::Result<(T, PathBuf)> {
    for name in names(target) {
        remove_left_over(&name);
        match make(&name) {
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
            made => return made.map(|made| (made, name)),
        }
    }
    let message =
        format!("there are {MOST_NAMES} files .steradian-... on their way to it; remove those that are left over");
    Err(io::Error::new(io::ErrorKind::AlreadyExists, message))
}

/// Removes what killed writers of `target` left.
pub fn clean(target: &Path) {
    let is_there = |name: &PathBuf| fs::symlink_metadata(name).is_ok();
    names(target).take_while(is_there).for_each(|name| remove_left_over(&name));
}

/// Removes a file that no process holds locked, if it is a regular one.
fn remove_left_over(name: &Path) {
    if !fs::symlink_metadata(name).is_ok_and(|metadata| metadata.is_file()) {
        return;
    }
    let flags = (OFlags::NOFOLLOW | OFlags::NONBLOCK).bits() as i32;
    let Ok(file) = File::options().read(true).custom_flags(flags).open(name) else { return };
    // Without locks, this cannot be determined.
    if file.try_lock().is_ok() && is_at(&file, name) {
        let _ = fs::remove_file(name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    type Create = fn(&Path) -> io::Result<Aside>;

    fn count(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn files_with_and_without_names_come_to_their_place() {
        let folder = tempfile::tempdir().unwrap();
        for (i, create) in [Aside::unnamed as Create, Aside::named as Create].into_iter().enumerate() {
            let target = folder.path().join(format!("{i}"));
            for text in ["first", "second"] {
                let mut aside = create(&target).unwrap();
                aside.file().write_all(text.as_bytes()).unwrap();
                aside.commit().unwrap();
                assert_eq!(fs::read_to_string(&target).unwrap(), text);
            }
            drop(create(&target).unwrap());
        }
        assert_eq!(count(folder.path()), 2);
    }

    #[test]
    fn left_over_files_go_and_those_in_use_stay() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        let mut names_of_a = names(&a);
        let [first, second] = [names_of_a.next().unwrap(), names_of_a.next().unwrap()];
        // Left by killed processes: of this file, and of another one.
        fs::write(&first, "half").unwrap();
        let of_b = names(&b).next().unwrap();
        fs::write(&of_b, "half").unwrap();
        clean(&a);
        assert!(!first.exists() && of_b.exists());
        // Two at a time: each has a name, and neither takes that of the other.
        let (one, two) = (Aside::named(&a).unwrap(), Aside::named(&a).unwrap());
        assert_eq!((one.name.as_ref(), two.name.as_ref()), (Some(&first), Some(&second)));
        clean(&a);
        assert!(first.exists() && second.exists());
        two.commit().unwrap();
        one.commit().unwrap();
        // Files of other programs, and what links lead to, are left alone.
        std::os::unix::fs::symlink("a", &first).unwrap();
        let three = Aside::named(&a).unwrap();
        assert_eq!(three.name.as_ref(), Some(&second));
        three.commit().unwrap();
        assert!(fs::symlink_metadata(&first).unwrap().is_symlink() && a.exists());
    }
}
