"""Why a question cannot be asked."""


class QueryError(ValueError):
    """A condition cannot be read or does not fit what is known; the message points at the place.

    Parameters
    ----------
    reason : one sentence with a remedy
    text : the condition
    position : where in it, from 0
    """

    def __init__(self, reason: str, text: str, position: int) -> None:
        self.reason, self.text, self.position = reason, text, position
        super().__init__(f"{reason}\n  {text}\n  {' ' * position}^")

    def __reduce__(self) -> tuple[type["QueryError"], tuple[str, str, int]]:
        return type(self), (self.reason, self.text, self.position)
