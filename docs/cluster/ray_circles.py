#!/usr/bin/env python3
"""Circles in many pictures with Ray Data and the Python package `puma_grasp`.

    pip install ./bindings/python "ray[data]" pillow
    python docs/cluster/ray_circles.py pictures/ circles/

Pictures are PNG, JPEG and other files in a folder, or Parquet files with the columns `id` (0, 1,
...) and `bytes` (an encoded picture). Each row of the result (Parquet files) is one picture: its
id, its file if it has one, its circles, and the process that found them. A worker that dies loses
nothing: Ray does its batch again. At the end the ids are checked, so that none is lost and none is
counted twice.

A trial with 100,000 drawn pictures, of which a worker is killed after 20 seconds:

    python docs/cluster/ray_circles.py --draw 100000 pictures/
    python docs/cluster/ray_circles.py --alone pictures/ alone/
    python docs/cluster/ray_circles.py --kill 20 pictures/ circles/
"""

import argparse
import io
import os
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
from PIL import Image

FIELDS = ("x", "y", "radius", "score")
#: Pictures of a file that is drawn, and of a batch.
TOGETHER = 1000


def draw(number, size):
    """A noisy picture of one disc whose place and size follow from its number, as PNG."""
    rng = np.random.default_rng(number)
    x, y = rng.uniform(22, size - 22, 2)
    radius = rng.uniform(9, 20)
    rows, columns = np.ogrid[:size, :size]
    picture = np.where(np.hypot(columns - x, rows - y) < radius, 60, 180)
    picture = picture + rng.integers(-3, 4, picture.shape)
    png = io.BytesIO()
    Image.fromarray(picture.astype(np.uint8)).save(png, "PNG", compress_level=1)
    return png.getvalue()


