"""What functions of the physics name as their source stands in the bibliography."""

from named_sources import functions, known


def test_every_reference_is_in_the_bibliography():
    citing = [one for one in functions() if one.references]
    assert len(citing) > 100
    for one in citing:
        text = " ".join(one.references.split())
        assert any(all(word in text for word in entry) for entry in known()), (
            f"{one.place}: {text}"
        )


def test_sources_are_named():
    """Plumbing has none to name.

    Of what computes a relation that is published, ever more has.
    """
    assert sum(one.named for one in functions()) >= 149
