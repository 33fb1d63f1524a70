//! The cell: arm, camera, hand, ball and table, and what follows from where the joints stand.

use hough_heuristic::{Circle, Features};
use nalgebra::{Isometry3, Point3, Vector3};
use puma_val2::{Gripper, Joint, Joints, PumaParams};

use crate::cell::ball::{Ball, Holder};
use crate::cell::camera::Camera;
use crate::cell::ellipse::Ellipse;
use crate::cell::hand::{Capsule, Hand};
use crate::cell::mount::Mount;
use crate::error::{ReachError, SightError};

/// When a ball counts as seen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SightRule {
    /// Smallest radius, feature units.
    pub min_radius: f64,
    /// Greatest radius, feature units.
    pub max_radius: f64,
    /// Least share of the outline inside the frame, 0..=1.
    pub min_share: f64,
}

impl Default for SightRule {
    /// Radius 5 to 68 units, at least 60 % of the outline inside the frame (and, always, the centre
    /// inside the frame).
    fn default() -> Self {
        Self {
            min_radius: 5.0,
            max_radius: 68.0,
            min_share: 0.6,
        }
    }
}

impl SightRule {
    /// Whether a ball with this outline counts as seen in a frame of `size` pixels.
    pub fn sees(&self, outline: &Ellipse, size: (u32, u32)) -> bool {
        self.check(outline, size).is_ok()
    }

    /// As [`SightRule::sees`], with the reason.
    ///
    /// # Errors
    /// What keeps the ball from being seen: [`SightError::LargerThanView`], [`SightError::Radius`],
    /// [`SightError::CentreOutside`], [`SightError::CutOff`]. [`SightError::NotFinite`] for a rule
    /// that is NaN.
    pub fn check(&self, outline: &Ellipse, size: (u32, u32)) -> Result<(), SightError> {
        for (quantity, value) in [
            ("the smallest radius seen (units)", self.min_radius),
            ("the greatest radius seen (units)", self.max_radius),
            (
                "the least share of the outline inside the frame",
                self.min_share,
            ),
        ] {
            if value.is_nan() {
                return Err(SightError::NotFinite { quantity, value });
            }
        }
        let circle = outline.circle();
        let Features { r, .. } = Features::from_circle(&circle, size.0);
        let (width, height) = (f64::from(size.0), f64::from(size.1));
        let (w, h) = outline.half_extent();
        // Whatever else is wrong with a ball that cannot fit into the frame follows from that.
        let why = |error| {
            if (2.0 * w > width || 2.0 * h > height) && r >= self.min_radius {
                SightError::LargerThanView {
                    width_px: 2.0 * w,
                    height_px: 2.0 * h,
                    frame_width: size.0,
                    frame_height: size.1,
                }
            } else {
                error
            }
        };
        if !(self.min_radius..=self.max_radius).contains(&r) {
            return Err(why(SightError::Radius {
                r,
                least: self.min_radius,
                greatest: self.max_radius,
            }));
        }
        let inside =
            (-0.5..=width - 0.5).contains(&circle.x) && (-0.5..=height - 0.5).contains(&circle.y);
        if !inside {
            return Err(why(SightError::CentreOutside {
                x: circle.x,
                y: circle.y,
            }));
        }
        let share = outline.share_inside(size.0, size.1);
        if share >= self.min_share {
            Ok(())
        } else {
            Err(why(SightError::CutOff {
                share,
                least: self.min_share,
            }))
        }
    }

    /// Whether a round outline with these features counts as seen in the paper's frame of 192x144
    /// units.
    pub fn sees_features(&self, features: &Features) -> bool {
        let Circle { x, y, radius } = features.to_circle(768);
        let finite = [x, y, radius].iter().all(|v| v.is_finite());
        let outline = Ellipse {
            centre: nalgebra::Point2::new(x, y),
            major: radius,
            minor: radius,
            angle: 0.0,
        };
        finite && self.sees(&outline, (768, 576))
    }
}

