"""The order of the jobs of a batch."""

import re
import shutil

from tests.workflow.projects import new_project, snakemake, write_case


def test_the_longest_cases_go_first(tmp_path):
    project = new_project(tmp_path / "sizes")
    shutil.rmtree(project / "cases" / "tiny")
    # Against the order of names, numbers and files.
    by_size = {"c": 12, "a": 9, "d-1": 6, "b": 3}
    for name in sorted(by_size):
        write_case(project / "cases" / "sizes", name)
        file = project / "cases" / "sizes" / f"{name}.yaml"
        text = file.read_text()
        assert text.count("[2, 2]") == 1
        file.write_text(text.replace("[2, 2]", f"[{by_size[name]}, {by_size[name]}]"))
    done = snakemake(project, "--cores", "1")
    assert done.returncode == 0, done.stdout
    assert re.findall(r"^(\S+): passed", done.stdout, re.MULTILINE) == list(by_size)
