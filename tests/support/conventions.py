"""What IOOS's checker says against a file, for CF 1.11 and ACDD 1.3."""

import contextlib
import io
import json

TRUE_OF_ALL = ("id", "source", "history", "date_created", "processing_level")
HIGHLY = {"title", "summary", "keywords", "Conventions"}


def complaints(path, suite):
    """Return what the checker says against a file, by priority."""
    from compliance_checker.runner import CheckSuite, ComplianceChecker

    CheckSuite.load_all_available_checkers()
    out = path.with_suffix(".json")
    with (
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()),
    ):
        ComplianceChecker.run_checker(
            str(path),
            [suite],
            0,
            "strict",
            output_filename=str(out),
            output_format="json",
        )
    report = json.loads(out.read_text())[suite]
    return {
        level: [text for one in report[f"{level}_priorities"] for text in one["msgs"]]
        for level in ("high", "medium", "low")
    }


def check(path):
    cf = complaints(path, "cf:1.11")
    assert cf == {"high": [], "medium": [], "low": []}, cf
    acdd = complaints(path, "acdd:1.3")["high"]
    assert not [text for text in acdd if text.split(" ")[0] in HIGHLY], acdd
    absent = [text.split(" ")[0] for text in complaints(path, "acdd:1.3")["medium"]]
    assert not set(absent) & set(TRUE_OF_ALL), absent
