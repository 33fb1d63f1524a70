#!/usr/bin/env python3
"""Compares the ellipses of detect_circles with those of OpenCV's EdgeDrawing: same frames, one run.

    python3 -m venv venv && venv/bin/pip install numpy 'opencv-contrib-python-headless<5'
    cargo build --release -p hough-heuristic --features cli --bin detect_circles
    venv/bin/python docs/benchmarks/compare_ellipses.py --frames 60 --seed 7

Draws frames of 640x480 with 4 to 6 discs in perspective, each on a plane tilted so that its outline
is an ellipse of axis ratio 0.5 to 1 and a longer half-axis of 14 to 70 px: contrasts of 40 to 120
gray levels of either sign, a blur of 0.8 px and noise of --noise levels. Then draws as many frames
without any ellipse: blobs, boxes, polygons, bars and wavy bands.

Prints a Markdown table. An ellipse is found if its centre lies within 2 px and both half-axes are
within 10 %. Columns:

    recall              share of the ellipses that were found, and of those of each range of ratios
    precision           share of the ellipses found in these frames that are true
    centre, axes        errors of those found: median and 95th percentile, px and percent
    exact               share of those found with the centre within 0.2 px and both axes within 1 %
    false               false ellipses per 100 frames that hold none (ours: at a score of 0.8, too)
    ms                  CPU time per frame, of one thread
    z                   root mean square of error by standard error: centre, half-axes, angle (ours)

EdgeDrawing runs after a Gaussian blur of 2 px (`ed`) and without (`ed-unblurred`).
"""

import argparse
import csv
import io
import math
import os
import subprocess
import tempfile
import time

import cv2
import numpy as np

WIDTH, HEIGHT, FOCUS = 640, 480, 700.0
RATIOS = [(0.5, 0.65), (0.65, 0.8), (0.8, 1.0)]


def ellipse_of(conic):
    """Centre, half-axes and angle of the ellipse x' C x = 0."""
    a, b, c = conic[0, 0], conic[0, 1], conic[1, 1]
    centre = np.linalg.solve([[a, b], [b, c]], [-conic[0, 2], -conic[1, 2]])
    level = -(np.append(centre, 1) @ conic @ np.append(centre, 1))
    values, vectors = np.linalg.eigh(np.array([[a, b], [b, c]]) / level)
    axes = 1 / np.sqrt(values)
    return (*centre, axes[0], axes[1], math.atan2(vectors[1, 0], vectors[0, 0]))


def disc(rng):
    """A homography from a tilted plane to the picture, and the outline of the unit disc there."""
    while True:
        ratio, major = rng.uniform(0.5, 1), rng.uniform(14, 70)
        tilt, axis = math.acos(ratio), rng.uniform(0, math.tau)
        turn = cv2.Rodrigues(np.array([math.cos(axis), math.sin(axis), 0]) * tilt)[0]
        place = np.array([rng.uniform(-0.4, 0.4), rng.uniform(-0.3, 0.3), 1.0])
        pose = np.column_stack([turn[:, 0] * major / FOCUS, turn[:, 1] * major / FOCUS, place])
        camera = np.array([[FOCUS, 0, WIDTH / 2], [0, FOCUS, HEIGHT / 2], [0, 0, 1]])
        homography = camera @ pose
        back = np.linalg.inv(homography)
        x, y, a, b, angle = ellipse_of(back.T @ np.diag([1.0, 1.0, -1.0]) @ back)
        inside = a + 4 < x < WIDTH - a - 4 and a + 4 < y < HEIGHT - a - 4
        if inside and 0.5 <= b / a and 12 <= a <= 72:
            return back, (x, y, a, b, angle)


def cover_of(inside, x0, y0, x1, y1, parts=6):
    """Share of each pixel's area that is inside, from parts x parts places."""
    steps = (np.arange(parts) + 0.5) / parts - 0.5
    xs = (np.arange(x0, x1)[:, None] + steps).ravel()
    ys = (np.arange(y0, y1)[:, None] + steps).ravel()
    hit = inside(*np.meshgrid(xs, ys)).astype(float)
    return hit.reshape(y1 - y0, parts, x1 - x0, parts).mean((1, 3))


def finish(rng, frame, noise):
    frame = cv2.GaussianBlur(frame, (0, 0), 0.8)
    return np.clip(frame + rng.normal(0, noise, frame.shape) + 0.5, 0, 255).astype(np.uint8)


def level_beside(rng, ground):
    return float(np.clip(ground + rng.choice([-1, 1]) * rng.uniform(40, 120), 5, 250))


