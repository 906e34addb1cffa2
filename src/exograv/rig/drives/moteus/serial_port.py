"""Serial port of a POSIX system, used by one program at a time. Only this module cannot be imported on Windows."""

import fcntl
import os
import termios
import tty

from exograv.errors import RigError


def open_port(path: str) -> int:
    """Open a port without waiting, and lock it against other programs.

    Raises:
        RigError: The port does not open, is not a serial port, or another program has it.
    """
    try:
        fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as error:
        raise RigError(
            f"moteus.path {path} does not open: {error.strerror}. Is the adapter plugged in, may this user read and "
            "write it, and is the path in drives.toml right? Without hardware: exograv dev drive-sim --bus moteus."
        ) from error
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        tty.setraw(fd)
        termios.tcflush(fd, termios.TCIOFLUSH)
    except BlockingIOError as error:
        os.close(fd)
        raise RigError(f"moteus.path {path}: another host program has this adapter. End that program first.") from error
    except (OSError, termios.error) as error:
        os.close(fd)
        raise RigError(f"moteus.path {path} is not a serial port. Correct it in drives.toml.") from error
    return fd
