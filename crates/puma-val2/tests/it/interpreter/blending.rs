//! Motions that follow one another: the path, the limits at every tick, and what ends blending.

use std::time::Duration;

use nalgebra::Vector3;
use puma_val2::{Event, Profile};

use crate::console::Console;

const TICK: Duration = Duration::from_millis(4);

/// Track of a program from its first motion to the last stand.
struct Track {
    /// Hand positions at every tick, millimetres.
    hand: Vec<Vector3<f64>>,
    seconds: f64,
    /// Times at which the arm came to a stand.
    stands: usize,
}

/// Runs a program from a pose, the location `S`, and checks the joints at every tick.
fn track(start: [f64; 6], steps: &str) -> (Console, Track) {
    let mut console = Console::ready();
    console.line(&format!(
        "DO MOVE #PPOINT({})",
        start.map(|v| v.to_string()).join(",")
    ));
    console.line("DO HERE S");
    console.program("T", steps);
    let params = *console.emulator.params();
    let acceleration = Profile::val2().acceleration_time.as_secs_f64();
    let tick = TICK.as_secs_f64();
    let pose = |c: &Console| params.forward(&c.emulator.joints()).translation.vector * 1000.0;
    let (mut joints, mut speeds) = (console.emulator.joints(), [0.0; 6]);
    let mut track = Track {
        hand: vec![pose(&console)],
        seconds: 0.0,
        stands: 0,
    };
    console.line_now("EXECUTE T");
    console.emulator.take_events();
    for step in 0.. {
        console.wait(TICK);
        let now = console.emulator.joints();
        let speed: [f64; 6] = std::array::from_fn(|i| (now.0[i] - joints.0[i]) / tick);
        for i in 0..6 {
            let limit = params.ranges[i].speed;
            assert!(
                speed[i].abs() <= limit * 1.001,
                "joint {i} at {} of {limit}",
                speed[i]
            );
            let gain = (speed[i] - speeds[i]) / tick * acceleration / limit;
            assert!(
                gain.abs() <= 1.02,
                "joint {i}: acceleration {gain} at {step}"
            );
        }
        track.hand.push(pose(&console));
        if now != joints {
            track.seconds = (step + 1) as f64 * tick;
        }
        (joints, speeds) = (now, speed);
        if console.screen.ends_with("Program completed\r\n.") {
            let events = console.emulator.take_events();
            track.stands = events.iter().filter(|e| **e == Event::MotionEnded).count();
            return (console, track);
        }
        assert!(step < 20_000, "{}", console.screen);
    }
    unreachable!()
}

const DOWN: [f64; 6] = [0.0, -45.0, 180.0, 0.0, 45.0, 0.0];

fn draws(count: usize) -> String {
    let step = 300.0 / count as f64;
    (1..=count)
        .map(|i| format!("MOVES SHIFT(S BY ,,{})\n", step * i as f64))
        .collect()
}

#[test]
fn via_points_on_a_line_cost_no_time_and_no_accuracy() {
    let one = track(DOWN, &draws(1)).1.seconds;
    for count in [2, 20, 100] {
        let (console, track) = track(DOWN, &draws(count));
        println!(
            "300 mm in {count} MOVES: {:.3} s, in one {one:.3} s",
            track.seconds
        );
        assert!(
            track.seconds <= 1.2 * one,
            "{count}: {} against {one}",
            track.seconds
        );
        let first = track.hand[0];
        for at in &track.hand {
            let off = at - first;
            assert!(off.xy().norm() < 0.1, "{count}: {off}");
            assert!(off.z > -0.01 && off.z < 300.01);
        }
        assert!((track.hand.last().unwrap() - first).z > 299.99);
        drop(console);
    }
}

#[test]
fn a_loop_of_short_draws_keeps_its_speed() {
    let one = track(DOWN, "DRAW ,,300").1.seconds;
    let (_, track) = track(DOWN, "FOR I = 1 TO 100\nDRAW ,,3\nEND");
    println!(
        "300 mm by a loop of 100: {:.3} s, in one {one:.3} s",
        track.seconds
    );
    assert!(track.seconds <= 1.2 * one, "{}", track.seconds);
    assert_eq!(track.stands, 1);
}

#[test]
fn corners_are_rounded_without_a_stand() {
    let square = "DRAW 100\nDRAW ,100\nDRAW -100\nDRAW ,-100";
    let (_, blended) = track(DOWN, square);
    let (console, broken) = track(DOWN, &square.replace('\n', "\nBREAK\n"));
    println!(
        "square of 100 mm: {:.3} s, with BREAK {:.3} s",
        blended.seconds, broken.seconds
    );
    assert_eq!((blended.stands, broken.stands), (1, 4));
    assert!(blended.seconds < 0.8 * broken.seconds);
    let corner = broken.hand[0] + Vector3::new(-100.0 + 100.0, 100.0, 0.0);
    let least = |t: &Track| {
        t.hand
            .iter()
            .map(|p| (p - corner).norm())
            .fold(1e9, f64::min)
    };
    assert!(least(&broken) < 0.01 && least(&blended) > 1.0 && least(&blended) < 30.0);
    console.assert_at(DOWN);
}

