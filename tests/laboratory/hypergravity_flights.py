"""Figures of an identified arm in a machine with quasi-direct drives, at levels up to 1.8.

This is a script, so that shape checks do not slow the ticks.
"""

import json
from dataclasses import replace

import numpy as np

from exograv.laboratory.hypergravity import compare, felt_errors, fly_parabola
from exograv.laboratory.preparation import prepare
from exograv.laboratory.transparency import movement_for
from exograv.laboratory.transparency_trial import TransparencyTrial
from exograv.model.description import load_rig
from exograv.task.flight_profile import FlightProfile

SEED = 1021
"""Figures are reported on other seeds (docs/results/results.md)."""


def main() -> None:
    description = load_rig("recupera_like_qdd")
    trial, movement = TransparencyTrial(description, 2, SEED), movement_for("pointing", description)
    known = prepare(trial.laboratory(), SEED, lambda _text, _share: None)
    felt = felt_errors(trial, replace(known, x=1.2 * known.x), (0.0, 1.0, 1.8))
    pulled = compare(trial, known, 1.8, movement)
    flown = fly_parabola(trial, known, movement, FlightProfile(parabolas=1))
    step = np.diff(flown.t).mean()
    found = {
        "felt_Nm": [error.tolist() for error in felt.values()],
        "lowest": pulled.lowest,
        "keeps_path": bool(pulled.machine.keeps_path),
        "effort_Nms": [float(pulled.machine.absolute.sum()), float(pulled.room.absolute.sum())],
        "pulled_s": float((flown.level > 1.75).sum() * step),
        "weightless_s": float((flown.level < 0.01).sum() * step),
        "off_deg": flown.off_deg,
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
