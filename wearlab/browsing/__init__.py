"""A window on a store in a browser: look, choose, compare; served on this machine alone."""
