# Error against run time: each point of the study is a job of its own, so that what is measured is
# not measured again. A point takes all cores of the run, whatever it uses: nothing runs beside it.
STUDY_FILE = "cases/study/study.yaml"
SIZE = config["study"]
POINTS = f"results/study/{SIZE}"
PAGE = "study" if SIZE == "full" else f"study-{SIZE}"


@cache
def study():
    from solver.studies.work_precision.description import read_study

    return points_of(read_study, STUDY_FILE, SIZE)


def reference_of(w):
    """The refined result that a point is compared with, where its problem has no exact solution."""
    problem = study()[w.point].problem
    return [f"results/study/references/{problem.name}.vtkhdf"] * bool(problem.reference)


rule study_reference:
    input:
        case=lambda w: next(
            str(p.problem.case)
            for p in study().values()
            if p.problem.name == w.problem
        ),
        study=STUDY_FILE,
    output:
        "results/study/references/{problem}.vtkhdf",
    log:
        "results/study/references/{problem}.log",
    params:
        content=SOLVER_CONTENT,
    message:
        "reference of {wildcards.problem}"
    shell:
        "{PYTHON} -m solver study reference {STUDY_FILE:q} {wildcards.problem:q} -o {output:q}"
        " > {log:q} 2>&1"


# A point always ends with a record, whatever became of it.
rule study_point:
    input:
        case=lambda w: str(study()[w.point].problem.case),
        reference=reference_of,
        study=STUDY_FILE,
    output:
        f"{POINTS}/{{point}}.json",
    wildcard_constraints:
        point=".+/.+/.+/[0-9]+",
    threads: lambda w: workflow.cores
    params:
        content=SOLVER_CONTENT,
        reference=lambda w, input: [f"--reference {r}" for r in input.reference],
    message:
        "measure {wildcards.point}"
    shell:
        "{PYTHON} -m solver study point {STUDY_FILE:q} {wildcards.point:q} --size {SIZE}"
        " {params.reference} -o {output:q}"


rule study:
    input:
        records=lambda w: [f"{POINTS}/{point}.json" for point in study()],
        study=STUDY_FILE,
    output:
        f"results/report/{PAGE}.html",
        f"results/report/{PAGE}.csv",
    log:
        f"results/report/{PAGE}.log",
    params:
        content=REPORT_CONTENT,
    message:
        "error against run time"
    shell:
        "{PYTHON} -m solver study page {input.study:q} --size {SIZE} --results {POINTS:q}"
        " -o results/report 2>&1 | tee {log:q}"
