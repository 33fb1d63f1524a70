//! Frames from image files.

use std::path::{Path, PathBuf};

use image::metadata::Orientation;
use image::{DynamicImage, GrayImage, ImageDecoder, ImageReader};

use crate::frame::{FrameError, FrameSource};

/// The endings that a folder is searched for, in lower case.
const ENDINGS: &[&str] = if cfg!(feature = "tiff") {
    &["png", "jpg", "jpeg", "pgm", "bmp", "tif", "tiff"]
} else {
    &["png", "jpg", "jpeg", "pgm", "bmp"]
};

/// The part of a coloured picture that becomes the gray frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "program", derive(clap::ValueEnum))]
#[non_exhaustive]
pub enum Channel {
    /// Brightness, unless one of the three components shows edges at least 1.5 times as strong (in
    /// gray levels squared, see [`Strongest`](Self::Strongest)): red on green of like brightness.
    /// Chosen for each picture.
    #[default]
    Auto,
    /// Brightness as the eye sees it.
    Luma,
    /// The red component.
    Red,
    /// The green component.
    Green,
    /// The blue component.
    Blue,
    /// The one of the three components with the strongest edges: that which changes most over 4
    /// pixels, in the root of the mean fourth power. So texture hides no few strong edges.
    Strongest,
}

impl Channel {
    /// Turns a picture in memory into a frame, as [`ImageFiles`] does, and returns the bits that
    /// its values used if they are of 16 bits and used fewer.
    pub fn frame(self, mut picture: DynamicImage) -> (GrayImage, Option<u32>) {
        let depth = stretch(&mut picture);
        (self.gray(picture), depth)
    }

    /// Takes this part of a picture of 8 bits, or of one that uses all of 16.
    pub(crate) fn gray(self, picture: DynamicImage) -> GrayImage {
        if !picture.color().has_color() || self == Self::Luma {
            return picture.into_luma8();
        }
        let luma = (self == Self::Auto).then(|| picture.to_luma8());
        let picture = picture.into_rgb8();
        let component = |component: usize| {
            let values = picture.iter().skip(component).step_by(3).copied();
            GrayImage::from_vec(picture.width(), picture.height(), values.collect())
                .unwrap_or_default()
        };
        let strongest = || [2, 1, 0].map(component).into_iter().max_by_key(edges);
        match (self, luma) {
            (Self::Red, _) => component(0),
            (Self::Green, _) => component(1),
            (Self::Blue, _) => component(2),
            (_, None) => strongest().unwrap_or_default(),
            (_, Some(luma)) => {
                let clear = |plane: &GrayImage| edges(plane) > edges(&luma) / 4 * 9;
                strongest().filter(clear).unwrap_or(luma)
            }
        }
    }
}

/// A [`FrameSource`] over image files: PNG, JPEG, PGM and BMP, with the feature `tiff` also TIFF.
///
/// A picture is turned as its EXIF orientation says, so that coordinates are those that a viewer
/// shows. Coloured pictures give their [`Channel`]; transparency is ignored. Values of 16 bits are
/// scaled to 8 by the bits that the largest value of the picture needs, at least 8: with `b` bits,
/// 2^b - 1 becomes 255. Data of 10 or 12 bits thus use the whole range, and
/// [`last_depth`](Self::last_depth) tells that they did.
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
    channel: Channel,
    depth: Option<u32>,
}

impl ImageFiles {
    /// Takes these files, in this order. They are opened when their turn comes.
    pub fn new(paths: impl IntoIterator<Item = PathBuf>) -> Self {
        Self {
            paths: paths.into_iter().collect(),
            next: 0,
            channel: Channel::default(),
            depth: None,
        }
    }

    /// Takes one file, or the image files of a folder in the order of their names.
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

    /// Sets the channel of coloured pictures (default [`Channel::Auto`]).
    #[must_use]
    pub fn with_channel(mut self, channel: Channel) -> Self {
        self.channel = channel;
        self
    }

    /// Returns the file that the last call of [`grab`](FrameSource::grab) read, or failed to read;
    /// none before the first call.
    pub fn last_path(&self) -> Option<&Path> {
        let last = self.next.checked_sub(1)?;
        self.paths.get(last).map(PathBuf::as_path)
    }

    /// Returns the bits that the values of the last file used, if it has values of 16 bits and used
    /// fewer of them: its gray levels were scaled up.
    pub fn last_depth(&self) -> Option<u32> {
        self.depth
    }

    /// The next picture, upright, of 8 bits or scaled to all of 16.
    pub(crate) fn next_picture(&mut self) -> Result<DynamicImage, FrameError> {
        let path = self.paths.get(self.next).ok_or(FrameError::End)?;
        self.next += 1;
        self.depth = None;
        let mut picture = read(path).map_err(|error| FrameError::Failed {
            origin: path.display().to_string(),
            reason: error.to_string(),
        })?;
        self.depth = stretch(&mut picture);
        Ok(picture)
    }
}

impl FrameSource for ImageFiles {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        let picture = self.next_picture()?;
        *frame = self.channel.gray(picture);
        Ok(())
    }
}

/// Reads a picture, turned as its orientation says, without transparency where it has 16 bits.
fn read(path: &Path) -> image::ImageResult<DynamicImage> {
    let reader = ImageReader::open(path)?.with_guessed_format()?;
    let mut decoder = reader.into_decoder()?;
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let mut picture = DynamicImage::from_decoder(decoder)?;
    picture.apply_orientation(orientation);
    Ok(match picture {
        DynamicImage::ImageLumaA16(_) => picture.into_luma16().into(),
        DynamicImage::ImageRgba16(_) => picture.into_rgb16().into(),
        _ => picture,
    })
}

