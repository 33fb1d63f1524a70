//! Faults of the line and of the controller, injected one by one at every place of a session, and at random.
//!
//! What must hold each time: a call that succeeds leaves the arm where it was sent; a call that fails is a typed error, the arm stands, and no
//! joint has gone beyond where it was sent.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::needless_pass_by_value
)] // Functions that serve tests may fail as tests do.

use std::io;
use std::time::Duration;

use puma_val2::{
    ArmError, ClientConfig, Emulator, Joint, JointDelta, Joints, Manipulator, MemoryLine, MoveWay, Profile,
    PumaParams, Transport, Val2Client,
};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// What happens to a character.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Damage {
    Lost,
    Doubled,
    Flipped(u8),
    /// It and all that follow, for ever.
    Cut,
    /// The line reports its end.
    Closed,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    ToController,
    FromController,
}

/// Something that happens to a controller.
type Disturbance = Box<dyn FnOnce(&mut Emulator)>;

/// A line that damages characters.
struct FaultyLine {
    inner: MemoryLine,
    /// Damage to the character of this number, counted from when it was set.
    single: Option<(Way, usize, Damage)>,
    /// Damage to any character with this probability.
    noise: Option<(f64, Xoshiro256PlusPlus)>,
    counted: [usize; 2],
    closed: bool,
    cut: bool,
    struck: bool,
    /// Done once, as soon as the arm is seen moving.
    disturb: Option<Disturbance>,
}

impl FaultyLine {
    fn new(emulator: Emulator) -> Self {
        Self {
            inner: MemoryLine::new(emulator),
            single: None,
            noise: None,
            counted: [0; 2],
            closed: false,
            cut: false,
            struck: false,
            disturb: None,
        }
    }

    fn strike(&mut self, way: Way, at: usize, damage: Damage) {
        self.single = Some((way, at, damage));
        self.counted = [0; 2];
    }

    fn heal(&mut self) {
        self.single = None;
        self.noise = None;
        self.cut = false;
    }

    fn pass(&mut self, bytes: &[u8], way: Way) -> Vec<u8> {
        let mut out = Vec::new();
        for &byte in bytes {
            let count = self.counted[way as usize];
            self.counted[way as usize] += 1;
            let mut damage = None;
            if let Some((w, at, d)) = self.single
                && w == way
                && at == count
            {
                damage = Some(d);
            }
            if let Some((chance, random)) = &mut self.noise
                && random.random_bool(*chance)
            {
                damage = Some(match random.random_range(0..3) {
                    0 => Damage::Lost,
                    1 => Damage::Doubled,
                    _ => Damage::Flipped(random.random_range(0..8)),
                });
            }
            self.struck |= damage.is_some();
            match damage {
                _ if self.cut => {}
                None => out.push(byte),
                Some(Damage::Lost) => {}
                Some(Damage::Doubled) => out.extend([byte, byte]),
                Some(Damage::Flipped(bit)) => out.push(byte ^ (1 << bit)),
                Some(Damage::Cut) => self.cut = true,
                Some(Damage::Closed) => self.closed = true,
            }
        }
        out
    }
}

