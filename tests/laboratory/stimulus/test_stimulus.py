"""A stimulus process reads the participant's real page in Chromium, and its touches are recorded there, on time."""

import json
import multiprocessing
import threading
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from tests.console.of_process import short_training

from exograv.console.options import Address
from exograv.console.run import run_console
from exograv.console.terminal_page import TerminalPage
from exograv.console.terminal_session import Keyboard, SessionOutcome, TerminalSession
from exograv.console.trial_request import TrialRequest
from exograv.experiment.steered.rehearsal import RehearsedFlight
from exograv.experiment.steered.session_controller import SessionController
from exograv.laboratory.options import DriveSimOptions, StimulusOptions
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.simulated_drives.wearer_behind_drives import WearerBehindDrives
from exograv.laboratory.stimulus.devtools import BrowserError, chromium
from exograv.laboratory.stimulus.stimulus_command import StimulusResult, run_stimulus
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.simulated.address import free_port
from exograv.rig.drives.simulated.plant import Plant
from exograv.runtime.processes.line_socket import LinesListener
from exograv.task.participant_line import TO_PARTICIPANT, Contact, Introduced, Room, Seen
from exograv.task.protocol import load_protocol
from exograv.task.record_sinks import TASK_TOPIC

CHROMIUM = Path("/usr/bin/chromium")
DRIVES = Path(__file__).parents[3] / "examples" / "drives" / "udp.toml"
SEED, LEVEL = 1024, 1
DAMPING, LAG_S = 5.0, 0.02
"""Damping of the machine [N·m·s/rad], and lag of the simulation after which time is lost instead of caught up [s]."""

needs_chromium = pytest.mark.skipif(
    not CHROMIUM.exists(), reason=f"There is no {CHROMIUM}. On Debian: apt-get install chromium"
)
OFF_PX = (30.0, -12.0)
"""Place of every touch, right and down of the target that the page shows [px]."""

EVERY_S, STAYS_S = 1.0, 0.15
LATE_S = 0.25
"""Longest time from a contact to the recorded time of its touch on a busy computer [s]."""


class ScriptedFinger:
    """Participant at the other end of the line, whose finger touches beside the drawn target once a second."""

    def __init__(self) -> None:
        self._listener = LinesListener(0)
        self.port = self._listener.port
        self.seen, self.contacts, self.is_in_room = list[Seen](), list[Contact](), False

    def run(self, is_over: threading.Event) -> None:
        line = None
        while line is None and not is_over.is_set():
            line = self._listener.accepted()
            time.sleep(0.01)
        if line is None:
            return
        room, width, pressed = SimulatedRoom(), 32.5, False
        line.send(
            Introduced(
                height_m=1.75, mass_kg=75.0, sex="male", lengths_m={}, screen=room.calibration,
                panel_px=(room.width_px, room.height_px), recorded={},
            ).model_dump_json()
        )  # fmt: skip
        while line.is_open and not is_over.is_set():
            for text in line.received(patience_s=0.005):
                message = TO_PARTICIPANT.validate_json(text)
                if isinstance(message, Seen):
                    self.seen.append(message)
                elif isinstance(message, Room):
                    self.is_in_room = message.is_there
            now, target = time.monotonic(), self.seen[-1].target_px if self.seen else None
            last = self.contacts[-1].t if self.contacts else 0.0
            if pressed and now - last > STAYS_S:
                pressed = False
                line.send(self.contacts[-1].model_copy(update={"t": now, "is_down": False}).model_dump_json())
            elif not pressed and target is not None and now - last > EVERY_S:
                pressed = True
                x, y = target[0] + OFF_PX[0], target[1] + OFF_PX[1]
                self.contacts.append(Contact(t=now, is_down=True, x_px=x, y_px=y, contact_px=width))
                line.send(self.contacts[-1].model_dump_json())
        line.close()
        self._listener.close()


def recorded_in(folder: Path) -> list[dict[str, Any]]:
    """Records of the task that the session has written, in order."""
    text = next(folder.glob("console-*.jsonl")).read_text(encoding="utf-8")
    rows = [json.loads(line) for line in text.splitlines()]
    return [row["message"] for row in rows if row["topic"] == TASK_TOPIC]


class Played(NamedTuple):
    """Rehearsed session whose participant was played at the page."""

    finished: bool
    result: StimulusResult
    records: list[dict[str, Any]]

    @property
    def recorded(self) -> list[dict[str, Any]]:
        """Touches that the session has recorded, in order."""
        return [record for record in self.records if record["kind"] == "touch"]

    @property
    def late_s(self) -> np.ndarray:
        """Recorded time of each touch after its contact [s]."""
        return self._recorded_s - [made.contact_s for made in self.result.made]

    @property
    def error_s(self) -> np.ndarray:
        """Recorded time of each touch after the panel has told it to the browser [s]."""
        return self._recorded_s - [made.sent_s for made in self.result.made]

    @property
    def _recorded_s(self) -> np.ndarray:
        return np.array([touch["t"] for touch in self.recorded])


