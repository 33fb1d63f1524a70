//! The paper's controller as JSON: two behaviours, their repetition penalty, and all that another
//! program needs to run them.

use puma_val2::{Joint, JointDelta, Joints, Kinematics};
use serde::{Deserialize, Serialize};

use crate::behaviour::policy::{Behaviour, LOST_WEIGHT};
use crate::controllers::learned::Learned;
use crate::error::BehaviourError;
use crate::limits::JointLimits;
use crate::record::behaviour_json::{BehaviourJson, bad, check_format, pretty};
use crate::run::config::AgentConfig;
use crate::sight::camera_model::CameraModel;

const FORMAT: &str = "grasp-agent policy 2";

/// Serialized form of a [`Learned`], with its task where it is a document of its own.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct PolicyJson {
    format: String,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    words: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    task: Option<Task>,
    /// Distance from the left and right border within which only centering moves, feature units.
    border: f64,
    loop_breaker: LoopBreaker,
    centering: BehaviourJson,
    approaching: BehaviourJson,
}

/// All around the behaviours: where to look for the ball, what to do when it is lost, the grip, and
/// what the policy was learned for.
#[derive(Debug, Serialize, Deserialize)]
struct Task {
    /// Program, version and settings that made the policy.
    made_by: String,
    /// Arm, camera and ball that it was learned for.
    learned_for: CameraModel,
    /// Lowest and highest angle of each joint, `JT1` first.
    limits_degrees: [[f64; 2]; 6],
    /// Angles of `JT4`, `JT5`, `JT6` while reaching.
    wrist_degrees: [f64; 3],
    search_poses_degrees: Vec<[f64; 6]>,
    search_again_degrees: Vec<[f64; 6]>,
    recovery_degrees: Vec<[f64; 6]>,
    grip_degrees: [f64; 6],
    /// Lift that verifies the grip.
    lift_degrees: Option<[f64; 6]>,
    most_moves: usize,
    looks: usize,
}

#[derive(Debug, Serialize, Deserialize)]
struct LoopBreaker {
    /// Repetition penalty of each behaviour, units of Q.
    centering: f64,
    approaching: f64,
    /// Weight added to an action that lost the ball.
    lost_weight: u32,
}

const WORDS: [&str; 11] = [
    "in every cycle each behaviour chooses an action by its own inputs; all joints make their \
     steps together, until both behaviours are at their goals",
    "border: with the ball nearer than this to the left or right border of the frame, only \
     centering chooses, as long as its action moves a joint",
    "limits_degrees: lowest and highest angle of each joint, JT1 first; actions that leave them \
     are not chosen, other moves end at them",
    "loop_breaker: each run starts with a weight of 0 for every action of every state; the \
     behaviour's number times the weight is subtracted from the action's value",
    "choosing an action changes its weight w to 2 w + 1; when the ball is lost, or supervision \
     takes the move back, lost_weight is added to the last action of approaching if it moved a \
     joint, else to that of centering",
    "a behaviour at its goal makes no step",
    "search: look from search_poses_degrees, the one nearest in JT1 first, then from all of them \
     displaced by each of search_again_degrees, looks times from each; the wrist stays at \
     wrist_degrees until the grip",
    "a lost ball: go back to the pose of its last sighting, then look from there displaced by each \
     of recovery_degrees, then search again",
    "grip: at the goal open the jaws, move by grip_degrees, close the jaws",
    "lift_degrees: after closing, move by it and look; a ball left behind is reached for again",
    "learned_for: lengths in metres, focal length and centre in the units of the frame; the mount \
     is the camera in the hand frame at the wrist centre (z along the tool axis), rotation as \
     quaternion i, j, k, w; tool is the distance from the flange to the middle of the jaws",
];

impl Learned {
    /// Returns the controller as JSON, complete enough for another program to run it.
    ///
    /// The object holds both behaviours as [`Behaviour::to_json`](crate::Behaviour::to_json)
    /// writes them, the repetition penalties (`loop_breaker`), and the `task`: joint limits, search
    /// and recovery, pose of the wrist, grip and lift of `config`, the arm, camera and ball that it
    /// was `learned_for`, and `made_by`, any words on program, version, seed and settings. Learning
    /// at work is left out.
    pub fn to_json(
        &self,
        config: &AgentConfig,
        learned_for: &CameraModel,
        made_by: &str,
    ) -> String {
        let degrees = |(low, high): (f64, f64)| [low, high].map(|end| rounded(end.to_degrees()));
        let pose = |joints: &Joints| joints.degrees().map(rounded);
        let turn = |delta: &JointDelta| delta.degrees().map(rounded);
        let wrist = config.search_poses.first().map_or([0.0; 6], pose);
        let task = Task {
            made_by: made_by.into(),
            learned_for: *learned_for,
            limits_degrees: config.limits.0.map(degrees),
            wrist_degrees: [wrist[3], wrist[4], wrist[5]],
            search_poses_degrees: config.search_poses.iter().map(pose).collect(),
            search_again_degrees: config.search_again.iter().map(turn).collect(),
            recovery_degrees: config.recovery.iter().map(turn).collect(),
            grip_degrees: turn(&config.grip),
            lift_degrees: config.lift.as_ref().map(turn),
            most_moves: config.max_cycles,
            looks: config.looks,
        };
        pretty(&PolicyJson {
            words: WORDS.map(Into::into).into(),
            task: Some(task),
            ..self.clone().into()
        })
    }

