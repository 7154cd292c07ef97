"""Work in forks: each task is done once, and a fork that fails leaves its caller unharmed."""

import os
import sys

import pytest

from solver.system.process import in_forks

forking = pytest.mark.skipif(sys.platform != "linux", reason="forks are for Linux")


@forking
def test_forks_do_each_task_once_while_the_caller_works(tmp_path):
    def task(number):
        with (tmp_path / str(number)).open("a") as file:
            file.write(f"{os.getpid()}\n")

    tasks = [lambda n=n: task(n) for n in range(7)]
    with in_forks(tasks, 3):
        here = os.getpid()
    done = [(tmp_path / str(n)).read_text().split() for n in range(7)]
    assert [len(processes) for processes in done] == [1] * 7
    assert len({process for (process,) in done}) == 3
    assert str(here) not in {process for (process,) in done}


@forking
def test_a_fork_that_fails_does_no_harm(tmp_path):
    def fail():
        raise ValueError("in a fork")

    tasks = [fail, (tmp_path / "other").touch, (tmp_path / "after it").touch]
    with in_forks(tasks, 2):
        pass
    assert sorted(file.name for file in tmp_path.iterdir()) == ["other"]


def test_one_process_leaves_the_work_to_its_caller(tmp_path):
    with in_forks([(tmp_path / "done").touch] * 3, 1):
        pass
    assert not list(tmp_path.iterdir())


@forking
def test_an_error_of_the_caller_waits_for_the_forks(tmp_path):
    with pytest.raises(ValueError, match="mine"), in_forks([(tmp_path / "done").touch] * 2, 2):
        raise ValueError("mine")
    assert (tmp_path / "done").is_file()
    with pytest.raises(ChildProcessError):
        os.waitpid(-1, os.WNOHANG)
