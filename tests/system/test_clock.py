"""What the clock of stages counts."""

import resource
import subprocess
import sys

from solver.system.progress import Clock


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
