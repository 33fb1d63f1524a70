//! Subcommands that need the monitor.

use std::fs;
use std::io::{self, IsTerminal, Read, Write};
use std::path::Path;
use std::time::Duration;

use serde_json::{Value, json};

use crate::client::{ClientConfig, Location, Val2Client};
use crate::error::ArmError;
use crate::joints::{Joint, JointDelta, Joints};
use crate::kinematics::xyzoat::Xyzoat;
use crate::manipulator::{Gripper, Manipulator};
use crate::program::failure::Failure;
use crate::program::files::write_whole;
use crate::program::keys;
use crate::program::link::Link;
use crate::program::{Command, Globals};

pub(super) type Client<'a> = Val2Client<&'a mut Link>;

impl Command {
    /// Returns the speed of a command that moves the arm.
    fn speed(&self) -> Option<f64> {
        match self {
            Self::Jog { speed, .. } | Self::Move { speed, .. } | Self::Run { speed, .. } => {
                Some(speed.percent)
            }
            _ => None,
        }
    }

    /// Returns `true` if the arm may move.
    pub(super) fn moves(&self) -> bool {
        let by_line = |line: &[String]| {
            let line = line.join(" ").trim().to_ascii_uppercase();
            let mut words = line.split(|c: char| !c.is_ascii_alphabetic());
            let word = words.next().unwrap_or_default();
            let moving = ["DO", "CALIBRATE", "EXECUTE", "PROCEED", "RETRY", "NEXT"];
            moving
                .iter()
                .any(|m| !word.is_empty() && m.starts_with(word))
        };
        match self {
            Self::Calibrate | Self::Hand { .. } => true,
            Self::Send { line } => by_line(line),
            _ => self.speed().is_some(),
        }
    }

    /// Returns a description of the motion that is asked about.
    fn motion(&self) -> String {
        let at = self
            .speed()
            .map(|s| format!(" at {s} % speed"))
            .unwrap_or_default();
        match self {
            Self::Calibrate => "Every joint will move a little.".to_owned(),
            Self::Hand { state } => format!("The hand will {state}."),
            Self::Jog {
                joint: Some(joint),
                degrees: Some(by),
                ..
            } => {
                format!("JT{joint} will turn by {by} degrees{at}.")
            }
            Self::Jog { .. } => format!("The arm will move while a key is held{at}."),
            Self::Move { to, .. } => format!("The arm will move to {}{at}.", to.join(" ")),
            Self::Run { name, .. } => format!("Program {name} will run{at}."),
            Self::Send { line } => format!(
                "`{}` may move the arm, at the monitor's speed.",
                line.join(" ")
            ),
            _ => String::new(),
        }
    }
}

/// Refuses a command that cannot be carried out, or is not confirmed, before the line is opened.
pub(super) fn check(globals: &Globals, command: &Command) -> Result<(), Failure> {
    if let Command::Move {
        to, hand, straight, ..
    } = command
    {
        let is_pose = to.len() == 6;
        if to.len() != 1 && !is_pose {
            return Err(Failure::usage("`move` takes six numbers or one name"));
        }
        if is_pose {
            numbers(to)?;
        }
        if *hand && !is_pose || *straight && is_pose && !*hand {
            return Err(Failure::usage(
                "--hand takes six numbers, --straight a pose of the hand",
            ));
        }
    }
    if matches!(command, Command::Term) && !globals.yes && !io::stdin().is_terminal() {
        let text = "Lines of a file or a pipe may move the arm: say --yes";
        return Err(Failure::unconfirmed(text));
    }
    if let Command::Rm { name } = command {
        confirm(globals, &format!("{name} will be deleted."))?;
    }
    if command.moves() {
        confirm(globals, &command.motion())?;
    }
    Ok(())
}

fn confirm(globals: &Globals, what: &str) -> Result<(), Failure> {
    if globals.yes {
        return Ok(());
    }
    if !io::stdin().is_terminal() {
        return Err(Failure::unconfirmed(format!(
            "{what} Nobody can be asked: say --yes"
        )));
    }
    eprint!("{what} Go on? [y/N] ");
    io::stderr().flush()?;
    let mut answer = String::new();
    io::stdin().read_line(&mut answer)?;
    match answer.trim().to_ascii_lowercase().as_str() {
        "y" | "yes" => Ok(()),
        _ => Err(Failure::unconfirmed("not confirmed: nothing was done")),
    }
}

/// Prints that a command is done.
pub(super) fn done(globals: &Globals, what: &str) -> Result<(), Failure> {
    print(globals, what, &json!({ "done": what }))
}

fn print(globals: &Globals, text: &str, value: &Value) -> Result<(), Failure> {
    let mut out = io::stdout();
    if globals.json {
        writeln!(out, "{value}")?;
    } else if !text.is_empty() {
        writeln!(out, "{}", text.trim_end())?;
    }
    Ok(())
}

