//! The client itself against bytes of any kind: no panic, no endless wait, bounded memory.

use std::io;
use std::time::Duration;

use proptest::prelude::*;
use puma_val2::{
    ClientConfig, Emulator, Gripper, Joint, JointDelta, Joints, Manipulator, MemoryLine, MoveWay,
    Profile, PumaParams, Transport, Val2Client, Xyzoat,
};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// A line to an emulated controller on which, once let loose, what comes has nothing to do with
/// what is sent: a piece each time, over and over, with pauses.
struct Scripted {
    sound: Option<MemoryLine>,
    pieces: Vec<(u16, Vec<u8>)>,
    next: usize,
    offset: usize,
    /// Pieces after which the line is silent, or closed.
    left: usize,
    closes: bool,
    now: Duration,
}

impl Transport for Scripted {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        if let Some(line) = &mut self.sound {
            return line.send(bytes);
        }
        self.now += Duration::from_millis(1) * bytes.len() as u32;
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        if let Some(line) = &mut self.sound {
            return line.receive(buffer, timeout);
        }
        if self.left == 0 && self.closes {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        if self.left == 0 || self.pieces.is_empty() {
            self.now += timeout;
            return Ok(None);
        }
        let (pause, piece) = &self.pieces[self.next];
        let pause = Duration::from_millis(u64::from(*pause));
        let rest = &piece[self.offset..];
        if self.offset == 0 && pause > timeout {
            // It has come nearer.
            self.pieces[self.next].0 -= timeout.as_millis().min(u128::from(u16::MAX)) as u16;
            self.now += timeout;
            return Ok(None);
        }
        let count = rest.len().min(buffer.len());
        buffer[..count].copy_from_slice(&rest[..count]);
        self.offset += count;
        self.now += if self.offset == count {
            pause
        } else {
            Duration::ZERO
        } + Duration::from_micros(100);
        if self.offset >= piece.len() {
            self.offset = 0;
            self.next = (self.next + 1) % self.pieces.len();
            self.left -= 1;
        }
        Ok((count > 0).then_some(count))
    }

    fn clock(&self) -> Duration {
        self.now
            + self
                .sound
                .as_ref()
                .map_or(Duration::ZERO, MemoryLine::clock)
    }

    fn name(&self) -> &str {
        "scripted"
    }
}

/// An emulated controller whose every character may be damaged, both ways.
struct Noisy {
    inner: MemoryLine,
    chance: f64,
    random: Xoshiro256PlusPlus,
}

impl Noisy {
    fn damaged(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        for &byte in bytes {
            if !self.random.random_bool(self.chance) {
                out.push(byte);
                continue;
            }
            match self.random.random_range(0..5) {
                0 => {}
                1 => out.extend([byte, byte]),
                2 => out.push(self.random.random()),
                3 => out.extend_from_slice(
                    [&b"\r\n."[..], b"?\r\n", b"*x*\r\n", b"(Y/N)? "][usize::from(byte % 4)],
                ),
                _ => out.push(byte ^ (1 << self.random.random_range(0..8))),
            }
        }
        out
    }
}

impl Transport for Noisy {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let bytes = self.damaged(bytes);
        self.inner.send(&bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        let count = buffer.len() / 8;
        let Some(count) = self.inner.receive(&mut buffer[..count], timeout)? else {
            return Ok(None);
        };
        let bytes = self.damaged(&buffer[..count]);
        buffer[..bytes.len()].copy_from_slice(&bytes);
        Ok((!bytes.is_empty()).then_some(bytes.len()))
    }

    fn clock(&self) -> Duration {
        self.inner.clock()
    }

    fn name(&self) -> &str {
        "noisy"
    }
}

fn emulated(profile: Profile) -> MemoryLine {
    MemoryLine::new(Emulator::new(PumaParams::unimation(), profile))
}

fn config() -> ClientConfig {
    ClientConfig {
        reply_timeout: Duration::from_millis(200),
        motion_timeout: Duration::from_secs(5),
        connect_timeout: Duration::from_secs(5),
        speed_percent: Some(100.0),
        reply_limit: 2000,
        power_retries: 1,
        ..ClientConfig::default()
    }
}

/// Longest that any one call may take on the clock of its line with this configuration, whatever
/// comes: a bound on bounds, tries and time-outs multiplied.
const LONGEST: Duration = Duration::from_secs(1200);

fn connected<T: Transport>(line: T, config: ClientConfig) -> Option<Val2Client<T>> {
    let begun = line.clock();
    let client = Val2Client::connect(line, config).ok()?;
    assert!(client.line().clock() - begun < LONGEST);
    Some(client)
}

