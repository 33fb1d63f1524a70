//! A line that damages what passes.

use std::io;
use std::time::Duration;

use puma_val2::{Emulator, MemoryLine, Transport};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// Damage to one character.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Damage {
    Lost,
    Doubled,
    Flipped(u8),
    /// Several bits at once: those of a mask.
    Masked(u8),
    /// It and those after it, this many together.
    Burst(usize),
    /// It and those after it, up to the end of the line.
    Line,
    /// Preceded by another.
    Inserted(u8),
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

impl Way {
    /// Character at the end of a line.
    fn line_end(self) -> u8 {
        match self {
            Self::ToController => b'\r',
            Self::FromController => b'\n',
        }
    }
}

/// Damages that noise causes.
pub(crate) const CHARACTERS: [&dyn Fn(usize) -> Damage; 4] = [
    &|_| Damage::Lost,
    &|_| Damage::Doubled,
    &|at| Damage::Flipped((at % 7) as u8),
    &|at| Damage::Flipped(((at + 3) % 7) as u8),
];

/// Damage at random: its chance at any character, its kind, and the ways that it takes.
pub(crate) struct Noise {
    pub(crate) chance: f64,
    pub(crate) kind: fn(&mut Xoshiro256PlusPlus) -> Damage,
    pub(crate) ways: &'static [Way],
    pub(crate) random: Xoshiro256PlusPlus,
}

impl Noise {
    /// Any of the three things that happen to a character, in both directions.
    pub(crate) fn of_all_kinds(chance: f64, seed: u64) -> Self {
        Self {
            chance,
            kind: |random| match random.random_range(0..3) {
                0 => Damage::Lost,
                1 => Damage::Doubled,
                _ => Damage::Flipped(random.random_range(0..8)),
            },
            ways: &[Way::ToController, Way::FromController],
            random: Xoshiro256PlusPlus::seed_from_u64(seed),
        }
    }
}

/// Something that happens to a controller.
pub(crate) type Disturbance = Box<dyn FnOnce(&mut Emulator)>;

/// A line that damages characters.
pub(crate) struct FaultyLine {
    pub(crate) inner: MemoryLine,
    /// Damage to the character of this number, counted from when it was set.
    pub(crate) single: Option<(Way, usize, Damage)>,
    /// Damage to any character with this probability.
    pub(crate) noise: Option<Noise>,
    pub(crate) counted: [usize; 2],
    pub(crate) closed: bool,
    /// Number of receipts until one fails, once.
    pub(crate) fails_once: Option<usize>,
    pub(crate) cut: bool,
    pub(crate) struck: bool,
    /// The first of these texts that comes from the controller is made the second.
    pub(crate) forge: Option<(&'static str, &'static str)>,
    /// Done once, when the arm has been moving for a while.
    pub(crate) disturb: Option<Disturbance>,
    moving_since: Option<Duration>,
    /// Characters that a burst still takes.
    burst: usize,
}

impl FaultyLine {
    pub(crate) fn new(emulator: Emulator) -> Self {
        Self {
            inner: MemoryLine::new(emulator),
            single: None,
            noise: None,
            counted: [0; 2],
            closed: false,
            fails_once: None,
            cut: false,
            struck: false,
            forge: None,
            disturb: None,
            moving_since: None,
            burst: 0,
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
            if let Some(noise) = &mut self.noise
                && noise.ways.contains(&way)
                && noise.random.random_bool(noise.chance)
            {
                damage = Some((noise.kind)(&mut noise.random));
            }
            if self.burst > 0 {
                self.burst -= 1;
                damage = Some(Damage::Lost);
                if self.burst > 1000 && byte == way.line_end() {
                    self.burst = 0;
                }
            }
            self.struck |= damage.is_some();
            match damage {
                _ if self.cut => {}
                None => out.push(byte),
                Some(Damage::Lost) => {}
                Some(Damage::Doubled) => out.extend([byte, byte]),
                Some(Damage::Flipped(bit)) => out.push(byte ^ (1 << bit)),
                Some(Damage::Masked(bits)) => out.push(byte ^ bits),
                Some(Damage::Burst(count)) => self.burst = count - 1,
                Some(Damage::Line) if byte == way.line_end() => {}
                Some(Damage::Line) => self.burst = usize::MAX,
                Some(Damage::Inserted(other)) => out.extend([other, byte]),
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
        self.fails_once = match self.fails_once {
            Some(0) => {
                self.fails_once = None;
                return Err(io::ErrorKind::Interrupted.into());
            }
            left => left.map(|count| count - 1),
        };
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
