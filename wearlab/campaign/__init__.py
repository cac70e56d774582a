"""Campaigns: a file becomes scenes, each with its place in a grid, and figures."""

from wearlab.campaign.axes import Axis, Coordinate
from wearlab.campaign.blocks import CampaignError
from wearlab.campaign.campaign import Campaign
from wearlab.campaign.case import Case, Excluded, Expectation, ExpectedNumber
from wearlab.campaign.json_schema import added_json, editors_schema, schema_json
from wearlab.campaign.reading import load, read_plugins