def played(folder: Path, line: int) -> Played:
    """Run a session without a machine; the participant at this port is shown the page."""
    outcome, results, threads = list[SessionOutcome](), list[StimulusResult](), list[threading.Thread]()

    def say(text: str) -> None:
        if text.startswith("Open on the participant's screen"):
            options = StimulusOptions(link=text.split()[-1], line=line, chromium=CHROMIUM)
            threads.append(threading.Thread(target=lambda: results.append(run_stimulus(options, print)), daemon=True))
            threads[-1].start()

    def operate(link: str, is_ended: threading.Event) -> None:
        page = TerminalPage(link)
        try:
            session = TerminalSession(page, Keyboard(say, is_ended, True), resumes=False, awaits_page=True)
            outcome.append(session.run())
            threads[-1].join(30.0)
        finally:
            page.close()

    flight = RehearsedFlight(participants=("P-07",))
    flight._identify_s, flight._participant = 1.0, "P-07"
    trial = TrialRequest(folder, str(short_training(folder)), "P-07")
    run_console(Address(port=0, browser=False), folder, SessionController(flight), trial, say, operate)
    return Played(outcome[0].finished, results[0], recorded_in(folder))


@needs_chromium
@pytest.mark.slow
def test_every_touch_at_the_page_is_recorded_once_at_its_place_and_time(tmp_path: Path):
    finger, is_over = ScriptedFinger(), threading.Event()
    thread = threading.Thread(target=finger.run, args=(is_over,), daemon=True)
    thread.start()
    try:
        session = played(tmp_path, finger.port)
    finally:
        is_over.set()
        thread.join(30.0)
    assert session.finished
    assert finger.is_in_room
    assert session.result.is_complete
    assert len(session.recorded) == len(session.result.made) == len(finger.contacts) >= 4
    for touch, contact in zip(session.recorded, finger.contacts, strict=True):
        assert (touch["x_px"], touch["y_px"]) == pytest.approx((contact.x_px, contact.y_px), abs=1.0)
        assert (touch["deviation_x_px"], touch["deviation_y_px"]) == pytest.approx(OFF_PX, abs=1.0)
    began = session.records[0]
    assert began["kind"] == "run_began"
    assert began["pitch_mm"] == pytest.approx(2 * [SimulatedRoom().pitch_mm], rel=0.005)
    assert (began["participant"], began["session"], began["windows"]) == ("P-07", 1, 2)
    refuse_late(session.late_s)
    # The browser takes the panel's own time, not the time at which it comes to read the touch.
    print(f"recorded minus told: {1e3 * session.error_s.min():.2f} to {1e3 * session.error_s.max():.2f} ms")
    assert np.median(np.abs(session.error_s)) < 0.003


def wear(port: int, is_over: Any) -> None:
    """Let a simulated wearer point in real time, in a machine that only damps."""
    options = DriveSimOptions(level=LEVEL, seed=SEED, worn=True, person="virtual", line=port)
    laboratory = draw_laboratory(options.rig, options.side, options.level, options.seed)
    wearer = WearerBehindDrives(laboratory, load_protocol("training").settings, options)
    plant = Plant(wearer.twin, load_drives(DRIVES, laboratory.description))
    plant.before_step, plant.watch = wearer.act, wearer.feel
    for drive in plant.each:
        drive.enable(plant.now)
    due = time.monotonic()
    while not is_over.is_set():
        for drive in plant.each:
            drive.tell(0.0, DAMPING, plant.now)
        wearer.look()
        plant.step()
        due = max(due + wearer.twin.period_s, time.monotonic() - LAG_S)
        time.sleep(max(due - time.monotonic(), 0.0))
    wearer.close()


@needs_chromium
@pytest.mark.slow
def test_a_simulated_wearer_reaches_for_the_target_on_the_page_and_every_contact_is_recorded(tmp_path: Path):
    context, port = multiprocessing.get_context("spawn"), free_port()
    is_over = context.Event()
    process = context.Process(target=wear, args=(port, is_over), daemon=True)
    process.start()
    try:
        session = played(tmp_path, port)
    finally:
        is_over.set()
        process.join(30.0)
    assert session.finished
    assert session.result.is_complete
    assert len(session.recorded) == len(session.result.made) >= 2
    for touch, made in zip(session.recorded, session.result.made, strict=True):
        assert (touch["x_px"], touch["y_px"]) == pytest.approx((made.x_px, made.y_px), abs=1.0)
    assert {touch["window"] for touch in session.recorded} >= {1, 2}
    refuse_late(session.late_s)


def refuse_late(late_s: np.ndarray) -> None:
    """Print the error of the recorded times, and check it."""
    print(f"recorded minus contact: {1e3 * late_s.min():.1f} to {1e3 * late_s.max():.1f} ms of {len(late_s)} touches")
    assert late_s.min() > -0.02  # The clocks of page and server differ by less.
    assert late_s.max() < LATE_S


def test_a_missing_browser_is_named_with_what_to_do(tmp_path: Path):
    with pytest.raises(BrowserError, match="Install Chromium, or name it with --chromium"), chromium(tmp_path / "no"):
        pass
