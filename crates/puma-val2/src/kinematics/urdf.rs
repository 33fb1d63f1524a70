//! Arms from a URDF, the robot description of ROS.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use roxmltree::{Document, Node};

use crate::kinematics::arm::{Arm, lasting};

/// Reads the arm with the given hand and joints.
pub(crate) fn read(text: &str, hand: &str, joints: [&str; 6]) -> Result<Arm, String> {
    let document = Document::parse(text).map_err(|error| format!("the URDF is no XML: {error}"))?;
    let chain = chain(document.root_element(), hand)?;
    let mut axes = [(Point3::origin(), Vector3::zeros()); 6];
    let mut limits = [(0.0, 0.0); 6];
    let mut home = Isometry3::identity();
    let mut found = Vec::new();
    for joint in chain {
        let origin = child(joint, "origin");
        let [x, y, z] = triple(origin, "xyz", [0.0; 3])?;
        let [roll, pitch, yaw] = triple(origin, "rpy", [0.0; 3])?;
        home *= Isometry3::from_parts(
            Translation3::new(x, y, z),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        );
        let name = joint.attribute("name").unwrap_or_default();
        let places = (0..6).filter(|&i| !name.is_empty() && joints[i] == name);
        for place in places {
            let axis = Vector3::from(triple(child(joint, "axis"), "xyz", [1.0, 0.0, 0.0])?);
            if !axis.norm().is_normal() {
                return Err(format!("the axis of joint {name:?} is zero"));
            }
            limits[place] = range(joint, name)?;
            axes[place] = (home * Point3::origin(), home * axis.normalize());
            found.push(place);
        }
    }
    if let Some(missing) = (0..6).find(|i| !joints[*i].is_empty() && !found.contains(i)) {
        let name = joints[missing];
        return Err(format!(
            "joint {name:?} is not between the base and {hand:?}"
        ));
    }
    let twice = |i: usize| !joints[i].is_empty() && joints[..i].contains(&joints[i]);
    if !found.is_sorted() || (0..6).any(twice) {
        return Err("name the joints in their order from the base, each once".into());
    }
    Ok(Arm::Serial {
        axes,
        home,
        limits,
        names: lasting(joints),
    })
}

/// Returns the joints from the base to the link `hand`.
fn chain<'a>(robot: Node<'a, 'a>, hand: &str) -> Result<Vec<Node<'a, 'a>>, String> {
    let elements = |name| robot.children().filter(move |node| node.has_tag_name(name));
    if !elements("link").any(|link| link.attribute("name") == Some(hand)) {
        return Err(format!("the URDF has no link {hand:?}"));
    }
    let mut chain = Vec::new();
    let mut at = hand;
    while let Some(joint) = elements("joint").find(|joint| link(*joint, "child") == Some(at)) {
        at = link(joint, "parent")
            .ok_or_else(|| format!("the joint that carries {at:?} has no parent link"))?;
        if chain.contains(&joint) {
            return Err(format!("the joints below {hand:?} run in a circle"));
        }
        chain.push(joint);
    }
    chain.reverse();
    Ok(chain)
}

/// Returns the range of a turning joint.
fn range(joint: Node, name: &str) -> Result<(f64, f64), String> {
    let kind = joint.attribute("type").unwrap_or_default();
    match (kind, child(joint, "limit")) {
        ("continuous", _) => Ok((-std::f64::consts::TAU, std::f64::consts::TAU)),
        ("revolute", Some(limit)) => {
            let of = |name| number(limit.attribute(name).unwrap_or("0"));
            match (of("lower")?, of("upper")?) {
                (low, high) if low <= high => Ok((low, high)),
                (low, high) => Err(format!("the limits of joint {name:?} are {low} to {high}")),
            }
        }
        ("revolute", None) => Err(format!("joint {name:?} has no <limit>")),
        _ => Err(format!(
            "joint {name:?} is of type {kind:?}; only revolute and continuous joints can be named"
        )),
    }
}

fn child<'a>(node: Node<'a, 'a>, name: &str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn link<'a>(joint: Node<'a, 'a>, end: &str) -> Option<&'a str> {
    child(joint, end)?.attribute("link")
}

fn number(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|number| number.is_finite())
        .ok_or_else(|| format!("{text:?} is no number; expand the file by xacro first"))
}

/// Returns three numbers of an attribute, or `default` without it.
fn triple(node: Option<Node>, name: &str, default: [f64; 3]) -> Result<[f64; 3], String> {
    let Some(text) = node.and_then(|node| node.attribute(name)) else {
        return Ok(default);
    };
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map(number)
        .collect::<Result<_, _>>()?;
    numbers
        .try_into()
        .map_err(|_| format!("{name}={text:?} does not hold three numbers"))
}

#[cfg(test)]
mod tests {
    use crate::joints::Joints;
    use crate::kinematics::arm::{Arm, Kinematics};
    use nalgebra::Point3;

    const TWO: &str = r#"<robot name="two">
      <link name="base"/><link name="a"/><link name="b"/><link name="hand"/>
      <joint name="wrist" type="fixed"><parent link="b"/><child link="hand"/>
        <origin xyz="0.3 0 0"/></joint>
      <joint name="pan" type="continuous"><parent link="base"/><child link="a"/>
        <origin xyz="0 0 0.1"/><axis xyz="0 0 2"/></joint>
      <joint name="lift" type="revolute"><parent link="a"/><child link="b"/>
        <origin xyz="0.2 0 0" rpy="1.5707963267948966 0 0"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="2" effort="1" velocity="1"/></joint>
    </robot>"#;

    #[test]
    fn a_small_arm_is_read_with_turned_frames_and_a_fixed_wrist() {
        let arm = Arm::from_urdf(TWO, "hand", ["pan", "", "lift", "", "", ""]).unwrap();
        assert_eq!(arm.limits()[1..3], [(0.0, 0.0), (-1.0, 2.0)]);
        assert_eq!(arm.names()[..3], ["pan", "", "lift"]);
        let hand = arm.forward(&Joints::from_degrees([90.0, 5.0, 90.0, 0.0, 0.0, 0.0]));
        let expected = Point3::new(0.0, 0.2, 0.1 + 0.3);
        // The axis of `lift` is -y: a positive angle raises the hand.
        assert!(
            (hand * Point3::origin() - expected).norm() < 1e-12,
            "{hand}"
        );
    }

    #[test]
    fn a_bad_description_is_refused_by_name() {
        let pan = ["pan", "", "", "", "", ""];
        for (from, to, hand, joints, word) in [
            ("<robot", "<<robot", "hand", pan, "no XML"),
            ("xx", "xx", "fist", pan, "fist"),
            ("xx", "xx", "hand", ["tilt", "", "", "", "", ""], "tilt"),
            ("xx", "xx", "hand", ["lift", "pan", "", "", "", ""], "order"),
            ("xx", "xx", "hand", ["pan", "pan", "", "", "", ""], "once"),
            ("continuous", "prismatic", "hand", pan, "prismatic"),
            ("0 0 2", "0 0 0", "hand", pan, "zero"),
            ("0 0 2", "0 0", "hand", pan, "three numbers"),
            ("0 0 2", "0 0 ${h}", "hand", pan, "xacro"),
            ("link=\"base\"", "link=\"hand\"", "hand", pan, "circle"),
        ] {
            let text = TWO.replace(from, to);
            let error = Arm::from_urdf(&text, hand, joints).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
