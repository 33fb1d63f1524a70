//! Agreement with tables computed elsewhere: the Robotics Toolbox for Python, and an independent
//! inverse.
//!
//! The tables are looked for in the folder `oracles` of `PUMA_GRASP_SHARED`; without them these
//! tests print that they are skipped.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion};
use puma_val2::{ArmDynamics, Joints, PumaParams, Xyzoat};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// The rows of a table as numbers; words become NaN.
fn table(name: &str) -> Option<Vec<Vec<f64>>> {
    let folder = std::env::var_os("PUMA_GRASP_SHARED");
    let path = folder.map(|f| std::path::Path::new(&f).join("oracles").join(name));
    let Some(text) = path.and_then(|p| std::fs::read_to_string(p).ok()) else {
        println!("skipped: {name} is not there (PUMA_GRASP_SHARED)");
        return None;
    };
    let row = |line: &str| {
        line.split(',')
            .map(|v| v.parse().unwrap_or(f64::NAN))
            .collect()
    };
    Some(text.lines().skip(1).map(row).collect())
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
    let Some(rows) = table("fk_oracle.dev.csv") else {
        return;
    };
    let arm = PumaParams::corke();
    let worst = rows
        .iter()
        .map(|row| {
            amax(&(toolbox_pose(&arm.forward(&val(row))) - Matrix4::from_row_slice(&row[6..22])))
        })
        .fold(0.0, greater);
    println!(
        "forward kinematics: {} rows, greatest difference {worst:.1e}",
        rows.len()
    );
    assert!(rows.len() > 100 && worst < 1e-9);
}

#[test]
fn all_solutions_of_the_inverse_agree_with_the_toolbox() {
    let Some(rows) = table("ik_oracle.dev.csv") else {
        return;
    };
    let arm = PumaParams::corke();
    let mut worst = 0.0_f64;
    for row in &rows {
        let pose = from_toolbox(&row[7..23]);
        let wanted = val(&row[24..30]);
        let found = arm.inverse(&pose).unwrap();
        assert_eq!(found.len(), 8);
        let best = found
            .iter()
            .map(|s| apart(&s.joints, &wanted))
            .fold(f64::MAX, f64::min);
        worst = greater(worst, best);
    }
    println!(
        "inverse kinematics: {} solutions, greatest difference {worst:.1e} rad",
        rows.len()
    );
    assert!(rows.len() > 100 && worst < 1e-9);
}

#[test]
fn jacobians_agree_with_the_toolbox() {
    let Some(rows) = table("jacobian_oracle.dev.csv") else {
        return;
    };
    let arm = PumaParams::corke();
    let turned = nalgebra::Matrix6::from_diagonal(&[-1.0, -1.0, 1.0, -1.0, -1.0, 1.0].into());
    let mut worst = 0.0_f64;
    for row in &rows {
        let joints = val(row);
        let (world, tool) = (arm.jacobian(&joints), arm.jacobian_tool(&joints));
        for (ours, theirs) in [(world, &row[6..42]), (tool, &row[42..78])] {
            let difference = turned * ours - nalgebra::Matrix6::from_row_slice(theirs);
            worst = greater(worst, amax(&difference));
        }
    }
    println!(
        "Jacobians: {} rows, greatest difference {worst:.1e}",
        rows.len()
    );
    assert!(rows.len() > 40 && worst < 1e-9);
}