/// Joint angles that a task keeps to, inside the arm's own ranges. Radians.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WorkingLimits {
    /// Lower limits, `JT1` first.
    pub min: [f64; 6],
    /// Upper limits, `JT1` first.
    pub max: [f64; 6],
}

impl WorkingLimits {
    /// The limits of the reaching task: `JT1` -160..160, `JT2` -150..-20, `JT3` 120..215 degrees,
    /// and the arm's own ranges for the wrist.
    pub fn paper() -> Self {
        Self {
            min: [-160.0_f64, -150.0, 120.0, -110.0, -100.0, -266.0].map(f64::to_radians),
            max: [160.0_f64, -20.0, 215.0, 170.0, 100.0, 266.0].map(f64::to_radians),
        }
    }

    /// Whether all six angles are inside.
    pub fn contain(&self, joints: &Joints) -> bool {
        self.violated(joints).is_none()
    }

    /// The first joint whose angle is outside.
    pub fn violated(&self, joints: &Joints) -> Option<Joint> {
        Joint::ALL.into_iter().find(|joint| {
            let (i, angle) = (joint.index(), joints[*joint]);
            !(angle >= self.min[i] - 1e-9 && angle <= self.max[i] + 1e-9)
        })
    }
}

/// Arm, camera on the hand, ball on its holder, table.
///
/// Everything is in VAL's world frame: metres, origin at the shoulder, z up. The methods are pure
/// geometry: the same joints always give the same answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Link lengths and joint ranges.
    pub params: PumaParams,
    /// The camera.
    pub camera: Camera,
    /// Where the camera sits on the hand.
    pub mount: Mount,
    /// Gripper and camera as bodies.
    pub hand: Hand,
    /// The ball.
    pub ball: Ball,
    /// What the ball stands on; `None` for a ball that hangs, flies or lies in the gripper.
    pub holder: Option<Holder>,
    /// Height of the table's surface, metres.
    pub table: f64,
    /// State of the jaws.
    pub jaws: Gripper,
    /// Where the ball is in the hand frame while the jaws hold it.
    pub held: Option<Point3<f64>>,
    /// When the ball counts as seen.
    pub sight: SightRule,
    /// Joint angles that the task keeps to.
    pub limits: WorkingLimits,
}

impl Cell {
    /// Features of the ball in the middle of the paper's goal intervals (x 99..108, y 74..82, r
    /// 32..34).
    pub const GOAL: Features = Features {
        x: 103.5,
        y: 78.0,
        r: 33.0,
    };

    /// `JT5` while reaching, degrees.
    pub const REACHING_JT5_DEGREES: f64 = 45.0;

    /// The paper's cell with `ball` on a holder, above a table 300 mm below the shoulder.
    pub fn paper(ball: Ball) -> Self {
        Self {
            params: PumaParams::unimation(),
            camera: Camera::paper(),
            mount: Mount::paper(),
            hand: Hand::paper(),
            ball,
            holder: Some(Holder::under(&ball)),
            table: -0.300,
            jaws: Gripper::Open,
            held: None,
            sight: SightRule::default(),
            limits: WorkingLimits::paper(),
        }
    }

    /// Puts the ball, with a holder under it, at another place, out of the jaws if they held it.
    pub fn place_ball(&mut self, centre: Point3<f64>) {
        self.held = None;
        self.ball.centre = centre;
        self.holder = Some(Holder::under(&self.ball));
    }

    /// The pose of the camera frame in the world.
    pub fn camera_pose(&self, joints: &Joints) -> Isometry3<f64> {
        self.params.wrist(joints) * self.mount.0
    }

    /// The outline of the ball in the image, whether or not it lies in the frame; `None` where it
    /// has none (behind the camera, camera inside the ball, joints or ball not finite).
    pub fn outline(&self, joints: &Joints) -> Option<Ellipse> {
        let centre = self
            .camera_pose(joints)
            .inverse_transform_point(&self.ball.centre);
        self.camera.project_sphere(&centre, self.ball.radius).ok()
    }

