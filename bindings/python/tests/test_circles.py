"""The detector on numpy arrays."""

import csv
import io
import itertools
import os
import subprocess
import sys
import threading
import warnings

import numpy as np
import pytest

import puma_grasp
from puma_grasp import CIRCLE, ELLIPSE, Detector, find_circles


def disc(width=200, height=150, x=100.3, y=70.6, radius=28.4, inside=40, outside=200):
    """A gray picture of a disc, with soft borders of a pixel."""
    rows, columns = np.mgrid[:height, :width]
    share = np.clip(np.hypot(columns - x, rows - y) - radius + 0.5, 0, 1)
    return np.round(inside + (outside - inside) * share).astype(np.uint8)


def test_a_disc_is_found_with_its_errors():
    found = find_circles(disc())
    assert found.dtype == CIRCLE and found.shape == (1,)
    ball = found[0]
    assert abs(ball["x"] - 100.3) < 0.1 and abs(ball["y"] - 70.6) < 0.1
    assert abs(ball["radius"] - 28.4) < 0.15
    assert ball["score"] > 0.9 and 0 < ball["centre_error"] < 0.1 and ball["visible"] == 1


def test_an_empty_picture_has_no_circles():
    for shape in [(0, 0), (0, 7), (1, 1), (100, 100)]:
        assert len(find_circles(np.zeros(shape, np.uint8))) == 0


@pytest.mark.parametrize("depth", [8, 10, 12, 16])
def test_every_dtype_gives_the_same_circles(depth):
    gray = disc(inside=0, outside=255)
    expected = find_circles(gray)
    white = 2**depth - 1
    sixteen = np.round(gray / 255.0 * white).astype(np.uint16)
    for other in [gray / 255.0, (gray / 255.0).astype(np.float32), sixteen, gray[..., None]]:
        np.testing.assert_array_equal(find_circles(other), expected)
    detector = Detector()
    detector.detect(sixteen)
    assert detector.effort["bits_used"] == (depth if depth < 16 else None)
    assert abs(find_circles(gray < 128)[0]["radius"] - 28.4) < 0.5


def test_strides_do_not_matter():
    gray = disc()
    expected = find_circles(gray)
    wide = np.zeros((150, 500), np.uint8)
    wide[:, 100:500:2] = gray
    flipped = np.ascontiguousarray(gray[::-1, ::-1])
    for view in [np.asfortranarray(gray), wide[:, 100:500:2], flipped[::-1, ::-1]]:
        assert not view.flags.c_contiguous
        np.testing.assert_array_equal(find_circles(view), expected)
    frozen = gray.copy()
    frozen.flags.writeable = False
    np.testing.assert_array_equal(find_circles(frozen), expected)


def test_channels_of_colours():
    gray = disc()
    flat = np.full_like(gray, 99)
    rgb = np.stack([flat, flat, gray], axis=2)
    expected = find_circles(gray)
    np.testing.assert_array_equal(find_circles(rgb, channel="blue"), expected)
    np.testing.assert_array_equal(find_circles(rgb, channel="strongest"), expected)
    assert len(find_circles(rgb, channel="red")) == 0
    np.testing.assert_array_equal(find_circles(rgb[..., ::-1], channel="red"), expected)
    rgba = np.concatenate([rgb, flat[..., None]], axis=2)
    np.testing.assert_array_equal(find_circles(rgba, channel="blue"), expected)
    np.testing.assert_array_equal(find_circles(rgba), find_circles(rgb))
    deep = np.concatenate([rgb, np.full_like(gray, 255)[..., None]], axis=2).astype(np.uint16) * 257
    deep[0, 0, :3] = 65535
    bright = find_circles(deep, channel="blue")
    assert len(bright) == 1 and abs(bright[0]["radius"] - 28.4) < 0.15


@pytest.mark.parametrize(
    ("image", "error", "words"),
    [
        ([[1, 2], [3, 4]], TypeError, "list"),
        (None, TypeError, "NoneType"),
        (np.zeros((4, 4), np.int64), TypeError, "int64"),
        (np.zeros((4, 4), np.complex128), TypeError, "complex128"),
        (np.zeros(4, np.uint8), ValueError, r"\[4\]"),
        (np.zeros((4, 4, 2), np.uint8), ValueError, r"\[4, 4, 2\]"),
        (np.zeros((1, 4, 4, 3), np.uint8), ValueError, "height, width"),
        (np.full((4, 4), np.nan), ValueError, "NaN"),
        (np.full((4, 4), 255.0), ValueError, "255"),
        (np.full((4, 4), -0.1, np.float32), ValueError, "-0.1"),
    ],
)
def test_a_wrong_picture_is_named(image, error, words):
    with pytest.raises(error, match=words):
        find_circles(image)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (dict(min_radius=2.0), "min_radius"),
        (dict(max_radius=float("nan")), "radius range"),
        (dict(time_limit=0.0), "milliseconds_per_megapixel"),
        (dict(rings="some"), "rings"),
        (dict(channel="purple"), "channel"),
        (dict(min_score=1.5), "min_score"),
        (dict(min_axis_ratio=0.2), "min_axis_ratio"),
        (dict(min_axis_ratio=float("nan")), "min_axis_ratio"),
        (dict(max_circles=0), "max_circles"),
        (dict(region=(150, 0, 100, 100)), "sticks out"),
    ],
)
def test_a_wrong_setting_is_named(settings, words):
    with pytest.raises(ValueError, match=words):
        find_circles(disc(), **settings)
    with pytest.raises(TypeError):
        find_circles(disc(), radius=3)


