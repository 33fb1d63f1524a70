"""Circle detection on numpy arrays, and Gymnasium environments of a PUMA 560 with a camera.

>>> import numpy as np
>>> from puma_grasp import find_circles
>>> y, x = np.mgrid[:144, :192]
>>> image = np.where(np.hypot(x - 100, y - 70) < 28, 40, 200).astype(np.uint8)
>>> ball = find_circles(image)[0]
>>> bool(abs(ball["x"] - 100) < 0.2), round(float(ball["radius"]))
(True, 28)

The environments ``PumaReach-v0`` and ``PumaCell-v0`` are registered when this module is imported
and Gymnasium is installed; see :mod:`puma_grasp.envs`.
"""

from importlib.util import find_spec as _find_spec

from .circles import CIRCLE, ELLIPSE, Detector, find_circles
from .sweeps import compare_controllers

__all__ = ["CIRCLE", "ELLIPSE", "Detector", "compare_controllers", "find_circles"]
__version__ = "0.1.0"

if _find_spec("gymnasium") is not None:
    from .envs import register as _register

    _register()
