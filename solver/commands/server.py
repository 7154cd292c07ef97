"""The warm process: all modules are loaded, and each command runs in a fork of it.

A fork is a separate process: it may crash, run out of memory or be killed without effect on others.
It runs the command as `python -m solver` does, on the standard output and error of its client
(`solver.commands.warm`).
"""

import argparse
import gc
import importlib
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
from threading import Thread
from typing import NoReturn

from ..system.package import PACKAGE
from ..system.process import fork
from ..verification.provenance import gather
from .warm import GREETING, LIMIT, THREADS, answer, words

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
    """Attend to all clients, each in a thread, until standard input ends.

    Commands that are at work then come to their end. Ctrl-C is for them, not for their server.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    load()
    sources: list[int | socket.socket] = [_INPUT, listener]
    while _INPUT not in select.select(sources, [], [])[0]:
        client, _ = listener.accept()
        Thread(target=_attend, args=(client, listener)).start()
    listener.close()


def _attend(client: socket.socket, listener: socket.socket) -> None:
    """Run the command of a client in a fork, and report to it how that ended.

    Libraries read the number of threads when they are loaded: no answer for another number, nor for
    a message that was cut off. The fork keeps the connection, so that a client whose server is
    killed waits for the end of its command. What a client hears of Ctrl-C is passed on, also where
    it came before its command existed.
    """
    with client, suppress(OSError):
        client.send(GREETING)
        message, streams, *_ = socket.recv_fds(client, LIMIT, 2)
        command, process = words(message, os.environ.get(THREADS, "")), 0
        if command and len(streams) == 2:
            process = fork()
            if process == 0:
                listener.close()
                _end(partial(_run, command, streams))
        for stream in streams:
            os.close(stream)
        if not process:
            return
        end = os.pidfd_open(process)
        sources: list[int | socket.socket] = [client, end]
        if client in select.select(sources, [], [])[0]:
            os.kill(process, signal.SIGINT)
        os.close(end)
        client.send(answer(*os.wait4(process, 0)[1:]))


def load() -> None:
    """Do once what every fork would: import the solver, find versions.

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
    gc.collect()
    gc.freeze()


def _run(command: Sequence[str], streams: Sequence[int]) -> int:
    """Run a command as `python -m solver` does; its exit status."""
    signal.signal(signal.SIGINT, _interrupted)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
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


def _interrupted(*_: object) -> NoReturn:
    """The first Ctrl-C: the terminal and the server both send it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise KeyboardInterrupt


def _end(run: Callable[[], int]) -> NoReturn:
    """Run and end this fork without the exit handlers of its parent."""
    status = _BUG
    try:
        status = run()
        sys.stdout.flush()
    except KeyboardInterrupt:
        status = 128 + signal.SIGINT
    finally:
        sys.stderr.flush()
        os._exit(status)


def add_serve(command: argparse.ArgumentParser) -> None:
    command.add_argument("socket", type=int, metavar="FD", help="an open, listening socket")


def run_serve(options: argparse.Namespace) -> int:
    """Serve on the socket."""
    with socket.socket(fileno=options.socket) as listener:
        serve(listener)
    return 0