    /// The ball as the image shows it, in pixels of the camera's frame; `None` if it counts as lost
    /// ([`Cell::sight`]: centre outside the frame, less than 60 % of the outline inside, radius
    /// below 5 or above 68 units).
    pub fn circle(&self, joints: &Joints) -> Option<Circle> {
        self.outline(joints)
            .filter(|outline| self.sight.sees(outline, self.camera.size()))
            .map(|outline| outline.circle())
    }

    /// The paper's image features of the ball, without rendering or detection; `None` if it counts
    /// as lost.
    pub fn features(&self, joints: &Joints) -> Option<Features> {
        self.circle(joints)
            .map(|circle| Features::from_circle(&circle, self.camera.size().0))
    }

    /// As [`Cell::features`], with the reason why there are none.
    ///
    /// # Errors
    /// [`SightError`]: joints, or a measure of arm or mount, that are not finite; a ball without an
    /// outline (behind the camera, around it, nowhere); an outline larger than the view; otherwise
    /// what [`Cell::sight`] asks for and does not get.
    pub fn try_features(&self, joints: &Joints) -> Result<Features, SightError> {
        if let Some(joint) = joints.non_finite() {
            return Err(SightError::JointNotFinite { joint });
        }
        if let Some((quantity, value)) = self.non_finite_measure() {
            return Err(SightError::NotFinite { quantity, value });
        }
        let centre = self
            .camera_pose(joints)
            .inverse_transform_point(&self.ball.centre);
        let outline = self.camera.project_sphere(&centre, self.ball.radius)?;
        self.sight.check(&outline, self.camera.size())?;
        Ok(Features::from_circle(
            &outline.circle(),
            self.camera.size().0,
        ))
    }

    /// The first measure that the camera's pose rests on and that is not finite.
    fn non_finite_measure(&self) -> Option<(&'static str, f64)> {
        let (arm, mount) = (&self.params, &self.mount.0);
        let [a, b, c] = mount.translation.vector.into();
        let [i, j, k, w] = mount.rotation.coords.into();
        let measures = [
            ("the arm's length a2 (m)", arm.a2),
            ("the arm's length a3 (m)", arm.a3),
            ("the arm's length d2 (m)", arm.d2),
            ("the arm's length d4 (m)", arm.d4),
            ("the arm's length d6 (m)", arm.d6),
            ("the place of the camera's mount (m)", a + b + c),
            ("the rotation of the camera's mount", i + j + k + w),
        ];
        measures.into_iter().find(|(_, value)| !value.is_finite())
    }

    /// The point between the finger pads, world frame, metres.
    pub fn tool_point(&self, joints: &Joints) -> Point3<f64> {
        self.params.wrist(joints) * Point3::new(0.0, 0.0, self.params.d6 + self.hand.tool)
    }

    /// Distance from the tool point to the centre of the ball, metres.
    pub fn grip_miss(&self, joints: &Joints) -> f64 {
        (self.tool_point(joints) - self.ball.centre).norm()
    }

    /// The angle of `JT5`, radians, that brings the tool point nearest to the ball when all other
    /// joints stay where they are.
    pub fn grip_angle(&self, joints: &Joints) -> f64 {
        // Frame that JT5 turns in: the hand frame turned back by JT5 about the wrist's bending
        // axis. At JT5 = 0 the tool axis is the forearm's axis, and +JT5 turns z toward +x of the
        // hand at JT5 = 0.
        let mut straight = *joints;
        straight.0[Joint::J5.index()] = 0.0;
        straight.0[Joint::J6.index()] = 0.0;
        let ball = self
            .params
            .wrist(&straight)
            .inverse_transform_point(&self.ball.centre);
        ball.x.atan2(ball.z)
    }

    /// Whether all joints are within the working limits.
    pub fn within_limits(&self, joints: &Joints) -> bool {
        self.limits.contain(joints)
    }

    /// Where a ball must be so that the image shows it with these features; `None` if no place
    /// does.
    pub fn ball_showing(&self, joints: &Joints, features: &Features) -> Option<Point3<f64>> {
        let circle = features.to_circle(self.camera.size().0);
        let centre = self.camera.sphere_of_circle(&circle, self.ball.radius)?;
        Some(self.camera_pose(joints) * centre)
    }

