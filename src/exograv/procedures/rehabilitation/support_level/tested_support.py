"""Search of the needed support with attempts in a machine, and a test of the found support."""

from dataclasses import dataclass
from pathlib import Path

from exograv.loop.pilot import Progress
from exograv.report.figures.support_data import SupportOutcome

from .flight import Attempt, SupportFlight
from .outcome import figures
from .search import NeededSupport, search
from .targets import TARGETS


@dataclass(frozen=True)
class TestedSupport:
    """Needed support, with the attempts of the search and those of the test that followed."""

    needed: NeededSupport
    attempts: list[Attempt]
    confirmed: list[Attempt]

    @property
    def outcome(self) -> SupportOutcome:
        """Figures of the search."""
        tried = [(one.target, one.support, one.reached) for one in self.attempts]
        return figures(self.needed, tried, sum(one.reached for one in self.confirmed))


def search_and_test(flight: SupportFlight, seed: int, progress: Progress) -> TestedSupport:
    """Search the needed support, try every target once with it, and carry the whole arm again.

    Raises:
        RigError: The machine was stopped.
    """
    needed, attempts = search_flight(flight, seed, progress)
    # Every target is tried once with the found support: the result of the search is tested, not assumed.
    confirmed = list[Attempt]()
    for target in range(len(TARGETS)):
        progress("Testing the found support", target / len(TARGETS))
        confirmed.append(flight.attempt(target, needed.ci[0]))
    flight.carry_all()
    return TestedSupport(needed, attempts, confirmed)


def search_flight(flight: SupportFlight, seed: int, progress: Progress) -> tuple[NeededSupport, list[Attempt]]:
    """Search with attempts in a machine. The attempts are returned too."""
    attempts: list[Attempt] = []

    def tries(target: int, support: float) -> bool:
        attempts.append(flight.attempt(target, support))
        return attempts[-1].reached

    return search(tries, seed, progress), attempts


def draw_outcome(outcome: SupportOutcome, is_simulated: bool, path: Path) -> Path:
    """Draw the outcome as a picture at this path, and beside it as PNG."""
    from exograv.report.figures.support import draw_support  # Matplotlib: 0.4 s
    from exograv.report.style.figure_style import write_picture

    for place in (path.with_suffix(".png"), path):
        write_picture(place, lambda: draw_support(outcome, is_simulated))
    return path
