"""`exograv weigh` on the twin: the empty machine, twenty seconds with the wearer, the arm, then known weights."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from exograv.errors import ConfigError
from exograv.identification.core.arm_model import ArmModel
from exograv.loop.pilot import Progress
from exograv.model.anthropometry import Body
from exograv.model.arm import WeightPlace
from exograv.model.support import assemble
from exograv.procedures.identification.controller_knowledge import MOTION_S
from exograv.procedures.weighing.arm_check import ArmCheck, ArmJudge
from exograv.procedures.weighing.first_motion import first_motion
from exograv.procedures.weighing.known_weight import weigh
from exograv.procedures.weighing.motion_samples import SampleCollector
from exograv.procedures.weighing.weight_estimator import Weighing
from exograv.rig.twin import Twin
from exograv.rig.twin.wearer.parameter_truth import parameter_truth
from exograv.storage.self_test_pass import NOT_NEEDED

from .options import WeighOptions
from .preparation import Preparation
from .virtual_laboratory import VirtualLaboratory, driven_laboratory

DRAWN_KG = (0.5, 1.0, 1.5, 2.0)
RESTLESS_TEXT = "The person does not relax: the form cannot be checked. Ask the person to let go, then repeat."


@dataclass
class _Found:
    """What the software says."""

    check: ArmCheck | None = None
    why: str = ""
    identified_s: float = 0.0
    """Motion of the identification that was asked beside the first twenty seconds."""
    weights: dict[WeightPlace, Weighing] = field(default_factory=dict)


def run_weighing(options: WeighOptions, progress: Progress) -> dict[str, Any]:
    """Run it; the result follows the contract of `exograv weigh --json`.

    Raises:
        ConfigError: An option cannot be used.
        ModelError: Machine or wearer cannot be modelled.
        IdentificationError: The empty machine is not what it should be.
        RigError: The envelope stopped the run, or the machine cannot carry a weight.
    """
    start = time.perf_counter()
    laboratory = driven_laboratory(options.rig, options.side, options.level, options.seed)
    own = laboratory.body
    typed = own.mass_kg if options.body_mass_kg is None else options.body_mass_kg
    found, t = _Found(), 0.0
    try:
        body = Body(own.height_m, typed, own.sex, own.lengths_m)
    except ConfigError as error:
        found.why = str(error)  # the form itself refuses: nothing has moved yet
    else:
        t = _weigh_all(options, laboratory, body, found, progress)
    result = _figures(options, laboratory, typed, found)
    return {**result, "simulated_s": round(t, 3), "wall_s": round(time.perf_counter() - start, 2)}


def _weigh_all(
    options: WeighOptions, laboratory: VirtualLaboratory, body: Body, found: _Found, progress: Progress
) -> float:
    """Fill `found`; return the rig's clock at the end [s]."""
    preparation = Preparation(laboratory, options.seed, progress)
    worn = preparation.worn(preparation.calibrated(options.calibration, assemble(laboratory.description, body)))
    twin, pilot, controller = worn.twin, worn.pilot, worn.controller
    model = ArmModel(worn.known.assembly, worn.known.machine)
    judge, gentle = ArmJudge(model), first_motion(pilot, controller, model)
    found.check = judge.judge([gentle], body.mass_kg)
    if is_enough(found.check, wants_weights=bool(weights_of(options))):
        return twin.t
    identifier, kept = worn.identifier(), SampleCollector()
    identifier.followers.append(kept)
    identified = worn.identify(identifier)
    arm, found.identified_s = identified.last, MOTION_S
    both = judge.judge([gentle, kept.samples], body.mass_kg)
    found.check = in_doubt_not_refused(both, identified.restless_s is not None)
    if found.check.refused:
        return twin.t
    for place, mass in weights_of(options).items():
        found.weights[place] = weigh(pilot, controller, model, arm, _hanging(twin, place, mass), place)
    return twin.t


def is_enough(check: ArmCheck, wants_weights: bool) -> bool:
    """Whether the first motion is all that is needed: nothing is to be weighed, or the form is surely wrong.

    A weight needs the arm identified first; a doubtful form is asked of that motion too.
    """
    return check.is_sure and (check.refused or not wants_weights)


def in_doubt_not_refused(check: ArmCheck, is_restless: bool) -> ArmCheck:
    """The verdict, unless a doubtful one rests on the torques of a person who does not relax: then a request."""
    if check.is_sure or not is_restless:
        return check
    return replace(check, refused=False, why=f"{RESTLESS_TEXT} {check.why}")


def _hanging(twin: Twin, place: WeightPlace, mass: float) -> Callable[[bool], None]:
    """The wearer's part: the software never sees the mass."""
    return lambda is_there: twin.hang(place, mass if is_there else 0.0)


def _figures(options: WeighOptions, laboratory: VirtualLaboratory, typed: float, found: _Found) -> dict[str, Any]:
    check, hand = found.check, found.weights.get("hand")
    truth = parameter_truth(laboratory.wearer)
    limbs = [arm.side for arm in laboratory.wearer.arms]
    first = f"{limbs[0]}_" if len(limbs) > 1 else ""
    arm = sum(value for name, value in truth.items() if name.startswith(first) and name.endswith(".mass"))
    return {
        "rig": laboratory.description.name,
        "disturbance_level": options.level,
        "seed": options.seed,
        "typed_body_mass_kg": round(typed, 2),
        "arm_mass_kg": None if check is None else round(check.arm_mass, 4),
        "ci95_kg": None if check is None else _interval(check.ci95),
        "arm_like_that_of_kg": None if check is None else round(check.like_kg, 1),
        "hand_weight_kg": None if hand is None else round(hand.mass, 4),
        "ci95_hand_kg": None if hand is None else _interval(hand.ci95),
        "refused": check is None or check.refused,
        "why": found.why if check is None else check.why,
        "probability": None if check is None else round(check.probability, 4),
        "identified_s": found.identified_s,
        "weights": [
            {
                "place": place,
                "true_kg": weights_of(options)[place],
                "estimated_kg": round(one.mass, 4),
                "ci95_kg": _interval(one.ci95),
            }
            for place, one in found.weights.items()
        ],
        "true_arm_mass_kg": round(arm, 4),
        "self_test": NOT_NEEDED,
    }


def _interval(interval: tuple[float, float]) -> list[float]:
    return [round(value, 4) for value in interval]


def weights_of(options: WeighOptions) -> dict[WeightPlace, float]:
    """Weights on the arm [kg]; the one in the hand is one of `DRAWN_KG` by the seed where the options name none."""
    drawn = float(np.random.default_rng([options.seed, 9]).choice(DRAWN_KG))
    hand = drawn if options.hand_weight_kg is None else options.hand_weight_kg
    both: dict[WeightPlace, float] = {"hand": hand, "forearm": options.forearm_weight_kg}
    return {place: mass for place, mass in both.items() if mass > 0.0}
