//! Agreement with tables computed elsewhere: the Robotics Toolbox for Python, and an independent
//! inverse.
//!
//! The tables are looked for in the folder `oracles` of `PUMA_GRASP_SHARED`; without them these
//! tests print that they are skipped.

use std::f64::consts::{PI, TAU};

use nalgebra::{
    Isometry3, Matrix3, Matrix4, Matrix6, Rotation3, Translation3, UnitQuaternion, Vector6,
};
use puma_val2::{ArmDynamics, Joints, PumaParams, Solution, Xyzoat};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// Compares every row of a table, whose words become NaN, and prints the greatest differences.
fn compare<const N: usize>(
    name: &str,
    least_rows: usize,
    bound: f64,
    differences: impl Fn(&[f64]) -> [f64; N],
) {
    let folder = std::env::var_os("PUMA_GRASP_SHARED");
    let path = folder.map(|f| std::path::Path::new(&f).join("oracles").join(name));
    let Some(text) = path.and_then(|p| std::fs::read_to_string(p).ok()) else {
        println!("skipped: {name} is not there (PUMA_GRASP_SHARED)");
        return;
    };
    let (mut worst, mut rows) = ([0.0; N], 0);
    for line in text.lines().skip(1) {
        let number = |word: &str| word.parse().unwrap_or(f64::NAN);
        let row: Vec<f64> = line.split(',').map(number).collect();
        for (worst, difference) in worst.iter_mut().zip(differences(&row)) {
            *worst = greater(*worst, difference);
        }
        rows += 1;
    }
    let shown = worst.map(|w| format!("{w:.1e}")).join(", ");
    println!("{name}: {rows} rows, greatest differences {shown}");
    assert!(
        rows > least_rows && worst.iter().all(|w| *w < bound),
        "{name}: {worst:?}"
    );
}

fn six(row: &[f64]) -> [f64; 6] {
    row[..6].try_into().unwrap()
}

/// VAL's joint angles from the toolbox's.
fn val(q: &[f64]) -> Joints {
    Joints([q[0], q[1] - PI, q[2] + PI, q[3], q[4], q[5]])
}

/// The toolbox's pose of our flange: world and tool turned by half a turn, counted from the
/// mounting face.
fn toolbox_pose(pose: &Isometry3<f64>) -> Matrix4<f64> {
    let half_turn = Matrix4::from_diagonal(&[-1.0, -1.0, 1.0, 1.0].into());
    let mut matrix = half_turn * pose.to_homogeneous() * half_turn;
    matrix[(2, 3)] += 26.45 * 0.0254;
    matrix
}

fn from_toolbox(row: &[f64]) -> Isometry3<f64> {
    let half_turn = Matrix4::from_diagonal(&[-1.0, -1.0, 1.0, 1.0].into());
    let mut matrix = Matrix4::from_row_slice(row);
    matrix[(2, 3)] -= 26.45 * 0.0254;
    let matrix = half_turn * matrix * half_turn;
    let rotation = Rotation3::from_matrix_unchecked(matrix.fixed_view::<3, 3>(0, 0).into());
    Isometry3::from_parts(
        Translation3::new(matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)]),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

fn angle_between(a: f64, b: f64) -> f64 {
    ((a - b + PI).rem_euclid(TAU) - PI).abs()
}

fn apart(a: &Joints, b: &Joints) -> f64 {
    (0..6).fold(0.0, |most, i| greater(most, angle_between(a.0[i], b.0[i])))
}

/// The distance of the solution that lies nearest.
fn nearest(found: &[Solution; 8], wanted: &Joints) -> f64 {
    let distances = found.iter().map(|s| apart(&s.joints, wanted));
    distances.fold(f64::MAX, f64::min)
}

/// The greater of two differences. What is no number is as far off as can be: `f64::max` would
/// overlook it.
fn greater(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::INFINITY
    } else {
        a.max(b)
    }
}

