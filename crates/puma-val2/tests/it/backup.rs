//! Programs, locations and reals of a controller: listed, kept, put back.

use puma_val2::{
    ArmError, ClientConfig, Emulator, Manipulator, MemoryLine, Profile, PumaParams, Val2Client,
};

const MEMORY: &str = ".PROGRAM PICK
 10 APPRO PART,50 ; above the part
 MOVES PART
 CLOSEI
 IF N > 2 GOTO 10
 TYPE \"1. done\"
.END
.PROGRAM WORK
 MOVE #REST
.END
.LOCATIONS
#REST 10.5,-85,95,0,0,-0.125
PART 400.25,150,300,90,90,0
Q[2] 1,2,3,-170.5,10,179.999
.END
.REALS
A[3] -1.25
N 3
.END
";

fn client(profile: Profile, memory: &str) -> Val2Client<MemoryLine> {
    let mut emulator = Emulator::new(PumaParams::unimation(), profile);
    emulator.load_text(memory).unwrap();
    let mut client =
        Val2Client::connect(MemoryLine::new(emulator), ClientConfig::default()).unwrap();
    client.calibrate().unwrap();
    client
}

fn lists(client: &mut Val2Client<MemoryLine>) -> Vec<String> {
    ["DIRECTORY", "LISTP", "LISTL", "LISTR"]
        .map(|list| client.send_line(list).unwrap())
        .to_vec()
}

#[test]
fn a_backup_restored_after_zero_lists_the_same() {
    let silent = Profile {
        echo: false,
        ..Profile::val2()
    };
    for profile in Profile::all().into_iter().chain([silent]) {
        let mut client = client(profile, MEMORY);
        let before = lists(&mut client);
        let backup = client.backup().unwrap();
        assert_eq!(client.backup().unwrap(), backup);
        let kept = client.restore(&backup, false).unwrap();
        assert!(
            kept.iter().all(|line| line.starts_with("keep ")),
            "{kept:?}"
        );
        client.line_mut().emulator_mut().load_text("").unwrap();
        for line in ["PICK", "WORK", "#REST", "PART", "Q[2]", "A[3]", "N"] {
            client.remove(line).unwrap();
        }
        assert_eq!(client.backup().unwrap(), "");
        let plan = client.restore_plan(&backup).unwrap();
        assert_eq!(plan.len(), 7);
        assert_eq!(client.restore(&backup, false).unwrap(), plan);
        assert_eq!(lists(&mut client), before);
        assert_eq!(client.backup().unwrap(), backup);
    }
}

#[test]
fn other_contents_of_a_name_refuse_the_whole_backup() {
    let mut client = client(
        Profile::val2(),
        ".PROGRAM WORK\n MOVE #P1\n.END\n.REALS\nN 3\n.END",
    );
    let before = client.backup().unwrap();
    let error = client.restore(MEMORY, false).unwrap_err();
    assert_matches!(&error, ArmError::Conflict { names, .. } if names == "program WORK");
    assert_eq!(client.backup().unwrap(), before);
    client.restore(MEMORY, true).unwrap();
    assert_eq!(client.program("WORK").unwrap(), ["MOVE #REST"]);
    assert!(
        !client
            .programs()
            .unwrap()
            .iter()
            .any(|name| name.starts_with("PG"))
    );
}

#[test]
fn a_refused_step_leaves_everything_as_it_was() {
    let memory = ".PROGRAM WORK\n MOVE P1\n MOVES P2\n.END";
    let mut client = client(Profile::val2(), memory);
    let before = client.backup().unwrap();
    let steps = ["MOVE P1", "FROBNICATE 1"].map(str::to_owned);
    assert_matches!(
        client.store_program("WORK", &steps),
        Err(ArmError::Refused { .. })
    );
    assert_eq!(client.backup().unwrap(), before);
    let text = ".PROGRAM A\n MOVE P1\n.END\n.PROGRAM B\n FROBNICATE 1\n.END\n.REALS\nN 1\n.END";
    assert_matches!(
        client.restore(text, false),
        Err(ArmError::Step { line: 5, word: Some(word), .. }) if word == "FROBNICATE"
    );
    assert_eq!(client.backup().unwrap(), before);
    client
        .store_program("WORK", &["MOVE P3".to_owned()])
        .unwrap();
    assert_eq!(client.backup().unwrap(), ".PROGRAM WORK\n MOVE P3\n.END\n");
}

#[test]
fn a_text_that_is_no_backup_is_refused_by_its_line() {
    let mut client = client(Profile::val2(), "");
    let sent = client.line().traffic();
    for (text, line) in [
        ("MOVE P1", 1),
        (".PROGRAM belt(1)\n.END", 1),
        (".PROGRAM belt(a\n.END", 1),
        (".PROGRAM A\n TYPE 1\n", 2),
        (".REALS\nN one\n.END", 2),
        (".REALS\nN nan\n.END", 2),
        (".LOCATIONS\nP 1,2,3,4,5\n.END", 2),
        (".LOCATIONS\n\nP 1,2,3,4,5,6\n.END", 2),
    ] {
        let error = client.restore(text, true).unwrap_err();
        assert_matches!(&error, ArmError::Text { line: at, .. } if *at == line, "{text}");
    }
    assert_eq!(client.line().traffic(), sent);
}

#[test]
fn a_taught_point_leads_the_arm_back() {
    let mut client = client(Profile::val2(), "");
    let start = client.joints().unwrap();
    let there = puma_val2::Joints::from_degrees([20.0, -60.0, 140.0, 10.0, 45.0, -30.0]);
    client.move_to(there).unwrap();
    assert!((client.here("#SPOT").unwrap()[0] - 20.0).abs() < 1e-3);
    client.here("SPOT").unwrap();
    for motion in ["DO MOVE #SPOT", "DO MOVE SPOT"] {
        client.move_to(start).unwrap();
        client.send_line(motion).unwrap();
        let off = client.joints().unwrap() - there;
        assert!(
            off.degrees().iter().all(|d| d.abs() < 0.01),
            "{motion}: {off:?}"
        );
    }
    assert_matches!(client.here("1"), Err(ArmError::Refused { .. }));
    client.set_signal(3).unwrap();
    assert!(client.signal(3).unwrap());
    client.set_signal(-3).unwrap();
    assert!(!client.signal(3).unwrap());
}
