"""``python -m contfric``: the command line."""

import sys

from contfric.cli import main

if __name__ == "__main__":
    sys.exit(main())
