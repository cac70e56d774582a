"""Archard's wear along the path: law, coefficient, film, load."""
