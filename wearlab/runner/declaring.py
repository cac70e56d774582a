"""What plug-ins declare, written beside the runs they make: plans and reports need no code of theirs."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from wearlab.plugins import FOLDER, Plugin, declaration
from wearlab.store.files import write_whole


def plugins_of(scenes: Iterable[Any]) -> tuple[Plugin, ...]:
    """Return the plug-ins of scenes, each once.

    Raises
    ------
    PluginError : of one, only the options are known
    """
    origins = (scene.plugins_used() for scene in scenes if hasattr(scene, "plugins_used"))
    return tuple(dict.fromkeys(plugin for origin in origins for plugin in origin))


def declare(plugins: Iterable[Plugin], store: Path) -> None:
    """Write source and options of plug-ins into a store, where they are not there yet."""
    for plugin in plugins:
        file = store / FOLDER / f"{plugin.sha256}.json"
        if not file.exists():
            text = json.dumps(declaration(plugin), indent=1, ensure_ascii=False)
            write_whole(file, text.encode())
