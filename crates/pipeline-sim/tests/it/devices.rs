//! Camera and arm in the cell.

use hough_heuristic::image::GrayImage;
use hough_heuristic::{FrameError, FrameSource};
use nalgebra::Vector3;
use pipeline_sim::{
    Ball, Cell, CellCamera, Renderer, Scene, Sensor, SharedCell, Shot, SimulatedArm, Workspace,
};
use puma_val2::{ArmError, Gripper, Joint, JointDelta, Joints, Manipulator, ProximitySensor};

fn cell() -> SharedCell {
    SharedCell::new(Cell::paper(Ball::at(0.60, 0.15, -0.10)))
}

fn grabbed(camera: &mut impl FrameSource) -> GrayImage {
    let mut frame = GrayImage::default();
    camera.grab(&mut frame).expect("a frame");
    frame
}

#[test]
fn frames_follow_the_arm_and_repeat_with_the_seed() {
    let run = || {
        let cell = cell();
        let mut arm = SimulatedArm::new(cell.clone(), Workspace::paper().search_poses()[3])
            .expect("a search pose");
        let mut camera = CellCamera::new(cell, Renderer::new(&Scene::laboratory(), 5), arm.pose());
        let first = grabbed(&mut camera);
        let again = grabbed(&mut camera);
        arm.move_by(JointDelta::from_degrees([0.0, 6.0, -5.0, 0.0, 0.0, 0.0]))
            .expect("within limits");
        [first, again, grabbed(&mut camera)]
    };
    let (a, b) = (run(), run());
    assert!(a == b, "same seed, same frames");
    let changed = |p: usize, q: usize| {
        let pairs = a[p].iter().zip(a[q].iter());
        pairs.map(|(x, y)| f64::from(x.abs_diff(*y))).sum::<f64>() / a[p].len() as f64
    };
    let (noise, motion) = (changed(0, 1), changed(1, 2));
    assert!(
        (0.5..4.0).contains(&noise),
        "only the noise differs between two frames of one pose: {noise}"
    );
    assert!(motion > 3.0 * noise, "a move changes the picture: {motion}");
}

#[test]
fn impossible_moves_are_refused_without_a_motion() {
    let cell = cell();
    let start = Workspace::paper().search_poses()[3];
    let mut arm = SimulatedArm::new(cell.clone(), start).expect("a search pose");
    let before = arm.joints().expect("always");
    let too_far = JointDelta::from_degrees([0.0, 0.0, 30.0, 0.0, 0.0, 0.0]);
    assert!(matches!(
        arm.move_by(too_far),
        Err(ArmError::JointLimit { .. })
    ));
    let mut nowhere = before;
    nowhere.0[1] = f64::NAN;
    assert!(matches!(
        arm.move_to(nowhere),
        Err(ArmError::NotFinite { .. })
    ));
    assert_eq!(arm.joints().expect("always"), before);
    arm.set_gripper(Gripper::Closed).expect("always");
    assert_eq!(cell.get().jaws, Gripper::Closed);
    assert!(!arm.object_near().expect("always"));
    let mut lost = CellCamera::new(cell, Renderer::new(&Scene::plain(), 1), || {
        Joints([f64::NAN; 6])
    });
    assert!(matches!(
        lost.grab(&mut GrayImage::default()),
        Err(FrameError::Failed { .. })
    ));
}

#[test]
fn camera_and_arm_can_be_sent_to_another_thread() {
    fn sent<T: Send>(_: &T) {}
    let cell = cell();
    let arm = SimulatedArm::new(cell.clone(), Workspace::paper().search_poses()[0])
        .expect("a search pose");
    let camera = CellCamera::new(cell, Renderer::new(&Scene::plain(), 1), arm.pose());
    sent(&camera);
    sent(&arm);
}

/// A frame, without noise, of a camera that is exposed while the waist turns at `speed` degrees a
/// second.
fn exposed(shot: Shot, speed: f64) -> GrayImage {
    let mut scene = Scene::laboratory();
    scene.sensor = Sensor {
        read_noise: 0.0,
        shot_noise: 0.0,
        ..scene.sensor
    };
    let pose = Workspace::paper().search_poses()[3];
    let turned = move |cell: &Cell, joints: &Joints, t: f64| {
        (
            *cell,
            *joints + JointDelta::of(Joint::J1, speed.to_radians() * t),
        )
    };
    let mut camera = CellCamera::new(cell(), Renderer::new(&scene, 5), move || pose)
        .exposed(shot, turned)
        .expect("a sound shot");
    grabbed(&mut camera)
}

