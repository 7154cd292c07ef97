# Studies: each group of a study's file is a job with a record, each study a page and a gate.
LEVEL = config["level"]
SUFFIX = "" if LEVEL == "full" else f"-{LEVEL}"
RECORDS = f"results/studies/{{study}}/{LEVEL}"
# The targets, and the files of their studies: `stability` has the theory too.
TARGETS = {f.stem: [str(f)] for f in sorted(Path("cases/studies").glob("*.yaml"))}
if {"stability", "infsup"} <= TARGETS.keys():
    TARGETS["stability"] += TARGETS["infsup"]
TARGETS["orders"] = sorted(
    str(f) for f in Path("cases").glob("*/orders.yaml") if f.parent.name in FAMILIES
)


@cache
def studies(target):
    """The studies of a target by name, with their files."""
    if not TARGETS[target]:
        refuse(f"{target}: no family of this run has a file {target}.yaml")
    read = part("studies.description").read_study
    found = [(file, checked(read, Path(file), LEVEL)) for file in TARGETS[target]]
    return {study.name: (file, study) for file, study in found}


def study_of(w):
    return next(studies(t)[w.study] for t in TARGETS if w.study in studies(t))


def cores_of(w):
    """A timed group has the machine for itself."""
    study = study_of(w)[1]
    timed = (study.group(w.group).measure or study.measure) in part("studies.run").APART
    return workflow.cores if timed else 1


rule measure:
    input:
        study=lambda w: study_of(w)[0],
        cases=lambda w: sorted({str(s.case) for s in study_of(w)[1].group(w.group).series}),
    output:
        record=f"{RECORDS}/{{group}}.json",
        benchmark=f"{RECORDS}/{{group}}.benchmark",
    log:
        f"{RECORDS}/{{group}}.log",
    threads: cores_of
    resources:
        mem_mb=lambda w, attempt: 2000 * attempt,
        runtime=lambda w, attempt: 120 * attempt,
    params:
        program=SOLVER_HASH,
    message:
        "measure {wildcards.study}/{wildcards.group}"
    shell:
        f"warm {{output.benchmark:q}} measure {{input.study:q}} {{wildcards.group:q}} --level {LEVEL}"
        " -o {output.record:q} > {log:q} 2>&1"


rule study_page:
    input:
        records=lambda w: [
            f"{RECORDS.format(study=w.study)}/{group.name}.json" for group in study_of(w)[1].groups
        ],
        study=lambda w: study_of(w)[0],
    output:
        f"results/report/{{study}}{SUFFIX}.html",
        f"results/report/{{study}}{SUFFIX}.csv",
        f"results/report/{{study}}{SUFFIX}-failures.txt",
    log:
        f"{RECORDS}/page.log",
    params:
        program=REPORT_HASH,
    message:
        "page of {wildcards.study}"
    shell:
        f"program study-page {{input.study:q}} --level {LEVEL}"
        f" --results results/studies/{{wildcards.study}}/{LEVEL}"
        " -o results/report 2>&1 | tee {log:q}"


# The gates: each fails when something of its studies does not hold; the pages are there by then.
for target in TARGETS:

    rule:
        name:
            target
        input:
            failures=lambda w, target=target: [
                f"results/report/{study}{SUFFIX}-failures.txt" for study in studies(target)
            ],
        localrule: True
        message:
            "all points hold?"
        shell:
            "if cat {input.failures:q} | grep .; then exit 1; fi # gate"
