"""The machine and `--simulate` mean the same in every command, and former spellings still work."""

from dataclasses import fields
from inspect import get_annotations
from typing import Any, get_type_hints

import pytest
import tyro

from exograv.cli import ACTIONS
from exograv.cli.shell.command import command_class, option_classes, refuse_idle
from exograv.cli.shell.spellings import has_machine, present_spelling
from exograv.errors import ConfigError
from exograv.options import RIG_HELP, SIMULATE_HELP

CONFIG = (tyro.conf.OmitSubcommandPrefixes, tyro.conf.SuppressFixed)
NEEDED = {"rig new": ["x.urdf"], "data replay": ["x.mcap"]}
MACHINE_COMMANDS = sorted(path for path, action in ACTIONS.items() if has_machine(command_class(action)))
WITH_DRIVES = sorted(path for path, action in ACTIONS.items() if hasattr(command_class(action), "drives"))


def parsed(path: str, *words: str) -> Any:
    kind = command_class(ACTIONS[path])
    return tyro.cli(kind, args=present_spelling(kind, list(words)), config=CONFIG)


def help_of(kind: type, name: str) -> list[str]:
    marks = getattr(get_type_hints(kind, include_extras=True)[name], "__metadata__", ())
    return [mark.help for mark in marks if getattr(mark, "help", None)]


def test_every_group_for_machines_and_arms_takes_the_machine_first():
    others = {"rig new", "arm identify-log", "doctor", "rigs", "report"}
    expected = {path for path in ACTIONS if path.split()[0] in ("demo", "rig", "arm", "run")} - others
    assert expected | {"next", "dev transparency", "dev drive-sim"} == set(MACHINE_COMMANDS)


@pytest.mark.parametrize("path", MACHINE_COMMANDS)
def test_the_machine_is_the_first_word_or_the_value_of_its_former_option(path: str):
    spellings = (["mine", "--json", "f"], ["--json", "f", "mine"], ["--json", "f", "--rig", "mine"], ["--rig=mine",
                 "--json=f"])  # fmt: skip
    assert {parsed(path, *words).rig for words in spellings} == {"mine"}


@pytest.mark.parametrize("path", MACHINE_COMMANDS)
def test_the_machine_has_a_default_and_one_help_text(path: str):
    kind = command_class(ACTIONS[path])
    assert all(text.startswith(RIG_HELP) for text in help_of(kind, "rig"))
    assert parsed(path).rig in (None, "recupera_like", "recupera_like_qdd", "recupera_like_dual")


@pytest.mark.parametrize("path", sorted(ACTIONS))
def test_simulate_exists_exactly_beside_drives_and_has_one_help_text(path: str):
    kind = command_class(ACTIONS[path])
    if path == "dev drive-sim":  # Its drives are the simulated ones.
        assert not hasattr(kind, "simulate")
        return
    assert hasattr(kind, "simulate") == hasattr(kind, "drives")
    if hasattr(kind, "simulate"):
        assert help_of(kind, "simulate") == [SIMULATE_HELP]
        declared = [cls for cls in kind.__mro__ if "simulate" in get_annotations(cls)]
        assert [cls.__name__ for cls in declared] == ["MachineOptions"]


@pytest.mark.parametrize("path", MACHINE_COMMANDS)
def test_every_machine_command_accepts_simulate(path: str):
    assert getattr(parsed(path, "--simulate"), "simulate", True)


def test_the_bus_of_simulated_drives_may_still_be_the_first_word():
    assert parsed("dev drive-sim", "canopen", "--rig", "mine").bus == "canopen"
    assert parsed("dev drive-sim", "mine", "--bus", "moteus").rig == "mine"


def test_a_recording_is_no_machine_so_its_command_keeps_the_option():
    assert parsed("data replay", "x.mcap", "--rig", "mine").rig == "mine"


@pytest.mark.parametrize("path", sorted(ACTIONS))
def test_no_command_refuses_its_own_defaults(path: str):
    kind = command_class(ACTIONS[path])
    flat: Any = kind
    refuse_idle(flat(**{field.name: "x" for field in fields(kind) if field.default is tyro.MISSING}))


def test_an_option_without_effect_is_refused_by_name():
    with pytest.raises(ConfigError, match="--level is 3, but it acts only on a simulated machine"):
        refuse_idle(parsed("run live", "--drives", "d.toml", "--level", "3"))
    refuse_idle(parsed("run live", "--drives", "d.toml", "--simulate", "--level", "3"))
    with pytest.raises(ConfigError, match="RIG is mine, but it acts only without --recording"):
        refuse_idle(parsed("run support-level", "mine", "--recording", "r.mcap"))


def test_every_option_class_is_frozen_so_that_a_command_cannot_change_what_was_asked():
    kinds = {kind for action in ACTIONS.values() for kind in option_classes(action).values()}
    assert all(kind.__dataclass_params__.frozen for kind in kinds)
