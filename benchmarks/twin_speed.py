"""Real-time factor of the twin and of the whole loop on this computer.

    python benchmarks/twin_speed.py

The twin alone: read, hold the current of the start, write. The loop: the same with the control law of the empty
machine, or with the general tick of a worn one, and with observer and envelope. The best of some rounds counts: other
load on the computer only adds time.
"""

import argparse
import time
from collections.abc import Callable

from exograv import motion
from exograv.control.exo_tick import ExoTick
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess
from exograv.rig.twin import Twin, Wearer
from exograv.safety.envelope import Envelope
from exograv.signals import Command


def real_time_factor(run: Callable[[], None], seconds: float) -> float:
    """Return simulated seconds per second of computing."""
    start = time.perf_counter()
    run()
    return seconds / (time.perf_counter() - start)


def main() -> None:
    """Print one line per case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--rig", default="recupera_like")
    options = parser.parse_args()
    laboratory = draw_laboratory(options.rig, None, 2, 0)
    cases = {
        f"{what}, {label}": make(laboratory, wearer, options.seconds)
        for what, make in (("twin alone", twin_alone), ("whole loop", whole_loop))
        for label, wearer in (("empty", None), ("worn", laboratory.wearer))
    }
    best = dict.fromkeys(cases, 0.0)
    for _ in range(options.rounds):
        for name, run in cases.items():
            best[name] = max(best[name], real_time_factor(run, options.seconds))
    for name, factor in best.items():
        print(f"{name}: {factor:.1f} x real time")


def twin_alone(laboratory: VirtualLaboratory, wearer: Wearer | None, seconds: float) -> Callable[[], None]:
    """Return a run of the twin held at rest."""
    twin = Twin(laboratory.description, laboratory.machine, wearer, 0)
    current = twin.read().current.copy()

    def run() -> None:
        for _ in range(round(seconds / twin.period_s)):
            state = twin.read()
            twin.write(Command(state.t, state.sequence, state.t + 1.0, current, current))

    return run


def whole_loop(laboratory: VirtualLaboratory, wearer: Wearer | None, seconds: float) -> Callable[[], None]:
    """Return a run of a pilot who holds the posture of the start."""
    assembly = laboratory.assembly()
    nominal = nominal_machine(laboratory.description, assembly.exo.phi)
    twin = Twin(laboratory.description, laboratory.machine, wearer, 0)
    if wearer is None:
        controller = ExoTick(laboratory.description, assembly.exo)
    else:
        controller = ArmController(assembly, nominal, table_guess(assembly, nominal), twin.period_s)
        controller.mode.drive = 1.0
    pilot = Pilot(twin, nominal.actuators, Envelope(limits(laboratory.description), twin.period_s))
    still = motion.hold(pilot.q.copy(), seconds, twin.period_s)
    return lambda: pilot.run(controller, still, "")


if __name__ == "__main__":
    main()
