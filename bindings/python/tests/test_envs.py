"""The environments of Gymnasium."""

import itertools
import warnings

import numpy as np
import pytest

import puma_grasp

gymnasium = pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env  # noqa: E402

NAMES = ["PumaReach-v0", "PumaCell-v0"]
TASKS = ["reaching", "centering", "approaching"]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("observation", "actions", "task"),
    list(itertools.product(["features", "scaled", "frame"], ["discrete", "continuous"], TASKS)),
)
def test_gymnasium_accepts_them(name, observation, actions, task):
    env = gymnasium.make(
        name, task=task, observation=observation, actions=actions, render_mode="rgb_array"
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.reset(seed=1)
    assert env.render().shape == (576, 768, 3)


def test_the_moves_are_the_papers():
    sizes = {}
    for task in TASKS:
        env = gymnasium.make("PumaReach-v0", task=task)
        sizes[task] = env.action_space
    assert sizes["centering"].n == 9 and sizes["approaching"].n == 81
    assert list(sizes["reaching"].nvec) == [9, 81]
    env = gymnasium.make("PumaReach-v0", task="approaching", noise=0.0)
    env.reset(seed=3)
    before = env.unwrapped._cells.joints(0)
    # 41 is no turn of JT2 and the smallest turn of JT3.
    env.step(41)
    turned = np.subtract(env.unwrapped._cells.joints(0), before)
    np.testing.assert_allclose(turned, [0, 0, 0.5, 0, 0, 0], atol=1e-9)


@pytest.mark.parametrize("task", TASKS)
def test_a_shaped_reward_adds_up_to_the_way(task):
    env = gymnasium.make("PumaReach-v0", task=task, observation="scaled")
    plain = gymnasium.make("PumaReach-v0", task=task)
    (x, y, r, elbow), _ = plain.reset(seed=5)
    scaled, _ = env.reset(seed=5)
    expected = [(x - 103.5) / 96, (y - 78) / 72, np.log(r / 33), elbow / 45]
    np.testing.assert_allclose(scaled, expected, atol=1e-5)
    weights = {"centering": [2, 0, 0, 0], "approaching": [0, 2, 1, 0], "reaching": [2, 2, 1, 0]}
    still = {"centering": 4, "approaching": 40, "reaching": [4, 40]}[task]
    env.action_space.seed(1)
    for episode in range(20):
        off = [np.abs(env.reset(seed=episode)[0]) @ weights[task]]
        for action in [still] + [env.action_space.sample() for _ in range(60)]:
            seen, reward, ended, truncated, info = env.step(action)
            if ended or truncated:
                break
            off.append(np.abs(seen) @ weights[task])
            assert abs(reward - (off[-2] - off[-1] - 0.05)) < 1e-4
        if ended:
            assert reward == (5 if info["outcome"] == "reached" else -5)


@pytest.mark.parametrize("name", NAMES)
def test_a_seed_repeats_the_episodes(name):
    def episodes(seed):
        env = gymnasium.make(name, level="moderate")
        env.action_space.seed(5)
        seen = []
        observation, _ = env.reset(seed=seed)
        for _ in range(100):
            observation, reward, ended, truncated, info = env.step(env.action_space.sample())
            seen.append((*observation, reward, info["outcome"]))
            if ended or truncated:
                env.reset()
        return seen

    assert episodes(7) == episodes(7) != episodes(8)


def test_a_vector_of_cells_equals_single_ones():
    settings = dict(actions="continuous", level="heavy")
    seeds = [11, 12, 13]
    many = gymnasium.make_vec(
        "PumaReach-v0", 3, vectorization_mode="vector_entry_point", **settings
    )
    rng = np.random.default_rng(1)
    actions = rng.uniform(-1, 1, (40, 3, 3)).astype(np.float32)
    all_seen = [many.reset(seed=seeds)[0].copy()]
    all_paid = []
    for action in actions:
        seen, paid, *_ = many.step(action)
        all_seen.append(seen)
        all_paid.append(paid)
    for index, seed in enumerate(seeds):
        one = gymnasium.make("PumaReach-v0", **settings)
        one.reset(seed=0)
        one.unwrapped._cells.seed(np.array([seed], np.uint64))
        seen, _ = one.reset()
        over = False
        for step, action in enumerate(actions):
            np.testing.assert_array_equal(seen, all_seen[step][index])
            if over:
                (seen, _), reward, over = one.reset(), 0.0, False
            else:
                seen, reward, ended, truncated, _ = one.step(action[index])
                over = ended or truncated
            assert reward == all_paid[step][index]


def test_a_simple_servo_grasps_in_the_whole_cell():
    """Each joint follows one feature; that suffices near the goal, so it shows that it is one."""
    env = gymnasium.make("PumaCell-v0", actions="continuous", noise=0.1, max_episode_steps=200)
    ends = []
    env.reset(seed=1)
    for _ in range(20):
        (x, y, r, _), _ = env.reset()
        over = False
        while not over:
            nearer = np.clip((33.0 - r) / r, -0.3, 0.3)
            turns = np.array([0.15 * (103.5 - x), 12.0 * nearer + 0.0 * y, -0.12 * (78.0 - y)])
            action = np.clip(turns / [5.0, 20.0, 16.0], -1, 1).astype(np.float32)
            (x, y, r, _), _, ended, truncated, info = env.step(action)
            over = ended or truncated
        ends.append(info["outcome"])
    assert ends.count("grasped") >= 10, ends


def test_frames_show_the_ball():
    env = gymnasium.make("PumaCell-v0", observation="frame", actions="continuous")
    shown = 0
    for seed in range(20):
        frame, _ = env.reset(seed=seed)
        x, y, r = env.unwrapped._cells.features(0)
        found = puma_grasp.find_circles(frame[..., 0], min_radius=4)
        shown += any(np.hypot(found["x"] - x, found["y"] - y) < 1.5)
        after, *_ = env.step(np.array([0.3, 0.0, 0.0], np.float32))
        assert (after != frame).any()
    assert shown >= 15, shown


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (dict(task="grasping"), "task"),
        (dict(reward="none"), "reward"),
        (dict(observation="pixels"), "observation"),
        (dict(actions="both"), "actions"),
        (dict(level="mild"), "mild"),
        (dict(odd=["zeroes"]), "zeros"),
        (dict(noise=-1.0), "noise"),
        (dict(noise=float("nan")), "noise"),
        (dict(render_mode="human"), "render_mode"),
    ],
)
def test_a_wrong_setting_is_named(settings, words):
    from puma_grasp.envs import PumaCell

    with pytest.raises(ValueError, match=words):
        PumaCell(**settings)


