# Growth with size: each point is a job of its own, so that what is measured is not measured again.
# A point takes all cores of the run: nothing runs beside it.
SCALING_FILE = "cases/scaling/scaling.yaml"
SCALE = config["scaling"]
SCALED = f"results/scaling/{SCALE}"
SCALING_PAGE = "scaling" if SCALE == "full" else f"scaling-{SCALE}"


@cache
def scaling():
    """The points by name; says how long those that are missing will take."""
    from solver.errors import InputError
    from solver.scaling.description import read_scaling
    from solver.scaling.expected import model
    from solver.study.expected import announcement

    try:
        content = read_scaling(Path(SCALING_FILE), SCALE)
    except InputError as error:
        raise WorkflowError(str(error)) from None
    newest = max(Path(s).stat().st_mtime for s in [SCALING_FILE, *SOLVER_SOURCES])
    pending = [
        point.name
        for point in content.points
        if older(f"{SCALED}/{point.name}.json", newest)
    ]
    logger.info(announcement(content, model(content), Path(SCALED), pending))
    return {point.name: point for point in content.points}


# A point always ends with a record, whatever became of it.
rule scaling_point:
    input:
        case=lambda w: str(scaling()[w.point].series.case),
        sources=[SCALING_FILE, *SOLVER_SOURCES],
    output:
        f"{SCALED}/{{point}}.json",
    wildcard_constraints:
        point="[^/]+/[0-9]+",
    threads: lambda w: workflow.cores
    message:
        "measure {wildcards.point}"
    shell:
        "{PYTHON} -m solver scaling point {SCALING_FILE:q} {wildcards.point:q} --size {SCALE}"
        " -o {output:q}"


rule scaling:
    input:
        records=lambda w: [f"{SCALED}/{point}.json" for point in scaling()],
        scaling=SCALING_FILE,
        sources=REPORT_SOURCES,
    output:
        f"results/report/{SCALING_PAGE}.html",
        f"results/report/{SCALING_PAGE}.csv",
        f"results/report/{SCALING_PAGE}-exponents.csv",
    log:
        f"results/report/{SCALING_PAGE}.log",
    message:
        "growth with size"
    shell:
        "{PYTHON} -m solver scaling page {input.scaling:q} --size {SCALE} --results {SCALED:q}"
        " -o results/report 2>&1 | tee {log:q}"
