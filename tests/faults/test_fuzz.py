"""Damaged files: a sample of what `make faults` does with many more."""

from tests.faults.fuzz import FAILED, REFUSED, fuzz, table


def test_damaged_files_are_refused_failed_or_read_correctly(tmp_path):
    attempts = list(fuzz(tmp_path, count=80, seed=2))
    assert all(attempt.sound for attempt in attempts), "\n".join(table(attempts))
    # The damage is real: most files do not get through, and of each kind some are refused.
    stopped = [a for a in attempts if a.ending in (REFUSED, FAILED)]
    assert len(stopped) > len(attempts) / 2
    assert {a.file for a in stopped if a.ending == REFUSED} == {a.file for a in attempts}
