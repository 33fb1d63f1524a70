"""Learns to reach a ball with CMA-ES, a stock optimiser, in a batch of simulated cells.

The policy is linear: ten weights turn what is seen into turns of the three joints.

    pip install "puma-grasp[gym]" cma
    python train_cma.py --seed 1
"""

import argparse

import cma
import gymnasium
import numpy as np

import puma_grasp  # noqa: F401  (registers the environments)

#: Middle of the goal: x, y and radius of the ball, in feature units.
GOAL = np.array([103.5, 78.0, 33.0])


def turns(weights, seen):
    """The action of a batch of observations, as parts of the largest turns."""
    x, y, radius, elbow = seen.T
    w = weights
    aside = (GOAL[0] - x) / 40
    above = (GOAL[1] - y) / 40
    nearer = np.log(GOAL[2] / np.maximum(radius, 1))
    size, elbow = radius / GOAL[2], elbow / 30
    return np.stack(
        [
            (w[0] + w[1] * size) * aside,
            (w[2] + w[4] * elbow) * above + (w[3] + w[5] * elbow) * nearer,
            (w[6] + w[8] * elbow) * above + (w[7] + w[9] * elbow) * nearer,
        ],
        axis=1,
    )


def make(name, cells):
    return gymnasium.make_vec(
        name,
        cells,
        vectorization_mode="vector_entry_point",
        actions="continuous",
        noise=0.2,
        max_episode_steps=20,
    )


def first_episodes(env, weights, seed):
    """The outcome of the first episode of each cell, and how far off it ended."""
    seen, _ = env.reset(seed=seed)
    outcome = np.zeros(env.num_envs, np.uint8)
    running = np.ones(env.num_envs, bool)
    off = np.zeros(env.num_envs)
    while running.any():
        last = seen
        seen, _, ended, truncated, info = env.step(turns(weights, seen))
        outcome = np.where(running, info["outcome"], outcome)
        far = np.abs(np.log(last[:, 2] / GOAL[2])) + np.abs(last[:, :2] - GOAL[:2]).sum(1) / 40
        off = np.where(running, far, off)
        running &= ~(ended | truncated)
    return outcome, off


def succeeded(name, weights, cells, seed):
    """Share of episodes that end at the goal, or with the ball in the jaws."""
    outcome, _ = first_episodes(make(name, cells), weights, seed)
    return float(np.isin(outcome, [1, 3]).mean())


def learn(seed, generations, report=None):
    """Weights that CMA-ES finds; a lost ball costs more than one that is not reached."""
    env = make("PumaReach-v0", 256)
    search = cma.CMAEvolutionStrategy(10 * [0.0], 0.4, {"seed": seed, "verbose": -9})

    def cost(weights, seed):
        outcome, off = first_episodes(env, weights, seed)
        lost = outcome == 2
        return np.where(outcome == 1, 0, np.where(lost, 3, 1 + np.minimum(off, 2))).mean()

    for generation in range(generations):
        drawn = search.ask()
        search.tell(drawn, [cost(weights, generation) for weights in drawn])
        if report and generation % 5 == 4:
            report(generation + 1, search.mean)
    return search.mean


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--generations", type=int, default=60)
    options = parser.parse_args()

    def report(generation, weights):
        share = succeeded("PumaReach-v0", weights, 1000, 1_000_000)
        print(f"generation {generation:3}: {share:6.1%} of 1000 balls reached", flush=True)

    weights = learn(options.seed, options.generations, report)
    share = succeeded("PumaCell-v0", weights, 1000, 1_000_000)
    print(f"in the whole cell: {share:.1%} of 1000 balls grasped")


if __name__ == "__main__":
    main()
