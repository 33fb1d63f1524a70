"""Gymnasium environments: a camera on the hand of a PUMA 560 and a ball of 40 mm.

Both environments have the same spaces.

Observation, ``observation="features"``
    float32 of shape (4,): x, y and radius of the ball in the image, in units of a frame of
    192 x 144, and theta 3, the elbow angle JT3 - 170 degrees.
Observation, ``observation="scaled"``
    The same for a neural network, about -1..1: x and y relative to the middle of the goal, by half
    the frame; the natural logarithm of the radius relative to that at the goal; theta 3 by 45
    degrees. Each is kept within -2..2.
Observation, ``observation="frame"``
    uint8 of shape (144, 192, 1): the rendered frame.
Action, ``actions="discrete"``
    The paper's moves. ``task="centering"``: Discrete(9), turns of JT1. ``task="approaching"``:
    Discrete(81), turns of JT2 and JT3. ``task="reaching"``: MultiDiscrete([9, 81]), both.
Action, ``actions="continuous"``
    float32 in -1..1 of one entry a joint of the task (JT1; JT2, JT3; or all three), times the
    largest of the paper's turns (5, 20 and 16 degrees).
Reward, ``reward="shaped"``
    The way by which the ball came closer to the goal, less 0.05 a step; 5 for success, -5 for
    failure. The way is measured in a quarter of the frame along x and y and in the logarithm of the
    radius, as far as the task moves them. Any discount factor will do.
Reward, ``reward="paper"``
    Equations 5 and 6 of the paper with both mends: 1000 at the goal, -100 for a failure, otherwise
    the pay for coming closer. It is for the paper's discount factor of 0.9: with 0.99, the default
    of most libraries, coming closer again and again near the goal is worth more than reaching it.
Reward, ``reward="sparse"``
    1 for success, -1 for failure, 0 otherwise.

An episode ends at the goal (x in 99..108, y in 74..82, radius in 32..34, as far as the task moves
them) or when the ball is lost. ``info["outcome"]`` names the end: "reached", "lost", and in
``PumaCell-v0`` "grasped", "missed" or "collided".

``PumaReach-v0`` is the geometry alone: any start in view, and the goal ends the episode.
``PumaCell-v0`` is the whole cell: the arm starts at a pose of the search, can run into the table,
the holder and the ball, and closes its gripper at the goal.
"""

from __future__ import annotations

from typing import Any, Optional, Sequence

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from . import _native

OUTCOMES = ("continuing", "reached", "lost", "grasped", "missed", "collided")
#: Steps after which the registered environments truncate an episode.
MOST_STEPS = 60


def register() -> None:
    """Register the environments with Gymnasium."""
    for name, entry, vector in (
        ("PumaReach-v0", "PumaReach", "PumaReachVector"),
        ("PumaCell-v0", "PumaCell", "PumaCellVector"),
    ):
        gymnasium.register(
            name,
            entry_point=f"puma_grasp.envs:{entry}",
            vector_entry_point=f"puma_grasp.envs:{vector}",
            max_episode_steps=MOST_STEPS,
        )


class _Spaces:
    """The spaces of a task, and the turns of the joints that its actions stand for."""

    def __init__(self, cells: _native.Cells, observation: str, actions: str) -> None:
        if observation not in ("features", "scaled", "frame"):
            raise ValueError(f'observation is {observation!r}: use "features", "scaled" or "frame"')
        if actions not in ("discrete", "continuous"):
            raise ValueError(f'actions is {actions!r}: use "discrete" or "continuous"')
        moves = [np.array(turns) for turns in cells.moves]
        largest = np.array(cells.largest)
        self._moves = moves if actions == "discrete" else None
        self._joints = np.flatnonzero(largest)
        self._largest = largest[self._joints]
        self.action: spaces.Space[Any]
        self.observation: spaces.Space[Any]
        if actions == "continuous":
            self.action = spaces.Box(-1.0, 1.0, (len(self._joints),), np.float32)
        elif len(moves) == 1:
            self.action = spaces.Discrete(len(moves[0]))
        else:
            self.action = spaces.MultiDiscrete([len(turns) for turns in moves])
        if observation == "frame":
            self.observation = spaces.Box(0, 255, (144, 192, 1), np.uint8)
        elif observation == "scaled":
            self.observation = spaces.Box(-2.0, 2.0, (4,), np.float32)
        else:
            # Features carry noise, so they may lie a little outside of the frame.
            low = np.array([-64.0, -64.0, 0.0, -180.0], np.float32)
            high = np.array([256.0, 208.0, 144.0, 180.0], np.float32)
            self.observation = spaces.Box(low, high, dtype=np.float32)

    def native(self, actions: Any, count: int) -> NDArray[Any]:
        """The actions of a batch as the native part takes them."""
        if self._moves is not None:
            chosen = np.asarray(actions)
            if chosen.dtype.kind not in "iu":
                raise TypeError(f"actions are of dtype {chosen.dtype}: use whole numbers")
            return chosen.astype(np.int64, copy=False).reshape(count, len(self._moves))
        given = np.asarray(actions, np.float64).reshape(count, len(self._joints))
        turns = np.zeros((count, 3))
        turns[:, self._joints] = np.clip(given, -1.0, 1.0) * self._largest
        return turns


