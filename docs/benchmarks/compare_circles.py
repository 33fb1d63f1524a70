#!/usr/bin/env python3
"""Compares the circle detectors with those of OpenCV: same frames, same radii, one run.

    python3 -m venv venv && venv/bin/pip install numpy 'opencv-contrib-python-headless<5'
    cargo build --release --example detect_circles --example render_dataset
    venv/bin/python docs/benchmarks/compare_circles.py FOLDER... --csv circles.csv
    venv/bin/python docs/benchmarks/compare_circles.py --scenes benchmark --frames 20
    cargo build --release -p circle-benches --example scenes
    venv/bin/python docs/benchmarks/compare_circles.py --scenes simple --frames 20

A FOLDER is a set. It holds images and may hold the tables that `render_dataset` writes: truth.csv
(file,cx,cy,r and any further columns; (0, 0) is the centre of the top-left pixel) with a row for
each circle, and frames.csv (file,scene) or files.txt (a name a line) with the frames that count. A
frame without a row in truth.csv holds no circle; a folder without truth.csv holds none at all. With
frames.csv every scene is a set. `--scenes` renders sets of these kinds first, as `render_dataset`
names them, or with `simple` those of the example `scenes` of the detector's crate.

Prints a Markdown table and writes CSV: a row for each set and detector, and a row `mean of sets`
for each detector. Columns:

    recall, precision   share of the true circles that were found and of the found ones that are
                        true; at an intersection over union (IoU) of the two discs of at least
                        0.8, and once more with centre and radius each within 2 px
    average_precision   area under precision over recall as the score falls, over all frames of
                        the set (IoU 0.8)
    top1                share of the frames with circles whose best detection is true (IoU 0.8)
    false_per_empty     false circles per frame that holds none
    centre, radius      errors of the circles matched within 2 px: median and 95th percentile, px
    cpu_ms              CPU time of one thread from gray image in memory to circles: the least of
                        the repetitions of a frame, then median, 95th percentile and maximum
    cpu_ms_per_mpx      the worst frame's time by its size, ms per megapixel

OpenCV's detectors are HoughCircles with HOUGH_GRADIENT (`hough`) and HOUGH_GRADIENT_ALT
(`hough-alt`), whose votes serve as scores, and EdgeDrawing with detectEllipses, that is EDCircles,
after a blur (`ed`) and without (`ed-unblurred`); these have no score and are ranked as listed. Each
has one setting for all frames. Times on a shared machine move: the repetitions are spread over
--rounds passes through all detectors. Compare ratios within one run only.
"""

import argparse
import csv
import datetime
import glob
import math
import os
import platform
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field

# glibc returns the large blocks that HoughCircles needs for every frame to the system, and the page
# faults then triple its time. These settings keep the blocks; a program reads them when it starts,
# so this one starts again with them.
ALLOCATOR = {"MALLOC_MMAP_THRESHOLD_": str(256 << 20), "MALLOC_TRIM_THRESHOLD_": str(1 << 30)}
if __name__ == "__main__" and not ALLOCATOR.items() <= os.environ.items():
    os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **ALLOCATOR})

import cv2
import numpy as np

ENDINGS = (".png", ".jpg", ".jpeg", ".pgm")


@dataclass
class Frame:
    gray: np.ndarray
    path: str  # the same gray levels as a file, for our program
    truth: list  # of (x, y, r)


@dataclass
class Found:
    """What a detector found in one frame: (score, (x, y, r)), and its CPU time in ms."""

    circles: list = field(default_factory=list)
    cpu: float = math.inf


# ---- frames ----


