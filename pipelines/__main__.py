"""``python -m pipelines …`` is the command ``a2v …``."""

import sys

from pipelines.cli import main

if __name__ == "__main__":  # worker processes import this module again
    sys.exit(main())
