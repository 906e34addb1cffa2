"""Support that a virtual person needs, from the twin's truth. The search must find it; only scoring may use it.

There are two answers. Flown: every target is tried at all supports near the answer, until the result is clear.
Static: the least support with which the arm comes to rest near enough to each target, without motion and noise.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import isotonic_regression

from exograv.laboratory.support_level.weak_participant import WeakParticipant
from exograv.laboratory.support_level.weak_person import PerFreedom, Place
from exograv.loop.pilot import Progress
from exograv.procedures.rehabilitation.support_level.search import CRITERION, SUPPORTS, Tries
from exograv.procedures.rehabilitation.support_level.targets import TOLERANCE_M
from exograv.procedures.rehabilitation.support_level.threshold import DRAWS_LAST, ThresholdSearch
from exograv.rig.twin.behaviour.acting_wearer import usual_physiology
from exograv.rig.twin.behaviour.weakness import ELBOW, involuntary, weak_physiology

ABOUT = 5
"""Steps of `SUPPORTS` to which whole blocks of targets narrow the answer: 12 points."""

HALF_WINDOW, CENTRED = 4, 2
"""Steps of `SUPPORTS`: flown on each side of the middle; distance of the answer beyond which the window moves."""

STREAK = 3
"""Supports in a row with only hits or only misses, after which a target is flown no further: 7 points."""

MOVES_MAX = 5

STEP, STEPS_MAX, STILL_RAD = 0.3, 600, 1e-4
"""Iteration to rest: share of the step that the muscles' stiffness asks for, most steps, step that ends it [rad]."""

MEAN_SHORT = float(np.sqrt(2.0 / np.pi))
"""Mean shortfall of half a normal distribution, in its SD [-]."""


@dataclass(frozen=True)
class FlownAnswer:
    """Hits and attempts of each target at each of `SUPPORTS`; zero attempts where nothing was flown."""

    hits: Int[np.ndarray, "support target"]
    tries: Int[np.ndarray, "support target"]

    def needed(self) -> float | None:
        """Least support [share of the weight] with which the criterion is met; None if none is enough."""
        return crossing(SUPPORTS, rising_share(self.hits, self.tries).mean(axis=1))

    def interval(self) -> tuple[float, float]:
        """95 % interval of the needed support [share of the weight], from the search's model of these attempts.

        A bootstrap of the attempts has too low coverage: with one attempt at each support a target seems certain.
        """
        found = ThresholdSearch(self.tries.shape[1], CRITERION, 0)
        for k, target in zip(*np.nonzero(self.tries), strict=True):
            for one in range(self.tries[k, target]):
                found.take(int(target), float(SUPPORTS[k]), bool(one < self.hits[k, target]))
        _, low, high = found.posterior(DRAWS_LAST).interval()
        return min(max(low, 0.0), 1.0), min(max(high, 0.0), 1.0)


def rising_share(
    hits: Int[np.ndarray, "support target"], tries: Int[np.ndarray, "support target"]
) -> Float[np.ndarray, "support target"]:
    """Share of attempts that reach a target, monotonic in support; interpolated where nothing was flown."""
    columns = []
    for hit, tried in zip(hits.T, tries.T, strict=True):
        at = np.flatnonzero(tried)
        columns.append(np.interp(SUPPORTS, SUPPORTS[at], isotonic_regression(hit[at] / tried[at], weights=tried[at]).x))
    return np.column_stack(columns)


def crossing(supports: Float[np.ndarray, " support"], share: Float[np.ndarray, " support"]) -> float | None:
    """Support at which a monotonic share reaches the criterion, by linear interpolation; None if never."""
    above = np.flatnonzero(share >= CRITERION - 1e-9)
    if not len(above):
        return None
    k = int(above[0])
    if k == 0:
        return float(supports[0])
    part = (CRITERION - share[k - 1]) / (share[k] - share[k - 1])
    return float(supports[k - 1] + part * (supports[k] - supports[k - 1]))


def static_answer(one: WeakParticipant, places: list[Place]) -> float | None:
    """Least of `SUPPORTS` with which enough arms come to rest near enough; None if full support is not enough."""
    for support in SUPPORTS.tolist():
        near = [np.linalg.norm(one.body.own.fingertip(resting(one, place, support)) - place) for place in places]
        if np.mean(np.array(near) <= TOLERANCE_M) >= CRITERION:
            return support
    return None


