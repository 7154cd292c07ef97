# Other codes on the same cases: each run makes a folder with a verdict beside that of our own solve.


@cache
def codes():
    """What --code takes and the version, by name of the code: those configured, else all installed."""
    run, chosen = part("codes.run"), listed(config["codes"])
    given = {c: checked(run.find, c) for c in chosen or run.names()}
    found = {code.name: (c, code.version()) for c, code in given.items()}
    return {name: code for name, code in found.items() if chosen or code[1]}


def foreign_runs():
    """The folders of all runs of other codes: both directions, the case's own cut."""
    jobs = [job for job in RUN.values() if not job.hexahedra]
    return [f"{job.folder}@{code}" for code in codes() for job in jobs]


rule run_code:
    input:
        files=lambda w: batch(w).inputs,
        mesh=lambda w: batch(w).mesh_folder or [],
        # The files of a user's own code.
        code=lambda w: sorted(f for f in Path(codes()[w.code][0]).rglob("*") if f.is_file()),
    output:
        directory("results/{family}/{job}@{code}"),
    log:
        "results/{family}/{job}@{code}/run.log",
    wildcard_constraints:
        code="[^/@]+",
    params:
        case=lambda w: batch(w).file,
        mesh=mesh_option,
        options=lambda w: batch(w).options,
        code=lambda w: codes()[w.code][0],
        program=lambda w: SOLVER_HASH + codes()[w.code][1],
    message:
        "{wildcards.code}: {wildcards.job}"
    shell:
        "warm {output:q}/benchmark run {params.case:q} {params.options} {params.mesh}"
        " --code {params.code:q} -o {output:q} > {log:q} 2>&1"
        " || test -s {output:q}/verdict.json"


# The report of all solves: our own and other codes'.
rule bench:
    input:
        codes=lambda w: foreign_runs(),
        ours=lambda w: [job.folder for job in RUN.values()],
    message:
        "report of all codes"
    shell:
        "program report -o results/report"
