//! Functions of the fuzz targets: bytes for one parser each, and texts to begin with.
//!
//! The targets of the folder `fuzz` include this file.

use std::cell::RefCell;
use std::io;
use std::time::Duration;

use puma_val2::{
    ClientConfig, Emulator, Gripper, Joint, JointDelta, Location, Manipulator, MemoryLine, Profile,
    PumaParams, Transport, Val2Client,
};

type Target = (&'static str, fn(&[u8]), &'static [&'static str]);

/// Name, function and first texts of each target.
pub(crate) const TARGETS: &[Target] = &[
    (
        "val2_backup",
        backup,
        &[BACKUP, "\n.program p ( a )\n10\n.end"],
    ),
    ("val2_client", client, &[REPLIES]),
    ("val2_emulator", emulator, &[SESSION, BOOT, PROGRAMMING]),
    ("val2_reply", reply, &[WHERE]),
    ("val2_text", text, &[BACKUP, VAL]),
    #[cfg(feature = "urdf")]
    ("val2_urdf", urdf, &[ROBOT]),
];

/// Gives the bytes to the target of this name.
pub(crate) fn run(name: &str, data: &[u8]) {
    let target = TARGETS.iter().find(|target| target.0 == name);
    target.expect("a target of this name").1(data);
}

const BACKUP: &str = ".PROGRAM PICK(N,#AT)\n 10 APPRO PART,50 ; above\n MOVES PART:TRANS(,,N)\n\
 IF N > 2 GOTO 10\n FOR I = 1 TO 3\n TYPE \"1. done\",/S,N\n END\n CALL PICK(N, #AT)\n.END\n\
.PROGRAM C\n C = 3E-5\n.END\n.LOCATIONS\n#REST 10.5,-85,95,0,0,-0.125\nPART 400,150,300,90,90,0\n\
Q[2,1] 1,2,3,-170.5,10,179.999\n.END\n.REALS\nA[3] -1.25\nN 3e-7\n.END\n";

const VAL: &str = "3.PROGRAM OLD\n SETI N = 3\n IF N EQ 3 THEN 20\n IFSIG 1001,,-1003 THEN 20\n\
 20 REMARK don't\n TYPE parts\n SHIFT P BY 1,,2\n FRAME F = A,B,C\n GOSUB OLD\n.END\n";

const SESSION: &str = "4WHERE\rDO DRIVE 1,10,100\rDO MOVE TRANS(400,150,300,90,90,0)\r\
HERE P:Q\r1,,3\r\rEDIT A,2\rMOVES P\rREACTI 1001,A ALWAYS\rE\rEXECUTE A,-1,2\rABORT\r\
LISTL\rSTORE F=A\rLOAD F\r";

const BOOT: &str = "0Y\rMAYBE\rN\rCALIBRATE\rY\rDO NEST\rZERO\rY\rDONE\rY\rN\rN\rSTATUS\r";

const PROGRAMMING: &str = "4EDIT B\rFOR I=1 TO 9 STEP -2\rIF SIG(1,-2) THEN\rELSE IF I<2 THEN\r\
END\rEND\rWAIT 1001\r\
PROMPT \"n \",N\rCASE N OF\rVALUE 1:\rANY\rEND\rDECOMPOSE A[]=#P\rR HALT\rT P\rI\r\
TYPE /F8.2,N,/X3,BITS(1,4)\r\rD 2\rS 1\rP 9\rC A\rE\rPCEXECUTE B,-1\rPRIME B\rPROCEED\r7\rPCEND\r";

const REPLIES: &str = "\u{1}.\u{20}\r\nCan this be (Y/N)? \u{a}\r\n*Arm off*\u{4}\r\n.";

const WHERE: &str = "WHERE\r\n X Y Z O A T\r\n -20.32 149.09 921.12 90 -90 0\r\n JT1 JT2 JT3 JT4 \
JT5 JT6\r\n 0.000 -90.000 90.000 0.000 0.000 -0.001\r\n.";

fn connected() -> Val2Client<MemoryLine> {
    let emulator = Emulator::new(PumaParams::unimation(), Profile::val2());
    Val2Client::connect(MemoryLine::new(emulator), ClientConfig::default())
        .expect("a sound controller answers")
}

/// A text as a backup: what can be restored is backed up and restored again.
fn backup(data: &[u8]) {
    thread_local! {
        /// An empty controller. To connect takes longer than to refuse most texts.
        static EMPTY: RefCell<Option<Val2Client<MemoryLine>>> = const { RefCell::new(None) };
    }
    let text = String::from_utf8_lossy(data);
    let plan =
        EMPTY.with_borrow_mut(|empty| empty.get_or_insert_with(connected).restore_plan(&text));
    let mut client = match plan {
        Ok(_) => connected(),
        Err(_) => return,
    };
    if client.restore(&text, true).is_err() {
        return;
    }
    let backup = client.backup().expect("a sound controller lists");
    let kept = client
        .restore(&backup, false)
        .expect("a backup is restored");
    let is_kept = |line: &String| line.starts_with("keep ");
    assert!(kept.iter().all(is_kept), "{backup}");
}

/// Bytes typed to a controller, at its start-up or when it is calibrated. The first one chooses
/// the profile.
fn emulator(data: &[u8]) {
    let Some((&kind, data)) = data.split_first() else {
        return;
    };
    let profile = Profile {
        // Programs without end take few steps.
        step_time: Duration::from_millis(50),
        ..Profile::all()[usize::from(kind) % 4].clone()
    };
    let mut emulator = Emulator::new(PumaParams::unimation(), profile);
    let mut now = Duration::ZERO;
    if kind & 4 != 0 {
        emulator.feed(b"N\rN\rCAL\rY\r", now);
    }
    for chunk in data.chunks(64) {
        now += Duration::from_secs(2);
        assert!(emulator.feed(chunk, now).len() < 1 << 22);
        assert!(emulator.joints().0.iter().all(|angle| angle.is_finite()));
    }
}

/// A text as a controller's reply to `WHERE`.
fn reply(data: &[u8]) {
    if let Some(location) = Location::parse(&String::from_utf8_lossy(data)) {
        assert!(location.joints.0.iter().all(|angle| angle.is_finite()));
    }
}

/// A text as stored programs, locations and variables. The first character chooses the profile.
fn text(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let kind = data.first().map_or(0, |kind| usize::from(*kind));
    let text = text.trim_start_matches(|c: char| c.is_ascii_digit());
    let mut emulator = Emulator::new(PumaParams::unimation(), Profile::all()[kind % 4].clone());
    if emulator.load_text(text).is_ok() {
        let stored = emulator.text();
        emulator
            .load_text(&stored)
            .expect("what was written is read");
        assert_eq!(emulator.text().lines().count(), stored.lines().count());
    }
}

/// Pieces of bytes with silences between; then silence.
struct Script<'a>(&'a [u8], Duration);

impl Transport for Script<'_> {
    fn send(&mut self, _: &[u8]) -> io::Result<()> {
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        // The first byte of a piece gives its length, or a silence instead.
        let Some((&head, rest)) = self.0.split_first() else {
            self.1 += timeout;
            return Ok(None);
        };
        let count = usize::from(head % 64).min(rest.len()).min(buffer.len());
        self.0 = &rest[count..];
        if head >= 192 || count == 0 {
            self.1 += timeout;
            return Ok(None);
        }
        self.1 += timeout.min(Duration::from_millis(1));
        buffer[..count].copy_from_slice(&rest[..count]);
        Ok(Some(count))
    }

    fn clock(&self) -> Duration {
        self.1
    }

    fn name(&self) -> &str {
        "script"
    }
}

