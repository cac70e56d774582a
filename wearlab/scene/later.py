"""What campaign files may say one day, and this version refuses by name."""

LATER_KEYS: dict[str, dict[str, str]] = {
    "": {},
    "gears": {"helix_angle": "helical gears"},
}

LATER_CHOICES: dict[str, dict[str, str]] = {}


def later(what: str) -> str:
    """Return the sentence that refuses it."""
    return f"{what}: not part of this version of wearlab"
