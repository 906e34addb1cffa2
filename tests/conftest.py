"""Settings of all tests: property tests have no deadline, and the same examples every time on a server."""

import os

# As the command line does: threads of OpenBLAS wait for each other, and our matrices are small. Before NumPy comes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from hypothesis import settings

# The first call compiles a kernel, which takes longer than any fair deadline for the second.
settings.register_profile("desk", deadline=None)
settings.register_profile("server", deadline=None, derandomize=True)
settings.load_profile("server" if os.environ.get("CI") else "desk")
