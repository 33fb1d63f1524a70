//! Frames from a stream of bytes.

use std::io::{self, BufRead, ErrorKind, Read};

use image::GrayImage;

use super::{FrameError, FrameSource, refill};
use crate::error::{ConfigError, require};

/// The longest line of a Y4M header that is read, bytes.
const MAX_LINE: usize = 1024;
/// The most pixels of a frame: a limit for damaged headers.
const MAX_PIXELS: u64 = 1 << 28;

/// A [`FrameSource`] over a stream of 8-bit video, so also over a live camera through a pipe.
///
/// ```text
/// ffmpeg -i /dev/video0 -f yuv4mpegpipe -pix_fmt yuv420p - | your-program
/// ```
///
/// A stream that ends in the middle of a frame delivers the frames before it, then an error that
/// names the frame, then [`FrameError::End`]. After an error nothing more is read. A pipe buffers
/// frames: whoever moves a camera by them reads the stream in a thread of its own and keeps the
/// newest.
#[derive(Debug)]
pub struct FrameStream<R> {
    reader: R,
    width: u32,
    height: u32,
    /// Bytes of chroma that follow the luma of a Y4M frame; none in a raw stream.
    chroma: Option<u64>,
    delivered: u64,
    ended: bool,
}

impl<R: BufRead> FrameStream<R> {
    /// Reads the header of a YUV4MPEG2 (Y4M) stream, of whose frames the luma is taken.
    ///
    /// # Errors
    /// [`FrameError::Failed`] if there is no Y4M header, or one of a format that is not supported;
    /// the text quotes it.
    pub fn y4m(mut reader: R) -> Result<Self, FrameError> {
        let header = match read_line(&mut reader) {
            Ok(Some(line)) => line,
            Ok(None) => return Err(failed("the stream is empty".into())),
            Err(error) => return Err(failed(format!("no header: {error}"))),
        };
        let (width, height, chroma) = parse_header(&header).map_err(failed)?;
        Ok(Self::new(reader, width, height, Some(chroma)))
    }

    /// Takes frames of `width` x `height` bytes that follow one another without any header, such as
    /// `ffmpeg -f rawvideo -pix_fmt gray` writes.
    ///
    /// # Errors
    /// [`ConfigError::OutOfRange`] if a side is 0 or a frame has more than 2^28 pixels.
    pub fn raw(reader: R, width: u32, height: u32) -> Result<Self, ConfigError> {
        for (parameter, side) in [("width", width), ("height", height)] {
            let usable = side > 0 && u64::from(width) * u64::from(height) <= MAX_PIXELS;
            let expected = "at least 1, with at most 2^28 pixels in all";
            require(parameter, side.into(), expected, usable)?;
        }
        Ok(Self::new(reader, width, height, None))
    }

    fn new(reader: R, width: u32, height: u32, chroma: Option<u64>) -> Self {
        Self {
            reader,
            width,
            height,
            chroma,
            delivered: 0,
            ended: false,
        }
    }

    /// Returns width and height of the frames, pixels.
    pub fn dimensions(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Reads the luma of a frame; false at the end of the stream.
    fn read(&mut self, luma: &mut [u8]) -> io::Result<bool> {
        let Some(chroma) = self.chroma else {
            // An end before the first byte is the ordinary one.
            return match self.reader.read_exact(&mut luma[..1]) {
                Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
                first => first
                    .and_then(|()| self.reader.read_exact(&mut luma[1..]))
                    .map(|()| true),
            };
        };
        match read_line(&mut self.reader)? {
            None => return Ok(false),
            Some(line) if line.starts_with(b"FRAME") => {}
            Some(line) if line.starts_with(b"YUV4MPEG2") => {
                return Err(invalid(
                    "a new header begins here, perhaps of another frame size",
                ));
            }
            Some(_) => return Err(invalid("it does not begin with FRAME")),
        }
        self.reader.read_exact(luma)?;
        let skipped = io::copy(&mut Read::take(&mut self.reader, chroma), &mut io::sink())?;
        if skipped < chroma {
            return Err(ErrorKind::UnexpectedEof.into());
        }
        Ok(true)
    }
}

impl<R: BufRead> FrameSource for FrameStream<R> {
    fn grab(&mut self, frame: &mut GrayImage) -> Result<(), FrameError> {
        if self.ended {
            return Err(FrameError::End);
        }
        let read = refill(frame, self.dimensions(), |luma| self.read(luma));
        self.ended = !matches!(read, Ok(true));
        let number = self.delivered + 1;
        match read {
            Ok(true) => {
                self.delivered = number;
                Ok(())
            }
            Ok(false) => Err(FrameError::End),
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => Err(failed(format!(
                "the stream ends in the middle of frame {number}"
            ))),
            Err(error) => Err(failed(format!("frame {number} cannot be read: {error}"))),
        }
    }
}

fn failed(reason: String) -> FrameError {
    FrameError::Failed {
        origin: "frame stream".into(),
        reason,
    }
}

fn invalid(reason: &str) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, reason)
}

