//! The cell behind the doors of camera and arm.

use hough_heuristic::{FrameError, FrameSource};
use pipeline_sim::{Ball, Cell, CellCamera, Renderer, Scene, SharedCell, SimulatedArm, Workspace};
use puma_val2::{ArmError, Gripper, JointDelta, Joints, Manipulator, ProximitySensor};

fn cell() -> SharedCell {
    SharedCell::new(Cell::paper(Ball::at(0.60, 0.15, -0.10)))
}

#[test]
fn frames_follow_the_arm_and_repeat_with_the_seed() {
    let run = || {
        let cell = cell();
        let mut arm =
            SimulatedArm::new(cell.clone(), Workspace::paper().search_poses()[3]).expect("a search pose");
        let mut camera = CellCamera::new(cell, Renderer::new(&Scene::laboratory(), 5), arm.pose());
        let first = camera.grab().expect("a frame");
        let again = camera.grab().expect("a frame");
        arm.move_by(JointDelta::from_degrees([0.0, 6.0, -5.0, 0.0, 0.0, 0.0]))
            .expect("within limits");
        [first, again, camera.grab().expect("a frame")]
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
fn impossible_moves_are_refused_and_nothing_moves() {
    let mut arm = SimulatedArm::new(cell(), Workspace::paper().search_poses()[3]).expect("a search pose");
    let before = arm.joints().expect("always");
    let too_far = JointDelta::from_degrees([0.0, 0.0, 30.0, 0.0, 0.0, 0.0]);
    assert!(matches!(arm.move_by(too_far), Err(ArmError::JointLimit { .. })));
    let mut nowhere = before;
    nowhere.0[1] = f64::NAN;
    assert!(matches!(arm.move_to(nowhere), Err(ArmError::NotFinite { .. })));
    assert_eq!(arm.joints().expect("always"), before);
    arm.set_gripper(Gripper::Closed).expect("always");
    assert_eq!(arm.gripper(), Gripper::Closed);
    assert!(!arm.object_near().expect("always"));
    let mut lost = CellCamera::new(cell(), Renderer::new(&Scene::plain(), 1), || {
        Joints([f64::NAN; 6])
    });
    assert!(matches!(lost.grab(), Err(FrameError::Failed { .. })));
}

#[test]
fn camera_and_arm_can_be_sent_to_another_thread() {
    fn sent<T: Send>(_: &T) {}
    let cell = cell();
    let arm = SimulatedArm::new(cell.clone(), Workspace::paper().search_poses()[0]).expect("a search pose");
    let camera = CellCamera::new(cell, Renderer::new(&Scene::plain(), 1), arm.pose());
    sent(&camera);
    sent(&arm);
}
