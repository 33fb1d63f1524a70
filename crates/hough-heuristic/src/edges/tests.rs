//! The fused passes beside Canny's passes as plainly as they can be written, and the whole operator
//! on frames whose edges are known.

use std::time::Duration;

use image::GrayImage;
use proptest::prelude::*;

use super::canny::EDGE;
use super::maxima::squared;
use super::rows::{Finding, Passes, STRONG, WEAK};
use super::*;
use crate::clock;

/// A candidate of the plain version.
#[derive(Clone, Copy, Debug)]
struct Maximum {
    /// Place in the frame, row by row.
    index: usize,
    mark: u8,
    /// The gradient in gray levels.
    vector: (f64, f64),
    /// Its length.
    strength: f64,
    /// From the pixel's centre to the steepest point, pixels.
    offset: (f64, f64),
}

/// The candidates of a frame of at least 3x3 pixels, row by row.
fn maxima(passes: &Passes, gray: &[u8], width: usize) -> Vec<Maximum> {
    let (w, h) = (width as isize, (gray.len() / width) as isize);
    let at = |x: isize, y: isize| (y.clamp(0, h - 1) * w + x.clamp(0, w - 1)) as usize;
    let plane = |value: &dyn Fn(isize, isize) -> i32| -> Vec<i32> {
        (0..h)
            .flat_map(|y| (0..w).map(move |x| (x, y)))
            .map(|(x, y)| value(x, y))
            .collect()
    };
    let reach = passes.weights.len() as isize - 1;
    let weight = |k: isize| i32::from(passes.weights[k.unsigned_abs()]);

    let down = plane(&|x, y| {
        let sum: i32 = (-reach..=reach)
            .map(|k| weight(k) * i32::from(gray[at(x, y + k)]))
            .sum();
        (sum + 8) >> 4
    });
    let smooth = plane(&|x, y| {
        let sum: i32 = (-reach..=reach)
            .map(|k| weight(k) * down[at(x + k, y)])
            .sum();
        (sum + 8) >> 4
    });
    let s = |x, y| smooth[at(x, y)];
    let gx = plane(&|x, y| {
        s(x + 1, y - 1) + 2 * s(x + 1, y) + s(x + 1, y + 1)
            - s(x - 1, y - 1)
            - 2 * s(x - 1, y)
            - s(x - 1, y + 1)
    });
    let gy = plane(&|x, y| {
        s(x - 1, y + 1) + 2 * s(x, y + 1) + s(x + 1, y + 1)
            - s(x - 1, y - 1)
            - 2 * s(x, y - 1)
            - s(x + 1, y - 1)
    });
    let square = plane(&|x, y| gx[at(x, y)].pow(2) + gy[at(x, y)].pow(2));

    let inner = (1..h - 1).flat_map(|y| (1..w - 1).map(move |x| (x, y)));
    inner
        .filter_map(|(x, y)| {
            let index = at(x, y);
            let (dx, dy) = (f64::from(gx[index]), f64::from(gy[index]));
            // The tangent of 22.5 degrees as the passes have it.
            let tangent = 13573.0 / 32768.0;
            let (step_x, step_y) = if dy.abs() < dx.abs() * tangent {
                (1, 0)
            } else if dx.abs() < dy.abs() * tangent {
                (0, 1)
            } else if (dx < 0.0) == (dy < 0.0) {
                (1, 1)
            } else {
                (-1, 1)
            };
            let here = square[index];
            let (before, behind) = (
                square[at(x - step_x, y - step_y)],
                square[at(x + step_x, y + step_y)],
            );
            if here <= passes.low || here <= before || here < behind {
                return None;
            }
            let [a, b, c] = [before, here, behind].map(|square| f64::from(square).sqrt());
            // The top of the parabola through the three lengths at -1, 0 and 1.
            let (slope, curvature) = ((c - a) / 2.0, a + c - 2.0 * b);
            let top = if curvature < 0.0 {
                (-slope / curvature).clamp(-0.5, 0.5)
            } else {
                0.0
            };
            Some(Maximum {
                index,
                mark: if here > passes.high { STRONG } else { WEAK },
                vector: (dx / 16.0, dy / 16.0),
                strength: dx.hypot(dy) / 16.0,
                offset: (top * step_x as f64, top * step_y as f64),
            })
        })
        .collect()
}

