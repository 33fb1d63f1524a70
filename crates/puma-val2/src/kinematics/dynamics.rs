//! Joint torques: gravity, inertia, friction.

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use crate::joints::Joints;
use crate::kinematics::params::PumaParams;

/// Mass, motor and friction of one link and its drive.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LinkDynamics {
    /// Mass, kilograms.
    pub mass: f64,
    /// Centre of mass in the link frame, metres.
    pub centre: [f64; 3],
    /// Moments of inertia about the centre of mass along the axes of the link frame, kg m².
    pub inertia: [f64; 3],
    /// Inertia of the motor at its shaft, kg m².
    pub motor_inertia: f64,
    /// Viscous friction at the motor shaft, N m s.
    pub viscous: f64,
    /// Coulomb friction at the motor shaft when the joint turns in its positive and in its negative
    /// direction, N m.
    pub coulomb: [f64; 2],
    /// Motor turns per joint turn.
    pub gear: f64,
}

/// Dynamics of the arm.
///
/// Link frames are those of the standard Denavit–Hartenberg description with rows (alpha, a, d) of
/// (90, 0, base), (0, `a2`, 0), (-90, -`a3`, `d2`), (90, 0, `d4`), (-90, 0, 0), (0, 0, 0), whose
/// angles are VAL's with 180 degrees added to `JT2` and taken from `JT3`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ArmDynamics {
    /// The six links, waist first.
    pub links: [LinkDynamics; 6],
    /// Acceleration of free fall along -z, m/s².
    pub gravity: f64,
}

impl ArmDynamics {
    /// Returns the values of Armstrong, Khatib and Burdick (1986) as edited by Corke and
    /// Armstrong-Hélouvry (1994) for the Robotics Toolbox.
    pub fn corke() -> Self {
        let mass = [0.0, 17.4, 4.8, 0.82, 0.34, 0.09];
        let centre = [
            [0.0; 3],
            [-0.3638, 0.006, 0.2275],
            [-0.0203, -0.0141, 0.070],
            [0.0, 0.019, 0.0],
            [0.0; 3],
            [0.0, 0.0, 0.032],
        ];
        let inertia = [
            [0.0, 0.35, 0.0],
            [0.13, 0.524, 0.539],
            [0.066, 0.086, 0.0125],
            [1.8e-3, 1.3e-3, 1.8e-3],
            [0.3e-3, 0.4e-3, 0.3e-3],
            [0.15e-3, 0.15e-3, 0.04e-3],
        ];
        let motor_inertia = [200e-6, 200e-6, 200e-6, 33e-6, 33e-6, 33e-6];
        let viscous = [1.48e-3, 0.817e-3, 1.38e-3, 71.2e-6, 82.6e-6, 36.7e-6];
        let coulomb = [
            [0.395, -0.435],
            [0.126, -0.071],
            [0.132, -0.105],
            [11.2e-3, -16.9e-3],
            [9.26e-3, -14.5e-3],
            [3.96e-3, -10.5e-3],
        ];
        let gear = [62.6111, 107.815, 53.7063, 76.0364, 71.923, 76.686];
        Self {
            links: std::array::from_fn(|i| LinkDynamics {
                mass: mass[i],
                centre: centre[i],
                inertia: inertia[i],
                motor_inertia: motor_inertia[i],
                viscous: viscous[i],
                coulomb: coulomb[i],
                gear: gear[i],
            }),
            gravity: 9.81,
        }
    }

    /// Returns the dynamics with a load at the flange: a mass (kg) whose centre lies on the tool
    /// axis at this distance (m) from the wrist centre. A load of zero changes nothing.
    #[must_use]
    pub fn with_payload(mut self, mass: f64, distance: f64) -> Self {
        let link = &mut self.links[5];
        let whole = link.mass + mass;
        if mass == 0.0 || whole <= 0.0 {
            return self;
        }
        let centre = (link.mass * link.centre[2] + mass * distance) / whole;
        // Both masses turn about their common centre.
        let spread = link.mass * (link.centre[2] - centre).powi(2);
        let spread = spread + mass * (distance - centre).powi(2);
        link.inertia[0] += spread;
        link.inertia[1] += spread;
        link.centre[2] = centre;
        link.mass = whole;
        self
    }

