"""Entry of `python -m solver`."""

import sys
from contextlib import suppress
from pathlib import Path

# The current folder has given this package and gives no other: a file `yaml.py` there is not ours.
with suppress(OSError):
    sys.path[:] = [folder for folder in sys.path if Path(folder) != Path.cwd()]

from .commands.cli import main

sys.exit(main())
