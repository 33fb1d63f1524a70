#!/usr/bin/env python3
"""A sweep of compare_controllers as Ray tasks, one a shard.

    pip install ray
    python docs/cluster/ray_sweep.py 8 out/sweep --levels heavy --draws 64

A task whose worker dies is run again by Ray and goes on where it stopped. On a cluster the folder
and the program must be at the same path on every node: start Ray there (`ray start`) and set
RAY_ADDRESS.
"""

import os
import subprocess
import sys
from pathlib import Path

import ray

PROGRAM = os.environ.get("COMPARE", "target/release/examples/compare_controllers")


@ray.remote(num_cpus=1, max_retries=3)
def shard(part, of, out, options):
    """Runs one shard, and returns its number. The shard ends with the task."""
    folder = out / f"shard{part}"
    command = [PROGRAM, "--threads", "1", "--resume", "--shard", f"{part}/{of}"]
    with open(out / f"shard{part}.log", "a", encoding="utf-8") as log:
        subprocess.run(
            [*command, "--out", str(folder), *options], check=True, stdout=log, stderr=log
        )
    return part


def main():
    of, out, options = int(sys.argv[1]), Path(sys.argv[2]).resolve(), sys.argv[3:]
    out.mkdir(parents=True, exist_ok=True)
    # Options of ray.init come from the environment: RAY_ADDRESS joins a cluster.
    ray.init(include_dashboard=False, log_to_driver=False)
    left = [shard.remote(part + 1, of, out, options) for part in range(of)]
    while left:
        done, left = ray.wait(left)
        print(f"shard {ray.get(done[0])} of {of} is done, {len(left)} left", flush=True)
    folders = [str(out / f"shard{part + 1}") for part in range(of)]
    subprocess.run([PROGRAM, "--merge", *folders, "--out", str(out / "merged")], check=True)


if __name__ == "__main__":
    main()