#[test]
fn joint_moves_that_reverse_stay_within_limits() {
    let moves = "MOVE #PPOINT(60,-45,180,0,45,0)\nMOVE #PPOINT(-60,-60,160,50,10,90)
        DRIVE 1,20,100\nMOVE #PPOINT(0,-45,180,0,45,0)\nMOVES SHIFT(S BY 100,50,60)
        APPRO S,50\nMOVES S\nDEPART 80\nMOVE #PPOINT(10,-90,90)\nREADY";
    let (console, blended) = track(DOWN, moves);
    console.assert_at([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    let (_, broken) = track(DOWN, &moves.replace('\n', "\nBREAK\n"));
    println!(
        "ten mixed motions: {:.3} s, with BREAK {:.3} s",
        blended.seconds, broken.seconds
    );
    assert!(blended.seconds < broken.seconds);
    assert_eq!(blended.stands, 1);
}

#[test]
fn what_ends_a_path_makes_the_arm_stand() {
    for (between, stands) in [
        ("", 1),
        ("TYPE 1", 1),
        ("COARSE ALWAYS", 1),
        ("BREAK", 2),
        ("DELAY 0.2", 2),
        ("OPENI", 2),
        ("WAIT SIG(-1001)", 1),
        ("DISABLE CP", 2),
        ("TOOL NULL", 2),
        ("SPEED 50", 1),
    ] {
        let steps = format!("DRIVE 1,20,100\n{between}\nDRIVE 1,20,100");
        assert_eq!(track(DOWN, &steps).1.stands, stands, "{between}");
    }
    assert_eq!(
        track(DOWN, "FINE\nDRIVE 1,20,100\nDRIVE 1,20,100\nDRIVE 1,20,100")
            .1
            .stands,
        2
    );
    assert_eq!(
        track(
            DOWN,
            "FINE ALWAYS\nDRIVE 1,9,100\nDRIVE 1,9,100\nDRIVE 1,9,100"
        )
        .1
        .stands,
        3
    );
}

#[test]
fn a_step_counts_as_done_when_its_motion_begins() {
    let mut console = Console::ready();
    console.program(
        "T",
        "DRIVE 1,41,100\nSIGNAL 1\nDRIVE 1,41,100\nSIGNAL 2\nDRIVE 1,-41,100",
    );
    console.line_now("EXECUTE T");
    console.wait(Duration::from_millis(20));
    assert!(console.emulator.signal(1).unwrap());
    console.wait(Duration::from_millis(440));
    assert!(!console.emulator.signal(2).unwrap());
    assert!(console.line_now("STATUS").contains("STEP 3"));
    console.wait(Duration::from_millis(40));
    assert!(console.emulator.signal(2).unwrap() && console.emulator.moving());
    console.settle();
    console.assert_at([41.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
}

#[test]
fn a_blend_can_be_broken_off() {
    for stop in ["PANIC\r", "ABORT\r", "\u{3}"] {
        let mut console = Console::ready();
        console.program("T", "DRIVE 1,40,100\nDRIVE 2,30,100\nREADY");
        console.line_now("EXECUTE T");
        console.wait(Duration::from_millis(560));
        console.emulator.feed(stop.as_bytes(), console.now);
        let at = console.degrees();
        console.wait(Duration::from_millis(61));
        let stands = console.degrees();
        if stop == "\u{3}" {
            continue;
        }
        assert!(!console.emulator.moving(), "{stop:?}");
        assert!((stands[0] - at[0]).abs() < 3.0 && (stands[1] - at[1]).abs() < 3.0);
        console.settle();
        assert!(console.line("PROCEED").contains("Program completed"));
        console.assert_at([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    }
}

#[test]
fn a_reaction_stops_the_arm_in_a_blend() {
    let mut console = Console::ready();
    console.program("HIT", "TYPE \"hit\"\nHALT");
    console
        .emulator
        .attach_sensor(1001, |j| j.degrees()[1] > -88.0)
        .unwrap();
    console.program(
        "T",
        "REACTI 1001,HIT\nDRIVE 1,40,100\nDRIVE 2,30,100\nREADY",
    );
    assert!(console.line("EXECUTE T").contains("hit"));
    let at = console.degrees();
    assert!(at[0] > 20.0 && at[0] < 41.0 && at[1] < -80.0, "{at:?}");
}

#[test]
fn a_fault_of_the_next_motion_leaves_the_arm_at_the_last_goal() {
    let mut console = Console::ready();
    console.program("T", "DRIVE 1,40,100\nMOVE NOWHERE\nREADY");
    assert!(console.line("EXECUTE T").contains("*Undefined value*"));
    console.assert_at([40.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    console.program("U", "DRIVE 1,-40,100\nDRIVE 1,200,100");
    assert!(console.line("EXECUTE U").contains("aborted at U, step 2"));
    console.assert_at([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
}

#[test]
fn random_paths_stay_within_limits_and_end_at_their_goal() {
    let mut seed = 1_u64;
    let mut random = |span: f64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (((seed >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * span).round()
    };
    for _ in 0..40 {
        let mut steps = String::new();
        for i in 0..12 {
            let (x, y, z) = (random(160.0), random(160.0), random(160.0));
            let (speed, turn) = (random(90.0) + 55.0, random(60.0));
            steps += &match i % 6 {
                0 => format!("MOVE SHIFT(S BY {x},{y},{z}):RZ({turn})\n"),
                1 | 4 => format!("MOVES SHIFT(S BY {x},{y},{z}):RX({turn})\n"),
                2 => format!("SPEED {speed} ALWAYS\nDRIVE {},{turn},100\n", 4 + i % 3),
                3 => format!("MOVE #PPOINT({x},-60,150,{turn},45,{y})\nMOVE S\n"),
                _ => format!(
                    "DRAW {},{}\nAPPROS S,{}\n",
                    x / 20.0,
                    y / 20.0,
                    z.abs() / 20.0
                ),
            };
        }
        let (console, _) = track(DOWN, &(steps + "MOVE #PPOINT(5,-50,170,0,40,0)"));
        console.assert_at([5.0, -50.0, 170.0, 0.0, 40.0, 0.0]);
    }
}
