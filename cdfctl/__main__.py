"""``python -m cdfctl`` is the ``cdfctl`` command."""

import sys

from cdfctl.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
