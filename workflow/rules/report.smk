# Pages of other targets: the report links those that are there. They are no inputs: after a change
# of the solver the report must not run ladders and studies first.
PAGES = [
    f"results/report/{name}.html"
    for name in ("orders", "study", "stability", "scaling", "infsup")
]
PAGES = [page for page in PAGES if os.path.isfile(page)]


def solved_by(verdict):
    """The job, by folder and name, that is solved again in another code's verdict."""
    *_, family, name, _ = Path(verdict).parts
    return family, name.partition("@")[0]


# Results of other codes on cases of the batch: shown beside ours.
CODES = sorted(
    verdict
    for verdict in map(str, Path("results").glob("*/*@*/verdict.json"))
    if solved_by(verdict) in BATCH
)
ASKED = [job.verdict for job in RUN.values()]
# Older results: where a family or a case is asked for, those of all others are shown too.
OLDER = [
    *(
        j.verdict
        for k, j in BATCH.items()
        if k not in RUN and os.path.isfile(j.verdict)
    ),
    *(verdict for verdict in CODES if solved_by(verdict) not in RUN),
]
# What the families are about, of whichever folder their cases lie in.
FAMILY_FILES = sorted(
    {
        str(file)
        for job in BATCH.values()
        if (file := Path(job.file).with_name("family.yaml")).is_file()
    }
)
RECORDED = sorted(
    str(file) for f in FAMILY_FILES for file in Path(f).parent.glob("recorded/*.yaml")
)
# Lists of verdicts: the system takes 128 kB for a job's shell command, 2,800 of them.
VERDICTS, OLDER_VERDICTS = ".snakemake/verdicts", ".snakemake/older-verdicts"


def list_verdicts():
    """Write the lists of verdicts that the report reads: of this run, and older ones."""
    mine = ASKED + [verdict for verdict in CODES if solved_by(verdict) in RUN]
    for file, verdicts in ((VERDICTS, mine), (OLDER_VERDICTS, OLDER)):
        Path(file).write_text("".join(f"{verdict}\n" for verdict in verdicts))


def of_family(w):
    return [job for job in RUN.values() if job.family == w.family]


# Of the families whose solves all belong to this run.
WHOLE = {family for family, _ in RUN} - {
    family for family, _ in BATCH.keys() - RUN.keys()
}
SAVED = [f"results/report/saved/{family}.json" for family in sorted(WHOLE)]


# The time that a family saves by the work that it leaves out.
rule saved:
    input:
        lambda w: [job.folder for job in of_family(w)],
    output:
        "results/report/saved/{family}.json",
    log:
        "results/report/saved/{family}.log",
    resources:
        mem_mb=lambda w, attempt: max(memory(job, attempt) for job in of_family(w)),
        runtime=lambda w, attempt: 6
        * max(minutes(job, attempt) for job in of_family(w)),
    params:
        program=SOLVER_HASH,
    message:
        "time saved: {wildcards.family}"
    shell:
        "warm {output:q}.benchmark saved results/{wildcards.family:q} -o {output:q} > {log:q} 2>&1"


# The pages of families are no outputs here: one that is missing, of a family not asked for before,
# would hide from Snakemake that the batch is another one.
rule report:
    input:
        solves=lambda w: [job.folder for job in RUN.values()],
        families=FAMILY_FILES + RECORDED,
        saved=SAVED,
    output:
        report(
            "results/report/summary.html",
            category="Verification",
            caption="../report/summary.rst",
        ),
        multiext("results/report/summary", ".json", ".md", ".csv"),
        "results/report/junit.xml",
        failures="results/report/failures.txt",
        benchmark="results/report/benchmark",
    log:
        "results/report/log",
    threads: workflow.resource_settings.cores or 1
    # What is listed is a parameter: the report is written again when it changes.
    params:
        verdicts=ASKED,
        others=OLDER,
        codes=hash_of(map(Path, CODES)),
        families=FAMILY_FILES,
        pages=PAGES,
        program=REPORT_HASH,
    message:
        "report of all cases"
    shell:
        # Cases that did not pass (status 1) are for the gate: the report is there.
        f"{{{{ OMP_NUM_THREADS=1 warm {{output.benchmark:q}} report --list {VERDICTS}"
        f" --older {OLDER_VERDICTS}"
        " --processes {threads} -o results/report"
        " --families {params.families:q} || test $? = 1; }} 2>&1 | tee {log:q}"


# The gate: the exit status of the batch. The report is there by then, whatever it says.
rule gate:
    input:
        failures="results/report/failures.txt",
    output:
        touch("results/report/passed"),
    log:
        "results/report/gate.log",
    params:
        log="results/report/log",
    message:
        "all cases passed?"
    shell:
        "if test -s {input.failures:q}; then"
        # The report of this run has just said so.
        " test {params.log:q} -nt .snakemake/run.lock || grep Report: {params.log:q} | tee {log:q};"
        " exit 1; fi # gate"
