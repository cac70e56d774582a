"""One file a group of commands; each registers itself on import, so that a new command is a new file."""