/// Every call there is, each ending in time, whatever it ends in; before each, the line is made as
/// it is to be.
fn everything<T: Transport>(mut client: Val2Client<T>, mut before: impl FnMut(&mut Val2Client<T>)) {
    type Call<T> = fn(&mut Val2Client<T>);
    let calls: [(&str, Call<T>); 16] = [
        ("calibrate", |c| drop(c.calibrate())),
        ("joints", |c| drop(c.joints())),
        ("move_by", |c| {
            drop(c.move_by(JointDelta::from_degrees([3.0, 2.0, -4.0, 0.0, 1.0, 0.0])));
        }),
        ("move_to", |c| {
            drop(c.move_to(Joints::from_degrees([0.0, -45.0, 180.0, 0.0, 45.0, 0.0])));
        }),
        ("drive", |c| drop(c.drive(Joint::J1, 0.1, 50.0))),
        ("ready", |c| drop(c.ready())),
        ("move_hand", |c| {
            let hand = Xyzoat::from_val([600.0, 149.09, -40.0, 90.0, 90.0, 0.0]);
            drop(c.move_hand(&hand, false));
        }),
        ("set_gripper", |c| drop(c.set_gripper(Gripper::Closed))),
        ("signal", |c| drop(c.signal(1001))),
        ("store_program", |c| {
            drop(c.store_program("P", &["TYPE 1".to_owned(), "DELAY 0.1".to_owned()]));
        }),
        ("execute", |c| drop(c.execute("P"))),
        ("abort", |c| drop(c.abort())),
        ("resident", |c| {
            if let Ok(mut resident) = c.resident() {
                drop(resident.move_by(JointDelta::of(Joint::J1, 0.05)));
                drop(resident.set_gripper(Gripper::Open));
                drop(resident.joints());
            }
        }),
        ("guarded", |c| {
            drop(c.arm_proximity(1001));
            drop(c.move_by(JointDelta::of(Joint::J1, -0.05)));
            drop(c.disarm_proximity());
        }),
        ("stop", |c| drop(c.stop())),
        ("reconnect", |c| drop(c.reconnect())),
    ];
    for (name, call) in calls {
        before(&mut client);
        let begun = client.line().clock();
        call(&mut client);
        let took = client.line().clock() - begun;
        assert!(took < LONGEST, "{name} took {took:?}");
        assert!(client.take_notices().len() <= 100);
        if let Some(joints) = client.last_known() {
            assert!(
                joints.0.iter().all(|angle| angle.is_finite()),
                "{name}: {joints}"
            );
        }
    }
}

/// Pieces of replies in which chance finds more than in bytes.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    let words = prop::sample::select(vec![
        &b"\r\n."[..],
        b".",
        b"*",
        b"\r\n*",
        b"?",
        b"? ",
        b"Change?\r\n",
        b" 1.? ",
        b"GO? ",
        b"Load VAL from floppy (Y/N)? ",
        b"Initialize (Y/N)? ",
        b"Are you sure (Y/N)? ",
        b"WHERE",
        b"WHERE\r\n",
        b"     X        Y        Z        O        A        T\r\n",
        b"   -20.32   149.09   921.12   90.000  -90.000    0.000\r\n",
        b"    JT1      JT2      JT3      JT4      JT5      JT6\r\n",
        b"    0.000  -90.000   90.000    0.000    0.000    0.000\r\n",
        b"*Arm power off*\r\n.",
        b"*Location out of range* Jt 1\r\n.",
        b" -1\r\n",
        b" 0\r\n",
        b"SPEED 100",
        b"1e999\r\n",
        b"\0\0\0",
        b"\x07",
        b"\xff\xfe",
    ]);
    prop_oneof![
        4 => words.prop_map(<[u8]>::to_vec),
        1 => prop::collection::vec(any::<u8>(), 1..40),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 192,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn the_client_takes_any_replies(
        pieces in prop::collection::vec((0_u16..400, piece()), 0..40),
        left in prop_oneof![0_usize..200, Just(usize::MAX)],
        closes in any::<bool>(),
        check_echo in any::<bool>(),
    ) {
        let script = |sound| Scripted {
            sound, pieces: pieces.clone(), next: 0, offset: 0, left, closes, now: Duration::ZERO,
        };
        let config = ClientConfig { check_echo, ..config() };
        connected(script(None), config.clone());
        let line = script(Some(emulated(Profile::val2())));
        let mut client = connected(line, config).expect("a sound line");
        client.calibrate().expect("a sound line");
        client.joints().expect("a sound line");
        let mut calls = 0;
        everything(client, |client| {
            let line = client.line_mut();
            // A closed line stays closed; each call but the first begins with its own place in the
            // script.
            line.now = line.clock();
            line.sound = None;
            line.left = line.left.max(left / 2);
            calls += 1;
            line.next = if line.pieces.is_empty() { 0 } else { calls % line.pieces.len() };
            line.offset = 0;
        });
    }

    #[test]
    fn the_client_takes_any_damage(
        seed in any::<u64>(),
        chance in prop::sample::select(vec![0.001, 0.01, 0.05, 0.3]),
        echo in any::<bool>(),
        control_characters in any::<bool>(),
        way in prop::sample::select(vec![
            MoveWay::Automatic, MoveWay::Drive, MoveWay::Ppoint, MoveWay::Point,
        ]),
    ) {
        let profile = Profile { echo, control_characters, ..Profile::val2() };
        let line = |chance| Noisy {
            inner: emulated(profile.clone()),
            chance,
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
        };
        let config = ClientConfig { way, ..config() };
        connected(line(chance), config.clone());
        let mut client = connected(line(0.0), config).expect("a sound line");
        client.calibrate().expect("a sound line");
        everything(client, |client| client.line_mut().chance = chance);
    }
}

/// Settings at the ends of their types.
#[test]
fn extreme_settings_neither_panic_nor_wait_for_ever() {
    for (quiet, time) in [
        (Duration::ZERO, Duration::ZERO),
        (Duration::from_nanos(1), Duration::from_nanos(1)),
        (Duration::from_millis(2), Duration::MAX),
    ] {
        let config = ClientConfig {
            quiet,
            reply_timeout: time,
            motion_timeout: time,
            connect_timeout: time,
            retries: 2,
            reply_limit: usize::MAX,
            ..ClientConfig::default()
        };
        if let Some(client) = connected(emulated(Profile::val2()), config) {
            everything(client, |_| ());
        }
    }
}
