//! Runs of injected faults, and what must hold after each.

use std::time::Duration;

use puma_val2::{
    ArmError, ClientConfig, Emulator, Joint, JointDelta, Joints, Manipulator, MoveWay, Profile,
    PumaParams, Transport, Val2Client,
};

use crate::faults::line::{Damage, FaultyLine, Way};

pub(crate) type Client = Val2Client<FaultyLine>;

pub(crate) fn config(way: MoveWay) -> ClientConfig {
    ClientConfig {
        way,
        reply_timeout: Duration::from_millis(300),
        motion_timeout: Duration::from_secs(20),
        speed_percent: Some(100.0),
        abort_running_program: true,
        ..ClientConfig::default()
    }
}

pub(crate) fn client(profile: Profile, way: MoveWay) -> Client {
    client_of(PumaParams::unimation(), profile, way)
}

pub(crate) fn client_of(arm: PumaParams, profile: Profile, way: MoveWay) -> Client {
    let config = ClientConfig {
        params: arm,
        ..config(way)
    };
    let line = FaultyLine::new(Emulator::new(arm, profile));
    let mut client = Val2Client::connect(line, config).unwrap();
    client.calibrate().unwrap();
    client.joints().unwrap();
    client
}

/// Results of a run of injected faults.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) injected: usize,
    pub(crate) recovered: usize,
    pub(crate) reported: usize,
}

impl Tally {
    pub(crate) fn add(&mut self, other: &Self) {
        self.injected += other.injected;
        self.recovered += other.recovered;
        self.reported += other.reported;
    }

    pub(crate) fn count(&mut self, recovered: bool) {
        self.injected += 1;
        self.recovered += usize::from(recovered);
        self.reported += usize::from(!recovered);
    }

    pub(crate) fn show(&self, what: &str) {
        println!(
            "{what}: {} faults injected, {} recovered, {} reported, 0 mishandled",
            self.injected, self.recovered, self.reported
        );
    }
}

pub(crate) const STEP: JointDelta = JointDelta([0.2, 0.1, -0.15, 0.0, 0.05, 0.0]);

pub(crate) fn truth(client: &Client) -> Joints {
    client.line().inner.emulator().joints()
}

/// Greatest difference of a joint, degrees; what is no number is infinitely far off.
pub(crate) fn off(a: Joints, b: Joints) -> f64 {
    let worse = |worst: f64, d: &f64| {
        if d.is_finite() {
            worst.max(d.abs())
        } else {
            f64::INFINITY
        }
    };
    (a - b).degrees().iter().fold(0.0, worse)
}

/// The arm stands where the client says it does, if it says so.
pub(crate) fn assert_not_misled(client: &Client, context: &str) {
    if let Some(known) = client.last_known() {
        let there = truth(client);
        assert!(
            off(known, there) < 0.013,
            "{context}: known {known}, true {there}"
        );
    }
}

/// The client knows where the arm stands.
pub(crate) fn assert_knows_where(client: &Client) {
    let (known, there) = (client.last_known().unwrap(), truth(client));
    assert!(off(known, there) < 1e-3, "known {known}, true {there}");
}

/// Everything that must hold after a move by [`STEP`]; whether it succeeded.
pub(crate) fn judge(
    client: &mut Client,
    start: Joints,
    outcome: &Result<Joints, ArmError>,
    context: &str,
) -> bool {
    let target = start + STEP;
    let line = client.line();
    assert!(
        line.cut || line.closed || !line.inner.emulator().moving(),
        "{context}: the arm was left moving by {outcome:?}"
    );
    // What the arm was doing goes on to its end; it must not have been told to go further than it
    // was sent.
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
        let (from, to) = (
            start[joint].min(target[joint]),
            start[joint].max(target[joint]),
        );
        // A pose of the hand is shown in hundredths of a millimetre.
        let slack = 0.03_f64.to_radians();
        assert!(
            (from - slack..=to + slack).contains(&stands[joint]),
            "{context}: {joint} at {stands} from {start} to {target} after {outcome:?}"
        );
    }
    assert_not_misled(client, context);
    match outcome {
        Ok(joints) => {
            let worst = off(stands, target).max(off(*joints, target));
            assert!(worst < 0.05, "{context}: {stands} instead of {target}");
            true
        }
        Err(
            ArmError::JointLimit { .. } | ArmError::NotFinite { .. } | ArmError::Setting { .. },
        ) => {
            panic!("{context}: blames the caller: {outcome:?}")
        }
        Err(_) => false,
    }
}

