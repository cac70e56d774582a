"""How the gears vibrate: one form of system, its steady response, its modes."""
