"""Wishes that cannot be met say why, and what could be."""

from dataclasses import replace

import pytest

from wearlab.figures import FigureError


@pytest.mark.parametrize(
    "wishes, message",
    [
        (
            {"select": {"speed": 900}},
            r"select.speed = 900 is not there; valid: 800 rpm, 1100 rpm, 3720 rpm",
        ),
        ({"select": {"case": "statik"}}, r"did you mean 'static'\?"),
        ({"select": {"update": 3}}, r"select.update = 3 is not there; valid: 0 to 2"),
        ({"select": {"cycle": "many"}}, r"not a number of cycles"),
        (
            {"select": {"flanks": "pinion"}},
            r"select.flanks: no such dimension; did you mean 'flank'\?",
        ),
        ({"hue": "torque"}, r"hue = 'torque' does not vary here; valid:"),
        ({"x": "diametre"}, r"x = 'diametre' is not there; did you mean 'diameter'\?"),
        (
            {"units": {"wear_depth": "rpm"}},
            r"units of wear_depth: 'm' is not a unit like 'rpm'",
        ),
        (
            {"y": "wear_dept"},
            r"y = 'wear_dept' is not there; did you mean 'wear_depth'\?",
        ),
    ],
)
def test_the_message_names_the_figure_and_the_choices(plot, wishes, message):
    with pytest.raises(FigureError, match=rf"figure 1 \(wear-profile\): .*{message}"):
        plot(kind="wear-profile", **wishes)


def test_what_does_not_run_along_is_no_abscissa(plot):
    """Was an IndexError of numpy."""
    with pytest.raises(
        FigureError,
        match=r"x = 'max_wear_depth' does not run along the flank; valid: path_",
    ):
        plot(kind="wear-profile", x="max_wear_depth")
    with pytest.raises(
        FigureError, match="x = 'diameter' is not one number per wear state"
    ):
        plot(kind="stiffness-harmonics", x="diameter")


def test_a_variable_that_no_selected_run_has(plot):
    with pytest.raises(FigureError, match="no selected run has dynamic_mesh_force"):
        plot(kind="mesh-force", select={"case": "static"})


def test_runs_without_the_variable_are_left_out(plot):
    assert len(plot(kind="mesh-force", select={"case": ["base", "static"]}).panels) == 3


def test_more_varies_than_there_is_room_for(plot):
    one = plot(
        kind="line",
        y=["wear_depth", "wear_rate"],
        rows="variable",
        cols="flank",
        hue="update",
    )
    assert (
        len(one.panels) == 2 * 2 * 4
    )  # every flank at every speed, and the static case
    assert "pinion · 800 rpm" in one.panels[0].title


def test_line_without_y(plot):
    with pytest.raises(FigureError, match=r"y names no variable; valid: .*worn_mass"):
        plot(kind="line")


def test_text_is_no_number(plot):
    with pytest.raises(FigureError, match="holds text"):
        plot(kind="line", y="status")


def test_a_case_where_there_are_none(drawn, campaign):
    alone = replace(campaign, cases=campaign.cases[:3])
    assert len(drawn({"kind": "tvms", "select": {"case": "base"}}, of=alone)) == 1
    with pytest.raises(FigureError, match=r"select\.case: no such dimension"):
        drawn({"kind": "tvms", "select": {"case": "static"}}, of=alone)


@pytest.mark.parametrize("kind", ["stiffness-harmonics", "load-share", "phase-plane"])
def test_a_kind_of_its_own_variables_draws_no_other(plot, kind):
    """Harmonics and lines of contact were a KeyError.

    Others drew their own variable and said nothing.
    """
    with pytest.raises(
        FigureError,
        match=rf'\({kind}\): y = .wear_rate.: this kind draws .*"line" draws it',
    ):
        plot(kind=kind, y="wear_rate")
