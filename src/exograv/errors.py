"""Every error that a caller can act on; each message says what, where, what is allowed and what to do next."""


class ExogravError(Exception):
    """Any mistake that the person at the keyboard can put right; the command line prints it without a traceback."""


class ConfigError(ExogravError):
    """A settings file or an option holds a value that cannot be used."""


class ModelError(ExogravError):
    """A machine or an arm that cannot exist, or that its cuffs cannot carry."""


class RigError(ExogravError):
    """The machine, real or virtual, refused or broke off."""


class RecordingError(ExogravError):
    """A recording or a log that cannot be read or written."""


class IdentificationError(ExogravError):
    """Data that do not allow an identification."""


class KernelError(ExogravError):
    """A function that cannot be compiled: an operation that the kernels do not know, or no compiler for this CPU."""
