# Pages of other targets: the report links those that are there. They are no inputs: after a change
# of the solver the report must not run ladders and studies first.
NAMES = ("orders", "study", "stability", "scaling", "infsup")
PAGES = [page for n in NAMES if os.path.isfile(page := f"results/report/{n}.html")]
# The report shows what else there is in results: other codes on cases, and solves that this run does
# not ask for. It is written again when any of these verdicts changes.
OTHERS = sorted(
    verdict for verdict in Path("results").glob("*/*/verdict.json") if verdict.parts[1:3] not in RUN
)
# What the families are about, of whichever folder their cases lie in.
CASES = {Path(job.file).parent for job in BATCH.values()}
FAMILY_FILES = sorted(str(file) for folder in CASES for file in folder.glob("family.yaml"))
RECORDED = sorted(str(file) for folder in CASES for file in folder.glob("recorded/*.yaml"))


# Of the families whose solves all belong to this run.
WHOLE = {family for family, _ in RUN} - {family for family, _ in BATCH.keys() - RUN.keys()}
SAVED = [f"results/report/saved/{family}.json" for family in sorted(WHOLE)]


def of_family(w):
    return [job for job in RUN.values() if job.family == w.family]


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
        runtime=lambda w, attempt: 6 * max(minutes(job, attempt) for job in of_family(w)),
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
    params:
        run=sorted(job.folder for job in RUN.values()),
        others=hash_of(OTHERS),
        families=FAMILY_FILES,
        pages=PAGES,
        program=REPORT_HASH,
    message:
        "report of all cases"
    shell:
        # Cases that did not pass (status 1) are for the gate: the report is there.
        f"{{{{ OMP_NUM_THREADS=1 warm {{output.benchmark:q}} report --run {RUN_LIST}"
        " -o results/report"
        " --families {params.families:q} || test $? = 1; }} 2>&1 | tee {log:q}"


# The gate: the exit status of the batch. The report is there by then, whatever it says.
rule gate:
    input:
        failures="results/report/failures.txt",
    output:
        touch("results/report/passed"),
    log:
        "results/report/gate.log",
    message:
        "all cases passed?"
    shell:
        "if test -s {input.failures:q}; then"
        # The report of this run has just said so.
        " test results/report/log -nt .snakemake/run.lock"
        " || grep Report: results/report/log | tee {log:q};"
        " exit 1; fi # gate"