class PumaReach(gymnasium.Env[Any, Any]):
    """The geometry of reaching: every move is exact and takes less than a microsecond.

    Parameters
    ----------
    task : {"reaching", "centering", "approaching"}
    observation : {"features", "scaled", "frame"}
    actions : {"discrete", "continuous"}
    reward : {"shaped", "paper", "sparse"}
    level : {"none", "moderate", "heavy", "extreme"}
        Errors of the camera and the ball, drawn anew for each episode.
    odd : list of str
        Further errors by name, "zeros=3" for example, as ``pipeline_sim::Errors::with_odd``
        lists them. Errors of the arm and of single frames show in ``PumaCell-v0`` only.
    noise : float, optional
        Standard deviation of the noise on each feature, units (default: that of ``level``).
    render_mode : {"rgb_array"}, optional
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}
    _whole = False

    def __init__(
        self,
        task: str = "reaching",
        observation: str = "features",
        actions: str = "discrete",
        reward: str = "shaped",
        level: str = "none",
        odd: Sequence[str] = (),
        noise: Optional[float] = None,
        render_mode: Optional[str] = None,
    ) -> None:
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f'render_mode is {render_mode!r}: use None or "rgb_array"')
        self._cells = _native.Cells(
            1,
            task=task,
            reward=reward,
            whole=self._whole,
            frames=observation == "frame",
            scaled=observation == "scaled",
            level=level,
            odd=list(odd),
            noise=noise,
        )
        self._spaces = _Spaces(self._cells, observation, actions)
        self._frames = observation == "frame"
        self.observation_space = self._spaces.observation
        self.action_space = self._spaces.action
        self.render_mode = render_mode
        self._seen: Optional[NDArray[np.float32]] = None
        self._begun = False

    def _observed(self, rows: NDArray[np.float32]) -> NDArray[Any]:
        self._seen = rows[0]
        return self._cells.frame(0)[..., None] if self._frames else rows[0]

    def _info(self, outcome: int = 0) -> dict[str, Any]:
        return {"joints": np.array(self._cells.joints(0)), "outcome": OUTCOMES[outcome]}

    def reset(
        self, *, seed: Optional[int] = None, options: Optional[dict[str, Any]] = None
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        super().reset(seed=seed)
        if seed is not None or not self._begun:
            drawn = self.np_random.integers(2**63, size=1, dtype=np.uint64)
            self._cells.seed(drawn)
            self._begun = True
        rows = self._cells.reset(np.ones(1, bool))
        return self._observed(rows), self._info()

    def step(self, action: Any) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        if self._seen is None:
            raise gymnasium.error.ResetNeeded("call reset before step")
        turns = self._spaces.native(action, 1)
        rows, rewards, outcomes, _ = self._cells.step(turns, 2**32 - 1)
        outcome = int(outcomes[0])
        return self._observed(rows), float(rewards[0]), outcome > 0, False, self._info(outcome)

    def render(self) -> Optional[NDArray[np.uint8]]:
        """Return the camera's picture, 576 x 768, with the ball as it is seen drawn in."""
        if self.render_mode is None or self._seen is None:
            return None
        picture = np.repeat(self._cells.picture(0)[..., None], 3, axis=2)
        x, y, r = (4.0 * value for value in self._cells.features(0))
        rows, columns = np.ogrid[: picture.shape[0], : picture.shape[1]]
        off = np.abs(np.hypot(columns - x - 1.5, rows - y - 1.5) - r)
        picture[off < 1.5] = (255, 210, 0)
        return picture


class PumaCell(PumaReach):
    """The whole cell: arm with limits and contacts, gripper, and the errors of arm and camera.

    Parameters are those of :class:`PumaReach`.
    """

    _whole = True


class PumaReachVector(VectorEnv[Any, Any, Any]):
    """Many cells that step together in native code; observations are features, scaled or not.

    An episode that has ended begins anew at the next step, whose action is ignored
    (``AutoresetMode.NEXT_STEP``). ``info["outcome"]`` is an array of indices of :data:`OUTCOMES`.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}
    _whole = False

    def __init__(
        self,
        num_envs: int = 1,
        task: str = "reaching",
        observation: str = "features",
        actions: str = "discrete",
        reward: str = "shaped",
        level: str = "none",
        odd: Sequence[str] = (),
        noise: Optional[float] = None,
        max_episode_steps: int = MOST_STEPS,
    ) -> None:
        self._cells = _native.Cells(
            num_envs,
            task=task,
            reward=reward,
            whole=self._whole,
            scaled=observation == "scaled",
            level=level,
            odd=list(odd),
            noise=noise,
        )
        if observation == "frame":
            raise ValueError("frames are observed one cell at a time: use gymnasium.make")
        self._spaces = _Spaces(self._cells, observation, actions)
        self._most = max_episode_steps
        self.num_envs = num_envs
        self.single_observation_space = self._spaces.observation
        self.single_action_space = self._spaces.action
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._begun = False

    def reset(
        self,
        *,
        seed: Any = None,
        options: Optional[dict[str, Any]] = None,
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        if isinstance(seed, (list, tuple, np.ndarray)):
            self._cells.seed(np.asarray(seed, np.uint64))
            self._begun = True
        else:
            super().reset(seed=seed)
            if seed is not None or not self._begun:
                size = self.num_envs
                drawn = self.np_random.integers(2**63, size=size, dtype=np.uint64)
                self._cells.seed(drawn)
                self._begun = True
        marked = np.ones(self.num_envs, bool)
        if options is not None and "reset_mask" in options:
            marked = np.asarray(options["reset_mask"], bool)
        rows = self._cells.reset(marked)
        return rows, {"outcome": np.zeros(self.num_envs, np.uint8)}

    def step(
        self, actions: Any
    ) -> tuple[NDArray[np.float32], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        turns = self._spaces.native(actions, self.num_envs)
        rows, rewards, outcomes, truncated = self._cells.step(turns, self._most)
        return rows, rewards, outcomes > 0, truncated, {"outcome": outcomes}


class PumaCellVector(PumaReachVector):
    """Many whole cells (:class:`PumaCell`) that step together in native code."""

    _whole = True
