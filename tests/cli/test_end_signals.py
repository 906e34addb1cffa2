"""SIGTERM and SIGHUP end a command exactly like Ctrl-C, and wait wherever Ctrl-C waits."""

import errno
import os
import pty
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest
from tests.waiting import SOON_S

from exograv.cli.shell.end_signals import ENDING, EndSignals, terminal_may_close
from exograv.loop.interrupt import HeldInterrupt
from exograv.recording.interrupt import uninterrupted

pytestmark = pytest.mark.skipif(os.name != "posix", reason="Windows has no SIGHUP, and its SIGTERM calls no handler")
BOTH = pytest.mark.parametrize("strike", [signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
IN_TERMINAL = """\
import fcntl, sys, termios, time
fcntl.ioctl(0, termios.TIOCSCTTY, 0)  # the end of this terminal then sends SIGHUP to this process
from exograv.cli.shell.end_signals import EndSignals
with EndSignals() as signals:
    try:
        print("begun", flush=True)
        time.sleep(60)
    except KeyboardInterrupt:
        print("a terminal that is closed must not stop this", flush=True)
        sys.exit(128 + signals.came)
"""


@pytest.fixture(autouse=True)
def as_in_a_terminal() -> Iterator[None]:
    """Handle the signals as a terminal's shell does; a test run may ignore them."""
    fresh = {signal.SIGINT: signal.default_int_handler} | dict.fromkeys(ENDING, signal.SIG_DFL)
    before = {number: signal.signal(number, handler) for number, handler in fresh.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@BOTH
def test_a_signal_ends_a_command_as_ctrl_c_does(strike: signal.Signals):
    with EndSignals() as signals, pytest.raises(KeyboardInterrupt):
        signal.raise_signal(strike)
    assert signals.came is strike


@BOTH
def test_a_signal_waits_until_the_arm_is_down(strike: signal.Signals):
    with EndSignals(), HeldInterrupt(is_real=True) as held:
        signal.raise_signal(strike)
        assert held.has_come


@BOTH
def test_a_signal_waits_until_a_write_is_complete(strike: signal.Signals):
    written = list[str]()

    def write() -> None:
        with uninterrupted():
            signal.raise_signal(strike)
            written.append("whole")

    with EndSignals(), pytest.raises(KeyboardInterrupt):
        write()
    assert written == ["whole"]


@BOTH
def test_a_command_in_the_background_ignores_ctrl_c_but_not_this_signal(strike: signal.Signals):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with EndSignals():
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(strike)


def test_a_signal_that_is_ignored_at_the_start_stays_ignored():
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with EndSignals() as signals:
        signal.raise_signal(signal.SIGHUP)
    assert signals.came is None


def test_a_closed_terminal_counts_once_because_shell_and_kernel_both_report_it():
    with EndSignals():
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGHUP)
        signal.raise_signal(signal.SIGHUP)


def test_the_write_error_of_a_closed_terminal_counts_as_its_signal():
    with EndSignals() as signals, pytest.raises(KeyboardInterrupt), terminal_may_close():
        raise OSError(errno.EIO, "Input/output error")
    assert signals.came is signal.SIGHUP


def test_handlers_are_restored():
    with EndSignals():
        pass
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_DFL


def test_a_command_whose_terminal_is_closed_can_still_print():
    ours, theirs = pty.openpty()
    command = [sys.executable, "-c", IN_TERMINAL]
    with subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True) as process:
        os.close(theirs)
        assert b"begun" in os.read(ours, 100)
        os.close(ours)
        assert process.wait(SOON_S) == 128 + signal.SIGHUP