#[test]
fn image_and_list_agree_after_reuse() {
    let mut map = EdgeMap::from_image(&GrayImage::from_pixel(9, 7, image::Luma([1])));
    assert_eq!(map.pixels().len(), 63);
    let mut small = GrayImage::new(4, 3);
    small.put_pixel(2, 1, image::Luma([255]));
    map.copy_from(&small);
    assert_eq!((map.width(), map.height()), (4, 3));
    assert_eq!(map.pixels(), [EdgePixel { x: 2, y: 1 }]);
    assert_eq!(map.image(), &small);
}

#[test]
fn settings_are_checked() {
    let nan = f32::NAN;
    for (low, high, sigma, noise_factor) in [
        (0.0, 10.0, 1.0, 1.0),
        (-1.0, 5.0, 1.0, 1.0),
        (20.0, 10.0, 1.0, 1.0),
        (nan, 1.0, 1.0, 1.0),
        (1.0, nan, 1.0, 1.0),
        (5.0, 2e3, 1.0, 1.0),
        (5.0, 9.0, 2.5, 1.0),
        (5.0, 9.0, -1.0, 1.0),
        (5.0, 9.0, nan, 1.0),
        (5.0, 9.0, 1.0, -1.0),
        (5.0, 9.0, 1.0, nan),
    ] {
        let config = CannyConfig {
            low,
            high,
            sigma,
            noise_factor,
        };
        let error = Canny::new(config).unwrap_err().to_string();
        assert!(
            high < 1e3 || high.is_nan() || error.contains("2000"),
            "{error}"
        );
    }
}

#[test]
fn frames_of_every_small_size_pass() {
    for sigma in [0.0, 1.2, 1.5, 2.0] {
        let mut canny = Canny::new(CannyConfig {
            sigma,
            ..CannyConfig::default()
        })
        .unwrap();
        for width in 0..12 {
            for height in 0..12 {
                let frame = GrayImage::from_fn(width, height, |x, _| {
                    image::Luma([if x > width / 2 { 255 } else { 0 }])
                });
                let edges = canny.detect_edges(&frame);
                assert_eq!((edges.width(), edges.height()), (width, height));
            }
        }
        assert!(!canny.edges().pixels().is_empty());
    }
}

/// Frames with flat parts, steps and texture, of sizes around the block size.
fn frames() -> impl Strategy<Value = GrayImage> {
    (3u32..80, 3u32..40, any::<u64>(), 1u8..=255).prop_map(|(width, height, seed, roughness)| {
        let mut state = seed | 1;
        GrayImage::from_fn(width, height, |x, y| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let texture = (state >> 56) as u8 % roughness;
            let step = if (x + y) % 37 < 18 { 90 } else { 0 };
            image::Luma([texture.saturating_add(step)])
        })
    })
}