def oval(width=200, height=150, x=100.3, y=70.6, major=40.0, minor=24.0, angle=25.0):
    """A gray picture of an ellipse, with soft borders of about a pixel."""
    rows, columns = np.mgrid[:height, :width]
    turn = np.exp(-1j * np.radians(angle)) * ((columns - x) + 1j * (rows - y))
    share = np.clip((np.hypot(turn.real / major, turn.imag / minor) - 1) * minor + 0.5, 0, 1)
    return np.round(40 + 160 * share).astype(np.uint8)


def test_an_ellipse_is_found_with_its_errors():
    assert len(find_circles(oval())) == 0
    found = find_circles(oval(), min_axis_ratio=0.5)
    assert found.dtype == ELLIPSE and len(found) == 1
    ellipse = found[0]
    for field, value in dict(x=100.3, y=70.6, major=40.0, minor=24.0).items():
        assert abs(ellipse[field] - value) < 0.3, field
    assert abs(ellipse["angle"] - 25.0) < 1.0 and abs(ellipse["radius"] - 30.98) < 0.3
    for field in ("major_error", "minor_error", "angle_error"):
        assert 0 < ellipse[field] < 1, field
    assert find_circles(np.zeros((50, 50), np.uint8), min_axis_ratio=0.5).dtype == ELLIPSE


def test_a_search_that_the_budget_ends_warns():
    picture = np.random.default_rng(1).integers(0, 256, (400, 400)).astype(np.uint8)
    with pytest.warns(RuntimeWarning, match="draws"):
        find_circles(picture, draws=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        find_circles(disc())


def test_a_ball_is_followed():
    detector = Detector()
    last = detector.detect(disc())[0]
    for step in range(1, 6):
        found, followed = detector.track(disc(x=100.3 + 6 * step), last)
        assert followed and abs(found[0]["x"] - (100.3 + 6 * step)) < 0.1
        last = found[0]
    found, followed = detector.track(disc(x=40.0), (160.0, 70.0, 28.0), reach=5)
    assert not followed and abs(found[0]["x"] - 40.0) < 0.1


def test_threads_share_a_detector():
    pictures = [disc(x=40 + 20 * i, radius=12 + i) for i in range(6)]
    expected = [find_circles(picture) for picture in pictures]
    detector = Detector()
    wrong = []

    def work(index):
        for _ in range(50):
            if not np.array_equal(detector.detect(pictures[index]), expected[index]):
                wrong.append(index)

    threads = [threading.Thread(target=work, args=(index,)) for index in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_other_threads_run_during_a_search():
    noise = np.random.default_rng(1).integers(0, 256, (1000, 1000)).astype(np.uint8)
    begun = threading.Event()
    counted = []

    def count():
        begun.wait()
        counted.extend(range(1000))

    thread = threading.Thread(target=count)
    thread.start()
    interval = sys.getswitchinterval()
    # Nobody is made to give the interpreter away, so the other thread counts only if the search
    # gives it away itself.
    sys.setswitchinterval(1000)
    try:
        begun.set()
        # On a busy machine the other thread may need several searches to get its turn.
        for _ in range(100):
            Detector(draws=50_000).detect(noise)
            if counted:
                break
        during = len(counted)
    finally:
        sys.setswitchinterval(interval)
    thread.join()
    assert during == 1000


def test_the_program_finds_the_same(tmp_path):
    program = os.environ.get("DETECT_CIRCLES")
    if not program:
        pytest.skip("DETECT_CIRCLES does not name the program detect_circles")
    pictures = {
        "noisy": disc() + np.random.default_rng(2).integers(0, 9, (150, 200)).astype(np.uint8),
        "two": np.hstack([disc(), disc(radius=13.2, inside=90)]),
        "oval": np.hstack([disc(), oval()]),
    }
    fields = {"cx": "x", "cy": "y", "r": "radius"}
    for ratio, (name, picture) in itertools.product([1.0, 0.5], pictures.items()):
        path = tmp_path / f"{name}.pgm"
        height, width = picture.shape
        path.write_bytes(b"P5 %d %d 255\n" % (width, height) + picture.tobytes())
        arguments = [] if ratio == 1.0 else ["--min-axis-ratio", str(ratio)]
        out = subprocess.run(
            [program, *arguments, "--csv", "-", path], check=True, capture_output=True
        )
        rows = list(csv.DictReader(io.StringIO(out.stdout.decode())))
        found = find_circles(picture, min_axis_ratio=ratio)
        assert len(rows) == len(found) > 0
        for row, circle in zip(rows, found):
            printed = {key: text for key, text in row.items() if key != "file"}
            assert len(printed) == (9 if ratio == 1.0 else 15)
            for key, text in printed.items():
                digits = len(text.split(".")[1])
                assert text == f"{circle[fields.get(key, key)]:.{digits}f}", (name, key)


def test_the_version_is_there():
    assert puma_grasp.__version__
