//! Result files: written whole or not at all.

use std::error::Error;
use std::fs;
use std::path::Path;

use image::RgbImage;

/// Makes the folder if need be, and makes sure that files can be written into it.
pub(crate) fn writable_folder(folder: &Path) -> Result<(), Box<dyn Error>> {
    let probe = folder.join(".writable.part");
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(&probe, b""))
        .and_then(|()| fs::remove_file(&probe))
        .map_err(|error| format!("{}: cannot be written to: {error}", folder.display()).into())
}

/// Writes a file: first beside its place, then renamed into it. What is there and is no regular
/// file (a device, a pipe) is written to as it is, never replaced; a link stays a link.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
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

/// Writes a picture as PNG.
pub(crate) fn write_png(path: &Path, picture: &RgbImage) -> Result<(), Box<dyn Error>> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png)?;
    write_whole(path, bytes.get_ref())
}