#[test]
fn torques_agree_with_the_toolbox() {
    let Some(rows) = table("dynamics_oracle.dev.csv") else {
        return;
    };
    let (arm, dynamics) = (PumaParams::corke(), ArmDynamics::corke());
    let mut worst = [0.0_f64; 4];
    for row in &rows {
        let (joints, qd, qdd) = (val(row), six(&row[6..]), six(&row[12..]));
        let free = dynamics.inverse(&arm, &joints, qd, qdd);
        let friction = dynamics.friction(qd);
        let gravity = dynamics.gravity_torques(&arm, &joints);
        let mass = dynamics.mass_matrix(&arm, &joints);
        for i in 0..6 {
            worst[0] = greater(worst[0], (gravity[i] - row[18 + i]).abs());
            worst[1] = greater(worst[1], (free[i] - row[24 + i]).abs());
            worst[2] = greater(worst[2], (free[i] + friction[i] - row[30 + i]).abs());
        }
        worst[3] = greater(
            worst[3],
            amax(&(mass - nalgebra::Matrix6::from_row_slice(&row[36..72]))),
        );
    }
    println!(
        "dynamics: {} rows, greatest difference gravity {:.1e}, free {:.1e}, with friction {:.1e} \
         N m, mass matrix {:.1e}",
        rows.len(),
        worst[0],
        worst[1],
        worst[2],
        worst[3]
    );
    assert!(
        rows.len() > 40 && worst.iter().all(|w| *w < 1e-6),
        "{worst:?}"
    );
}

#[test]
fn oat_angles_agree_with_the_table() {
    let Some(rows) = table("val_oat_oracle.dev.csv") else {
        return;
    };
    let arm = PumaParams::unimation();
    let (mut worst, mut table_error) = (0.0_f64, 0.0_f64);
    for row in &rows {
        let joints = Joints::from_degrees(six(row));
        let pose = arm.forward(&joints);
        let rotation = Matrix3::from_row_slice(&row[12..21]);
        // The joint angles of the table are rounded to thousandths; its rotation is exact, and so
        // are the angles made of it.
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        let exact = Isometry3::from_parts(pose.translation, rotation);
        let shown = Xyzoat::from_pose(&exact).val();
        for (i, angle) in shown.iter().enumerate().skip(3) {
            worst = greater(
                worst,
                angle_between(angle.to_radians(), row[6 + i].to_radians()),
            );
        }
        for (i, length) in shown.iter().enumerate().take(3) {
            table_error = greater(table_error, (length - row[6 + i]).abs());
        }
        let again = Xyzoat::from_val(six(&row[6..])).pose();
        worst = greater(worst, again.rotation.angle_to(&rotation));
    }
    println!(
        "O A T: {} rows, greatest difference {worst:.1e} rad; positions within {table_error:.1e} \
         mm",
        rows.len()
    );
    assert!(rows.len() > 100 && worst < 1e-9);
}

#[test]
fn an_independent_inverse_finds_the_same_solutions() {
    use rs_opw_kinematics::kinematic_traits::Kinematics;
    use rs_opw_kinematics::kinematics_impl::OPWKinematics;
    use rs_opw_kinematics::parameters::opw_kinematics::Parameters;

    let arm = PumaParams::corke();
    let opw = OPWKinematics::new(Parameters {
        a1: 0.0,
        a2: 0.0203,
        b: -0.15005,
        c1: 26.45 * 0.0254,
        c2: 0.4318,
        c3: 0.4318,
        c4: 0.0,
        offsets: [0.0, -PI / 2.0, PI / 2.0, 0.0, 0.0, 0.0],
        sign_corrections: [1, -1, -1, 1, -1, 1],
        dof: 6,
    });
    let mut random = Xoshiro256PlusPlus::seed_from_u64(560);
    let (mut worst, mut lost, mut compared) = (0.0_f64, 0, 0);
    while compared < 10_000 {
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
        let theirs = opw.inverse(&opw.forward(&toolbox));
        compared += 1;
        for solution in &theirs {
            let wanted = val(solution);
            let best = ours
                .iter()
                .map(|s| apart(&s.joints, &wanted))
                .fold(f64::MAX, f64::min);
            worst = greater(worst, best);
        }
        lost += usize::from(theirs.len() != ours.len());
        let own = ours
            .iter()
            .map(|s| apart(&s.joints, &joints))
            .fold(f64::MAX, f64::min);
        worst = greater(worst, own);
    }
    println!(
        "rs-opw-kinematics: {compared} poses, greatest difference {worst:.1e} rad, {lost} with \
         another count"
    );
    assert!(worst < 1e-9, "{worst}");
    assert_eq!(lost, 0);
}
