# Growth with size: each point is a job of its own, so that what is measured is not measured again.
# A point takes all cores of the run: nothing runs beside it.
SCALING_FILE = "cases/scaling/scaling.yaml"
SCALE = config["scaling"]
SCALED = f"results/scaling/{SCALE}"
SCALING_PAGE = "scaling" if SCALE == "full" else f"scaling-{SCALE}"


@cache
def scaling():
    from solver.studies.scaling.description import read_scaling

    return points_of(read_scaling, SCALING_FILE, SCALE)


# A point always ends with a record, whatever became of it.
rule scaling_point:
    input:
        case=lambda w: str(scaling()[w.point].series.case),
        scaling=SCALING_FILE,
    output:
        f"{SCALED}/{{point}}.json",
    wildcard_constraints:
        point="[^/]+/[0-9]+",
    threads: lambda w: workflow.cores
    params:
        content=SOLVER_CONTENT,
    message:
        "measure {wildcards.point}"
    shell:
        "{PYTHON} -m solver scaling point {SCALING_FILE:q} {wildcards.point:q} --size {SCALE}"
        " -o {output:q}"


rule scaling:
    input:
        records=lambda w: [f"{SCALED}/{point}.json" for point in scaling()],
        scaling=SCALING_FILE,
    output:
        f"results/report/{SCALING_PAGE}.html",
        f"results/report/{SCALING_PAGE}.csv",
        f"results/report/{SCALING_PAGE}-exponents.csv",
    log:
        f"results/report/{SCALING_PAGE}.log",
    params:
        content=REPORT_CONTENT,
    message:
        "growth with size"
    shell:
        "{PYTHON} -m solver scaling page {input.scaling:q} --size {SCALE} --results {SCALED:q}"
        " -o results/report 2>&1 | tee {log:q}"
