"""``python -m pipelines …`` runs the command ``a2v …``."""

import sys

from pipelines.cli import main

if __name__ == "__main__":  # Worker processes import this module again.
    sys.exit(main())
