"""The laboratory: tools for researchers to make, train and measure the shipped models. Making a
video imports nothing from it."""
