//! Numpy arrays into frames.

use hough_heuristic::Channel;
use hough_heuristic::image::{DynamicImage, GrayImage, ImageBuffer};
use numpy::ndarray::ArrayViewD;
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// Parses the name of a channel.
pub fn channel(name: &str) -> PyResult<Channel> {
    Ok(match name {
        "auto" => Channel::Auto,
        "luma" => Channel::Luma,
        "red" => Channel::Red,
        "green" => Channel::Green,
        "blue" => Channel::Blue,
        "strongest" => Channel::Strongest,
        _ => {
            return Err(PyValueError::new_err(format!(
                "channel is {name:?}: use \"auto\", \"luma\", \"red\", \"green\", \"blue\" or \
                 \"strongest\""
            )));
        }
    })
}

/// Turns an array of shape (height, width) or (height, width, 1, 3 or 4) into a frame.
///
/// Returns the bits that values of 16 bits used, if they used fewer.
pub fn from_array(
    image: &Bound<'_, PyAny>,
    channel: Channel,
    buffer: GrayImage,
) -> PyResult<(GrayImage, Option<u32>)> {
    let array = image.cast::<PyUntypedArray>().map_err(|_| {
        PyTypeError::new_err(format!(
            "image is of type {}: pass a numpy array of shape (height, width) or (height, width, \
             3)",
            image.get_type()
        ))
    })?;
    let (size, depth) = size_of(array.shape())?;
    if let Ok(pixels) = image.cast::<PyArrayDyn<u8>>() {
        let pixels = pixels.try_readonly()?;
        let values = values_of(&pixels.as_array(), buffer.into_raw(), |value| value);
        return Ok(gray8(size, depth, values, channel));
    }
    if let Ok(pixels) = image.cast::<PyArrayDyn<bool>>() {
        let pixels = pixels.try_readonly()?;
        let white = |value| if value { 255 } else { 0 };
        let values = values_of(&pixels.as_array(), buffer.into_raw(), white);
        return Ok(gray8(size, depth, values, channel));
    }
    if let Ok(pixels) = image.cast::<PyArrayDyn<u16>>() {
        let pixels = pixels.try_readonly()?;
        let values = values_of(&pixels.as_array(), Vec::new(), |value| value);
        return Ok(gray16(size, depth, values, channel));
    }
    let values = if let Ok(pixels) = image.cast::<PyArrayDyn<f32>>() {
        let pixels = pixels.try_readonly()?;
        unit_values(&pixels.as_array().mapv(f64::from).view())?
    } else if let Ok(pixels) = image.cast::<PyArrayDyn<f64>>() {
        unit_values(&pixels.try_readonly()?.as_array())?
    } else {
        return Err(PyTypeError::new_err(format!(
            "image is of dtype {}: use uint8, uint16, bool, or float32 or float64 in 0..1",
            array.dtype()
        )));
    };
    Ok(gray8(size, depth, values, channel))
}

/// Width and height, and the number of components of a pixel.
fn size_of(shape: &[usize]) -> PyResult<((u32, u32), usize)> {
    let (height, width, components) = match *shape {
        [height, width] => (height, width, 1),
        [height, width, components @ (1 | 3 | 4)] => (height, width, components),
        _ => {
            return Err(PyValueError::new_err(format!(
                "image is of shape {shape:?}: use (height, width) or (height, width, 1, 3 or 4)"
            )));
        }
    };
    let side = |side: usize| {
        u32::try_from(side).map_err(|_| PyValueError::new_err("image has too many pixels"))
    };
    Ok(((side(width)?, side(height)?), components))
}

/// The values in the order of rows, whatever the strides.
fn values_of<T: Copy, V: Copy>(
    pixels: &ArrayViewD<'_, T>,
    mut values: Vec<V>,
    value: impl Fn(T) -> V,
) -> Vec<V> {
    values.clear();
    if let Some(rows) = pixels.as_slice() {
        values.extend(rows.iter().map(|pixel| value(*pixel)));
    } else {
        values.extend(pixels.iter().map(|pixel| value(*pixel)));
    }
    values
}

/// Values of 0..1 as gray levels.
fn unit_values(pixels: &ArrayViewD<'_, f64>) -> PyResult<Vec<u8>> {
    let level = |value: f64| {
        if (0.0..=1.0).contains(&value) {
            return Ok((value * 255.0).round() as u8);
        }
        Err(PyValueError::new_err(format!(
            "image holds {value}: values of floating point must lie in 0..1; divide by the \
             largest possible value"
        )))
    };
    pixels.iter().map(|value| level(*value)).collect()
}

fn gray8(
    (width, height): (u32, u32),
    components: usize,
    values: Vec<u8>,
    channel: Channel,
) -> (GrayImage, Option<u32>) {
    let picture = match components {
        1 => return (filled(width, height, values), None),
        3 => DynamicImage::ImageRgb8(filled(width, height, values)),
        _ => DynamicImage::ImageRgba8(filled(width, height, values)),
    };
    channel.frame(picture)
}

fn gray16(
    (width, height): (u32, u32),
    components: usize,
    values: Vec<u16>,
    channel: Channel,
) -> (GrayImage, Option<u32>) {
    let picture = match components {
        1 => DynamicImage::ImageLuma16(filled(width, height, values)),
        3 => DynamicImage::ImageRgb16(filled(width, height, values)),
        // Transparency must not decide how far the values are scaled.
        _ => {
            let opaque = values
                .chunks_exact(4)
                .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]);
            DynamicImage::ImageRgb16(filled(width, height, opaque.collect()))
        }
    };
    channel.frame(picture)
}

/// An image of exactly these values.
fn filled<P: hough_heuristic::image::Pixel>(
    width: u32,
    height: u32,
    values: Vec<P::Subpixel>,
) -> ImageBuffer<P, Vec<P::Subpixel>> {
    ImageBuffer::from_raw(width, height, values).unwrap_or_else(|| ImageBuffer::new(0, 0))
}
