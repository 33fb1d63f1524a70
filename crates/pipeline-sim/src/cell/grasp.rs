//! Contact of hand and ball: gripping, carrying, pushing.

use hough_heuristic::Features;
use nalgebra::{Isometry3, Point3, Vector3};
use puma_val2::{Arm, Gripper, Joints, PumaParams};

use crate::cell::ball::Holder;
use crate::cell::geometry::Cell;
use crate::cell::hand::Capsule;

/// The result of closing the jaws.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Grasp {
    /// The ball is between the pads and moves with the hand.
    Held,
    /// The pads caught the ball beside its middle and squeezed it out.
    Pushed {
        /// Distance the ball moved, metres.
        by: f64,
    },
    /// There was no ball between the jaws.
    Missed,
}

impl Cell {
    /// Closes the jaws with the arm at `joints`.
    ///
    /// The jaws open along the hand's y axis. [`Grasp::Held`]: the ball's middle lies between the
    /// jaws and within [`HandShape::pad_tolerance`](crate::HandShape::pad_tolerance) of the pads'
    /// middle across them; the jaws pull it to the middle. [`Grasp::Pushed`]: it lies between the
    /// jaws but farther out, and the pads press it away along the table until they miss it.
    /// [`Grasp::Missed`]: otherwise, and always for a ball wider than the open jaws and for jaws
    /// that were closed already; the ball stays.
    pub fn close_gripper(&mut self, joints: &Joints) -> Grasp {
        if self.held.is_some() {
            self.jaws = Gripper::Closed;
            return Grasp::Held;
        }
        let were_open = self.jaws == Gripper::Open;
        self.jaws = Gripper::Closed;
        let wrist = self.arm.wrist(joints);
        let ball = wrist.inverse_transform_point(&self.ball.centre);
        let pads = self.arm.flange() + self.hand.tool;
        let across = Vector3::new(ball.x, 0.0, ball.z - pads);
        let miss = across.norm();
        let gap = self.hand.half_opening - self.hand.finger_radius;
        let reach = self.ball.radius + self.hand.finger_radius;
        let between = were_open && self.ball.radius <= gap && ball.y.abs() <= gap && miss <= reach;
        if !between {
            return Grasp::Missed;
        }
        if miss <= self.hand.pad_tolerance {
            let place = Point3::new(ball.x, 0.0, ball.z);
            self.held = Some(place);
            self.ball.centre = wrist * place;
            return Grasp::Held;
        }
        let Some((aside, by)) = way_out(&wrist, &across, reach) else {
            return Grasp::Missed;
        };
        self.slide_ball(aside * by);
        Grasp::Pushed { by }
    }

    /// Opens the jaws. A held ball falls straight down, onto its holder if that is below, else onto
    /// the table; it slides off the side of a holder.
    pub fn open_gripper(&mut self) {
        self.jaws = Gripper::Open;
        if self.held.take().is_none() {
            return;
        }
        let ball = &mut self.ball;
        match self.holder {
            Some(h) if (ball.centre.xy() - h.foot).norm() <= h.radius => {
                ball.centre = Point3::new(h.foot.x, h.foot.y, h.top + h.rise(ball));
            }
            holder => {
                ball.centre.z = self.table + ball.radius;
                let Some(h) = holder else { return };
                let aside = ball.centre.xy() - h.foot;
                let missing = h.radius + ball.radius - aside.norm();
                if let Some(out) = aside.try_normalize(1e-9).filter(|_| missing > 0.0) {
                    ball.centre += Vector3::new(out.x, out.y, 0.0) * missing;
                }
            }
        }
    }

    /// Moves the ball with the hand, now at `joints`, and returns the distance it was pushed: a
    /// held ball moves along; one that finger, palm or camera overlap is pushed aside with its
    /// holder until they only touch.
    fn follow(&mut self, joints: &Joints) -> f64 {
        if let Some(place) = self.held {
            self.ball.centre = self.arm.wrist(joints) * place;
            return 0.0;
        }
        let start = self.ball.centre;
        let bodies = self.hand_bodies(joints);
        // Pushing it off one body may push it into another.
        for _ in 0..8 {
            let centre = self.ball.centre;
            let gaps = bodies
                .iter()
                .map(|body| (body.gap_to_sphere(&centre, self.ball.radius), body));
            let deepest = gaps.min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((gap, body)) = deepest.filter(|(gap, _)| *gap < -1e-9) else {
                break;
            };
            let away = centre - body.nearest_axis_point(&centre);
            let level = Vector3::new(away.x, away.y, 0.0);
            let aside = level.try_normalize(1e-9).unwrap_or_else(Vector3::x);
            // Sideways along the table, far enough to clear a gap that opens obliquely.
            let slant = aside.dot(&away.try_normalize(1e-9).unwrap_or(aside));
            self.slide_ball(aside * (-gap / slant.max(0.25)));
        }
        (self.ball.centre - start).norm()
    }

