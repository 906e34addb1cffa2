"""Notes before a run: a motion that is not designed for the machine, and a machine that is drawn from its twin."""


def say_motion(rig: str | None) -> None:
    """Print that the motion of the machine is only proposed; nothing if it is designed."""
    from exograv.cli.shell.terminal import say
    from exograv.procedures.machine_tools.design_motion import motion_note

    note = None if rig is None else motion_note(rig)
    if note is not None:
        say(f"Note: {note}")


def say_twin(twin: str) -> None:
    """Print that the machine is a draw from its fitted twin; nothing of a machine that is not."""
    from exograv.cli.shell.terminal import say

    if twin == "fitted":
        say("Machine: a draw from the posterior in its twin.toml. Another --seed draws another machine.")
