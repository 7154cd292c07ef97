"""A sample of the kills that `make kills` does by the hundred.

A whole batch is killed in `test_workflow`.
"""

from tests.workflow.kills import kill_at_random


def test_what_is_killed_recovers(tmp_path):
    targets = ["mesh", "batch's job", "solve", "report", "batch's server"]
    failures, struck = kill_at_random(tmp_path / "project", len(targets), 1, targets)
    assert failures == []
    assert struck.total() == len(targets)
