//! Any bytes as what a controller says to a client, whatever it is asked.
#![no_main]

use std::io;
use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use puma_val2::{ClientConfig, Gripper, Joint, JointDelta, Manipulator, Transport, Val2Client};

/// The bytes, some at a time; then silence.
struct Script<'a>(&'a [u8], Duration);

impl Transport for Script<'_> {
    fn send(&mut self, _: &[u8]) -> io::Result<()> {
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        // The first byte of a piece says how long it is, and whether there is a silence instead.
        let Some((&head, rest)) = self.0.split_first() else {
            self.1 += timeout;
            return Ok(None);
        };
        let count = usize::from(head % 64).min(rest.len()).min(buffer.len());
        self.0 = &rest[count..];
        if head >= 192 || count == 0 {
            self.1 += timeout;
            return Ok(None);
        }
        self.1 += timeout.min(Duration::from_millis(1));
        buffer[..count].copy_from_slice(&rest[..count]);
        Ok(Some(count))
    }

    fn clock(&self) -> Duration {
        self.1
    }

    fn name(&self) -> &str {
        "script"
    }
}

fuzz_target!(|data: &[u8]| {
    let Ok(mut client) = Val2Client::connect(Script(data, Duration::ZERO), ClientConfig::default())
    else {
        return;
    };
    let step = JointDelta::of(Joint::J1, 0.1);
    let _ = client.calibrate();
    let _ = client.joints();
    let _ = client.move_by(step);
    let _ = client.set_gripper(Gripper::Closed);
    let _ = client.signal(1001);
    if let Ok(mut resident) = client.resident() {
        let _ = resident.move_by(step);
    }
    let _ = client.arm_proximity(1001);
    let _ = client.move_by(step);
    assert!(client.take_notices().len() <= 100);
    assert!(client.line().clock() < Duration::from_secs(100_000));
});
