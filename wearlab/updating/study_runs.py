"""The runs that an update needs: what is missing is computed, then all are read."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import xarray as xr

from wearlab.scene import Scene
from wearlab.store import Store
from wearlab.updating import cases, run_curves
from wearlab.updating.record_clocks import clocked_run


class Runner(NamedTuple):
    """How the runs of an update are made.

    Parameters
    ----------
    title : of the campaign
    store : where they are kept
    progress : whether a bar is shown
    workers : processes [the cores]
    """

    title: str
    store: Store
    progress: bool = True
    workers: int | None = None

    def run(self, studies: cases.Subjects) -> list[run_curves.Runs]:
        """Return the histories of each study; what is missing is run together.

        Parameters
        ----------
        studies : case by case
        """
        conditions = [study.conditions for study in studies]
        scenes = [scene for study in studies for scene in study.scenes]
        scenes += [scene for named in conditions for scene in named.values()]
        self._compute(studies, scenes)

        all_histories = []
        runs_read: cases.RunsRead = {}
        for study, condition_scenes in zip(studies, conditions, strict=True):
            is_single = len(study.scenes) == 1  # of many, memory is not kept
            runs = cases.histories(study, self.store, runs_read if is_single else None)
            if study.record is not None:  # all of it idle: a clock without a run
                condition_runs = cases.condition_histories(
                    study, condition_scenes, self.store
                )
                runs = [clocked_run(study, runs[0], condition_runs)]
            all_histories.append(runs)
        return all_histories

    def stored(self, study: cases.Subject, worn: Scene) -> xr.Dataset:
        """Return what is stored of a scene with worn mates.

        Where it is missing, it is run.

        Parameters
        ----------
        study : the case
        worn : the scene
        """
        self._compute([study], [worn])
        named = {"update.replaced: its run with worn mates": worn}
        return cases.stored_runs(study, named, self.store)[0]

    def _compute(self, studies: cases.Subjects, scenes: Sequence[Scene]) -> None:
        """Run scenes that the store does not have."""
        from wearlab import runner

        distinct = {scene.id: scene for scene in scenes}
        campaign = studies[0].campaign(self.title, list(distinct.values()))
        if len(studies) > 1:
            campaign = replace(campaign, title=self.title)
        runner.run(campaign, self.store, progress=self.progress, workers=self.workers)
