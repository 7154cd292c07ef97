"""Runs commands in a process that may die of them: one JSON line in, one JSON line out."""

import contextlib
import io
import json
import os
import resource
import signal
import sys
from collections.abc import Sequence

SECONDS = 10.0  # of the processor: how busy the machine is does not matter
MEMORY = 6 << 30


def outcome(arguments: Sequence[str]) -> dict:
    """Status, output and error lines of one command of the solver's."""
    from solver.commands.cli import main

    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = main(arguments)
        except BaseException as error:  # noqa: BLE001 -- whatever gets out is what is looked for
            status = f"{type(error).__name__}: {error}"
    return {"status": status, "out": out.getvalue(), "err": err.getvalue()}


def serve() -> None:
    """Answer line by line; libraries' own output goes nowhere."""
    answers = os.fdopen(os.dup(1), "w")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for line in sys.stdin:
        signal.setitimer(signal.ITIMER_PROF, SECONDS)  # its signal ends the process
        answer = outcome(json.loads(line))
        signal.setitimer(signal.ITIMER_PROF, 0)
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    serve()
