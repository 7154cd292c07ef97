"""Batches on a machine that fails: the report says why, and the next run does what is missing."""

import re
import shutil

from tests.workflow.projects import new_project, snakemake, summary, write_case

# In each process of the solver, as long as there is a file `fault`.
FAULTS = """\
import pathlib, resource, sys
fault = pathlib.Path("fault").exists() and "solve" in sys.argv
if fault and "hungry" in str(sys.argv):
    import solver.verification.run
    used = int(pathlib.Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2**24, used + 2**24))
"""


def test_what_the_machine_kept_from_is_done_by_the_next_run(tmp_path):
    project = new_project(tmp_path / "project")
    cases = project / "cases" / "tiny"
    for case in cases.glob("tiny-*.yaml"):
        case.unlink()
    for name in ("good", "hungry", "meshless", "own"):
        write_case(cases, name)
    recipe = re.search(r"mesh: \{.*?\}\}\n", (cases / "own.yaml").read_text(), re.DOTALL)[0]
    (cases / "own.yaml").write_text(
        (cases / "own.yaml").read_text().replace(recipe, "mesh: {file: own.vtkhdf}\n")
    )
    main = project / "solver" / "__main__.py"
    main.write_text(FAULTS + main.read_text())
    (project / "fault").touch()

    run = snakemake(project)

    assert run.returncode != 0
    told = {name: (v["verdict"], v["reason"]) for name, v in summary(project).items()}
    assert {name: verdict for name, (verdict, _) in told.items()} == {
        "good": "passed",
        "hungry": "refused",
        "meshless": "passed",
        "own": "refused",
    }
    assert re.search("memory = .* are free", told["hungry"][1])
    assert "no such file" in told["own"][1]

    (project / "fault").unlink()
    meshes = project / "results" / "meshes" / "tiny"
    (meshes / "meshless" / "mesh.vtkhdf").unlink()  # as a kill of its job leaves it
    shutil.copy(meshes / "good" / "mesh.vtkhdf", cases / "own.vtkhdf")
    again = snakemake(project)
    assert again.returncode == 0, again.stdout
    assert all(verdict["passed"] for verdict in summary(project).values())
    done = set(re.findall(r"^(\S+): passed, .*$", again.stdout, re.MULTILINE))
    assert done == {"hungry", "own"}