def read_sets(folder, scratch, pad):
    """The sets of a folder: name -> frames."""
    listing = os.path.join(folder, "frames.csv")
    plain = os.path.join(folder, "files.txt")
    name = os.path.basename(os.path.normpath(folder))
    if os.path.exists(listing):
        with open(listing, newline="") as file:
            members = [(row["file"], row["scene"]) for row in csv.DictReader(file)]
    elif os.path.exists(plain):
        with open(plain) as file:
            members = [(line.strip(), name) for line in file if line.strip()]
    else:
        images = (
            path
            for path in sorted(glob.glob(os.path.join(glob.escape(folder), "*")))
            if path.lower().endswith(ENDINGS)
        )
        members = [(os.path.basename(path), name) for path in images]
    if not members:
        sys.exit(f"{folder}: no images")
    truth = {}
    if os.path.exists(os.path.join(folder, "truth.csv")):
        with open(os.path.join(folder, "truth.csv"), newline="") as file:
            for row in csv.DictReader(file):
                truth.setdefault(row["file"], []).append(
                    (float(row["cx"]) + pad, float(row["cy"]) + pad, float(row["r"]))
                )
        strangers = truth.keys() - {file for file, _ in members}
        if strangers:
            sys.exit(f"{folder}/truth.csv: {min(strangers)} is not among the frames")
    sets = {}
    for number, (file, scene) in enumerate(members):
        gray = cv2.imread(os.path.join(folder, file), cv2.IMREAD_GRAYSCALE)
        if gray is None:
            sys.exit(f"{folder}/{file}: not an image that OpenCV reads")
        if pad:
            gray = cv2.copyMakeBorder(gray, pad, pad, pad, pad, cv2.BORDER_REPLICATE)
        # Decoders differ by a gray level here and there: both sides get the very same bytes.
        path = os.path.join(scratch, f"{number:05}.pgm")
        cv2.imwrite(path, gray)
        sets.setdefault(scene, []).append(Frame(gray, path, truth.get(file, [])))
    return sets


def render(options, size, out):
    """Renders the scenes at a size, "WxH"."""
    program = (
        [options.simple_renderer]
        if options.scenes == "simple"
        else [options.renderer, "--kinds", options.scenes]
    )
    command = [
        *program,
        "--out",
        out,
        "--frames",
        str(options.frames),
        "--seed",
        str(options.seed),
        "--size",
        size,
    ]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


# ---- detectors ----


def hough(method, edge, votes):
    def detect(gray, smallest, largest):
        smooth = cv2.GaussianBlur(gray, (5, 5), 1.2)
        found = cv2.HoughCirclesWithAccumulator(
            smooth,
            method,
            dp=1,
            minDist=max(6, 0.02 * gray.shape[1]),
            param1=edge,
            param2=votes,
            minRadius=int(smallest),
            maxRadius=int(largest),
        )
        return (
            []
            if found is None
            else [(float(c[3]), tuple(map(float, c[:3]))) for c in found.reshape(-1, 4)]
        )

    return detect


def edge_drawing(blur):
    settings = cv2.ximgproc.EdgeDrawing.Params()
    settings.EdgeDetectionOperator = cv2.ximgproc.EdgeDrawing_SOBEL
    settings.GradientThresholdValue = 60
    settings.Sigma = 1.0
    settings.NFAValidation = True
    settings.PFmode = False
    drawing = cv2.ximgproc.createEdgeDrawing()
    drawing.setParams(settings)

    def detect(gray, smallest, largest):
        drawing.detectEdges(cv2.GaussianBlur(gray, (9, 9), 2.0) if blur else gray)
        shapes = drawing.detectEllipses()
        circles = []
        for x, y, radius, major, minor, _ in (
            [] if shapes is None else shapes.reshape(-1, 6).astype(float)
        ):
            # A shape is a circle, or an ellipse, which passes for a circle if it is nearly one.
            if radius <= 0 and min(major, minor) > 0.9 * max(major, minor):
                radius = (major + minor) / 2
            circle = (x, y, radius)
            if smallest <= radius <= largest and all(
                overlap(circle, other) < 0.8 for other in circles
            ):
                circles.append(circle)
        return [(-place, circle) for place, circle in enumerate(circles)]

    return detect


RIVALS = {
    "hough": lambda: hough(cv2.HOUGH_GRADIENT, 200, 32),
    "hough-alt": lambda: hough(cv2.HOUGH_GRADIENT_ALT, 300, 0.9),
    "ed": lambda: edge_drawing(True),
    "ed-unblurred": lambda: edge_drawing(False),
}


def run_rival(detect, frames, options, found):
    for frame, result in zip(frames, found):
        for _ in range(options.repeat):
            start = time.process_time()
            result.circles = detect(frame.gray, options.min_radius, options.max_radius)
            result.cpu = min(result.cpu, 1e3 * (time.process_time() - start))


