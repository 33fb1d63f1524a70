//! Programs, locations and reals of a controller: listed, kept, put back.

use puma_val2::{
    ArmError, ClientConfig, Emulator, Manipulator, MemoryLine, Profile, PumaParams, Val2Client,
};
use rand::rngs::StdRng;
use rand::{RngExt, SeedableRng};

const MEMORY: &str = ".PROGRAM LAYER(A,B)
 TYPE A
.END
.PROGRAM PICK
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
    let loaded = emulator.load_text(memory);
    assert!(loaded.is_ok(), "{loaded:?}\n{memory}");
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
        for line in [
            "LAYER", "PICK", "WORK", "#REST", "PART", "Q[2]", "A[3]", "N",
        ] {
            client.remove(line).unwrap();
        }
        assert_eq!(client.backup().unwrap(), "");
        let plan = client.restore_plan(&backup).unwrap();
        assert_eq!(plan.len(), 8);
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

const LETTERS: &str = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._";

fn random_text(rng: &mut StdRng, letters: &str, longest: usize) -> String {
    let letters: Vec<char> = letters.chars().collect();
    let length = rng.random_range(1..=longest);
    let letter = |_| letters[rng.random_range(0..letters.len())];
    (0..length).map(letter).collect()
}

fn random_name(rng: &mut StdRng, longest: usize) -> String {
    let first = char::from(rng.random_range(b'A'..=b'Z'));
    match longest {
        2.. if rng.random_bool(0.7) => {
            format!("{first}{}", random_text(rng, LETTERS, longest - 1))
        }
        _ => first.to_string(),
    }
}

fn random_step(rng: &mut StdRng, longest: usize) -> String {
    let printable: String = (' '..='~').filter(|c| *c != '"').collect();
    let name = random_name(rng, longest);
    let number = rng.random_range(1..999);
    let step = match rng.random_range(0..14) {
        0 => format!("{name} = -{number}.5e-3*({name} MOD 3)"),
        1 => format!("{name}[{number}]=SQRT({number})"),
        2 => format!("{name} [2] = 1"),
        3 => format!("MOVES {name}:TRANS(,,{number}) ; Go on"),
        4 => format!("IF {name}==1 GOTO 10"),
        5 => format!("CALL {name}(#{name}, {name}[2], 1+2, P:Q)"),
        6 => format!("TYPE \"{}\",/S,{name}", random_text(rng, &printable, 60)),
        7 => format!("PROMPT \"{} ?\", {name}", random_text(rng, &printable, 9)),
        8 => format!(";{}", random_text(rng, &printable, 110)),
        9 => format!(
            "appro {name} , {number} ;{}",
            random_text(rng, &printable, 90)
        ),
        10 => format!("REACTI 1001,{name}"),
        11 => String::new(),
        12 => "10".to_owned(),
        _ => "END".to_owned(),
    };
    let labelled = rng.random_bool(0.2) && !step.is_empty() && step != "10";
    let label = rng.random_range(1..65535);
    let step = if labelled {
        format!("{label} {step}")
    } else {
        step
    };
    step.chars().take(127).collect()
}

fn random_memory(rng: &mut StdRng, longest: usize) -> String {
    let mut memory = String::new();
    for _ in 0..rng.random_range(0..4) {
        let name = random_name(rng, longest);
        let [a, b] = ["X", "Y"].map(|first| format!("{first}{}", random_name(rng, longest - 1)));
        let heads = [
            "",
            "()",
            &format!("({a})"),
            &format!("({a}, #{b})"),
            &format!("(#{b})"),
        ];
        memory += &format!(".PROGRAM {name}{}\n", heads[rng.random_range(0..5)]);
        for _ in 0..rng.random_range(0..12) {
            memory += &format!("  {}\n", random_step(rng, longest));
        }
        memory += ".END\n";
    }
    memory += ".LOCATIONS\n";
    for _ in 0..rng.random_range(0..6) {
        let name = random_name(rng, longest);
        let angle = |rng: &mut StdRng| match rng.random_range(0..4) {
            0 => [0.0, 90.0, -90.0, 180.0, -180.0][rng.random_range(0..5)],
            1 => 90.0 - rng.random_range(-2e-3..2e-3),
            2 => -180.0 + rng.random_range(-2e-3..2e-3),
            _ => rng.random_range(-360.0..360.0),
        };
        let size = 10_f64.powi(rng.random_range(-3..6));
        let [x, y, z] = [(); 3].map(|()| rng.random_range(-size..size));
        let [o, a, t] = [(); 3].map(|()| angle(rng));
        let kind = ["", "#"][rng.random_range(0..2)];
        let index = ["", "[7]", "[1,2]"][rng.random_range(0..3)];
        memory += &format!("{kind}{name}{index} {x},{y},{z},{o},{a},{t}\n");
    }
    memory += ".END\n.REALS\n";
    for _ in 0..rng.random_range(0..6) {
        let name = random_name(rng, longest);
        let index = ["", "[0]", "[32767,1,0]"][rng.random_range(0..3)];
        let size = 10_f64.powi(rng.random_range(-38..38));
        let plain = [0.0, -0.0, 3.0, -0.25, 1e-5, 1e38, -1e15, 1.0 / 3.0];
        let value = match rng.random_range(0..3) {
            0 => plain[rng.random_range(0..plain.len())],
            _ => rng.random_range(-size..size),
        };
        memory += &format!("{name}{index} {value:e}\n");
    }
    memory + ".END\n"
}

