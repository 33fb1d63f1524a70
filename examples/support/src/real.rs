//! A controller on a line, a real camera, and the person beside them.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Write};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use clap::Args;
use grasp_agent::{AgentConfig, HybridSettings, ServoSettings, TaughtGoal};
use hough_heuristic::{CircleDetector, Features};
use pipeline_sim::Scene;
use puma_grasp::{BallDetector, LiveCamera, Rig};
use puma_val2::{Joint, JointDelta, Joints};

use crate::program::{Outcome, STOP, go_on};

/// Options of the programs that drive an arm.
#[derive(Args, Clone, Debug)]
pub struct RealOptions {
    /// Serial device of a VAL II controller or emulator, 9600 8N1; needs --camera or --rendered
    #[arg(long, value_name = "PATH", conflicts_with = "tcp")]
    pub port: Option<String>,
    /// Socket of a VAL II controller or emulator, as HOST:PORT
    #[arg(long, value_name = "ADDR")]
    pub tcp: Option<String>,
    /// Frames of a real camera on the hand, Y4M or with --raw: `-` for standard input, a named
    /// pipe, or `| COMMAND`, such as '| ffmpeg -i /dev/video0 -f yuv4mpegpipe -pix_fmt yuv420p -';
    /// or a device of Linux, /dev/video0 (cargo's --features v4l2)
    #[arg(long, value_name = "SOURCE", conflicts_with = "rendered")]
    pub camera: Option<String>,
    /// Size of the frames of --camera: of a device; or of bytes of gray without any header
    #[arg(long, value_name = "WxH", requires = "camera", value_parser = size)]
    pub raw: Option<(u32, u32)>,
    /// Longest time from the exposure of a frame to its arrival, milliseconds; frames that arrive
    /// sooner after a move are dropped
    #[arg(long, value_name = "MS", requires = "camera", default_value_t = 100)]
    pub camera_delay: u64,
    /// Radius of the real ball, millimetres
    #[arg(long, value_name = "MM", default_value_t = 20.0, value_parser = radius)]
    pub ball_radius: f64,
    /// Drive the arm on the line toward a rendered ball
    #[arg(long)]
    pub rendered: bool,
    /// Monitor speed of the controller on the line
    #[arg(long, value_name = "PERCENT", default_value_t = 10.0, value_parser = percent)]
    pub speed: f64,
    /// Ask nothing before the arm moves, and do not wait between runs
    #[arg(long)]
    pub yes: bool,
}

/// Parses the size of a frame, for the command line.
///
/// # Errors
/// Text that is no such size.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once('x').and_then(|(width, height)| {
        let sides: (u32, u32) = (width.parse().ok()?, height.parse().ok()?);
        (sides.0 > 0 && sides.1 > 0).then_some(sides)
    });
    sides.ok_or_else(|| format!("{text} is no size; give it as 640x480"))
}

fn between(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("{text} is no number"))?;
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(format!("{text} is out of range; give {least} to {most}"))
}

fn radius(text: &str) -> Result<f64, String> {
    between(text, 5.0, 60.0)
}

fn percent(text: &str) -> Result<f64, String> {
    between(text, 1.0, 100.0)
}

impl RealOptions {
    /// Returns the name of the line, if there is one.
    fn line(&self) -> Option<&str> {
        self.port.as_deref().or(self.tcp.as_deref())
    }

    /// Refuses a real arm that would follow pictures of a ball that is not there, and a camera
    /// without an arm.
    ///
    /// # Errors
    /// An option without the one that it needs.
    pub fn check(&self) -> Result<(), String> {
        match (self.line(), &self.camera) {
            (Some(line), None) if !self.rendered => Err(format!(
                "the arm on {line} needs the frames of its camera: give --camera, or --rendered \
                 to drive it toward a ball that exists in rendered frames only"
            )),
            (None, Some(_)) => {
                Err("--camera needs the arm that carries it: give --port or --tcp".into())
            }
            _ => Ok(()),
        }
    }

    /// Returns the ratio of the ball's radius to that of the paper's ball.
    pub fn ball_size(&self) -> f64 {
        self.ball_radius / 20.0
    }

    /// Returns the goal of a ball of another size than the paper's, seen by the paper's camera.
    ///
    /// # Errors
    /// Settings without a goal.
    pub fn goal(&self, config: &AgentConfig) -> Outcome<Option<TaughtGoal>> {
        if (self.ball_radius - 20.0).abs() < 1e-9 {
            return Ok(None);
        }
        let Features { x, y, r } = HybridSettings::paper().goal;
        let seen = Features::new(x, y, r * self.ball_size());
        let from = Joints::from_degrees(ServoSettings::GOAL_POSE);
        let goal = TaughtGoal::new(&config.goal, seen, from, config.grip);
        goal.map(Some)
            .ok_or_else(|| "the settings have no goal".into())
    }

