"""The program compare_controllers as a function."""

import os
import signal
import subprocess
import sys
import time

import pytest

from puma_grasp import compare_controllers

SWEEP = ["--draws", "3", "--starts", "2", "--levels", "moderate,heavy", "--only", "fuzzy"]
TABLES = ["runs.csv", "comparison.csv", "comparison.svg", "settings.json"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    out = tmp_path_factory.mktemp("whole")
    compare_controllers([*SWEEP, "--out", str(out)])
    return out


@pytest.fixture
def shards(tmp_path):
    """The folders of a sweep's two shards."""
    parts = [tmp_path / "1", tmp_path / "2"]
    for number, part in enumerate(parts, 1):
        compare_controllers([*SWEEP, "--shard", f"{number}/2", "--out", str(part)])
    return parts


def merge(out, parts):
    compare_controllers(["--out", str(out), "--merge", *map(str, parts)])


def test_shards_merge_to_the_bytes_of_one(whole, shards, tmp_path):
    # Only the finished cells are merged: a table that was damaged does no harm.
    (shards[1] / "runs.csv").write_text("level,ce")
    merge(tmp_path / "merged", shards)
    for name in TABLES:
        assert (tmp_path / "merged" / name).read_bytes() == (whole / name).read_bytes(), name


def test_a_shard_that_is_missing_damaged_or_foreign_is_named(shards, tmp_path):
    out = tmp_path / "out"
    with pytest.raises(RuntimeError, match="never.*no results of a sweep"):
        merge(out, [shards[0], tmp_path / "never"])
    with pytest.raises(RuntimeError, match="3 of 6 cells are missing, the first is"):
        merge(out, shards[:1])

    cell = min((shards[1] / "cells").iterdir())
    settings = shards[1] / "settings.json"
    for file, old, new, words in [
        (cell, '"moves":', '"mo', "damaged: .*run its shard again with --resume"),
        (cell, '"success":', '"won":', "damaged: .*run its shard again with --resume"),
        (settings, '"seed": ', '"seed', "settings.json: damaged"),
        (settings, '"version": "', '"version": "9.', 'made by version "9.'),
        (settings, '"draws": 3', '"draws": 4', "the setting `draws` differs"),
    ]:
        text = file.read_text()
        assert old in text
        file.write_text(text.replace(old, new, 1))
        with pytest.raises(RuntimeError, match=words):
            merge(out, shards)
        if file == cell or words.startswith("made"):
            with pytest.raises(RuntimeError, match=words):
                compare_controllers([*SWEEP, "--shard", "2/2", "--resume", "--out", str(shards[1])])
        file.write_text(text)
    with pytest.raises(RuntimeError, match="`seed` differs"):
        compare_controllers([*SWEEP, "--seed", "3", "--resume", "--out", str(shards[0])])


def test_wrong_arguments_are_named(capfd):
    with pytest.raises(ValueError, match="--shards"):
        compare_controllers(["--shards", "1/2"])
    with pytest.raises(ValueError, match="I/N"):
        compare_controllers(["--shard", "3/2"])
    compare_controllers(["--help"])
    assert "--shard <I/N>" in capfd.readouterr().out


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_keeps_the_finished_cells(tmp_path):
    program = "import sys; from puma_grasp.sweeps import main; main()"
    sweep = ["--draws", "500", "--starts", "5", "--only", "fuzzy", "--out", str(tmp_path)]
    with subprocess.Popen(
        [sys.executable, "-c", program, *sweep], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        while not any(tmp_path.glob("cells/*.json")):
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=60)
    assert process.returncode == 130 and b"stopped by a signal" in told, told
    assert (tmp_path / "runs.csv").read_text().count("\n") > 1
