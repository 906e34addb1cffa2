"""Process faults use signals and tables of Linux."""

import sys

collect_ignore_glob = [] if sys.platform.startswith("linux") else ["test_*.py"]
