"""What a solve reports while it works: lines with the time, where somebody may read them."""

import logging
import re
import resource
import subprocess
import sys
from threading import Thread

import pytest

from solver.commands.cli import main
from solver.system import progress
from solver.system.progress import Clock
from tests.commands.test_cli import PLANE

LINE = re.compile(r"\d\d:\d\d:\d\d \S.*")


@pytest.fixture
def solve(tmp_path, capsys):
    """Solve a small case with some options; what came to the standard error, line by line."""
    (tmp_path / "c.yaml").write_text(PLANE)

    def run(*options):
        arguments = ["solve", str(tmp_path / "c.yaml"), "-o", str(tmp_path / "r.vtkhdf"), *options]
        assert main(arguments) == 0
        return capsys.readouterr().err.splitlines()

    return run


def test_stages_unknowns_iterations_and_residuals_with_the_time(solve):
    lines = solve("--verbose")
    assert all(LINE.fullmatch(line) for line in lines)
    told = [line[9:] for line in lines]
    stages = ["mesh", "cut", "pairing", "assembly", "solve", "recovery", "checks", "write"]
    assert [line for line in told if line in stages] == stages
    text = "\n".join(told)
    assert re.search(r"^linear system of \d+ unknowns, by a factor$", text, re.MULTILINE)
    assert re.search(r"^solution 1: residual \d\.\de-\d\d$", text, re.MULTILINE)
    assert re.search(r"^contact status: iteration 1, 3 of 3 closed, 0 wrong$", text, re.MULTILINE)


def test_nothing_where_nobody_asked(solve):
    assert solve() == []
    assert solve("--quiet") == []
    assert solve("--quiet", "--verbose") == []


def test_outcomes_of_a_thread_go_to_its_function():
    said, log = [], logging.getLogger("solver.any")
    before = logging.getLogger("solver").level
    with progress.report_outcomes(said.append):
        log.log(progress.OUTCOME, "%d unknowns", 3)
        log.info("a detail")
        other = Thread(target=log.log, args=(progress.OUTCOME, "of another solve"))
        other.start()
        other.join()
    log.log(progress.OUTCOME, "nobody listens")
    assert said == ["3 unknowns"]
    assert logging.getLogger("solver").level == before


def test_the_logger_is_left_as_it_was(solve):
    logger = logging.getLogger("solver")
    before = logger.level, logger.propagate, list(logger.handlers)
    solve("--verbose")
    assert (logger.level, logger.propagate, list(logger.handlers)) == before


def test_iterations_of_a_large_system_are_told(caplog):
    import numpy as np

    from solver.mechanics.linear.krylov import conjugate_gradients

    values = np.linspace(1, 300, 400)
    with caplog.at_level(logging.INFO, "solver"):
        conjugate_gradients(lambda x: values * x, lambda x: x.copy(), np.ones(400), 1e-8, 300)
    told = [record.getMessage() for record in caplog.records]
    assert len(told) > 3
    assert re.fullmatch(r"conjugate gradients: iteration 10, residual \d\.\de-\d\d", told[0])


# What the clock of stages counts.


def processor_time_of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def test_a_stage_counts_the_processes_that_it_waited_for():
    clock, before = Clock(), processor_time_of_children()
    for _ in range(2):
        with clock.stage("read"):
            subprocess.run([sys.executable, "-c", "sum(range(10**6))"], check=True)
    spent = processor_time_of_children() - before
    assert 0 < spent <= clock.cpu_seconds["read"]
    assert list(clock.seconds) == ["read"]
