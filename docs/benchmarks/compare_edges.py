#!/usr/bin/env python3
"""The crate's Canny beside OpenCV's GaussianBlur + Canny, on the same frames in one run.

    python3 -m venv venv && venv/bin/pip install numpy 'opencv-contrib-python-headless<5'
    cargo build --release -p hough-heuristic --example edges
    venv/bin/python docs/benchmarks/compare_edges.py FOLDER...

For each folder of images: CPU time per frame of both (one thread, the least of the repetitions, the median over frames), and
the share of each side's edge pixels that have one of the other side within a pixel. Both smooth with a Gaussian of 1.2 px cut off
after 2 px, measure the gradient's Euclidean length by Sobel's kernels, and have the same two thresholds.
"""
import argparse, csv, os, subprocess, tempfile, time

import cv2
import numpy as np

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("folders", nargs="+")
parser.add_argument("--program", default="target/release/examples/edges")
parser.add_argument("--low", type=float, default=30)
parser.add_argument("--high", type=float, default=70)
parser.add_argument("--reps", type=int, default=15)
options = parser.parse_args()

cv2.setNumThreads(1)
near = np.ones((3, 3), np.uint8)
print("folder,frames,ours_us,opencv_us,ratio,ours_near_opencv,opencv_near_ours")
for folder in options.folders:
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([options.program, folder, "--edges", out, "--times", f"{out}/times.csv", "--noise-factor", "0",
                        "--low", str(options.low), "--high", str(options.high), "--reps", str(options.reps)],
                       check=True, stdout=subprocess.DEVNULL)
        ours = {row["file"]: float(row["cpu_us"]) for row in csv.DictReader(open(f"{out}/times.csv"))}
        theirs, precision, recall = [], [], []
        for name in ours:
            grey = cv2.imread(f"{folder}/{name}", cv2.IMREAD_GRAYSCALE)
            best = float("inf")
            for _ in range(options.reps):
                start = time.process_time()
                edges = cv2.Canny(cv2.GaussianBlur(grey, (5, 5), 1.2), options.low, options.high, L2gradient=True)
                best = min(best, time.process_time() - start)
            theirs.append(best * 1e6)
            own = cv2.imread(f"{out}/{os.path.splitext(name)[0]}.png", cv2.IMREAD_GRAYSCALE) > 0
            other = edges > 0
            precision.append((own & (cv2.dilate(edges, near) > 0)).sum() / max(1, own.sum()))
            recall.append((other & (cv2.dilate(own.astype(np.uint8), near) > 0)).sum() / max(1, other.sum()))
        a, b = np.median(list(ours.values())), np.median(theirs)
        name = os.path.basename(os.path.normpath(folder))
        print(f"{name},{len(ours)},{a:.0f},{b:.0f},{a / b:.2f},{np.mean(precision):.4f},{np.mean(recall):.4f}", flush=True)
