"""Headline and tiles of the report."""

import numpy as np

from exograv.recording import Recording
from exograv.report.figures.touches import counted
from exograv.report.style.page import Tile
from exograv.study.targets import joint_groups, targets
from exograv.task.levels import LEVELS
from exograv.task.record_sinks import TASK_TOPIC

PLACES = {
    LEVELS["weightless"]: "weightless",
    LEVELS["moon"]: "as on the Moon",
    LEVELS["mars"]: "as on Mars",
    LEVELS["earth"]: "as on Earth",
    LEVELS["hyper"]: f"as in a pull-up at {LEVELS['hyper']} g",
}
"""Words by gravity level."""


def run_facts(recording: Recording) -> list[tuple[str, str]]:
    """Machine and settings of the run, as (name, value)."""
    settings = recording.settings
    level = settings.get("gravity_level")
    calibration = (settings.get("hashes") or {}).get("calibration")
    facts = [
        ("machine", settings.get("title") or settings.get("rig")),
        ("side", settings.get("side")),
        ("method", settings.get("method")),
        ("gravity level", None if level is None else gravity_words(float(level))),
        ("disturbance level", settings.get("disturbance_level")),
        ("world", settings.get("world")),
        ("seed", settings.get("seed")),
        ("calibration", None if calibration is None else f"stored, {calibration[:12]}…"),
    ]
    return [(name, str(value)) for name, value in facts if value is not None]


def gravity_words(level: float) -> str:
    """Gravity level as a number, with the place where it is felt."""
    return f"{level:g} ({PLACES[level]})" if level in PLACES else f"{level:g}"


def headline(recording: Recording) -> str:
    """Duration and left over in one sentence."""
    result = recording.last("/result")
    if not result:
        return _of_records(recording) or "The run was not completed; this report shows the recorded part."
    if (task := result.get("task") or {}).get("touches"):
        return _of_task(task)
    identification = result.get("identification") or {}
    seconds = identification.get("time_to_target_s")
    parts = _left_over_of_parts(recording)
    if not parts:
        return str(identification.get("outcome") or "The run is complete.")
    *first, last = (f"{value:.2f} N·m at the {part}" for part, (value, _) in parts.items())
    left = " and ".join((*([", ".join(first)] if first else ()), last))
    if seconds is not None and all(value <= goal for value, goal in parts.values()):
        return f"On target after {seconds:.0f} s of motion: {left} are left over."
    motion = identification.get("motion_s")
    return f"After {motion:.0f} s of motion {left} are left over." if motion is not None else f"Left over: {left}."


def _of_records(recording: Recording) -> str:
    """Sentence on a complete run of a session whose pages keep the result; empty without such a run."""
    records = [message["record"] for message in recording.messages(TASK_TOPIC)]
    if not any(record["kind"] == "run_ended" and record["is_complete"] for record in records):
        return ""
    touches = counted(recording)
    median = float(np.median([touch["deviation_px"] for touch in touches])) if touches else None
    closed = {one["window"] for one in records if one["kind"] == "window_closed" and one["is_complete"]}
    return _of_task({"windows": len(closed), "accepted": len(touches), "deviation_px": {"median": median}})


def _of_task(task: dict) -> str:
    median = task["deviation_px"]["median"]
    text = f"{task['windows']} windows, {task['accepted']} accepted touches"
    return f"{text}." if median is None else f"{text}: half of them within {median:.0f} px of the target's centre."


def tiles(recording: Recording) -> list[Tile]:
    """Return the tiles at the top, as far as the recording has their values.

    The examiner of a simulation measures the left over; the estimator only predicts it.
    """
    result = recording.last("/result")
    predicted = _predicted_of_parts(recording)
    found = [
        Tile(
            f"left over, {part}: true value",
            f"{value:.2f} N·m",
            f"{f'the estimator predicted {predicted[part]:.2f} N·m; ' if part in predicted else ''}"
            f"target {goal:g} N·m, worst axis",
            value <= goal,
        )
        for part, (value, goal) in _left_over_of_parts(recording).items()
    ]
    if (weight := result.get("known_weight") or {}).get("estimated_kg") is not None:
        found.append(_weight_tile(weight))
    if (floated := result.get("float") or {}).get("drift_deg") is not None:
        drift = float(np.max(np.abs(floated["drift_deg"])))
        note = f"in {floated['window_s']:g} s, worst joint; friction holds a still arm, so the left over says more"
        found.append(Tile("drift of the floated arm", f"{drift:.1f}°", note))
    return found


def _weight_tile(weight: dict) -> Tile:
    value, truth, interval = weight["estimated_kg"], weight.get("true_kg"), weight.get("ci95_kg")
    note = f"95 % interval: {interval[0]:.3f}–{interval[1]:.3f} kg" if interval else ""
    # The project's tolerance: 5 % or 30 g, whichever is larger.
    is_good = None if truth is None else abs(value - truth) <= max(0.05 * truth, 0.03)
    # As many decimals as in the terminal and in the figure, so that one weight has one form.
    return Tile(
        "weight in the hand", f"{value:.3f} kg", note if truth is None else f"true {truth:.3f} kg; {note}", is_good
    )


def _predicted_of_parts(recording: Recording) -> dict[str, float]:
    """Left over of the worst axis of each part of the arm that the last estimate predicted [N·m]."""
    predicted = recording.last("/estimate").get("predicted_left_over_Nm")
    if predicted is None:
        return {}
    values, goal = np.array(predicted), targets(recording)
    groups = joint_groups(recording.joints)
    return {part: float(values[max(axes, key=lambda k: values[k] / goal[k])]) for part, axes in groups.items()}


def _left_over_of_parts(recording: Recording) -> dict[str, tuple[float, float]]:
    """Left over (total) and target of the worst axis of each part of the arm [N·m], after identification."""
    total = (recording.last("/result").get("left_over_rms_Nm") or {}).get("total") or {}
    if not total:
        return {}
    values, goal = np.array(total.get("identified") or list(total.values())[-1]), targets(recording)
    worst = {
        part: max(axes, key=lambda k: values[k] / goal[k]) for part, axes in joint_groups(recording.joints).items()
    }
    return {part: (float(values[k]), float(goal[k])) for part, k in worst.items()}
