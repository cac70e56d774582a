"""What an update refuses."""

from collections.abc import Iterable


class UpdateError(ValueError):
    """An update cannot be done; one line a problem, each with its place and remedy."""

    def __init__(self, problems: Iterable[str] | str) -> None:
        self.problems = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(self.problems))
