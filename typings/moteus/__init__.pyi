"""moteus for pyright, which need not be installed: it says nothing of its types, so all of its names are `Any`."""

from typing import Any

def __getattr__(name: str) -> Any: ...
