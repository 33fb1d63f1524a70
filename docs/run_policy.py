#!/usr/bin/env python3
"""Runs an exported policy in a simulation of its own, with the standard library only.

    cargo run --release --example grasp -- --export policy.json
    python3 docs/run_policy.py policy.json --balls 200

This shows that the file is complete. The arm's lengths and the camera are facts of the cell and not
part of a policy, so they stand here: a PUMA 560, and a pinhole camera on its hand. Balls are drawn
at random and searched from the six poses; the arm makes the moves that the policy chooses until
both behaviours are at their goals.
"""

import argparse
import json
import math
import random
import sys

# The arm: Denavit-Hartenberg rows (alpha in degrees, a and d in metres) of the six joints.
LINKS = [
    (-90, 0, 0),
    (0, 0.4318, 0.14909),
    (90, -0.02032, 0),
    (-90, 0, 0.43307),
    (90, 0, 0),
    (0, 0, 0),
]
# Position of the camera in the hand's frame, metres. Its x axis (right in the image) lies along -y
# of the hand, its y axis (down) along x.
CAMERA = (-0.060, 0.0045, 0.020)
FOCAL = 11.5 / 8.8  # in widths of the frame
BALL_RADIUS = 0.020
SEARCH = [(pan, -110.0, 210.0, 0.0, 45.0, 0.0) for pan in (-75, -50, -25, 0, 25, 50)]
MOST_MOVES = 60


def hand(joints):
    """Rotation (rows) and position of the hand, at the wrist's centre."""
    rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    position = [0, 0, 0]
    for angle, (alpha, a, d) in zip(joints, LINKS):
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        ca, sa = math.cos(math.radians(alpha)), math.sin(math.radians(alpha))
        along = (a * c, a * s, d)
        position = [
            p + sum(row[k] * along[k] for k in range(3)) for p, row in zip(position, rotation)
        ]
        link = [[c, -s * ca, s * sa], [s, c * ca, -c * sa], [0, sa, ca]]
        rotation = [
            [sum(row[k] * link[k][j] for k in range(3)) for j in range(3)] for row in rotation
        ]
    return rotation, position


def see(joints, ball, frame):
    """x, y and r of the ball's outline in units of `frame`; None when it is not in view."""
    rotation, position = hand(joints)
    offset = [b - p for b, p in zip(ball, position)]
    in_hand = [sum(rotation[k][j] * offset[k] for k in range(3)) - CAMERA[j] for j in range(3)]
    right, down, depth = -in_hand[1], in_hand[0], in_hand[2]
    if depth <= BALL_RADIUS:
        return None
    # The rays that touch a ball form a cone; the image plane cuts it in an ellipse.
    width, height = frame
    focal, across = FOCAL * width, depth**2 - BALL_RADIUS**2
    x = width / 2 + focal * depth * right / across
    y = height / 2 + focal * depth * down / across
    distance2 = right**2 + down**2 + depth**2
    minor = focal * BALL_RADIUS / math.sqrt(across)
    major = focal * BALL_RADIUS * math.sqrt(distance2 - BALL_RADIUS**2) / across
    r = (minor + major) / 2
    return (x, y, r) if 0 <= x < width and 0 <= y < height and 5 <= r <= 68 else None


class Behaviour:
    """One behaviour of the policy, in one run."""

    def __init__(self, document, kappa, lost_weight, limits):
        self.document, self.kappa, self.lost_weight, self.limits = (
            document,
            kappa,
            lost_weight,
            limits,
        )
        self.weights = {}
        self.last = None

    def at_goal(self, values):
        return all(
            goal["low"] <= values[goal["input"]] <= goal["high"] for goal in self.document["goal"]
        )

    def state(self, values):
        number = 0
        for name, axis in zip(self.document["inputs"], self.document["space"]["quantities"]):
            edges, goal = axis["edges"], axis["goal"]
            interval = sum(edge <= values[name] for edge in edges)
            if goal is not None and interval == goal + 1 and values[name] == edges[goal]:
                interval = goal
            number = number * (len(edges) + 1) + interval
        return number

    def steps(self, action):
        """Joint (from 0) and degrees, for each joint that the behaviour moves."""
        steps = []
        for move in reversed(self.document["moves"]):
            action, choice = divmod(action, len(move["degrees"]))
            steps.append((int(move["joint"][1:]) - 1, move["degrees"][choice]))
        return steps

    def within_limits(self, joints, action):
        return all(
            self.limits[j][0] <= joints[j] + step <= self.limits[j][1]
            for j, step in self.steps(action)
        )

    def choose(self, values, joints):
        """The steps to make now."""
        self.last = None
        if self.at_goal(values):
            return []
        state, best = self.state(values), None
        for action, q in enumerate(self.document["q"][state]):
            worth = q - self.kappa * self.weights.get((state, action), 0)
            if (best is None or worth > best[0]) and self.within_limits(joints, action):
                best = (worth, action)
        if best is None:
            return []
        self.last = (state, best[1])
        self.weights[self.last] = 2 * self.weights.get(self.last, 0) + 1
        return self.steps(best[1])

    def lost(self):
        if self.last:
            self.weights[self.last] += self.lost_weight


def run(policy, ball):
    """Returns the moves to the goal; None if not reached, "unseen" if no pose shows the ball."""
    limits, breaker = policy["limits_degrees"], policy["loop_breaker"]
    names = ("centering", "approaching")
    behaviours = [
        Behaviour(policy[name], breaker[name], breaker["lost_weight"], limits) for name in names
    ]
    conventions = policy["approaching"]["conventions"]
    frame = conventions["frame"]
    joints = next((list(pose) for pose in SEARCH if see(pose, ball, frame)), None)
    if joints is None:
        return "unseen"
    for moves in range(MOST_MOVES + 1):
        x, y, r = see(joints, ball, frame)
        values = {"X": x, "Y": y, "R": r, "Theta3": joints[2] - conventions["theta3_zero_degrees"]}
        if all(behaviour.at_goal(values) for behaviour in behaviours):
            return moves
        moved = list(joints)
        for behaviour in behaviours:
            for joint, step in behaviour.choose(values, joints):
                moved[joint] += step
        if see(moved, ball, frame):
            joints = moved
        else:
            # Back to where the ball was in view.
            for behaviour in behaviours:
                behaviour.lost()
    return None


def main():
    parser = argparse.ArgumentParser(
        description="Run an exported policy in a simulation of its own."
    )
    parser.add_argument("policy", help="JSON written by `grasp --export`")
    parser.add_argument("--balls", type=int, default=200, help="how many balls to go for [200]")
    parser.add_argument("--seed", type=int, default=1, help="seed of their places [1]")
    options = parser.parse_args()
    with open(options.policy, encoding="utf-8") as file:
        policy = json.load(file)
    if policy.get("format") != "grasp-agent policy 1":
        sys.exit(f"{options.policy}: no policy of the form that is read here")
    rng, moves, runs = random.Random(options.seed), [], 0
    while runs < options.balls:
        away, azimuth = rng.uniform(0.5, 0.8), math.radians(rng.uniform(-70, 70))
        ball = (away * math.cos(azimuth), away * math.sin(azimuth), rng.uniform(-0.2, 0.05))
        result = run(policy, ball)
        if result == "unseen":
            continue
        runs += 1
        if result is not None:
            moves.append(result)
    print(
        f"reached {len(moves)} of {runs} balls, "
        f"in {sum(moves) / max(len(moves), 1):.2f} moves on average"
    )


if __name__ == "__main__":
    main()
