"""Entry of `python -m solver`, and of this file run by its path.

By its path with the option -P, no module of the current folder is imported: `-m` imports `runpy`
first, and a file `re.py` or `enum.py` there would join it.
"""

# Built into Python: a file `signal.py` of the current folder is another module.
import _signal  # type: ignore[import-not-found]
import sys

# While Python imports the program, Ctrl-C ends the process at once, without a traceback.
if _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler:
    _signal.signal(_signal.SIGINT, _signal.SIG_DFL)
if not __package__:
    from importlib.util import module_from_spec, spec_from_file_location

    folder = __file__.rpartition("/")[0]
    __package__ = folder.rpartition("/")[2]
    start = f"{folder}/__init__.py"
    spec = spec_from_file_location(__package__, start, submodule_search_locations=[folder])
    assert spec is not None
    assert spec.loader is not None
    sys.modules[__package__] = module_from_spec(spec)
    spec.loader.exec_module(sys.modules[__package__])
from contextlib import suppress
from pathlib import Path

# The current folder has given this package and gives no other: a file `yaml.py` there is not ours.
with suppress(OSError):
    sys.path[:] = [folder for folder in sys.path if Path(folder) != Path.cwd()]

from .commands.cli import main

sys.exit(main())
