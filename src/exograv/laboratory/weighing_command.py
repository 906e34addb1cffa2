"""Weighing on the twin for `exograv arm weigh`: empty machine, twenty seconds with the wearer, arm, known weights."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from exograv.errors import ConfigError
from exograv.identification.core.arm_model import ArmModel
from exograv.loop.moved_machine import PilotedArm
from exograv.loop.pilot import Progress
from exograv.loop.run_settings import TwinRun
from exograv.model.anthropometry import Body
from exograv.model.arm import WeightPlace
from exograv.model.support import assemble
from exograv.next_command import calibration_command
from exograv.procedures.identification.controller_knowledge import MOTION_S
from exograv.procedures.weighing.arm_check import ArmCheck, ArmJudge, in_doubt_not_refused
from exograv.procedures.weighing.first_motion import first_motion
from exograv.procedures.weighing.known_weight import weigh
from exograv.procedures.weighing.motion_samples import SampleCollector
from exograv.procedures.weighing.options import WeighOptions
from exograv.procedures.weighing.weight_estimator import Weighing
from exograv.recording.rounding import rounded
from exograv.results import MERGED
from exograv.rig.twin import Twin
from exograv.rig.twin.wearer.parameter_truth import parameter_truth
from exograv.storage.self_test_pass import NOT_NEEDED

from .preparation import Preparation
from .result_rows import Interval, WeightRow
from .virtual_laboratory import VirtualLaboratory, driven_laboratory


@dataclass(frozen=True)
class PlacedWeight:
    """Weight that was put on the arm."""

    place: WeightPlace
    found: WeightRow = field(metadata=MERGED)


@dataclass(frozen=True)
class WeighResult:
    """Result of `exograv arm weigh`."""

    run: TwinRun = field(metadata=MERGED)
    typed_body_mass_kg: float
    arm_mass_kg: float | None
    ci95_kg: Interval | None
    arm_like_that_of_kg: float | None
    """Mass of a person with an equally heavy arm, by the table."""
    hand_weight_kg: float | None
    ci95_hand_kg: Interval | None
    ok: bool
    """False if the form is refused. The command then ends with exit status 1."""
    refused: bool
    why: str
    probability: float | None
    identified_s: float
    """Duration of the identification motion, which was evaluated together with the first twenty seconds [s]."""
    weights: list[PlacedWeight]
    true_arm_mass_kg: float
    self_test: str
    simulated_s: float
    wall_s: float


@dataclass
class _Found:
    """Estimates of the software, without knowledge of the twin's truth."""

    check: ArmCheck | None = None
    why: str = ""
    identified_s: float = 0.0
    weights: dict[WeightPlace, Weighing] = field(default_factory=dict)
    t: float = 0.0
    """The rig's clock at the end [s]."""


def run_weighing(options: WeighOptions, progress: Progress) -> WeighResult:
    """Weigh the arm on the twin, and then the known weights.

    Raises:
        ConfigError: An option is not valid.
        ModelError: Machine or wearer cannot be modelled.
        IdentificationError: The empty machine is not as expected.
        RigError: The envelope stopped the run, or the machine cannot carry a weight.
    """
    start = time.perf_counter()
    laboratory = driven_laboratory(options.rig, options.side, options.level, options.seed, options.world)
    own = laboratory.body
    typed = own.mass_kg if options.body_mass_kg is None else options.body_mass_kg
    found = _Found()
    try:
        body = Body(own.height_m, typed, own.sex, own.lengths_m)
    except ConfigError as error:
        found.why = str(error)  # The form is not valid. The machine has not moved yet.
    else:
        found.t = _weigh_all(options, laboratory, body, found, progress)
    return _result(options, laboratory, typed, found, start)


def _weigh_all(
    options: WeighOptions, laboratory: VirtualLaboratory, body: Body, found: _Found, progress: Progress
) -> float:
    """Fill `found`; return the rig's clock at the end [s]."""
    preparation = Preparation(laboratory, options.seed, progress)
    assembly = assemble(laboratory.description, body)
    worn = preparation.worn(preparation.calibrated(options.calibration, assembly, calibration_command(options)))
    twin, pilot, controller = worn.twin, worn.pilot, worn.controller
    model = ArmModel(worn.known.assembly, worn.known.machine)
    judge, gentle = ArmJudge(model), first_motion(pilot, controller, model)
    found.check = judge.judge([gentle], body.mass_kg)
    if is_enough(found.check, wants_weights=bool(options.weights)):
        return twin.t
    identifier, kept = worn.identifier(), SampleCollector()
    identifier.followers.append(kept)
    identified = worn.identify(identifier)
    arm, found.identified_s = identified.floated, MOTION_S
    both = judge.judge([gentle, kept.samples], body.mass_kg)
    found.check = in_doubt_not_refused(both, identified.restless_s is not None)
    if found.check.refused:
        return twin.t
    for place, mass in options.weights.items():
        found.weights[place] = weigh(PilotedArm(pilot, controller), model, arm, _hanging(twin, place, mass), place)
    return twin.t


def is_enough(check: ArmCheck, wants_weights: bool) -> bool:
    """Return True if the first motion is sufficient: no weight is to be weighed, or the form is surely wrong.

    A weight needs the identified arm. A doubtful form is judged again with the identification motion.
    """
    return check.is_sure and (check.refused or not wants_weights)


def _hanging(twin: Twin, place: WeightPlace, mass: float) -> Callable[[bool], None]:
    """Return the function with which the wearer takes the weight. The software has no access to the mass."""
    return lambda is_there: twin.hang(place, mass if is_there else 0.0)


def _result(
    options: WeighOptions, laboratory: VirtualLaboratory, typed: float, found: _Found, start: float
) -> WeighResult:
    check, hand = found.check, found.weights.get("hand")
    truth = parameter_truth(laboratory.wearer)
    limbs = [arm.side for arm in laboratory.wearer.arms]
    first = f"{limbs[0]}_" if len(limbs) > 1 else ""
    arm = sum(value for name, value in truth.items() if name.startswith(first) and name.endswith(".mass"))
    refused = check is None or check.refused
    return WeighResult(
        run=TwinRun(laboratory.description.name, options.level, options.world, options.seed),
        typed_body_mass_kg=round(typed, 2),
        arm_mass_kg=check and round(check.arm_mass, 4),
        ci95_kg=check and rounded(np.array(check.ci95)),
        arm_like_that_of_kg=check and round(check.like_kg, 1),
        hand_weight_kg=hand and round(hand.mass, 4),
        ci95_hand_kg=hand and rounded(np.array(hand.ci95)),
        ok=not refused,
        refused=refused,
        why=found.why if check is None else check.why,
        probability=check and round(check.probability, 4),
        identified_s=found.identified_s,
        weights=[
            PlacedWeight(place, WeightRow.of(options.weights[place], one)) for place, one in found.weights.items()
        ],
        true_arm_mass_kg=round(arm, 4),
        self_test=NOT_NEEDED,
        simulated_s=round(found.t, 3),
        wall_s=round(time.perf_counter() - start, 2),
    )
