"""Install what the project needs into `.venv`: `python3 workflow/install GROUP…`.

A group is one lock file: `run` is requirements.txt, `test` is requirements-test.txt, and so on.
Only the standard library is used, and this file has to be readable by any Python 3, so that an
old one is told what is missing.
"""

import sys

if sys.version_info < (3, 11):
    version = "{}.{}".format(*sys.version_info[:2])
    sys.exit(
        "Python 3.11 or newer is needed, this is %s (%s): name a newer one, for example "
        "make PYTHON=python3.12" % (version, sys.executable)
    )

import argparse

import environment
import libraries
from errors import InstallError


def main() -> None:
    """Bring `.venv` up to date with the lock files of the groups on the command line."""
    parser = argparse.ArgumentParser(prog="python3 workflow/install", description=__doc__)
    parser.add_argument("groups", nargs="+", metavar="GROUP", help="run, test, lint, lock …")
    arguments = parser.parse_args()
    try:
        groups = environment.wanted(arguments.groups)
        if not environment.current(groups):
            environment.install(groups)
            environment.stamp(groups)
        environment.share()
        environment.keep_scripts()
        # An environment out of a cache may have been completed on another system.
        if not environment.complete() or libraries.missing(environment.VENV):
            libraries.provide(environment.VENV)
            environment.stamp(groups, complete=True)
    except InstallError as error:
        sys.exit(f"installation: {error}")


main()
