# Stability in the sense of theory: the inf-sup test and the half-loaded block, in one process.
INFSUP_RECORD = f"results/stability/infsup-{config['stability']}.json"


rule infsup_record:
    input:
        ladders="cases/stability/infsup/infsup.yaml",
    output:
        record=INFSUP_RECORD,
        benchmark=f"{INFSUP_RECORD}.benchmark",
    log:
        f"{INFSUP_RECORD}.log",
    resources:
        mem_mb=lambda w, attempt: 2000 * attempt,
        runtime=lambda w, attempt: 60 * attempt,
    params:
        content=SOLVER_CONTENT,
        quick=" --quick" * (config["stability"] == "quick"),
    message:
        "inf-sup test"
    shell:
        "{SOLVER} {output.benchmark:q} infsup {input.ladders:q} -o {output.record:q}{params.quick}"
        " > {log:q} 2>&1"


rule infsup_page:
    input:
        record=INFSUP_RECORD,
    output:
        "results/report/infsup.html",
        "results/report/infsup.csv",
        "results/report/infsup-failures.txt",
    log:
        "results/report/infsup.log",
    params:
        content=REPORT_CONTENT,
    message:
        "page of the inf-sup test"
    shell:
        "{PYTHON} -m solver infsup-page {input.record:q} -o results/report 2>&1 | tee {log:q}"


# The gate: fails when the cut's constant does not level off; the page is there by then.
rule infsup:
    input:
        "results/report/infsup-failures.txt",
    params:
        log="results/report/infsup.log",
    message:
        "inf-sup constants level off?"
    shell:
        "if test -s {input:q}; then tail -n 1 {params.log:q}; exit 1; fi # gate"