    /// Reads a controller that [`Learned::to_json`], or another program, has written.
    ///
    /// Returns the controller, frozen, and the settings of its task, angles exact to 1e-7 degrees.
    /// Settings that the file does not hold are those of [`AgentConfig::paper`].
    ///
    /// # Errors
    /// [`BehaviourError::Text`] for anything that
    /// [`Behaviour::from_json`](crate::Behaviour::from_json) refuses, two behaviours that move the
    /// same joint, limits that are no ranges or wider than the arm's, settings that an agent
    /// refuses, negative repetition penalties, and another `lost_weight` or `border`.
    pub fn from_json(text: &str) -> Result<(Self, AgentConfig), BehaviourError> {
        let mut policy: PolicyJson = serde_json::from_str(text).map_err(|e| bad(e.to_string()))?;
        check_format(&policy.format, FORMAT)?;
        let task = policy.task.take();
        let task = task.ok_or_else(|| bad("missing field `task`"))?;
        Ok((policy.try_into()?, config_of(task)?))
    }
}

/// Leaves out the task and learning at work.
impl From<Learned> for PolicyJson {
    fn from(learned: Learned) -> Self {
        let (centering, approaching) = learned.kappa();
        Self {
            format: FORMAT.into(),
            words: Vec::new(),
            task: None,
            border: Learned::BORDER,
            loop_breaker: LoopBreaker {
                centering,
                approaching,
                lost_weight: LOST_WEIGHT,
            },
            centering: learned.centering().into(),
            approaching: learned.approaching().into(),
        }
    }
}

impl TryFrom<PolicyJson> for Learned {
    type Error = BehaviourError;

    fn try_from(json: PolicyJson) -> Result<Self, BehaviourError> {
        check_format(&json.format, FORMAT)?;
        let breaker = json.loop_breaker;
        for kappa in [breaker.centering, breaker.approaching] {
            if kappa.is_nan() || kappa < 0.0 {
                return Err(bad(format!(
                    "a loop breaker is {kappa}, expected 0 or more"
                )));
            }
        }
        if breaker.lost_weight != LOST_WEIGHT {
            return Err(bad(format!(
                "its lost_weight is {}, expected {LOST_WEIGHT}",
                breaker.lost_weight
            )));
        }
        if (json.border - Learned::BORDER).abs() > 1e-9 || json.border.is_nan() {
            return Err(bad(format!(
                "its border is {}, expected {}",
                json.border,
                Learned::BORDER
            )));
        }
        let centering: Behaviour = json.centering.try_into()?;
        let approaching: Behaviour = json.approaching.try_into()?;
        let others = &approaching.spec().moves;
        let mut moves = centering.spec().moves.iter();
        if let Some(steps) = moves.find(|steps| others.iter().any(|s| s.joint == steps.joint)) {
            return Err(bad(format!("both behaviours move {}", steps.joint)));
        }
        Ok(Self::new(centering, approaching).with_kappa(breaker.centering, breaker.approaching))
    }
}

/// Rounds to seven digits, to undo the way through radians.
fn rounded(degrees: f64) -> f64 {
    (degrees * 1e7).round() / 1e7
}

