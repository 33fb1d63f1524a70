"""Circles in pictures: the a contrario detector of the Rust crate ``hough-heuristic``."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, Optional, TypedDict

import numpy as np
from numpy.typing import NDArray

from . import _native

if TYPE_CHECKING:
    from typing_extensions import Unpack

#: Fields of a circle. Pixels have their centres at whole coordinates: (0, 0) is the middle of the
#: top-left pixel, x to the right and y down.
CIRCLE = np.dtype(
    [
        ("x", "f8"),  # centre, pixels
        ("y", "f8"),
        ("radius", "f8"),  # pixels
        ("score", "f8"),  # 0..1: 0.5 is one circle of chance in 10 frames, 0.8 one in 10,000
        ("covered", "f8"),  # share of the visible outline with an edge on it, 0..1
        ("visible", "f8"),  # share of the outline that lies in the frame, 0..1
        ("axis_ratio", "f8"),  # shortest by longest diameter, 0..1
        ("centre_error", "f8"),  # standard errors, pixels
        ("radius_error", "f8"),
        ("log_false_alarms", "f8"),  # decimal logarithm of the number of false alarms
    ]
)

#: Fields of an ellipse, found with ``min_axis_ratio`` below 1: those of a circle of its centre and
#: area, and its half-axes.
ELLIPSE = np.dtype(
    CIRCLE.descr
    + [
        ("major", "f8"),  # half-axes, pixels
        ("minor", "f8"),
        ("angle", "f8"),  # of the longer one, degrees from the x axis toward the y axis, -90..90
        ("major_error", "f8"),  # standard errors, pixels and degrees
        ("minor_error", "f8"),
        ("angle_error", "f8"),  # about 52 degrees where the axes are too alike to tell it
    ]
)


class Settings(TypedDict, total=False):
    """Settings of :class:`Detector`, for type checkers."""

    min_radius: float
    max_radius: Optional[float]
    max_circles: int
    rings: str
    min_distance: float
    min_axis_ratio: float
    min_score: float
    contrast: float
    draws: int
    time_limit: Optional[float]
    region: Optional[tuple[int, int, int, int]]
    channel: str
    seed: int


class Detector:
    """A circle detector with its buffers, for many frames.

    Results depend on the settings and the frame alone, never on the frames before. It can be used
    from several threads, which then take turns; other threads of Python run while it searches.

    Parameters
    ----------
    min_radius, max_radius : float, optional
        Range of radii in pixels (defaults 8, or 4 if small closed outlines are seen, and 0.52 of
        the shorter side of the frame).
    max_circles : int, optional
        Largest number of circles, best first (default: all).
    rings : {"all", "outer", "inner"}
        Circles returned of those about one centre.
    min_distance : float
        Smallest distance between the centres of two circles, pixels.
    min_axis_ratio : float
        Smallest ratio of the half-axes of an outline, 0.3..1. Below 1 ellipses are found too, and
        results are of dtype :data:`ELLIPSE`. It takes several times as long.
    min_score : float
        Smallest score, 0..1.
    contrast : float
        Smallest contrast of an edge that the search draws, gray levels.
    draws : int
        Largest number of draws per million pixels.
    time_limit : float, optional
        Time limit in milliseconds per million pixels. With one, results depend on the machine.
    region : tuple of int, optional
        Left, top, width and height of the region in which the centres must lie.
    channel : {"auto", "luma", "red", "green", "blue", "strongest"}
        Part of a coloured picture that is searched: ``"auto"`` takes brightness unless a component
        shows much stronger edges. Colours are in the order red, green, blue:
        for a picture read by OpenCV pass ``image[..., ::-1]``.
    seed : int
        Seed of the draws.

    Raises
    ------
    ValueError
        A setting outside its range.
    """

    def __init__(self, **settings: Unpack[Settings]) -> None:
        self._native = _native.Detector(**settings)
        self._dtype = ELLIPSE if settings.get("min_axis_ratio", 1.0) < 1.0 else CIRCLE

    def detect(self, image: NDArray[Any]) -> NDArray[np.void]:
        """Find the circles in a picture.

        Parameters
        ----------
        image : numpy.ndarray
            Shape (height, width) or (height, width, 1, 3 or 4); uint8, bool, uint16 (scaled by
            the bits that its largest value needs), or floating point in 0..1.

        Returns
        -------
        numpy.ndarray
            Circles of dtype :data:`CIRCLE`, or :data:`ELLIPSE` with ``min_axis_ratio``, best first.

        Raises
        ------
        TypeError
            No numpy array, or one of another dtype.
        ValueError
            Another shape, values outside 0..1, or a region outside the frame.
        """
        return self._native.detect(image).view(self._dtype).reshape(-1)

    def track(
        self, image: NDArray[Any], last: Any, reach: float = 12.0
    ) -> tuple[NDArray[np.void], bool]:
        """Look for a circle near ``last``, and in the whole picture if it is not there.

        Parameters
        ----------
        image : numpy.ndarray
            As for :meth:`detect`.
        last : record of dtype CIRCLE, or (x, y, radius)
            Circle in the frame before.
        reach : float
            Pixels that the centre may move, or the radius change.

        Returns
        -------
        circles : numpy.ndarray
            As of :meth:`detect`.
        followed : bool
            True if the circle was found near ``last``.
        """
        x, y, radius = (float(last[i]) for i in range(3))
        rows, followed = self._native.track(image, (x, y, radius), reach)
        return rows.view(self._dtype).reshape(-1), followed

    @property
    def effort(self) -> dict[str, Any]:
        """Work of the last frame, a dict.

        ``draws`` and ``looks`` count the work; ``ended_by_budget`` and ``ended_by_count`` tell
        that there may be more circles; ``bits_used`` is the number of bits that 16-bit values
        were scaled up from, or None.
        """
        return self._native.effort


def find_circles(image: NDArray[Any], **settings: Unpack[Settings]) -> NDArray[np.void]:
    """Find the circles in one picture.

    Takes the picture of :meth:`Detector.detect` and the settings of :class:`Detector`. It warns if
    the budget or ``max_circles`` ended the search.

    >>> import numpy as np
    >>> len(find_circles(np.zeros((100, 100), np.uint8)))
    0
    """
    detector = Detector(**settings)
    circles = detector.detect(image)
    effort = detector.effort
    if effort["ended_by_budget"]:
        warnings.warn(
            "the budget ended the search, there may be more circles: raise draws or time_limit",
            RuntimeWarning,
            stacklevel=2,
        )
    return circles