/// Scales values of 16 bits by the bits that the largest needs; returns these if they are fewer
/// than 16.
fn stretch(picture: &mut DynamicImage) -> Option<u32> {
    let values: &mut [u16] = match picture {
        DynamicImage::ImageLuma16(gray) => gray,
        DynamicImage::ImageRgb16(rgb) => rgb,
        _ => return None,
    };
    let largest = values.iter().copied().max()?;
    let bits = (u16::BITS - largest.leading_zeros()).max(8);
    let white = (1u32 << bits) - 1;
    for value in values {
        *value = ((u32::from(*value) * 0xffff + white / 2) / white) as u16;
    }
    (bits < u16::BITS).then_some(bits)
}

/// The sum of the fourth powers of the differences between pixels 4 px apart.
fn edges(plane: &GrayImage) -> u64 {
    let sum = |ends: &mut dyn Iterator<Item = (&u8, &u8)>| -> u64 {
        ends.map(|(a, b)| u64::from(a.abs_diff(*b)).pow(4)).sum()
    };
    let (width, levels) = (plane.width() as usize, plane.as_raw());
    let rows = levels.chunks_exact(width.max(1));
    let along = rows.map(|row| sum(&mut row.iter().zip(row.iter().skip(4))));
    along.sum::<u64>() + sum(&mut levels.iter().zip(levels.iter().skip(4 * width)))
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
    use image::{ImageBuffer, Luma};

    #[test]
    fn a_folder_is_read_in_order_and_past_a_broken_file() {
        let folder = tempfile::tempdir().unwrap();
        for (name, gray) in [("b.png", 20), ("a.PGM", 10), ("d.jpg", 40), ("e.bmp", 50)] {
            let frame = GrayImage::from_pixel(4, 3, Luma([gray]));
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
        assert_eq!(grays, [10, 20, 0, 40, 50]);
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

    /// The gray levels of a picture that is written to a file and read again.
    fn levels(picture: &DynamicImage, channel: Channel) -> (Vec<u8>, Option<u32>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        picture.save(&path).unwrap();
        let mut files = ImageFiles::open(path).unwrap().with_channel(channel);
        let mut frame = GrayImage::default();
        files.grab(&mut frame).unwrap();
        (frame.into_raw(), files.last_depth())
    }

    #[test]
    fn values_of_sixteen_bits_fill_the_range() {
        for (largest, depth) in [
            (1023u16, Some(10)),
            (4095, Some(12)),
            (65535, None),
            (200, Some(8)),
        ] {
            let gray =
                ImageBuffer::from_fn(3, 1, |x, _| Luma([[0, largest / 2, largest][x as usize]]));
            let (levels, told) = levels(&gray.into(), Channel::Luma);
            let white = if largest == 200 { 200 } else { 255 };
            assert_eq!(levels, [0, white / 2, white], "{largest}");
            assert_eq!(told, depth, "{largest}");
        }
    }

    #[test]
    fn a_channel_is_chosen_by_name_or_by_its_changes() {
        // Red before green of the same luma, in a little blue noise.
        let picture = image::RgbImage::from_fn(40, 30, |x, y| {
            let noise = (x * 7 + y * 13) % 5;
            image::Rgb([
                if x > 15 { 200 } else { 20 },
                if x > 15 { 30 } else { 84 },
                noise as u8,
            ])
        });
        let picture = DynamicImage::ImageRgb8(picture);
        let first = |channel| levels(&picture, channel).0[0];
        assert_eq!(
            [
                first(Channel::Red),
                first(Channel::Green),
                first(Channel::Blue)
            ],
            [20, 84, 0]
        );
        let red = levels(&picture, Channel::Red);
        assert_eq!(levels(&picture, Channel::Strongest), red);
        assert_eq!(levels(&picture, Channel::Auto), red);
        // Texture of all three changes more in the mean square, but has no strong edges.
        let textured = |edge: u8| {
            let level = |x: u32, y: u32| (x * x * 7 + y * y * 13 + x * y) % 60;
            let picture = image::RgbImage::from_fn(80, 60, |x, y| {
                let (red, green) = if x > 40 { (edge, 60) } else { (60, 100) };
                let noise = level(x, y) as u8;
                image::Rgb([red + noise, green + noise, 90 + noise])
            });
            DynamicImage::ImageRgb8(picture)
        };
        for (edge, chosen) in [(195, Channel::Red), (80, Channel::Luma)] {
            let picture = textured(edge);
            assert_eq!(
                levels(&picture, Channel::Auto),
                levels(&picture, chosen),
                "{edge}"
            );
        }
    }

    #[test]
    fn pictures_are_turned_as_viewers_do() {
        // An EXIF block that says "turn by a quarter to the right".
        let exif = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        let mut jpeg = std::io::Cursor::new(Vec::new());
        let frame = GrayImage::from_fn(32, 16, |x, _| Luma([if x < 16 { 250 } else { 5 }]));
        frame.write_to(&mut jpeg, image::ImageFormat::Jpeg).unwrap();
        let jpeg = jpeg.into_inner();
        let length = (exif.len() as u16 + 2).to_be_bytes();
        let turned = [&jpeg[..2], b"\xff\xe1", &length, exif, &jpeg[2..]].concat();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("turned.jpg");
        std::fs::write(&path, turned).unwrap();
        let mut read = GrayImage::default();
        ImageFiles::open(path).unwrap().grab(&mut read).unwrap();
        assert_eq!(read.dimensions(), (16, 32));
        assert!(read.get_pixel(8, 4).0[0] > 200 && read.get_pixel(8, 28).0[0] < 50);
    }
}
