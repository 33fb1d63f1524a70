//! The truth of a frame: visible fractions, and things that hide others.

use nalgebra::{Point2, Point3, Vector3};
use pipeline_sim::{
    Appearance, Ball, Cell, Distortion, Occluder, ProjectedEllipse, Recipe, Renderer, Round, Scene,
    Shape, Thing, Workspace,
};
use puma_val2::{JointDelta, Joints};

use crate::{at_goal, rng};

#[test]
fn truth_knows_what_hides_the_ball() {
    let (cell, goal) = at_goal();
    let target = |scene: &Scene| {
        let truth = Renderer::new(scene, 1).truth(&cell, &goal);
        assert_eq!(truth[0].what, Round::Target);
        truth[0]
    };
    let free = target(&Scene::plain());
    assert!(free.visible > 0.99, "{}", free.visible);
    assert_eq!(Ok(free.ellipse.circle()), cell.circle(&goal));
    // A strip of 20 units over the middle of a circle of radius 33.
    let ProjectedEllipse { centre, .. } = free.ellipse;
    let (x, y) = ((centre.x + 0.5) / 4.0, (centre.y + 0.5) / 4.0);
    let strip = Occluder {
        from: Point2::new(x, y - 100.0),
        to: Point2::new(x, y + 100.0),
        width: 20.0,
        softness: 2.0,
        albedo: 0.2,
    };
    let hidden = target(&Scene {
        occluders: vec![strip],
        ..Scene::plain()
    });
    let t = 10.0_f64 / 33.0;
    let expected = 1.0 - 2.0 / std::f64::consts::PI * (t.asin() + t * (1.0 - t * t).sqrt());
    assert!(
        (hidden.visible - expected).abs() < 0.02,
        "{} against {expected}",
        hidden.visible
    );
    // Half out of the frame.
    let mut cut = goal;
    let mut share = 1.0;
    let renderer = Renderer::new(&Scene::plain(), 1);
    while share > 0.6 {
        cut = cut + JointDelta::from_degrees([0.1, 0.0, 0.0, 0.0, 0.0, 0.0]);
        share = renderer
            .truth(&cell, &cut)
            .first()
            .map_or(0.0, |s| s.visible);
    }
    assert!((0.5..=0.6).contains(&share), "{share}");
}

/// Returns a dull thing.
fn thing(shape: Shape, x: f64, y: f64) -> Thing {
    let appearance = Appearance::new(0.5, 0.0, 0.0);
    Thing {
        shape,
        x,
        y,
        turn: 0.3,
        appearance,
    }
}

/// Returns the visible part of the first outline of a kind among things on a bare table; 0 if there
/// is none.
fn visible(what: Round, things: &[Thing], cell: &Cell, pose: &Joints) -> f64 {
    let scene = Scene {
        things: things.to_vec(),
        ..Scene::plain()
    };
    let truth = Renderer::new(&scene, 1).truth(cell, pose);
    let first = truth.iter().find(|outline| outline.what == what);
    first.map_or(0.0, |outline| outline.visible)
}

#[test]
fn nearer_things_hide_farther_ones() {
    // A tall cylinder between the camera and a low ball on the table.
    let (cell, _) = at_goal();
    let pose = Workspace::paper().search_poses()[3];
    let ball = thing(Shape::Ball { radius: 0.03 }, 0.80, 0.0);
    let camera = cell.camera_pose(&pose).translation.vector;
    let y = 0.053 * camera.y / (0.80 - camera.x);
    let post = |x| {
        let (radius, height) = (0.02, 0.10);
        thing(Shape::Cylinder { radius, height }, x, y)
    };
    let seen = |things: &[Thing]| visible(Round::Ball, things, &cell, &pose);
    assert!(seen(&[ball]) > 0.95);
    assert!(seen(&[post(0.80 - 0.053), ball]) < 0.7);
    assert!(seen(&[post(0.80 + 0.09), ball]) > 0.95);
}

#[test]
fn ball_over_a_box_hides_it_and_behind_it_is_hidden() {
    let (mut cell, goal) = at_goal();
    cell.holder = None;
    let shape = Shape::Box {
        length: 0.10,
        width: 0.08,
        height: 0.05,
    };
    // The box under the ball reaches nearer to the camera than the ball does.
    let (ball, eye) = (cell.ball.centre, cell.camera_pose(&goal).translation.vector);
    let toward = (eye.xy() - ball.coords.xy()).normalize();
    for nearer in [0.0, 0.02, 0.05, 0.07] {
        let (x, y) = (ball.x + nearer * toward.x, ball.y + nearer * toward.y);
        let seen = visible(Round::Target, &[thing(shape, x, y)], &cell, &goal);
        assert!(seen > 0.98, "{nearer}: {seen}");
    }
    // A ball on the table close behind a tall box, as seen from a search pose, is hidden by it.
    let pose = Workspace::paper().search_poses()[3];
    let eye = cell.camera_pose(&pose).translation.vector;
    let mut low = cell;
    low.ball.centre = Point3::new(0.75, 0.15, cell.table + 0.02);
    let toward = (eye.xy() - low.ball.centre.coords.xy()).normalize();
    let tall = Shape::Box {
        length: 0.05,
        width: 0.05,
        height: 0.09,
    };
    let before = thing(tall, 0.75 + 0.06 * toward.x, 0.15 + 0.06 * toward.y);
    let seen = visible(Round::Target, &[before], &low, &pose);
    assert!(seen < 0.7, "{seen}");
}

