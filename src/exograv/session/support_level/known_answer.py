"""The known answer for a virtual person: what a search has to find. It reads the twin's truth; only scoring uses it.

Two ways. By flying: every target at many supports, none chosen by outcome. By statics: with how much support the
muscles just hold the arm at each target, without friction, inertia and noise.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from exograv.rig.twin.weakness import involuntary, weak_physiology
from exograv.session.pilot import Progress

from .ready import Subject
from .search import CRITERION
from .targets import TARGETS

STEP = 0.05
"""Of support between two blocks that are flown [share of the weight]."""

HALF_RANGE = 0.2
"""About the static answer [share of the weight]; wider where the criterion is not crossed within."""

MEAN_SHORT = float(np.sqrt(2.0 / np.pi))
"""Mean of what half a normal distribution falls short by, in its SD [-]."""

RESAMPLED = 500


@dataclass(frozen=True)
class FlownAnswer:
    """Of all the targets at each support, how often each was reached."""

    supports: Float[np.ndarray, " support"]
    reached: Bool[np.ndarray, "support target repeat"]

    def needed(self) -> float | None:
        """Least support [share of the weight] with which the criterion is met; None if none is enough."""
        return crossing(self.supports, self.reached.mean(axis=(1, 2)))

    def interval(self, seed: int = 0) -> tuple[float, float]:
        """95 % interval of that by drawing the attempts of each target again, neighbouring supports together."""
        random = np.random.default_rng([seed, 53])
        p = _monotone_by_target(self.reached.mean(axis=2))
        found = []
        for _ in range(RESAMPLED):
            drawn = random.random(self.reached.shape) < p[:, :, None]
            value = crossing(self.supports, drawn.mean(axis=(1, 2)))
            found.append(1.0 if value is None else value)
        low, high = np.quantile(found, [0.025, 0.975])
        return float(low), float(high)


def crossing(supports: Float[np.ndarray, " support"], share: Float[np.ndarray, " support"]) -> float | None:
    """Where the best fitting share that never falls with support comes to the criterion; between two, linearly."""
    rising = isotonic(share)
    above = np.flatnonzero(rising >= CRITERION)
    if not len(above):
        return None
    k = int(above[0])
    if k == 0:
        return float(supports[0])
    part = (CRITERION - rising[k - 1]) / (rising[k] - rising[k - 1])
    return float(supports[k - 1] + part * (supports[k] - supports[k - 1]))


def isotonic(values: Float[np.ndarray, " support"]) -> Float[np.ndarray, " support"]:
    """Nearest values, in squares, that never fall: neighbours that do are pooled."""
    pools: list[tuple[float, int]] = []
    for value in values.tolist():
        pools.append((value, 1))
        while len(pools) > 1 and pools[-2][0] > pools[-1][0]:
            (a, n), (b, m) = pools[-2:]
            pools[-2:] = [((a * n + b * m) / (n + m), n + m)]
    return np.array([mean for mean, count in pools for _ in range(count)])


def static_answer(one: Subject, places: list[Float[np.ndarray, " 3"]]) -> float | None:
    """By what muscles of average effort hold [share of the weight]; None where full support is not enough."""
    weakness, own = one.weakness, one.body.own
    most = weak_physiology(weakness).torque_max
    limit = (1.0 - MEAN_SHORT * weakness.mobilised_sd) * most
    still, supports = np.zeros(len(most)), np.linspace(0.0, 1.0, 101)
    holds = np.zeros((len(supports), len(places)))
    for k, place in enumerate(places):
        q = one.body.posture_at(place)
        full, none = (own.torque(q, still, still, level) for level in (1.0, 0.0))
        for row, support in enumerate(supports):
            needed = none + (1.0 - support) * (full - none)
            wanted = needed.copy()
            wanted[3] -= involuntary(weakness, most, np.clip(needed, -limit, limit))
            holds[row, k] = bool((np.abs(wanted) <= limit).all())
    enough = np.flatnonzero(holds.mean(axis=1) >= CRITERION)
    return float(supports[enough[0]]) if len(enough) else None


def fly_answer(one: Subject, about: float, repeats: int, run_seed: int, progress: Progress) -> FlownAnswer:
    """Every target `repeats` times at supports about one [share of the weight], from much support to little.

    Raises:
        RigError: The envelope stopped the run.
    """
    flight = one.flight(run_seed)
    high, low = (round(min(max(about + side * HALF_RANGE, 0.0), 1.0) / STEP) for side in (1.0, -1.0))
    rows: dict[int, list[list[bool]]] = {}

    def block(k: int) -> float:
        progress(f"All targets with {100 * k * STEP:.0f} % carried", 0.0)
        tried = [[flight.attempt(target, k * STEP).reached for _ in range(repeats)] for target in range(len(TARGETS))]
        rows[k] = tried
        return float(np.mean(tried))

    for k in range(high, low - 1, -1):
        block(k)
    while np.mean(rows[max(rows)]) < CRITERION and max(rows) * STEP < 1.0 - 1e-9:
        block(max(rows) + 1)
    while np.mean(rows[min(rows)]) >= CRITERION and min(rows) > 0:
        block(min(rows) - 1)
    order = sorted(rows)
    return FlownAnswer(STEP * np.array(order), np.array([rows[k] for k in order]))


def _monotone_by_target(share: Float[np.ndarray, "support target"]) -> Float[np.ndarray, "support target"]:
    """One attempt a support says 0 or 1: half an attempt either way is not known."""
    return np.clip(np.column_stack([isotonic(one) for one in share.T]), 0.05, 0.95)
