"""The progress of a run: a line for each solve that ends, and the state of the run.

Snakemake logs the start and the end of each job as an event; a filter of its logger receives them,
whatever is shown. On a terminal the state of the run is its last line, rewritten in place; in a
file it is a line a minute.
"""

import logging
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Event, RLock, Thread
from typing import Any, TextIO

from solver.system.files import last_line

# The rules whose jobs are counted, with the word for one of their jobs.
COUNTED = {"solve": "solve", "measure": "group"}
# Rules whose jobs print by themselves: the last line is left to them while they run.
VERBOSE_RULES = ("report", "study_page")
# Lines of Snakemake that are useless beside the jobs.
_CHATTER = (
    *("Select jobs", "Execute ", "Using shell", "Assuming unrestricted", "Touching output"),
    *("Removing temporary output", "Complete log", "Elapsed time", "Exiting because a job"),
    "WorkflowError:\nAt least one job did not complete",
)
# Rules that fail if a check does, and the end of their commands: they print the outcome
# themselves.
_GATES = ("gate", "orders", "study", "stability", "infsup", "scaling", "benchmark")
_GATE_MARK = "# gate"
_GOOD = ("passed", "solved")
_BAD = ("failed", "unreliable", "refused", "crashed")
_EVENTS = ("job_info", "job_started", "job_finished", "progress", "run_info", "resources_info")
_ON_TERMINAL, _IN_FILE = 1.0, 60.0
# A job that has run for so many seconds tells its stage.
_LEAST_SECONDS = 5.0


@dataclass(frozen=True)
class Running:
    """A running job: its rule, message, log if any, and start time."""

    rule: str
    message: str
    log: Path | None
    began: float


class State:
    """The state of a run, by the events of its jobs; `clock` returns seconds."""

    def __init__(self, clock: Callable[[], float] = time.monotonic):
        self.clock = clock
        self.running: dict[int, Running] = {}
        self.total = self.done = self.bad = 0
        self.broken: set[int] = set()
        self.word = "job"

    def expect(self, jobs: Mapping[str, int]) -> None:
        """Set the expected numbers of jobs by rule."""
        rules = [rule for rule in COUNTED if jobs.get(rule)]
        self.total = sum(jobs[rule] for rule in rules)
        words = {COUNTED[rule] for rule in rules}
        self.word = words.pop() if len(words) == 1 else "job"

    def start(self, number: int, rule: str, message: str, log: Path | None) -> None:
        """A job starts, possibly again."""
        self.broken.discard(number)
        self.running[number] = Running(rule, message, log, self.clock())

    def fail(self, number: int) -> None:
        """A job fails; it may start again."""
        self.running.pop(number, None)
        self.broken.add(number)

    def end(self, number: int) -> str | None:
        """A job ends; the last line of its log with the count, if it is one that counts."""
        job = self.running.pop(number, None)
        if job is None or job.rule not in COUNTED:
            return None
        self.done += 1
        said = last_line(job.log)
        what = said.partition(": ")[2]
        if job.rule == "solve":  # refused or without a solution: the reason alone
            self.bad += bool(said) and not what.startswith(_GOOD)
        else:
            self.bad += what.startswith(_BAD)
        return f"{said} [{self.done}/{self.total}]" if said else None

    @property
    def not_passed(self) -> int:
        """The number of solves that did not pass, plus the number of failed jobs."""
        return self.bad + len(self.broken)

    @property
    def talking(self) -> bool:
        """Whether a running job prints by itself."""
        return any(job.rule in VERBOSE_RULES for job in self.running.values())

    def text(self) -> str:
        """The state in one line."""
        parts = [f"{self.done} of {self.total} {self.word}s done"]
        parts += [f"{self.not_passed} not passed"] * bool(self.not_passed)
        parts += [f"{len(self.running)} running"] * bool(self.running)
        return ", ".join(parts) + self._longest()

    def _longest(self) -> str:
        """The job that has run longest, with the last line of its log."""
        jobs = sorted(self.running.values(), key=lambda job: job.began)
        if not jobs:
            return ""
        seconds = self.clock() - jobs[0].began
        said = last_line(jobs[0].log) if seconds > _LEAST_SECONDS else ""
        return f" – {jobs[0].message}" + (f" ({duration(seconds)}): {said}" if said else "")


class Progress(logging.Filter):
    """Turns the events of Snakemake's logger into lines; lets all records pass.

    Ends of solves go to `out`, the state to `status`.
    """

    def __init__(self, out: TextIO, status: TextIO, state: State | None = None):
        super().__init__()
        self.out, self.status, self.state = out, status, state or State()
        self.terminal = status.isatty()
        self._lock, self._stop, self._shown = RLock(), Event(), False

    def filter(self, record: logging.LogRecord) -> bool:
        """Handle an event; never drops a record."""
        with self._lock:
            self._wipe()
            self._hear(str(getattr(record, "event", None) or ""), record.__dict__)
        return True

    def _hear(self, event: str, of: Mapping[str, Any]) -> None:
        state, line = self.state, None
        if event == "run_info":
            state.expect(of["stats"])
            Thread(target=self._tick, daemon=True).start()
        elif event == "job_info":
            log = next(iter(of["log"]), None)
            message = of["rule_msg"] or of["rule_name"]
            state.start(of["jobid"], of["rule_name"], message, Path(log) if log else None)
        elif event == "job_finished":
            line = state.end(of["job_id"])
        elif event == "job_error":
            state.fail(of["jobid"])
        if line:
            print(line, file=self.out, flush=True)
        if self.terminal and (line or event == "job_info"):
            self._show()

    def _tick(self) -> None:
        while not self._stop.wait(_ON_TERMINAL if self.terminal else _IN_FILE):
            with self._lock:
                self._show()

    def _show(self) -> None:
        """Write the state, unless another job is printing."""
        state = self.state
        if self._stop.is_set() or state.talking or not state.total or state.done == state.total:
            return
        if self.terminal:
            width = shutil.get_terminal_size().columns - 1
            self._wipe()
            self.status.write(state.text()[:width])
            self._shown = True
        else:
            self.status.write(f"{time.strftime('%H:%M:%S')} {state.text()}\n")
        self.status.flush()

    def _wipe(self) -> None:
        if self._shown:
            self.status.write("\r\x1b[K")
            self.status.flush()
            self._shown = False

    def close(self) -> None:
        """Leave the terminal clean."""
        with self._lock:
            self._stop.set()
            self._wipe()


def hides(record: logging.LogRecord) -> bool:
    """Whether a record is useless beside the progress."""
    event, message = str(getattr(record, "event", None) or ""), record.getMessage()
    if event == "job_error":
        return getattr(record, "rule_name", None) in _GATES
    failed_gate = message.startswith("RuleException:") and _GATE_MARK in message
    return event in _EVENTS or failed_gate or message.startswith(_CHATTER)


def duration(seconds: float) -> str:
    """Seconds in words."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
