//! The outline of a sphere against a brute-force ray cast.

use nalgebra::{Matrix2, Point2, Point3, Vector2, Vector3};
use pipeline_sim::{Camera, Distortion, QuantityError, SightError};

/// The lens as the literature has it, written down anew: a pinhole's image of unit focal length to
/// the distorted one.
fn distorted(lens: &Distortion, x: f64, y: f64) -> (f64, f64) {
    let r2 = x * x + y * y;
    let radial = 1.0 + lens.k1 * r2 + lens.k2 * r2.powi(2) + lens.k3 * r2.powi(3);
    (
        x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x),
        y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y,
    )
}

/// The ray through a pixel, the lens undone by repeated correction.
fn ray(camera: &Camera, pixel: Point2<f64>) -> Vector3<f64> {
    let image = (pixel - camera.principal_point()) / camera.focal_px();
    let (mut x, mut y) = (image.x, image.y);
    for _ in 0..100 {
        let (u, v) = distorted(camera.distortion(), x, y);
        (x, y) = (x + image.x - u, y + image.y - v);
    }
    Vector3::new(x, y, 1.0)
}

/// Returns `true` if the ray through a pixel meets the sphere.
fn hits(camera: &Camera, pixel: Point2<f64>, centre: &Point3<f64>, radius: f64) -> bool {
    let ray = ray(camera, pixel).normalize();
    let along = ray.dot(&centre.coords);
    along > 0.0 && centre.coords.norm_squared() - along * along <= radius * radius
}

/// The outline found by bisection along rays from a pixel inside: centroid, and mean of the
/// semi-axes of the ellipse with the same second moments.
fn brute_force(camera: &Camera, centre: &Point3<f64>, radius: f64) -> (f64, f64, f64) {
    let (u, v) = distorted(
        camera.distortion(),
        centre.x / centre.z,
        centre.y / centre.z,
    );
    let inside = camera.principal_point() + Vector2::new(u, v) * camera.focal_px();
    let n = 512;
    let outline: Vec<Vector2<f64>> = (0..n)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / f64::from(n)).sin_cos();
            let (mut near, mut far) = (0.0, 400.0);
            for _ in 0..50 {
                let middle = 0.5 * (near + far);
                if hits(
                    camera,
                    inside + Vector2::new(cos, sin) * middle,
                    centre,
                    radius,
                ) {
                    near = middle;
                } else {
                    far = middle;
                }
            }
            Vector2::new(cos, sin) * near
        })
        .collect();
    // Sums over the triangles between the pixel inside and neighbouring points of the outline.
    let (mut area, mut first, mut second) = (0.0, Vector2::zeros(), Matrix2::zeros());
    for (p, q) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        let triangle = 0.5 * p.perp(q);
        area += triangle;
        first += (p + q) * (triangle / 3.0);
        let sum = p + q;
        second +=
            (p * p.transpose() + q * q.transpose() + sum * sum.transpose()) * (triangle / 12.0);
    }
    let middle = first / area;
    let spread = (second / area - middle * middle.transpose()).symmetric_eigenvalues();
    let place = inside + middle;
    (place.x, place.y, spread.x.sqrt() + spread.y.sqrt())
}

const PLACES: [(f64, f64, f64); 6] = [
    (0.0, 0.0, 0.1534),
    (0.03, -0.01, 0.12),
    (-0.05, 0.035, 0.16),
    (0.15, 0.10, 0.50),
    (-0.02, 0.02, 0.09),
    (0.2, -0.15, 0.8),
];

#[test]
fn projected_circle_agrees_with_a_ray_cast() {
    let lens = Distortion {
        k1: -0.20,
        k2: 0.05,
        k3: 0.0,
        p1: 0.002,
        p2: -0.001,
    };
    let bent = Camera::paper()
        .with_distortion(lens)
        .expect("does not fold");
    for camera in [Camera::paper(), bent] {
        for (x, y, z) in PLACES {
            let centre = Point3::new(x, y, z);
            let outline = camera.project_sphere(&centre, 0.020).expect("in view");
            let (circle, (cx, cy, r)) = (outline.circle(), brute_force(&camera, &centre, 0.020));
            let off = (circle.x - cx)
                .abs()
                .max((circle.y - cy).abs())
                .max((circle.radius - r).abs());
            assert!(off < 0.01, "{centre}: {circle:?} against {cx} {cy} {r}");
            let pixel = camera.project(&centre).expect("in front");
            let back = camera.ray(pixel).expect("shown") * z;
            assert!((back - centre.coords).norm() < 1e-9);
        }
    }
}