    /// Fits the settings of an agent to this ball, this goal and a real camera, whose frames may be
    /// late.
    #[must_use]
    pub fn fit(&self, config: AgentConfig, goal: Option<&TaughtGoal>) -> AgentConfig {
        let mut config = goal.into_iter().fold(config, AgentConfig::with_taught_goal);
        config.approach_radius *= self.ball_size();
        config.left_behind *= self.ball_size();
        if self.camera.is_some() {
            config.lag_check = Some(JointDelta::of(Joint::J1, 3_f64.to_radians()));
        }
        config
    }

    /// Opens the camera if there is one, asks before anything moves, and connects to the arm: an
    /// emulated one, in real time if `realtime` is set, or the one on the line. Returns it with the
    /// detector for its frames.
    ///
    /// # Errors
    /// Camera or line cannot be opened, or the question was not answered with yes.
    pub fn open(
        &self,
        detector: BallDetector,
        realtime: bool,
        scene: &Scene,
        seed: u64,
    ) -> Outcome<(Rig, Box<dyn CircleDetector + Send>)> {
        let camera = self.open_camera()?;
        let width = camera.as_ref().map_or(768, |camera| camera.dimensions().0);
        let detector = detector.build_for(width, self.ball_size(), seed)?;
        if let Some(line) = self.line()
            && !self.yes
        {
            let speed = self.speed;
            let answer = self.ask(&format!(
                "The arm on {line} will calibrate and move, at {speed} % speed. Keep clear of it, \
                 with a hand on the emergency stop. Go on? [y/N] "
            ))?;
            if !matches!(answer.to_lowercase().as_str(), "y" | "yes") {
                return Err("not confirmed; nothing has moved".into());
            }
        }
        let mut rig = match (&self.port, &self.tcp) {
            (None, None) => Rig::emulated(realtime, scene, seed, &STOP)?,
            (None, Some(address)) => Rig::on_socket(address, self.speed, scene, seed, &STOP)?,
            #[cfg(feature = "serial")]
            (Some(path), _) => Rig::on_port(path, self.speed, scene, seed, &STOP)?,
            #[cfg(not(feature = "serial"))]
            (Some(_), _) => return Err("this program was built without serial lines".into()),
        };
        rig.cell()
            .with(|cell| cell.ball.radius = self.ball_radius / 1000.0);
        if let Some(camera) = camera {
            rig = rig.seen_by(camera);
        }
        Ok((rig, detector))
    }

    fn open_camera(&self) -> Outcome<Option<LiveCamera>> {
        let Some(source) = &self.camera else {
            return Ok(None);
        };
        let mut camera = LiveCamera::open(source, self.raw, &STOP)?;
        camera.delay = Duration::from_millis(self.camera_delay);
        Ok(Some(camera))
    }

    /// Asks a question of the person at the terminal: on the standard streams, or on the terminal
    /// itself where the camera has standard input.
    ///
    /// # Errors
    /// Nobody there.
    pub fn ask(&self, question: &str) -> Outcome<String> {
        let mut out = io::stdout();
        write!(out, "{question}").and_then(|()| out.flush())?;
        let on_terminal = self.camera.as_deref() == Some("-");
        let (answered, answers) = mpsc::channel();
        // A signal ends the program while this thread still waits.
        thread::spawn(move || {
            let mut answer = String::new();
            let read = if on_terminal {
                File::open("/dev/tty").and_then(|tty| BufReader::new(tty).read_line(&mut answer))
            } else {
                io::stdin().lock().read_line(&mut answer)
            };
            let _ = answered.send(read.map(|count| (count, answer)));
        });
        loop {
            go_on()?;
            match answers.recv_timeout(Duration::from_millis(50)) {
                Ok(Ok((1.., answer))) => return Ok(answer.trim().to_owned()),
                Err(RecvTimeoutError::Timeout) => {}
                _ => {
                    return Err(
                        "nobody answers; give --yes for an arm that may move unasked".into(),
                    );
                }
            }
        }
    }

    /// Prepares run number `run` on a real ball: after the first one the jaws open, and the arm
    /// goes to READY, where the person at the terminal may take the ball and put it elsewhere.
    ///
    /// # Errors
    /// Faults of the arm, and nobody at the terminal.
    pub fn next_ball(&self, rig: &mut Rig, run: usize) -> Outcome {
        if rig.is_simulated() {
            return Ok(());
        }
        if run > 1 && !self.yes {
            self.ask("Hold the ball, then press Enter: the jaws open, and the arm goes up. ")?;
        }
        rig.clear_for(Joints::READY)?;
        if !self.yes {
            self.ask(&format!(
                "Ball {run}: put it on its stand, then press Enter. "
            ))?;
        }
        Ok(())
    }
}