def resting(one: WeakParticipant, place: Place, support: float) -> PerFreedom:
    """Resting posture [rad] of an arm that aims at a place [m], after it sinks or its elasticity moves it.

    Muscles pull with the torque of an average attempt, and the machine's dry friction helps; they give way beyond that.
    A criterion that asks the muscles to hold the exact posture asks for more than a reach needs.
    """
    weakness, own = one.weakness, one.body.own
    most, stiffness = weak_physiology(weakness).torque_max, usual_physiology(len(weakness.strength)).stiffness
    # The joints of machines with four joints are nearly the arm's own degrees of freedom.
    limit = (1.0 - MEAN_SHORT * weakness.mobilised_sd) * most + one.laboratory.machine.friction.coulomb
    wanted = one.body.posture_at(place)
    q, still = wanted.copy(), np.zeros(len(most))
    for _ in range(STEPS_MAX):
        needed = own.torque(q, still, still, 1.0 - support)
        pull = np.clip(needed + stiffness * (wanted - q), -limit, limit)
        pull[ELBOW] += involuntary(weakness, most, pull)
        step = STEP * (pull - needed) / stiffness
        q = np.clip(q + step, one.body.lower, one.body.upper)
        if np.abs(step).max() < STILL_RAD:
            break
    return q


def fly_answer(tries: Tries, targets: int, repeats: int, progress: Progress) -> FlownAnswer:
    """Find the support that meets the criterion: first by blocks of all targets, then target by target near it.

    Args:
        tries: Makes one attempt at a target with a support.
        targets: Number of targets.
        repeats: Attempts at a target with one support.
        progress: Called after every block and target.
    """
    brute = _BruteForce(tries, targets, repeats)
    low, high = 0, len(SUPPORTS) - 1
    while high - low > ABOUT:
        middle = (low + high) // 2
        progress(f"All targets with {100 * SUPPORTS[middle]:.0f} % carried", 0.0)
        enough = np.mean([brute.fly(middle, target) for target in range(targets)]) >= CRITERION
        low, high = (low, middle) if enough else (middle, high)
    at = (low + high) // 2
    for _ in range(MOVES_MAX):
        for target in range(targets):
            progress(f"About {100 * SUPPORTS[at]:.0f} % carried, target {target + 1}", target / targets)
            brute.fly_near(target, max(at - HALF_WINDOW, 0), min(at + HALF_WINDOW, len(SUPPORTS) - 1))
        value = brute.answer().needed()
        now = len(SUPPORTS) - 1 if value is None else int(np.searchsorted(SUPPORTS, value))
        if abs(now - at) <= CENTRED:
            break
        at = now
    return brute.answer()


class _BruteForce:
    """Attempts that were flown; each target and support is flown at most `repeats` times."""

    def __init__(self, tries: Tries, targets: int, repeats: int):
        self._tries, self._repeats = tries, repeats
        self._hits, self._tried = np.zeros((2, len(SUPPORTS), targets), dtype=int)

    def answer(self) -> FlownAnswer:
        return FlownAnswer(self._hits.copy(), self._tried.copy())

    def fly(self, support: int, target: int) -> float:
        """Share of attempts that reach the target with this index of `SUPPORTS`; fly them if needed."""
        while self._tried[support, target] < self._repeats:
            self._hits[support, target] += self._tries(target, float(SUPPORTS[support]))
            self._tried[support, target] += 1
        return self._hits[support, target] / self._repeats

    def fly_near(self, target: int, low: int, high: int) -> None:
        """Fly a target from its own threshold up and down, until it is clear or the window ends."""
        share = rising_share(self._hits[:, [target]], self._tried[:, [target]])[:, 0]
        own = int(np.clip(np.searchsorted(share, 0.5), low, high))
        for way, clear in ((range(own, high + 1), 1.0), (range(own - 1, low - 1, -1), 0.0)):
            streak = 0
            for support in way:
                streak = streak + 1 if self.fly(support, target) == clear else 0
                if streak == STREAK:
                    break
