//! A session held by Python and pyserial on a real pseudo-terminal. Without Python or pyserial it
//! is skipped, and says so.

use std::path::Path;
use std::process::Command;

use puma_val2::{Emulator, EmulatorServer, Profile, PumaParams, ServeConfig};

/// A Python that has pyserial: the one named by `PUMA_VAL2_PYTHON`, or one on the path.
fn python() -> Option<String> {
    let named = std::env::var("PUMA_VAL2_PYTHON").ok();
    named
        .into_iter()
        .chain(["python3".to_owned(), "python".to_owned()])
        .find(|name| {
            Command::new(name)
                .args(["-c", "import serial; serial.Serial"])
                .output()
                .is_ok_and(|o| o.status.success())
        })
}

#[test]
fn pyserial_holds_the_example_session_and_reopens_the_line() {
    let Some(python) = python() else {
        println!("skipped: no Python with pyserial (PUMA_VAL2_PYTHON names one)");
        return;
    };
    let emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
    let server = EmulatorServer::pty(emulator, ServeConfig::default()).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/session.py");
    let output = Command::new(python)
        .arg(script)
        .arg(server.address())
        .output()
        .unwrap();
    let screen = String::from_utf8_lossy(&output.stdout).replace("\r\n", "\n");
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{screen}\n{complaints}");
    println!("{screen}");
    if std::env::var_os("REGENERATE").is_some() {
        std::fs::write(
            Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/pyserial.txt"),
            &screen,
        )
        .unwrap();
        return;
    }
    let expected = include_str!("../golden/pyserial.txt").replace("\r\n", "\n");
    assert_eq!(screen, expected);
}
