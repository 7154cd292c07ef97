# Refinement ladders: each level is a solve of its own, so that what is there is not solved again.
LADDER_FILES = sorted(
    str(f) for f in Path("cases").glob("*/orders.yaml") if f.parent.name in FAMILIES
)


use rule solve as solve_level with:
    input:
        case=lambda w: watched(level_of(w).file),
        again=lambda w: again(f"results/orders/{w.family}/{w.job}/{w.level}"),
    output:
        directory("results/orders/{family}/{job}/{level}"),
    log:
        "results/orders/{family}/{job}/{level}/log",
    priority: lambda w: seconds(level_of(w), int(w.level))
    resources:
        mem_mb=lambda w, attempt: memory(level_of(w), attempt, int(w.level)),
        runtime=lambda w, attempt: minutes(level_of(w), attempt, int(w.level)),
    params:
        file=lambda w: level_of(w).file,
        mesh="''",
        content=lambda w: contents(level_of(w).file) + SOLVER_CONTENT,
        options=options_of_level,
        refusal="''",
    message:
        "solve {wildcards.job} refined {wildcards.level} times"


rule orders_page:
    input:
        levels=lambda w: level_folders(),
        ladders=watched(*LADDER_FILES),
        families=[
            str(f)
            for f in (Path(file).with_name("family.yaml") for file in LADDER_FILES)
            if f.is_file()
        ],
    output:
        "results/report/orders.html",
        [f"results/report/orders-{Path(f).parent.name}.html" for f in LADDER_FILES],
        "results/report/orders.csv",
        "results/report/orders-points.csv",
        "results/report/orders-recovery.csv",
        "results/report/orders-failures.txt",
    log:
        "results/report/orders.log",
    params:
        content=contents(*LADDER_FILES) + REPORT_CONTENT,
    message:
        "orders of convergence"
    shell:
        "{PYTHON} -m solver orders {input.ladders:q} --results results/orders -o results/report"
        " 2>&1 | tee {log:q}"


# The gate: fails when a level has no result or a slope is not reached; the page is there by then.
rule orders:
    input:
        failures="results/report/orders-failures.txt",
        levels=lambda w: level_folders(),
        again=lambda w: sorted({f for folder in level_folders() for f in again(folder)}),
    params:
        log="results/report/orders.log",
    message:
        "all orders reached?"
    shell:
        "if test -s {input.failures:q}; then tail -n 1 {params.log:q}; exit 1; fi # gate"
