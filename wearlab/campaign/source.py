"""What a campaign file says, word for word, together with the files it extends."""

import hashlib
import os
from pathlib import Path

from wearlab.campaign.inheritance import inherit


def source_text(path: Path | None) -> str:
    """Return the text of a campaign file and of all it extends, each under its name; "" without a file.

    The file itself comes first. Names are relative to its folder: the text tells nothing of a machine.

    Parameters
    ----------
    path : the campaign file
    """
    if path is None or not path.is_file():
        return ""
    files = dict.fromkeys(layer.file for layer in reversed(inherit(path.resolve()).layers))
    return "\n".join(f"# ---- {_name(file, path.resolve().parent)}\n{_read(file)}" for file in files)


def fingerprint(text: str) -> str:
    """Return the hash by which a text is known, 16 hexadecimal digits; "" for no text."""
    return hashlib.sha256(text.encode()).hexdigest()[:16] if text else ""


def _name(file: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # another drive
        return file.name


def _read(file: Path) -> str:
    return file.read_text(encoding="utf-8-sig")
