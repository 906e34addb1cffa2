"""Errors that a caller can act on. Each message says what is wrong, where, what is allowed and what to do next."""


class ExogravError(Exception):
    """Base class of errors that the user can correct. The command line prints them without a traceback."""


class ConfigError(ExogravError):
    """Unusable value in a settings file or an option."""


class ModelError(ExogravError):
    """Machine or arm that cannot exist, or that its cuffs cannot carry."""


class ModelFaultsError(ModelError):
    """Several faults of one file, a sentence each."""

    def __str__(self):
        return f"{len(self.args)} faults:\n" + "\n".join(f"- {fault}" for fault in self.args)


class RigError(ExogravError):
    """Refusal or failure of the machine, real or simulated."""


class RecordingError(ExogravError):
    """Recording or log that cannot be read or written."""


class IdentificationError(ExogravError):
    """Data that do not allow an identification."""


class KernelError(ExogravError):
    """Function that cannot be compiled: it has an unsupported operation, or this CPU has no compiler."""
