# Other codes on the same cases: each run makes a folder with a verdict beside the folder of our own
# solve.


@cache
def codes_to_run():
    """The codes by name: those configured, else all that are installed."""
    registry, chosen = part("codes.registry"), listed(config["codes"])
    try:
        found = {registry.find(c).name: c for c in chosen or registry.names()}
    except part("system.errors").InputError as error:
        refuse(error)
    if chosen:
        return found
    return {name: code for name, code in found.items() if version_of(code)}


@cache
def version_of(code):
    return part("codes.registry").find(code).version()


def sources_of(code):
    """The files of a user's own code; empty for the codes of the solver."""
    return sorted(str(f) for f in Path(code).rglob("*") if f.is_file())


def foreign_runs():
    """The folders of all runs of other codes: both directions, the case's own cut."""
    jobs = [job for job in RUN.values() if not job.hexahedra and not job.refusal]
    return [f"{job.folder}@{code}" for code in codes_to_run() for job in jobs]


rule run_code:
    input:
        files=lambda w: batch(w).inputs,
        mesh=lambda w: batch(w).mesh_folder or [],
        code=lambda w: sources_of(codes_to_run()[w.code]),
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
        code=lambda w: codes_to_run()[w.code],
        program=lambda w: SOLVER_HASH + version_of(codes_to_run()[w.code]),
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
        "program report --results results -o results/report"
