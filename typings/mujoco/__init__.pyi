"""MuJoCo for pyright: its names come from compiled modules without type information, so all of them are `Any`."""

from typing import Any

def __getattr__(name: str) -> Any: ...
