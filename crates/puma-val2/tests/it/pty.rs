//! A real pseudo-terminal, opened through the `serial2` crate.

use puma_val2::{
    ArmError, ClientConfig, Emulator, EmulatorServer, Gripper, JointDelta, Manipulator, Profile,
    PumaParams, SerialLine, ServeConfig, Val2Client,
};

fn emulator() -> Emulator {
    Emulator::new(PumaParams::unimation(), Profile::val2())
}

#[test]
fn a_pseudo_terminal_can_be_closed_and_opened_again() {
    let server = EmulatorServer::pty(emulator(), ServeConfig::default()).unwrap();
    let path = server.address().to_owned();
    let connect = || {
        Val2Client::connect(
            SerialLine::open(&path, 9600).unwrap(),
            ClientConfig::for_emulator(),
        )
    };

    let mut client = connect().unwrap();
    client.calibrate().unwrap();
    let joints = client
        .move_by(JointDelta::from_degrees([10.0, 5.0, 5.0, 0.0, 0.0, 0.0]))
        .unwrap();
    assert!(
        (server.with_emulator(|e| e.joints()) - joints)
            .degrees()
            .iter()
            .all(|d| d.abs() < 1e-3)
    );
    drop(client);

    let mut client = connect().unwrap();
    assert!(
        (client.joints().unwrap() - joints)
            .degrees()
            .iter()
            .all(|d| d.abs() < 1e-3)
    );
    client.set_gripper(Gripper::Closed).unwrap();
    assert_eq!(server.with_emulator(|e| e.gripper()), Gripper::Closed);
    drop(server);
    assert_matches!(client.joints(), Err(ArmError::Line { .. }));
}

#[test]
fn the_link_leads_to_the_terminal_and_goes_with_the_server() {
    let folder = std::env::temp_dir().join(format!("puma-val2-link-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let link = folder.join("arm");
    let config = || ServeConfig {
        link: Some(link.clone()),
        ..ServeConfig::default()
    };
    let server = EmulatorServer::pty(emulator(), config()).unwrap();
    let mut client = Val2Client::connect(
        SerialLine::open(link.to_str().unwrap(), 9600).unwrap(),
        ClientConfig::for_emulator(),
    )
    .unwrap();
    client.joints().unwrap();
    drop(server);
    assert!(std::fs::symlink_metadata(&link).is_err());
    std::fs::write(&link, "something of value").unwrap();
    assert!(EmulatorServer::pty(emulator(), config()).is_err());
    let astray = ServeConfig {
        link: Some(folder.join("no such folder/arm")),
        ..ServeConfig::default()
    };
    let problem = EmulatorServer::pty(emulator(), astray)
        .unwrap_err()
        .to_string();
    assert!(
        problem.contains("no such folder/arm cannot be made"),
        "{problem}"
    );
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn real_time_takes_the_time_of_the_motion() {
    let config = ServeConfig {
        realtime: true,
        ..ServeConfig::default()
    };
    let profile = Profile {
        start_calibrated: true,
        start_power: Some(true),
        ..Profile::val2()
    };
    let server =
        EmulatorServer::pty(Emulator::new(PumaParams::unimation(), profile), config).unwrap();
    let line = SerialLine::open(server.address(), 9600).unwrap();
    let mut client = Val2Client::connect(line, ClientConfig::for_emulator()).unwrap();
    client.set_speed(50.0).unwrap();
    let begun = std::time::Instant::now();
    client
        .move_by(JointDelta::from_degrees([41.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
        .unwrap();
    // 41 degrees at half of 82 degrees per second, and the ramps.
    assert!(begun.elapsed().as_secs_f64() > 1.0);
}
