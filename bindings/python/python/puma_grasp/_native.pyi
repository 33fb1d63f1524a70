from typing import Any, Optional, Sequence

import numpy as np
from numpy.typing import NDArray

def compare_controllers(arguments: Sequence[str]) -> None: ...

class Detector:
    def __init__(
        self,
        *,
        min_radius: Optional[float] = None,
        max_radius: Optional[float] = None,
        max_circles: Optional[int] = None,
        rings: str = "all",
        min_distance: float = 0.0,
        min_axis_ratio: float = 1.0,
        min_score: float = 0.5,
        contrast: float = 8.0,
        draws: int = 50_000,
        time_limit: Optional[float] = None,
        region: Optional[tuple[int, int, int, int]] = None,
        channel: str = "auto",
        seed: int = 1,
    ) -> None: ...
    def detect(self, image: NDArray[Any]) -> NDArray[np.float64]: ...
    def track(
        self, image: NDArray[Any], last: tuple[float, float, float], reach: float
    ) -> tuple[NDArray[np.float64], bool]: ...
    @property
    def effort(self) -> dict[str, Any]: ...

class Cells:
    def __init__(
        self,
        count: int,
        *,
        task: str = "reaching",
        reward: str = "paper",
        whole: bool = False,
        frames: bool = False,
        scaled: bool = False,
        level: str = "none",
        odd: Sequence[str] = ...,
        noise: Optional[float] = None,
    ) -> None: ...
    @property
    def moves(self) -> list[list[tuple[float, float, float]]]: ...
    @property
    def largest(self) -> tuple[float, float, float]: ...
    @property
    def goal(self) -> list[tuple[int, float, float]]: ...
    def seed(self, seeds: NDArray[np.uint64]) -> None: ...
    def reset(self, marked: NDArray[np.bool_]) -> NDArray[np.float32]: ...
    def step(
        self, actions: NDArray[Any], most: int
    ) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.uint8], NDArray[np.bool_]]: ...
    def joints(self, cell: int) -> tuple[float, ...]: ...
    def features(self, cell: int) -> tuple[float, float, float]: ...
    def frame(self, cell: int) -> NDArray[np.uint8]: ...
    def picture(self, cell: int) -> NDArray[np.uint8]: ...
