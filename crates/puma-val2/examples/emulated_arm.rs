//! A client moves an emulated arm: calibration, moves, a signal, the hand.
//!
//! ```text
//! cargo run -p puma-val2 --example emulated_arm
//! ```
#![allow(clippy::print_stdout)] // Output of a program.

use puma_val2::{
    ArmError, ClientConfig, Emulator, Gripper, JointDelta, Joints, Manipulator, MemoryLine,
    Profile, PumaParams, Val2Client,
};

fn main() -> Result<(), ArmError> {
    let controller = Emulator::new(PumaParams::unimation(), Profile::val2());
    let mut arm = Val2Client::connect(MemoryLine::new(controller), ClientConfig::default())?;
    arm.calibrate()?;
    println!("calibrated at {}", arm.joints()?);

    let reached = arm.move_to(Joints::from_degrees([20.0, -60.0, 150.0, 0.0, 40.0, 0.0]))?;
    println!("moved to      {reached}");
    let reached = arm.move_by(JointDelta::from_degrees([0.0, 5.0, -5.0, 0.0, 0.0, 0.0]))?;
    println!("moved on to   {reached}");
    println!("hand at       {}", arm.where_()?.hand);
    arm.set_gripper(Gripper::Closed)?;
    println!("input 1001 on: {}", arm.signal(1001)?);

    // A goal out of range is refused before anything is sent.
    let refused = arm.move_by(JointDelta::from_degrees([200.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    if let Err(error) = refused {
        println!("refused: {error}");
    }
    Ok(())
}
