//! A frame to be taken.

use hough_heuristic::image::GrayImage;
use puma_val2::{JointDelta, Joints};

use crate::cell::geometry::Cell;
use crate::render::renderer::Renderer;
use crate::render::shot::Shot;
use crate::render::truth::RoundOutline;

/// A frame to be taken: the cell, the arm and its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Snapshot {
    /// Cell to be seen.
    pub cell: Cell,
    /// Joints when the shutter opens.
    pub joints: Joints,
    /// Speeds of the joints, radians per second.
    pub speed: JointDelta,
    /// Exposure of the frame.
    pub shot: Shot,
}

impl Snapshot {
    /// Returns cell and joints `seconds` after the shutter opened.
    pub fn moment(&self, seconds: f64) -> (Cell, Joints) {
        let moved = JointDelta(self.speed.0.map(|v| v * seconds));
        (self.cell, self.joints + moved)
    }

    /// Draws the frame.
    pub fn take<'a>(&self, renderer: &'a mut Renderer) -> &'a GrayImage {
        renderer.take(&self.shot, |seconds| self.moment(seconds))
    }

    /// Returns the round outlines that the frame shows ([`Renderer::truth`]) in the middle of its
    /// exposure.
    pub fn truth(&self, renderer: &Renderer) -> Vec<RoundOutline> {
        let (cell, joints) = self.moment(self.shot.middle());
        renderer.truth(&cell, &joints)
    }
}
