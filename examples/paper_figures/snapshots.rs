//! Figure 9: the pose of the arm and the camera's view at four moments of a reach.

use grasp_agent::{Agent, AgentConfig, CameraModel, EventKind, Learned, Sighting};
use hough_heuristic::image::GrayImage;
use hough_heuristic::{Canny, CannyConfig, EdgeDetector};
use image::RgbImage;
use image::imageops::{FilterType, replace, resize};
use nalgebra::{Point3, Rotation3, Vector3};
use pipeline_sim::{Ball, Scene, Workspace};
use puma_grasp::{BallDetector, Rig};
use puma_val2::{Joint, Joints, PumaParams};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;

use example_support::overlay::{CAPTION, Overlay, Rgb888};
use example_support::prelude::*;
use example_support::trial::ball_in_view;

/// Size of each picture, below its caption.
const TILE: (u32, u32) = (384, 288);
/// Pixels per metre, and the shoulder's place, in the drawing of the pose.
const SCALE: f64 = 290.0;
const SHOULDER: (f64, f64) = (80.0, 165.0);

/// A moment of the reach.
struct Moment {
    frame: GrayImage,
    sighting: Sighting,
    joints: Joints,
    moves: usize,
}

/// Draws four columns, from the first sighting to the goal, of three rows: the pose from the side,
/// the frame with the circle, its edges.
pub(crate) fn snapshots(learned: &Learned, seed: u64) -> Outcome<RgbImage> {
    let mut rig = Rig::emulated(false, &Scene::bright_ball(), seed, &STOP)?;
    let mut detector = BallDetector::default().build(seed)?;
    let config = AgentConfig::paper(Workspace::paper().search_poses());
    let mut agent = Agent::with_controller(config, learned.clone())?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let ball = ball_in_view(rig.cell(), &mut rng)?;
    rig.place(&ball)?;
    let table = rig.cell().get().table;
    let (mut moments, mut gripped) = (Vec::new(), false);
    rig.run(&mut agent, &mut *detector, &mut |event| {
        gripped |= event.kind == EventKind::Gripped;
        if let (EventKind::Seen(sighting), Some(frame), false) = (&event.kind, event.frame, gripped)
        {
            moments.push(Moment {
                frame: frame.clone(),
                sighting: *sighting,
                joints: event.joints,
                moves: event.cycle,
            });
        }
    })?;
    let last = moments
        .len()
        .checked_sub(1)
        .ok_or("the ball was never seen")?;
    let mut sheet = RgbImage::from_pixel(4 * TILE.0, 3 * (TILE.1 + CAPTION), image::Rgb([255; 3]));
    for column in 0..4_usize {
        let moment = &moments[column * last / 3];
        let rows = [pose(moment, &ball, table), seen(moment), edges(moment)?];
        for (row, picture) in (0_u32..).zip(rows) {
            let at = (column as u32 * TILE.0, row * (TILE.1 + CAPTION));
            replace(&mut sheet, &picture, at.0.into(), at.1.into());
        }
    }
    Ok(sheet)
}

/// Draws the arm from the side, in the plane that it moves in.
fn pose(moment: &Moment, ball: &Ball, table: f64) -> RgbImage {
    let (dark, blue) = (Rgb888::new(60, 60, 75), Rgb888::new(30, 90, 180));
    let (model, joints) = (CameraModel::paper(), &moment.joints);
    let into_plane = Rotation3::from_axis_angle(&Vector3::z_axis(), -joints[Joint::J1]);
    let at = |point: Point3<f64>| {
        let point = into_plane * point;
        (SHOULDER.0 + SCALE * point.x, SHOULDER.1 - SCALE * point.z)
    };
    let wrist = model.arm.wrist(joints);
    let camera = wrist * model.mount;
    let (sin, cos) = joints[Joint::J2].sin_cos();
    let upper = PumaParams::unimation().a2;
    let elbow = into_plane.inverse() * Point3::new(upper * cos, 0.0, -upper * sin);
    let ground = RgbImage::from_pixel(TILE.0, TILE.1, image::Rgb([250, 250, 252]));
    let mut drawing = Overlay::from(ground);
    let surface = SHOULDER.1 - SCALE * table;
    let right = (f64::from(TILE.0), surface);
    drawing.line((0.0, surface), right, Rgb888::new(170, 140, 100), 3);
    drawing.line(SHOULDER, (SHOULDER.0, surface), dark, 12);
    // The upper and the lower border of the camera's view.
    let slope = 0.5 * 144.0 / model.focal;
    for border in [-slope, slope] {
        let far = camera * Point3::new(0.0, 0.55 * border, 0.55);
        let eye = camera * Point3::origin();
        drawing.line(at(eye), at(far), Rgb888::new(190, 205, 230), 1);
    }
    let [wrist, camera] = [wrist, camera].map(|pose| at(pose * Point3::origin()));
    drawing.line(SHOULDER, at(elbow), blue, 9);
    drawing.line(at(elbow), wrist, blue, 7);
    drawing.line(wrist, at(model.tool_point(joints)), dark, 4);
    drawing.disc(camera, 5.0, Rgb888::new(20, 130, 60));
    drawing.disc(
        at(ball.centre),
        SCALE * ball.radius,
        Rgb888::new(220, 110, 20),
    );
    let [j1, j2, j3, ..] = joints.degrees();
    drawing.captioned(&format!(
        "move {}: {j1:.0} {j2:.0} {j3:.0} deg",
        moment.moves
    ))
}

fn seen(moment: &Moment) -> RgbImage {
    let mut overlay = Overlay::new(&moment.frame);
    let f = moment.sighting.features;
    overlay.circle(&f.to_circle(moment.frame.width()));
    let small = resize(&overlay.into_image(), TILE.0, TILE.1, FilterType::Triangle);
    Overlay::from(small).captioned(&format!("x {:.1} y {:.1} r {:.1}", f.x, f.y, f.r))
}

fn edges(moment: &Moment) -> Outcome<RgbImage> {
    let mut canny = Canny::new(CannyConfig {
        low: 20.0,
        high: 50.0,
        ..CannyConfig::default()
    })?;
    // Drawn at half size, so that the thin lines stay bright.
    let mut image = RgbImage::new(TILE.0, TILE.1);
    for pixel in canny.detect_edges(&moment.frame).pixels() {
        let (x, y) = (
            pixel.x * TILE.0 / moment.frame.width().max(1),
            pixel.y * TILE.1 / moment.frame.height().max(1),
        );
        image.put_pixel(x, y, image::Rgb([255; 3]));
    }
    Ok(Overlay::from(image).captioned("edges"))
}
