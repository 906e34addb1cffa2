"""Session of the campaign: `exograv run live --simulate --real-time` with a prepared participant and hooks.

The command, its terminal, its signals and all its processes are the product's. Only the preparation is replaced: the
participant is known already, so that the arm floats after seconds, and the simulated drives belong to the campaign.
"""

import contextlib
import importlib
import os
import pickle
import runpy
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from datetime import datetime
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from exograv.live.live_control import LivePlan
from exograv.live.live_figures import live_figures
from exograv.live.live_flight import fly_plan, lesson_plan
from exograv.live.on_drives import float_command
from exograv.live.on_drives.float_command import FlownOnDrives
from exograv.live.options import LiveOptions, PersonForm
from exograv.loop.pilot import Progress
from exograv.rig.drives.opening import open_drives
from exograv.rig.drives.settings import load_drives
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.processes import spawn, supervisor
from exograv.runtime.ros2.bridging import Bridging, Ros2
from exograv.runtime.ros2.streaming import Streaming
from exograv.storage.self_test_pass import FILE as PASS
from exograv.storage.self_test_pass import MachineKey, write_pass

from . import hooks
from .cell import ORDERS, FlightOrders, Process
from .neighbours import STREAM
from .notes import write_note
from .participant import PreparedParticipant

SERIAL = "simulated drives of the process faults"


def main() -> None:
    """Run the command `exograv run live` with the instructions in the environment."""
    # A campaign in the background, or under nohup, hands on that it ignores Ctrl-C and SIGHUP. A terminal does not.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in (signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP):
        signal.signal(number, signal.SIG_DFL)
    orders = FlightOrders.read(Path(os.environ[ORDERS]))
    lines: dict[Process, Connection] = {}
    # The product takes this name from the module at each start of a process.
    setattr(supervisor, "spawned", partial(_spawned, lines))  # noqa: B010 - pyright refuses the plain assignment
    float_command.fly_on_drives = partial(fly_prepared, orders)
    # The command's own rooms are above this one; this process starts the command (`runpy` below) and prepares it here.
    vars(importlib.import_module("exograv.api.rig_factory")).update(simulated_wearer=lambda _options: None)
    _install_in_parent(orders, lines)
    # The drives of the campaign keep their own time, as real ones do: drives that wait would hide each gap.
    words = ["run", "live", "--simulate", "--real-time", "--identify", "10", "--out", orders.folder]
    sys.argv = ["exograv", *words, "--json", str(Path(orders.folder) / "live.json")]
    runpy.run_module("exograv.cli", run_name="__main__", alter_sys=True)


def fly_prepared(
    orders: FlightOrders, options: LiveOptions, _person: PersonForm, folder: Path, progress: Progress, *_: Any
) -> FlownOnDrives:
    """Fly the prepared participant on the campaign's simulated drives.

    Raises:
        RigError: As `fly_on_drives`.
    """
    known: PreparedParticipant = pickle.loads(Path(orders.participant).read_bytes())
    drives = load_drives(Path(orders.drives), known.description)
    key = MachineKey(folder / PASS, known.description, SERIAL, "")
    write_pass(key, datetime.now().astimezone())
    prepared, person = (known.unknown, known.anyone) if orders.motion_s else (known.prepared, known.person)
    with contextlib.ExitStack() as stack:
        period_s = drives.period_s
        lesson = lesson_plan(prepared, orders.motion_s, period_s, stack) if orders.motion_s else None
        machine, period_ns = partial(open_drives, drives), round(1e9 * period_s)
        plan = LivePlan(known.description, known.form, prepared, person, 0.0, machine, period_ns, lesson, key)
        listening = stack.enter_context(Listening((STREAM,))) if orders.has(Process.LSL) else None
        ros2 = Bridging(Ros2(orders.router), known.description.joints) if orders.has(Process.ROS2) else None
        lsl = Streaming(None, listening, ros2)
        if orders.has(Process.CONSOLE):
            stack.enter_context(_pages(folder))
        flown = fly_plan(
            plan, orders.seconds, folder / "live.mcap", {}, progress, lambda _: None, is_tested=True, lsl=lsl
        )
    figures = live_figures(options.rig, flown, None, prepared, "passed", lsl, listening, machine=SERIAL)
    return FlownOnDrives(flown, figures, prepared, None, None, known.form.body, SERIAL, from_file=False)


def _spawned(
    lines: dict[Process, Connection], name: str, target: Callable[[Any, Connection], object], job: object, **named: bool
) -> tuple[BaseProcess, Connection]:
    """Start a process as the product does, with the hook of the campaign around its target."""
    process, line = spawn.spawned(name, partial(hooks.struck_target, name, target), job, **named)
    lines[hooks.NAMES.get(name) or Process(name)] = line
    return process, line


def _install_in_parent(orders: FlightOrders, lines: dict[Process, Connection]) -> None:
    write_note(orders.folder, "process", name=Process.PARENT, pid=os.getpid())
    hooks.install(orders, Process.PARENT, lines.get)


@contextlib.contextmanager
def _pages(folder: Path) -> Iterator[None]:
    """Run the process of the pages as a child of this one, as `exograv run console` does, over a rehearsed desk.

    This room may not import those of the console, so this process loads them as the command would.
    """
    supervisor_, page, options, serve, trial, rehearsal, session = (
        importlib.import_module(f"exograv.{name}")
        for name in (
            "console.page_supervisor", "console.page_process", "console.options", "console.serve",
            "console.trial_request", "experiment.steered.rehearsal", "experiment.steered.session_controller",
        )
    )  # fmt: skip
    desk, is_over = session.SessionController(rehearsal.RehearsedFlight()), threading.Event()
    address = options.Address(port=0, browser=False)
    with serve.bound(address) as (listening, host):
        write_note(folder, "page", host=host)

        def job(link: Any) -> Any:
            return page.PageJob(
                link.names, address, listening, host, folder / "console.jsonl", trial.TrialRequest(folder, None),
                bytes(32), supervisor_.new_token(),
            )  # fmt: skip

        pages = supervisor_.PageSupervisor(desk, job, False, lambda line: print(line, flush=True))
        thread = threading.Thread(target=pages.run, args=(is_over,))
        thread.start()
        try:
            yield
        finally:
            is_over.set()
            thread.join()
            pages.end()
            desk.close()


if __name__ == "__main__":
    main()
