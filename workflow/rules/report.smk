# Verdicts of the batch that are shown but not run: where one case is asked for, all others there.
SHOWN = [verdict_of(job) for key, job in BATCH.items() if key not in RUN]


# What the families are about, of whichever folder their cases lie in.
FAMILY_FILES = sorted(
    {
        str(file)
        for job in BATCH.values()
        if (file := Path(job.file).with_name("family.yaml")).is_file()
    }
)


# The pages of families are no outputs here: one that is missing, of a family not asked for before,
# would hide from Snakemake that the batch is another one.
rule report:
    input:
        verdicts=[verdict_of(job) for job in RUN.values()],
        families=FAMILY_FILES,
        sources=REPORT_SOURCES,
    output:
        report(
            "results/report/summary.html",
            category="Verification",
            caption="../report/summary.rst",
        ),
        multiext("results/report/summary", ".json", ".md", ".csv"),
        "results/report/junit.xml",
        "results/report/failures.txt",
    log:
        "results/report/log",
    params:
        benchmark="results/report/benchmark",
        content=lambda w: contents(*FAMILY_FILES, *REPORT_SOURCES),
        shown=[verdict for verdict in SHOWN if Path(verdict).is_file()],
    message:
        "report of all cases"
    shell:
        "{SOLVER} {params.benchmark:q} report {input.verdicts:q} {params.shown:q} -o results/report"
        " --families {input.families:q} 2>&1"
        " | tee {log:q}"


# The gate: the exit status of the batch. The report is there by then, whatever it says.
rule gate:
    input:
        "results/report/failures.txt",
    output:
        touch("results/report/passed"),
    params:
        line=f"^{config['case']}: " if config["case"] else "^",
    message:
        "all cases passed?"
    shell:
        "! grep --quiet {params.line:q} {input:q}"