def test_wrong_actions_are_refused():
    from puma_grasp.envs import PumaReach

    env = PumaReach(task="centering")
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(0)
    env.reset(seed=1)
    with pytest.raises(ValueError, match="0..8"):
        env.step(9)
    with pytest.raises(ValueError, match="0..8"):
        env.step(-1)
    with pytest.raises(TypeError, match="whole numbers"):
        env.step(1.5)
    with pytest.raises(ValueError, match="one cell at a time"):
        gymnasium.make_vec(
            "PumaReach-v0", 2, vectorization_mode="vector_entry_point", observation="frame"
        )
    env = PumaReach(actions="continuous")
    env.reset(seed=1)
    with pytest.raises(ValueError, match="finite"):
        env.step(np.full(3, np.nan))


def test_a_stock_algorithm_learns_to_reach_and_grasp():
    """CMA-ES finds a linear policy of ten weights in a minute of simulated arms."""
    pytest.importorskip("cma")
    from train_cma import learn, succeeded

    before = succeeded("PumaReach-v0", np.zeros(10), cells=200, seed=1_000)
    weights = learn(seed=1, generations=45)
    after = succeeded("PumaReach-v0", weights, cells=500, seed=1_000)
    grasped = succeeded("PumaCell-v0", weights, cells=100, seed=1_000)
    assert before < 0.1 and after > 0.9 and grasped > 0.8, (before, after, grasped)