/// Strikes the line from now on.
pub(crate) type Strike<'a> = &'a dyn Fn(&mut FaultyLine);

/// A call at every character of which the line is struck: it moves the arm by [`STEP`].
#[derive(Clone)]
pub(crate) struct Subject<'a> {
    pub(crate) name: &'a str,
    pub(crate) profile: Profile,
    pub(crate) way: MoveWay,
    pub(crate) arm: PumaParams,
    /// Done before each call, on a sound line, the arm standing at home.
    pub(crate) prepare: &'a dyn Fn(&mut Client),
    /// The call; it lets the strike loose.
    pub(crate) act: &'a dyn Fn(&mut Client, Strike<'_>) -> Result<Joints, ArmError>,
    pub(crate) home: Joints,
    /// Every this many characters are struck.
    pub(crate) stride: usize,
}

impl<'a> Subject<'a> {
    pub(crate) const READY: Joints = Joints([
        0.0,
        -std::f64::consts::FRAC_PI_2,
        std::f64::consts::FRAC_PI_2,
        0.0,
        0.0,
        0.0,
    ]);

    /// `move_by` from READY.
    pub(crate) fn moving(profile: Profile, way: MoveWay) -> Self {
        Self {
            name: "move_by",
            profile,
            way,
            arm: PumaParams::unimation(),
            prepare: &|_| (),
            act: &|client, strike| {
                strike(client.line_mut());
                client.move_by(STEP)
            },
            home: Self::READY,
            stride: 1,
        }
    }

    /// Strikes at one character after another until a call stays unhurt.
    pub(crate) fn strike_everywhere(
        &self,
        direction: Way,
        damage: &dyn Fn(usize) -> Damage,
    ) -> Tally {
        let mut tally = Tally::default();
        let fresh = || client_of(self.arm, self.profile.clone(), self.way);
        let mut client = fresh();
        for at in (0..).step_by(self.stride) {
            let damage = damage(at);
            let context = format!(
                "{} {:?} {direction:?} {damage:?} at {at}, echo {}",
                self.name, self.way, self.profile.echo
            );
            if client.line().closed {
                client = fresh();
            }
            client.line_mut().heal();
            if client.joints().is_err() {
                client
                    .reconnect()
                    .unwrap_or_else(|e| panic!("{context}: does not come back: {e}"));
            }
            client
                .move_to(self.home)
                .unwrap_or_else(|e| panic!("{context}: does not come home: {e}"));
            (self.prepare)(&mut client);
            let start = truth(&client);
            client.line_mut().struck = false;
            let outcome = (self.act)(&mut client, &|line| line.strike(direction, at, damage));
            if !client.line().struck {
                assert!(outcome.is_ok(), "{context}: {outcome:?} on a sound line");
                return tally;
            }
            tally.count(judge(&mut client, start, &outcome, &context));
        }
        tally
    }

    /// Injects each of these damages in both directions.
    pub(crate) fn strike_both_ways(&self, damages: &[&dyn Fn(usize) -> Damage]) -> Tally {
        let mut sum = Tally::default();
        for direction in [Way::ToController, Way::FromController] {
            for damage in damages {
                sum.add(&self.strike_everywhere(direction, damage));
            }
        }
        sum
    }
}