def draw_all(count, size, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for first in range(0, count, TOGETHER):
        ids = list(range(first, min(first + TOGETHER, count)))
        table = pyarrow.table({"id": ids, "bytes": [draw(number, size) for number in ids]})
        pyarrow.parquet.write_table(table, folder / f"{first:09}.parquet")


def find(batch, settings, started=None):
    """The circles in a batch of pictures; `started` is a folder for the names of processes."""
    from puma_grasp import Detector

    if started:
        (Path(started) / str(os.getpid())).touch()
    detector = Detector(**settings)
    circles = {field: [] for field in FIELDS}
    stored = batch["path"] if "path" in batch else map(io.BytesIO, batch["bytes"])
    for picture in stored:
        found = detector.detect(np.asarray(Image.open(picture).convert("L")))
        for field in FIELDS:
            circles[field].append(found[field].tolist())
    kept = {name: column for name, column in batch.items() if name != "bytes"}
    lists = {field: np.array([*rows, None], object)[:-1] for field, rows in circles.items()}
    return {**kept, **lists, "process": np.full(len(batch["id"]), os.getpid())}


def stored_pictures(folder):
    """The Parquet files of a folder, or rows of an id and the path of each other file."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    parquet = [str(path) for path in files if path.suffix == ".parquet"]
    if not files or (parquet and len(parquet) < len(files)):
        sys.exit(f"{folder}: must hold pictures, or Parquet files alone")
    return parquet, [{"id": number, "path": str(path)} for number, path in enumerate(files)]


def find_alone(folder, out, settings, size):
    """Does the work in this process without Ray."""
    parquet, rows = stored_pictures(folder)

    def batches():
        for file in parquet:
            for batch in pyarrow.parquet.ParquetFile(file).iter_batches(size):
                yield {name: np.array(batch[name].to_pylist()) for name in batch.schema.names}
        for first in range(0, 0 if parquet else len(rows), size):
            part = rows[first : first + size]
            yield {name: np.array([row[name] for row in part]) for name in ("id", "path")}

    for number, batch in enumerate(batches()):
        columns = {name: list(column) for name, column in find(batch, settings).items()}
        pyarrow.parquet.write_table(pyarrow.table(columns), out / f"{number:09}.parquet")


def find_by_ray(folder, out, settings, size, workers, kill):
    """Does the work on the workers of Ray; one of them is killed after `kill` seconds."""
    import ray

    # The core beyond the workers reads and writes. RAY_ADDRESS joins a cluster instead.
    cores = None if "RAY_ADDRESS" in os.environ else workers + 1
    ray.init(num_cpus=cores, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    context = ray.data.DataContext.get_current()
    context.enable_progress_bars = False
    context.print_on_execution_start = False
    parquet, rows = stored_pictures(folder)
    # Tasks of moderate size: that of a worker that dies is done again from its beginning.
    context.target_max_block_size = 8 << 20
    pictures = ray.data.read_parquet(str(folder)) if parquet else ray.data.from_items(rows)
    with tempfile.TemporaryDirectory() as started:
        # Tasks, not actors: Ray does the task of a worker that died again.
        found = pictures.map_batches(
            find,
            fn_kwargs={"settings": settings, "started": started if kill else None},
            compute=ray.data.TaskPoolStrategy(size=workers),
            batch_size=size,
            num_cpus=1,
        )
        if kill:
            threading.Thread(target=kill_worker, args=(started, kill), daemon=True).start()
        begun = time.perf_counter()
        found.write_parquet(str(out))
        return time.perf_counter() - begun


def kill_worker(started, seconds):
    """Kills the worker on this machine that began a batch last, by SIGKILL."""
    while not any(Path(started).iterdir()):
        time.sleep(0.1)
    time.sleep(seconds)
    last = max(Path(started).iterdir(), key=lambda file: file.stat().st_mtime)
    os.kill(int(last.name), signal.SIGKILL)
    print(f"process {last.name} was killed after {seconds:g} s", flush=True)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pictures", type=Path, help="folder of the pictures")
    parser.add_argument("out", type=Path, nargs="?", help="new folder for the result")
    parser.add_argument("--draw", type=int, metavar="N", help="draw N pictures, and end")
    parser.add_argument("--size", type=int, default=64, help="side of a drawn picture [64]")
    parser.add_argument("--workers", type=int, default=2, help="worker processes [2]")
    parser.add_argument("--batch", type=int, default=TOGETHER, help="pictures of a batch [1000]")
    parser.add_argument("--min-radius", type=float, default=8.0, help="pixels [8]")
    parser.add_argument("--alone", action="store_true", help="in one process without Ray")
    parser.add_argument("--kill", type=float, metavar="S", help="kill a worker after S seconds")
    options = parser.parse_args()
    if options.draw:
        return draw_all(options.draw, options.size, options.pictures)
    if options.out is None:
        parser.error("the folder for the result is missing")
    options.out.mkdir(parents=True, exist_ok=True)
    if any(options.out.iterdir()):
        parser.error(f"{options.out}: is not empty; choose a new folder")

    settings = {"min_radius": options.min_radius}
    work = options.pictures, options.out, settings, options.batch
    begun = time.perf_counter()
    if options.alone:
        find_alone(*work)
        seconds = time.perf_counter() - begun
    else:
        seconds = find_by_ray(*work, options.workers, options.kill)

    # The ids that there are, from the pictures; those that were done, from the result.
    parquet, rows = stored_pictures(options.pictures)
    read = pyarrow.parquet.read_table
    expected = [row["id"] for row in rows]
    if parquet:
        expected = read(parquet, columns=["id"])["id"].to_numpy()
    result = read(options.out, columns=["id", "x", "process"])
    done = result["id"].to_numpy()
    lost = np.setdiff1d(expected, done).size
    doubled = done.size - np.unique(done).size
    how = "1, without Ray" if options.alone else options.workers
    circles = sum(map(len, result["x"].to_pylist()))
    print("workers | pictures | circles | a second | sum of ids | lost | doubled | of each process")
    parts = np.unique_counts(result["process"].to_numpy()).counts.tolist()
    print(how, done.size, circles, f"{done.size / seconds:.0f}", done.sum(), sep=" | ", end=" | ")
    print(lost, doubled, parts, sep=" | ")
    if lost or doubled or done.sum() != np.sum(expected):
        sys.exit("the result is not whole")


if __name__ == "__main__":
    main()
