"""Learns to reach a ball with PPO or DQN of Stable-Baselines3, with their usual settings.

pip install "puma-grasp[gym]" stable-baselines3
python train_sb3.py --steps 400000 --curve ppo.svg
python train_sb3.py --algorithm dqn --task centering --steps 100000
"""

import argparse
from pathlib import Path

import numpy as np
import torch
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env

import puma_grasp  # noqa: F401  (registers the environments)


class Curve(BaseCallback):
    """The share of balls reached by the policy as it is, now and then."""

    def __init__(self, task, every):
        super().__init__()
        self.env = make("PumaReach-v0", task, 50)
        self.every = every
        self.points = []

    def _on_step(self):
        if self.num_timesteps >= self.every * (len(self.points) + 1):
            share = reached(self.model, self.env, 1000)
            self.points.append((self.num_timesteps, share))
            print(f"{self.num_timesteps:8} steps: {share:6.1%} of 1000 balls reached", flush=True)
        return True


def make(name, task, cells, seed=None):
    settings = dict(task=task, observation="scaled", reward="shaped")
    return make_vec_env(name, cells, seed=seed, env_kwargs=settings)


def reached(model, env, episodes):
    """Share of episodes that end at the goal, or with the ball in the jaws, from fixed seeds."""
    env.seed(1_000_000)
    seen, ends = env.reset(), []
    while len(ends) < episodes:
        actions, _ = model.predict(seen, deterministic=True)
        seen, _, ended, infos = env.step(actions)
        ends += [info["outcome"] for info, over in zip(infos, ended) if over]
    return float(np.isin(ends[:episodes], ["reached", "grasped"]).mean())


def draw(points, title, path):
    """Draws the curve as SVG."""
    most = points[-1][0]
    line = " ".join(f"{60 + 500 * x / most:.1f},{240 - 200 * y:.1f}" for x, y in [(0, 0), *points])
    grid = "".join(
        f'<path d="M60 {240 - 2 * y}H560" stroke="#ccc"/><text x="52" y="{244 - 2 * y}" '
        f'text-anchor="end">{y} %</text>'
        for y in (0, 25, 50, 75, 100)
    )
    ticks = "".join(
        f'<text x="{60 + 500 * i / 4}" y="258" text-anchor="middle">{most * i // 4:,}</text>'
        for i in range(5)
    )
    path.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 600 290" font-family="sans-serif" '
        'font-size="12"><rect width="600" height="290" fill="white"/>'
        f'<text x="310" y="22" text-anchor="middle" font-size="14">{title}</text>{grid}{ticks}'
        '<text x="310" y="280" text-anchor="middle">steps of training</text>'
        f'<polyline points="{line}" fill="none" stroke="#1f6fb4" stroke-width="2"/></svg>\n'
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--algorithm", choices=["ppo", "dqn"], default="ppo")
    parser.add_argument("--task", default="reaching")
    parser.add_argument("--steps", type=int, default=400_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--curve", type=Path, help="file for the training curve, SVG")
    options = parser.parse_args()
    # The networks are too small for several threads.
    torch.set_num_threads(1)
    if options.algorithm == "ppo":
        env = make("PumaReach-v0", options.task, 16, options.seed)
        model = PPO("MlpPolicy", env, n_steps=128, batch_size=256, seed=options.seed)
    else:
        env = make("PumaReach-v0", options.task, 4, options.seed)
        model = DQN("MlpPolicy", env, seed=options.seed)
    curve = Curve(options.task, options.steps // 20)
    model.learn(options.steps, callback=curve)
    if options.curve:
        name = options.algorithm.upper()
        draw(curve.points, f"{name}, {options.task}: share of 1000 balls reached", options.curve)
    share = reached(model, make("PumaCell-v0", options.task, 10), 200)
    print(f"in the whole cell: {share:.1%} of 200 balls grasped")


if __name__ == "__main__":
    main()
