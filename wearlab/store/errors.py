"""What a store says when it cannot do what it is asked."""


class StoreError(Exception):
    """The store cannot be read, written or understood; the message names the path and the remedy."""
