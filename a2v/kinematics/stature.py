"""Default height of a person."""

TYPICAL_HEIGHT = 1.7
"""Standing height of an adult, meters: between the worldwide means of women (1.6) and men (1.7 to
1.8). Default of `FitSettings.height`."""