pub(super) fn run(
    globals: &Globals,
    command: &Command,
    link: &mut Link,
    mut config: ClientConfig,
) -> Result<(), Failure> {
    config.speed_percent = command.speed();
    let mut client = Val2Client::connect(link, config)?;
    match command {
        Command::Calibrate => {
            client.calibrate()?;
            show_where(globals, &client.where_()?)?;
        }
        Command::Where { watch } => {
            show_where(globals, &client.where_()?)?;
            while *watch && !client.line().take_interrupt() {
                std::thread::sleep(Duration::from_millis(200));
                match client.where_() {
                    Ok(location) => show_where(globals, &location)?,
                    Err(_) if client.line().take_interrupt() => return Ok(()),
                    Err(error) => return Err(error.into()),
                }
            }
        }
        Command::Jog {
            joint: Some(joint),
            degrees: Some(by),
            ..
        } => {
            turn(&mut client, Joint::ALL[usize::from(*joint) - 1], *by)?;
            show_where(globals, &client.where_()?)?;
        }
        Command::Jog { .. } => keys::jog(&mut client)?,
        Command::Move {
            to, hand, straight, ..
        } => {
            go(&mut client, to, *hand, *straight)?;
            show_where(globals, &client.where_()?)?;
        }
        Command::Hand { state } => {
            let (gripper, text) = match state.as_str() {
                "open" => (Gripper::Open, "hand open"),
                _ => (Gripper::Closed, "hand closed"),
            };
            client.set_gripper(gripper)?;
            done(globals, text)?;
        }
        Command::Speed { percent } => {
            client.set_speed(*percent)?;
            done(globals, &format!("speed {percent} %"))?;
        }
        Command::Teach { name } => {
            let values = client.here(name)?;
            let text = values.map(|v| v.to_string()).join(", ");
            print(
                globals,
                &format!("{name} = {text}"),
                &json!({"name": name, "values": values}),
            )?;
        }
        Command::Ls => list(globals, &mut client)?,
        Command::Get { name } => {
            let (head, steps) = client.listed(name)?;
            let body: String = steps.iter().map(|step| format!(" {step}\n")).collect();
            let text = format!(".PROGRAM {head}\n{body}.END");
            let value = json!({"program": name, "head": head, "steps": steps});
            print(globals, &text, &value)?;
        }
        Command::Put { file }
        | Command::Restore {
            file,
            dry_run: false,
        } => {
            restore(globals, &mut client, file)?;
        }
        Command::Restore { file, .. } => {
            let plan = client.restore_plan(&read(file)?);
            show_plan(globals, &plan.map_err(|error| in_file(file, error))?)?;
        }
        Command::Rm { name } => {
            client.remove(name)?;
            done(globals, &format!("{name} deleted"))?;
        }
        Command::Backup { file } => {
            let text = client.backup()?;
            if file.as_os_str() == "-" {
                print(globals, &text, &json!({ "backup": text }))?;
            } else {
                write_whole(file, text.as_bytes())?;
                let lines = text.lines().count();
                done(
                    globals,
                    &format!("{lines} lines written to {}", file.display()),
                )?;
            }
        }
        Command::Run {
            name, wait: true, ..
        } => {
            let said = client.execute(name)?;
            let lines: Vec<&str> = said.split(['\r', '\n']).filter(|l| !l.is_empty()).collect();
            let output = &lines[1..lines.len().saturating_sub(1).max(1)];
            print(
                globals,
                &output.join("\n"),
                &json!({"program": name, "output": output}),
            )?;
        }
        Command::Run { name, cycles, .. } => {
            client.start(name, *cycles)?;
            done(globals, &format!("{name} started"))?;
        }
        Command::Status => said(globals, &mut client, "STATUS")?,
        Command::Io => said(globals, &mut client, "IO")?,
        Command::Send { .. } if command.moves() && !client.echoes() => {
            return Err(Failure::usage(
                "the controller echoes nothing, so that a damaged line could be another motion: \
                 `move`, `jog` and `run` compare what has arrived",
            ));
        }
        Command::Send { line } => said(globals, &mut client, &line.join(" "))?,
        Command::Signal { number, state } => {
            let signed = i32::from(*number);
            match state.as_deref() {
                Some("on") => client.set_signal(signed)?,
                Some(_) => client.set_signal(-signed)?,
                None => {}
            }
            let on = client.signal(*number)?;
            let text = format!("{number} {}", if on { "on" } else { "off" });
            print(globals, &text, &json!({"signal": number, "on": on}))?;
        }
        Command::Stop | Command::Term | Command::Emulate(_) => {}
    }
    for notice in client.take_notices() {
        let _ = writeln!(io::stderr(), "note: {notice}");
    }
    Ok(())
}

fn numbers(words: &[String]) -> Result<[f64; 6], Failure> {
    let number = |word: &String| word.parse::<f64>().ok().filter(|v| v.is_finite());
    let values: Option<Vec<f64>> = words.iter().map(number).collect();
    let six = values.and_then(|values| values.try_into().ok());
    six.ok_or_else(|| Failure::usage(format!("`{}` are not six numbers", words.join(" "))))
}

