"""Case files as tests of pytest: copy this file beside the folder `cases`."""

from pathlib import Path

import pytest

from solver import solve_case


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Each YAML file in a folder `cases` is a case."""
    if file_path.suffix == ".yaml" and file_path.parent.name == "cases":
        return CaseFile.from_parent(parent, path=file_path)
    return None


class CaseFile(pytest.File):
    """A file with one test: its verdict."""

    def collect(self) -> list[pytest.Item]:
        """The test."""
        return [CaseTest.from_parent(self, name=self.path.stem)]


class CaseTest(pytest.Item):
    """Passes where the case passes; one without a reference is solved, and does not."""

    def runtest(self) -> None:
        """Solve."""
        solved = solve_case(self.path)
        if not solved.passed:
            pytest.fail(f"{self.name}: {solved.verdict}: {solved.reason}", pytrace=False)
