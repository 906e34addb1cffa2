"""How much faster than real time the twin and the whole loop are on this computer.

    python benchmarks/twin_speed.py --seconds 10

The twin alone: read, hold the start's current, write. The loop: the same with the general tick, observer and envelope.
"""

import argparse
import platform
import time
from collections.abc import Callable

import numpy as np

from exograv import motion
from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer
from exograv.safety.envelope import Envelope
from exograv.session.arm_controller import ArmController
from exograv.session.identify import table_guess
from exograv.session.nominal import nominal_machine
from exograv.session.outcome import percentiles
from exograv.session.pilot import Pilot
from exograv.session.virtual import draw_laboratory, limits
from exograv.signals import Command


def real_time_factor(run: Callable[[], None], seconds: float) -> float:
    """Simulated seconds per second."""
    start = time.perf_counter()
    run()
    return seconds / (time.perf_counter() - start)


def main() -> None:
    """Print one line a case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=10.0)
    options = parser.parse_args()
    laboratory = draw_laboratory("recupera_like", "right", 2, 0)
    description = laboratory.description
    disturbances = Disturbances.at_level(2)
    machine = draw_machine(description, disturbances, 0)
    ticks = round(options.seconds / 1e-3)
    for label, wearer in (("empty", None), ("worn", draw_wearer(disturbances, 0))):
        twin = Twin(description, machine, wearer, 0)
        current = twin.read().current.copy()

        def alone(twin: Twin = twin, current: np.ndarray = current) -> None:
            for _ in range(ticks):
                state = twin.read()
                twin.write(Command(state.t, state.sequence, state.t + 1.0, current, current))

        print(f"twin alone, {label}: {real_time_factor(alone, options.seconds):.1f} x real time")
    assembly = laboratory.assembly()
    nominal = nominal_machine(description, assembly.exo.phi)
    twin = Twin(description, machine, laboratory.wearer, 0)
    controller = ArmController(assembly, nominal, table_guess(assembly, nominal), twin.period_s)
    controller.mode.drive = 1.0
    pilot = Pilot(twin, nominal.actuators, Envelope(limits(description), twin.period_s))
    still = motion.hold(pilot.q.copy(), options.seconds, twin.period_s)
    factor = real_time_factor(lambda: pilot.run(controller, still, ""), options.seconds)
    print(f"whole loop, worn: {factor:.1f} x real time; tick {percentiles(pilot.tick_us)} µs; {platform.processor()}")


if __name__ == "__main__":
    main()
