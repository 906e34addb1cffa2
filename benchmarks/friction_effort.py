"""What returned friction is worth to a wearer who acts: muscle effort of the pointing movement on the full twin.

    python benchmarks/friction_effort.py --rig recupera_like --level 2 --seeds 0-4 --save effort.json
    python benchmarks/friction_effort.py --load effort.json

Machine and arm are calibrated and identified as in `exograv transparency`; then the wearer practises and performs with
the machine carried (GCM) and with the arm carried too (DAM), with no friction returned, half of it by speed, and as
`control` does. Effort is ∫|tau_muscle| dt summed over the arm's freedoms.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.control.returned_friction import CERTAINTY, WARMED
from exograv.dynamics.friction import Friction
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout
from exograv.laboratory.conditions import leave_the_arm
from exograv.laboratory.effort import Performer, UsedTo
from exograv.laboratory.movements import pointing
from exograv.laboratory.preparation import pilot_of, prepare
from exograv.laboratory.transparency_trial import UNREST, TransparencyTrial
from exograv.loop.arm_controller import ArmController
from exograv.loop.pilot import Controller
from exograv.model.description import load_rig
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig.twin import Twin
from exograv.rig.twin.behaviour.own_arm import OwnArm, worn_inertia
from exograv.signals import Reference

LAWS = ("nothing", "by speed 0.5", "kept")
SHARE, V_OFF, V_FULL = 0.5, 0.05, 0.10  # of the law by speed [-], [rad/s]
UNSURE = 1e3  # N·m: a standard deviation with which no friction is certain

Joints = Float[np.ndarray, " joint"]


class BySpeed:
    """`Controller` that adds half of Coulomb and viscous friction to another one's torque, none at low speed."""

    def __init__(self, controller: ArmController, coulomb: Joints, viscous: Joints):
        self._controller, self._coulomb, self._viscous = controller, coulomb, viscous

    @property
    def tau_feedforward(self) -> Joints:
        """What the model expects [N·m]."""
        return self._controller.tau_feedforward

    @property
    def closure_slope(self) -> float:
        """How far the loops are from closed [N·m]."""
        return self._controller.closure_slope

    @property
    def clearance(self) -> float:
        """How far the arm is from a singular posture [-]."""
        return self._controller.clearance

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Desired torque (joint,) [N·m]."""
        s = np.clip((np.abs(v) - V_OFF) / (V_FULL - V_OFF), 0.0, 1.0)
        returned = SHARE * (3 * s**2 - 2 * s**3) * (self._coulomb * np.sign(v) + self._viscous * v)
        return self._controller.step(q, v, reference) + returned


def without_return(machine: CalibratedMachine, viscous: Joints) -> CalibratedMachine:
    """So little is certain of its friction that `control` returns none."""
    sd = machine.friction_sd
    nothing: Friction = replace(sd, coulomb=np.full(len(viscous), UNSURE), viscous=WARMED / CERTAINTY * viscous)
    return replace(machine, friction_sd=nothing)


def performed(trial: TransparencyTrial, known: ControllerKnowledge, law: str, condition: str) -> dict[str, object]:
    """Effort of the pointing movement [N·m·s] and its error [°], by freedom of the arm."""
    laboratory = trial.laboratory(*UNREST)
    description, machine, wearer = laboratory.description, laboratory.machine, laboratory.wearer
    layout = ParameterLayout.of(known.assembly)
    coulomb, viscous = known.x[layout.coulomb], known.x[layout.viscous]
    believed = known.machine if law == "kept" else without_return(known.machine, viscous)
    twin = Twin(description, machine, wearer, trial.seed, t0=known.t)
    pilot = pilot_of(twin, known.machine.actuators, laboratory, lambda _text, _share: None)
    used_to = UsedTo(OwnArm(description, machine, wearer), worn_inertia(description, machine, wearer))
    movement = pointing(len(twin.truth.q_arm), twin.period_s)
    performer = Performer(pilot, twin, used_to, movement, lambda _share: None)
    carrying = ArmController(known.assembly, believed, known.x, twin.period_s)
    performer.go_to_start(carrying)
    if condition == "gcm":
        leave_the_arm(performer, carrying, twin.period_s)
    controller: Controller = BySpeed(carrying, coulomb, viscous) if law == "by speed 0.5" else carrying
    effort = performer.perform(controller, 0.0 if condition == "dam" else 1.0)
    return {"effort": effort.absolute.tolist(), "error": effort.tracking_deg.tolist()}


def show(results: list[dict[str, object]]) -> None:
    """Medians over the machines, by law; shares within each machine first."""
    for rig in dict.fromkeys(str(row["rig"]) for row in results):
        print(
            f"\n{rig}: median over machines of effort by freedom and in sum [N·m·s], share DAM / GCM, worst error [°]"
        )
        for law in LAWS:
            rows = [r for r in results if (r["rig"], r["law"]) == (rig, law)]
            if not rows:
                continue
            of = {c: np.array([r[c]["effort"] for r in rows]) for c in ("gcm", "dam")}  # pyright: ignore[reportIndexIssue, reportCallIssue, reportArgumentType] - as saved
            error = max(max(r[c]["error"]) for r in rows for c in of)  # pyright: ignore[reportIndexIssue, reportCallIssue, reportArgumentType] - as saved
            for condition, effort in of.items():
                row = " ".join(f"{value:7.1f}" for value in np.median(effort, axis=0))
                print(f"{law:14} {condition}  {row}  {np.median(effort.sum(axis=1)):7.1f}")
            share = np.median(of["dam"].sum(axis=1) / of["gcm"].sum(axis=1))
            by_freedom = " ".join(f"{value:7.2f}" for value in np.median(of["dam"] / of["gcm"], axis=0))
            print(f"{'':14}      {by_freedom}  {share:7.2f}   {len(rows)} machines, error {error:.2f}")


def main() -> None:
    """Run or load, then show."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rig", default="recupera_like")
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", default="0-4")
    parser.add_argument("--laws", help="separated by commas", default=",".join(LAWS))
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path, nargs="*")
    options = parser.parse_args()
    if options.load:
        show([row for path in options.load for row in json.loads(path.read_text())])
        return
    first, _, last = options.seeds.partition("-")
    results: list[dict[str, object]] = []
    for seed in range(int(first), int(last or first) + 1):
        trial = TransparencyTrial(load_rig(options.rig), options.level, seed)
        known = prepare(trial.laboratory(), seed, lambda _text, _share: None)
        for law in options.laws.split(","):
            of = {condition: performed(trial, known, law, condition) for condition in ("gcm", "dam")}
            results.append({"rig": options.rig, "level": options.level, "seed": seed, "law": law, **of})
            if options.save:
                options.save.write_text(json.dumps(results, indent=1))
    show(results)


if __name__ == "__main__":
    main()
