//! A file is written whole or not at all.
//!
//! The contents go to a temporary file in the same folder, reach the disk, and take the name in one step. Whoever looks
//! sees the old file or the new one, never a part: not when the disk is full, not when the machine stops.

use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use crate::error::{Error, Result};

/// Writes `contents` to `path`, replacing what is there, and makes the folder if there is none.
///
/// # Errors
/// [`Error::File`] with the reason; then `path` is as it was.
pub fn whole(path: &Path, contents: &[u8]) -> Result<()> {
    let temporary = temporary_beside(path);
    let outcome = replace(path, &temporary, contents);
    outcome.map_err(|reason| {
        // The temporary file is of no use to anyone; if it cannot be removed either, the first reason still counts.
        let _ = fs::remove_file(&temporary);
        Error::File {
            path: path.to_owned(),
            message: format!("cannot be written: {reason}"),
            help: "choose a folder that can be written to and has room".into(),
        }
    })
}

fn replace(path: &Path, temporary: &Path, contents: &[u8]) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let mut file = OpenOptions::new().write(true).create_new(true).open(temporary)?;
    file.write_all(contents)?;
    file.sync_all()?;
    fs::rename(temporary, path)?;
    sync(folder);
    Ok(())
}

/// Waits until the names in a folder are on the disk; systems that cannot open a folder do that by themselves.
pub(super) fn sync(folder: &Path) {
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

/// True for the name of a temporary file of this program.
pub(super) fn is_temporary(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    let Some(inside) = name.strip_prefix('.').and_then(|name| name.strip_suffix(".partial")) else { return false };
    let mut numbers = inside.rsplit('.');
    (0..2).all(|_| numbers.next().is_some_and(|number| number.parse::<u32>().is_ok())) && numbers.next().is_some()
}

/// A name that no other process and no other thread uses.
fn temporary_beside(path: &Path) -> PathBuf {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let (process, count) = (std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    path.with_file_name(format!(".{name}.{process}.{count}.partial"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_a_failure_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("new/results.json");
        whole(&path, b"one").expect("writable");
        whole(&path, b"two").expect("writable");
        assert_eq!(fs::read(&path).expect("readable"), b"two");
        let names = |folder: &Path| fs::read_dir(folder).expect("readable").count();
        assert_eq!(names(path.parent().expect("a folder")), 1);
        // A folder stands where the file should be.
        let error = whole(&folder.path().join("new"), b"three").expect_err("a folder is in the way");
        assert_eq!(error.exit_status(), 2);
        assert_eq!(names(folder.path()), 1);
        // A file stands where the folder should be.
        assert!(whole(&path.join("below.json"), b"four").is_err());
        assert_eq!(fs::read(&path).expect("readable"), b"two");
    }
}