#[test]
fn impossible_balls_and_cameras_are_named() {
    let camera = Camera::paper();
    for (x, z, r, reason) in [
        (0.0, 0.01, 0.02, "not before the camera"),
        (0.0, -0.5, 0.02, "not before the camera"),
        (0.5, 0.01, 0.02, "not before the camera"),
        (f64::NAN, 0.5, 0.02, "distance of the ball"),
        (0.0, 0.5, 0.0, "radius of the ball"),
        (0.0, 0.5, -0.02, "radius of the ball"),
        (0.0, 0.5, f64::INFINITY, "radius of the ball"),
    ] {
        let refused = camera.project_sphere(&Point3::new(x, 0.0, z), r);
        let refused = refused.expect_err(reason).to_string();
        assert!(refused.contains(reason), "{refused}");
    }
    let (largest, more) = (Camera::LARGEST_SIDE, Camera::LARGEST_SIDE + 1);
    assert!(camera.resized(largest, largest).is_ok());
    let folding = |k1| {
        let lens = Distortion {
            k1,
            ..Distortion::default()
        };
        camera.with_distortion(lens)
    };
    for (refused, reason) in [
        (Camera::pinhole(0.0, 0.0088, 768, 576), "focal length (m)"),
        (
            Camera::pinhole(f64::NAN, 0.0088, 768, 576),
            "focal length (m)",
        ),
        (
            Camera::pinhole(0.0115, -0.0088, 768, 576),
            "sensor width (m)",
        ),
        (Camera::pinhole(0.0115, 0.0088, 0, 576), "frame width (px)"),
        (Camera::pinhole(0.0115, 0.0088, 768, 0), "frame height (px)"),
        (Camera::pinhole(0.01, 0.01, 1, more), "at most 16384"),
        (camera.resized(0, 576), "frame width (px)"),
        (camera.resized(u32::MAX, u32::MAX), "at most 16384"),
        (camera.with_focal_factor(0.0), "focal factor"),
        (folding(-3.0), "folds the image over"),
        (folding(f64::NAN), "k1"),
    ] {
        let refused = refused.expect_err(reason).to_string();
        assert!(refused.contains(reason), "{refused}");
    }
}

#[test]
fn strong_lenses_are_undone_or_refused() {
    let lens = |k1, k2, p1| Distortion {
        k1,
        k2,
        p1,
        ..Distortion::default()
    };
    let corners = [
        (-0.5, -0.5),
        (767.5, -0.5),
        (-0.5, 575.5),
        (767.5, 575.5),
        (383.0, -0.5),
    ];
    let mut usable = 0;
    for strong in [
        lens(-0.9, 0.6, 0.0),
        lens(-0.75, 0.25, 0.01),
        lens(-0.6, 0.0, 0.0),
        lens(40.0, 0.0, 0.0),
        lens(3.0, 900.0, 0.02),
        lens(-1.4, 1.5, 0.0),
    ] {
        let Ok(camera) = Camera::paper().with_distortion(strong) else {
            continue;
        };
        usable += 1;
        for (x, y) in corners {
            let pixel = Point2::new(x, y);
            let ray = camera.ray(pixel).expect("inside the frame");
            let (u, v) = distorted(&strong, ray.x, ray.y);
            let back = camera.principal_point() + Vector2::new(u, v) * camera.focal_px();
            assert!(
                (back - pixel).norm() < 1e-8,
                "{strong:?}: {pixel} comes back as {back}"
            );
        }
    }
    assert!(usable >= 5, "{usable}");
    // Where a barrel lens folds, nothing is shown; a pixel nowhere has no ray.
    let barrel = Camera::paper()
        .with_distortion(lens(-0.6, 0.0, 0.0))
        .expect("does not fold inside the frame");
    for pixel in [Point2::new(3000.0, 288.0), Point2::new(f64::NAN, 0.0)] {
        let ray = barrel.ray(pixel);
        assert!(matches!(ray, Err(QuantityError::NoRay { .. })), "{ray:?}");
    }
}

#[test]
fn resized_camera_shows_all_of_the_old_frame() {
    let camera = Camera::paper();
    let centre = Point3::new(0.03, -0.02, 0.4);
    let circle = camera
        .project_sphere(&centre, 0.02)
        .expect("in view")
        .circle();
    for (size, scale, beside) in [((192, 144), 0.25, 0.0), ((1920, 1080), 1.875, 240.0)] {
        let other = camera.resized(size.0, size.1).expect("a usable size");
        assert_eq!(other.size(), size);
        let shown = other
            .project_sphere(&centre, 0.02)
            .expect("in view")
            .circle();
        assert!((shown.radius - scale * circle.radius).abs() < 1e-9);
        assert!((shown.x + 0.5 - beside - scale * (circle.x + 0.5)).abs() < 1e-9);
        assert!((shown.y + 0.5 - scale * (circle.y + 0.5)).abs() < 1e-9);
    }
}

