//! Forward and inverse kinematics: the eight postures that reach one pose of the hand.
//!
//! ```text
//! cargo run -p puma-val2 --example kinematics
//! ```
#![allow(clippy::print_stdout)] // Output of a program.

use puma_val2::{Joints, PumaParams, Unreachable, Xyzoat};

fn main() -> Result<(), Unreachable> {
    let arm = PumaParams::unimation();
    let joints = Joints::from_degrees([10.0, -60.0, 150.0, 20.0, 40.0, -30.0]);
    let hand = arm.forward(&joints);
    println!("joints {joints}\nhand   {}\n", Xyzoat::from_pose(&hand));

    for solution in arm.inverse(&hand)? {
        let fits = if arm.check(&solution.joints).is_ok() {
            "in range"
        } else {
            ""
        };
        let posture = solution.configuration.to_string();
        println!("{posture:<21} {} {fits}", solution.joints);
    }
    let nearest = arm.inverse_near(&hand, &Joints::READY, None)?;
    println!("\nnearest to READY      {nearest}");

    let jacobian = arm.jacobian(&joints);
    println!("determinant of the Jacobian {:.4}", jacobian.determinant());
    if let Some(singularity) = arm.singularity(&Joints::READY, 0.02) {
        println!("READY is singular: {singularity:?}");
    }
    Ok(())
}
