"""Note before an arm is identified with a motion that is not designed for the machine."""


def say_motion(rig: str | None) -> None:
    """Print that the motion of the machine is only proposed; nothing if it is designed."""
    from exograv.cli.shell.terminal import say
    from exograv.procedures.machine_tools.design_motion import motion_note

    note = None if rig is None else motion_note(rig)
    if note is not None:
        say(f"Note: {note}")
