"""Wear over cycles: the coupled state, the steps, the limits."""