/// Mean difference of neighbours along rows and along columns: what motion along x takes from the
/// first, and fields add to the second.
fn detail(frame: &GrayImage) -> (f64, f64) {
    let (w, h) = frame.dimensions();
    let at = |x: u32, y: u32| f64::from(frame.get_pixel(x, y).0[0]);
    let (mut across, mut down) = (0.0, 0.0);
    for (x, y) in (0..h - 1).flat_map(|y| (0..w - 1).map(move |x| (x, y))) {
        across += (at(x + 1, y) - at(x, y)).abs();
        down += (at(x, y + 1) - at(x, y)).abs();
    }
    let n = f64::from(w * h);
    (across / n, down / n)
}

#[test]
fn exposures_blur_motion_and_fields_comb_it() {
    let exposure = |seconds: f64| Shot {
        exposure: seconds,
        moments: 8,
        interlace: None,
    };
    let (sharp, resting) = (exposed(Shot::still(), 0.0), exposed(exposure(0.02), 0.0));
    let apart = |a: &GrayImage, b: &GrayImage| {
        a.iter()
            .zip(b.iter())
            .map(|(p, q)| f64::from(p.abs_diff(*q)))
            .sum::<f64>()
            / a.len() as f64
    };
    // Nothing moves: an exposure changes next to nothing. A turning waist does, and along the rows.
    assert!(apart(&sharp, &resting) < 0.5, "{}", apart(&sharp, &resting));
    let (still, blurred) = (detail(&sharp), detail(&exposed(exposure(0.02), 30.0)));
    assert!(blurred.0 < 0.8 * still.0, "{still:?} {blurred:?}");
    let combed = detail(&exposed(Shot::pal(0.002, 4), 60.0));
    assert!(combed.1 > 1.2 * still.1, "{still:?} {combed:?}");
}

#[test]
fn blurred_ball_is_centred_on_the_middle_of_its_exposure() {
    // A bright ball that rolls by: its blurred picture lies around the sharp one.
    let mut scene = Scene::plain();
    scene.ball.albedo = 0.95;
    let middle = |exposed: bool| {
        let shared = cell();
        let pose = shared.get().goal_pose(45.0).expect("within reach");
        let rolling = |cell: &Cell, joints: &Joints, t: f64| {
            let mut cell = *cell;
            cell.place_ball(cell.ball.centre + Vector3::new(0.0, 0.5 * t, 0.0));
            (cell, *joints)
        };
        let shot = Shot {
            exposure: 0.02,
            moments: 16,
            interlace: None,
        };
        let mut camera = CellCamera::new(shared, Renderer::new(&scene, 5), move || pose);
        if exposed {
            camera = camera.exposed(shot, rolling).expect("a sound shot");
        }
        let frame = grabbed(&mut camera);
        let bright = |p: &u8| f64::from(p.saturating_sub(150));
        let sum: f64 = frame.iter().map(bright).sum();
        let rows = frame
            .enumerate_pixels()
            .map(|(x, _, p)| f64::from(x) * bright(&p.0[0]));
        (rows.sum::<f64>() / sum, detail(&frame).0)
    };
    let (sharp, blurred) = (middle(false), middle(true));
    // The ball moves by 10 mm, 65 pixels; from one end of the exposure to its middle would be half
    // of that.
    assert!(
        (sharp.0 - blurred.0).abs() < 6.0 && blurred.1 < sharp.1,
        "{sharp:?} {blurred:?}"
    );
}

#[test]
fn impossible_exposures_are_refused() {
    let pose = Workspace::paper().search_poses()[3];
    let camera = || CellCamera::new(cell(), Renderer::new(&Scene::plain(), 5), move || pose);
    let shot = Shot {
        exposure: -1.0,
        ..Shot::still()
    };
    let still = |cell: &Cell, joints: &Joints, _: f64| (*cell, *joints);
    let refused = camera().exposed(shot, still).expect_err("no exposure");
    assert!(refused.to_string().contains("exposure time"), "{refused}");
    let nowhere = |cell: &Cell, joints: &Joints, _: f64| {
        (*cell, *joints + JointDelta::of(Joint::J2, f64::NAN))
    };
    let mut camera = camera()
        .exposed(Shot::pal(0.01, 4), nowhere)
        .expect("a sound shot");
    let Err(FrameError::Failed { reason, .. }) = camera.grab(&mut GrayImage::default()) else {
        panic!("no such speed");
    };
    assert!(reason.contains("JT2"), "{reason}");
}
