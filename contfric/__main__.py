"""``python -m contfric``: the command line."""

from contfric.cli import console

if __name__ == "__main__":
    console()
