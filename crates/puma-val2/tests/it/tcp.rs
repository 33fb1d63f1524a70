//! An emulator on a socket.

use std::time::Duration;

use puma_val2::{
    ClientConfig, Emulator, EmulatorServer, JointDelta, Manipulator, Profile, PumaParams,
    ServeConfig, TcpLine, Val2Client,
};

#[test]
fn a_session_over_tcp_with_one_terminal_after_the_other() {
    let emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
    let server = EmulatorServer::tcp("127.0.0.1:0", emulator, ServeConfig::default()).unwrap();
    let connect = || {
        let line = TcpLine::connect(server.address(), Duration::from_secs(5)).unwrap();
        Val2Client::connect(line, ClientConfig::for_emulator()).unwrap()
    };
    let mut client = connect();
    client.calibrate().unwrap();
    let delta = JointDelta::from_degrees([10.0, 5.0, 5.0, 0.0, 0.0, 0.0]);
    let joints = client.move_by(delta).unwrap();
    drop(client);
    let again = connect().joints().unwrap();
    assert!((again - joints).degrees().iter().all(|d| d.abs() < 1e-3));
}
