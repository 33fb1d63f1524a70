//! Rendered frames against the exact truth, and the effects of lens, motion, fields and occluders.

use hough_heuristic::image::GrayImage;
use nalgebra::Point2;
use pipeline_sim::{
    Appearance, Ball, Camera, Cell, Distortion, Light, Recipe, Renderer, Round, Scene, Sensor,
    Shape, Shot, Thing, Workspace,
};
use puma_val2::{JointDelta, Joints};

use crate::{at_goal, rng};

/// A gray ball in perfectly even light over a white table, no noise, no blur: its edge is where the
/// geometry says, or nowhere.
fn silhouette() -> Scene {
    Scene {
        lights: Vec::new(),
        ambient: 0.9,
        table: Appearance::new(1.0, 0.0, 0.0),
        ball: Appearance::new(0.3, 0.0, 0.0),
        sensor: Sensor {
            read_noise: 0.0,
            shot_noise: 0.0,
            blur: 0.0,
            vignetting: 0.0,
            ..Sensor::default()
        },
        ..Scene::plain()
    }
}

/// A minimal detector for such a ball: the half-level crossing along rays from a place inside, then
/// centroid and radius of equal area. `None` where something else than the table surrounds the
/// ball.
fn detect(frame: &GrayImage, inside: Point2<f64>, reach: f64) -> Option<(f64, f64, f64)> {
    let value = |x: f64, y: f64| -> Option<f64> {
        let (i, j) = (x.floor(), y.floor());
        let inside = x >= 0.0
            && y >= 0.0
            && i + 1.0 < f64::from(frame.width())
            && j + 1.0 < f64::from(frame.height());
        let at =
            |di: f64, dj: f64| f64::from(frame.get_pixel((i + di) as u32, (j + dj) as u32).0[0]);
        inside.then(|| {
            let (fx, fy) = (x - i, y - j);
            (1.0 - fy) * ((1.0 - fx) * at(0.0, 0.0) + fx * at(1.0, 0.0))
                + fy * ((1.0 - fx) * at(0.0, 1.0) + fx * at(1.0, 1.0))
        })
    };
    let n = 360;
    let mut outline = Vec::new();
    for k in 0..n {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / f64::from(n)).sin_cos();
        let at = |s: f64| value(inside.x + s * cos, inside.y + s * sin);
        let level = 0.9 * 255.0 * 0.5 * (1.0 + 0.3);
        let mut s = 0.5 * reach;
        while at(s)? < level {
            s += 0.5;
            if s > reach {
                return None;
            }
        }
        let (mut near, mut far) = (s - 0.5, s);
        for _ in 0..40 {
            let middle = 0.5 * (near + far);
            if at(middle)? < level {
                near = middle;
            } else {
                far = middle;
            }
        }
        outline.push((near * cos, near * sin));
    }
    let (mut area, mut cx, mut cy) = (0.0, 0.0, 0.0);
    for (p, q) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        let cross = p.0 * q.1 - q.0 * p.1;
        area += 0.5 * cross;
        cx += cross * (p.0 + q.0) / 6.0;
        cy += cross * (p.1 + q.1) / 6.0;
    }
    let (x, y) = (inside.x + cx / area, inside.y + cy / area);
    Some((x, y, (area / std::f64::consts::PI).sqrt()))
}

/// The largest error of centre and of radius over many poses, the mean error of the radius, and how
/// many were measured.
fn errors(camera: Camera, seed: u64) -> (f64, f64, f64, usize) {
    let mut rng = rng(seed);
    let mut renderer = Renderer::new(&silhouette(), 1);
    let (mut centre, mut radius, mut bias, mut count) = (0.0_f64, 0.0_f64, 0.0, 0);
    for _ in 0..30 {
        let again = Recipe::cell()[0].draw_again((768, 576), &mut rng);
        let mut shot = again
            .expect("a frame of pixels")
            .expect("scenes are shared");
        // No rod: it would be a second gray thing.
        shot.cell.holder = None;
        shot.cell.camera = camera;
        let Some(outline) = shot.cell.outline(&shot.joints) else {
            continue;
        };
        if outline.share_inside(764, 572) < 1.0 {
            continue;
        }
        let frame = renderer.render(&shot.cell, &shot.joints);
        let Some((x, y, r)) = detect(frame, outline.centre, 1.15 * outline.major + 4.0) else {
            continue;
        };
        centre = centre.max((x - outline.centre.x).hypot(y - outline.centre.y));
        radius = radius.max((r - (outline.major * outline.minor).sqrt()).abs());
        bias += r - (outline.major * outline.minor).sqrt();
        count += 1;
    }
    (centre, radius, bias / count as f64, count)
}