#[test]
fn directions_beyond_the_fold_are_not_shown() {
    let lens = |k1, k2, k3, p1| Distortion {
        k1,
        k2,
        k3,
        p1,
        p2: 0.5 * p1,
    };
    for (lens, folds) in [
        (lens(-0.30, 0.01, 0.0, 0.0), true),
        (lens(-0.35, 0.08, 0.0, 0.0), false),
        (lens(-0.30, 0.03, 0.0, 0.01), true),
        (lens(-0.60, 0.0, 0.0, 0.0), true),
        // Back again on the far side of the fold.
        (lens(-0.60, 0.13, 0.01, 0.0), true),
        (lens(0.30, -0.10, 0.0, -0.02), true),
        (lens(0.20, 0.05, 0.0, 0.0), false),
    ] {
        let camera = Camera::paper()
            .with_distortion(lens)
            .expect("does not fold in the frame");
        let (mut shown, mut refused) = (0, 0);
        for (i, k) in (0..100).flat_map(|i| (0..24).map(move |k| (i, k))) {
            let (tangent, angle) = (0.06 * f64::from(i), f64::from(k) * 0.27);
            let direction = Point3::new(tangent * angle.cos(), tangent * angle.sin(), 1.0);
            let Some(pixel) = camera.project(&direction) else {
                refused += 1;
                // Nor has a ball there an outline.
                let named = camera.project_sphere(&direction, 0.02);
                let Err(SightError::BeyondLens { angle }) = named else {
                    panic!("{named:?}");
                };
                assert!((angle - tangent.atan()).abs() < 1e-9, "{angle}");
                continue;
            };
            // Whatever is said to lie in the frame is what the frame shows there.
            if (-0.5..=767.5).contains(&pixel.x) && (-0.5..=575.5).contains(&pixel.y) {
                shown += 1;
                let back = camera.ray(pixel).expect("inside the frame");
                assert!(
                    (back - direction.coords).norm() < 1e-9,
                    "{lens:?}: {direction} {back}"
                );
            }
        }
        assert!(shown > 120, "{shown}");
        assert_eq!(refused > 0, folds, "{lens:?}: {refused}");
    }
    // A frame shows all that its rays meet.
    let camera = Camera::paper()
        .with_distortion(lens(-0.60, 0.0, 0.0, 0.01))
        .expect("does not fold in the frame");
    for (x, y) in (0..=48).flat_map(|i| (0..=36).map(move |j| (i, j))) {
        let pixel = Point2::new(16.0 * f64::from(x) - 0.5, 16.0 * f64::from(y) - 0.5);
        let back = camera
            .project(&Point3::from(camera.ray(pixel).expect("shown")))
            .expect("shown");
        assert!((back - pixel).norm() < 1e-6, "{pixel} {back}");
    }
}

#[test]
fn circle_leads_back_to_its_sphere() {
    for millimetres in 2..=12 {
        let camera =
            Camera::pinhole(f64::from(millimetres) * 1e-3, 0.0088, 768, 576).expect("a camera");
        for k in 0..400 {
            let circle = hough_heuristic::Circle {
                x: f64::from(k % 20) * 40.0,
                y: f64::from(k / 20) * 30.0,
                radius: [2.0, 40.0, 132.0, 260.0][k as usize % 4],
            };
            let centre = camera
                .sphere_of_circle(&circle, 0.02)
                .expect("there is one");
            let back = camera
                .project_sphere(&centre, 0.02)
                .expect("before the camera")
                .circle();
            let off =
                (back.x - circle.x).hypot(back.y - circle.y) + (back.radius - circle.radius).abs();
            assert!(
                off < 1e-6,
                "{millimetres} mm: {circle:?} comes back as {back:?}"
            );
        }
    }
}

#[test]
fn fold_narrower_than_a_step_is_found() {
    let lens = Distortion {
        k1: -2.0,
        k2: 1.0,
        ..Distortion::default()
    };
    let wide = Camera::paper().with_focal_factor(0.002).expect("a camera");
    // The radius u (1 - u²)² first turns back at u² = 1 / 5.
    let expected = wide.focal_px() * 0.2_f64.sqrt() * 0.64;
    for lens in [lens, Distortion { p1: 1e-6, ..lens }] {
        let Err(QuantityError::Folds { radius_px }) = wide.with_distortion(lens) else {
            panic!("folds");
        };
        assert!(
            (radius_px - expected).abs() < 1e-3 * expected,
            "{radius_px} {expected}"
        );
    }
}