impl Transport for FaultyLine {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let passed = self.pass(bytes, Way::ToController);
        self.inner.send(&passed)?;
        if self.closed {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        if self.closed {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let half = buffer.len() / 2;
        let until = self.clock() + timeout;
        loop {
            let left = until.saturating_sub(self.clock());
            let slice = if self.disturb.is_some() {
                left.min(Duration::from_millis(20))
            } else {
                left
            };
            if self.inner.emulator().moving()
                && let Some(disturb) = self.disturb.take()
            {
                disturb(self.inner.emulator_mut());
            }
            let Some(count) = self.inner.receive(&mut buffer[..half], slice)? else {
                if slice < left {
                    continue;
                }
                return Ok(None);
            };
            let passed = self.pass(&buffer[..count], Way::FromController);
            if self.closed {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            buffer[..passed.len()].copy_from_slice(&passed);
            if !passed.is_empty() {
                return Ok(Some(passed.len()));
            }
        }
    }

    fn clock(&self) -> Duration {
        self.inner.clock()
    }

    fn name(&self) -> &str {
        "faulty"
    }
}

fn config(way: MoveWay) -> ClientConfig {
    ClientConfig {
        way,
        reply_timeout: Duration::from_millis(300),
        motion_timeout: Duration::from_secs(20),
        speed_percent: Some(100.0),
        ..ClientConfig::default()
    }
}

fn client(profile: Profile, way: MoveWay) -> Val2Client<FaultyLine> {
    let line = FaultyLine::new(Emulator::new(PumaParams::unimation(), profile));
    let mut client = Val2Client::connect(line, config(way)).unwrap();
    client.calibrate().unwrap();
    client.joints().unwrap();
    client
}

/// What a run of injected faults came to.
#[derive(Debug, Default)]
struct Tally {
    injected: usize,
    recovered: usize,
    reported: usize,
}

impl Tally {
    fn show(&self, what: &str) {
        println!(
            "{what}: {} faults injected, {} recovered, {} reported, 0 mishandled",
            self.injected, self.recovered, self.reported
        );
    }
}

const STEP: JointDelta = JointDelta([0.2, 0.1, -0.15, 0.0, 0.05, 0.0]);

fn truth(client: &Val2Client<FaultyLine>) -> Joints {
    client.line().inner.emulator().joints()
}

/// Everything that must hold after a call; whether it succeeded.
fn judge(
    client: &mut Val2Client<FaultyLine>,
    start: Joints,
    outcome: Result<Joints, ArmError>,
    context: &str,
) -> bool {
    let target = start + STEP;
    // What the arm was doing goes on to its end; it must not have been told to go further than it was sent.
    while let Ok(Some(_)) = client
        .line_mut()
        .inner
        .receive(&mut [0; 4096], Duration::from_secs(30))
    {}
    let emulator = client.line().inner.emulator();
    assert!(
        !emulator.moving(),
        "{context}: the arm moves on after {outcome:?}"
    );
    let stands = emulator.joints();
    for joint in Joint::ALL {
        let (from, to) = (start[joint].min(target[joint]), start[joint].max(target[joint]));
        let slack = 0.01_f64.to_radians();
        assert!(
            (from - slack..=to + slack).contains(&stands[joint]),
            "{context}: {joint} at {stands} from {start} to {target} after {outcome:?}"
        );
    }
    match outcome {
        Ok(joints) => {
            let off = (stands - target)
                .0
                .iter()
                .chain(&(joints - target).0)
                .fold(0.0_f64, |m, d| m.max(d.abs()));
            assert!(
                off < 0.05_f64.to_radians(),
                "{context}: {stands} instead of {target}"
            );
            true
        }
        Err(ArmError::JointLimit { .. } | ArmError::NotFinite { .. } | ArmError::Setting { .. }) => {
            panic!("{context}: blames the caller: {outcome:?}")
        }
        Err(_) => false,
    }
}

/// Strikes at every character of a move until a run stays unhurt.
fn strike_everywhere(
    profile: &Profile,
    way: MoveWay,
    direction: Way,
    damage: impl Fn(usize) -> Damage,
) -> Tally {
    let mut tally = Tally::default();
    let mut fresh = client(profile.clone(), way);
    for at in 0.. {
        let context = format!(
            "{way:?} {direction:?} {:?} at {at}, echo {}",
            damage(at),
            profile.echo
        );
        if fresh.line().closed {
            fresh = client(profile.clone(), way);
        }
        fresh.line_mut().heal();
        if fresh.joints().is_err() {
            fresh
                .reconnect()
                .unwrap_or_else(|e| panic!("{context}: does not come back: {e}"));
        }
        let home = Joints::from_degrees([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
        fresh
            .move_to(home)
            .unwrap_or_else(|e| panic!("{context}: does not come home: {e}"));
        let start = truth(&fresh);
        fresh.line_mut().struck = false;
        fresh.line_mut().strike(direction, at, damage(at));
        let outcome = fresh.move_by(STEP);
        if !fresh.line().struck {
            assert!(outcome.is_ok());
            return tally;
        }
        tally.injected += 1;
        if judge(&mut fresh, start, outcome, &context) {
            tally.recovered += 1;
        } else {
            tally.reported += 1;
        }
    }
    tally
}

fn profiles_and_ways() -> Vec<(Profile, MoveWay)> {
    let silent = Profile {
        echo: false,
        ..Profile::val2()
    };
    vec![
        (Profile::val2(), MoveWay::Automatic),
        (Profile::val2(), MoveWay::Drive),
        (Profile::val2(), MoveWay::Point),
        (Profile::val2_strict_miz(), MoveWay::Automatic),
        (silent, MoveWay::Automatic),
    ]
}

#[test]
fn lost_doubled_and_flipped_characters_anywhere_in_a_move() {
    let mut sum = Tally::default();
    for (profile, way) in profiles_and_ways() {
        for direction in [Way::ToController, Way::FromController] {
            let kinds: [&dyn Fn(usize) -> Damage; 4] = [
                &|_| Damage::Lost,
                &|_| Damage::Doubled,
                &|at| Damage::Flipped((at % 7) as u8),
                &|at| Damage::Flipped(((at + 3) % 7) as u8),
            ];
            for damage in kinds {
                let tally = strike_everywhere(&profile, way, direction, damage);
                sum.injected += tally.injected;
                sum.recovered += tally.recovered;
                sum.reported += tally.reported;
            }
        }
    }
    sum.show("single characters");
    assert!(sum.injected > 3000);
    assert!(sum.recovered * 10 > sum.injected * 9, "{sum:?}");
}

#[test]
fn a_line_cut_or_closed_anywhere_in_a_move_is_reported() {
    for (damage, what) in [(Damage::Cut, "cut line"), (Damage::Closed, "closed line")] {
        let mut sum = Tally::default();
        for (profile, way) in profiles_and_ways() {
            for direction in [Way::ToController, Way::FromController] {
                let tally = strike_everywhere(&profile, way, direction, |_| damage);
                sum.injected += tally.injected;
                sum.recovered += tally.recovered;
                sum.reported += tally.reported;
            }
        }
        sum.show(what);
        // Only a cut behind the last character that counts can be overlooked.
        assert!(sum.injected > 500 && sum.recovered < 20, "{sum:?}");
    }
}

#[test]
fn noise_on_the_line() {
    let mut sum = Tally::default();
    for seed in 0..300 {
        let (profile, way) = profiles_and_ways().swap_remove(seed % 5);
        let mut client = client(profile, way);
        let mut start = truth(&client);
        client.line_mut().noise = Some((0.004, Xoshiro256PlusPlus::seed_from_u64(seed as u64)));
        for turn in 0..3 {
            client.line_mut().struck = false;
            let outcome = client.move_by(STEP);
            sum.injected += usize::from(client.line().struck);
            let noise = client.line_mut().noise.take();
            let good = judge(
                &mut client,
                start,
                outcome,
                &format!("seed {seed} turn {turn} {way:?}"),
            );
            if client.line().struck {
                sum.recovered += usize::from(good);
                sum.reported += usize::from(!good);
            }
            if client.joints().is_err() {
                client.reconnect().unwrap();
            }
            client.joints().unwrap();
            client.line_mut().noise = noise;
            start = truth(&client);
        }
    }
    sum.show("noise, moves with at least one damaged character");
    assert!(
        sum.injected > 200 && sum.recovered * 10 > sum.injected * 8,
        "{sum:?}"
    );
}

#[test]
fn damage_anywhere_in_a_move_of_the_resident_program() {
    let mut tally = Tally::default();
    for direction in [Way::ToController, Way::FromController] {
        for damage in [
            Damage::Lost,
            Damage::Doubled,
            Damage::Flipped(0),
            Damage::Flipped(3),
            Damage::Flipped(6),
            Damage::Cut,
        ] {
            for at in 0.. {
                let context = format!("resident {direction:?} {damage:?} at {at}");
                let mut client = client(Profile::val2(), MoveWay::Automatic);
                let start = truth(&client);
                let mut resident = client.resident().unwrap();
                resident.line_mut().struck = false;
                resident.line_mut().strike(direction, at, damage);
                let outcome = resident.move_by(STEP);
                let struck = resident.line().struck;
                resident.line_mut().heal();
                drop(resident);
                if !struck {
                    outcome.unwrap();
                    break;
                }
                tally.injected += 1;
                if judge(&mut client, start, outcome, &context) {
                    tally.recovered += 1;
                } else {
                    tally.reported += 1;
                }
                if client.joints().is_err() {
                    client
                        .reconnect()
                        .unwrap_or_else(|e| panic!("{context}: does not come back: {e}"));
                }
                client
                    .move_to(start)
                    .unwrap_or_else(|e| panic!("{context}: does not go home: {e}"));
            }
        }
    }
    tally.show("resident program");
    assert!(tally.injected > 300);
}

/// Runs a move during which something happens to the controller as soon as the arm has begun to move.
fn disturbed(
    way: MoveWay,
    disturb: impl FnOnce(&mut Emulator) + 'static,
) -> (Val2Client<FaultyLine>, Result<Joints, ArmError>) {
    let mut client = client(Profile::val2(), way);
    let start = truth(&client);
    client.line_mut().disturb = Some(Box::new(disturb));
    let outcome = client.move_by(STEP);
    assert!(client.line().disturb.is_none(), "the arm never moved");
    let copy = match &outcome {
        Ok(joints) => Ok(*joints),
        Err(error) => Err(ArmError::Garbled {
            port: String::new(),
            sent: String::new(),
            expected: String::new(),
            heard: error.to_string(),
        }),
    };
    judge(&mut client, start, copy, &format!("{way:?}"));
    (client, outcome)
}

const WAYS: [MoveWay; 3] = [MoveWay::Drive, MoveWay::Ppoint, MoveWay::Point];

fn assert_knows_where(client: &Val2Client<FaultyLine>) {
    let off = client.last_known().unwrap() - truth(client);
    assert!(off.degrees().iter().all(|d| d.abs() < 1e-3));
}

#[test]
fn arm_power_lost_in_mid_move() {
    for way in WAYS {
        let (client, outcome) = disturbed(way, |emulator| emulator.set_arm_power(false));
        assert!(
            matches!(&outcome, Err(ArmError::Refused { message, .. }) if message == "Arm power off"),
            "{outcome:?}"
        );
        assert_knows_where(&client);
    }
}

#[test]
fn envelope_error_in_mid_move() {
    for way in WAYS {
        let (client, outcome) = disturbed(way, |emulator| emulator.envelope_error(Joint::J2));
        assert!(
            matches!(&outcome, Err(ArmError::Refused { message, .. }) if message == "Envelope error Jt 2"),
            "{outcome:?}"
        );
        assert_knows_where(&client);
    }
}

#[test]
fn the_controller_restarts_in_mid_move() {
    for way in WAYS {
        let (mut client, outcome) = disturbed(way, Emulator::restart);
        assert!(matches!(outcome, Err(ArmError::Restarted { .. })), "{outcome:?}");
        assert!(matches!(client.joints(), Err(ArmError::Restarted { .. })));
        client.reconnect().unwrap();
        client.calibrate().unwrap();
        client
            .move_by(JointDelta::from_degrees([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
            .unwrap();
    }
}

#[test]
fn the_controller_restarts_between_commands() {
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    client.line_mut().inner.emulator_mut().restart();
    assert!(matches!(client.move_by(STEP), Err(ArmError::Restarted { .. })));
    client.reconnect().unwrap();
    // It knows its position again only after calibration, and says so.
    assert!(matches!(client.move_by(STEP), Err(ArmError::Refused { .. })));
    client.calibrate().unwrap();
    client.move_by(STEP).unwrap();
}

#[test]
fn unasked_messages_during_a_move_and_between_commands() {
    for way in WAYS {
        for text in [
            "\r\nBreak time\r\n",
            "\r\n*Tape reader out of paper*\r\n.",
            "?",
            "\r\n.",
            "*\r\n",
        ] {
            let start_of = |client: &Val2Client<FaultyLine>| truth(client);
            let (mut client, _) = disturbed(way, move |emulator| emulator.interject(text));
            client.joints().unwrap();
            let start = start_of(&client);
            client.line_mut().inner.emulator_mut().interject(text);
            let outcome = client.move_by(STEP);
            assert!(outcome.is_ok(), "{way:?} {text:?}: {outcome:?}");
            judge(&mut client, start, outcome, text);
        }
    }
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    client
        .line_mut()
        .inner
        .emulator_mut()
        .interject("\r\n*Tape reader out of paper*\r\n.");
    client.joints().unwrap();
    assert_eq!(client.take_notices(), ["Tape reader out of paper"]);
}

#[test]
fn limits_of_the_controller_that_are_narrower_than_ours() {
    for way in WAYS {
        let mut narrow = PumaParams::unimation();
        narrow.ranges[1].max = -85.0_f64.to_radians();
        let line = FaultyLine::new(Emulator::new(narrow, Profile::val2()));
        let mut client = Val2Client::connect(line, config(way)).unwrap();
        client.calibrate().unwrap();
        let start = client.joints().unwrap();
        let outcome = client.move_by(STEP);
        assert!(
            matches!(&outcome, Err(ArmError::Refused { message, .. }) if message == "Location out of range Jt 2"),
            "{outcome:?}"
        );
        judge(&mut client, start, outcome, "narrow");
        assert_knows_where(&client);
    }
}

#[test]
fn a_controller_that_stops_short_is_found_out() {
    let profile = Profile {
        drive_error_degrees: 0.5,
        ..Profile::val2()
    };
    let mut client = client(profile, MoveWay::Drive);
    let outcome = client.drive(Joint::J1, 0.2, 100.0);
    assert!(matches!(
        outcome,
        Err(ArmError::NotReached { joint: Joint::J1, wanted_degrees, reported_degrees, .. })
            if (wanted_degrees - reported_degrees - 0.5).abs() < 1e-3
    ));
}

#[test]
fn proximity_stops_a_move_by_either_means() {
    for profile in [Profile::val2(), Profile::val2_strict_miz()] {
        let mut client = client(profile.clone(), MoveWay::Automatic);
        client
            .line_mut()
            .inner
            .emulator_mut()
            .attach_sensor(1001, |joints| joints.degrees()[0] > 5.0)
            .unwrap();
        client.arm_proximity(1001).unwrap();
        let start = truth(&client);
        let outcome = client.move_by(STEP);
        let Err(ArmError::ProximityStop {
            signal: 1001, joints, ..
        }) = outcome
        else {
            panic!("{}: {outcome:?}", profile.name)
        };
        let stands = truth(&client);
        assert!((5.0..9.0).contains(&stands.degrees()[0]), "{stands}");
        assert!((stands - joints).degrees().iter().all(|d| d.abs() < 1e-3));
        judge(&mut client, start, outcome, "proximity");
        // The guard is used up: the way back is free.
        client.move_to(start).unwrap();
        assert!(!puma_val2::ProximitySensor::object_near(&mut client).unwrap());
        // Armed again and nothing near: moves as ever.
        client.arm_proximity(1001).unwrap();
        client
            .move_by(JointDelta::from_degrees([-10.0, 3.0, 0.0, 0.0, 0.0, 0.0]))
            .unwrap();
        client.disarm_proximity().unwrap();
        client
            .move_by(JointDelta::from_degrees([20.0, 3.0, 0.0, 0.0, 0.0, 0.0]))
            .unwrap();
        assert!(puma_val2::ProximitySensor::object_near(&mut client).unwrap());
    }
}

#[test]
fn a_motion_that_never_ends_is_stopped() {
    let mut client = client(Profile::val2(), MoveWay::Automatic);
    client.set_speed(0.05).unwrap();
    let start = truth(&client);
    let outcome = client.move_by(STEP);
    assert!(matches!(outcome, Err(ArmError::Silence { .. })), "{outcome:?}");
    judge(&mut client, start, outcome, "slow");
    assert_knows_where(&client);
}
