"""Self-test of the unworn machine, step by step; it ends at the first step that fails."""

from collections.abc import Callable, Sequence

from exograv.loop.pilot import Progress
from exograv.procedures.calibration.breakaway_checks import refuse_before_motion
from exograv.storage.self_test_step import Step, tried

from .bench import SelfTestRun, TestedMachine
from .motion_steps import hold_poses, nudge
from .rest_steps import listen, wake_guard
from .stops import press_stop, stop_feeding

Act = Callable[[SelfTestRun], list[Step]]


def first_look(bench: SelfTestRun) -> list[Step]:
    """Joints, drives and first readings, before any current flows."""
    refuse_before_motion(bench.description, bench.tree, bench.pilot.rig)
    return [Step("joints and first readings", True, "as in rig.toml", "as in rig.toml")]


ACTS: Sequence[tuple[str, Act]] = (
    ("joints and first readings", first_look),
    ("encoders and zeros at rest", listen),
    ("guard", wake_guard),
    ("sign of each joint", nudge),
    ("hold in three postures", hold_poses),
    ("Stop", press_stop),
    ("nobody commands", stop_feeding),
)
"""In this order: nothing is fed back before its sign is known, and nothing is stopped in motion before it is held."""


def test_machine(subject: TestedMachine, progress: Progress) -> tuple[list[Step], float]:
    """All of it on the empty machine; its steps, and how long the machine was busy [s]."""
    started = subject.rig.t
    bench = SelfTestRun(subject, progress)
    steps: list[Step] = []
    try:
        for name, act in ACTS:
            if all(step.passed for step in steps):
                steps += tried(name, lambda act=act: act(bench))
            else:
                steps.append(Step(name, None))
    finally:
        # By whatever way it ends, Ctrl-C too.
        bench.leave()
    return steps, subject.rig.t - started
