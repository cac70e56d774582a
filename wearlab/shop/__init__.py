"""The words of the shop and the standards that they stand for: hardness numbers, materials, oils."""