#[test]
fn holder_without_its_ball_keeps_its_place() {
    // The ball has been put down near the camera; between its holder and the camera stands a
    // cylinder.
    let pose = Workspace::paper().search_poses()[3];
    let mut cell = Cell::paper(Ball::at(0.75, 0.15, -0.24));
    let eye = cell.camera_pose(&pose).translation.vector;
    let foot = cell.ball.centre.xy();
    let toward = (eye.xy() - foot.coords).normalize();
    let (x, y) = (foot.x + 0.05 * toward.x, foot.y + 0.05 * toward.y);
    cell.ball.centre = Point3::new(
        foot.x + 0.25 * toward.x,
        foot.y + 0.25 * toward.y,
        cell.table + 0.02,
    );
    let (radius, height) = (0.02, 0.08);
    let post = thing(Shape::Cylinder { radius, height }, x, y);
    let top = |cell: &Cell| visible(Round::Top, &[post], cell, &pose);
    assert!(top(&cell) > 0.99, "{}", top(&cell));
    // In front of it, the holder does hide it.
    let mut before = cell;
    if let Some(holder) = &mut before.holder {
        holder.foot += 0.10 * toward;
        holder.top = -0.05;
    }
    assert!(top(&before) < 0.9, "{}", top(&before));
}

#[test]
fn visible_share_is_the_counted_one_at_bent_borders() {
    let lens = Distortion {
        k1: -0.30,
        k2: 0.06,
        ..Distortion::default()
    };
    let paper = pipeline_sim::Camera::paper();
    let bent = paper.with_distortion(lens).expect("does not fold");
    let small = paper.resized(192, 144).expect("a usable size");
    let (cell, goal) = at_goal();
    let renderer = Renderer::new(&Scene::plain(), 1);
    for camera in [paper, small, bent] {
        let mut cell = cell;
        cell.camera = camera;
        cell.holder = None;
        let (width, height) = (f64::from(camera.size().0), f64::from(camera.size().1));
        // What is large and bent is no ellipse any more.
        let most = if *camera.distortion() == Distortion::default() {
            0.2
        } else {
            0.06
        };
        for radius in [0.012, 0.02, 0.06, most] {
            // The centre on the right border, in a corner, and a little above the bottom.
            for (x, y) in [
                (width, 0.5 * height),
                (0.0, 0.0),
                (0.3 * width, height - 0.02 * width),
            ] {
                let circle = hough_heuristic::Circle {
                    x: x - 0.5,
                    y: y - 0.5,
                    radius: radius * width,
                };
                let place = camera
                    .sphere_of_circle(&circle, cell.ball.radius)
                    .expect("some place shows it");
                cell.ball.centre = cell.camera_pose(&goal) * place;
                let truth = renderer.truth(&cell, &goal);
                let outline = truth[0].ellipse;
                // Points spread evenly over the outlined area.
                let n = 4000;
                let inside = (0..n).filter(|k| {
                    let share = (f64::from(*k) + 0.5) / f64::from(n);
                    let rim = outline.point(f64::from(*k) * 2.399_963) - outline.centre;
                    let p = outline.centre + rim * share.sqrt();
                    (-0.5..=width - 0.5).contains(&p.x) && (-0.5..=height - 0.5).contains(&p.y)
                });
                let counted = inside.count() as f64 / f64::from(n);
                assert!(
                    (truth[0].visible - counted).abs() < 0.015,
                    "{:?} {circle:?}: {} against {counted}",
                    camera.size(),
                    truth[0].visible
                );
            }
        }
    }
}

#[test]
fn truth_of_distorted_frames_agrees_with_their_rays() {
    let mut rng = rng(3);
    let recipe = Recipe::named("distorted").expect("a recipe");
    let mut rows = 0;
    for _ in 0..2 {
        let drawn = recipe.draw((768, 576), &mut rng);
        let (renderer, _) = drawn.expect("a frame of pixels");
        let scene = renderer.scene();
        for _ in 0..12 {
            let drawn = recipe.draw_again((768, 576), &mut rng).expect("a frame");
            let snapshot = drawn.expect("scenes are shared");
            let cell = &snapshot.cell;
            let pose = cell.camera_pose(&snapshot.joints);
            let eye = Point3::from(pose.translation.vector);
            for row in snapshot.truth(&renderer) {
                rows += 1;
                let ray = cell.camera.ray(row.ellipse.centre);
                let ray = pose
                    * ray
                        .expect("the lens shows the middle of what is seen")
                        .normalize();
                // How far the ray passes a ball, and where it meets a level.
                let passes = |centre: Point3<f64>| (centre - eye).cross(&ray).norm();
                let meets = |z: f64| eye + ray * ((z - eye.z) / ray.z);
                let met = if row.what == Round::Target {
                    passes(cell.ball.centre) < cell.ball.radius
                } else {
                    scene.things.iter().any(|thing| {
                        let at = Point3::new(thing.x, thing.y, cell.table);
                        let on = |z: f64| (meets(cell.table + z) - at).xy().norm();
                        match thing.shape {
                            Shape::Ball { radius } => passes(at + Vector3::z() * radius) < radius,
                            Shape::Disc { radius, .. } => on(0.0) < radius,
                            Shape::Cylinder { radius, height } => on(height) < radius,
                            _ => false,
                        }
                    })
                };
                assert!(met, "{snapshot:?}: {row:?}");
            }
        }
    }
    assert!(rows > 40, "{rows}");
}