    /// Returns the accelerations (rad/s²) that torques (N m) cause at these speeds (rad/s), without
    /// friction; the inverse of [`ArmDynamics::inverse`]. `None` if masses and inertias do not
    /// resist every joint.
    pub fn accelerations(
        &self,
        arm: &PumaParams,
        joints: &Joints,
        speeds: [f64; 6],
        torques: [f64; 6],
    ) -> Option<[f64; 6]> {
        let at_rest = Vector6::from(self.inverse(arm, joints, speeds, [0.0; 6]));
        let free = Vector6::from(torques) - at_rest;
        let solved = self.mass_matrix(arm, joints).cholesky()?.solve(&free);
        Some(solved.into())
    }

    /// Returns the torques (N m) that hold the arm still.
    pub fn gravity_torques(&self, arm: &PumaParams, joints: &Joints) -> [f64; 6] {
        self.newton_euler(arm, joints, [0.0; 6], [0.0; 6], self.gravity)
    }

    /// Returns the torques (N m) at the joints for these speeds (rad/s) and accelerations (rad/s²):
    /// links and motors, without friction.
    pub fn inverse(
        &self,
        arm: &PumaParams,
        joints: &Joints,
        speeds: [f64; 6],
        accelerations: [f64; 6],
    ) -> [f64; 6] {
        let mut torques = self.newton_euler(arm, joints, speeds, accelerations, self.gravity);
        for ((torque, link), acceleration) in torques.iter_mut().zip(&self.links).zip(accelerations)
        {
            *torque += link.motor_inertia * link.gear * link.gear * acceleration;
        }
        torques
    }

    /// Returns the torques (N m) of viscous and Coulomb friction at the joints at these speeds
    /// (rad/s). They are zero at rest.
    pub fn friction(&self, speeds: [f64; 6]) -> [f64; 6] {
        std::array::from_fn(|i| {
            let (link, speed) = (&self.links[i], speeds[i]);
            let gear = link.gear.abs();
            let coulomb = if speed > 0.0 {
                link.coulomb[0]
            } else if speed < 0.0 {
                link.coulomb[1]
            } else {
                0.0
            };
            gear * (link.viscous * gear * speed + coulomb)
        })
    }

