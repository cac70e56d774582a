"""What the dataset of a run holds: one file for each topic, from contact to errors.

Each file turns physics arrays into named values, as the table of variables
(`wearlab/schema/variables.toml`) declares them. `build` joins them to one dataset.
"""
