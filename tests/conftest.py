"""Settings of all tests: property tests have no deadline, and the same examples every time on a server."""

import os

from hypothesis import settings

# The first call compiles a kernel, which takes longer than any fair deadline for the second.
settings.register_profile("desk", deadline=None)
settings.register_profile("server", deadline=None, derandomize=True)
settings.load_profile("server" if os.environ.get("CI") else "desk")
