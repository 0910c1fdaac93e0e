"""Exceptions. Each has the sentence that the tool prints, and its exit code as `code`."""


class Error(Exception):
    """Base class of all errors of Strata.

    Attributes
    ----------
    code : int
        The exit code with which the tool ends for such an error.
    """

    code: int = 1


class InternalError(Error, RuntimeError):
    """A fault in Strata itself."""

    code = 1


class UsageError(Error, ValueError):
    """Arguments that contradict each other or are out of range."""

    code = 2


class InputError(Error, ValueError):
    """A file or an array that cannot be read or is malformed."""

    code = 3


class OutputError(Error, OSError):
    """A file that cannot be written."""

    code = 4


class GeometryError(Error, ValueError):
    """Geometry that is refused: an open mesh with ``open="fail"``, coordinates that are too large."""

    code = 5


class LimitError(Error, MemoryError):
    """A limit of memory or of size."""

    code = 6


class VerificationError(Error, RuntimeError):
    """Two results that should agree do not."""

    code = 7


class CancelledError(Error):
    """The work was stopped on request."""

    code = 130


class StrataWarning(UserWarning):
    """A fact about an input or a result that a user should know, such as a mesh that is not closed."""


_CLASSES = {
    kind.code: kind
    for kind in (InternalError, UsageError, InputError, OutputError, GeometryError, LimitError, VerificationError, CancelledError)
}


def error_of(code: int, message: str) -> Error:
    """The exception for an error of the native part."""
    return _CLASSES.get(code, InternalError)(message)
