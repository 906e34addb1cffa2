"""The description of a computer is what its system states, and unknown properties stay empty."""

from dataclasses import replace
from pathlib import Path

import pytest

from exograv.runtime.clock.host import cpu_list, loop_cpus, read_host


def write(root: Path, path: str, text: str) -> None:
    """Write a file of a simulated system."""
    file = root / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)


def test_a_system_that_states_nothing_is_taken_for_an_ordinary_one(tmp_path: Path):
    host = read_host(tmp_path)
    assert not host.is_virtual
    assert host.isolated_cpus == ()
    assert host.governors == ()
    assert host.clock_source == ""


def test_a_hypervisor_is_found_by_the_processor_s_flag(tmp_path: Path):
    write(tmp_path, "proc/cpuinfo", "processor\t: 0\nflags\t\t: fpu vme hypervisor lahf_lm\n")
    assert read_host(tmp_path).is_virtual


def test_a_word_that_only_begins_like_the_flag_is_not_the_flag(tmp_path: Path):
    write(tmp_path, "proc/cpuinfo", "model name\t: hypervisor\nflags\t\t: fpu hypervisorless\n")
    assert not read_host(tmp_path).is_virtual


@pytest.mark.parametrize("path", ["sys/hypervisor/type", "proc/device-tree/hypervisor/compatible"])
def test_a_hypervisor_that_announces_itself_is_believed(tmp_path: Path, path: str):
    write(tmp_path, path, "xen\n")
    assert read_host(tmp_path).is_virtual


def test_a_realtime_kernel_is_known_by_its_own_file(tmp_path: Path):
    write(tmp_path, "sys/kernel/realtime", "1\n")
    assert read_host(tmp_path).is_realtime_kernel


def test_policies_of_all_processors_are_seen(tmp_path: Path):
    for cpu, governor in enumerate(["performance", "powersave"]):
        write(tmp_path, f"sys/devices/system/cpu/cpu{cpu}/cpufreq/scaling_governor", governor + "\n")
    write(tmp_path, "sys/devices/system/cpu/isolated", "1\n")
    host = read_host(tmp_path)
    assert host.governors == ("performance", "powersave")
    assert host.isolated_cpus == (1,)


@pytest.mark.parametrize(("text", "cpus"), [("", ()), ("3", (3,)), ("1,4-6", (1, 4, 5, 6)), ("0-1,7", (0, 1, 7))])
def test_lists_of_processors_are_read_as_the_kernel_writes_them(text: str, cpus: tuple[int, ...]):
    assert cpu_list(text) == cpus


@pytest.mark.parametrize(
    ("cpus", "isolated", "found"),
    [
        ((0,), (), (0, 0)),
        ((0, 1), (), (1, 0)),
        ((0, 1, 2, 3), (), (3, 2)),
        ((0, 1, 2), (3,), (3, 2)),
        ((0, 1), (2, 3), (2, 3)),
        ((0, 1, 2, 3), (1,), (1, 3)),
    ],
)
def test_guard_and_control_share_a_processor_only_where_there_is_one(
    cpus: tuple[int, ...], isolated: tuple[int, ...], found: tuple[int, int], tmp_path: Path
):
    host = replace(read_host(tmp_path), cpus=cpus, isolated_cpus=isolated)
    assert loop_cpus(host) == found
