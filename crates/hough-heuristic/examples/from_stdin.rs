//! Reads Y4M video from standard input and prints the circles of each frame as one line of JSON.
//!
//! ```text
//! ffmpeg -i balls.mp4 -f yuv4mpegpipe -pix_fmt yuv420p - |
//!     cargo run --release -p hough-heuristic --features serde --example from_stdin 15 300
//! ```
//!
//! The two numbers are the smallest and the largest radius, pixels.

use std::error::Error;
use std::io::{BufReader, Write, stdin, stdout};

use hough_heuristic::image::GrayImage;
use hough_heuristic::{
    AContrario, AContrarioConfig, CircleDetector, FrameError, FrameSource, FrameStream,
};

fn main() -> Result<(), Box<dyn Error>> {
    let mut config = AContrarioConfig::default();
    let mut words = std::env::args().skip(1);
    if let Some(word) = words.next() {
        config.min_radius = Some(word.parse()?);
    }
    config.max_radius = words.next().map(|word| word.parse()).transpose()?;
    let mut detector = AContrario::new(config)?;
    let mut frames = FrameStream::y4m(BufReader::new(stdin().lock()))?;
    let mut frame = GrayImage::default();
    for number in 1u64.. {
        match frames.grab(&mut frame) {
            Ok(()) => {}
            Err(FrameError::End) => break,
            Err(error) => return Err(error.into()),
        }
        let circles = detector.detect(&frame)?;
        let line = serde_json::json!({ "frame": number, "circles": circles });
        // A reader that has seen enough closes the pipe.
        if writeln!(stdout(), "{line}").is_err() {
            break;
        }
    }
    Ok(())
}
