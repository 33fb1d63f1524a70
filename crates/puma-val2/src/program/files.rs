//! Result files: written whole or not at all.

use std::error::Error;
use std::fs;
use std::path::Path;

/// Writes a file beside its place and renames it into it. A device or a pipe is written to in
/// place, and a link stays a link.
pub(super) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    let failed = |error| format!("{}: cannot be written: {error}", path.display());
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if fs::metadata(&target).is_ok_and(|there| !there.is_file()) {
        return Ok(fs::write(&target, bytes).map_err(failed)?);
    }
    let mut beside = target.as_os_str().to_owned();
    beside.push(".part");
    let written = fs::write(&beside, bytes).and_then(|()| fs::rename(&beside, &target));
    Ok(written.map_err(|error| {
        let _ = fs::remove_file(&beside);
        failed(error)
    })?)
}
