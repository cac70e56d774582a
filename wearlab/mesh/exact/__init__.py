"""The exact mesh relationship of worn flanks: where they touch when contact leaves the line of action."""
