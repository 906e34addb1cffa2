"""Gravity levels up to 1.8 in the machine, against a room with that gravity, and a parabola on the ground.

    python benchmarks/hypergravity.py --seeds 0-4

Per wearer: error of what the arm feels (worst shoulder axis / elbow [N·m], RMS over held-out postures) at levels 0, 1
and 1.8; muscle torque of a pointing movement in the machine over that in a room of the same gravity, at levels 1 and
1.8; and a parabola 1, 1.8, 0, 1.8, 1, in which the person holds the hand still: times above 1.75 and below 0.05 [s],
largest distance from the held posture [°], and largest change of the commanded torque [N·m/s]. Muscles have no unrest.
"""

import argparse

import numpy as np

from exograv.errors import ExogravError
from exograv.laboratory.hypergravity import compare, felt_errors, fly_parabola
from exograv.laboratory.preparation import prepare
from exograv.laboratory.transparency import movement_for
from exograv.laboratory.transparency_trial import TransparencyTrial
from exograv.model.description import load_rig
from exograv.task.flight_profile import FlightProfile
from seeds import seed_range

LEVELS, COMPARED = (0.0, 1.0, 1.8), (1.0, 1.8)
HEADS = (
    "machine", "seed", "felt error at 0, 1, 1.8", "muscle torque, machine / room, at 1, 1.8",
    "parabola: s at 1.8, s at 0, off °, N·m/s",
)  # fmt: skip


def row(rig: str, level: int, seed: int) -> list[str]:
    """Return the figures of one wearer."""
    description = load_rig(rig)
    movement, trial = movement_for("pointing", description), TransparencyTrial(description, level, seed)
    known = prepare(trial.laboratory(), seed, lambda _text, _share: None)
    errors = felt_errors(trial, known, LEVELS)
    ratios = []
    for felt in COMPARED:
        found = compare(trial, known, felt, movement)
        ratio = found.machine.absolute.sum() / found.room.absolute.sum()
        is_kept = found.machine.keeps_path and found.room.keeps_path
        ratios.append(f"{ratio:.3f}{'' if is_kept else ' (path not kept)'}")
    flown = fly_parabola(trial, known, movement, FlightProfile(parabolas=1))
    step = float(np.diff(flown.t).mean())
    parts = (flown.level > 1.75).sum() * step, (flown.level < 0.05).sum() * step, flown.off_deg, flown.rate_Nm_per_s
    return [
        rig,
        str(seed),
        ", ".join(f"{error[:3].max():.2f} / {error[3]:.2f}" for error in errors.values()),
        ", ".join(ratios),
        ", ".join(f"{part:.1f}" for part in parts),
    ]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0-4")
    parser.add_argument("--level", type=int, default=2, help="disturbance level")
    parser.add_argument("--rigs", default="recupera_like,recupera_like_qdd")
    options = parser.parse_args()
    print(f"| {' | '.join(HEADS)} |\n{'|---' * len(HEADS)}|", flush=True)
    for rig in options.rigs.split(","):
        for seed in seed_range(options.seeds):
            try:
                print(f"| {' | '.join(row(rig, options.level, seed))} |", flush=True)
            except ExogravError as error:
                print(f"| {rig} | {seed} | {error} |", flush=True)


if __name__ == "__main__":
    main()