def run_ours(name, frames, options, found, scratch):
    repeat = 1 if name in listed(options.slow) else options.repeat
    circles, times = os.path.join(scratch, "found.csv"), os.path.join(scratch, "times.csv")
    command = [
        options.program,
        "--detector",
        name,
        "--repeat",
        str(repeat),
        "--csv",
        circles,
        "--times",
        times,
        "--min-radius",
        str(options.min_radius),
        "--max-radius",
        str(options.max_radius),
        "--max-circles",
        "32",
    ]
    if not name.startswith("sht"):
        command += ["--seed", str(options.detector_seed)]
    subprocess.run(command + [frame.path for frame in frames], check=True)
    by_path = {frame.path: result for frame, result in zip(frames, found)}
    for result in found:
        result.circles = []
    with open(circles, newline="") as file:
        for row in csv.DictReader(file):
            circle = (float(row["cx"]), float(row["cy"]), float(row["r"]))
            by_path[row["file"]].circles.append((float(row["score"]), circle))
    with open(times, newline="") as file:
        for row in csv.DictReader(file):
            result = by_path[row["file"]]
            result.cpu = min(result.cpu, float(row["cpu_us"]) / 1e3)


# ---- measures ----


def overlap(a, b):
    """Intersection over union of two discs."""
    (ax, ay, p), (bx, by, q) = a, b
    apart = math.hypot(ax - bx, ay - by)
    if apart >= p + q:
        return 0.0
    if apart <= abs(p - q):
        return (min(p, q) / max(p, q)) ** 2
    # Two circular segments, cut off by the chord through the crossings.
    at_p = math.acos(np.clip((apart**2 + p**2 - q**2) / (2 * apart * p), -1, 1))
    at_q = math.acos(np.clip((apart**2 + q**2 - p**2) / (2 * apart * q), -1, 1))
    common = p**2 * (at_p - math.sin(2 * at_p) / 2) + q**2 * (at_q - math.sin(2 * at_q) / 2)
    return common / (math.pi * (p**2 + q**2) - common)


def pairs(circles, truth, worth):
    """Pairs (found, true) one to one, the best first; `worth` is None for no match."""
    options = [(worth(c, t), i, j) for i, c in enumerate(circles) for j, t in enumerate(truth)]
    taken_i, taken_j, matched = set(), set(), []
    for _, i, j in sorted((o for o in options if o[0] is not None), key=lambda o: -o[0]):
        if i not in taken_i and j not in taken_j:
            taken_i.add(i)
            taken_j.add(j)
            matched.append((i, j))
    return matched


def by_overlap(c, t):
    value = overlap(c, t)
    return value if value >= 0.8 else None


def by_pixels(c, t):
    centre, radius = math.hypot(c[0] - t[0], c[1] - t[1]), abs(c[2] - t[2])
    return -(centre + radius) if centre <= 2 and radius <= 2 else None


def average_precision(frames, found):
    """Ranks detections by score; one is true if it overlaps a circle that no better one claimed."""
    total = sum(len(frame.truth) for frame in frames)
    ranked = []
    for frame, result in zip(frames, found):
        free = list(frame.truth)
        for score, circle in sorted(result.circles, key=lambda c: -c[0]):
            hit = max(free, key=lambda t: overlap(circle, t), default=None)
            true = hit is not None and overlap(circle, hit) >= 0.8
            if true:
                free.remove(hit)
            ranked.append((score, true))
    if not total:
        return None
    if not ranked:
        return 0.0
    true = np.array([t for _, t in sorted(ranked, key=lambda r: (-r[0], r[1]))])
    precision = np.cumsum(true) / np.arange(1, len(true) + 1)
    # The best precision at this recall or a higher one.
    precision = np.maximum.accumulate(precision[::-1])[::-1]
    return float(precision[true].sum() / total)


