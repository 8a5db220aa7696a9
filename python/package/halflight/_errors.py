"""What can go wrong for a reason outside the program: one line that names the thing and the way out."""


class Error(Exception):
    """All of them."""

    __module__ = "halflight"


class UsageError(Error, ValueError):
    """An argument that cannot be followed."""

    __module__ = "halflight"


class NoLayer(UsageError, AttributeError):
    """A layer that a picture does not have."""

    __module__ = "halflight"


class SceneError(Error, ValueError):
    """A scene that is not what it should be."""

    __module__ = "halflight"


class FileError(Error, OSError):
    """A file that cannot be read or written, or is no picture."""

    __module__ = "halflight"


class NoImage(Error):
    """The series of reflections has no sum: there is no image."""

    __module__ = "halflight"

    #: The multiplication factor.
    k: float
