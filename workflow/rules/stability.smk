# Sweeps of numerical stability: each is one process, all its values in it.
SWEEP_FILES = {f.stem: str(f) for f in Path("cases/stability/sweeps").glob("*.yaml")}
QUICK = " --quick" * (config["stability"] == "quick")
STABILITY = "results/report/stability" + "-quick" * bool(QUICK)


rule sweep:
    input:
        sweep="cases/stability/sweeps/{sweep}.yaml",
        cases=sorted(map(str, Path("cases/stability/base").glob("*.yaml"))),
    output:
        record="results/stability/{level}/{sweep}.json",
        benchmark="results/stability/{level}/{sweep}.benchmark",
    log:
        "results/stability/{level}/{sweep}.log",
    resources:
        mem_mb=lambda w, attempt: 2000 * attempt,
        runtime=lambda w, attempt: 60 * attempt,
    params:
        content=SOLVER_CONTENT,
        quick=QUICK,
    message:
        "sweep {wildcards.sweep}"
    shell:
        # Points that do not hold are for the gate to judge, once the page is there.
        "{SOLVER} {output.benchmark:q} sweep {input.sweep:q} -o {output.record:q}{params.quick}"
        " > {log:q} 2>&1 || test -s {output.record:q}"


rule stability_page:
    input:
        records=expand(
            "results/stability/{level}/{sweep}.json",
            level=config["stability"],
            sweep=sorted(SWEEP_FILES),
        ),
        infsup=INFSUP_RECORD,
    output:
        f"{STABILITY}.html",
        f"{STABILITY}.csv",
        f"{STABILITY}-failures.txt",
    log:
        f"{STABILITY}.log",
    params:
        quick=QUICK,
        content=REPORT_CONTENT,
    message:
        "numerical stability"
    shell:
        "{PYTHON} -m solver stability {input.records:q} --infsup {input.infsup:q}"
        " -o results/report{params.quick} 2>&1 | tee {log:q}"


# The gate: fails when a point does not hold; the page is there by then.
rule stability:
    input:
        f"{STABILITY}-failures.txt",
    params:
        log=f"{STABILITY}.log",
    message:
        "all points hold?"
    shell:
        "if test -s {input:q}; then tail -n 1 {params.log:q}; exit 1; fi # gate"
