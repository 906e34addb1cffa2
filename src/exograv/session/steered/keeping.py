"""What becomes of the person who is put in: a file that is somebody else's stops, and who was learned is kept."""

import contextlib

from exograv.errors import ExogravError
from exograv.runtime.steering import Pressed
from exograv.session.live_processes import Running
from exograv.session.prepare import Prepared

from .people import Donned
from .place import Place
from .sentences import say

PRESSED = -1
"""Number of a word that nobody waits for."""


class Keeping:
    """Of one set of processes."""

    def __init__(self, who: Donned, place: Place):
        """Nobody has been moved yet."""
        self._who, self._place = who, place
        self._is_done = False
        self.code = who.participant
        """Of the file in force, or of the one that was written; absent where there is none."""
        self.is_contradicted = False
        """Whether the motion speaks against the file."""
        self.wrong: tuple[str, ...] = ()
        """What somebody should know."""

    def look(self, running: Running, prepared: Prepared) -> None:
        """Some times a second."""
        worker = running.worker
        if worker is None or worker.judged is None or self._is_done:
            return
        if worker.judged.is_contradicted:
            self._is_done = self.is_contradicted = True
            self.wrong = (say("flight.other_person", person=self._who.participant),)
            with contextlib.suppress(OSError):
                running.line.send(Pressed(PRESSED))
        elif worker.learned is not None:
            self._is_done = True
            try:
                kept = self._place.people.keep(self._who.code, worker.learned, worker.judged.left_over, prepared)
            except ExogravError as error:
                self.wrong = (str(error),)
                return
            self.code = kept or self.code
            self._place.look_for_files()