    /// Moves the hand from one pose to another, all joints in step, and the ball with it; returns
    /// how far the ball was pushed, metres.
    ///
    /// A held ball moves with the hand. One that finger, palm or camera run into is pushed aside
    /// along the table, with its holder if it stands on it.
    pub fn sweep(&mut self, from: &Joints, to: &Joints) -> f64 {
        /// Greatest joint step between two checks for contact on the way, radians.
        const STEP: f64 = 0.02;
        if self.held.is_some() {
            return self.follow(to);
        }
        // Too far away to meet: the wrist's path stays within half its length of the nearer end,
        // and the hand within its reach of the wrist.
        let wrist_at = |joints: &Joints| self.arm.wrist(joints).translation.vector;
        let (start, end) = (wrist_at(from), wrist_at(to));
        let bodies = self.hand_bodies(from);
        let reach = |body: &Capsule| {
            let ends = [body.from, body.to].map(|end| (end.coords - start).norm());
            ends[0].max(ends[1]) + body.radius
        };
        let hand = bodies.iter().map(reach).fold(0.0, f64::max);
        // Length of the arm to the wrist, and number of the joints that move the wrist.
        let (arm, moving) = match &self.arm {
            Arm::Puma(PumaParams { a2, a3, d2, d4, .. }) => {
                (a2.abs() + d2.abs() + a3.hypot(*d4), 3)
            }
            Arm::Serial { axes, home, .. } => {
                let points = axes.iter().map(|(point, _)| point.coords);
                let points: Vec<_> = points.chain([home.translation.vector]).collect();
                (
                    points
                        .windows(2)
                        .map(|ends| (ends[1] - ends[0]).norm())
                        .sum(),
                    6,
                )
            }
        };
        let turns: [f64; 6] = std::array::from_fn(|i| (to.0[i] - from.0[i]).abs());
        let way: f64 = turns[..moving].iter().sum();
        let ball = self.ball.centre.coords;
        let nearer = (ball - start).norm().min((ball - end).norm());
        if nearer > hand + self.ball.radius + 0.5 * arm * way {
            return 0.0;
        }
        let turned = turns.into_iter().fold(0.0, f64::max);
        let steps = (turned / STEP).ceil().clamp(1.0, 1000.0) as usize;
        let (before, mut pushed) = (self.ball.centre, false);
        for i in 1..=steps {
            let t = i as f64 / steps as f64;
            let at = |j: usize| from.0[j] + t * (to.0[j] - from.0[j]);
            pushed |= self.follow(&Joints(std::array::from_fn(at))) > 0.0;
        }
        if pushed {
            (self.ball.centre - before).norm()
        } else {
            0.0
        }
    }

    /// Moves the ball, with the holder if it stands on it.
    fn slide_ball(&mut self, by: Vector3<f64>) {
        let carried = self.holder.is_some_and(|h| h.carries(&self.ball));
        self.ball.centre += by;
        if let Some(Holder { foot, .. }) = self.holder.as_mut().filter(|_| carried) {
            *foot += by.xy();
        }
    }

    /// Moves the ball, with its holder, along the camera's line of sight until it shows with radius
    /// `r` units: nearer for a greater r. Returns `true` if there is such a place above the table.
    pub fn push_to_radius(&mut self, joints: &Joints, r: f64) -> bool {
        let Some(outline) = self.outline(joints) else {
            return false;
        };
        let now = Features::from_circle(&outline.circle(), self.camera.size().0);
        match self.ball_showing(joints, &Features { r, ..now }) {
            Some(place) if place.z > self.table + self.ball.radius => {
                self.place_ball(place);
                true
            }
            _ => false,
        }
    }
}

/// Returns the horizontal direction in which a ball leaves the pads, and the distance to go until
/// it is `reach` away from their middle; `across` is its offset from there in the hand frame,
/// without the part along the jaws.
fn way_out(
    wrist: &Isometry3<f64>,
    across: &Vector3<f64>,
    reach: f64,
) -> Option<(Vector3<f64>, f64)> {
    let level = |v: Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
    // Straight away unless that is nearly vertical; else along the more level axis of the hand.
    let axes = [Vector3::x(), Vector3::z()].map(|axis| level(wrist * axis));
    let away = level(wrist * across);
    let aside = if away.norm() > 0.1 * across.norm() {
        away
    } else if axes[0].norm() > axes[1].norm() {
        axes[0]
    } else {
        axes[1]
    }
    .try_normalize(1e-9)?;
    // |across + by * along| = reach, with only what is across the jaws counting.
    let turned = wrist.rotation.inverse() * aside;
    let along = Vector3::new(turned.x, 0.0, turned.z);
    let (a, b) = (along.norm_squared(), across.dot(&along));
    let c = across.norm_squared() - reach * reach;
    let by = (-b + (b * b - a * c).max(0.0).sqrt()) / a;
    by.is_finite().then_some((aside, by))
}