    /// Returns the joint-space inertia matrix (kg m²), motors included.
    pub fn mass_matrix(&self, arm: &PumaParams, joints: &Joints) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        for i in 0..6 {
            let mut unit = [0.0; 6];
            unit[i] = 1.0;
            let column = self.newton_euler(arm, joints, [0.0; 6], unit, 0.0);
            matrix.set_column(i, &column.into());
            matrix[(i, i)] += self.links[i].motor_inertia * self.links[i].gear * self.links[i].gear;
        }
        matrix
    }

    /// Evaluates the recursive Newton–Euler formulation (Luh, Walker, Paul 1980) in link frames.
    fn newton_euler(
        &self,
        arm: &PumaParams,
        joints: &Joints,
        qd: [f64; 6],
        qdd: [f64; 6],
        gravity: f64,
    ) -> [f64; 6] {
        use std::f64::consts::PI;
        let rows = [
            (1.0, 0.0, 0.0),
            (0.0, arm.a2, 0.0),
            (-1.0, -arm.a3, arm.d2),
            (1.0, 0.0, arm.d4),
            (-1.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
        ];
        let offsets = [0.0, PI, -PI, 0.0, 0.0, 0.0];
        let axis = Vector3::z();
        let mut frames = [(Matrix3::identity(), Vector3::zeros()); 6];
        let mut forces = [(Vector3::zeros(), Vector3::zeros()); 6];
        let (mut w, mut wd) = (Vector3::zeros(), Vector3::zeros());
        let mut vd = Vector3::new(0.0, 0.0, gravity);
        for i in 0..6 {
            let ((s, c), (sa, a, d)) = ((joints.0[i] + offsets[i]).sin_cos(), rows[i]);
            let ca: f64 = 1.0 - sa * sa;
            // Rz(theta) Rx(alpha)
            let rotation = Matrix3::new(c, -s * ca, s * sa, s, c * ca, -c * sa, 0.0, sa, ca);
            let back = rotation.transpose();
            let arm_of_link = Vector3::new(a, d * sa, d * ca);
            let turning = axis * qd[i];
            wd = back * (wd + axis * qdd[i] + w.cross(&turning));
            w = back * (w + turning);
            vd = wd.cross(&arm_of_link) + w.cross(&w.cross(&arm_of_link)) + back * vd;
            let link = &self.links[i];
            let centre = Vector3::from(link.centre);
            let inertia = Matrix3::from_diagonal(&Vector3::from(link.inertia));
            let at_centre = wd.cross(&centre) + w.cross(&w.cross(&centre)) + vd;
            forces[i] = (
                at_centre * link.mass,
                inertia * wd + w.cross(&(inertia * w)),
            );
            frames[i] = (rotation, arm_of_link);
        }
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        let mut torques = [0.0; 6];
        for i in (0..6).rev() {
            let (rotation, arm_of_link) = frames[i];
            let (link_force, link_moment) = forces[i];
            let centre = arm_of_link + Vector3::from(self.links[i].centre);
            moment += arm_of_link.cross(&force) + centre.cross(&link_force) + link_moment;
            force += link_force;
            // Into the frame before.
            moment = rotation * moment;
            force = rotation * force;
            torques[i] = moment.z;
        }
        torques
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_is_the_slope_of_the_potential_energy() {
        // The horizontal upper arm needs the greatest shoulder torque, the upright arm next to
        // none.
        let (arm, dynamics) = (PumaParams::corke(), ArmDynamics::corke());
        let torque = |degrees| dynamics.gravity_torques(&arm, &Joints::from_degrees(degrees));
        let stretched = torque([0.0, 0.0, 90.0, 0.0, 0.0, 0.0]);
        let upright = torque([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
        assert!(
            stretched[1].abs() > 35.0 && upright[1].abs() < 2.0,
            "{stretched:?} {upright:?}"
        );
        assert!(stretched[0].abs() < 1e-12);
    }

    #[test]
    fn the_mass_matrix_is_symmetric_and_positive() {
        let joints = Joints::from_degrees([20.0, -70.0, 120.0, 30.0, 40.0, -50.0]);
        let matrix = ArmDynamics::corke().mass_matrix(&PumaParams::corke(), &joints);
        assert!((matrix - matrix.transpose()).amax() < 1e-12);
        assert!(matrix.cholesky().is_some());
    }

    #[test]
    fn accelerations_undo_the_inverse_dynamics_and_bear_a_load() {
        let (arm, plain) = (PumaParams::corke(), ArmDynamics::corke());
        let joints = Joints::from_degrees([20.0, -70.0, 120.0, 30.0, 40.0, -50.0]);
        let speeds = [0.3, -0.2, 0.5, 1.0, -1.0, 0.4];
        let wanted = [1.0, -2.0, 0.5, 3.0, -1.0, 2.0];
        for dynamics in [plain, plain.with_payload(2.3, 0.1)] {
            let torques = dynamics.inverse(&arm, &joints, speeds, wanted);
            let found = dynamics.accelerations(&arm, &joints, speeds, torques);
            let pairs = found.unwrap().into_iter().zip(wanted);
            assert!(pairs.fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs())) < 1e-10);
        }
        assert_eq!(plain.with_payload(0.0, 0.1), plain);
        let stretched = Joints::from_degrees([0.0, 0.0, 90.0, 0.0, 0.0, 0.0]);
        let shoulder = |d: ArmDynamics| d.gravity_torques(&arm, &stretched)[1].abs();
        let added = shoulder(plain.with_payload(1.0, 0.1)) - shoulder(plain);
        let lever = 9.81 * (arm.a2 + arm.d4 + 0.1);
        assert!((added - lever).abs() < 1e-9, "{added} {lever}");
    }

    #[test]
    fn friction_opposes_and_vanishes_at_rest() {
        let friction = ArmDynamics::corke().friction([0.1, -0.1, 0.0, 0.0, 0.0, 0.0]);
        assert!(friction[0] > 0.0 && friction[1] < 0.0 && friction[2] == 0.0);
    }
}
