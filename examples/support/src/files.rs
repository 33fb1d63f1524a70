//! Result files: written whole or not at all.

use std::fmt::Display;
use std::fs::{self, File, TryLockError};
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use grasp_agent::SavedRun;
use image::{ImageBuffer, ImageFormat, Pixel, PixelWithColorType, RgbImage};

use crate::program::Outcome;

/// Creates the folder if need be, and checks that files can be written into it.
///
/// # Errors
/// A folder that cannot be written to.
pub fn writable_folder(folder: &Path) -> Outcome {
    let probe = folder.join(".writable.part");
    fs::create_dir_all(folder)
        .and_then(|()| fs::write(&probe, b""))
        .and_then(|()| fs::remove_file(&probe))
        .map_err(|error| format!("{}: cannot be written to: {error}", folder.display()).into())
}

/// Makes a folder writable for this program alone, until the returned file is closed.
///
/// # Errors
/// A folder that cannot be written to, or that another run of a program is writing to.
pub fn lock_folder(folder: &Path) -> Outcome<File> {
    writable_folder(folder)?;
    let path = folder.join(".lock");
    let failed = |error| format!("{}: cannot be locked: {error}", path.display());
    let mut options = File::options();
    let open = options.read(true).write(true).create(true).truncate(false);
    let mut file = open.open(&path).map_err(failed)?;
    match file.try_lock() {
        Ok(()) => {
            file.set_len(0).map_err(failed)?;
            write!(file, "process {}", std::process::id()).map_err(failed)?;
            Ok(file)
        }
        Err(TryLockError::WouldBlock) => {
            let holder = fs::read_to_string(&path).unwrap_or_default();
            let folder = folder.display();
            let what = format!("{folder}: {holder} is writing its results here");
            Err(format!("{what}; choose another folder with --out").into())
        }
        Err(TryLockError::Error(error)) => Err(failed(error).into()),
    }
}

/// Writes a file beside its place and renames it into it. A device or a pipe is written to directly
/// and never replaced; a link stays a link.
///
/// # Errors
/// A file that cannot be written.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Outcome {
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

/// Writes a saved run for the example `replay`, and returns a note of where it is.
///
/// # Errors
/// Those of [`write_whole`].
pub fn keep_run(path: &Path, saved: &SavedRun) -> Outcome<String> {
    write_whole(path, saved.to_json().as_bytes())?;
    Ok(format!("for `replay`: {}", path.display()))
}

/// A table in a file, to which rows are written as they come.
#[derive(Debug)]
pub struct Table {
    file: File,
    path: PathBuf,
}

impl Table {
    /// Creates or replaces the file, and writes the names of its columns.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn create(path: PathBuf, columns: &str) -> Outcome<Self> {
        write_whole(&path, b"")?;
        let file = File::options().append(true).open(&path)?;
        let mut table = Self { file, path };
        table.row(columns)?;
        Ok(table)
    }

    /// Writes a row.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn row(&mut self, row: impl Display) -> Outcome {
        let written = self.file.write_all(format!("{row}\n").as_bytes());
        Ok(written
            .map_err(|error| format!("{}: cannot be written: {error}", self.path.display()))?)
    }
}

/// Encodes frames of one size as an animated PNG, each shown for `delay` seconds (a fraction), the
/// last one for `last`.
///
/// # Errors
/// No frames, or frames of several sizes.
pub fn animated(frames: &[RgbImage], delay: (u16, u16), last: (u16, u16)) -> Outcome<Vec<u8>> {
    let first = frames.first().ok_or("no frames")?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, first.width(), first.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.set_animated(u32::try_from(frames.len())?, 0)?;
    encoder.set_frame_delay(delay.0, delay.1)?;
    let mut writer = encoder.write_header()?;
    for (i, frame) in frames.iter().enumerate() {
        if i + 1 == frames.len() {
            writer.set_frame_delay(last.0, last.1)?;
        }
        writer.write_image_data(frame.as_raw())?;
    }
    writer.finish()?;
    Ok(bytes)
}

/// Writes a picture as PNG.
///
/// # Errors
/// Those of [`write_whole`].
pub fn write_png<P>(path: &Path, picture: &ImageBuffer<P, Vec<u8>>) -> Outcome
where
    P: Pixel<Subpixel = u8> + PixelWithColorType,
{
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png)?;
    write_whole(path, bytes.get_ref())
}
