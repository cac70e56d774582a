"""Whom work is given to: workers elsewhere that run other code than this process are left out, and named."""

from collections.abc import Callable
from typing import Any

from wearlab.runner.report import RunnerError
from wearlab.sources import source_hash


class OtherCode(Exception):
    """A worker was given work and runs other code; its arguments are its address and its source hash."""


class Crew:
    """The workers of a scheduler, those that may work and those that may not.

    Parameters
    ----------
    client : of dask.distributed
    tell : is told whom is left out, and why
    """

    def __init__(self, client: Any, tell: Callable[[str], None]) -> None:
        self.client, self.tell = client, tell
        self.fit: set[str] = set()
        self.refused: dict[str, str] = {}

    def present(self) -> list[str]:
        """Return the addresses of workers that may work, after asking new ones for their code.

        Raises
        ------
        RunnerError : there are workers, and every one runs other code
        """
        here = set(self.client.scheduler_info(n_workers=-1)["workers"])
        if strangers := sorted(here - self.fit - set(self.refused)):
            answers = self.client.run(source_hash, workers=strangers, on_error="return")
            for address, answer in answers.items():
                self.learn(address, answer)
        if here and not here & self.fit:
            raise RunnerError("\n".join(["no worker is left that runs the same code", *self.reasons()]))
        return sorted(here & self.fit)

    def learn(self, address: str, code: object) -> None:
        """Take note of a worker's source hash, or of the error it answered with."""
        if code == source_hash():
            self.fit.add(address)
        elif not isinstance(code, OSError) and address not in self.refused:
            self.fit.discard(address)
            self.refused[address] = str(code)
            self.tell(self.reasons()[-1])

    def reasons(self) -> list[str]:
        """Return one sentence about each worker that was refused."""
        return [
            f"worker {address} is refused: the source hash of its wearlab is {code}, here it is "
            f"{source_hash()}; install the same version there"
            for address, code in self.refused.items()
        ]

    def choice(self, fit: list[str]) -> dict[str, Any]:
        """Return how dask is told whom to give work: anybody, until somebody had to be refused.

        A preference, not a rule: a worker that dies and returns under another address still gets work.
        """
        return {"workers": fit, "allow_other_workers": True} if self.refused and fit else {}