/// Width, height, and bytes of chroma per frame.
fn parse_header(line: &[u8]) -> Result<(u32, u32, u64), String> {
    let text = String::from_utf8_lossy(line);
    let mut fields = text.split_ascii_whitespace();
    if fields.next() != Some("YUV4MPEG2") {
        return Err("not a Y4M stream: it does not begin with YUV4MPEG2".into());
    }
    let (mut width, mut height, mut colour) = (None, None, "420");
    for field in fields {
        match field.split_at_checked(1) {
            Some(("W", value)) => width = value.parse::<u32>().ok(),
            Some(("H", value)) => height = value.parse::<u32>().ok(),
            Some(("C", value)) => colour = value,
            _ => {}
        }
    }
    let (Some(width @ 1..), Some(height @ 1..)) = (width, height) else {
        return Err(format!(
            "the Y4M header gives no usable width and height: {text:?}"
        ));
    };
    let pixels = u64::from(width) * u64::from(height);
    if pixels > MAX_PIXELS {
        return Err(format!(
            "frames of {width}x{height} px are more than the 2^28 pixels that are read"
        ));
    }
    let (half_width, half_height) = (u64::from(width.div_ceil(2)), u64::from(height.div_ceil(2)));
    let chroma = match colour {
        "mono" => 0,
        "420" | "420jpeg" | "420mpeg2" | "420paldv" => 2 * half_width * half_height,
        "411" => 2 * u64::from(width.div_ceil(4)) * u64::from(height),
        "422" => 2 * half_width * u64::from(height),
        "444" => 2 * pixels,
        "444alpha" => 3 * pixels,
        other => {
            return Err(format!(
                "Y4M colour space {other:?} is not read; convert to 8 bits, for example with \
                 -pix_fmt yuv420p"
            ));
        }
    };
    Ok((width, height, chroma))
}

/// Reads a line and drops its line end; `None` at the end of the stream.
fn read_line(reader: &mut impl BufRead) -> io::Result<Option<Vec<u8>>> {
    let mut line = Vec::new();
    let mut limited = Read::take(reader, MAX_LINE as u64 + 1);
    limited.read_until(b'\n', &mut line)?;
    match line.pop() {
        None => Ok(None),
        Some(b'\n') => Ok(Some(line)),
        Some(_) if line.len() == MAX_LINE => Err(invalid("its first line is too long")),
        Some(_) => Err(ErrorKind::UnexpectedEof.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `count` frames of 5x3 pixels whose luma is their number, in this colour space.
    fn y4m(colour: &str, chroma: usize, count: u8) -> Vec<u8> {
        let mut bytes = format!("YUV4MPEG2 W5 H3 F25:1 Ip{colour}\n").into_bytes();
        for number in 0..count {
            bytes.extend(b"FRAME\n");
            bytes.extend([number; 15]);
            bytes.extend(std::iter::repeat_n(99, chroma));
        }
        bytes
    }

    fn grays(source: &mut impl FrameSource) -> (Vec<u8>, String) {
        let (mut grays, mut frame) = (Vec::new(), GrayImage::new(50, 1));
        loop {
            match source.grab(&mut frame) {
                Ok(()) => {
                    assert_eq!(frame.dimensions(), (5, 3));
                    assert!(frame.iter().all(|&gray| gray == frame.as_raw()[0]));
                    grays.push(frame.as_raw()[0]);
                }
                Err(FrameError::End) => return (grays, String::new()),
                Err(error) => {
                    assert!(matches!(source.grab(&mut frame), Err(FrameError::End)));
                    return (grays, error.to_string());
                }
            }
        }
    }

    #[test]
    fn every_colour_space_gives_its_luma() {
        for (colour, chroma) in [
            ("", 12),
            (" C420jpeg", 12),
            (" C411", 12),
            (" C422", 18),
            (" C444", 30),
            (" C444alpha", 45),
            (" Cmono", 0),
        ] {
            let bytes = y4m(colour, chroma, 3);
            let mut frames = FrameStream::y4m(&bytes[..]).unwrap();
            assert_eq!(
                grays(&mut frames),
                (vec![0, 1, 2], String::new()),
                "{colour}"
            );
        }
    }

    #[test]
    fn a_cut_stream_delivers_the_whole_frames_and_names_the_next() {
        let bytes = y4m(" C420", 12, 3);
        let frame = (bytes.len() - y4m(" C420", 12, 0).len()) / 3;
        let header = bytes.len() - 3 * frame;
        for end in header..bytes.len() {
            let (grays, error) = grays(&mut FrameStream::y4m(&bytes[..end]).unwrap());
            let whole = (end - header) / frame;
            assert_eq!(grays.len(), whole, "{end}");
            let cut = !(end - header).is_multiple_of(frame);
            assert_eq!(
                error.contains(&format!("frame {}", whole + 1)),
                cut,
                "{end}: {error}"
            );
        }
        for end in 0..header {
            assert!(FrameStream::y4m(&bytes[..end]).is_err());
        }
    }

    #[test]
    fn headers_that_cannot_be_read_are_refused() {
        for header in [
            "",
            "RIFF",
            "YUV4MPEG2\n",
            "YUV4MPEG2 W5\n",
            "YUV4MPEG2 W0 H3\n",
            "YUV4MPEG2 W-5 H3\n",
            "YUV4MPEG2 W5 H3 C420p10\n",
            "YUV4MPEG2 W60000 H60000\n",
            "YUV4MPEG2 W99999999999 H3\n",
        ] {
            assert!(FrameStream::y4m(header.as_bytes()).is_err(), "{header:?}");
        }
        let endless = io::BufReader::new(io::repeat(b'Y'));
        assert!(FrameStream::y4m(endless).is_err());
    }

    #[test]
    fn raw_frames_follow_one_another() {
        let bytes: Vec<u8> = (0..4u8).flat_map(|number| [number; 15]).collect();
        assert_eq!(
            grays(&mut FrameStream::raw(&bytes[..], 5, 3).unwrap()),
            (vec![0, 1, 2, 3], String::new())
        );
        let (delivered, error) = grays(&mut FrameStream::raw(&bytes[..50], 5, 3).unwrap());
        assert_eq!(delivered, [0, 1, 2]);
        assert!(error.contains("frame 4"), "{error}");
        assert!(FrameStream::raw(&bytes[..], 0, 3).is_err());
        assert!(FrameStream::raw(&bytes[..], u32::MAX, u32::MAX).is_err());
    }
}
