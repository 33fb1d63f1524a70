#!/usr/bin/env python3
"""A sweep of compare_controllers as Ray tasks, one a shard, through the package puma_grasp.

    pip install ./bindings/python ray
    python docs/cluster/ray_sweep.py 8 out/sweep --levels heavy --draws 64

A task whose worker dies is run again by Ray and goes on where it stopped. On a cluster the package
is installed on every node and the folder is at the same path there: start Ray (`ray start`) and set
RAY_ADDRESS. Without it, the tasks run on this machine; --workers N (first) limits their number.
"""

import sys
from pathlib import Path

import ray
from puma_grasp import compare_controllers


@ray.remote(num_cpus=1, max_retries=3)
def shard(part, of, out, options):
    """Does one shard, and returns its number."""
    name = ["--shard", f"{part}/{of}", "--out", str(out / f"shard{part}")]
    compare_controllers([*name, "--threads", "1", "--resume", *options])
    return part


def main():
    arguments = sys.argv[1:]
    workers = None
    if arguments[:1] == ["--workers"]:
        workers, arguments = int(arguments[1]), arguments[2:]
    if len(arguments) < 2:
        sys.exit(__doc__)
    of, out, options = int(arguments[0]), Path(arguments[1]).resolve(), arguments[2:]
    ray.init(num_cpus=workers, include_dashboard=False, log_to_driver=False)
    left = [shard.remote(part + 1, of, out, options) for part in range(of)]
    while left:
        done, left = ray.wait(left)
        print(f"shard {ray.get(done[0])} of {of} is done, {len(left)} left", flush=True)
    folders = [str(out / f"shard{part + 1}") for part in range(of)]
    compare_controllers(["--out", str(out / "merged"), "--merge", *folders])


if __name__ == "__main__":
    main()