fn assert_drawn_where_projected(camera: Camera, seed: u64) {
    let (centre, radius, bias, count) = errors(camera, seed);
    assert!(
        count > 15 && centre < 0.05 && radius < 0.05 && bias.abs() < 0.01,
        "{centre} {radius} {bias} {count}"
    );
}

#[test]
fn drawn_ball_is_at_its_projection() {
    assert_drawn_where_projected(Camera::paper(), 1);
}

#[test]
fn drawn_ball_is_at_its_projection_through_a_lens() {
    let lens = Distortion {
        k1: -0.25,
        k2: 0.05,
        ..Distortion::default()
    };
    assert_drawn_where_projected(
        Camera::paper()
            .with_distortion(lens)
            .expect("does not fold"),
        2,
    );
}

/// Mean absolute difference of neighbouring pixels along the two axes.
fn roughness(frame: &GrayImage) -> (f64, f64) {
    let (w, h) = frame.dimensions();
    let at = |x, y| f64::from(frame.get_pixel(x, y).0[0]);
    let (mut across, mut down) = (0.0, 0.0);
    for y in 0..h - 1 {
        for x in 0..w - 1 {
            across += (at(x + 1, y) - at(x, y)).abs();
            down += (at(x, y + 1) - at(x, y)).abs();
        }
    }
    let n = f64::from((w - 1) * (h - 1));
    (across / n, down / n)
}

#[test]
fn defocus_motion_and_fields_leave_their_marks() {
    let (cell, _) = at_goal();
    let goal = Workspace::paper().search_poses()[3];
    let quiet = Sensor {
        read_noise: 0.0,
        shot_noise: 0.0,
        ..Sensor::default()
    };
    let scene = Scene {
        sensor: quiet,
        ..Scene::laboratory()
    };
    let mut renderer = Renderer::new(&scene, 3);
    let sharp = roughness(renderer.render(&cell, &goal));
    let blurred = Scene {
        sensor: Sensor {
            defocus: 2.5,
            ..quiet
        },
        ..scene.clone()
    };
    let soft = roughness(Renderer::new(&blurred, 3).render(&cell, &goal));
    assert!(
        soft.0 < 0.8 * sharp.0 && soft.1 < 0.95 * sharp.1,
        "{soft:?} {sharp:?}"
    );
    // The arm turns about its waist: in the image that is motion along x.
    let turning = |t: f64| (cell, goal + JointDelta::of(puma_val2::Joint::J1, 0.3 * t));
    let smeared = roughness(renderer.take(
        &Shot {
            exposure: 0.02,
            moments: 8,
            interlace: None,
        },
        turning,
    ));
    assert!(smeared.0 < 0.85 * sharp.0, "{smeared:?} {sharp:?}");
    let combed = roughness(renderer.take(&Shot::pal(0.0, 1), turning));
    assert!(
        combed.1 > 1.15 * sharp.1 && combed.0 < 1.1 * sharp.0,
        "{combed:?} {sharp:?}"
    );
    // Each field is the frame of its moment.
    let frame = renderer.take(&Shot::pal(0.0, 1), turning).clone();
    for (first, t) in [(0, 0.0), (1, 0.020)] {
        let (cell, joints) = turning(t);
        let whole = renderer.render(&cell, &joints);
        let rows = (first..576).step_by(2).skip(2).take(280);
        let difference: f64 = rows
            .flat_map(|y| (0..768).map(move |x| (x, y)))
            .map(|(x, y)| {
                f64::from(frame.get_pixel(x, y).0[0].abs_diff(whole.get_pixel(x, y).0[0]))
            })
            .sum::<f64>()
            / (280.0 * 768.0);
        assert!(difference < 0.1, "{difference}");
    }
}

