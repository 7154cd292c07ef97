"""Settings of all tests: the same examples every time, and no deadline on a busy machine."""

import gc
import os

from hypothesis import settings

settings.register_profile("project", deadline=None, derandomize=True)
settings.load_profile("project")
# Output is buffered in the processes of the tests as it is on a user's machine.
os.environ.pop("PYTHONUNBUFFERED", None)
# `make test ARGS=…` hands its settings down to any make that a test runs.
for name in ("MAKEFLAGS", "MAKEOVERRIDES", "MFLAGS", "ARGS"):
    os.environ.pop(name, None)
# Thousands of tests keep many objects. To look for cycles among them as often as Python does by
# itself takes an eighth of the time.
gc.set_threshold(50_000, 20, 50)
