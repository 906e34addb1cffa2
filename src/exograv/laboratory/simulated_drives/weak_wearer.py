"""Weak person behind simulated drives, who follows the instructions at the bench."""

from collections.abc import Callable

import numpy as np

from exograv.laboratory.options import DriveSimOptions
from exograv.laboratory.support_level.weak_participant import weak_in
from exograv.laboratory.support_level.weak_person import ReachingPerson
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.procedures.rehabilitation.support_level.options import WeakPersonOptions
from exograv.rig.twin import Twin


class WeakWearerBehindDrives:
    """Wearer who is relaxed until the first instruction, and then acts with little strength."""

    def __init__(self, laboratory: VirtualLaboratory, options: DriveSimOptions):
        """Seat the person in the machine.

        Raises:
            ConfigError: An option or a file is not valid, or the machine is not one for the targets.
        """
        of_person = WeakPersonOptions(options.seed, options.strength, options.synergy, options.person_file)
        self.laboratory, weakness, body = weak_in(laboratory, of_person)
        """Machine with the weak person."""
        self.twin: Twin = self.laboratory.twin(options.seed)
        self.hold: Callable[[], object] = lambda: None
        """Acts of each step until the first instruction: the person holds the arm until the machine carries it."""
        self._person = ReachingPerson(body, weakness, self.twin, options.seed)
        self._is_instructed = False

    def act(self) -> None:
        """Set the muscles for the next step."""
        if self._is_instructed:
            self._person.act()
        else:
            self.hold()

    def rest(self, seconds: float, gravity_level: float) -> None:
        """Go to rest within a time [s], while the felt gravity level changes to this value."""
        self._is_instructed = True
        self._person.rest(seconds, gravity_level)

    def attempt(self) -> None:
        """Mobilise strength for the next attempt."""
        self._person.attempt()

    def reach(self, target: int, place: np.ndarray) -> None:
        """Reach for a target at this place in the base frame [m]."""
        self._is_instructed = True
        self._person.reach(target, place)
