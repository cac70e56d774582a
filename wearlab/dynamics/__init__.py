"""How the gears vibrate: one equation of motion, its steady response, its modes.

The way through: a model (`models`, built by `spur` or `planetary`) is a `system`;
`steps` advance it; `orbits.periodic` finds its steady response; `forces` reads mesh
forces, extremes and energy off it; `modes` are its natural frequencies.
"""
