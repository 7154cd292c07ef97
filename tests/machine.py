"""What keeps a program from its work: full disks and missing permissions, made for a test."""

import os
import shutil
import subprocess
from contextlib import contextmanager

import pytest

# Root may write everywhere, unless it gives this up.
_OBEYING = ["setpriv", "--bounding-set=-dac_override,-dac_read_search"]


def obeying_permissions(command):
    """The command under a user who has to obey permissions, root or not."""
    if os.geteuid() != 0:
        return command
    if shutil.which("setpriv") is None:
        pytest.skip("setpriv is not there, and root may write everywhere")
    return [*_OBEYING, *command]


@contextmanager
def small_disk(folder, kilobytes):
    """`folder` lies on a file system of that size."""
    folder.mkdir(exist_ok=True)
    if os.geteuid() != 0:
        pytest.skip("only root can mount a small file system")
    options = ["-o", f"size={kilobytes}k"]
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", *options, "tmpfs", folder], capture_output=True, text=True
    )
    if mounted.returncode != 0:
        pytest.skip(f"no file system can be mounted here: {mounted.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", folder], check=True)
