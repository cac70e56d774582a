"""The exact mesh relationship of worn flanks."""
