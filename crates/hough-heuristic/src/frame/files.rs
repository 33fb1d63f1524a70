//! Frames from image files.

use std::path::{Path, PathBuf};

use image::{GrayImage, ImageReader};

use crate::frame::{FrameError, FrameSource};

/// The endings that a folder is searched for, in lower case.
const ENDINGS: [&str; 4] = ["png", "jpg", "jpeg", "pgm"];

/// A [`FrameSource`] over image files: PNG, JPEG and PGM, colour turned to luma.
///
/// A file that cannot be read gives an error that names it, and the next
/// [`grab`](FrameSource::grab) goes on with the next file.
///
/// ```no_run
/// use hough_heuristic::image::GrayImage;
/// use hough_heuristic::{FrameError, FrameSource, ImageFiles};
///
/// let (mut files, mut frame) = (ImageFiles::open("frames/")?, GrayImage::default());
/// loop {
///     match files.grab(&mut frame) {
///         Ok(()) => println!("{:?}: {}x{}", files.last_path(), frame.width(), frame.height()),
///         Err(FrameError::End) => break,
///         Err(error) => eprintln!("skipped: {error}"),
///     }
/// }
/// # Ok::<(), FrameError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ImageFiles {
    paths: Vec<PathBuf>,
    next: usize,
}

impl ImageFiles {
    /// These files, in this order. They are opened when their turn comes.
    pub fn new(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        Self {
            paths: paths.into_iter().collect(),
            next: 0,
        }
    }

    /// One file, or the image files of a folder in the order of their names.
    ///
    /// A folder is not searched for folders inside it; a file is taken whatever its name.
    ///
    /// # Errors
    /// [`FrameError::Failed`] if `path` does not exist, or the folder cannot be listed or holds no
    /// image file.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, FrameError> {
        let path = path.as_ref();
        let failed = |reason: String| FrameError::Failed {
            origin: path.display().to_string(),
            reason,
        };
        let metadata = std::fs::metadata(path).map_err(|error| failed(error.to_string()))?;
        if !metadata.is_dir() {
            return Ok(Self::new([path.to_path_buf()]));
        }
        let mut paths = Vec::new();
        for entry in std::fs::read_dir(path).map_err(|error| failed(error.to_string()))? {
            let file = entry.map_err(|error| failed(error.to_string()))?.path();
            if !file.is_dir() && is_image(&file) {
                paths.push(file);
            }
        }
        if paths.is_empty() {
            return Err(failed(format!(
                "the folder holds no image file (one that ends in {})",
                ENDINGS.join(", ")
            )));
        }
        paths.sort();
        Ok(Self::new(paths))
    }

    /// The file that the last call of [`grab`](FrameSource::grab) read, or failed to read; none
    /// before the first call.
    pub fn last_path(&self) -> Option<&Path> {
        let last = self.next.checked_sub(1)?;
        self.paths.get(last).map(PathBuf::as_path)
    }
}

impl FrameSource for ImageFiles {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        let path = self.paths.get(self.next).ok_or(FrameError::End)?;
        self.next += 1;
        *frame = read(path).map_err(|error| FrameError::Failed {
            origin: path.display().to_string(),
            reason: error.to_string(),
        })?;
        Ok(())
    }
}

fn read(path: &Path) -> image::ImageResult<GrayImage> {
    Ok(ImageReader::open(path)?
        .with_guessed_format()?
        .decode()?
        .to_luma8())
}

fn is_image(path: &Path) -> bool {
    path.extension().is_some_and(|ending| {
        let ending = ending.to_string_lossy().to_ascii_lowercase();
        ENDINGS.contains(&ending.as_str())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_read_in_order_and_past_a_broken_file() {
        let folder = tempfile::tempdir().unwrap();
        for (name, gray) in [("b.png", 20), ("a.PGM", 10), ("d.jpg", 40)] {
            let frame = GrayImage::from_pixel(4, 3, image::Luma([gray]));
            frame.save(folder.path().join(name)).unwrap();
        }
        std::fs::write(folder.path().join("c.png"), b"not an image").unwrap();
        std::fs::write(folder.path().join("notes.txt"), b"left alone").unwrap();

        let mut files = ImageFiles::open(folder.path()).unwrap();
        assert_eq!(files.last_path(), None);
        let (mut grays, mut frame) = (Vec::new(), GrayImage::default());
        loop {
            match files.grab(&mut frame) {
                Ok(()) => grays.push(frame.get_pixel(0, 0).0[0]),
                Err(FrameError::End) => break,
                Err(error) => {
                    assert!(error.to_string().contains("c.png"), "{error}");
                    assert!(files.last_path().unwrap().ends_with("c.png"));
                    grays.push(0);
                }
            }
        }
        assert_eq!(grays, [10, 20, 0, 40]);
        assert!(matches!(files.grab(&mut frame), Err(FrameError::End)));
    }

    #[test]
    fn what_cannot_be_opened_is_named() {
        let error = ImageFiles::open("/nowhere/at/all").unwrap_err();
        assert!(error.to_string().contains("/nowhere/at/all"), "{error}");
        let folder = tempfile::tempdir().unwrap();
        assert!(
            ImageFiles::open(folder.path())
                .unwrap_err()
                .to_string()
                .contains("png")
        );
    }
}