def measure(frames, found):
    share = lambda part, whole: part / whole if whole else None
    spot = lambda values, percent: float(np.percentile(values, percent)) if values else None
    circles = [[circle for _, circle in result.circles] for result in found]
    true, reported = sum(len(f.truth) for f in frames), sum(map(len, circles))
    overlapping = sum(len(pairs(c, f.truth, by_overlap)) for f, c in zip(frames, circles))
    near = [
        (c[i], f.truth[j]) for f, c in zip(frames, circles) for i, j in pairs(c, f.truth, by_pixels)
    ]
    empty = [c for f, c in zip(frames, circles) if not f.truth]
    holding = [(f, r) for f, r in zip(frames, found) if f.truth]
    best = lambda r: max(r.circles, key=lambda c: c[0], default=None)
    first = sum(any(best(r) and overlap(best(r)[1], t) >= 0.8 for t in f.truth) for f, r in holding)
    centre = [math.hypot(c[0] - t[0], c[1] - t[1]) for c, t in near]
    radius = [abs(c[2] - t[2]) for c, t in near]
    times = [r.cpu for r in found]
    return {
        "frames": len(frames),
        "circles": true,
        "found": reported,
        "recall_iou": share(overlapping, true),
        "precision_iou": share(overlapping, reported) if true else None,
        "recall_2px": share(len(near), true),
        "precision_2px": share(len(near), reported) if true else None,
        "average_precision": average_precision(frames, found),
        "top1": share(first, len(holding)),
        "false_per_empty": share(sum(map(len, empty)), len(empty)),
        "centre_px_median": spot(centre, 50),
        "centre_px_p95": spot(centre, 95),
        "radius_px_median": spot(radius, 50),
        "radius_px_p95": spot(radius, 95),
        "cpu_ms_median": spot(times, 50),
        "cpu_ms_p95": spot(times, 95),
        "cpu_ms_max": max(times),
        "cpu_ms_per_mpx": max(1e6 * r.cpu / f.gray.size for f, r in zip(frames, found)),
    }


def mean(rows):
    """Averages each measure over the sets that have it; sums counts, keeps the worst time."""
    result = {}
    for key in rows[0]:
        values = [row[key] for row in rows if row[key] is not None]
        combine = (
            sum
            if key in ("frames", "circles", "found")
            else max if key in ("cpu_ms_max", "cpu_ms_per_mpx") else np.mean
        )
        result[key] = combine(values) if values else None
    return result


# ---- the run ----


def listed(text):
    return [word for word in text.split(",") if word]


def compare(sets, options, scratch, emit):
    """Measures every detector on every set of a folder."""
    rivals = {name: RIVALS[name]() for name in listed(options.rivals)}
    for name, frames in sets.items():

        def sample(detector):
            few = options.slow_frames if detector in listed(options.slow) else len(frames)
            return [
                frames[k]
                for k in sorted(
                    {int(k) for k in np.linspace(0, len(frames) - 1, min(few, len(frames)))}
                )
            ]

        found = {d: [Found() for _ in sample(d)] for d in listed(options.detectors) + list(rivals)}
        for turn in range(options.rounds):
            for detector in found:
                if turn and detector in listed(options.slow):
                    continue
                if detector in rivals:
                    run_rival(rivals[detector], sample(detector), options, found[detector])
                else:
                    run_ours(detector, sample(detector), options, found[detector], scratch)
        for detector in found:
            emit(name, detector, measure(sample(detector), found[detector]))


SHOWN = {
    "frames": "frames",
    "circles": "circles",
    "recall_iou": "recall",
    "precision_iou": "precision",
    "recall_2px": "recall 2 px",
    "precision_2px": "precision 2 px",
    "average_precision": "AP",
    "top1": "best is true",
    "false_per_empty": "false per empty frame",
    "cpu_ms_median": "CPU ms",
    "cpu_ms_p95": "95 %",
    "cpu_ms_max": "worst",
}


