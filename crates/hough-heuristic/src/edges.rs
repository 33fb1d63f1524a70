//! The first stage: from a frame to its edge pixels, the paper's structure `D`.

mod canny;
mod dispatch;
mod gradient;
#[cfg(feature = "imageproc")]
mod imageproc_canny;
mod maxima;
mod noise;
mod rows;
mod smoothing;
#[cfg(test)]
mod tests;

use image::GrayImage;

pub use canny::{Canny, CannyConfig};
pub use dispatch::Vectorized;
pub(crate) use dispatch::widest;
pub(crate) use gradient::{EdgeGradient, Geometry};
#[cfg(feature = "imageproc")]
pub use imageproc_canny::ImageprocCanny;
pub(crate) use maxima::Maxima;
pub(crate) use noise::{ROW_STEP, noise_deviation};
pub(crate) use rows::Candidate;

/// The coordinates of one edge pixel: a record of the paper's structure `D`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct EdgePixel {
    /// Column, 0 at the left.
    pub x: u32,
    /// Row, 0 at the top.
    pub y: u32,
}

/// The edges of one frame: as an image, and as the list of coordinates that the paper calls `D`.
///
/// The two always agree: the list holds every edge pixel once, row by row.
#[derive(Clone, Debug, Default)]
pub struct EdgeMap {
    image: GrayImage,
    pixels: Vec<EdgePixel>,
    /// One for each pixel, or none at all.
    gradients: Vec<EdgeGradient>,
}

impl EdgeMap {
    /// Returns the map of an edge image: every pixel that is not 0 is an edge.
    pub fn from_image(edges: &GrayImage) -> Self {
        let mut map = Self::default();
        map.copy_from(edges);
        map
    }

    /// Replaces the map by that of an edge image in which every pixel that is not 0 is an edge.
    ///
    /// Reuses the memory of the map; a user-defined [`EdgeDetector`] ends with this call.
    pub fn copy_from(&mut self, edges: &GrayImage) {
        self.clear(edges.width(), edges.height());
        for (x, y, pixel) in edges.enumerate_pixels() {
            if pixel.0[0] != 0 {
                self.light(EdgePixel { x, y });
            }
        }
    }

    /// Returns the edge image: 255 on an edge, 0 elsewhere, of the size of the frame.
    pub fn image(&self) -> &GrayImage {
        &self.image
    }

    /// Returns the structure `D`: all edge pixels, row by row.
    pub fn pixels(&self) -> &[EdgePixel] {
        &self.pixels
    }

    /// Returns the gradient at the pixel of this index in [`pixels`](EdgeMap::pixels), from dark to
    /// bright, in the units of [`CannyConfig::low`]; `None` if the detector knows no gradients.
    pub fn gradient(&self, index: usize) -> Option<(f64, f64)> {
        self.gradients.get(index).map(EdgeGradient::vector)
    }

    /// Returns the position of the edge at the pixel of this index in [`pixels`](EdgeMap::pixels):
    /// to a fraction of a pixel if the detector knows gradients, else the centre of the pixel.
    ///
    /// # Panics
    /// If there are not so many pixels.
    pub fn position(&self, index: usize) -> (f64, f64) {
        let pixel = self.pixels[index];
        let (dx, dy) = self
            .gradients
            .get(index)
            .map_or((0.0, 0.0), EdgeGradient::offset);
        (f64::from(pixel.x) + dx, f64::from(pixel.y) + dy)
    }

    /// Returns the columns of the frame.
    pub fn width(&self) -> u32 {
        self.image.width()
    }

    /// Returns the rows of the frame.
    pub fn height(&self) -> u32 {
        self.image.height()
    }

    /// Makes this the map of a frame without edges, keeping the memory.
    pub(crate) fn clear(&mut self, width: u32, height: u32) {
        self.repaint(width, height, |bytes, _, _| bytes.fill(0));
    }

    /// Makes this the map of a frame of this size with only these edges, of a part of it whose
    /// corner is (left, top).
    pub(crate) fn place(&mut self, part: &Self, (left, top): (u32, u32), size: (u32, u32)) {
        let (width, height) = size;
        self.repaint(width, height, |bytes, pixels, gradients| {
            bytes.fill(0);
            for &EdgePixel { x, y } in &part.pixels {
                let (x, y) = (x + left, y + top);
                bytes[y as usize * width as usize + x as usize] = 255;
                pixels.push(EdgePixel { x, y });
            }
            gradients.extend_from_slice(&part.gradients);
        });
    }

    /// Gives the map the size of a frame and lets `paint` set the image, whose old content is of no
    /// meaning, and the lists, which come empty.
    pub(crate) fn repaint(
        &mut self,
        width: u32,
        height: u32,
        paint: impl FnOnce(&mut [u8], &mut Vec<EdgePixel>, &mut Vec<EdgeGradient>),
    ) {
        self.pixels.clear();
        self.gradients.clear();
        let mut bytes = std::mem::take(&mut self.image).into_raw();
        bytes.resize(width as usize * height as usize, 0);
        paint(&mut bytes, &mut self.pixels, &mut self.gradients);
        self.image = GrayImage::from_raw(width, height, bytes).unwrap_or_default();
    }

    fn light(&mut self, pixel: EdgePixel) {
        self.image.put_pixel(pixel.x, pixel.y, image::Luma([255]));
        self.pixels.push(pixel);
    }
}

/// Finds the edge pixels of monochrome frames.
///
/// An edge detector owns its buffers, hence `&mut self` and the borrowed result. A frame so small
/// that the operator is undefined on it (0x0 among them) has no edges; its map still has the size
/// of the frame.
pub trait EdgeDetector {
    /// Returns the edges of `frame`.
    fn detect_edges<'a>(&'a mut self, frame: &GrayImage) -> &'a EdgeMap;

    /// Returns the edges found last; an empty map before the first frame.
    fn edges(&self) -> &EdgeMap;
}

impl<E: EdgeDetector + ?Sized> EdgeDetector for Box<E> {
    fn detect_edges<'a>(&'a mut self, frame: &GrayImage) -> &'a EdgeMap {
        (**self).detect_edges(frame)
    }

    fn edges(&self) -> &EdgeMap {
        (**self).edges()
    }
}
