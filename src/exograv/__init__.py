"""Take the weight off an arm inside an exoskeleton. Importing does no work; the rooms are imported one by one."""

__version__ = "0.1.0"