/// The greatest element, whatever its sign; infinite if one is no number.
fn amax<R: nalgebra::Dim, C: nalgebra::Dim, S: nalgebra::RawStorage<f64, R, C>>(
    matrix: &nalgebra::Matrix<f64, R, C, S>,
) -> f64 {
    matrix
        .iter()
        .fold(0.0, |most, element| greater(most, element.abs()))
}

#[test]
fn what_is_no_number_is_a_difference() {
    assert!(greater(0.0, f64::NAN).is_infinite() && greater(f64::NAN, 1.0).is_infinite());
    let mut matrix = Matrix4::<f64>::identity();
    assert!(amax(&matrix) < 1.1);
    matrix[(2, 1)] = f64::NAN;
    assert!(amax(&matrix).is_infinite());
    let nowhere = Joints([0.0, 0.0, f64::NAN, 0.0, 0.0, 0.0]);
    assert!(apart(&nowhere, &Joints::default()).is_infinite());
}

#[test]
fn forward_kinematics_agree_with_the_toolbox() {
    let arm = PumaParams::corke();
    compare("fk_oracle.dev.csv", 100, 1e-9, |row| {
        let pose = toolbox_pose(&arm.forward(&val(row)));
        [amax(&(pose - Matrix4::from_row_slice(&row[6..22])))]
    });
}

#[test]
fn all_solutions_of_the_inverse_agree_with_the_toolbox() {
    let arm = PumaParams::corke();
    compare("ik_oracle.dev.csv", 100, 1e-9, |row| {
        let found = arm.inverse(&from_toolbox(&row[7..23])).unwrap();
        [nearest(&found, &val(&row[24..30]))]
    });
}

#[test]
fn jacobians_agree_with_the_toolbox() {
    let arm = PumaParams::corke();
    let turned = Matrix6::from_diagonal(&[-1.0, -1.0, 1.0, -1.0, -1.0, 1.0].into());
    compare("jacobian_oracle.dev.csv", 40, 1e-9, |row| {
        let joints = val(row);
        let off = |ours, theirs: &[f64]| amax(&(turned * ours - Matrix6::from_row_slice(theirs)));
        [
            off(arm.jacobian(&joints), &row[6..42]),
            off(arm.jacobian_tool(&joints), &row[42..78]),
        ]
    });
}

#[test]
fn torques_agree_with_the_toolbox() {
    let (arm, dynamics) = (PumaParams::corke(), ArmDynamics::corke());
    compare("dynamics_oracle.dev.csv", 40, 1e-6, |row| {
        let (joints, qd, qdd) = (val(row), six(&row[6..]), six(&row[12..]));
        let free = Vector6::from(dynamics.inverse(&arm, &joints, qd, qdd));
        let friction = Vector6::from(dynamics.friction(qd));
        let gravity = Vector6::from(dynamics.gravity_torques(&arm, &joints));
        let mass = dynamics.mass_matrix(&arm, &joints);
        [
            amax(&(gravity - Vector6::from(six(&row[18..])))),
            amax(&(free - Vector6::from(six(&row[24..])))),
            amax(&(free + friction - Vector6::from(six(&row[30..])))),
            amax(&(mass - Matrix6::from_row_slice(&row[36..72]))),
        ]
    });
}

#[test]
fn oat_angles_agree_with_the_table() {
    let arm = PumaParams::unimation();
    compare("val_oat_oracle.dev.csv", 100, 1e-9, |row| {
        let pose = arm.forward(&Joints::from_degrees(six(row)));
        // The joint angles of the table are rounded to thousandths; its rotation is exact, and so
        // are the angles made of it.
        let matrix = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&row[12..21]));
        let rotation = UnitQuaternion::from_rotation_matrix(&matrix);
        let exact = Isometry3::from_parts(pose.translation, rotation);
        let shown = Xyzoat::from_pose(&exact).val();
        let again = Xyzoat::from_val(six(&row[6..])).pose();
        let apart = |i: usize| angle_between(shown[i].to_radians(), row[6 + i].to_radians());
        [
            apart(3),
            apart(4),
            apart(5),
            again.rotation.angle_to(&rotation),
        ]
    });
}