proptest! {
    #[test]
    fn every_path_gives_what_the_plain_version_gives(
        frame in frames(), sigma in 0f32..=2.0, low in 1f32..300.0, ratio in 1f32..3.0
    ) {
        let config = CannyConfig { sigma, low, high: low * ratio, noise_factor: 0.0 };
        let mut canny = Canny::new(config).unwrap();
        let Maxima { passes, rows, .. } = &mut canny.maxima;
        (passes.low, passes.high) = (squared(config.low), squared(config.high));
        let (gray, width) = (frame.as_raw(), frame.width() as usize);
        let expected = maxima(passes, gray, width);
        let mut expected_marks = vec![0; gray.len()];
        for maximum in &expected {
            expected_marks[maximum.index] = maximum.mark;
        }
        let paths: [fn(Finding<'_>); 2] = [|work| widest(work), |work| work.run()];
        for path in paths {
            let mut find = |marks: &mut [u8]| {
                let mut found = Vec::new();
                let found_in = &mut found;
                path(Finding { passes, gray, width, rows, marks, found: found_in, deadline: None });
                found
            };
            let mut marks = vec![77; gray.len()];
            let found = find(&mut marks);
            prop_assert_eq!(&marks, &expected_marks);
            // The list does not depend on the marks.
            prop_assert_eq!(&find(&mut []), &found);
            let index = |pixel: EdgePixel| pixel.y as usize * width + pixel.x as usize;
            let listed: Vec<_> = found.iter().map(|found| index(found.pixel)).collect();
            let indices: Vec<_> = expected.iter().map(|maximum| maximum.index).collect();
            prop_assert_eq!(listed, indices);
            for (candidate, maximum) in found.iter().zip(&expected) {
                let gradient = candidate.gradient;
                prop_assert_eq!(gradient.vector(), maximum.vector);
                prop_assert!((gradient.strength() - maximum.strength).abs() < 1e-9);
                let ((x, y), (u, v)) = (gradient.offset(), maximum.offset);
                let off = (x - u).abs().max((y - v).abs());
                prop_assert!(off < 1e-9, "{:?} {:?}", candidate, maximum);
            }
        }
    }

    #[test]
    fn image_and_list_agree(frame in frames()) {
        let mut canny = Canny::default();
        let edges = canny.detect_edges(&frame);
        let again = EdgeMap::from_image(edges.image());
        prop_assert_eq!(again.pixels(), edges.pixels());
        prop_assert_eq!(edges.gradients.len(), edges.pixels().len());
        prop_assert!(edges.image().as_raw().iter().all(|&gray| gray == 0 || gray == EDGE));
    }
}

#[test]
fn a_slanted_border_is_located_to_a_twentieth_of_a_pixel() {
    for degrees in (0..180).step_by(7) {
        let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
        let distance = |x: f64, y: f64| (x - 40.2) * cos + (y - 39.6) * sin;
        let frame = GrayImage::from_fn(80, 80, |x, y| {
            let cover = (distance(x.into(), y.into()) + 0.5).clamp(0.0, 1.0);
            image::Luma([(50.0 + 120.0 * cover) as u8])
        });
        let mut canny = Canny::default();
        let edges = canny.detect_edges(&frame);
        assert!(edges.pixels().len() > 50);
        let mut errors = Vec::new();
        for (index, gradient) in edges.gradients.iter().enumerate() {
            let (x, y) = edges.position(index);
            if (6.0..73.0).contains(&x) && (6.0..73.0).contains(&y) {
                errors.push(distance(x, y).abs());
                let (gx, gy) = gradient.vector();
                let along = (gx * cos + gy * sin) / gradient.strength();
                assert!(along > 0.998, "{degrees}: direction off by {along}");
            }
        }
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        assert!(mean < 0.05, "{degrees}: {mean}");
    }
}

#[test]
fn a_deadline_leaves_all_maxima_or_none() {
    let frame = GrayImage::from_fn(90, 70, |x, y| image::Luma([(x / 9 * 20 + y % 3) as u8]));
    let mut maxima = Maxima::new(0.8);
    let mut find = |deadline| maxima.find(frame.as_raw(), 90, 20.0, deadline).len();
    let now = clock::now().unwrap();
    assert!(find(None) > 0);
    assert_eq!(find(Some(now + Duration::from_secs(60))), find(None));
    assert_eq!(find(Some(now)), 0);
}

#[test]
fn noise_raises_the_thresholds() {
    let mut state = 1u64;
    let mut noise = || {
        // The sum of twelve uniform numbers is close to normal, with deviation 1.
        (0..12)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 40) as f32 / (1u64 << 24) as f32 - 0.5
            })
            .sum::<f32>()
    };
    for deviation in [5.0f32, 15.0, 30.0] {
        let frame = GrayImage::from_fn(400, 300, |_, _| {
            image::Luma([(128.0 + deviation * noise()).round() as u8])
        });
        let estimate = noise_deviation(frame.as_raw(), 400, ROW_STEP);
        assert!(
            (estimate / deviation - 1.0).abs() < 0.1,
            "{deviation}: {estimate}"
        );
        let operator = |noise_factor| {
            let config = CannyConfig {
                noise_factor,
                ..CannyConfig::default()
            };
            let mut canny = Canny::new(config).unwrap();
            canny.detect_edges(&frame);
            canny
        };
        assert_eq!(operator(0.0).thresholds(), (30.0, 70.0));
        let raised = operator(5.0);
        let high = 5.0 * estimate * raised.maxima.noise_gain();
        assert_eq!(
            raised.thresholds().1.to_bits(),
            high.max(70.0).to_bits(),
            "{deviation}"
        );
        let count = |noise_factor| operator(noise_factor).edges().pixels().len();
        assert!(count(5.0) < 60, "{deviation}: {}", count(5.0));
        assert!(
            deviation < 20.0 || count(0.0) > 3000,
            "{deviation}: {}",
            count(0.0)
        );
    }
}
