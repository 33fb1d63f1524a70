//! The floppy disk of an emulated controller as a folder.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::emulator::controller::Emulator;
use crate::program::files::write_whole;

/// A floppy disk kept as a folder of text files, each named as in VAL with `.v2` behind it.
#[derive(Debug)]
pub(super) struct Floppy {
    folder: PathBuf,
    /// File of each name on the disk. VAL knows upper case only, a file system may not.
    paths: BTreeMap<String, PathBuf>,
    /// Contents of the folder.
    kept: BTreeMap<String, String>,
}

impl Floppy {
    /// Puts the text files of a folder on the disk of `emulator`. A folder that is missing is made.
    pub(super) fn insert(folder: &Path, emulator: &mut Emulator) -> Result<Self, Box<dyn Error>> {
        let at = |path: &Path, problem: io::Error| format!("{}: {problem}", path.display());
        fs::create_dir_all(folder).map_err(|e| at(folder, e))?;
        let mut paths: BTreeMap<String, PathBuf> = BTreeMap::new();
        for entry in fs::read_dir(folder).map_err(|e| at(folder, e))? {
            let path = entry.map_err(|e| at(folder, e))?.path();
            let Some(name) = path
                .file_name()
                .and_then(|name| name.to_str())
                .and_then(|name| name.strip_suffix(".v2"))
            else {
                continue;
            };
            let name = name.to_ascii_uppercase();
            let text = fs::read_to_string(&path).map_err(|e| at(&path, e))?;
            emulator.insert_file(&name, text);
            if let Some(other) = paths.insert(name.clone(), path.clone()) {
                let (one, two) = (other.display(), path.display());
                return Err(format!(
                    "{one} and {two} are both the file {name}: rename one of them"
                )
                .into());
            }
        }
        Ok(Self {
            folder: folder.to_owned(),
            paths,
            kept: emulator.floppy().clone(),
        })
    }

    /// Returns the contents of the disk if they differ from the folder's.
    pub(super) fn changed(&self, emulator: &Emulator) -> Option<BTreeMap<String, String>> {
        let now = emulator.floppy();
        (*now != self.kept).then(|| now.clone())
    }

    /// Writes the files that were stored and removes those that were deleted.
    pub(super) fn follow(&mut self, now: BTreeMap<String, String>) -> Result<(), Box<dyn Error>> {
        for (name, text) in &now {
            if self.kept.get(name) == Some(text) {
                continue;
            }
            let path = self
                .paths
                .entry(name.clone())
                .or_insert_with(|| self.folder.join(format!("{name}.v2")));
            write_whole(path, text.as_bytes())?;
        }
        for name in self.kept.keys().filter(|name| !now.contains_key(*name)) {
            if let Some(path) = self.paths.remove(name) {
                fs::remove_file(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            }
        }
        self.kept = now;
        Ok(())
    }
}
