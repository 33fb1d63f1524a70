//! An emulated controller on a TCP socket, and a client that connects to it.
//!
//! ```text
//! cargo run -p puma-val2 --example tcp_emulator
//! ```
#![allow(clippy::print_stdout)] // Output of a program.

use std::error::Error;
use std::time::Duration;

use puma_val2::{
    ClientConfig, Emulator, EmulatorServer, Joint, JointDelta, Manipulator, Profile, PumaParams,
    ServeConfig, TcpLine, Val2Client,
};

fn main() -> Result<(), Box<dyn Error>> {
    let controller = Emulator::new(PumaParams::unimation(), Profile::val2());
    let server = EmulatorServer::tcp("127.0.0.1:0", controller, ServeConfig::default())?;
    println!("serving on {}", server.address());

    let line = TcpLine::connect(server.address(), Duration::from_secs(5))?;
    let mut arm = Val2Client::connect(line, ClientConfig::for_emulator())?;
    arm.calibrate()?;
    let reported = arm.move_by(JointDelta::of(Joint::J1, 0.5))?;
    let stands = server.with_emulator(|emulator| emulator.joints());
    println!("the client says {reported}, the arm stands at {stands}");
    Ok(())
}