def shown(value):
    if value is None:
        return "–"
    return (
        str(value)
        if isinstance(value, int)
        else f"{value:.{2 if value < 10 else 1 if value < 100 else 0}f}"
    )


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="*", metavar="FOLDER")
    parser.add_argument(
        "--detectors",
        default="a-contrario,heuristic",
        help="ours, as detect_circles names them [%(default)s]",
    )
    parser.add_argument(
        "--rivals", default="hough,hough-alt,ed,ed-unblurred", help="OpenCV's [%(default)s]"
    )
    parser.add_argument("--min-radius", type=float, default=8, metavar="PX", help="[%(default)s]")
    parser.add_argument("--max-radius", type=float, default=280, metavar="PX", help="[%(default)s]")
    parser.add_argument(
        "--detector-seed",
        type=int,
        default=1,
        metavar="N",
        help="seed of our random searches [%(default)s]",
    )
    parser.add_argument(
        "--repeat", type=int, default=3, help="repetitions per frame and round [%(default)s]"
    )
    parser.add_argument(
        "--rounds", type=int, default=2, help="passes through all detectors [%(default)s]"
    )
    parser.add_argument(
        "--slow",
        default="sht,sht-gradient",
        help="detectors that see few frames, each once [%(default)s]",
    )
    parser.add_argument(
        "--slow-frames", type=int, default=5, help="that many, spread over the set [%(default)s]"
    )
    parser.add_argument(
        "--pad",
        type=int,
        default=0,
        metavar="PX",
        help="widen the frames of folders by repeating their border",
    )
    parser.add_argument(
        "--scenes",
        metavar="KIND,...",
        help="kinds of scenes to render; `benchmark` or `simple` for those made for this",
    )
    parser.add_argument(
        "--sizes",
        default="768x576",
        help="at these sizes; the radius range is scaled along [%(default)s]",
    )
    parser.add_argument(
        "--frames", type=int, default=20, help="so many frames of each [%(default)s]"
    )
    parser.add_argument("--seed", type=int, default=1, help="from this seed [%(default)s]")
    parser.add_argument(
        "--program", default="target/release/examples/detect_circles", help="[%(default)s]"
    )
    parser.add_argument(
        "--renderer", default="target/release/examples/render_dataset", help="[%(default)s]"
    )
    parser.add_argument(
        "--simple-renderer", default="target/release/examples/scenes", help="[%(default)s]"
    )
    parser.add_argument("--csv", metavar="FILE", help="where to write all measures")
    options = parser.parse_args()
    if not options.folders and not options.scenes:
        parser.error("a FOLDER or --scenes is needed")
    unknown = set(listed(options.rivals)) - RIVALS.keys()
    if unknown:
        parser.error(f"--rivals: {', '.join(sorted(unknown))} is none of {', '.join(RIVALS)}")

    cv2.setNumThreads(1)
    rows = []
    print(f"{datetime.date.today()}, OpenCV {cv2.__version__}, {processor()}\n")
    print("| set | detector | " + " | ".join(SHOWN.values()) + " |")
    print("|---|---|" + "---|" * len(SHOWN), flush=True)

    def emit(name, detector, row):
        rows.append((name, detector, row))
        print(
            f"| {name} | {detector} | " + " | ".join(shown(row[key]) for key in SHOWN) + " |",
            flush=True,
        )
        if options.csv:
            write(options.csv, rows)

    for folder in options.folders:
        with tempfile.TemporaryDirectory() as scratch:
            compare(read_sets(folder, scratch, options.pad), options, scratch, emit)
    for size in listed(options.sizes) if options.scenes else []:
        with tempfile.TemporaryDirectory() as rendered, tempfile.TemporaryDirectory() as scratch:
            render(options, size, rendered)
            sets = {
                f"{kind} {size}": frames for kind, frames in read_sets(rendered, scratch, 0).items()
            }
            scale = int(size.split("x")[0]) / 768
            scaled = argparse.Namespace(**vars(options))
            scaled.min_radius, scaled.max_radius = (
                max(4, options.min_radius * scale),
                options.max_radius * scale,
            )
            compare(sets, scaled, scratch, emit)
    if len({name for name, _, _ in rows}) > 1:
        for detector in dict.fromkeys(detector for _, detector, _ in rows):
            emit("mean of sets", detector, mean([row for _, d, row in rows if d == detector]))


def write(path, rows):
    """Writes the table as a whole or not at all."""
    with open(path + ".part", "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["set", "detector", *rows[0][2]])
        rounded = lambda value: f"{value:.4g}" if isinstance(value, float) else value
        table.writerows(
            [name, detector, *map(rounded, row.values())] for name, detector, row in rows
        )
    os.replace(path + ".part", path)


def processor():
    try:
        with open("/proc/cpuinfo") as file:
            return next(
                line.split(":")[1].strip() for line in file if line.startswith("model name")
            )
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
