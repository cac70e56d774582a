"""The command line: every command is a few calls of the rooms before it."""

from wearlab.cli.app import main