#[test]
fn noise_has_the_strength_asked_for() {
    let (cell, goal) = at_goal();
    let even = Scene {
        lights: Vec::new(),
        ambient: 0.5,
        table: Appearance::new(0.6, 0.0, 0.0),
        sensor: Sensor {
            read_noise: 3.0,
            shot_noise: 8.0,
            vignetting: 0.0,
            ..Sensor::default()
        },
        ..Scene::plain()
    };
    let mut renderer = Renderer::new(&even, 4);
    let (a, b) = (
        renderer.render(&cell, &goal).clone(),
        renderer.render(&cell, &goal).clone(),
    );
    // In a corner, away from ball and shadow: light 0.3, so variance 3² + 0.3 * 8² in each frame.
    let region = (0..120).flat_map(|y| (0..120).map(move |x| (x, y)));
    let differences: Vec<f64> = region
        .map(|(x, y)| f64::from(a.get_pixel(x, y).0[0]) - f64::from(b.get_pixel(x, y).0[0]))
        .collect();
    let deviation =
        (differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64 / 2.0).sqrt();
    let expected = (9.0_f64 + 0.3 * 64.0).sqrt();
    assert!(
        (deviation - expected).abs() < 0.08 * expected,
        "{deviation} against {expected}"
    );
}

#[test]
fn impossible_scenes_and_poses_do_not_fail() {
    let (mut cell, goal) = at_goal();
    let mut scene = Scene::laboratory();
    scene.lights.push(Light {
        toward: nalgebra::Vector3::zeros(),
        intensity: f64::NAN,
        half_angle: 9.0,
    });
    scene.things[0].x = f64::NAN;
    scene.things[1].shape = Shape::Box {
        length: -1.0,
        width: f64::INFINITY,
        height: 0.0,
    };
    for (thing, (length, width)) in
        scene.things[2..]
            .iter_mut()
            .zip([(0.1, 0.0), (0.1, -0.1), (f64::INFINITY, 0.1)])
    {
        thing.shape = Shape::Print {
            length,
            width,
            lines: u32::MAX,
        };
    }
    scene.sensor.gamma = -1.0;
    scene.sensor.defocus = f64::NAN;
    let mut renderer = Renderer::new(&scene, 5);
    renderer.render(&cell, &goal);
    renderer.render(&cell, &Joints([f64::NAN; 6]));
    // Under the table, upside down, inside the ball.
    renderer.render(
        &cell,
        &Joints::from_degrees([0.0, 40.0, 180.0, 0.0, 0.0, 0.0]),
    );
    renderer.render(
        &cell,
        &Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]),
    );
    cell.ball.centre = nalgebra::Point3::from(cell.camera_pose(&goal).translation.vector);
    renderer.render(&cell, &goal);
    assert!(
        renderer
            .truth(&cell, &goal)
            .iter()
            .all(|s| s.what != Round::Target)
    );
    cell.ball.centre.x = f64::NAN;
    renderer.render(&cell, &goal);
    assert!(cell.features(&goal).is_err() && cell.goal_pose(45.0).is_err());
}

#[test]
fn things_far_off_the_table_throw_no_shadow() {
    let (cell, joints) = (
        Cell::paper(Ball::at(0.6, 0.0, -0.1)),
        Workspace::paper().search_poses()[3],
    );
    let mut scene = Scene {
        things: Vec::new(),
        ..Scene::laboratory()
    };
    let bare = Renderer::new(&scene, 1).render(&cell, &joints).clone();
    let template = Scene::laboratory().things[0];
    for (x, y) in [
        (0.0, 1.0),
        (1.0, 0.0),
        (0.0, -1.0),
        (-1.0, 0.0),
        (1.0, 1.0),
        (-1.0, -1.0),
    ] {
        for far in [20.0, 1e6, 1e300] {
            scene.things.push(Thing {
                shape: Shape::Ball { radius: 0.02 },
                x: far * x,
                y: far * y,
                ..template
            });
        }
    }
    assert!(*Renderer::new(&scene, 1).render(&cell, &joints) == bare);
}
