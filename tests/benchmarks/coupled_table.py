"""Published, static and coupled lives of W23's Figs. 9–12, from the stored runs of
their campaigns.

``python tests/benchmarks/coupled_table.py STORE`` writes the tables into
docs/evidence/coupled_lives.md, between the lines that name this file. Every row names
the wear coefficient, the contact patch, how a pair enters and the harmonics of its
runs, as their scenes have them.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

import wearlab as wl
from wearlab.campaign import load
from wearlab.scene.identity import MODEL_VERSION

TOP = Path(__file__).parents[2]
PAGE = TOP / "docs" / "evidence" / "coupled_lives.md"
BEGIN = "<!-- written by tests/benchmarks/coupled_table.py: begin -->"
END = "<!-- written by tests/benchmarks/coupled_table.py: end -->"
HEADINGS = "| runs | k [1e-16 m²/N] | patch | entry | harmonics |"
AS_PUBLISHED = "_as_published"
PER = 1e-7
"""Lives are told in 1e7 cycles."""


class Figure(NamedTuple):
    """A figure of W23: campaign, axis of its sweep and its unit, file of points in
    millions of cycles.
    """

    number: int
    campaign: str
    axis: str
    unit: str
    published: str


LIVES = (
    Figure(10, "planetary_initial_wear", "initial_wear", "µm", "w23_fig10.csv"),
    Figure(11, "planetary_torque", "torque", "N·m", "w23_fig11.csv"),
    Figure(12, "planetary_speed", "speed", "rpm", "w23_fig12.csv"),
)
FORCES, LAWS = "planetary_excitation", "planetary_damping_laws"
OUTLINES = "planetary_exact_contact"
LIGHT_DEPTHS = (100e-6, 300e-6)
WANTED = (
    "life",
    "error_estimate_life",
    "end_reason",
    "max_wear_depth",
    "calibrated_wear_coefficient",
)


def published(name: str) -> dict[float, float]:
    """Return the published points of a file, by x."""
    lines = (
        (TOP / "campaigns" / "published" / name)
        .read_text(encoding="utf-8")
        .splitlines()
    )
    points = [line.split(",") for line in lines if not line.startswith("#")][1:]
    return {float(x): float(y) for x, y in points}


def choices(scene: Any) -> str:
    """Return patch, entry and harmonics of a scene as cells."""
    excitation = scene.mesh.excitation
    series = excitation.model == "fourier"
    harmonics = "all, by pairs"
    if scene.dynamics is None:
        harmonics = "–"
    elif series:
        harmonics = f"{excitation.stiffness_harmonics}/{excitation.error_harmonics}"
    entry = "extended" if scene.mesh.extended_contact else "at A"
    return f"{scene.wear.contact_patch.model} | {entry} | {harmonics}"


def cell(run: xr.Dataset) -> str:
    """Return the life of a run with its estimated error, or how far it came."""
    run = run.compute()
    error = float(run.error_estimate_life)
    if str(run.end_reason.item()) == "depth":
        life = float(run.life)
        return f"{life * PER:.3f} ± {max(error * PER, 0.001):.3f}"
    reached = 1e6 * float(run.max_wear_depth.sel(flank="sun").max())
    return (
        f"{run.end_reason.item()} at {reached:.0f} µm, "
        f"{float(run.cycle.max()) * PER:.2f}"
    )


def rows(store: Any, figure: Figure) -> Iterator[str]:
    """Yield the table of one figure: lives in 1e7 cycles."""
    points = published(figure.published)
    campaign = load(TOP / "campaigns" / f"{figure.campaign}.toml")
    swept = store.open(campaign)[figure.axis].values
    yield f"{HEADINGS} " + " | ".join(f"{x:g} {figure.unit}" for x in swept) + " |"
    yield "|" + "---|" * (5 + len(swept))
    known = [f"{points[x] * 0.1:.3f}" if x in points else "–" for x in swept.tolist()]
    yield "| W23 | not printed | – | – | not printed | " + " | ".join(known) + " |"
    for name, told in (
        (figure.campaign, "consistent"),
        (figure.campaign + AS_PUBLISHED, "as published"),
    ):
        campaign = load(TOP / "campaigns" / f"{name}.toml")
        runs = store.open(campaign)[list(WANTED)]
        for label in ("base", "static load"):
            of = runs.sel(case=label)
            scene = next(case.scene for case in campaign.cases if case.label == label)
            k = of.calibrated_wear_coefficient.values
            cells = [cell(of.isel({figure.axis: at})) for at in range(len(swept))]
            kind = "static" if label == "static load" else "coupled"
            yield (
                f"| {kind}, {told} | {1e16 * np.nanmean(k):.3f} | {choices(scene)} | "
                f"{' | '.join(cells)} |"
            )
    yield row_by_outlines(store, figure)


def row_by_outlines(store: Any, figure: Figure) -> str:
    """Return the coupled lives of a figure by contact of whole outlines, where some
    have been run.
    """
    campaign = load(TOP / "campaigns" / f"{OUTLINES}.toml")
    labels = {case.scene.id: case.label for case in campaign.cases}
    runs = store.open(campaign)[list(WANTED)]
    swept = load(TOP / "campaigns" / f"{figure.campaign}.toml").cases
    scenes = [
        case.scene.replace("mesh.contact", "exact")
        for case in swept
        if case.label == "base"
    ]
    found = [labels.get(scene.id) for scene in scenes]
    of = runs.sel(case=[label for label in found if label is not None])
    k = np.nanmean(of.calibrated_wear_coefficient.values)
    cells = ["–" if label is None else cell(of.sel(case=label)) for label in found]
    return (
        f"| coupled, whole outlines | {1e16 * k:.3f} | {choices(scenes[0])} | "
        f"{' | '.join(cells)} |"
    )


def forces(store: Any) -> Iterator[str]:
    """Yield the table of Fig. 9: smallest and largest mesh force [N]
    over the wear of the sun.
    """
    largest = published("w23_fig9_largest.csv")
    smallest = published("w23_fig9_smallest.csv")
    depths = (0.0, 20.0, 40.0, 60.0, 80.0, 100.0)
    yield f"{HEADINGS} " + " | ".join(f"{x:g} µm" for x in depths) + " |"
    yield "|" + "---|" * (5 + len(depths))
    known = [
        f"{smallest[x]:.0f}–{largest[x]:.0f}" if x in largest else "–" for x in depths
    ]
    yield "| W23 | not printed | – | – | not printed | " + " | ".join(known) + " |"
    for name, told in ((FORCES, "consistent"), (FORCES + AS_PUBLISHED, "as published")):
        campaign = load(TOP / "campaigns" / f"{name}.toml")
        run = (
            store.open(campaign)[["max_wear_depth", "mesh_force_min", "mesh_force_max"]]
            .squeeze()
            .compute()
        )
        own = run.sel(mesh="sun-planet-1", flank="sun")
        reached = 1e6 * own.max_wear_depth.values
        at = [int(np.abs(reached - x).argmin()) for x in depths]
        cells = [
            f"{float(own.mesh_force_min[i]):.0f}–{float(own.mesh_force_max[i]):.0f}"
            for i in at
        ]
        yield (
            f"| dynamic, {told} | – | {choices(campaign.cases[0].scene)} | "
            f"{' | '.join(cells)} |"
        )


def sliding_force(run: xr.Dataset, depth: float) -> float:
    """Return the integral of normal force times sliding over the sun's path at a depth
    of its wear [W m].
    """
    sun = run.sel(flank="sun")
    rate = sun.tooth_force * np.abs(sun.sliding_velocity)
    touched = np.isfinite(sun.path_position.values)
    work = np.trapezoid(
        rate.values[:, touched], sun.path_position.values[touched], axis=-1
    )
    return at_depth(run, depth, work)


def at_depth(run: xr.Dataset, depth: float, values: Any) -> float:
    """Return what a run has at a depth of its sun, NaN beyond what it reached."""
    return float(
        np.interp(depth, run.max_wear_depth.sel(flank="sun"), values, right=np.nan)
    )


def told(values: Sequence[float], form: str) -> str:
    """Return numbers as a cell, a dash for each that is missing."""
    return ", ".join("–" if np.isnan(x) else form.format(x) for x in values)


def laws(store: Any) -> Iterator[str]:
    """Yield the table of damping laws at light loads: life, and at some depths force
    and loss of contact.
    """
    campaign = load(TOP / "campaigns" / f"{LAWS}.toml")
    runs = store.open(campaign)
    cells = [f"life at {x:g} N·m" for x in runs.torque.values]
    cells += [
        f"{what}, {x:g} N·m" for x in runs.torque.values for what in ("force", "apart")
    ]
    yield f"| damping law | {' | '.join(cells)} |"
    yield "|" + "---|" * (1 + len(cells))
    wanted = ["tooth_force", "sliding_velocity", "separation_fraction", *WANTED]
    for label in runs.case.values:
        lives = []
        seen = []
        for torque in runs.torque.values:
            both = [
                runs.sel(case=one, torque=torque)[wanted]
                for one in (label, "static load")
            ]
            run, static = (
                one.dropna("update", how="all", subset=["max_wear_depth"]).compute()
                for one in both
            )
            lives += [cell(run)]
            force = [
                sliding_force(run, x) / sliding_force(static, x) for x in LIGHT_DEPTHS
            ]
            seen += [told(force, "{:.3f}")]
            apart = run.separation_fraction.sel(mesh="sun-planet-1")
            seen += [
                told(
                    [100.0 * at_depth(run, x, apart) for x in LIGHT_DEPTHS], "{:.0f} %"
                )
            ]
        name = "viscous, damping ratio 0.07" if label == "base" else label
        yield f"| {name} | {' | '.join([*lives, *seen])} |"


def page(store: Any) -> list[str]:
    """Return the section that is written."""
    lines = [
        f"Runs of model version {MODEL_VERSION}.",
        "",
        "W23 Fig. 9: smallest and largest force of a sun–planet mesh [N], 90 N·m, "
        "1000 rpm, over the",
    ]
    lines += [
        "wear of the sun; its profiles are those of the static load.",
        "",
        *forces(store),
    ]
    for figure in LIVES:
        axis = figure.axis.replace("_", " ")
        lines += ["", f"W23 Fig. {figure.number}: lives in 1e7 cycles over {axis}.", ""]
        lines += rows(store, figure)
    depths = " and ".join(f"{1e6 * x:g}" for x in LIGHT_DEPTHS)
    lines += [
        "",
        f"Light loads by damping law (`{LAWS}.toml`): lives in 1e7 cycles; at "
        f"{depths} µm worn, normal force",
        "times sliding over that of the static load at that depth (force), and the "
        "share of time in which",
        "a sun–planet mesh does not push (apart).",
        "",
        *laws(store),
    ]
    return lines


def main(arguments: Sequence[str]) -> None:
    """Write the tables."""
    if len(arguments) != 1:
        raise SystemExit("usage: python tests/benchmarks/coupled_table.py STORE")
    store = wl.open(arguments[0])
    section = "\n".join(page(store))
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    PAGE.write_text(f"{before}{BEGIN}\n\n{section}\n\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
