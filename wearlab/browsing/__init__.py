"""A window on a store in a browser: look, choose, compare.

Served on this machine alone.
"""
