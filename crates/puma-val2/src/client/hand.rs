//! Motions of the hand.

use std::time::Duration;

use nalgebra::Isometry3;

use crate::client::number::plain;
use crate::client::val2_client::Val2Client;
use crate::client::whereabouts::Location;
use crate::client::wire::Failed;
use crate::error::ArmError;
use crate::kinematics::xyzoat::Xyzoat;
use crate::transport::Transport;

impl<T: Transport> Val2Client<T> {
    /// Moves the hand to a pose in the world frame, by `DO MOVE TRANS(...)` with the joints
    /// interpolated, or along a straight line.
    ///
    /// `WHERE` confirms the position within 0.1 mm and the direction within 0.1 degrees. An armed
    /// proximity guard watches this motion too.
    ///
    /// # Errors
    /// [`ArmError::Setting`] if a number of the pose is not finite; [`ArmError::Refused`] if the
    /// controller cannot reach it; otherwise as for
    /// [`Manipulator::move_to`](crate::Manipulator::move_to).
    pub fn move_hand(&mut self, hand: &Xyzoat, straight: bool) -> Result<Location, ArmError> {
        if !hand.is_finite() {
            return Err(ArmError::Setting {
                what: "a hand pose",
                value: hand.to_string(),
                allowed: "six finite numbers",
            });
        }
        let limit = self.longest_motion();
        let mut tries = 0;
        loop {
            // The pose is absolute: commanding it again leads to the same place.
            let outcome = self.send_hand(hand, if straight { "MOVES" } else { "MOVE" }, limit);
            let doubt = self.doubt(outcome, limit)?;
            let stands = self.stand_anywhere().map_err(|error| self.lost(error))?;
            self.check_guard(stands, doubt.is_some())?;
            let location = self.where_().map_err(|error| self.lost(error))?;
            let (off, turned) = apart(&hand.pose(), &location.hand.pose());
            if off < 1e-4 && turned < 0.1 {
                return Ok(location);
            }
            match doubt {
                Some(doubt) if tries < self.wire.config.retries && !doubt.overdue => tries += 1,
                Some(doubt) => return Err(doubt.error),
                None => {
                    let expected = format!("the hand at {hand}");
                    let shown = location.hand.to_string();
                    return Err(self.wire.garbled("a move of the hand", &expected, &shown));
                }
            }
        }
    }

    /// Commands a motion of the hand: in one line where its echo is checked, otherwise as a point
    /// whose display is checked.
    fn send_hand(&mut self, hand: &Xyzoat, word: &str, limit: Duration) -> Result<(), Failed> {
        if !self.wire.checks_echo() {
            let name = self.wire.config.point_name.clone();
            return self.move_to_point(word, &name, hand.val(), None, limit);
        }
        let move_to_pose = format!("{word} TRANS({})", hand.val().map(plain).join(","));
        if let Some(signal) = self.guard {
            return self.run_guarded_once(signal, &[move_to_pose], limit);
        }
        self.command_once(&format!("DO {move_to_pose}"), limit)
            .map(drop)
    }
}

/// Returns the distance of two poses, metres and degrees.
pub(super) fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let off = (a.translation.vector - b.translation.vector).norm();
    (off, a.rotation.angle_to(&b.rotation).to_degrees())
}
