"""`python -m bladewing.classify`: the command line, where its own program is not on the path."""

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
