//! Frames written as video: YUV4MPEG2, which every player and encoder reads.

use std::io::{self, Write};

use image::GrayImage;

/// Writes monochrome frames as a YUV4MPEG2 (Y4M) stream of eight bits of luma (`Cmono`), which
/// [`FrameStream`](crate::FrameStream) reads.
///
/// ```
/// use hough_heuristic::image::GrayImage;
///
/// fn main() -> std::io::Result<()> {
///     let mut video = hough_heuristic::Y4mWriter::new(Vec::new(), 25, 1)?;
///     video.write(&GrayImage::new(4, 2))?;
///     let bytes = video.finish()?;
///     assert!(bytes.starts_with(b"YUV4MPEG2 W4 H2 F25:1 Ip A1:1 Cmono\nFRAME\n"));
///     Ok(())
/// }
/// ```
#[derive(Debug)]
pub struct Y4mWriter<W: Write> {
    out: W,
    rate: (u32, u32),
    interlaced: bool,
    size: Option<(u32, u32)>,
}

impl<W: Write> Y4mWriter<W> {
    /// Creates a stream of `frames` frames every `seconds` seconds: (25, 1) is PAL.
    ///
    /// # Errors
    /// [`io::ErrorKind::InvalidInput`] for a rate with a zero in it.
    pub fn new(out: W, frames: u32, seconds: u32) -> io::Result<Self> {
        if frames == 0 || seconds == 0 {
            let what = format!(
                "a frame rate of {frames} per {seconds} s is not usable; both must be above zero"
            );
            return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
        }
        Ok(Self {
            out,
            rate: (frames, seconds),
            interlaced: false,
            size: None,
        })
    }

    /// Declares in the header that every frame consists of two fields, the even rows (top field)
    /// first. Without it the stream is progressive.
    #[must_use]
    pub fn interlaced(mut self) -> Self {
        self.interlaced = true;
        self
    }

    /// Appends a frame. The first one decides the size.
    ///
    /// # Errors
    /// [`io::ErrorKind::InvalidInput`] for a frame of another size, or an empty one; errors of
    /// the output.
    pub fn write(&mut self, frame: &GrayImage) -> io::Result<()> {
        let size = frame.dimensions();
        match self.size {
            None if size.0 > 0 && size.1 > 0 => {
                let (frames, seconds) = self.rate;
                let fields = if self.interlaced { 't' } else { 'p' };
                writeln!(
                    self.out,
                    "YUV4MPEG2 W{} H{} F{frames}:{seconds} I{fields} A1:1 Cmono",
                    size.0, size.1
                )?;
                self.size = Some(size);
            }
            Some(first) if first == size => {}
            first => {
                let what = format!(
                    "a frame of {}x{} pixels in a stream of {first:?}",
                    size.0, size.1
                );
                return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
            }
        }
        self.out.write_all(b"FRAME\n")?;
        self.out.write_all(frame.as_raw())
    }

    /// Flushes and returns the output.
    ///
    /// # Errors
    /// Those of the output.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interlacing_is_declared_and_other_sizes_are_refused() {
        let mut video = Y4mWriter::new(Vec::new(), 25, 1)
            .expect("a rate")
            .interlaced();
        video.write(&GrayImage::new(4, 2)).expect("memory");
        assert!(video.write(&GrayImage::new(5, 2)).is_err());
        let bytes = video.finish().expect("memory");
        assert!(bytes.starts_with(b"YUV4MPEG2 W4 H2 F25:1 It A1:1 Cmono\n"));
        assert!(Y4mWriter::new(Vec::new(), 0, 1).is_err());
    }
}
