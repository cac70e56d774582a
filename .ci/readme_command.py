"""Print one of the README's two set-up commands: ``run`` or ``tests``."""

import re
import sys
from pathlib import Path

blocks = re.findall(r"```sh set-up\n(.+)\n```", Path("README.md").read_text())
commands = {"tests" if "pytest" in block else "run": block for block in blocks}
if len(blocks) != 2 or len(commands) != 2:
    sys.exit(
        "README.md must hold exactly two set-up commands, one to run and one to "
        f"test; found {blocks}"
    )
print(commands[sys.argv[1]])
