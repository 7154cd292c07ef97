"""Entry of `python -m solver`."""

import sys

from solver.commands.cli import main

sys.exit(main())
