"""Entry of `python -m solver`."""

import io
import sys
import warnings
from contextlib import suppress
from pathlib import Path

# The current folder has given this package and gives no other: a file `yaml.py` there is not ours.
with suppress(OSError):
    sys.path[:] = [folder for folder in sys.path if Path(folder) != Path.cwd()]
# Lines leave as they are written, so that the last line of a log is what was said last.
if isinstance(sys.stdout, io.TextIOWrapper):
    sys.stdout.reconfigure(line_buffering=True)
# A result that is not sound is refused in one line; what libraries warn of before says no more.
if not sys.warnoptions:
    warnings.simplefilter("ignore")

from solver.commands.cli import main

sys.exit(main())
