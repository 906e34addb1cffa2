"""Lock on an open file, on POSIX systems and on Windows. The lock ends with its process."""

import sys


def take_lock(handle: int) -> None:
    """Lock an open file.

    Raises:
        BlockingIOError: Another process holds the lock.
    """
    if sys.platform == "win32":
        import msvcrt

        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError as error:
            raise BlockingIOError(error.errno, error.strerror) from error
        return
    import fcntl

    fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
