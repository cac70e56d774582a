"""One file a group of commands.

Each registers itself on import, so that a new command is a new file.
"""
