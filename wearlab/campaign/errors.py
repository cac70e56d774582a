"""The one error of a campaign file: every fault it has, one line each."""

from wearlab.scene.problems import Refusal


class CampaignError(Refusal):
    """A campaign file is refused whole; its problems say file and path first."""
