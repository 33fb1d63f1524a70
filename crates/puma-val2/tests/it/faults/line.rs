//! A line that damages what passes.

use std::io;
use std::time::Duration;

use puma_val2::{Emulator, MemoryLine, Transport};
use rand::{RngExt, rngs::Xoshiro256PlusPlus};

/// Damage to one character.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Damage {
    Lost,
    Doubled,
    Flipped(u8),
    /// It and all that follow, for ever.
    Cut,
    /// The line reports its end.
    Closed,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    ToController,
    FromController,
}

/// Damages that noise causes.
pub(crate) const CHARACTERS: [&dyn Fn(usize) -> Damage; 4] = [
    &|_| Damage::Lost,
    &|_| Damage::Doubled,
    &|at| Damage::Flipped((at % 7) as u8),
    &|at| Damage::Flipped(((at + 3) % 7) as u8),
];

/// Something that happens to a controller.
pub(crate) type Disturbance = Box<dyn FnOnce(&mut Emulator)>;

/// A line that damages characters.
pub(crate) struct FaultyLine {
    pub(crate) inner: MemoryLine,
    /// Damage to the character of this number, counted from when it was set.
    pub(crate) single: Option<(Way, usize, Damage)>,
    /// Damage to any character with this probability.
    pub(crate) noise: Option<(f64, Xoshiro256PlusPlus)>,
    pub(crate) counted: [usize; 2],
    pub(crate) closed: bool,
    pub(crate) cut: bool,
    pub(crate) struck: bool,
    /// The first of these texts that comes from the controller is made the second.
    pub(crate) forge: Option<(&'static str, &'static str)>,
    /// Done once, when the arm has been moving for a while.
    pub(crate) disturb: Option<Disturbance>,
    moving_since: Option<Duration>,
}

impl FaultyLine {
    pub(crate) fn new(emulator: Emulator) -> Self {
        Self {
            inner: MemoryLine::new(emulator),
            single: None,
            noise: None,
            counted: [0; 2],
            closed: false,
            cut: false,
            struck: false,
            forge: None,
            disturb: None,
            moving_since: None,
        }
    }

    pub(crate) fn strike(&mut self, way: Way, at: usize, damage: Damage) {
        self.single = Some((way, at, damage));
        self.counted = [0; 2];
    }

    pub(crate) fn heal(&mut self) {
        self.single = None;
        self.noise = None;
        self.cut = false;
    }

    fn pass(&mut self, bytes: &[u8], way: Way) -> Vec<u8> {
        let mut out = Vec::new();
        for &byte in bytes {
            let count = self.counted[way as usize];
            self.counted[way as usize] += 1;
            let mut damage = None;
            if let Some((w, at, d)) = self.single
                && w == way
                && at == count
            {
                damage = Some(d);
            }
            if let Some((chance, random)) = &mut self.noise
                && random.random_bool(*chance)
            {
                damage = Some(match random.random_range(0..3) {
                    0 => Damage::Lost,
                    1 => Damage::Doubled,
                    _ => Damage::Flipped(random.random_range(0..8)),
                });
            }
            self.struck |= damage.is_some();
            match damage {
                _ if self.cut => {}
                None => out.push(byte),
                Some(Damage::Lost) => {}
                Some(Damage::Doubled) => out.extend([byte, byte]),
                Some(Damage::Flipped(bit)) => out.push(byte ^ (1 << bit)),
                Some(Damage::Cut) => self.cut = true,
                Some(Damage::Closed) => self.closed = true,
            }
        }
        out
    }
}

impl Transport for FaultyLine {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let passed = self.pass(bytes, Way::ToController);
        self.inner.send(&passed)?;
        if self.closed {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<usize>> {
        if self.closed {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let half = buffer.len() / 2;
        let until = self.clock() + timeout;
        loop {
            let left = until.saturating_sub(self.clock());
            let slice = if self.disturb.is_some() {
                left.min(Duration::from_millis(20))
            } else {
                left
            };
            let now = self.clock();
            let since = self.moving_since.get_or_insert(now);
            if !self.inner.emulator().moving() {
                self.moving_since = None;
            } else if now >= *since + Duration::from_millis(150)
                && let Some(disturb) = self.disturb.take()
            {
                disturb(self.inner.emulator_mut());
            }
            let Some(count) = self.inner.receive(&mut buffer[..half], slice)? else {
                if slice < left {
                    continue;
                }
                return Ok(None);
            };
            let mut passed = self.pass(&buffer[..count], Way::FromController);
            if let Some((from, to)) = self.forge
                && let Some(at) = passed
                    .windows(from.len())
                    .position(|w| w == from.as_bytes())
            {
                passed[at..at + to.len()].copy_from_slice(to.as_bytes());
                self.forge = None;
            }
            if self.closed {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            buffer[..passed.len()].copy_from_slice(&passed);
            if !passed.is_empty() {
                return Ok(Some(passed.len()));
            }
        }
    }

    fn clock(&self) -> Duration {
        self.inner.clock()
    }

    fn name(&self) -> &str {
        "faulty"
    }
}
