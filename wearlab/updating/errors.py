"""What an update refuses."""

from wearlab.scene.problems import Refusal


class UpdateError(Refusal):
    """An update cannot be done; its problems tell place and remedy."""
