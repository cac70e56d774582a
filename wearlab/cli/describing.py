"""``variables``: everything that a dataset may hold."""

from difflib import get_close_matches

from wearlab.cli.output import Status, Stop, show_json, show_table

HEADS = ("name", "dims", "unit", "shown in", "meaning", "made by")


def list_variables(like: str, as_json: bool) -> Status:
    """Show every variable whose name or meaning holds a word, all for an empty one."""
    from wearlab.origins import origin_of
    from wearlab.schema import VARIABLES

    word = like.lower()
    variables = {
        name: variable
        for name, variable in VARIABLES.items()
        if word in f"{name} {variable.long_name} {variable.comment}".lower()
    }
    if not variables:
        near = get_close_matches(like, VARIABLES, 1)
        meant = f"; did you mean {near[0]!r}?" if near else ""
        raise Stop(f"variables: none has {like!r} in its name or meaning{meant}")
    if as_json:
        show_json(
            [
                {
                    "name": name,
                    "dims": list(variable.dims),
                    "units": variable.units,
                    "display_units": variable.display_units,
                    "long_name": variable.long_name,
                    "comment": variable.comment,
                    "group": origin_of(name)[0],
                    "made_by": origin_of(name)[1],
                }
                for name, variable in variables.items()
            ]
        )
        return Status.WELL
    rows = []
    for name, variable in variables.items():
        meaning = f"{variable.long_name} ({variable.comment})" if variable.comment else variable.long_name
        rows.append(
            (
                name,
                ", ".join(variable.dims),
                variable.units,
                variable.display_units,
                meaning,
                origin_of(name)[1],
            )
        )
    show_table(HEADS, rows)
    return Status.WELL
