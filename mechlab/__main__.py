"""`python -m mechlab VERB NAME ...` does what the command `mechlab` does."""

import sys

from mechlab.cli import main

if __name__ == "__main__":
    sys.exit(main())
