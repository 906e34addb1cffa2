"""A wearer behind simulated drives who also points at a screen: the participant of a session in another process.

The session and this wearer share nothing but the drives' bus and a line (`task/participant_line.py`). At the other end
of the line is the session itself, which shows its page on the line and takes the touches; or a stimulus process, which
reads the session's page in a browser, takes the contacts of the finger, and makes the touches there. The wearer does
not know which of them is there.
"""

import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from exograv.laboratory.amplifier.pulse_line import ToAmplifier
from exograv.laboratory.attentive_wearer import AttentiveHold
from exograv.laboratory.options import DriveSimOptions
from exograv.laboratory.participant.habits import Habits
from exograv.laboratory.participant.recorded_participant import recorded_participant
from exograv.laboratory.participant.touch_panel import LIFT_S, OnScreen, TouchPanel
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.virtual_participant import Movement, PointingPerson, Thinker
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.results import json_value
from exograv.rig.twin import Twin, day_seed
from exograv.runtime.processes.line_socket import LinesListener
from exograv.storage.session_checkpoint import LearnedState
from exograv.task.participant_line import (
    TO_PARTICIPANT,
    Contact,
    Electrodes,
    Introduced,
    Learned,
    Remember,
    Room,
    Seen,
    Touched,
)
from exograv.task.protocol_schema import Protocol

SWITCH_S = 5e-5
"""Time after which the planner's thread leaves the interpreter to the loop of the drives [s]."""


FELT_EVERY_S = 0.02
"""Time between two torques of the muscles that the electrodes of an amplifier feel [s]."""


