"""Why finite elements cannot be had."""


class LibraryMissing(ValueError):
    """The finite-element library is not installed."""