/// The number of controllers is `PUMA_VAL2_BACKUPS` (default 8).
#[test]
fn backups_of_random_controllers_restore_all_of_them() {
    let cases = std::env::var("PUMA_VAL2_BACKUPS").map_or(8, |n| n.parse().unwrap());
    for case in 0..cases {
        let mut rng = StdRng::seed_from_u64(case);
        let profile = Profile::all()[case as usize % 4].clone();
        let longest = profile.max_name;
        let memory = random_memory(&mut rng, longest);
        let mut old = client(profile.clone(), &memory);
        let backup = old.backup().unwrap();
        assert_eq!(old.backup().unwrap(), backup, "{case}");
        let mut new = client(profile, "");
        let done = new.restore(&backup, false);
        assert!(done.is_ok(), "{case}: {done:?}\n{memory}");
        assert_eq!(lists(&mut new), lists(&mut old), "{case}\n{memory}");
        assert_eq!(new.backup().unwrap(), backup, "{case}");
        // The programs are those of the file, with their parameters.
        let programs = |c: &mut Val2Client<MemoryLine>| {
            let text = c.line_mut().emulator_mut().text();
            let end = text.find(".LOCATIONS").or(text.find(".REALS"));
            text[..end.unwrap_or(text.len())].to_owned()
        };
        assert_eq!(programs(&mut new), programs(&mut old), "{case}");
    }
}

#[test]
fn parameters_of_a_program_are_part_of_it() {
    let memory = ".PROGRAM PICK(N, #AT)\n MOVE #AT\n.END\n.PROGRAM NONE()\n TYPE 1\n.END\n";
    let mut client = client(Profile::val2(), memory);
    let backup = client.backup().unwrap();
    assert_eq!(
        backup,
        ".PROGRAM NONE\n TYPE 1\n.END\n.PROGRAM PICK(N,#AT)\n MOVE #AT\n.END\n"
    );
    let other = backup.replace("(N,#AT)", "(N)").replace("#AT", "N");
    assert_matches!(
        client.restore(&other, false),
        Err(ArmError::Conflict { .. })
    );
    client.restore(&other, true).unwrap();
    assert!(client.backup().unwrap().contains(".PROGRAM PICK(N)\n"));
    let spelled = ".program pick ( n , #at )\n move #AT\n\n.end\n";
    client.restore(spelled, true).unwrap();
    assert_eq!(client.backup().unwrap(), backup);
    client
        .store_program("PICK(A)", &["TYPE A".to_owned()])
        .unwrap();
    assert!(
        client
            .backup()
            .unwrap()
            .contains(".PROGRAM PICK(A)\n TYPE A\n")
    );
}

#[test]
fn programs_named_like_the_scratch_ones_are_restored() {
    let mut client = client(Profile::val2(), ".PROGRAM PGN0\n TYPE 0\n.END\n");
    let names = ["A", "B", "PGN0", "PGN2"];
    let text = names.map(|name| format!(".PROGRAM {name}\n TYPE 0\n.END\n"));
    client.restore(&text.concat(), false).unwrap();
    assert_eq!(client.backup().unwrap(), text.concat());
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
fn a_listing_with_numbered_steps_is_stored_as_its_steps() {
    let mut client = client(Profile::val2(), "");
    let steps = "  1.  10 APPRO PART,50\n   2.  MOVES PART\n  3. TYPE \"1. done\"\n";
    let text = format!(".PROGRAM PICK\n{steps}.END\n");
    client.restore(&text, false).unwrap();
    let stored = client.program("PICK").unwrap();
    let trimmed: Vec<&str> = stored.iter().map(|step| step.trim()).collect();
    assert_eq!(
        trimmed,
        ["10 APPRO PART,50", "MOVES PART", "TYPE \"1. done\""]
    );
}

#[test]
fn a_text_that_is_no_backup_is_refused_by_its_line() {
    let mut client = client(Profile::val2(), "");
    let sent = client.line().traffic();
    for (text, line) in [
        ("MOVE P1", 1),
        (".PROGRAM belt(a b)\n.END", 1),
        (".PROGRAM belt(1)\n.END", 1),
        (".PROGRAM belt(a\n.END", 1),
        (".PROGRAM A\n.END\n.PROGRAM a(b)\n.END", 3),
        (".REALS\nA 1\nB[1] 2\na 1\n.END", 4),
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