def draw_discs(rng, noise):
    ground = rng.uniform(70, 170)
    frame, truth = np.full((HEIGHT, WIDTH), ground), []
    for _ in range(200):
        back, (x, y, a, b, angle) = disc(rng)
        if len(truth) == 6 or any(math.hypot(x - t[0], y - t[1]) < a + t[2] + 8 for t in truth):
            continue

        def inside(u, v):
            u, v, w = (back[k, 0] * u + back[k, 1] * v + back[k, 2] for k in range(3))
            return u * u + v * v <= w * w

        box = int(x - a - 2), int(y - a - 2), int(x + a + 3), int(y + a + 3)
        cover = cover_of(inside, *box)
        part = frame[box[1]:box[3], box[0]:box[2]]
        level = level_beside(rng, ground)
        while abs(level - ground) < 40:
            level = level_beside(rng, ground)
        part += (level - part) * cover
        truth.append((x, y, a, b, angle))
    return finish(rng, frame, noise), truth


def draw_shapes(rng, noise):
    ground = rng.uniform(70, 170)
    frame = np.full((HEIGHT, WIDTH), ground)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    for _ in range(rng.integers(5, 10)):
        kind = rng.choice(["blob", "blob", "box", "polygon", "bar", "wave"])
        size, turn = rng.uniform(15, 75), rng.uniform(0, math.tau)
        dx, dy = x - rng.uniform(0, WIDTH), y - rng.uniform(0, HEIGHT)
        u, v = dx * math.cos(turn) + dy * math.sin(turn), dy * math.cos(turn) - dx * math.sin(turn)
        if kind == "blob":
            t, r = np.arctan2(v, u), 1.0
            for k in (2, 3, 4, 5):
                least = 0.15 if k == 3 else 0.05
                lobe = rng.uniform(least, 0.34) / (k - 1) ** 0.5
                r = r + lobe * np.cos(k * t + rng.uniform(0, 7))
            off = np.hypot(u, v) - size * r
        elif kind == "box":
            ratio = rng.uniform(0.35, 1)
            off = np.maximum(np.abs(u) - 0.9 * size, np.abs(v) - 0.9 * size * ratio)
        elif kind == "polygon":
            n = rng.integers(3, 6)
            sides = (math.tau * k / n for k in range(n))
            off = np.max([u * math.cos(s) + v * math.sin(s) for s in sides], axis=0) - 0.7 * size
        elif kind == "bar":
            off = np.maximum(np.abs(u) - 2.2 * size, np.abs(v) - rng.uniform(2, 6))
        else:
            middle = 0.35 * size * np.sin(3 * u / size)
            off = np.maximum(np.abs(u) - 2 * size, np.abs(v - middle) - rng.uniform(2, 9))
        cover = np.clip(0.5 - off, 0, 1)
        frame += (level_beside(rng, ground) - frame) * cover
    return finish(rng, frame, noise)


def ours(program, folder, extra):
    """(file, x, y, a, b, angle, score, errors) of every ellipse, and CPU ms per file."""
    times = os.path.join(folder, "times.csv")
    command = [program, "--min-axis-ratio", "0.5", "--csv", "-", "--times", times, *extra, folder]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    found = {}
    for row in csv.DictReader(io.StringIO(text)):
        numbers = {key: float(value) for key, value in row.items() if key != "file"}
        numbers["angle"] = math.radians(numbers["angle"])
        numbers["angle_error"] = math.radians(numbers["angle_error"])
        found.setdefault(os.path.basename(row["file"]), []).append(numbers)
    with open(times) as file:
        spent = [float(row["cpu_us"]) / 1e3 for row in csv.DictReader(file)]
    return found, float(np.mean(spent))


def edge_drawing(folder, blur):
    settings = cv2.ximgproc.EdgeDrawing.Params()
    settings.EdgeDetectionOperator = cv2.ximgproc.EdgeDrawing_SOBEL
    settings.GradientThresholdValue = 60
    settings.Sigma = 1.0
    settings.NFAValidation = True
    settings.PFmode = False
    drawing = cv2.ximgproc.createEdgeDrawing()
    drawing.setParams(settings)
    found, spent = {}, []
    for name in sorted(name for name in os.listdir(folder) if name.endswith(".png")):
        gray = cv2.imread(os.path.join(folder, name), cv2.IMREAD_GRAYSCALE)
        start = time.thread_time()
        drawing.detectEdges(cv2.GaussianBlur(gray, (9, 9), 2.0) if blur else gray)
        rows = drawing.detectEllipses()
        spent.append(1e3 * (time.thread_time() - start))
        for x, y, r, a, b, angle in ([] if rows is None else rows.reshape(-1, 6)):
            one, two, turn = r + a, r + b, math.radians(angle)
            if two > one:
                one, two, turn = two, one, turn + math.pi / 2
            if two >= 0.5 * one:
                found.setdefault(name, []).append(
                    {"cx": x, "cy": y, "major": one, "minor": two, "angle": turn, "score": 1.0})
    return found, float(np.mean(spent))