/// Turns one joint by an angle in degrees.
pub(super) fn turn(client: &mut Client<'_>, joint: Joint, by: f64) -> Result<Joints, ArmError> {
    let by = by.to_radians();
    if client.echoes() {
        client.drive(joint, by, 100.0)
    } else {
        client.move_by(JointDelta::of(joint, by))
    }
}

fn go(client: &mut Client<'_>, to: &[String], hand: bool, straight: bool) -> Result<(), Failure> {
    if to.len() == 6 {
        let values = numbers(to)?;
        if hand {
            client.move_hand(&Xyzoat::from_val(values), straight)?;
        } else {
            client.move_to(Joints::from_degrees(values))?;
        }
        return Ok(());
    }
    let name = &to[0];
    if name.eq_ignore_ascii_case("ready") {
        client.ready()?;
        return Ok(());
    }
    let values = client.location(name)?;
    if name.starts_with('#') {
        client.move_to(Joints::from_degrees(values))?;
    } else {
        client.move_hand(&Xyzoat::from_val(values), straight)?;
    }
    Ok(())
}

fn show_where(globals: &Globals, location: &Location) -> Result<(), Failure> {
    let joints = location.joints.degrees();
    let text = format!("joints {}\nhand   {}", location.joints, location.hand);
    print(
        globals,
        &text,
        &json!({"joints_deg": joints.map(rounded), "xyzoat": location.hand.val().map(rounded)}),
    )
}

/// Rounds to the digits that a controller shows.
fn rounded(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

/// Types a line and prints the answer; a message of the controller is a refusal.
fn said(globals: &Globals, client: &mut Client<'_>, line: &str) -> Result<(), Failure> {
    let text = client.send_line(line)?;
    let lines: Vec<&str> = text.lines().collect();
    print(globals, &text, &json!({"line": line, "answer": lines}))?;
    let is_message = |l: &&&str| l.len() > 2 && l.starts_with('*') && l[1..].contains('*');
    if let Some(message) = lines.iter().find(is_message) {
        let text = format!("`{line}` was refused: {message}");
        return Err(Failure { text, code: 3 });
    }
    match lines.last() {
        Some(question) if question.ends_with('?') => Err(Failure::unconfirmed(format!(
            "`{line}` asks {question:?}, which was left with no: answer it in `val2 term`"
        ))),
        _ => Ok(()),
    }
}

fn list(globals: &Globals, client: &mut Client<'_>) -> Result<(), Failure> {
    let programs = client.programs()?;
    let mut names = |list: &str, words: usize| -> Result<Vec<String>, Failure> {
        let text = client.send_line(list)?;
        let rows = text.lines().map(|line| line.split_whitespace().collect());
        let named = rows.filter(|row: &Vec<&str>| row.len() == words);
        Ok(named.map(|row| row[0].to_owned()).collect())
    };
    let (locations, reals) = (names("LISTL", 7)?, names("LISTR", 2)?);
    let all = [
        ("programs ", &programs),
        ("locations", &locations),
        ("reals    ", &reals),
    ];
    let text =
        all.map(|(kind, names)| format!("{kind}  {}", names.join(" ")).trim_end().to_owned());
    let value = json!({"programs": programs, "locations": locations, "reals": reals});
    print(globals, &text.join("\n"), &value)?;
    Ok(())
}

fn read(file: &Path) -> Result<String, Failure> {
    let text = if file.as_os_str() == "-" {
        let mut text = String::new();
        io::stdin().read_to_string(&mut text).map(|_| text)
    } else {
        fs::read_to_string(file)
    };
    text.map_err(|error| Failure {
        text: format!("{}: {error}", file.display()),
        code: 1,
    })
}

fn restore(globals: &Globals, client: &mut Client<'_>, file: &Path) -> Result<(), Failure> {
    let text = read(file)?;
    let mut outcome = client.restore(&text, globals.yes);
    if let Err(error @ ArmError::Conflict { port, names }) = &outcome {
        if !io::stdin().is_terminal() {
            return Err(Failure::unconfirmed(format!(
                "{error}: --yes replaces them"
            )));
        }
        let what = format!("{port} holds other contents of {names}, to be replaced.");
        client.line().asking(|| confirm(globals, &what))?;
        outcome = client.restore(&text, true);
    }
    let plan = outcome.map_err(|error| in_file(file, error))?;
    show_plan(globals, &plan)
}

/// Returns the failure of a text with the name of its file.
fn in_file(file: &Path, error: ArmError) -> Failure {
    let by_line = matches!(error, ArmError::Text { .. } | ArmError::Step { .. });
    let mut failure = Failure::from(error);
    if by_line {
        failure.text = format!("{}: {}", file.display(), failure.text);
    }
    failure
}

fn show_plan(globals: &Globals, plan: &[String]) -> Result<(), Failure> {
    let text = match plan {
        [] => "the file holds nothing".to_owned(),
        plan => plan.join("\n"),
    };
    print(globals, &text, &json!({ "plan": plan }))
}
