//! Discs that differ from the ground in colour and not in brightness.

use circle_scenes::scene::same;
use hough_heuristic::image::{DynamicImage, GrayImage, Luma, Rgb, RgbImage, imageops};
use hough_heuristic::{AContrario, AContrarioConfig, Channel, Circle, CircleDetector};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{Rng, SeedableRng};

#[test]
fn discs_of_another_colour_of_like_brightness_are_found() {
    let disc = Circle {
        x: 96.3,
        y: 108.8,
        radius: 21.0,
    };
    let mut detector = AContrario::new(AContrarioConfig::default()).unwrap();
    // Ground and disc, both of a luma of about 140, in texture of 12 gray levels.
    for (ground, paint) in [
        ([125, 150, 125], [255, 100, 125]),
        ([200, 130, 60], [120, 140, 200]),
        ([60, 170, 110], [200, 115, 110]),
    ] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let noise = GrayImage::from_fn(200, 200, |_, _| Luma([rng.next_u32() as u8 / 4]));
        let texture = imageops::blur(&noise, 0.8);
        let picture = RgbImage::from_fn(200, 200, |x, y| {
            let off = (f64::from(x) - disc.x).hypot(f64::from(y) - disc.y);
            let share = (disc.radius + 0.5 - off).clamp(0.0, 1.0);
            let change = f64::from(texture.get_pixel(x, y).0[0]) - 32.0;
            Rgb([0, 1, 2].map(|k| {
                let plain = f64::from(ground[k]) * (1.0 - share) + f64::from(paint[k]) * share;
                (plain + change).clamp(0.0, 255.0) as u8
            }))
        });
        let (frame, _) = Channel::default().frame(DynamicImage::ImageRgb8(picture.clone()));
        let found = detector.detect(&frame).unwrap();
        assert!(
            found.len() == 1 && same(&found[0].circle, &disc, 2.0),
            "{paint:?}: {found:?}"
        );
        let (luma, _) = Channel::Luma.frame(DynamicImage::ImageRgb8(picture));
        let found = detector.detect(&luma).unwrap();
        let shown = found.iter().any(|one| same(&one.circle, &disc, 2.0));
        assert!(!shown, "luma shows it too");
    }
}
