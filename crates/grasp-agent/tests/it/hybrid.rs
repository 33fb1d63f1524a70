//! The hybrid finds out what is wrong with the camera, and aims its grip by it.

use grasp_agent::nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use grasp_agent::{Agent, CameraModel, EventLog, Hybrid, HybridSettings};

use crate::cell::{Fault, Shared, config};

#[test]
fn the_camera_is_learned_from_moves_alone() {
    let nominal = CameraModel::paper();
    let off = Isometry3::from_parts(
        Translation3::new(0.01, -0.015, 0.01),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.08, -0.06, 0.1)),
    );
    let truth = CameraModel {
        focal: nominal.focal * 1.2,
        mount: nominal.mount * off,
        ball_radius: nominal.ball_radius * 0.9,
        ..nominal
    };
    let mut agent = Agent::with_controller(config(), Hybrid::new(HybridSettings::paper())).unwrap();
    for run in 0..40 {
        let azimuth = 0.04 * f64::from(run) - 0.8;
        let rho = 0.55 + 0.005 * f64::from(run % 20);
        let ball = [
            rho * azimuth.cos(),
            rho * azimuth.sin(),
            -0.15 + 0.01 * f64::from(run % 13),
        ];
        let cell = Shared::new(truth, ball, Fault::None);
        let outcome = cell.run(&mut agent, &mut EventLog::default()).unwrap();
        if run >= 20 && outcome.gave_up.is_none() {
            assert!(outcome.cycles <= 8, "run {run}: {outcome:?}");
            assert!(cell.miss() < 0.004, "run {run}: {}", cell.miss());
        }
    }
    let learned = agent.controller().belief().corrected(&nominal);
    assert!(
        (learned.focal / truth.focal - 1.0).abs() < 0.01,
        "{}",
        learned.focal
    );
    assert!(
        (learned.ball_radius / truth.ball_radius - 1.0).abs() < 0.02,
        "{}",
        learned.ball_radius
    );
    let off = learned.mount.inverse() * truth.mount;
    assert!(
        off.rotation.angle() < 0.02 && off.translation.vector.norm() < 0.003,
        "{off}"
    );
}
