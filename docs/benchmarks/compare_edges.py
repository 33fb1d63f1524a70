#!/usr/bin/env python3
"""Compares the crate's Canny with OpenCV's GaussianBlur and Canny on the same frames in one run.

    python3 -m venv venv && venv/bin/pip install numpy 'opencv-contrib-python-headless<5'
    cargo build --release -p circle-benches --features imageproc --example edges
    venv/bin/python docs/benchmarks/compare_edges.py FOLDER...

Prints CSV with a row for each folder of images: CPU time per frame (one thread, the least of the
repetitions, the median over frames) of the crate's Canny at its defaults, which raises the
thresholds with the noise it measures, of the same with fixed thresholds (noise factor 0), and of
OpenCV. All smooth with a Gaussian of 1.2 px cut off after 2 px, measure the Euclidean length of
Sobel's gradient, and start from the same two thresholds.

OpenCV runs twice: with these two, and with the raised ones of the frame, so that both sides look
for the same edges. A ratio compares runs with the same thresholds. Agreement is the share of each
side's edge pixels that have one of the other side within a pixel.
"""

import argparse, csv, os, subprocess, tempfile, time

import cv2
import numpy as np

parser = argparse.ArgumentParser(
    description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
)
parser.add_argument("folders", nargs="+")
parser.add_argument("--program", default="target/release/examples/edges")
parser.add_argument("--low", type=float, default=30)
parser.add_argument("--high", type=float, default=70)
parser.add_argument("--reps", type=int, default=15)
options = parser.parse_args()

cv2.setNumThreads(1)
NEAR = np.ones((3, 3), np.uint8)


def ours(folder, out, noise_factor):
    """The crate's edges, written to `out`: for each frame its CPU time and thresholds."""
    os.mkdir(out)
    settings = [] if noise_factor is None else ["--noise-factor", str(noise_factor)]
    subprocess.run(
        [
            options.program,
            folder,
            "--edges",
            out,
            "--times",
            f"{out}/times.csv",
            "--low",
            str(options.low),
            "--high",
            str(options.high),
            "--reps",
            str(options.reps),
            *settings,
        ],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    with open(f"{out}/times.csv", newline="") as file:
        return {row["file"]: row for row in csv.DictReader(file)}


def theirs(gray, low, high):
    """OpenCV's edges, and the CPU time in microseconds."""
    best = float("inf")
    for _ in range(options.reps):
        start = time.process_time()
        edges = cv2.Canny(cv2.GaussianBlur(gray, (5, 5), 1.2), low, high, L2gradient=True)
        best = min(best, time.process_time() - start)
    return edges > 0, best * 1e6


def near(edges, others):
    """Returns the share of the edge pixels with one of the others within a pixel, NaN for none."""
    return (
        (edges & (cv2.dilate(others.astype(np.uint8), NEAR) > 0)).sum() / edges.sum()
        if edges.any()
        else np.nan
    )


print(
    "folder,frames,ours_us,opencv_us,ratio,ours_near_opencv,opencv_near_ours,"
    "fixed_ours_us,fixed_opencv_us,fixed_ratio,fixed_ours_near_opencv,fixed_opencv_near_ours"
)
for folder in options.folders:
    columns, frames = [], 0
    with tempfile.TemporaryDirectory() as out:
        for place, noise_factor in (("default", None), ("fixed", 0)):
            rows = ours(folder, f"{out}/{place}", noise_factor)
            opencv, agreement = [], []
            for name, row in rows.items():
                gray = cv2.imread(f"{folder}/{name}", cv2.IMREAD_GRAYSCALE)
                edges, micros = theirs(gray, float(row["low"]), float(row["high"]))
                own = (
                    cv2.imread(
                        f"{out}/{place}/{os.path.splitext(name)[0]}.png", cv2.IMREAD_GRAYSCALE
                    )
                    > 0
                )
                opencv.append(micros)
                agreement.append((near(own, edges), near(edges, own)))
            a, b = np.median([float(row["cpu_us"]) for row in rows.values()]), np.median(opencv)
            shares = np.nanmean(agreement, axis=0)
            columns += [
                f"{a:.0f}",
                f"{b:.0f}",
                f"{a / b:.2f}",
                f"{shares[0]:.4f}",
                f"{shares[1]:.4f}",
            ]
            frames = len(rows)
    print(f"{os.path.basename(os.path.normpath(folder))},{frames},{','.join(columns)}", flush=True)
