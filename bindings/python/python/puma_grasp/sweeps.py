"""Sweeps of the program ``compare_controllers`` from Python."""

from __future__ import annotations

import sys
from typing import Sequence

from . import _native


def compare_controllers(arguments: Sequence[str]) -> None:
    """Run the program ``compare_controllers`` in this process; other threads of Python run too.

    Parameters
    ----------
    arguments : sequence of str
        Those of the command line, ``["--shard", "1/4", "--resume", "--out", "out/shard1"]`` for
        example. ``["--help"]`` prints them all.

    Raises
    ------
    ValueError
        Wrong arguments.
    RuntimeError
        Results of another sweep or version, cells that are missing or damaged, files that cannot
        be read or written.
    KeyboardInterrupt
        Ctrl-C; the finished cells are kept.
    """
    _native.compare_controllers(list(arguments))


def main() -> None:
    """Run ``compare_controllers`` with the arguments of the command line, and exit."""
    try:
        compare_controllers(sys.argv[1:])
    except ValueError as wrong:
        sys.exit(_told(str(wrong), 2))
    except RuntimeError as error:
        sys.exit(_told(f"error: {error}\n", 1))
    except KeyboardInterrupt:
        sys.exit(_told("error: stopped by a signal\n", 130))


def _told(words: str, code: int) -> int:
    sys.stderr.write(words)
    return code
