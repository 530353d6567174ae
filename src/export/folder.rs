//! A folder of results: one run at a time writes into it, and its files change together.
//!
//! All files of a run are first written beside the old ones, in a folder of their own, and take their names when every one of them
//! is on the disk. A disk that is full, or a folder that cannot be written to, therefore leaves the results of an earlier
//! run as they were. The lock of the folder goes with its process, however that ends; what a killed one left behind is
//! removed by the next.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

use super::write;

/// Where files wait until all of them are written.
const STAGING: &str = ".results.partial";

/// A folder that this process writes into, and no other, until it is dropped.
pub struct Folder {
    path: PathBuf,
    /// True when it was not there before.
    made: bool,
    /// Held open for its lock; none on systems that do not lock folders.
    _lock: Option<File>,
}

impl Folder {
    /// Makes the folder if there is none, takes it, and removes what a killed run left half written.
    ///
    /// # Errors
    /// [`Error::File`] when it cannot be made or written to, or when another run writes into it.
    pub fn open(path: &Path) -> Result<Self> {
        let made = !path.exists();
        fs::create_dir_all(path).map_err(|reason| unwritable(path, &reason))?;
        let lock = lock(path)?;
        clear(path).map_err(|reason| unwritable(path, &reason))?;
        // better now than after an hour of work
        let trial = path.join(STAGING);
        fs::create_dir(&trial).and_then(|()| fs::remove_dir(&trial)).map_err(|reason| unwritable(path, &reason))?;
        Ok(Self { path: path.to_owned(), made, _lock: lock })
    }

    /// Lets `write` fill an empty folder and moves its files here, all or none of them; returns where they are.
    ///
    /// # Errors
    /// Those of `write`, with the names that the files would have had here; [`Error::File`] for a name that is taken by a
    /// folder. The files of earlier runs are then as they were.
    pub fn publish(&self, write: impl FnOnce(&Path) -> Result<Vec<PathBuf>>) -> Result<Vec<PathBuf>> {
        let staging = self.path.join(STAGING);
        let outcome = write(&staging).and_then(|files| self.move_in(&files));
        // Of no use to anyone, whether it is empty or not; the next run removes what is left.
        let _ = fs::remove_dir_all(&staging);
        outcome.map_err(|error| match error {
            Error::File { path, message, help } => Error::File { path: self.final_path(&path), message, help },
            other => other,
        })
    }

    /// Moves the files of the staging folder to their names.
    fn move_in(&self, files: &[PathBuf]) -> Result<Vec<PathBuf>> {
        let names: Vec<PathBuf> = files.iter().map(|file| self.final_path(file)).collect();
        for name in &names {
            let parent = name.parent().unwrap_or(&self.path);
            fs::create_dir_all(parent).map_err(|reason| unwritable(name, &reason))?;
            if name.is_dir() {
                return Err(unwritable(name, &io::Error::from(io::ErrorKind::IsADirectory)));
            }
        }
        for (file, name) in files.iter().zip(&names) {
            fs::rename(file, name).map_err(|reason| unwritable(name, &reason))?;
        }
        let mut folders: Vec<&Path> = names.iter().filter_map(|name| name.parent()).collect();
        folders.dedup();
        folders.into_iter().for_each(write::sync);
        Ok(names)
    }

    /// The name here of a file in the staging folder.
    fn final_path(&self, staged: &Path) -> PathBuf {
        staged.strip_prefix(self.path.join(STAGING)).map_or_else(|_| staged.to_owned(), |name| self.path.join(name))
    }
}

impl Drop for Folder {
    /// A run that wrote nothing leaves no folder behind; one with files in it stays.
    fn drop(&mut self) {
        if self.made {
            let _ = fs::remove_dir(&self.path);
        }
    }
}

/// The lock of a folder, where the system has one.
fn lock(path: &Path) -> Result<Option<File>> {
    let Ok(folder) = File::open(path) else { return Ok(None) };
    match folder.try_lock() {
        Ok(()) => Ok(Some(folder)),
        Err(TryLockError::Error(_)) => Ok(None),
        Err(TryLockError::WouldBlock) => Err(Error::File {
            path: path.to_owned(),
            message: "another run writes into this folder".into(),
            help: "wait for its end, or choose another folder".into(),
        }),
    }
}

/// Removes temporary files and the staging folder of a run that was killed.
fn clear(path: &Path) -> io::Result<()> {
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        if entry.file_name() == STAGING {
            fs::remove_dir_all(entry.path())?;
        } else if write::is_temporary(&entry.file_name()) {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

fn unwritable(path: &Path, reason: &io::Error) -> Error {
    Error::File {
        path: path.to_owned(),
        message: format!("cannot be written: {reason}"),
        help: "choose a folder that can be written to and has room".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("readable");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("readable").file_name().into_string().expect("UTF-8")).collect();
        names.sort();
        names
    }

    #[test]
    fn files_change_together_or_not_at_all() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = Folder::open(&place.path().join("new")).expect("writable");
        let put = |contents: &'static [u8]| {
            move |staging: &Path| -> Result<Vec<PathBuf>> {
                let files = [staging.join("a.json"), staging.join("deep/b.json")];
                files.iter().try_for_each(|file| write::whole(file, contents))?;
                Ok(files.into())
            }
        };
        let here = |name: &str| place.path().join("new").join(name);
        assert_eq!(folder.publish(put(b"one")).expect("room"), [here("a.json"), here("deep/b.json")]);
        folder.publish(put(b"two")).expect("room");
        assert_eq!(fs::read(here("deep/b.json")).expect("a file"), b"two");
        // the second file fails
        let error = folder.publish(|staging| {
            put(b"three")(staging)?;
            write::whole(&staging.join("a.json/c"), b"")?;
            Ok(vec![])
        });
        assert!(matches!(error, Err(Error::File { path, .. }) if path == here("a.json/c")));
        // a folder has the name of the second file
        fs::remove_file(here("deep/b.json")).expect("a file");
        fs::create_dir(here("deep/b.json")).expect("a free name");
        assert!(folder.publish(put(b"four")).is_err());
        assert_eq!(fs::read(here("a.json")).expect("a file"), b"two");
        assert_eq!(names(&here("")), ["a.json", "deep"]);
        drop(Folder::open(&place.path().join("unused")).expect("writable"));
        drop(folder);
        assert_eq!(names(place.path()), ["new"]);
    }

    #[test]
    fn one_run_at_a_time_and_the_rubbish_of_a_killed_one_goes() {
        let place = tempfile::tempdir().expect("a folder");
        let partial = place.path().join(".result.json.12.0.partial");
        fs::write(&partial, b"half").expect("writable");
        fs::create_dir(place.path().join(STAGING)).expect("writable");
        fs::write(place.path().join(STAGING).join("a"), b"half").expect("writable");
        fs::write(place.path().join("mine.partial"), b"whole").expect("writable");
        let first = Folder::open(place.path()).expect("free");
        assert_eq!(names(place.path()), ["mine.partial"]);
        let message = Folder::open(place.path()).err().expect("taken").to_string();
        assert!(message.contains("another run"), "{message}");
        drop(first);
        assert!(Folder::open(place.path()).is_ok());
    }
}
