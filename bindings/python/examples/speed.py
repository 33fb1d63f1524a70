"""Times a call of the detector and steps of the environments on this machine."""

import time

import gymnasium
import numpy as np

import puma_grasp


def per_call(call, calls):
    """Median over nine rounds of the microseconds of a call."""
    rounds = []
    for _ in range(9):
        begun = time.perf_counter()
        for _ in range(calls):
            call()
        rounds.append((time.perf_counter() - begun) / calls * 1e6)
    return float(np.median(rounds))


def main():
    rows, columns = np.mgrid[:576, :768]
    image = np.where(np.hypot(columns - 300, rows - 270) < 60, 40, 200).astype(np.uint8)
    detector = puma_grasp.Detector()
    copy = image.copy()
    call = per_call(lambda: detector.detect(np.zeros((4, 4), np.uint8)), 2000)
    copying = per_call(lambda: np.copyto(copy, image), 500)
    print(f"overhead of a call: {call:.1f} us, and {copying:.1f} us to copy 768 x 576 pixels")
    print(f"a disc in 768 x 576 pixels: {per_call(lambda: detector.detect(image), 100):.0f} us")

    for name, cells in [("PumaReach-v0", 4096), ("PumaCell-v0", 256)]:
        env = gymnasium.make_vec(name, cells, vectorization_mode="vector_entry_point")
        env.reset(seed=1)
        actions = [env.action_space.sample() for _ in range(8)]
        begun, steps = time.process_time(), 9 * 4 * 8 * cells
        step = per_call(lambda: [env.step(action) for action in actions], 4) / 8
        cpu = (time.process_time() - begun) / steps * 1e6
        print(
            f"{name}, {cells} cells, random actions: {cells / step:.2f} million steps/s, "
            f"{cpu:.2f} us of CPU time a step"
        )
    env = gymnasium.make("PumaReach-v0", observation="frame", task="centering")
    env.reset(seed=1)
    frame = per_call(lambda: (env.reset(), env.step(4)), 20) / 2
    print(f"a frame of 192 x 144 pixels: {frame:.0f} us")


if __name__ == "__main__":
    main()
