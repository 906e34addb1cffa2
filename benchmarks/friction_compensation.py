"""Laws that return friction without a torque sensor, compared on one joint of the twin's own drives.

    python benchmarks/friction_compensation.py --level 2 --seeds 0-9 --save level2.json
    python benchmarks/friction_compensation.py --load level2.json

Each machine is drawn and calibrated as in `exograv demo`; a person practises a reach there and back, breaks the joint
away, swings it to and fro and lets it go. Medians over the machines; of what must not happen the worst.
"""

import argparse
import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from exograv import motion
from exograv.rig.twin.behaviour.acting import Nerves, Physiology
from exograv.rig.twin.behaviour.practice import Practice
from friction_calibrations import calibrated
from friction_candidates import CANDIDATES, KEPT, Candidate
from friction_joint import DT, LOADS, Circumstances, Hand, JointWorld

REACH_FROM, REACH_RAD, REACH_S, PAUSE_S = 0.5, np.deg2rad(40.0), 1.0, 0.5
REPETITIONS, COUNTED = 30, 4
RAMP_Nm_per_s, RAMP_S, BROKEN_AWAY_DEG = 4.0, 2.5, 0.2
SWINGS_RAD, SWING_S = (0.005, 0.01, 0.02, 0.03, 0.05, 0.2), 0.8
GRIP, GRIP_DAMPING = 2000.0, 20.0  # N·m/rad, N·m·s/rad: of a hand that swings the arm whatever the torque
PUSHES_Nm, PUSH_S, WATCH_S = (1.5, 4.0, -3.0, -7.0), 0.2, 5.0
CREEP_RAD_S, CREEP_S = 0.02, 3.0
CIRCUMSTANCES = {
    "as calibrated": Circumstances(),
    "warm": Circumstances(warmth=1.0),
    "friction 15 % too high": Circumstances(estimate=1.15),
    "friction 30 % too high": Circumstances(estimate=1.3),
    "friction 30 % too low": Circumstances(estimate=0.7),
}
COLUMNS = ("effort", "error", "gcm", "away", "back", "fed", "alone", "chatter")


def effort(world: JointWorld) -> tuple[float, float]:
    """∫|tau| dt of a practised reach there and back [N·m·s], and the largest error [°]."""
    load = world.load
    stops = [REACH_FROM, REACH_FROM + REACH_RAD, REACH_FROM]
    parts = [motion.hold(np.array([stops[0]]), PAUSE_S, DT)]
    for a, b in pairwise(stops):
        parts += [motion.minimum_jerk(np.array([a]), np.array([b]), REACH_S, DT)]
        parts += [motion.hold(np.array([b]), PAUSE_S, DT)]
    path = motion.joined(parts)
    body = Physiology(np.array([load.stiffness]), np.array([load.damping]), np.array([60.0]), Nerves(reflex_share=0.0))
    body = replace(body, muscle_lag=0.0)
    practice = Practice(path, body, np.array([[load.arm_inertia]]), np.zeros((len(path), 1)))
    world.start(REACH_FROM)
    efforts, errors = [], []
    for _ in range(REPETITIONS):
        anticipated = practice.anticipated[:, 0]
        trace = world.run(len(path), Hand(anticipated, path.q[:, 0], path.v[:, 0], load.stiffness, load.damping))
        error = path.q[:, 0] - trace.q_arm
        practice.repeated(error[:, None])
        efforts.append(np.abs(trace.tau_hand).sum() * DT)
        errors.append(np.rad2deg(np.abs(error).max()))
    return float(np.mean(efforts[-COUNTED:])), float(np.mean(errors[-COUNTED:]))


def breakaway(world: JointWorld, sign: float, *, after_the_other_way: bool) -> float:
    """Torque of the hand at which a resting joint begins to move [N·m]."""
    world.start(0.9)
    if after_the_other_way:
        t = np.arange(0.0, PUSH_S, DT)
        world.run(len(t), Hand(-8.0 * sign * np.sin(np.pi * t / PUSH_S)))
    world.run(round(1.0 / DT), Hand())
    ramp = sign * RAMP_Nm_per_s * np.arange(0.0, RAMP_S, DT)
    trace = world.run(len(ramp), Hand(ramp))
    moved = np.abs(trace.q - trace.q[0]) > np.deg2rad(BROKEN_AWAY_DEG)
    return float(np.abs(trace.tau_hand[np.argmax(moved)])) if moved.any() else np.inf


def fed_per_swing(world: JointWorld) -> float:
    """Energy that a hand gets which swings the arm, of the worst amplitude, over what is stored least [J]."""
    worst = -np.inf
    period = round(SWING_S / DT)
    omega = 2 * np.pi / SWING_S
    t = np.arange(3 * period) * DT
    for amplitude in SWINGS_RAD:
        world.start(0.9)
        q = world.run(1, Hand()).q_arm[0] + amplitude * np.sin(omega * t)
        trace = world.run(len(t), Hand(0.0, q, amplitude * omega * np.cos(omega * t), GRIP, GRIP_DAMPING))
        last = slice(-period, None)
        worst = max(worst, -float(np.dot(trace.tau_hand[last], trace.v_arm[last])) * DT)
    return worst


