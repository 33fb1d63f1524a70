//! Camera and arm in the cell.

use hough_heuristic::image::GrayImage;
use hough_heuristic::{FrameError, FrameSource};
use nalgebra::Vector3;
use pipeline_sim::{
    Ball, Cell, CellCamera, Renderer, Scene, SharedCell, Shot, SimulatedArm, Workspace,
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
        let rows = frame.enumerate_pixels();
        let columns = rows.map(|(x, _, p)| f64::from(x) * bright(&p.0[0]));
        let brightest = frame.iter().filter(|p| **p > 200).count();
        (columns.sum::<f64>() / sum, brightest)
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