/// Returns the settings of a task, checked.
fn config_of(task: Task) -> Result<AgentConfig, BehaviourError> {
    task.learned_for.check().map_err(bad)?;
    let ranges = task.learned_for.arm.limits();
    for ((joint, [low, high]), range) in Joint::ALL.into_iter().zip(task.limits_degrees).zip(ranges)
    {
        let [min, max] = [range.0, range.1].map(|end| rounded(end.to_degrees()));
        let limits = format!("the limits of {joint} are {low} to {high} degrees");
        if !(low.is_finite() && high.is_finite() && low <= high) {
            return Err(bad(limits));
        }
        if low < min || high > max {
            return Err(bad(format!("{limits}; its range is {min} to {max}")));
        }
    }
    let radians = |[low, high]: [f64; 2]| (low.to_radians(), high.to_radians());
    let poses = task.search_poses_degrees;
    if let Some(pose) = poses.iter().find(|pose| pose[3..] != task.wrist_degrees) {
        let wrist = task.wrist_degrees;
        return Err(bad(format!(
            "wrist_degrees is {wrist:?}, but a search pose is {pose:?}"
        )));
    }
    let turns = |all: Vec<[f64; 6]>| all.into_iter().map(JointDelta::from_degrees).collect();
    let poses: Vec<Joints> = poses.into_iter().map(Joints::from_degrees).collect();
    let config = AgentConfig {
        search_again: turns(task.search_again_degrees),
        grip: JointDelta::from_degrees(task.grip_degrees),
        recovery: turns(task.recovery_degrees),
        limits: JointLimits(task.limits_degrees.map(radians)),
        max_cycles: task.most_moves,
        looks: task.looks,
        lift: task.lift_degrees.map(JointDelta::from_degrees),
        ..AgentConfig::paper(poses)
    };
    config.check().map_err(bad)?;
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::behaviour::preset::BehaviourPair;
    use crate::behaviour::spec::BehaviourSpec;
    use qtable::{Action, QTable, State};

    fn learned() -> Learned {
        let taught = |spec: BehaviourSpec| {
            let mut table = QTable::new(spec.states(), spec.actions()).unwrap();
            for state in 0..spec.states() {
                let action = (7 * state + 3) % spec.actions();
                table
                    .set(State(state), Action(action), 0.1 + state as f64 / 3.0)
                    .unwrap();
            }
            Behaviour::new(spec, table).unwrap()
        };
        let pair = BehaviourPair::paper_mended();
        Learned::new(taught(pair.centering), taught(pair.approaching)).with_kappa(12.5, 30.0)
    }

    #[test]
    fn a_policy_comes_back_with_penalties_and_task() {
        let then = learned();
        let (now, read) = Learned::from_json(&written(&then)).unwrap();
        assert!(now.centering() == then.centering() && now.approaching() == then.approaching());
        assert_eq!(now.kappa(), (12.5, 30.0));
        let close = |a: &Joints, b: &Joints| (0..6).all(|i| (a.0[i] - b.0[i]).abs() < 1e-8);
        let config = config();
        assert!(close(&read.search_poses[0], &config.search_poses[0]));
        assert_eq!((read.max_cycles, read.limits), (60, config.limits));
        // And again, to the letter.
        let again = now.to_json(&read, &CameraModel::paper(), "a test");
        assert_eq!(again, written(&then));
    }

    fn config() -> AgentConfig {
        AgentConfig::paper([Joints::from_degrees([-25.0, -110.0, 210.0, 0.0, 45.0, 0.0])])
    }

    fn written(learned: &Learned) -> String {
        learned.to_json(&config(), &CameraModel::paper(), "a test")
    }

    #[test]
    fn a_policy_that_cannot_be_run_is_refused_with_the_reason() {
        type Change = fn(&mut serde_json::Value);
        let cases: [(Change, &str); 11] = [
            (|d| d["format"] = "grasp-agent policy 3".into(), "policy 3"),
            (
                |d| d["format"] = "grasp-agent policy 1".into(),
                "earlier version",
            ),
            (
                |d| d["task"]["wrist_degrees"][1] = 40.0.into(),
                "wrist_degrees",
            ),
            (|d| d["task"]["looks"] = 0.into(), "looks is 0"),
            (
                |d| d["task"]["limits_degrees"][2][0] = 300.0.into(),
                "limits of JT3",
            ),
            (
                |d| d["task"]["limits_degrees"][1] = serde_json::json!([-1e9, 1e9]),
                "its range is -225 to 45",
            ),
            (
                |d| d["loop_breaker"]["centering"] = (-1.0).into(),
                "loop breaker",
            ),
            (
                |d| d["loop_breaker"]["lost_weight"] = 3.into(),
                "lost_weight is 3",
            ),
            (
                |d| d["centering"]["moves"][0]["joint"] = "J3".into(),
                "both behaviours move JT3",
            ),
            (
                |d| d["approaching"]["goal"] = serde_json::json!([]),
                "no goal",
            ),
            (
                |d| {
                    d["approaching"]["q"].as_array_mut().unwrap().pop();
                },
                "89x81",
            ),
        ];
        let json = written(&learned());
        for (change, said) in cases {
            let mut document: serde_json::Value = serde_json::from_str(&json).unwrap();
            change(&mut document);
            let refused = Learned::from_json(&document.to_string())
                .unwrap_err()
                .to_string();
            assert!(refused.contains(said), "{refused} does not say {said}");
        }
        assert!(Learned::from_json(&json[..json.len() / 2]).is_err());
    }
}
