//! The cell: arm, camera, hand, ball and table, and the geometry between them.

use hough_heuristic::{Circle, Features};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use puma_val2::{Arm, Gripper, Joint, JointDelta, Joints, Kinematics, PumaParams};

use crate::cell::ball::{Ball, Holder};
use crate::cell::camera::Camera;
use crate::cell::ellipse::ProjectedEllipse;
use crate::cell::hand::{Capsule, HandShape};
use crate::cell::sight::SightRule;
use crate::error::{QuantityError, SightError, finite, positive};

/// Arm, camera on the hand, ball on its holder, table.
///
/// Lengths and places are in VAL's world frame: metres, origin at the shoulder, z up. The methods
/// are pure geometry: equal joints give equal answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Geometry of the arm.
    pub arm: Arm,
    /// Camera on the hand.
    pub camera: Camera,
    /// Pose of the camera frame (see [`Camera`]) in the hand frame ([`Arm::wrist`]); of a PUMA its
    /// origin is the wrist centre. Its z axis is the tool axis.
    pub mount: Isometry3<f64>,
    /// Gripper and camera as bodies.
    pub hand: HandShape,
    /// Ball to be grasped.
    pub ball: Ball,
    /// Rod under the ball; `None` for a ball that hangs, flies or lies in the gripper.
    pub holder: Option<Holder>,
    /// Height of the table's surface, metres.
    pub table: f64,
    /// State of the jaws.
    pub jaws: Gripper,
    /// Place of the ball in the hand frame while the jaws hold it.
    pub held: Option<Point3<f64>>,
    /// Rule by which the ball counts as seen.
    pub sight: SightRule,
    /// Range that the task keeps each joint in, radians (low, high), `JT1` first.
    pub limits: [(f64, f64); 6],
    /// Pose with a ball at the goal; `JT4` to `JT6` stay like this while reaching.
    pub reached: Joints,
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

    /// Returns the paper's cell with `ball` on a holder, above a table 300 mm below the shoulder.
    ///
    /// The camera sits 60 mm off the tool axis on the outer (upper) side of the hand, 4.5 mm to its
    /// left and 20 mm past the wrist centre, its optical axis parallel to the tool axis, image
    /// right along -y and image down along +x. With `JT5` held at 45 degrees the ball then shows at
    /// the paper's goal exactly where turning `JT5` alone brings the gripper to it. The working
    /// limits are `JT1` -160..160, `JT2` -150..-20, `JT3` 120..215 degrees and the arm's own ranges
    /// for the wrist.
    pub fn paper(ball: Ball) -> Self {
        let axes = Matrix3::new(
            0.0, 1.0, 0.0, //
            -1.0, 0.0, 0.0, //
            0.0, 0.0, 1.0,
        );
        let limits = [
            (-160.0_f64, 160.0_f64),
            (-150.0, -20.0),
            (120.0, 215.0),
            (-110.0, 170.0),
            (-100.0, 100.0),
            (-266.0, 266.0),
        ];
        Self {
            arm: PumaParams::unimation().into(),
            camera: Camera::paper(),
            mount: Isometry3::from_parts(
                Translation3::new(-0.060, 0.0045, 0.020),
                UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes)),
            ),
            hand: HandShape::paper(),
            ball,
            holder: Some(Holder::under(&ball)),
            table: -0.300,
            jaws: Gripper::Open,
            held: None,
            sight: SightRule::default(),
            limits: limits.map(|(low, high)| (low.to_radians(), high.to_radians())),
            reached: Joints::from_degrees([0.0, -57.0, 186.0, 0.0, 45.0, 0.0]),
        }
    }

    /// Returns a cell of a UR5 with the paper's camera, a gripper of 100 mm, and `ball` on a holder
    /// above a table 300 mm below the base. At zero the arm is stretched along -x.
    pub fn ur5(ball: Ball) -> Self {
        let paper = Self::paper(ball);
        let arm = Arm::ur5();
        // The paper's mount is in the frame of the wrist, 82.3 mm behind the flange, and `JT5` of a
        // UR5 turns about -y of the hand.
        let half = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI);
        let behind = Isometry3::from_parts(Translation3::new(0.0, 0.0, -0.0823), half);
        let mut hand = paper.hand;
        hand.tool = 0.100;
        Self {
            arm,
            mount: behind * paper.mount,
            hand,
            limits: arm.limits(),
            reached: Joints::from_degrees([0.0, -45.0, 70.0, -80.0, -90.0, 0.0]),
            ..paper
        }
    }

    /// Returns a cell of a desk arm of the size of the SO-101 ([`Arm::so101`]) with a camera of 60
    /// degrees above its hand, a gripper of 140 mm, and `ball` on a holder above a table 100 mm
    /// below the base.
    pub fn so101(ball: Ball) -> Self {
        let paper = Self::paper(ball);
        let arm = Arm::so101();
        let camera = paper.camera;
        let wide = 166.0 / 192.0 * f64::from(camera.size().0) / camera.focal_px();
        let mut hand = paper.hand;
        hand.tool = 0.140;
        Self {
            arm,
            camera: camera.with_focal_factor(wide).unwrap_or(camera),
            mount: Translation3::new(-0.040, 0.0, 0.020) * paper.mount.rotation,
            hand,
            table: -0.100,
            limits: arm.limits(),
            reached: Joints::from_degrees([0.0, 53.0, -33.0, 0.0, 60.0, 0.0]),
            ..paper
        }
    }

    /// Moves the ball, with a holder under it, to `centre`, out of the jaws if they held it.
    pub fn place_ball(&mut self, centre: Point3<f64>) {
        self.held = None;
        self.ball.centre = centre;
        self.holder = Some(Holder::under(&self.ball));
    }

    /// Returns the pose of the camera frame in the world.
    pub fn camera_pose(&self, joints: &Joints) -> Isometry3<f64> {
        self.arm.wrist(joints) * self.mount
    }

    /// Returns the outline of the ball in the image, inside the frame or not; `None` where it has
    /// none (behind the camera, camera inside the ball, joints or ball not finite).
    pub fn outline(&self, joints: &Joints) -> Option<ProjectedEllipse> {
        self.project_ball(&self.camera_pose(joints)).ok()
    }

    fn project_ball(&self, camera: &Isometry3<f64>) -> Result<ProjectedEllipse, SightError> {
        let centre = camera.inverse_transform_point(&self.ball.centre);
        self.camera.project_sphere(&centre, self.ball.radius)
    }

    /// Returns the ball as the image shows it, in pixels of the camera's frame.
    ///
    /// # Errors
    /// [`SightError`]: joints, or a measure of arm or mount, that are not finite; a ball without an
    /// outline (behind the camera, around it, nowhere); an outline larger than the view; the
    /// condition of [`Cell::sight`] that fails.
    pub fn circle(&self, joints: &Joints) -> Result<Circle, SightError> {
        if let Some(joint) = joints.non_finite() {
            finite(format!("the angle of {joint} (rad)"), joints[joint])?;
        }
        self.check_measures()?;
        self.circle_from(&self.camera_pose(joints))
    }

    /// Returns the circle that a camera at this pose shows.
    pub(crate) fn circle_from(&self, camera: &Isometry3<f64>) -> Result<Circle, SightError> {
        let outline = self.project_ball(camera)?;
        self.sight.check(&outline, self.camera.size())?;
        Ok(outline.circle())
    }

    /// Returns the paper's image features of the ball, without rendering or detection.
    ///
    /// # Errors
    /// [`Cell::circle`] lists them.
    pub fn features(&self, joints: &Joints) -> Result<Features, SightError> {
        let circle = self.circle(joints)?;
        Ok(Features::from_circle(&circle, self.camera.size().0))
    }

    /// Refuses a measure that the camera's pose depends on and that is not finite.
    fn check_measures(&self) -> Result<(), QuantityError> {
        let [a, b, c] = self.mount.translation.vector.into();
        let [i, j, k, w] = self.mount.rotation.coords.into();
        let lengths = match &self.arm {
            Arm::Puma(arm) => [
                ("the arm's length a2 (m)", arm.a2),
                ("the arm's length a3 (m)", arm.a3),
                ("the arm's length d2 (m)", arm.d2),
                ("the arm's length d4 (m)", arm.d4),
                ("the arm's length d6 (m)", arm.d6),
            ],
            Arm::Serial { axes, home, .. } => {
                let points: f64 = axes.iter().map(|(p, v)| p.coords.sum() + v.sum()).sum();
                let hand = home.translation.vector.sum();
                [
                    ("the first axis of the arm", axes[0].1.sum()),
                    ("the axes of the arm", points),
                    ("the place of the hand (m)", hand),
                    ("the turn of the hand", home.rotation.coords.sum()),
                    ("the last axis of the arm", axes[5].1.sum()),
                ]
            }
        };
        for (quantity, value) in lengths.into_iter().chain([
            ("the place of the camera's mount (m)", a + b + c),
            ("the rotation of the camera's mount", i + j + k + w),
        ]) {
            finite(quantity, value)?;
        }
        Ok(())
    }

    /// Refuses a ball whose centre is not finite.
    pub(super) fn check_ball(&self) -> Result<(), QuantityError> {
        let ball = self.ball.centre;
        finite("the x coordinate of the ball (m)", ball.x)?;
        finite("the y coordinate of the ball (m)", ball.y)?;
        finite("the z coordinate of the ball (m)", ball.z)
    }

    /// Returns the point between the finger pads, world frame, metres.
    pub fn tool_point(&self, joints: &Joints) -> Point3<f64> {
        self.arm.wrist(joints) * Point3::new(0.0, 0.0, self.arm.flange() + self.hand.tool)
    }

    /// Returns the distance from the tool point to the centre of the ball, metres.
    pub fn grip_miss(&self, joints: &Joints) -> f64 {
        (self.tool_point(joints) - self.ball.centre).norm()
    }

    /// Returns the angle of `JT5`, radians, that brings the tool point nearest to the ball while
    /// all other joints stay.
    pub fn grip_angle(&self, joints: &Joints) -> f64 {
        if let Arm::Serial { .. } = self.arm {
            return self.grip_angle_of_chain(joints);
        }
        // Frame that JT5 turns in: the hand frame turned back by JT5 about the wrist's bending
        // axis. At JT5 = 0 the tool axis is the forearm's axis, and +JT5 turns z toward +x of the
        // hand at JT5 = 0.
        let mut straight = *joints;
        straight.0[Joint::J5.index()] = 0.0;
        straight.0[Joint::J6.index()] = 0.0;
        let ball = self
            .arm
            .wrist(&straight)
            .inverse_transform_point(&self.ball.centre);
        ball.x.atan2(ball.z)
    }

    /// Returns [`Cell::grip_angle`] of any arm: the turn about the axis of `JT5` that brings the
    /// direction of the tool point to that of the ball.
    fn grip_angle_of_chain(&self, joints: &Joints) -> f64 {
        const TURN: f64 = 0.01;
        let at = |turn: f64| self.arm.wrist(&(*joints + JointDelta::of(Joint::J5, turn)));
        let turned = at(TURN) * at(-TURN).inverse();
        let Some(axis) = turned.rotation.axis() else {
            return joints[Joint::J5];
        };
        // A point on the axis, from the shift of the small turn.
        let shift = turned.translation.vector;
        let half = 0.5 * turned.rotation.angle();
        let foot = 0.5 * (shift + axis.cross(&shift) / half.tan());
        let across = |point: Point3<f64>| {
            let from = point.coords - foot;
            from - axis.into_inner() * axis.dot(&from)
        };
        let (tool, ball) = (across(self.tool_point(joints)), across(self.ball.centre));
        joints[Joint::J5] + axis.dot(&tool.cross(&ball)).atan2(tool.dot(&ball))
    }

    /// Returns `true` if all joints are within the working limits.
    pub fn within_limits(&self, joints: &Joints) -> bool {
        self.joint_out_of_limits(joints).is_none()
    }

    /// Returns the first joint that is out of the working limits.
    fn joint_out_of_limits(&self, joints: &Joints) -> Option<Joint> {
        Joint::ALL.into_iter().find(|joint| {
            let ((low, high), angle) = (self.limits[joint.index()], joints[*joint]);
            !(angle >= low - 1e-9 && angle <= high + 1e-9)
        })
    }

    /// Returns the place at which the image shows a ball with these features; `None` if there is
    /// none.
    pub fn ball_showing(&self, joints: &Joints, features: &Features) -> Option<Point3<f64>> {
        self.ball_at(&self.camera_pose(joints), features)
    }

    /// Returns the place at which a camera at this pose shows a ball with these features.
    pub(crate) fn ball_at(&self, camera: &Isometry3<f64>, seen: &Features) -> Option<Point3<f64>> {
        let circle = seen.to_circle(self.camera.size().0);
        let centre = self.camera.sphere_of_circle(&circle, self.ball.radius)?;
        Some(camera * centre)
    }

    /// Returns the elbow-up pose, with `JT5` at `jt5_degrees` and `JT4` = `JT6` = 0, in which the
    /// ball shows the middle of the goal in y and r and lies in the middle between the jaws.
    ///
    /// Of another arm than a PUMA it is the pose near [`Cell::reached`] in which the ball shows at
    /// [`Cell::GOAL`].
    ///
    /// # Errors
    /// [`SightError`]: a ball, an angle, or a measure of arm or mount that is not finite; a ball
    /// without size; a camera that cannot show the ball at the goal; a ball out of the arm's reach;
    /// a pose out of the working limits.
    pub fn goal_pose(&self, jt5_degrees: f64) -> Result<Joints, SightError> {
        finite("JT5 (degrees)", jt5_degrees)?;
        self.check_ball()?;
        self.check_measures()?;
        positive("the radius of the ball (m)", self.ball.radius)?;
        let ball = self.ball.centre;
        let Arm::Puma(params) = self.arm else {
            return self.goal_pose_of_chain(jt5_degrees);
        };
        // The ball's place in the hand is fixed, so forearm, hand and ball are one rigid link: a
        // two-link arm in the plane.
        let hand = Joints::from_degrees([0.0, 0.0, 0.0, 0.0, jt5_degrees, 0.0]);
        let wrist = params.wrist(&hand);
        let goal = self
            .ball_at(&(wrist * self.mount), &Self::GOAL)
            .ok_or(SightError::NoView)?;
        let mut in_hand = wrist.inverse_transform_point(&goal);
        in_hand.y = 0.0;
        let elbow = Point3::new(params.a2, params.d2, 0.0);
        let link = wrist * in_hand - elbow;
        let (length, angle) = (link.x.hypot(link.z), link.z.atan2(link.x));

        let rho2 = ball.x * ball.x + ball.y * ball.y;
        let forward2 = rho2 - params.d2 * params.d2;
        if forward2.is_nan() || forward2 <= 0.0 {
            return Err(SightError::BesideWaist {
                distance: rho2.sqrt(),
                offset: params.d2.abs(),
            });
        }
        let forward = forward2.sqrt();
        let jt1 = ball.y.atan2(ball.x) - params.d2.atan2(forward);
        // Elevations above the horizon, VAL turning downward for positive JT2 and JT3.
        let distance2 = forward2 + ball.z * ball.z;
        let a2 = params.a2;
        let cos_bend = (distance2 - a2 * a2 - length * length) / (2.0 * a2 * length);
        if cos_bend.is_nan() || cos_bend.abs() > 1.0 {
            return Err(SightError::OutOfReach {
                distance: distance2.sqrt(),
                least: (a2 - length).abs(),
                greatest: a2 + length,
            });
        }
        let bend = cos_bend.acos();
        let shoulder = ball.z.atan2(forward) + (length * bend.sin()).atan2(a2 + length * cos_bend);
        // At JT2 = JT3 = 0 the link stands at `angle`; turning the elbow by JT3 lowers it.
        let jt3 = angle + bend;
        let middle = |i: usize| 0.5 * (self.limits[i].0 + self.limits[i].1);
        let pose = Joints([
            turned_near(jt1, middle(0)),
            turned_near(-shoulder, middle(1)),
            turned_near(jt3, middle(2)),
            0.0,
            hand.0[4],
            0.0,
        ]);
        self.in_limits(pose)
    }

    /// Returns a pose, or the first joint that is out of the working limits.
    fn in_limits(&self, pose: Joints) -> Result<Joints, SightError> {
        let Some(joint) = self.joint_out_of_limits(&pose) else {
            return Ok(pose);
        };
        let (name, limits) = (self.arm.names()[joint.index()], self.limits[joint.index()]);
        Err(SightError::out_of(limits, joint, name, pose[joint]))
    }

    /// Returns [`Cell::goal_pose`] of any arm, by Newton's method in `JT1` to `JT3`.
    fn goal_pose_of_chain(&self, jt5_degrees: f64) -> Result<Joints, SightError> {
        let ball = self.ball.centre;
        let mut pose = self.reached;
        pose.0[4] = jt5_degrees.to_radians();
        let wanted = self.ball_showing(&pose, &Self::GOAL);
        let wanted = wanted.ok_or(SightError::NoView)?;
        let wanted = self.camera_pose(&pose).inverse_transform_point(&wanted);
        // The first joint turns the hand to the side of the ball.
        let hand = self.camera_pose(&pose).translation.vector;
        pose.0[0] += ball.y.atan2(ball.x) - hand.y.atan2(hand.x);
        let off = |pose: &Joints| self.camera_pose(pose).inverse_transform_point(&ball) - wanted;
        for _ in 0..50 {
            let here = off(&pose);
            if here.norm() < 1e-9 {
                pose.0[0] = turned_near(pose.0[0], self.reached.0[0]);
                return self.in_limits(pose);
            }
            let mut slope = Matrix3::zeros();
            for (i, joint) in [Joint::J1, Joint::J2, Joint::J3].into_iter().enumerate() {
                let there = off(&(pose + JointDelta::of(joint, 1e-6)));
                slope.set_column(i, &((there - here) / 1e-6));
            }
            let Some(step) = slope.lu().solve(&here) else {
                break;
            };
            let share = (0.3 / step.amax()).min(1.0);
            for i in 0..3 {
                pose.0[i] -= share * step[i];
            }
        }
        Err(SightError::NoView)
    }

    /// Returns `true` if [`Cell::goal_pose`] exists for the hand's angle while reaching
    /// ([`Cell::REACHING_JT5_DEGREES`]).
    pub(crate) fn reachable(&self) -> bool {
        self.goal_pose(self.reached[Joint::J5].to_degrees()).is_ok()
    }

    /// Returns `true` if fingers, palm or camera are nearer to table, holder or ball than the
    /// sensors' range.
    ///
    /// In a correct reach and grip the ball stays out of that range between the open fingers. A
    /// held ball does not count. Joints, ball or table that are NaN count as near.
    pub fn proximity(&self, joints: &Joints) -> bool {
        let range = self.hand.sensor_range;
        self.hand_bodies(joints)
            .iter()
            .any(|body| self.is_within(range, body))
    }

    /// Returns `true` if fingers, palm or camera overlap table, holder or ball: the simulated hand
    /// has run into something. A held ball does not count. Joints, ball or table that are NaN count
    /// as overlapping.
    pub fn collides(&self, joints: &Joints) -> bool {
        /// Rounding of bodies that [`Cell::sweep`] has pushed apart.
        const TOUCH: f64 = -1e-6;
        self.hand_bodies(joints)
            .iter()
            .any(|body| self.is_within(TOUCH, body))
    }

    /// Returns [`Cell::proximity`] of each finger alone, the left one (the hand's +y) first.
    pub fn proximity_pair(&self, joints: &Joints) -> [bool; 2] {
        let [left, right, ..] = self.hand_bodies(joints);
        [left, right].map(|finger| self.is_within(self.hand.sensor_range, &finger))
    }

    /// Returns `true` if a part of the hand is nearer to something than `range`, or a place is NaN.
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

    /// Returns fingers, palm and camera in the world frame. Fingers that hold the ball touch it.
    pub(crate) fn hand_bodies(&self, joints: &Joints) -> [Capsule; 4] {
        let wrist = self.arm.wrist(joints);
        let apart = match self.jaws {
            Gripper::Open => self.hand.half_opening,
            Gripper::Closed if self.held.is_some() => self.ball.radius + self.hand.finger_radius,
            Gripper::Closed => self.hand.finger_radius,
        };
        let [left, right] = self.hand.fingers(self.arm.flange(), apart);
        [
            left.moved(&wrist),
            right.moved(&wrist),
            self.hand.palm(self.arm.flange()).moved(&wrist),
            self.hand.camera_body().moved(&(wrist * self.mount)),
        ]
    }
}

/// Returns the angle nearest to `reference` that differs from `angle` by whole turns.
fn turned_near(angle: f64, reference: f64) -> f64 {
    use std::f64::consts::TAU;
    angle - TAU * ((angle - reference) / TAU).round()
}
