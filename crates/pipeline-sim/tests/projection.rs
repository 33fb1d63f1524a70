//! The outline of a sphere against a brute-force ray cast.

use nalgebra::{Point2, Point3};
use pipeline_sim::{Camera, Distortion, ProjectionError};

/// Whether the ray through a pixel meets the sphere.
fn hits(camera: &Camera, pixel: Point2<f64>, centre: &Point3<f64>, radius: f64) -> bool {
    let ray = camera.ray(pixel).normalize();
    let along = ray.dot(&centre.coords);
    along > 0.0 && centre.coords.norm_squared() - along * along <= radius * radius
}

/// The outline found by bisection along rays from a pixel inside: area, centroid and second moments by fine polar sums.
fn brute_force(camera: &Camera, centre: &Point3<f64>, radius: f64) -> (f64, f64, f64) {
    let inside = camera.project(centre).expect("in front");
    let n = 4096;
    let outline: Vec<Point2<f64>> = (0..n)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / f64::from(n)).sin_cos();
            let (mut near, mut far) = (0.0, 2000.0);
            for _ in 0..60 {
                let middle = 0.5 * (near + far);
                let pixel = Point2::new(inside.x + middle * cos, inside.y + middle * sin);
                if hits(camera, pixel, centre, radius) {
                    near = middle;
                } else {
                    far = middle;
                }
            }
            Point2::new(inside.x + near * cos, inside.y + near * sin)
        })
        .collect();
    // Centre and semi-axes from width and height along the principal directions of the outline.
    let (mut area, mut cx, mut cy) = (0.0, 0.0, 0.0);
    for (p, q) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        let cross = (p.x - inside.x) * (q.y - inside.y) - (q.x - inside.x) * (p.y - inside.y);
        area += cross / 2.0;
        cx += cross * (p.x + q.x - 2.0 * inside.x) / 6.0;
        cy += cross * (p.y + q.y - 2.0 * inside.y) / 6.0;
    }
    let (cx, cy) = (inside.x + cx / area, inside.y + cy / area);
    let distances = outline.iter().map(|p| (p.x - cx).hypot(p.y - cy));
    let longest = distances.clone().fold(0.0, f64::max);
    let shortest = distances.fold(f64::MAX, f64::min);
    (cx, cy, 0.5 * (longest + shortest))
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
fn the_projected_circle_agrees_with_a_ray_cast_to_a_hundredth_of_a_pixel() {
    let camera = Camera::paper();
    for (x, y, z) in PLACES {
        let centre = Point3::new(x, y, z);
        let circle = camera.project_sphere_to_circle(&centre, 0.020).expect("in view");
        let (cx, cy, r) = brute_force(&camera, &centre, 0.020);
        let error = (circle.x - cx)
            .abs()
            .max((circle.y - cy).abs())
            .max((circle.radius - r).abs());
        assert!(error < 0.01, "{centre}: {circle:?} against {cx} {cy} {r}");
    }
}

#[test]
fn with_distortion_too() {
    let lens = Distortion {
        k1: -0.20,
        k2: 0.05,
        k3: 0.0,
        p1: 0.002,
        p2: -0.001,
    };
    let camera = Camera::paper().with_distortion(lens).expect("does not fold");
    for (x, y, z) in PLACES {
        let centre = Point3::new(x, y, z);
        let circle = camera.project_sphere_to_circle(&centre, 0.020).expect("in view");
        let (cx, cy, r) = brute_force(&camera, &centre, 0.020);
        let error = (circle.x - cx).abs().max((circle.y - cy).abs());
        assert!(error < 0.01, "{centre}: {circle:?} against {cx} {cy} {r}");
        // No longer an ellipse: mean of the extremes and mean of the axes of inertia part company slightly.
        assert!(
            (circle.radius - r).abs() < 0.02 + 0.002 * r,
            "{centre}: {} against {r}",
            circle.radius
        );
        let back = camera.ray(camera.project(&centre).expect("in front")) * z;
        assert!((back - centre.coords).norm() < 1e-9);
    }
}

#[test]
fn what_has_no_outline_is_named() {
    let camera = Camera::paper();
    let at = |x, y, z, r| camera.project_sphere(&Point3::new(x, y, z), r);
    assert!(matches!(
        at(0.0, 0.0, 0.01, 0.02),
        Err(ProjectionError::Inside { .. })
    ));
    assert!(matches!(
        at(0.0, 0.0, -0.5, 0.02),
        Err(ProjectionError::Behind { .. })
    ));
    assert!(matches!(
        at(0.5, 0.0, 0.01, 0.02),
        Err(ProjectionError::Behind { .. })
    ));
    assert!(matches!(
        at(f64::NAN, 0.0, 0.5, 0.02),
        Err(ProjectionError::CentreNotFinite)
    ));
    for r in [0.0, -0.02, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            at(0.0, 0.0, 0.5, r),
            Err(ProjectionError::Radius { .. })
        ));
    }
    for (f, w) in [(0.0, 0.0088), (-0.01, 0.0088), (0.0115, 0.0), (f64::NAN, 0.0088)] {
        assert!(Camera::pinhole(f, w, 768, 576).is_err());
    }
    assert!(Camera::pinhole(0.0115, 0.0088, 0, 576).is_err());
    assert!(camera.with_focal_factor(0.0).is_err());
    assert!(
        camera
            .with_distortion(Distortion {
                k1: -3.0,
                ..Distortion::default()
            })
            .is_err()
    );
    assert!(
        camera
            .with_distortion(Distortion {
                k1: f64::NAN,
                ..Distortion::default()
            })
            .is_err()
    );
}
