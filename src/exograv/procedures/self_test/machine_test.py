"""Self-test of the unworn machine, step by step, until the first step that fails."""

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
    """Check joints, drives and first readings, before any current flows."""
    refuse_before_motion(bench.description, bench.tree, bench.pilot.rig)
    return [Step("joints and first readings", True, "as in rig.toml", "as in rig.toml")]


ACTS: Sequence[tuple[str, Act]] = (
    ("joints and first readings", first_look),
    ("encoders and zeros at rest", listen),
    ("guard", wake_guard),
    ("sign of each joint", nudge),
    ("hold in three postures", hold_poses),
    ("Stop", press_stop),
    ("no commands", stop_feeding),
)
"""Steps in their order: no feedback before the signs are known, and no stop in motion before the hold."""


def test_machine(subject: TestedMachine, progress: Progress) -> tuple[list[Step], float]:
    """Run all steps on the empty machine. Return the steps, and the time for which the machine was busy [s]."""
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
        # This runs after an error or Ctrl-C, too.
        bench.leave()
    return steps, subject.rig.t - started