class WearerBehindDrives:
    """Wearer who holds the arm until the machine carries it, and touches the target when the page shows it."""

    def __init__(self, laboratory: VirtualLaboratory, protocol: Protocol, options: DriveSimOptions):
        """Seat the wearer in the machine, and listen for a session.

        Args:
            laboratory: Machine and wearer.
            protocol: Protocol of the session, with target and pace.
            options: Seed, donning and run of the participant, and the port of the line.

        Raises:
            RigError: Another process listens at the port.
        """
        self._room, self._habits = SimulatedRoom(), Habits(interval_s=protocol.windows.interval_s)
        self._surroundings = self._room.around(laboratory.assembly(), protocol.target)
        self._laboratory, self._protocol = laboratory, protocol
        day = day_seed(options.seed, options.donning)
        self.twin: Twin = laboratory.twin(day + options.run, surroundings=self._surroundings)
        self.twin.put_surroundings(False)
        self.person = PointingPerson(
            laboratory.own_arm(),
            laboratory.worn_inertia(),
            self._surroundings,
            self._room.on_panel(*self._room.target_px(protocol.target)),
            protocol.pace.too_short.shape,
            options.seed,
            self.twin.period_s,
            self._habits,
        )
        self.person.inner_ear = lambda: self.twin.room_gravity
        self.person.begin_day(day)
        self._hold = AttentiveHold(self.twin, laboratory.own_arm())
        self._day, self._is_pointing, self._openings = day, False, 0
        self._panel = self._new_panel()
        self._pressed: tuple[float, float] | None = None
        """Pixel under the finger that is on the panel."""
        self._left_at = self._felt_at = -np.inf
        self._electrodes: ToAmplifier | None = None
        if not options.lock_step:
            self.person.rehearse()
            self.person.think = in_background()
        self._listener, self._line = LinesListener(options.line), None

    @property
    def port(self) -> int:
        """Port of the line."""
        return self._listener.port

    @property
    def hear(self) -> Callable[[str], None]:
        """Function that tells the wearer the mode of the machine that begins."""
        return self._hold.hear

    def look(self) -> None:
        """Welcome a session that has connected."""
        came = self._listener.accepted()
        if came is None:
            return
        if self._line is not None:
            self._line.close()
        self._line, self._is_pointing = came, False
        self._openings += 1
        self._panel = self._new_panel()
        form = self._laboratory.form
        self._tell(
            Introduced(
                height_m=form.body.height_m,
                mass_kg=form.body.mass_kg,
                sex=form.body.sex,
                lengths_m=dict(form.lengths),
                screen=self._room.calibration,
                panel_px=(self._room.width_px, self._room.height_px),
                recorded=json_value(recorded_participant(self._room, self._surroundings, self._habits)),
            )
        )

    def act(self) -> None:
        """See the page, and set the muscles for the next step."""
        twin, line = self.twin, self._line
        if line is not None:
            for message in line.received():
                self._take(TO_PARTICIPANT.validate_json(message))
            if not line.is_open:
                self._line, self._is_pointing = None, False
                twin.tau_voluntary[:] = 0.0
        if not self._is_pointing:
            self._hold.act()
            return
        truth = twin.truth
        twin.tau_voluntary[:] = self.person.act(twin.t, truth.q_arm, truth.v_arm)

    def feel(self) -> None:
        """Feel the panel after a step, tell contacts, and report the touches whose reports are due.

        After the step the participant's clock shows the time of the measurement that answers the session, so that the
        session can convert the times.
        """
        now = self.twin.t
        if self._electrodes is not None and now - self._felt_at >= FELT_EVERY_S:
            self._felt_at = now
            self._electrodes.torque(self.twin.tau_voluntary.tolist())
        if not self._is_pointing:
            return
        finger = self.twin.finger_on_screen()
        off = self._panel.feel(now, finger)
        if off is not None:
            self.person.touched(now, off)
            self._tell(Learned(learned=self.person.learned.model_dump()))
        for touch in self._panel.reported(now):
            self._tell(Touched(now=now, touch=touch))
        self._press(now, finger)

    def close(self) -> None:
        """Close the line and its listener."""
        if self._line is not None:
            self._line.close()
        if self._electrodes is not None:
            self._electrodes.close()
        self._listener.close()

    def _take(self, message: Seen | Room | Remember | Electrodes) -> None:
        match message:
            case Seen():
                self._is_pointing = True
                if message.target_px is not None:
                    self._panel.put_target(*message.target_px)
                    self.person.look_at(self._panel.target)
                self.person.see(self.twin.t, message.picture)
            case Room():
                self.twin.put_surroundings(message.is_there)
            case Electrodes():
                if self._electrodes is not None:
                    self._electrodes.close()
                self._electrodes = ToAmplifier(message.port)
            case Remember():
                self.person.remember(LearnedState.model_validate(message.learned))

    def _press(self, now: float, finger: OnScreen | None) -> None:
        """Tell that the finger has met the panel, or has left it for longer than a bounce."""
        if finger is not None:
            self._left_at = now + LIFT_S
        pixel = None if finger is None else self._room.pixel_of(finger)
        if self._pressed is None and pixel is not None:
            self._pressed = pixel
            self._tell_contact(is_down=True)
        elif self._pressed is not None and now > self._left_at:
            self._tell_contact(is_down=False)
            self._pressed = None

    def _tell_contact(self, *, is_down: bool) -> None:
        assert self._pressed is not None
        x, y = self._pressed
        width = self._room.contact_mm / self._room.pitch_mm
        self._tell(Contact(t=time.monotonic(), is_down=is_down, x_px=x, y_px=y, contact_px=width))

    def _tell(self, message: Introduced | Touched | Contact | Learned) -> None:
        if self._line is not None:
            self._line.send(message.model_dump_json())

    def _new_panel(self) -> TouchPanel:
        random = np.random.default_rng([self._day, 32, self._openings])
        return TouchPanel(self._room, self._protocol.target, random, f"simulated-{self._openings}")


def in_background() -> Thinker:
    """Return a planner in a thread of usual priority: the drives in this process must not wait for a plan.

    The thread begins before the loop of the drives takes its real-time priority: a new thread would inherit it.
    """
    pool = ThreadPoolExecutor(1)
    pool.submit(int).result()
    sys.setswitchinterval(SWITCH_S)

    def think(plan: Callable[[], Movement]) -> Callable[[], Movement | None]:
        planned = pool.submit(plan)
        return lambda: planned.result() if planned.done() else None

    return think
