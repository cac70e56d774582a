"""Pictures of README and docs: each shows runs of today, or says why it shows none."""

import io
import re
from pathlib import Path

import pictures
import pytest
from PIL import Image

TOP = Path(__file__).parents[1]
SHOWN = re.compile(r"(?:!\[[^\]]*\]\(|\{image\} )([^)\s]+\.png)")


@pytest.fixture(scope="module")
def files():
    return pictures.campaign_files()


def shown():
    pages = [TOP / "README.md", *(TOP / "docs").rglob("*.md")]
    return {
        (page.parent / link).resolve()
        for page in pages
        for link in SHOWN.findall(page.read_text(encoding="utf-8"))
    }


def test_every_picture_is_todays():
    """`python docs/papers_pages.py STORE`, `docs/gallery.py` and `docs/pictures.py
    STORE` draw them.
    """
    assert pictures.stale() == {}


def test_every_picture_shown_is_of_runs_or_said_to_be_of_none():
    known = set(pictures.pictures())
    others = {
        file
        for file in shown() - known
        if file.name not in pictures.OF_NO_RUN
        and file.parent.name not in pictures.OF_NO_RUN_FOLDERS
    }
    assert others == set()
    assert all(file.exists() for file in shown())


PICTURE = TOP / "docs" / "images" / "wear_profile.png"


def test_another_model_version_makes_a_picture_stale(files, monkeypatch):
    assert pictures.why_stale(PICTURE, files, {}) == ""
    monkeypatch.setattr("wearlab.scene.identity.MODEL_VERSION", 5)
    reason = pictures.why_stale(PICTURE, files, {})
    assert re.search(
        r"spur_speeds.toml: (\d+) of \1 runs are of other scenes or model versions",
        reason,
    )


def test_another_figure_or_campaign_makes_a_picture_stale(tmp_path):
    campaign = TOP / "campaigns" / "spur_speeds.toml"
    text = campaign.read_text(encoding="utf-8").replace(
        '"base/', f'"{campaign.parent.as_posix()}/base/'
    )
    text = text.replace('"published/', f'"{campaign.parent.as_posix()}/published/')
    other = tmp_path / "other.toml"
    other.write_text(text.replace("The waves are", "Waves are"), encoding="utf-8")
    title = "Wear of a spur pair at five speeds"
    assert "its figure 13 is another" in pictures.why_stale(
        PICTURE, {title: [other]}, {}
    )
    other.write_text(text.replace("1860 rpm", "1870 rpm"), encoding="utf-8")
    assert "of 6 runs are of other" in pictures.why_stale(PICTURE, {title: [other]}, {})
    assert "no campaign is called" in pictures.why_stale(PICTURE, {}, {})


def test_a_picture_without_a_question_is_stale(files, tmp_path):
    bare = tmp_path / "bare.png"
    with Image.open(PICTURE) as picture:
        picture.convert("RGB").save(bare)
    assert pictures.why_stale(bare, files, {}).startswith("carries no question")


def test_what_looks_otherwise_is_seen():
    image = PICTURE.read_bytes()
    assert pictures.share_seen(image, image) == 0.0
    stream = io.BytesIO()
    with Image.open(PICTURE) as picture:
        moved = Image.new("RGB", picture.size, "white")
        moved.paste(picture.convert("RGB"), (0, 3))
        moved.save(stream, format="png")
    assert pictures.share_seen(image, stream.getvalue()) > pictures.SAME
    with Image.open(PICTURE) as picture:
        picture.resize((100, 100)).convert("RGB").save(stream, format="png")
