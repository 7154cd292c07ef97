# Refinement ladders: each level is a solve of its own, so that what is there is not solved again.
LADDER_FILES = sorted(
    str(f)
    for f in Path("cases").glob("*/orders.yaml")
    if f.parent.name in (listed(config["family"]) or [f.parent.name])
)


@cache
def ladders():
    """The jobs of all ladders by (family, folder), and their levels."""
    from solver.studies.orders.description import read_ladders

    found = {}
    for file in LADDER_FILES:
        family = read_ladders(Path(file))
        for ladder in family.ladders:
            for job in jobs_of(ladder.case):
                if job.hexahedra is None:
                    name = ladder.folder(job.swap)
                    job = job._replace(name=name, hexahedra=ladder.hexahedra, mesh=None)
                    found[family.name, name] = job, ladder
    return found


def level_file(w):
    return ladders()[w.family, w.job][0].file


def level_options(w):
    """How the command line is told which level of which ladder this is."""
    job, ladder = ladders()[w.family, w.job]
    return (
        f"--refine {w.level}"
        + " --swap" * job.swap
        + (f" --hexahedra {job.hexahedra}" if job.hexahedra else "")
        + (f" --recovery {ladder.recovery}" if ladder.recovery else "")
    )


use rule solve as solve_level with:
    input:
        case=level_file,
        sources=SOLVER_SOURCES,
    output:
        verdict="results/orders/{family}/{job}/{level}/verdict.json",
    log:
        "results/orders/{family}/{job}/{level}/log",
    resources:
        mem_mb=lambda w, attempt: memory(level_file(w), attempt, int(w.level)),
        runtime=lambda w, attempt: minutes(level_file(w), attempt, int(w.level)),
    params:
        benchmark="results/orders/{family}/{job}/{level}/benchmark",
        result="results/orders/{family}/{job}/{level}/result.vtkhdf",
        content=lambda w: contents(level_file(w), *SOLVER_SOURCES),
        options=level_options,
    message:
        "solve {wildcards.job} refined {wildcards.level} times"


rule orders_page:
    input:
        verdicts=lambda w: [
            f"results/orders/{family}/{name}/{level}/verdict.json"
            for (family, name), (_, ladder) in ladders().items()
            for level in ladder.levels
        ],
        ladders=LADDER_FILES,
        families=[
            str(f)
            for f in (Path(file).with_name("family.yaml") for file in LADDER_FILES)
            if f.is_file()
        ],
        sources=REPORT_SOURCES,
    output:
        "results/report/orders.html",
        "results/report/orders.csv",
        "results/report/orders-points.csv",
        "results/report/orders-failures.txt",
    log:
        "results/report/orders.log",
    message:
        "orders of convergence"
    shell:
        "{PYTHON} -m solver orders {input.ladders:q} --results results/orders -o results/report"
        " 2>&1 | tee {log:q}"


# The gate: fails when a level has no result or a slope is not reached; the page is there by then.
rule orders:
    input:
        "results/report/orders-failures.txt",
    message:
        "all orders reached?"
    shell:
        "! test -s {input:q}"