#[test]
fn an_independent_inverse_finds_the_same_solutions() {
    use rs_opw_kinematics::kinematic_traits::Kinematics;
    use rs_opw_kinematics::kinematics_impl::OPWKinematics;
    use rs_opw_kinematics::parameters::opw_kinematics::Parameters;

    let mut random = Xoshiro256PlusPlus::seed_from_u64(560);
    let arms = [
        ("560", PumaParams::corke()),
        ("260", PumaParams::puma_260([90.0; 6])),
        ("762", PumaParams::puma_762([90.0; 6])),
    ];
    for (name, arm) in arms {
        let opw = OPWKinematics::new(Parameters {
            a1: 0.0,
            a2: -arm.a3,
            b: -arm.d2,
            c1: 26.45 * 0.0254,
            c2: arm.a2,
            c3: arm.d4,
            c4: arm.d6,
            offsets: [0.0, -PI / 2.0, PI / 2.0, 0.0, 0.0, 0.0],
            sign_corrections: [1, -1, -1, 1, -1, 1],
            dof: 6,
        });
        let (mut worst, mut lost, mut compared) = (0.0_f64, 0, 0);
        while compared < 4000 {
            let q: [f64; 6] = std::array::from_fn(|i| {
                let range = arm.ranges[i];
                random.random_range(range.min..range.max)
            });
            let joints = Joints(q);
            if arm.singularity(&joints, 0.01).is_some() {
                continue;
            }
            let pose = arm.forward(&joints);
            let ours = arm.inverse(&pose).unwrap();
            let toolbox = [q[0], q[1] + PI, q[2] - PI, q[3], q[4], q[5]];
            let theirs = opw.forward(&toolbox);
            let position = toolbox_pose(&pose).fixed_view::<3, 1>(0, 3).into_owned();
            let away = [
                theirs.translation.x - position.x,
                theirs.translation.y - position.y,
                theirs.translation.z - position.z,
            ];
            worst = away.iter().fold(worst, |worst, d| greater(worst, d.abs()));
            let theirs = opw.inverse(&theirs);
            compared += 1;
            for solution in &theirs {
                worst = greater(worst, nearest(&ours, &val(solution)));
            }
            lost += usize::from(theirs.len() != ours.len());
            worst = greater(worst, nearest(&ours, &joints));
        }
        println!(
            "rs-opw-kinematics, {name}: {compared} poses, greatest difference {worst:.1e}, \
             {lost} with another count"
        );
        assert!(worst < 1e-9, "{name}: {worst}");
        assert_eq!(lost, 0, "{name}");
    }
}

/// The reach ends at the stretched arm, and the straight wrist has one turn: neither costs
/// accuracy.
#[test]
fn the_inverse_is_right_at_the_straight_elbow_and_wrist() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(92);
    for arm in [PumaParams::unimation(), PumaParams::corke()] {
        let straight = arm.d4.atan2(arm.a3);
        for turn in 0..2000 {
            let mut joints = Joints(std::array::from_fn(|i| {
                random.random_range(arm.ranges[i].min..arm.ranges[i].max)
            }));
            if turn % 2 == 0 {
                joints.0[2] = straight;
            } else {
                joints.0[4] = 10_f64.powi(-(turn % 16)) * if turn % 3 == 0 { 1.0 } else { -1.0 };
            }
            let pose = arm.forward(&joints);
            for solution in arm.inverse(&pose).unwrap() {
                let back = arm.forward(&solution.joints);
                let moved = (back.translation.vector - pose.translation.vector).norm();
                let turned = amax(&(back.to_homogeneous() - pose.to_homogeneous()));
                let bound = if turn % 2 == 0 { 1e-6 } else { 1e-11 };
                assert!(
                    moved < bound && turned < bound,
                    "{joints}: {moved} {turned}"
                );
            }
        }
    }
}
