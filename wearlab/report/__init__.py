"""What is told of a campaign, or of two: pages and figures that need nothing else."""
