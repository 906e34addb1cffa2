"""Compile guard, loop and tick when the package is built or installed; give the wheel the tag of its platform."""

import importlib.util
import sys
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGE = Path("src/exograv")
NATIVE = PACKAGE / "safety/native"
LOOP = PACKAGE / "live/native"
LOCK_STEP = PACKAGE / "loop/native"
DRIVES = PACKAGE / "rig/drives"
LOOP_SOURCES = (
    LOOP / "loop.c",
    DRIVES / "native/machine.c",
    DRIVES / "canopen/native/drives.c",
    DRIVES / "canopen/native/frames.c",
    DRIVES / "udp/native/drives.c",
)


class GuardBuildHook(BuildHookInterface):
    """Build hook of the compiled guard and loop. Without a C compiler the guard runs as Python, in simulation only."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile the guard, before the files of the wheel are collected."""
        if self.target_name != "wheel":
            return
        folder = Path(self.root) / NATIVE
        # The package itself cannot be imported here: its dependencies are not installed yet.
        spec = importlib.util.spec_from_file_location("guard_build", folder / "build.py")
        assert spec is not None
        assert spec.loader is not None
        build = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(build)
        compiled = folder / build.COMPILED_NAME
        if not build.build(compiled):
            print(
                "exograv: no C compiler was found; the guard will run as Python, in simulation only.", file=sys.stderr
            )
            return
        build_data["artifacts"].append(str(NATIVE / compiled.name))
        build.build(Path(self.root) / LOCK_STEP / "lock_step.native", [Path(self.root) / LOCK_STEP / "lock_step.c"])
        build_data["artifacts"].append(str(LOCK_STEP / "lock_step.native"))
        # The loop uses functions of Linux. Elsewhere the live loop runs as Python.
        if sys.platform.startswith("linux"):
            build.build(Path(self.root) / LOOP / "loop.native", [Path(self.root) / one for one in LOOP_SOURCES])
            build_data["artifacts"].append(str(LOOP / "loop.native"))
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["pure_python"], build_data["tag"] = False, f"py3-none-{platform}"
