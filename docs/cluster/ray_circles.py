#!/usr/bin/env python3
"""Circles in many pictures with Ray Data and the Python package `puma_grasp`.

    pip install "./bindings/python" "ray[data]" pillow
    python docs/cluster/ray_circles.py pictures/ circles/
    python docs/cluster/ray_circles.py --drawn 100000 circles/     # drawn pictures, for a trial

Each row of the result (Parquet files) is one picture: its name and the list of its circles. A
worker that dies loses nothing: Ray does its batch again. At the end the sum of the pictures' ids is
checked, so that none is lost and none is counted twice.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import ray

FIELDS = ("x", "y", "radius", "score")
SIZE = 96


def draw(number):
    """A noisy picture of one disc whose place and size follow from its number."""
    rng = np.random.default_rng(number)
    x, y = rng.uniform(30, SIZE - 30, 2)
    radius = rng.uniform(10, 28)
    rows, columns = np.mgrid[:SIZE, :SIZE]
    picture = np.where(np.hypot(columns - x, rows - y) < radius, 60, 180)
    return (picture + rng.normal(0, 5, picture.shape)).clip(0, 255).astype(np.uint8)


class Finder:
    """A detector that lives as long as its worker."""

    settings = {}

    def __init__(self):
        from puma_grasp import Detector

        self.detector = Detector(**self.settings)

    def __call__(self, batch):
        circles = {field: [] for field in FIELDS}
        for index in range(len(batch["id"])):
            stored = "path" in batch
            picture = read(batch["path"][index]) if stored else draw(batch["id"][index])
            found = self.detector.detect(picture)
            for field in FIELDS:
                circles[field].append(found[field].tolist())
        columns = {field: np.array(lists, dtype=object) for field, lists in circles.items()}
        return {**batch, **columns}


def read(path):
    from PIL import Image

    return np.asarray(Image.open(path).convert("L"))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pictures", nargs="?", help="folder with pictures")
    parser.add_argument("out", help="folder for the result")
    parser.add_argument("--drawn", type=int, help="draw this many pictures instead")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--batch", type=int, default=500)
    parser.add_argument("--min-radius", type=float, default=8.0)
    parser.add_argument("--alone", action="store_true", help="without Ray, for comparison")
    options = parser.parse_args()

    if options.drawn:
        rows = [{"id": number} for number in range(options.drawn)]
    else:
        paths = sorted(p for p in Path(options.pictures).rglob("*") if p.is_file())
        rows = [{"id": number, "path": str(path)} for number, path in enumerate(paths)]
    # A part of the class, so that a worker that is started again has it too.
    Finder.settings = {"min_radius": options.min_radius}
    begun = time.perf_counter()
    if options.alone:
        finder = Finder()
        for start in range(0, len(rows), options.batch):
            part = rows[start : start + options.batch]
            finder({key: np.array([row[key] for row in part]) for key in rows[0]})
        seconds = time.perf_counter() - begun
        print(f"{len(rows)} pictures alone: {len(rows) / seconds:.0f} a second")
        return

    ray.init(include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    ray.data.DataContext.get_current().enable_progress_bars = False
    found = (
        ray.data.from_items(rows, override_num_blocks=max(2, len(rows) // options.batch))
        .map_batches(
            Finder,
            compute=ray.data.ActorPoolStrategy(size=options.workers),
            batch_size=options.batch,
            num_cpus=1,
        )
    )
    begun = time.perf_counter()
    found.write_parquet(options.out)
    seconds = time.perf_counter() - begun
    result = ray.data.read_parquet(options.out)
    ids = np.sort(np.concatenate([b["id"] for b in result.iter_batches(batch_size=None)]))
    whole = len(ids) == len(rows) and (ids == np.arange(len(rows))).all()
    print(f"{len(rows)} pictures on {options.workers} workers: {len(rows) / seconds:.0f} a second")
    print(f"sum of ids {ids.sum()}: {'none lost, none doubled' if whole else 'NOT WHOLE'}")
    if not whole:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
