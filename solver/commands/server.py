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
from typing import NoReturn

from ..system.package import PACKAGE
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
    """Run the commands of all clients, each in a fork, until standard input ends.

    Forks that are at work then come to their end. Ctrl-C is for them, not for their server, which
    passes on what a client heard before its fork existed.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    load()
    ended = _watch_forks()
    asking: set[socket.socket] = set()
    running: dict[int, socket.socket] = {}
    undisturbed: dict[socket.socket, int] = {}
    while True:
        waiting: list[int | socket.socket] = [_INPUT, ended, listener, *asking, *undisturbed]
        ready = select.select(waiting, [], [])[0]
        for client in [client for client in undisturbed if client in ready]:
            os.kill(undisturbed.pop(client), signal.SIGINT)
        if ended in ready:
            os.read(ended, LIMIT)
            _report_ends(running, os.WNOHANG)
            undisturbed = {c: process for c, process in undisturbed.items() if process in running}
        if _INPUT in ready:
            break
        for client in asking.intersection(ready):
            asking.remove(client)
            if process := _start(client, [listener, *asking, *running.values()]):
                running[process], undisturbed[client] = client, process
            else:
                client.close()
        if listener in ready:
            asking.add(_greet(listener))
    listener.close()
    for client in asking:
        client.close()
    _report_ends(running)


def _watch_forks() -> int:
    """The end of a pipe that can be read whenever a fork has ended."""
    signal.signal(signal.SIGCHLD, lambda *_: None)
    inward, outward = os.pipe()
    os.set_blocking(outward, False)
    signal.set_wakeup_fd(outward, warn_on_full_buffer=False)
    return inward


def _greet(listener: socket.socket) -> socket.socket:
    client, _ = listener.accept()
    with suppress(OSError):
        client.send(GREETING)
    return client


def _start(client: socket.socket, others: Sequence[socket.socket]) -> int:
    """Start the client's command in a fork: its process, or 0 where it is not started.

    Libraries read the number of threads when they are loaded: no answer for another number. The
    fork keeps the client's connection, so that a client whose server is killed waits for the end of
    its command; it closes all `others`.
    """
    message, streams = b"", list[int]()
    with suppress(OSError):
        message, streams, *_ = socket.recv_fds(client, LIMIT, 2)
    command, process = words(message, os.environ.get(THREADS, "")), 0
    if command and len(streams) == 2:
        process = os.fork()
        if process == 0:
            for other in others:
                other.close()
            _end(partial(_run, command, streams))
    for stream in streams:
        os.close(stream)
    return process


def _report_ends(running: dict[int, socket.socket], options: int = 0) -> None:
    """Report to its client how each fork ended that has ended, or wait for all."""
    while running:
        process, status, used = os.wait4(-1, options)
        if not process:
            return
        client = running.pop(process)
        with suppress(OSError):
            client.send(answer(status, used))
        client.close()


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
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
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
