//! A line that never falls silent: every call ends in time, with an error that has a type.

use std::io;
use std::time::Duration;

use puma_val2::{
    ArmError, ClientConfig, Emulator, Gripper, Joint, JointDelta, Manipulator, MemoryLine, MoveWay,
    Profile, PumaParams, Transport, Val2Client,
};

/// A line on which, from some time on, these bytes come again and again, one every so often,
/// whatever is sent.
struct Babbling {
    inner: MemoryLine,
    words: &'static [u8],
    every: Duration,
    /// When it begins, by its own clock.
    from: Option<Duration>,
    late: Duration,
    said: usize,
}

impl Babbling {
    fn new(words: &'static [u8], every: Duration) -> Self {
        Self {
            inner: MemoryLine::new(Emulator::new(PumaParams::unimation(), Profile::val2())),
            words,
            every,
            from: None,
            late: Duration::ZERO,
            said: 0,
        }
    }

    fn babbles(&self) -> bool {
        self.from.is_some_and(|from| self.clock() >= from)
    }
}

impl Transport for Babbling {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.inner.send(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        if !self.babbles() {
            return self.inner.receive(buffer, timeout);
        }
        if timeout < self.every {
            self.late += timeout;
            return Ok(None);
        }
        self.late += self.every;
        buffer[0] = self.words[self.said % self.words.len()];
        self.said += 1;
        Ok(Some(1))
    }

    fn clock(&self) -> Duration {
        self.inner.clock() + self.late
    }

    fn name(&self) -> &str {
        "babbling"
    }
}

type Call = (
    &'static str,
    fn(&mut Val2Client<Babbling>) -> Result<(), ArmError>,
);

const CALLS: [Call; 9] = [
    ("joints", |c| c.joints().map(drop)),
    ("set_speed", |c| c.set_speed(30.0)),
    ("move_by", |c| {
        c.move_by(JointDelta::of(Joint::J1, 0.3)).map(drop)
    }),
    ("drive", |c| c.drive(Joint::J2, 0.3, 50.0).map(drop)),
    ("set_gripper", |c| c.set_gripper(Gripper::Closed)),
    ("signal", |c| c.signal(1001).map(drop)),
    ("arm_proximity", |c| c.arm_proximity(1001)),
    ("resident", |c| c.resident().map(drop)),
    ("execute", |c| c.execute("NOTHING").map(drop)),
];

#[test]
fn every_call_on_a_line_that_babbles_ends_in_time() {
    let words: [&[u8]; 7] = [
        b"\0",
        b"\x07\0",
        b"\r\n.",
        b".",
        b"x",
        b"?\r\n",
        b"\xff\x81\r\n*\r\n",
    ];
    for words in words {
        for every in [1, 20] {
            for (name, call) in CALLS {
                let context = format!("{name} while {words:?} comes every {every} ms");
                let config = ClientConfig {
                    way: MoveWay::Automatic,
                    motion_timeout: Duration::from_secs(20),
                    ..ClientConfig::default()
                };
                let line = Babbling::new(words, Duration::from_millis(every));
                let mut client = Val2Client::connect(line, config).unwrap();
                client.calibrate().unwrap();
                client.joints().unwrap();
                // In the middle of the call rather than before it.
                let begun = client.line().clock();
                client.line_mut().from = Some(begun + Duration::from_millis(35));
                let outcome = call(&mut client);
                let took = client.line().clock() - begun;
                assert!(took < Duration::from_secs(400), "{context}: {took:?}");
                if client.line().babbles() {
                    assert!(client.take_notices().len() <= 100);
                    client.stop().ok();
                    let took = client.line().clock() - begun;
                    assert!(took < Duration::from_secs(500), "{context}: {took:?}");
                    if client.line().said > 0 && name != "arm_proximity" && name != "resident" {
                        assert!(
                            matches!(
                                outcome,
                                Err(ArmError::Garbled { .. }
                                    | ArmError::Silence { .. }
                                    | ArmError::Unconfirmed { .. })
                                    | Ok(())
                            ),
                            "{context}: {outcome:?}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn connecting_to_a_line_that_babbles_ends_in_time() {
    for words in [&b"\0"[..], b"\r\n.", b"?", b"(Y/N)? ", b"abc"] {
        let mut line = Babbling::new(words, Duration::from_millis(5));
        line.from = Some(Duration::ZERO);
        let outcome = Val2Client::connect(line, ClientConfig::default()).map(drop);
        assert_matches!(
            outcome,
            Err(ArmError::Garbled { .. } | ArmError::Silence { .. }),
            "{words:?}"
        );
    }
}
