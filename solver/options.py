"""The number of threads, an option of several commands."""

import argparse
import os

_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def add_threads(command: argparse.ArgumentParser) -> None:
    """Let a command take `--threads`."""
    command.add_argument("--threads", type=int, metavar="N", help="where the environment sets none")


def limit_threads(number: int) -> None:
    """Tell the libraries, which read it when they are loaded; the environment comes first."""
    for variable in _VARIABLES:
        os.environ.setdefault(variable, str(number))
