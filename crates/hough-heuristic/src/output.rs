//! Files that appear complete or not at all.

use std::fs;
use std::io::{self, Cursor};
use std::path::Path;

use image::RgbImage;

/// Writes a picture as PNG; the text of an error names the file.
pub(crate) fn write_png(path: &Path, picture: &RgbImage) -> io::Result<()> {
    let mut png = Cursor::new(Vec::new());
    picture
        .write_to(&mut png, image::ImageFormat::Png)
        .map_err(io::Error::other)?;
    write_whole(path, png.get_ref())
}

/// Writes a file beside its place and renames it; the text of an error names the file.
///
/// A device, a pipe or another file that is not regular is written to and never replaced; a link
/// stays a link.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let written = if fs::metadata(&target).is_ok_and(|there| !there.is_file()) {
        fs::write(&target, bytes)
    } else {
        let mut beside = target.as_os_str().to_owned();
        beside.push(".part");
        fs::write(&beside, bytes)
            .and_then(|()| fs::rename(&beside, &target))
            .inspect_err(|_| {
                // Best effort: the error that matters is the one returned.
                let _ = fs::remove_file(&beside);
            })
    };
    written.map_err(|error| {
        let text = format!("{}: cannot be written: {error}", path.display());
        io::Error::new(error.kind(), text)
    })
}