/// Bytes as what a controller says to a client, whatever it is asked.
fn client(data: &[u8]) {
    let Ok(mut client) = Val2Client::connect(Script(data, Duration::ZERO), ClientConfig::default())
    else {
        return;
    };
    let step = JointDelta::of(Joint::J1, 0.1);
    let _ = client.calibrate();
    let _ = client.joints();
    let _ = client.move_by(step);
    let _ = client.set_gripper(Gripper::Closed);
    let _ = client.signal(1001);
    let _ = client.backup();
    if let Ok(mut resident) = client.resident() {
        let _ = resident.move_by(step);
    }
    let _ = client.arm_proximity(1001);
    let _ = client.move_by(step);
    assert!(client.take_notices().len() <= 100);
    assert!(client.line().clock() < Duration::from_secs(100_000));
}

#[cfg(feature = "urdf")]
const ROBOT: &str = "<robot name='r'><link name='base'/><link name='hand'/><link name='arm'/>\
<joint name='pan' type='continuous'><parent link='base'/><child link='arm'/><axis xyz='0 0 2'/>\
<origin xyz='0 0 0.1' rpy='0 0 1.57'/></joint><joint name='lift' type='revolute'>\
<parent link='arm'/><child link='hand'/><axis xyz='0 -1 0'/><origin xyz='0.2 0 0'/>\
<limit lower='-1' upper='2' velocity='1'/></joint></robot>";

/// A text as the description of an arm.
#[cfg(feature = "urdf")]
fn urdf(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let joints = ["pan", "", "lift", "", "", ""];
    if let Ok(arm) = puma_val2::Arm::from_urdf(&text, "hand", joints) {
        let hand = puma_val2::Kinematics::forward(&arm, &puma_val2::Joints::default());
        assert!(hand.translation.vector.iter().all(|v| !v.is_nan()));
    }
}
