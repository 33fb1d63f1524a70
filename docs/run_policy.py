#!/usr/bin/env python3
"""Runs an exported policy in a simulation of its own, with the standard library only.

    cargo run --release --example grasp -- --export policy.json
    python3 docs/run_policy.py policy.json --balls 200

This shows that the file is complete: arm, camera and ball, search poses, recovery and grip stand in
it. Balls are drawn at random. The arm looks for each from the search poses and makes the moves that
the policy chooses until both behaviours are at their goals; a lost ball is looked for again. At the
goal the grip is made, and the ball counts as gripped if it lies between the jaws.
"""

import argparse
import json
import math
import random
import sys



class Cell:
    """The arm and the camera that a policy was learned for."""

    def __init__(self, policy):
        self.model = policy["task"]["learned_for"]
        arm = self.model["arm"]
        # Denavit-Hartenberg rows (alpha in degrees, a and d in metres) of the six joints.
        self.links = [
            (-90, 0, 0),
            (0, arm["a2"], arm["d2"]),
            (90, arm["a3"], 0),
            (-90, 0, arm["d4"]),
            (90, 0, 0),
            (0, 0, 0),
        ]
        mount = self.model["mount"]
        self.place = mount["translation"]
        i, j, k, w = mount["rotation"]
        self.axes = [
            [1 - 2 * (j * j + k * k), 2 * (i * j - k * w), 2 * (i * k + j * w)],
            [2 * (i * j + k * w), 1 - 2 * (i * i + k * k), 2 * (j * k - i * w)],
            [2 * (i * k - j * w), 2 * (j * k + i * w), 1 - 2 * (i * i + j * j)],
        ]

    def hand(self, joints):
        """Rotation (rows) and position of the hand, at the wrist's centre."""
        rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        position = [0, 0, 0]
        for angle, (alpha, a, d) in zip(joints, self.links):
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

    def in_hand(self, joints, point):
        """A point in the hand's frame."""
        rotation, position = self.hand(joints)
        offset = [b - p for b, p in zip(point, position)]
        return [sum(rotation[k][j] * offset[k] for k in range(3)) for j in range(3)]

    def see(self, joints, ball, frame):
        """x, y and r of the ball's outline in the units of the frame; None out of view."""
        offset = [b - p for b, p in zip(self.in_hand(joints, ball), self.place)]
        right, down, depth = (sum(self.axes[k][j] * offset[k] for k in range(3)) for j in range(3))
        radius, focal = self.model["ball_radius"], self.model["focal"]
        if depth <= radius:
            return None
        # The rays that touch a ball form a cone; the image plane cuts it in an ellipse.
        across = depth**2 - radius**2
        x = self.model["centre"][0] + focal * depth * right / across
        y = self.model["centre"][1] + focal * depth * down / across
        distance2 = right**2 + down**2 + depth**2
        minor = focal * radius / math.sqrt(across)
        major = focal * radius * math.sqrt(distance2 - radius**2) / across
        r = (minor + major) / 2
        return (x, y, r) if 0 <= x < frame[0] and 0 <= y < frame[1] and 5 <= r <= 68 else None

    def grip_miss(self, joints, ball):
        """Distance from the middle of the jaws to the ball, metres."""
        jaws = self.model["arm"]["d6"] + self.model["tool"]
        x, y, z = self.in_hand(joints, ball)
        return math.sqrt(x * x + y * y + (z - jaws) ** 2)


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

    def moves(self):
        """Whether the action chosen last moves a joint."""
        return self.last is not None and any(step for _, step in self.steps(self.last[1]))

    def lost(self):
        self.weights[self.last] += self.lost_weight


def displaced(pose, moves, limits):
    """The pose and, one after the other, the pose after each of the moves, within the limits."""
    for move in [[0] * 6, *moves]:
        yield [
            min(max(p + m, low), high) for p, m, (low, high) in zip(pose, move, limits)
        ]


def run(policy, cell, ball):
    """Returns the moves to the goal and the distance of the jaws from the ball after the grip; None
    if not reached, "unseen" if no pose shows the ball."""
    task, breaker = policy["task"], policy["loop_breaker"]
    limits, border = task["limits_degrees"], policy["border"]
    centering, approaching = behaviours = [
        Behaviour(policy[name], breaker[name], breaker["lost_weight"], limits)
        for name in ("centering", "approaching")
    ]
    conventions = policy["approaching"]["conventions"]
    frame = conventions["frame"]

    def first_in_view(poses):
        return next((pose for pose in poses if cell.see(pose, ball, frame)), None)

    again = [[0] * 6, *task["search_again_degrees"]]
    search = [
        list(displaced(pose, [move], limits))[1]
        for move in again
        for pose in task["search_poses_degrees"]
    ]
    joints = first_in_view(search)
    if joints is None:
        return "unseen"
    for moves in range(task["most_moves"] + 1):
        x, y, r = cell.see(joints, ball, frame)
        values = {"X": x, "Y": y, "R": r, "Theta3": joints[2] - conventions["theta3_zero_degrees"]}
        if all(behaviour.at_goal(values) for behaviour in behaviours):
            gripping = [j + turn for j, turn in zip(joints, task["grip_degrees"])]
            return moves, cell.grip_miss(gripping, ball)
        turn, reach = centering.choose(values, joints), []
        approaching.last = None
        if border <= x <= frame[0] - border or not any(step for _, step in turn):
            reach = approaching.choose(values, joints)
        moved = list(joints)
        for joint, step in turn + reach:
            moved[joint] += step
        if cell.see(moved, ball, frame):
            joints = moved
            continue
        lost_by = next((b for b in (approaching, centering) if b.moves()), None)
        if lost_by is not None:
            lost_by.lost()
        # Back to where the ball was in view; it still lies there.
        joints = first_in_view([*displaced(joints, task["recovery_degrees"], limits), *search])
        if joints is None:
            return None
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
    if policy.get("format") != "grasp-agent policy 2":
        sys.exit(f"{options.policy}: no policy of the form that is read here")
    cell = Cell(policy)
    rng, moves, gripped, runs = random.Random(options.seed), [], 0, 0
    while runs < options.balls:
        away, azimuth = rng.uniform(0.5, 0.8), math.radians(rng.uniform(-70, 70))
        ball = (away * math.cos(azimuth), away * math.sin(azimuth), rng.uniform(-0.2, 0.05))
        result = run(policy, cell, ball)
        if result == "unseen":
            continue
        runs += 1
        if result is not None:
            moves.append(result[0])
            gripped += result[1] < 0.010
    print(
        f"reached {len(moves)} of {runs} balls, "
        f"in {sum(moves) / max(len(moves), 1):.2f} moves on average; gripped {gripped}"
    )


if __name__ == "__main__":
    main()
