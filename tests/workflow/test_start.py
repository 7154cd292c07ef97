"""How Snakemake is started: `workflow/start.py`."""

import runpy
import signal
import sys

import pytest
from snakemake import cli

from tests.workflow.projects import ROOT


@pytest.fixture(autouse=True)
def _ctrl_c():
    """The start ends with the system's own handling of Ctrl-C, here in the process of the tests."""
    handler = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, handler)


@pytest.mark.parametrize(
    ("words", "limited"),
    [([], False), (["--executor", "local"], False), (["--executor", "slurm"], True)],
)
def test_jobs_on_this_machine_are_not_limited_in_a_second(words, limited, monkeypatch):
    """It wakes the scheduler each second for every job so far; a cluster's queue needs it."""
    seen = []
    parsed = cli.get_argument_parser().parse_args([])
    parsed.executor = words[1] if words else None
    monkeypatch.setattr(cli, "parse_args", lambda argv: (None, parsed))
    monkeypatch.setattr(cli, "args_to_api", lambda given, parser: seen.append(given) or True)
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(ROOT / "workflow" / "start.py"))
    assert end.value.code == 0
    assert (seen[0].max_jobs_per_timespan is not None) == limited


def test_an_error_of_snakemake_ends_the_run(monkeypatch, caplog):
    """As its own command does: status 1, and the error in words."""
    monkeypatch.setattr(sys, "argv", ["start.py", "--workflow-profile", "none", "--cores", "few"])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(ROOT / "workflow" / "start.py"))
    assert end.value.code in (1, 2)
    assert "number of cores" in caplog.text
