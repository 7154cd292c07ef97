"""The warm process: all modules are loaded, and each command runs in a fork of it.

A fork is a separate process: it may crash, run out of memory or be killed without effect on others.
It runs the command as `python -m solver` does, on the standard output and error of its client
(`solver.commands.warm`).
"""

import gc
import importlib
import json
import os
import pkgutil
import runpy
import select
import signal
import socket
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NoReturn

from ..system.package import PACKAGE
from ..system.provenance import gather
from .cli import parser
from .warm import GREETING, LIMIT, THREADS, outcome

# Modules that the solver imports late. The command itself reports a missing one.
_LATE = (
    "gmsh",
    "skfem.element",
    "cvxopt.cholmod",
    "scipy.optimize",
    "scipy.sparse.linalg",
    "tomllib",
)
_INPUT = 0
_BUG = 70


def serve(listener: socket.socket) -> None:
    """Run the commands of all clients, each in a fork, until standard input ends.

    Forks that are at work then come to their end; Ctrl-C is for them, not for their server.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    load()
    while _INPUT not in select.select([listener.fileno(), _INPUT], [], [])[0]:
        client, _ = listener.accept()
        if os.fork() == 0:
            listener.close()
            _end(partial(_answer, client))
        client.close()
        _reap(os.WNOHANG)
    listener.close()
    _reap()


def _reap(options: int = 0) -> None:
    """Collect the forks that have ended, or wait for all."""
    with suppress(ChildProcessError):
        while os.waitpid(-1, options)[0]:
            pass


def load() -> None:
    """Do once what every fork would: import the solver, find versions, declare the command line.

    All of it is excluded from garbage collection, so that forks share it.
    """
    ours = [
        module.name
        for module in pkgutil.walk_packages(sys.modules[PACKAGE].__path__, f"{PACKAGE}.")
    ]
    for name in (*_LATE, *ours):
        if not name.endswith("__main__"):
            with suppress(ImportError, OSError):
                importlib.import_module(name)
    gather(Path(), None)
    parser()
    gc.collect()
    gc.freeze()


def _answer(client: socket.socket) -> int:
    """Run the client's command in a separate process and report how it ended."""
    client.send(GREETING)
    message, streams, *_ = socket.recv_fds(client, LIMIT, 2)
    request = json.loads(message or "{}")
    # Libraries read the number of threads when they are loaded: no answer for another number.
    if request.get("threads") == os.environ.get(THREADS):
        process = os.fork()
        if process == 0:
            client.close()
            _end(partial(_run, request["command"], streams))
        client.send(json.dumps(outcome(process)).encode())
    return 0


def _run(command: Sequence[str], streams: Sequence[int]) -> int:
    """Run a command as `python -m solver` does; its exit status."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    nothing = os.open(os.devnull, os.O_RDONLY)
    for number, stream in enumerate((nothing, *streams)):
        os.dup2(stream, number)
        os.close(stream)
    sys.argv = [PACKAGE, *command]
    sys.orig_argv = [sys.executable, "-m", *sys.argv]
    try:
        runpy.run_module(PACKAGE, run_name="__main__", alter_sys=True)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else _BUG
    return 0


def _end(run: Callable[[], int]) -> NoReturn:
    """Run and end this fork without the exit handlers of its parent."""
    status = _BUG
    try:
        status = run()
        sys.stdout.flush()
    finally:
        sys.stderr.flush()
        os._exit(status)
