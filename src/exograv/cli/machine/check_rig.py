"""Command `exograv rig check` and the printout of its result."""

from typing import TYPE_CHECKING, Any

from exograv.cli.shell.base_options import OutFolder
from exograv.procedures.machine_tools.options import CheckOptions

if TYPE_CHECKING:
    from exograv.procedures.machine_tools.check_rig.check_result import CheckResult


def run_check_rig(options: CheckOptions, common: OutFolder) -> "CheckResult":
    """Check a machine's folder: missing answers, support by the cuffs, reach, and the largest arm that it can carry."""
    from exograv.cli.shell.terminal import bars
    from exograv.procedures.machine_tools.check_rig import check_rig

    with bars() as progress:
        result = check_rig(options, common.out, progress)
    _show(result, options.rig)
    return result


def _show(result: "CheckResult", rig: str) -> None:
    from rich.console import Console
    from rich.markup import escape

    from exograv.cli.shell.terminal import say
    from exograv.model.description import rig_names

    console = Console()
    if result.largest_arm_kg is not None:
        _show_mechanics(result, console)
    for problem in result.problems:
        console.print(f"[bold red]Problem:[/] {escape(problem)}")
    for note in result.notes:
        console.print(f"[bold]Note:[/] {escape(note)}")
    if result.picture is not None:
        console.print(f"Picture: {result.picture}", soft_wrap=True)
    if result.ok:
        console.print("[bold green]The machine has no problems.[/]")
        say(f"Next: `exograv data view {rig}` shows it with a person.")
        if any(row.limit is not None for row in result.torque_Nm or []):
            if rig not in rig_names():
                # A calibration is valid for one rig.toml: a motion that is pasted later would need another one.
                say(
                    f"`exograv rig motion {rig} --write` designs its motion for the identification, before calibration."
                )
            say(f"`exograv rig test {rig} --simulate` practises to bring up its drives.")
    else:
        count = len(result.problems)
        console.print(f"{count} {'problem remains' if count == 1 else 'problems remain'} in {escape(result.rig)}.")
        say(f"Next: correct its rig.toml, then run `exograv rig check {rig}` again.")


def _show_mechanics(result: "CheckResult", console: Any) -> None:
    from rich.table import Table

    from exograv.cli.shell.terminal import NARROW

    is_narrow = console.width < NARROW
    title = f"{result.rig}, {result.side}: torque at rest, worst posture of the task workspace, N·m"
    table = Table(title=title, box=None, padding=(0, 1, 0, 0)) if is_narrow else Table(title=title)
    for name in ("joint", "machine", "arm", "1 kg in hand", "friction", "drive"):
        # A narrow terminal breaks words instead of cutting them off.
        heading = name.replace("friction", "fric-\ntion").replace("1 kg in ", "1 kg\nin\n") if is_narrow else name
        justify, width = ("left", 9) if name == "joint" else ("right", 4)
        table.add_column(heading, justify=justify, min_width=width, overflow="fold")
    for row in result.torque_Nm or []:
        limit = "no motor" if row.limit is None else f"{row.limit:g}"
        numbers = (f"{value:.1f}" for value in (row.exo, row.arm, row.hand_1kg, row.friction))
        table.add_row(row.joint.replace("_", "\n" if is_narrow else " "), *numbers, limit)
    console.print(table)
    conditioning, loops, softest = result.conditioning, result.loops, result.softest
    if conditioning is None or loops is None or softest is None or result.workspace is None:
        return
    reach = "; ".join(f"{arm.side} {arm.volume_m3:.2f} m³, up to {arm.furthest_m:.2f} m" for arm in result.workspace)
    margin = conditioning.singular_beyond_task_deg
    singular = "none within the limits" if margin is None else f"the nearest {margin:g}° outside it"
    console.print(
        f"The cuffs support {result.rank} of {result.human_dof} freedoms, {softest.freedom} most softly "
        f"({softest.Nm_per_rad:.1f} N·m/rad); strain in the task workspace at most {loops.stretch_mm:.1f} mm and "
        f"{loops.turn_deg:.1f}°.\n"
        f"Reach of the fingertip: {reach}.\n"
        f"Conditioning in the task workspace at least {conditioning.worst_in_task:.2f}; singular postures: "
        f"{singular}.\n"
        f"Largest arm with 1 kg in the hand: {result.largest_arm_kg:.1f} kg; the arm of this wearer weighs "
        f"{result.wearer_arm_kg:.1f} kg."
    )
