//! A frame to be taken.

use hough_heuristic::image::GrayImage;
use puma_val2::{JointDelta, Joints};
use rand::{Rng, RngExt};

use crate::cell::ball::Ball;
use crate::cell::camera::Camera;
use crate::cell::distortion::Distortion;
use crate::cell::geometry::Cell;
use crate::cell::workspace::Workspace;
use crate::error::QuantityError;
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
        (
            self.cell,
            self.joints + JointDelta(self.speed.0.map(|v| v * seconds)),
        )
    }

    /// Draws the frame.
    pub fn take<'a>(&self, renderer: &'a mut Renderer) -> &'a GrayImage {
        renderer.take(&self.shot, |seconds| self.moment(seconds))
    }

    /// Returns the round outlines that the frame shows ([`Renderer::truth`]) in the middle of its
    /// exposure.
    pub fn truth(&self, renderer: &Renderer) -> Vec<RoundOutline> {
        let (cell, joints) = self.middle();
        renderer.truth(&cell, &joints)
    }

    fn middle(&self) -> (Cell, Joints) {
        self.moment(0.5 * (self.shot.exposure + self.shot.interlace.unwrap_or(0.0)))
    }
}

/// Lens, motion and sight of the ball of a snapshot.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// A lens with barrel distortion.
    pub(super) barrel: bool,
    /// The ball out of sight.
    pub(super) empty: bool,
    pub(super) exposure: Exposure,
}

/// Motion during the exposure.
#[derive(Clone, Copy, Debug)]
pub(super) enum Exposure {
    /// None.
    Still,
    /// The arm moves.
    Motion,
    /// The arm moves, in two fields.
    Interlaced,
}

impl View {
    /// Draws a random ball and a random pose of the arm on its way from a search pose to the ball.
    ///
    /// The radius of the ball in the image is log-uniform over the radii on such ways.
    pub(super) fn snapshot(
        &self,
        size: (u32, u32),
        rng: &mut dyn Rng,
    ) -> Result<Snapshot, QuantityError> {
        let workspace = Workspace::paper();
        let mut cell = Cell::paper(Ball::at(0.6, 0.1, -0.1));
        if self.barrel {
            cell.camera = loop {
                let k1 = rng.random_range(-0.35..-0.10);
                let lens = Distortion {
                    k1,
                    k2: rng.random_range(0.0..0.08),
                    ..Distortion::default()
                };
                if let Ok(camera) = Camera::paper().with_distortion(lens) {
                    break camera;
                }
            };
        }
        let poses = workspace.search_poses();
        loop {
            let (ball, pose) = workspace
                .sample_seen_ball(&cell, rng)
                .unwrap_or((cell.ball, poses[0]));
            cell.place_ball(ball.centre);
            let Ok(goal) = cell.goal_pose(Cell::REACHING_JT5_DEGREES) else {
                continue;
            };
            let t: f64 = rng.random_range(0.0..1.0);
            let aside = [0.0; 6].map(|_: f64| rng.random_range(-4.0_f64..4.0).to_radians());
            let mut joints = Joints(std::array::from_fn(|i| {
                let wrist = i == 3 || i == 5;
                pose.0[i] + t * (goal.0[i] - pose.0[i]) + if wrist { 0.0 } else { aside[i] }
            }));
            if self.empty {
                // Turned away from the ball.
                joints.0[0] += if joints.0[0] > 0.0 { -0.9 } else { 0.9 };
            }
            let seen = cell.features(&joints).is_ok_and(|f| f.r > 6.0);
            let gone = cell
                .outline(&joints)
                .is_none_or(|o| o.share_inside(768, 576) == 0.0);
            if cell.params.check(&joints).is_err() || !(if self.empty { gone } else { seen }) {
                continue;
            }
            let mut speed = JointDelta::default();
            let mut shot = Shot::still();
            if !matches!(self.exposure, Exposure::Still) {
                // Image speeds of up to some hundred pixels a second.
                for i in 0..3 {
                    speed.0[i] = rng.random_range(-0.30..0.30);
                }
                let exposure = rng.random_range(0.005..0.015);
                shot = match self.exposure {
                    Exposure::Interlaced => Shot::pal(exposure, 3),
                    _ => Shot {
                        exposure: 1.5 * exposure,
                        moments: 6,
                        interlace: None,
                    },
                };
            }
            cell.camera = cell.camera.resized(size.0, size.1)?;
            return Ok(Snapshot {
                cell,
                joints,
                speed,
                shot,
            });
        }
    }
}
