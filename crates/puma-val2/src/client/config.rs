//! Settings of the client.

use std::time::Duration;

use crate::kinematics::params::PumaParams;

/// Settings of a [`Val2Client`](super::Val2Client). The defaults suit a real controller behind a
/// USB serial adapter.
#[derive(Clone, Debug, PartialEq)]
pub struct ClientConfig {
    /// Silence after which a prompt counts as one (default: 30 ms). Every exchange waits this long.
    /// A USB adapter delivers in bursts up to 16 ms apart: with less than that, a `.` in mid-reply
    /// can be taken for the prompt. 1 to 2 ms suit an emulator.
    pub quiet: Duration,
    /// Silence after which a reply counts as missing and the prompt is asked for (default: 1 s). A
    /// value that is too small slows the exchange but does no harm.
    pub reply_timeout: Duration,
    /// Longest time of a motion, a calibration or anything else that moves the arm (default: 60 s).
    /// The arm is stopped after it. A motion that takes longer at the speed set, or at SPEED 1
    /// where none has been set, gets twice the time it takes.
    pub motion_timeout: Duration,
    /// Longest time for finding a prompt in [`Val2Client::connect`](super::Val2Client::connect)
    /// (default: 10 s); loading from a floppy takes longer.
    pub connect_timeout: Duration,
    /// Monitor speed set by `connect`, percent, above 0, at most 327.67 (default: none, `connect`
    /// leaves it as it is).
    pub speed_percent: Option<f64>,
    /// Greatest distance of a joint from its goal that counts as reached, radians (default: 0.05
    /// degrees). A PUMA 560 stands at encoder counts up to 0.009 degrees apart; less than 0.01
    /// degrees makes good moves fail.
    pub tolerance: f64,
    /// Number of repetitions after a fault of the line (default: 3). 0 reports the first fault.
    pub retries: usize,
    /// Compares what is typed with its echo before the line is ended, if the controller echoes at
    /// all (default: yes). The check costs one round trip; without it a character lost on the line
    /// can change a command.
    pub check_echo: bool,
    /// Command for coordinated motions (default: automatic).
    pub way: MoveWay,
    /// Answer to a start-up question that speaks of loading (default: yes).
    pub load_from_floppy: bool,
    /// Answer to a start-up question that speaks of initializing, which erases programs and
    /// locations (default: no).
    pub initialize: bool,
    /// Makes `connect` abort a program that runs or asks for values (default: no). While a program
    /// runs, the position can be read and moves are refused.
    pub abort_running_program: bool,
    /// `true` if the controller understands Ctrl-C, Ctrl-Q and Ctrl-U (default: yes). Otherwise
    /// they are not sent.
    pub control_characters: bool,
    /// Number of further tries of `calibrate` while arm power is off (default: 0).
    pub power_retries: usize,
    /// Pause between these tries (default: 2 s).
    pub power_retry_delay: Duration,
    /// Name of the precision point that the client uses for its moves (default: `PGOAL`), letters
    /// and digits, at most six.
    pub point_name: String,
    /// The input that the pair of proximity sensors is wired to (default: 1001).
    pub proximity_signal: u16,
    /// Longest reply that is kept, bytes (default: 16384); a longer one is an error.
    pub reply_limit: usize,
    /// Prompt of the idle monitor (default: `.`).
    pub idle_prompt: char,
    /// Prompt of the monitor while a program runs (default: `*`).
    pub run_prompt: char,
    /// Geometry and limits (default: [`PumaParams::unimation`]). Moves out of the ranges are
    /// refused before anything is sent, and the two halves of `WHERE` are compared.
    pub params: PumaParams,
}

impl Default for ClientConfig {
    fn default() -> Self {
        Self {
            quiet: Duration::from_millis(30),
            reply_timeout: Duration::from_secs(1),
            motion_timeout: Duration::from_secs(60),
            connect_timeout: Duration::from_secs(10),
            speed_percent: None,
            tolerance: 0.05_f64.to_radians(),
            retries: 3,
            check_echo: true,
            way: MoveWay::Automatic,
            load_from_floppy: true,
            initialize: false,
            abort_running_program: false,
            control_characters: true,
            power_retries: 0,
            power_retry_delay: Duration::from_secs(2),
            point_name: "PGOAL".into(),
            proximity_signal: 1001,
            reply_limit: 16 * 1024,
            idle_prompt: '.',
            run_prompt: '*',
            params: PumaParams::unimation(),
        }
    }
}

impl ClientConfig {
    /// Returns settings for an emulator on the same machine: 2 ms of quiet.
    pub fn for_emulator() -> Self {
        Self {
            quiet: Duration::from_millis(2),
            ..Self::default()
        }
    }

    /// Returns settings for a line of this speed, 110 to 9600 baud and more: the times of
    /// [`ClientConfig::default`], or as many characters as these times are worth at 9600 baud
    /// where that is longer.
    pub fn for_baud(baud: u32) -> Self {
        let characters = |count| Duration::from_secs(10) * count / baud.max(1);
        let usual = Self::default();
        Self {
            quiet: usual.quiet.max(characters(4)),
            reply_timeout: usual.reply_timeout.max(characters(100)),
            connect_timeout: usual.connect_timeout.max(characters(1000)),
            ..usual
        }
    }

    /// Returns the longest time of a reply that waits for no motion.
    pub(super) fn patience(&self) -> Duration {
        self.reply_timeout.saturating_mul(4)
    }
}

/// Command for a motion of several joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MoveWay {
    /// `DRIVE` for a relative move of one joint, `#PPOINT` for other moves, `POINT` where the
    /// controller does not know `#PPOINT` or echoes nothing. The display of `POINT` shows what has
    /// arrived.
    Automatic,
    /// `DO DRIVE` for each joint, one after the other.
    Drive,
    /// `DO MOVE #PPOINT(...)`: one line, all joints together.
    Ppoint,
    /// `POINT #name`, the values, an empty line, `DO MOVE #name`: all joints together.
    Point,
}
