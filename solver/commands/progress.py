"""The progress of a run: a line for each solve that ends.

Snakemake logs the start and the end of each job as an event; a filter of its logger receives them,
whatever is shown.
"""

import logging
from pathlib import Path
from typing import TextIO

from ..system.files import last_line

# The rules whose jobs are counted.
_COUNTED = ("solve", "measure")
# Lines of Snakemake that are useless beside the jobs.
_CHATTER = (
    *("Select jobs", "Execute ", "Using shell", "Assuming unrestricted", "Touching output"),
    *("Complete log", "Elapsed time", "Exiting because a job"),
    "WorkflowError:\nAt least one job did not complete",
)
_EVENTS = ("job_info", "job_started", "job_finished", "progress", "run_info", "resources_info")
# Rules that fail if a check does, and the end of their commands: they print the outcome
# themselves.
_GATES = ("gate", "orders", "study", "stability", "infsup", "scaling", "benchmark")
_GATE_MARK = "# gate"


class Progress(logging.Filter):
    """Prints the last line of each counted job's log when the job ends; lets all records pass."""

    def __init__(self, out: TextIO):
        super().__init__()
        self.out, self.total, self.done = out, 0, 0
        self.logs: dict[int, Path] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Handle an event; never drops a record."""
        event, of = str(getattr(record, "event", None) or ""), record.__dict__
        if event == "run_info":
            self.total = sum(of["stats"].get(rule, 0) for rule in _COUNTED)
        elif event == "job_info" and of["rule_name"] in _COUNTED:
            self.logs[of["jobid"]] = Path(of["log"][0])
        elif event == "job_finished" and of["job_id"] in self.logs:
            self.done += 1
            line = last_line(self.logs[of["job_id"]])
            print(f"{line} [{self.done}/{self.total}]", file=self.out, flush=True)
        return True


def hides(record: logging.LogRecord) -> bool:
    """Whether a record is useless beside the progress."""
    event, message = str(getattr(record, "event", None) or ""), record.getMessage()
    if event == "job_error":
        return getattr(record, "rule_name", None) in _GATES
    failed_gate = message.startswith("RuleException:") and _GATE_MARK in message
    return event in _EVENTS or failed_gate or message.startswith(_CHATTER)
