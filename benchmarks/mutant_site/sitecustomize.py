"""Start of an interpreter that a test starts while a mutant is tried: the mutant is in force there, too.

Python imports a module of this name, if it is in the path, before anything else.
"""

import os
import sys

if "EXOGRAV_MUTANT" in os.environ:
    import importlib.abc
    import importlib.machinery
    import importlib.util
    from pathlib import Path

    class _Mutant(importlib.abc.MetaPathFinder, importlib.machinery.SourceFileLoader):
        """Import hook and loader of the one wrong module."""

        def __init__(self, name: str, file: str, source: str):
            super().__init__(name, file)
            self.source = source

        def find_spec(self, fullname, path=None, target=None):
            """Return the specification of the wrong module, else None."""
            if fullname != self.name:
                return None
            return importlib.util.spec_from_loader(fullname, self, origin=self.path)

        def get_code(self, fullname: str):
            """Compile the wrong source; never cache it."""
            return compile(Path(self.source).read_text(encoding="utf-8"), self.path, "exec")

    sys.meta_path.insert(0, _Mutant(*os.environ["EXOGRAV_MUTANT"].split("\n")))
