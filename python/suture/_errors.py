"""Exceptions, one class for each class of errors of the engine. A defect of a mesh is never an error: it is counted, repaired or reported."""


class SutureError(Exception):
    """The engine has no result."""


class UnreadableError(SutureError, ValueError):
    """It is no mesh that can be read. Trying again gives the same answer."""


class RefusedError(SutureError, ValueError):
    """It is beyond a stated limit that memory does not decide. Trying again gives the same answer."""


class StarvedError(SutureError, MemoryError):
    """It needs more memory than ``memory`` allows. The message says how much."""


class EnvironmentFailedError(SutureError, OSError):
    """Reading or writing failed. Trying again may help."""


class ShortageError(SutureError, OSError):
    """The machine has no room, no quota, or no file handle to spare."""


class ChangedError(SutureError, OSError):
    """The file changed while it was worked on."""
