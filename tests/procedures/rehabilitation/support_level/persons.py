"""Virtual persons of known thresholds, who need no machine."""

import numpy as np

from exograv.procedures.rehabilitation.support_level.targets import TARGETS


class Known:
    """Person who reaches a target with a chance that rises with support."""

    def __init__(self, seed: int, person: float | None = None):
        self.random = np.random.default_rng(seed)
        middle = self.random.uniform(0.1, 0.9) if person is None else person
        self.thresholds = middle + self.random.uniform(0.04, 0.25) * self.random.standard_normal(len(TARGETS))
        self.width = self.random.uniform(0.008, 0.06)
        self.asked: list[tuple[float, bool]] = []

    def chance(self, s: np.ndarray) -> np.ndarray:
        return 0.02 + 0.96 / (1.0 + np.exp(-np.clip((s - self.thresholds) / self.width, -50, 50)))

    def __call__(self, target: int, support: float) -> bool:
        hit = bool(self.random.random() < self.chance(np.array(support))[target])
        self.asked.append((support, hit))
        return hit

    def needed(self) -> float:
        grid = np.linspace(-0.5, 1.5, 2001)
        return float(grid[np.argmax(self.chance(grid[:, None]).mean(axis=1) >= 0.8)])
