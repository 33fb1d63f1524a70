#!/usr/bin/env python3
"""Compares hand-eye calibration by a ball with OpenCV's by a board, on the same simulated arms.

    cargo run --release --example hand_eye_coverage -- --cells 100 --noise 0.05 \
        --cells-file cells.jsonl
    python3 docs/benchmarks/compare_hand_eye.py cells.jsonl

Each line of the file is a cell: the true camera, the error of the calibration by the ball, and 30
poses before a board (8 x 6 corners, 15 mm): the hand by the joints that the arm reports, with the
cell's joint zeros in it, and the camera in truth. Here the corners are projected with the cell's
lens and pixel noise, `cv2.calibrateCamera` finds the lens and the board in each view, and
`cv2.calibrateHandEye` the camera in the hand. OpenCV gets the perfect corners of a perfect board;
the ball's calibration the noise of the program above, which is 4 pixels a unit. Needs numpy and
opencv-python.
"""

import argparse
import json

import cv2
import numpy as np

METHODS = {
    "Tsai": cv2.CALIB_HAND_EYE_TSAI,
    "Park": cv2.CALIB_HAND_EYE_PARK,
    "Horaud": cv2.CALIB_HAND_EYE_HORAUD,
    "Andreff": cv2.CALIB_HAND_EYE_ANDREFF,
    "Daniilidis": cv2.CALIB_HAND_EYE_DANIILIDIS,
}
SIZE = (768, 576)


def matrix(rows):
    """A 4x4 matrix; it is written row by row."""
    return np.array(rows).reshape(4, 4)


def apart(truth, found):
    """Angle in degrees and distance in millimetres between two poses."""
    off = np.linalg.inv(found) @ truth
    turn = np.degrees(np.linalg.norm(cv2.Rodrigues(off[:3, :3])[0]))
    return turn, 1000 * np.linalg.norm(off[:3, 3])


def calibrate(cell, views, noise, rng):
    """Errors of each method in a cell: degrees, millimetres, focal length in per cent, k1."""
    board = matrix(cell["board"]["board"])
    corners = np.array([[0.015 * (i % 8), 0.015 * (i // 8), 0] for i in range(48)], np.float32)
    lens = np.array([[cell["focal"], 0, cell["principal"][0]],
                     [0, cell["focal"], cell["principal"][1]], [0, 0, 1]])
    hands, pictures = [], []
    for hand, camera in cell["board"]["poses"][:views]:
        in_camera = np.linalg.inv(matrix(camera)) @ board
        turn = cv2.Rodrigues(in_camera[:3, :3])[0]
        pixels, _ = cv2.projectPoints(
            corners.astype(np.float64), turn, in_camera[:3, 3], lens,
            np.array([cell["k1"], 0, 0, 0, 0]))
        pixels = pixels.reshape(-1, 2) + rng.normal(0, noise, (48, 2))
        hands.append(matrix(hand))
        pictures.append(pixels.astype(np.float32))
    flags = (cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
             | cv2.CALIB_FIX_ASPECT_RATIO)
    _, found, distortion, turns, places = cv2.calibrateCamera(
        [corners] * len(pictures), pictures, SIZE,
        np.array([[1000.0, 0, 384], [0, 1000.0, 288], [0, 0, 1]]), np.zeros(5),
        flags=flags | cv2.CALIB_USE_INTRINSIC_GUESS)
    focal = 100 * abs(found[0, 0] / cell["focal"] - 1)
    k1 = abs(distortion.ravel()[0] - cell["k1"])
    truth = matrix(cell["mount"])
    results = {}
    for name, method in METHODS.items():
        turn, place = cv2.calibrateHandEye(
            [h[:3, :3] for h in hands], [h[:3, 3] for h in hands],
            [cv2.Rodrigues(t)[0] for t in turns], places, method=method)
        mount = np.eye(4)
        mount[:3, :3], mount[:3, 3] = turn, place.ravel()
        if np.isfinite(mount).all():
            results[name] = (*apart(truth, mount), focal, k1)
    return results


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cells", help="file written by hand_eye_coverage --cells-file")
    parser.add_argument("--noise", type=float, default=0.2, help="pixel noise of corners [0.2]")
    options = parser.parse_args()
    rng = np.random.default_rng(1)
    with open(options.cells, encoding="utf-8") as file:
        cells = [json.loads(line) for line in file]
    rows = {"ball, 15 looks": []}
    for cell in cells:
        ours = cell["ours"]
        rows["ball, 15 looks"].append(
            (ours["turn"], ours["place"], ours["focal"], ours["k1"]))
        for views in (15, 30):
            if len(cell["board"]["poses"]) < views:
                continue
            for name, errors in calibrate(cell, views, options.noise, rng).items():
                rows.setdefault(f"board, {views} views, {name}", []).append(errors)
    print("| calibration | cells | place, mm | 95 % below | axes, deg | 95 % below |"
          " focal length, % | k1 |")
    print("|---|---|---|---|---|---|---|---|")
    for name, errors in rows.items():
        turn, place, focal, k1 = np.array(errors).T
        high = [np.quantile(v, 0.95) for v in (place, turn)]
        middle = [np.median(v) for v in (place, turn, focal, k1)]
        print(f"| {name} | {len(errors)} | {middle[0]:.2f} | {high[0]:.2f} | {middle[1]:.3f} |"
              f" {high[1]:.3f} | {middle[2]:.2f} | {middle[3]:.4f} |")


if __name__ == "__main__":
    main()
