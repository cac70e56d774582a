"""More draws of the unknowns that cost runs, where few of the first carry the weight.

As many more are drawn from a normal law fitted to the posterior, in scores of the prior
(z, standard normal before), and all are weighted as if drawn from the mixture (balance
heuristic, Veach & Guibas 1995), so that none of the first is lost.
"""

from dataclasses import replace

import numpy as np
from scipy.special import ndtr, ndtri

from wearlab.arrays import Array
from wearlab.campaign import distributions
from wearlab.updating import answers, cases, grids, run_curves
from wearlab.updating.study_runs import Runner

WIDER = 1.5  # times the posterior's own spread that more runs are drawn from


def with_second_round(
    study: cases.Subject, post: grids.Posterior, runner: Runner
) -> answers.UpdateOutcome:
    """Return what a study comes to with a second round of draws.

    Its runs say how often they were drawn.

    Parameters
    ----------
    study : with a first round of draws
    post : the posterior by their runs
    runner : of the new ones
    """
    from scipy.stats import multivariate_normal, norm, qmc

    # a normal law about the posterior, in scores
    z = scores_of(study, post.histories)
    mean = post.weight @ z
    spread = np.atleast_2d(np.cov(z.T, aweights=post.weight, bias=True))
    covariance = WIDER**2 * (spread + 1e-4 * np.eye(len(mean)))

    # as many draws from it as there were
    count = len(next(iter(study.drawn.values())))
    size = 1 << max(count - 1, 0).bit_length()
    sequence = qmc.Sobol(len(mean), rng=study.spec.seed + 1)
    inside = np.clip(sequence.random(size)[:count], 1e-9, 1.0 - 1e-9)
    new_scores = mean + ndtri(inside) @ np.linalg.cholesky(covariance).T
    extended = _with_draws(study, new_scores)
    (runs,) = runner.run([extended])

    # how often two equal rounds have draws there, over the prior
    z = scores_of(extended, runs)
    log_law = multivariate_normal(mean, covariance).logpdf(z)
    log_ratio = log_law - norm.logpdf(z).sum(axis=1)
    log_weights = np.logaddexp(0.0, log_ratio) - np.log(2.0)
    drawn = [
        replace(run, log_weight=log_weight)
        for run, log_weight in zip(runs, log_weights.tolist(), strict=True)
    ]
    return answers.outcome_of(extended, drawn)


def _with_draws(study: cases.Subject, scores: Array) -> cases.Subject:
    """Return a study with more draws, at scores of the prior, (draws, keys)."""
    values = {}
    for (key, prior), column in zip(study.costly.items(), scores.T, strict=True):
        drawn = prior.at(ndtr(column))
        written = [distributions.written(float(x), prior.unit) for x in drawn]
        values[key] = (*study.drawn[key], *written)
    return replace(study, drawn=values)


def scores_of(study: cases.Subject, runs: run_curves.Runs) -> Array:
    """Return the standard scores of the draws that runs are of, (runs, keys).

    They are 0 at the prior's median.

    Parameters
    ----------
    study : with the draws
    runs : of them
    """
    columns = []
    for key, prior in study.costly.items():
        drawn = study.drawn[key]
        values = np.array([cases.plain_number(drawn[run.draw]) for run in runs])
        columns.append(prior.below(values))
    return np.asarray(ndtri(np.clip(np.array(columns).T, 1e-12, 1.0 - 1e-12)))
