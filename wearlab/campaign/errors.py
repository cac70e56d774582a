"""The one error of a campaign file: every fault it has, one line each."""

from collections.abc import Iterable


class CampaignError(ValueError):
    """A campaign file is refused whole; ``problems`` has one line for each fault, file and path first."""

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems = tuple(dict.fromkeys(problems))
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[type["CampaignError"], tuple[tuple[str, ...]]]:
        return type(self), (self.problems,)