def matches(found, truth):
    """Pairs of an ellipse found and a true one, and the number of those found."""
    pairs, count = [], 0
    for name, true in truth.items():
        left = list(found.get(name, []))
        count += len(left)
        for x, y, a, b, angle in true:
            def off(e):
                return math.hypot(e["cx"] - x, e["cy"] - y)
            near = [e for e in left if off(e) <= 2 and abs(e["major"] / a - 1) <= 0.1
                    and abs(e["minor"] / b - 1) <= 0.1]
            if near:
                best = min(near, key=off)
                left.remove(best)
                pairs.append((best, (x, y, a, b, angle)))
    return pairs, count


def row(name, found, spent, truth, empty):
    pairs, count = matches(found, truth)
    total = [true for all_true in truth.values() for true in all_true]
    parts = []
    for low, high in RATIOS:
        inside = lambda true: low <= true[3] / true[2] < high
        hit = sum(inside(true) for _, true in pairs)
        parts.append(f"{hit / max(1, sum(map(inside, total))):.3f}")
    centre = [math.hypot(e["cx"] - t[0], e["cy"] - t[1]) for e, t in pairs]
    axes = [100 * max(abs(e["major"] / t[2] - 1), abs(e["minor"] / t[3] - 1)) for e, t in pairs]
    exact = np.mean([c <= 0.2 and a <= 1 for c, a in zip(centre, axes)]) if pairs else 0
    both = lambda values: " ".join(f"{np.percentile(values, p):.2f}" for p in (50, 95) if values)
    false = 100 * sum(map(len, empty.values())) / len(truth)
    sure = 100 * sum(e["score"] >= 0.8 for all_found in empty.values() for e in all_found)
    cells = [name, f"{len(pairs) / len(total):.3f}", " ".join(parts),
             f"{len(pairs) / max(1, count):.3f}", both(centre), both(axes), f"{exact:.3f}"]
    z = ""
    if pairs and "major_error" in pairs[0][0]:
        rms = lambda values: f"{math.sqrt(np.mean(np.square(values))):.2f}"
        off = [d / e["centre_error"] for e, t in pairs for d in (e["cx"] - t[0], e["cy"] - t[1])]
        major = [(e["major"] - t[2]) / e["major_error"] for e, t in pairs]
        minor = [(e["minor"] - t[3]) / e["minor_error"] for e, t in pairs]
        turn = [math.remainder(e["angle"] - t[4], math.pi) / e["angle_error"] for e, t in pairs]
        z = " ".join(map(rms, (off, major, minor, turn)))
        cells.append(f"{false:.1f} ({sure / len(truth):.1f})")
    else:
        cells.append(f"{false:.1f}")
    print("| " + " | ".join([*cells, f"{spent:.1f}", z]) + " |")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--noise", type=float, default=10.0)
    parser.add_argument("--program", default="target/release/detect_circles")
    parser.add_argument("--keep", metavar="DIR", help="folder for the frames, which are kept there")
    parser.add_argument("extra", nargs="*", help="options of detect_circles, after --")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        base = options.keep or temporary
        folders = [os.path.join(base, kind) for kind in ("discs", "shapes")]
        for folder in folders:
            os.makedirs(folder, exist_ok=True)
        truth = {}
        for index in range(options.frames):
            rng = np.random.default_rng((options.seed, index))
            name = f"{index:03}.png"
            frame, truth[name] = draw_discs(rng, options.noise)
            cv2.imwrite(os.path.join(folders[0], name), frame)
            cv2.imwrite(os.path.join(folders[1], name), draw_shapes(rng, options.noise))
        ranges = ", ".join(f"{low} to {high}" for low, high in RATIOS)
        print(f"| detector | recall | {ranges} | precision | centre px | axes % | exact | false "
              "| ms | z |")
        print("|---|---|---|---|---|---|---|---|---|---|")
        results = [ours(options.program, folder, options.extra) for folder in folders]
        row("a-contrario", *results[0], truth, results[1][0])
        for name, blur in (("ed", True), ("ed-unblurred", False)):
            results = [edge_drawing(folder, blur) for folder in folders]
            row(name, *results[0], truth, results[1][0])


if __name__ == "__main__":
    main()
