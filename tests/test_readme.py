"""The README's session runs as it is printed: every file, every command, one after the other."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

TOP = Path(__file__).parents[1]
README = (TOP / "README.md").read_text()
FILES = dict(re.findall(r"```toml (\S+)\n(.+?)```", README, re.DOTALL))
COMMANDS = re.findall(r"```sh session\n(.+?)```", README, re.DOTALL)


def test_every_command_is_in_the_table_and_every_campaign_in_the_list():
    from wearlab.cli.app import app

    table = "".join(line for line in README.splitlines() if line.startswith("|"))
    for command in app.registered_commands:
        assert f"`wearlab {command.callback.__name__}" in table
    listed = [Path(name) for name in re.findall(r"`([^`]+\.(?:toml|csv))`", table)]
    for file in (TOP / "campaigns").rglob("*.toml"):
        assert any(file.relative_to(TOP / "campaigns").match(str(one)) for one in listed), file
    for one in listed:
        assert list((TOP / "campaigns").glob(str(one))), one


@pytest.mark.slow
def test_the_session(tmp_path):
    (tmp_path / "campaigns").symlink_to(TOP / "campaigns")
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    scripts = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    environment = {**os.environ, "PATH": scripts, "WEARLAB_STORE": str(tmp_path / "store")}
    told = []
    for block in COMMANDS:
        done = subprocess.run(
            ["bash", "-euc", block],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert (done.returncode, done.stderr) == (0, ""), block
        told.append(done.stdout)
    first, extended, asked, branched, compared, redrawn, handed_on = told
    assert "2 new" in first and "2 of 2 done; 2 computed" in first
    assert "1 new\n        2 cached" in extended and "3 of 3 done; 1 computed" in extended
    assert asked.count("torque=") == 2 and "first_cycle(max_wear_depth > 5 um)" in asked
    assert "goes on from    run " in branched and "new flanks: pinion" in branched
    assert "start.replace.0" in compared and (tmp_path / "compared.png").is_file()
    assert "the same bytes" in redrawn
    assert "Your Name. (" in handed_on and "4 runs compared, 0 problems" in handed_on