    /// The pose, with the hand at `jt5_degrees` and `JT4` = `JT6` = 0, in which the ball shows the
    /// middle of the goal in y and r and lies in the middle between the jaws; elbow up. `None` if
    /// the ball is out of reach or the pose out of the working limits ([`Cell::try_goal_pose`] says
    /// which).
    pub fn goal_pose(&self, jt5_degrees: f64) -> Option<Joints> {
        self.try_goal_pose(jt5_degrees).ok()
    }

    /// As [`Cell::goal_pose`], with the reason why there is none.
    ///
    /// # Errors
    /// [`ReachError`]: a ball, an angle, or a measure of arm or mount that is not finite; a ball
    /// without size; a camera that cannot show the ball as the goal has it; a ball out of the arm's
    /// reach; a pose out of the working limits.
    pub fn try_goal_pose(&self, jt5_degrees: f64) -> Result<Joints, ReachError> {
        let ball = self.ball.centre;
        for (quantity, value) in [
            ("JT5 (degrees)", jt5_degrees),
            ("the x coordinate of the ball (m)", ball.x),
            ("the y coordinate of the ball (m)", ball.y),
            ("the z coordinate of the ball (m)", ball.z),
        ] {
            if !value.is_finite() {
                return Err(ReachError::NotFinite { quantity, value });
            }
        }
        if let Some((quantity, value)) = self.non_finite_measure() {
            return Err(ReachError::NotFinite { quantity, value });
        }
        let radius = self.ball.radius;
        if !(radius.is_finite() && radius > 0.0) {
            return Err(ReachError::BallRadius { radius });
        }
        // The ball's place in the hand is fixed, so forearm, hand and ball are one rigid link: a
        // two-link arm in the plane.
        let hand = Joints::from_degrees([0.0, 0.0, 0.0, 0.0, jt5_degrees, 0.0]);
        let goal = self
            .ball_showing(&hand, &Self::GOAL)
            .ok_or(ReachError::NoView)?;
        let wrist = self.params.wrist(&hand);
        let mut in_hand = wrist.inverse_transform_point(&goal);
        in_hand.y = 0.0;
        let elbow = Point3::new(self.params.a2, self.params.d2, 0.0);
        let link = wrist * in_hand - elbow;
        let (length, angle) = (link.x.hypot(link.z), link.z.atan2(link.x));

        let rho2 = ball.x * ball.x + ball.y * ball.y;
        let forward2 = rho2 - self.params.d2 * self.params.d2;
        if forward2.is_nan() || forward2 <= 0.0 {
            return Err(ReachError::BesideWaist {
                distance: rho2.sqrt(),
                offset: self.params.d2.abs(),
            });
        }
        let forward = forward2.sqrt();
        let jt1 = ball.y.atan2(ball.x) - self.params.d2.atan2(forward);
        // Elevations above the horizon, VAL turning downward for positive JT2 and JT3.
        let distance2 = forward2 + ball.z * ball.z;
        let a2 = self.params.a2;
        let cos_bend = (distance2 - a2 * a2 - length * length) / (2.0 * a2 * length);
        if cos_bend.is_nan() || cos_bend.abs() > 1.0 {
            return Err(ReachError::OutOfReach {
                distance: distance2.sqrt(),
                least: (a2 - length).abs(),
                greatest: a2 + length,
            });
        }
        let bend = cos_bend.acos();
        let shoulder = ball.z.atan2(forward) + (length * bend.sin()).atan2(a2 + length * cos_bend);
        // At JT2 = JT3 = 0 the link stands at `angle`; turning the elbow by JT3 lowers it.
        let jt3 = angle + bend;
        let middle = |i: usize| 0.5 * (self.limits.min[i] + self.limits.max[i]);
        let pose = Joints([
            turned_near(jt1, middle(0)),
            turned_near(-shoulder, middle(1)),
            turned_near(jt3, middle(2)),
            0.0,
            hand.0[4],
            0.0,
        ]);
        match self.limits.violated(&pose) {
            None => Ok(pose),
            Some(joint) => Err(ReachError::OutOfLimits {
                joint,
                angle: pose[joint],
                low: self.limits.min[joint.index()],
                high: self.limits.max[joint.index()],
            }),
        }
    }

