//! Cost of a move on a 9600-baud line: characters, and moves per second when the motion itself
//! takes no time.

use std::time::Duration;

use puma_val2::{
    ClientConfig, Emulator, JointDelta, Manipulator, MemoryLine, MoveWay, Profile, PumaParams,
    Transport, Val2Client,
};

/// A calibrated client of an arm that is everywhere at once, on a paced line.
fn client(way: MoveWay, quiet: u64) -> Val2Client<MemoryLine> {
    client_at(way, quiet, true)
}

fn client_at(way: MoveWay, quiet: u64, echo: bool) -> Val2Client<MemoryLine> {
    let mut swift = PumaParams::unimation();
    swift.ranges.iter_mut().for_each(|range| range.speed *= 1e4);
    let profile = Profile {
        baud: Some(9600),
        echo,
        acceleration_time: Duration::from_millis(1),
        step_time: Duration::from_micros(100),
        ..Profile::val2()
    };
    let config = ClientConfig {
        way,
        quiet: Duration::from_millis(quiet),
        speed_percent: Some(100.0),
        ..ClientConfig::default()
    };
    let line = MemoryLine::new(Emulator::new(swift, profile));
    let mut client = Val2Client::connect(line, config).unwrap();
    client.calibrate().unwrap();
    client.joints().unwrap();
    client
}

/// Characters out and in per move, and moves per second.
fn cost<T: Manipulator>(
    arm: &mut T,
    joints: usize,
    meter: impl Fn(&mut T) -> (Duration, (u64, u64)),
) -> (u64, u64, f64) {
    let turns = 20;
    let (begun, before) = meter(arm);
    for turn in 0..turns {
        let sign = if turn % 2 == 0 { 1.0 } else { -1.0 };
        let mut degrees = [sign * 5.25, sign * 2.5, sign * -3.75, 0.0, 0.0, 0.0];
        degrees[joints..].fill(0.0);
        arm.move_by(JointDelta::from_degrees(degrees)).unwrap();
    }
    let (ended, after) = meter(arm);
    let per = |a: u64, b: u64| (b - a).div_ceil(turns);
    (
        per(before.0, after.0),
        per(before.1, after.1),
        turns as f64 / (ended - begun).as_secs_f64(),
    )
}

#[test]
fn the_ways_to_move_by_their_cost() {
    let ways = [
        ("one joint, DRIVE", MoveWay::Drive, 1),
        ("two joints, two DRIVEs", MoveWay::Drive, 2),
        ("three joints, three DRIVEs", MoveWay::Drive, 3),
        ("three joints, POINT and MOVE", MoveWay::Point, 3),
        ("three joints, MOVE #PPOINT", MoveWay::Ppoint, 3),
    ];
    let mut rates = Vec::new();
    println!("| a move of | sent | received | per second, 30 ms quiet | 5 ms |");
    let mut row = |name: &str, slow: (u64, u64, f64), quick: f64| {
        println!(
            "| {name} | {} | {} | {:.2} | {quick:.2} |",
            slow.0, slow.1, slow.2
        );
        rates.push(quick);
    };
    let meter = |c: &mut Val2Client<MemoryLine>| (c.line().clock(), c.line().traffic());
    for (name, way, joints) in ways {
        let slow = cost(&mut client(way, 30), joints, meter);
        let quick = cost(&mut client(way, 5), joints, meter).2;
        row(name, slow, quick);
    }
    let guarded = |quiet| {
        let mut client = client(MoveWay::Ppoint, quiet);
        client.arm_proximity(1001).unwrap();
        cost(&mut client, 3, meter)
    };
    row("three joints, guarded", guarded(30), guarded(5).2);
    let resident = |quiet| {
        let mut client = client(MoveWay::Ppoint, quiet);
        let mut resident = client.resident().unwrap();
        let cost = cost(&mut resident, 3, |r| {
            let line = r.line();
            (line.clock(), line.traffic())
        });
        resident.end().unwrap();
        client.joints().unwrap();
        cost
    };
    row(
        "three joints, resident program",
        resident(30),
        resident(5).2,
    );
    // What the automatic choice rests on.
    let [
        _,
        two_drives,
        three_drives,
        point,
        ppoint,
        guarded,
        resident,
    ] = rates[..]
    else {
        panic!("seven ways")
    };
    assert!(
        ppoint > two_drives
            && two_drives > three_drives
            && ppoint > point
            && point > guarded
            && resident > 2.0 * ppoint
    );
}

#[test]
fn a_move_without_an_echo_costs_a_tenth_more_at_most() {
    let meter = |c: &mut Val2Client<MemoryLine>| (c.line().clock(), c.line().traffic());
    // Sent and received by an earlier version that did not show the point again.
    for (guard, then) in [(false, (74, 498)), (true, (85, 527))] {
        let mut client = client_at(MoveWay::Automatic, 30, false);
        if guard {
            client.arm_proximity(1001).unwrap();
        }
        // The first move defines the point and types the program.
        let by = JointDelta::from_degrees([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        client.move_by(by).unwrap();
        let (sent, received, rate) = cost(&mut client, 3, meter);
        println!("| nothing echoed, guard {guard} | {sent} | {received} | {rate:.2} | |");
        assert!(10 * sent <= 11 * then.0, "{sent}");
        assert!(
            10 * (sent + received) <= 11 * (then.0 + then.1),
            "{received}"
        );
    }
}