def alone(world: JointWorld) -> float:
    """What a joint that was pushed and let go still moves in the last seconds of the watch, of the worst push [°]."""
    worst = 0.0
    for push in PUSHES_Nm:
        world.start(0.9)
        world.run(round(PUSH_S / DT), Hand(push))
        trace = world.run(round(WATCH_S / DT), Hand())
        worst = max(worst, float(np.rad2deg(np.ptp(trace.q[-round(1.5 / DT) :]))))
    return worst


def chatter(world: JointWorld) -> float:
    """How much the returned torque goes up and down while the joint is led slowly [N·m/s]."""
    world.start(0.5)
    load, t = world.load, np.arange(0.0, CREEP_S, DT)
    slowly = Hand(0.0, 0.5 + CREEP_RAD_S * t, CREEP_RAD_S, 5 * load.stiffness, 3 * load.damping)
    trace = world.run(len(t), slowly)
    half = len(trace.q) // 2
    return float(np.abs(np.diff(trace.tau_returned[half:])).sum() / (CREEP_S / 2))


def measured(candidate: Candidate, level: int, seed: int, joint: int, now: Circumstances) -> dict[str, float]:
    """One law on one joint of one machine."""
    machine, known = calibrated(level, seed)
    world = JointWorld(machine, known, joint, candidate, now)
    with_arm, error = effort(world)
    without, _ = effort(JointWorld(machine, known, joint, candidate, replace(now, arm_share=0.0)))
    away = [breakaway(world, sign, after_the_other_way=False) for sign in (1.0, -1.0)]
    back = [breakaway(world, sign, after_the_other_way=True) for sign in (1.0, -1.0)]
    figures = (with_arm, error, without, max(away), max(back), fed_per_swing(world), alone(world), chatter(world))
    return dict(zip(COLUMNS, figures, strict=True))


def show(results: list[dict[str, object]]) -> None:
    """A table for each circumstance and joint."""
    for circumstance in dict.fromkeys(str(row["circumstance"]) for row in results):
        for joint in LOADS:
            rows = [r for r in results if r["circumstance"] == circumstance and r["joint"] == joint]
            if not rows:
                continue
            print(f"\nlevel {rows[0]['level']}, {circumstance}, {'elbow' if joint == 3 else 'shoulder'}, ", end="")
            print(f"{len({r['seed'] for r in rows})} machines")
            print(f"{'':22} effort  error    GCM DAM/GCM   away   back  fed mJ alone °  chatter")
            for name in dict.fromkeys(str(r["law"]) for r in rows):
                _show_law(name, [r["figures"] for r in rows if r["law"] == name])  # pyright: ignore[reportArgumentType] - as saved


def _show_law(name: str, figures: list[dict[str, float]]) -> None:
    of = {column: np.array([f[column] for f in figures]) for column in COLUMNS}
    ratio = np.median(of["effort"] / of["gcm"])
    m = {column: float(np.median(values)) for column, values in of.items()}
    print(f"{name:22} {m['effort']:6.2f} {m['error']:6.2f} {m['gcm']:6.2f} {ratio:7.2f} {m['away']:6.2f} ", end="")
    print(f"{m['back']:6.2f} {1e3 * of['fed'].max():7.2f} {of['alone'].max():7.3f} {m['chatter']:8.1f}")


def main() -> None:
    """Run or load, then show."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--level", type=int, default=2)
    parser.add_argument("--seeds", default="0-9")
    parser.add_argument("--laws", help="separated by commas; all where absent", default=",".join(CANDIDATES))
    parser.add_argument("--circumstances", default="as calibrated")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--load", type=Path, nargs="*")
    options = parser.parse_args()
    if options.load:
        show([row for path in options.load for row in json.loads(path.read_text())])
        return
    first, _, last = options.seeds.partition("-")
    laws = [KEPT if name == "kept" else name for name in options.laws.split(",")]
    results: list[dict[str, object]] = []
    for circumstance in options.circumstances.split(","):
        for name in laws:
            for seed in range(int(first), int(last or first) + 1):
                for joint in LOADS:
                    figures = measured(CANDIDATES[name], options.level, seed, joint, CIRCUMSTANCES[circumstance])
                    row = {"law": name, "level": options.level, "seed": seed, "joint": joint}
                    results.append(row | {"circumstance": circumstance, "figures": figures})
    if options.save:
        options.save.write_text(json.dumps(results, indent=1))
    show(results)


if __name__ == "__main__":
    main()