    /// Whether the goal can be reached with the hand as it stands while reaching
    /// ([`Cell::REACHING_JT5_DEGREES`]).
    pub fn reachable(&self) -> bool {
        self.goal_pose(Self::REACHING_JT5_DEGREES).is_some()
    }

    /// Whether fingers, palm or camera are about to touch table, holder or ball.
    ///
    /// The ball may be between the open fingers, that is what they are for: it counts when a
    /// finger, the palm or the camera comes nearer to its surface than the sensors' range, which
    /// does not happen in a correct reach and grip. A held ball does not count. Joints, ball or
    /// table that are NaN count as near: nothing says that the way is free.
    pub fn proximity(&self, joints: &Joints) -> bool {
        let range = self.hand.sensor_range;
        self.hand_bodies(joints)
            .iter()
            .any(|body| self.is_within(range, body))
    }

    /// Whether fingers, palm or camera overlap table, holder or ball (a held ball does not count):
    /// what no hand of metal can do, and what a simulated one that got there has run into. Joints,
    /// ball or table that are NaN count as overlapping.
    pub fn collides(&self, joints: &Joints) -> bool {
        /// Bodies that [`Cell::follow`] has pushed apart touch, to rounding.
        const TOUCH: f64 = -1e-6;
        self.hand_bodies(joints)
            .iter()
            .any(|body| self.is_within(TOUCH, body))
    }

    /// What each of the pair of sensors says, the one on the left finger (the hand's +y) first:
    /// whether its finger is about to touch table, holder or ball, as [`Cell::proximity`] has it
    /// for the whole hand.
    pub fn proximity_pair(&self, joints: &Joints) -> [bool; 2] {
        let [left, right, ..] = self.hand_bodies(joints);
        [left, right].map(|finger| self.is_within(self.hand.sensor_range, &finger))
    }

    /// Whether a part of the hand is nearer to something than `range`, or cannot be told not to be
    /// (a place that is NaN).
    fn is_within(&self, range: f64, body: &Capsule) -> bool {
        let holder = self.holder.map(|h| Capsule {
            from: Point3::new(h.foot.x, h.foot.y, self.table),
            to: Point3::new(h.foot.x, h.foot.y, h.top - h.radius),
            radius: h.radius,
        });
        let near = |gap: f64| gap.is_nan() || gap < range;
        near(body.gap_to_plane(self.table))
            || (self.held.is_none()
                && near(body.gap_to_sphere(&self.ball.centre, self.ball.radius)))
            || holder.is_some_and(|h| near(body.gap_to(&h)))
    }

    /// Fingers, palm and camera, in the world frame. Closed fingers stand as far apart as the ball
    /// is wide if they hold it.
    pub fn hand_bodies(&self, joints: &Joints) -> [Capsule; 4] {
        let wrist = self.params.wrist(joints);
        let apart = match self.jaws {
            Gripper::Open => self.hand.half_opening,
            Gripper::Closed if self.held.is_some() => self.ball.radius + self.hand.finger_radius,
            Gripper::Closed => self.hand.finger_radius,
        };
        let [left, right] = self.hand.fingers(self.params.d6, apart);
        [
            left.moved(&wrist),
            right.moved(&wrist),
            self.hand.palm(self.params.d6).moved(&wrist),
            self.hand.camera_body().moved(&(wrist * self.mount.0)),
        ]
    }

    /// The optical axis in the world frame.
    pub fn viewing_direction(&self, joints: &Joints) -> Vector3<f64> {
        self.camera_pose(joints) * Vector3::z()
    }
}

/// The angle that differs from `angle` by whole turns and is nearest to `reference`.
fn turned_near(angle: f64, reference: f64) -> f64 {
    use std::f64::consts::TAU;
    angle - TAU * ((angle - reference) / TAU).round()
}
