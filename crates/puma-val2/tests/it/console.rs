//! A person at the terminal of an emulated controller.

use std::time::Duration;

use puma_val2::{Emulator, Profile, PumaParams};

pub(crate) struct Console {
    pub(crate) emulator: Emulator,
    pub(crate) now: Duration,
    /// Everything the terminal has shown.
    pub(crate) screen: String,
}

impl Console {
    /// At the start-up dialogue.
    pub(crate) fn switched_on(profile: Profile) -> Self {
        let mut console = Self {
            emulator: Emulator::new(PumaParams::unimation(), profile),
            now: Duration::ZERO,
            screen: String::new(),
        };
        console.wait(Duration::ZERO);
        console
    }

    /// At the monitor, calibrated, with arm power.
    pub(crate) fn ready() -> Self {
        Self::ready_with(Profile::val2())
    }

    pub(crate) fn ready_with(profile: Profile) -> Self {
        let mut console = Self::switched_on(profile);
        for line in ["N", "N", "CAL", "Y"] {
            console.line(line);
        }
        console
    }

    /// Types a line and returns what follows on the screen until nothing more is due within a
    /// minute, or for a tenth of a second where something goes on and on.
    pub(crate) fn line(&mut self, line: &str) -> String {
        self.typed(&format!("{line}\r"))
    }

    /// Types text with the line ends that it brings, and returns what follows as
    /// [`Console::line`] does.
    pub(crate) fn typed(&mut self, text: &str) -> String {
        let before = self.screen.len();
        let said = self.emulator.feed(text.as_bytes(), self.now);
        self.show(&said);
        self.settle();
        self.screen[before..].to_owned()
    }

    /// Types lines, and returns what follows the last.
    pub(crate) fn lines(&mut self, text: &str) -> String {
        text.lines()
            .map(|line| self.line(line.trim()))
            .last()
            .unwrap_or_default()
    }

    /// Lets the clock jump while the controller waits for nothing but time.
    pub(crate) fn settle(&mut self) {
        let until = self.now + Duration::from_secs(60);
        for _ in 0..4000 {
            match self.emulator.next_deadline() {
                Some(at) if at <= until => self.now = self.now.max(at),
                _ => return,
            }
            let said = self.emulator.poll(self.now);
            self.show(&said);
        }
    }

    /// Lets this much time pass.
    pub(crate) fn wait(&mut self, time: Duration) -> String {
        let before = self.screen.len();
        self.now += time;
        let said = self.emulator.poll(self.now);
        self.show(&said);
        self.screen[before..].to_owned()
    }

    /// Types a line without letting time pass.
    pub(crate) fn line_now(&mut self, line: &str) -> String {
        let said = self.emulator.feed(format!("{line}\r").as_bytes(), self.now);
        self.show(&said);
        String::from_utf8(said).unwrap()
    }

    fn show(&mut self, bytes: &[u8]) {
        self.screen.push_str(std::str::from_utf8(bytes).unwrap());
    }

    /// Stores a program through the editor.
    pub(crate) fn program(&mut self, name: &str, steps: &str) {
        self.line(&format!("EDIT {name}"));
        for step in steps.lines().map(str::trim).filter(|s| !s.is_empty()) {
            let said = self.line(step);
            assert!(!said.contains("\n*"), "{step}: {said}");
        }
        self.line("E");
    }

    /// Runs a program of these steps to its end and returns what it printed.
    pub(crate) fn run(&mut self, steps: &str) -> String {
        self.program("TEST", steps);
        let said = self.line("EXECUTE TEST");
        self.line("DELETEP TEST");
        self.line("Y");
        said
    }

    pub(crate) fn degrees(&self) -> [f64; 6] {
        self.emulator.joints().degrees()
    }

    pub(crate) fn assert_at(&self, degrees: [f64; 6]) {
        let near = self
            .degrees()
            .iter()
            .zip(degrees)
            .all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near, "{} instead of {degrees:?}", self.emulator.joints());
    }
}
