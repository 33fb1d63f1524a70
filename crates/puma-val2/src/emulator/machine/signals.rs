//! Signals: 1 to 64 are outputs, 1001 to 1064 inputs, 2001 to 2064 soft signals.

use crate::emulator::message::{Fault, Message};

/// Number of signals of each kind.
const COUNT: u16 = 64;

/// First number of the outputs, the inputs and the soft signals.
pub(crate) const BANKS: [u16; 3] = [1, 1001, 2001];

#[derive(Clone, Debug, Default)]
pub(crate) struct Signals {
    banks: [u64; 3],
}

impl Signals {
    fn locate(number: u16) -> Result<(usize, u64), Fault> {
        BANKS
            .iter()
            .position(|&first| (first..first + COUNT).contains(&number))
            .map(|bank| (bank, 1 << (number - BANKS[bank])))
            .ok_or(Message::IllegalSignal.into())
    }

    pub(crate) fn get(&self, number: u16) -> Result<bool, Fault> {
        let (bank, bit) = Self::locate(number)?;
        Ok(self.banks[bank] & bit != 0)
    }

    /// Sets any signal, inputs included.
    pub(crate) fn set(&mut self, number: u16, on: bool) -> Result<(), Fault> {
        let (bank, bit) = Self::locate(number)?;
        if on {
            self.banks[bank] |= bit;
        } else {
            self.banks[bank] &= !bit;
        }
        Ok(())
    }

    /// Sets an output or a soft signal; a negative number switches it off.
    pub(crate) fn command(&mut self, number: i32) -> Result<(), Fault> {
        let magnitude = u16::try_from(number.unsigned_abs()).map_err(|_| Message::IllegalSignal)?;
        if (BANKS[1]..BANKS[1] + COUNT).contains(&magnitude) {
            return Err(Message::IllegalSignal.into());
        }
        self.set(magnitude, number > 0)
    }

    /// Switches all outputs off.
    pub(crate) fn reset_outputs(&mut self) {
        self.banks[0] = 0;
    }

    /// Returns the states of the first `count` signals of a bank.
    pub(crate) fn bank(&self, bank: usize, count: usize) -> impl Iterator<Item = bool> + '_ {
        (0..count).map(move |i| self.banks[bank] >> i & 1 != 0)
    }
}
