"""The laboratory: what researchers use to make, train and measure what the product ships. Making a
video imports nothing of it."""
