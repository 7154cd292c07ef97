def mesh_of(job):
    """The generated mesh, or the user's own where it exists (where not, the solver says so)."""
    if job.mesh is None:
        return [f"results/{job.family}/{job.case}/mesh.vtkhdf"]
    return [str(job.mesh)] if job.mesh.is_file() else []


def accepted_of(job):
    """The accepted values that the solve's checks are held against, if there are any."""
    file = Path(job.file).parent / "regression" / f"{job.name}.json"
    return [str(file)] if file.is_file() else []


def content_of_solve(job):
    """What a solve is made from; a mesh file of the user's, which may be large, by its date."""
    files = contents(job.file, *accepted_of(job), *SOLVER_SOURCES)
    return files + (stamp_of(job.mesh) if job.mesh else "")


def options_of(job):
    """How the command line is told which job of a case this is."""
    options = "--mesh " + shlex.quote(mesh_of(job)[0]) if job.mesh is None else ""
    return (
        options
        + " --swap" * job.swap
        + (f" --hexahedra {job.hexahedra}" if job.hexahedra else "")
    )


# A solve always ends with a verdict, also when it is refused, fails or dies: the report lists all.
rule solve:
    input:
        case=lambda w: BATCH[w.family, w.job].file,
        mesh=lambda w: mesh_of(BATCH[w.family, w.job]),
        accepted=lambda w: accepted_of(BATCH[w.family, w.job]),
        sources=SOLVER_SOURCES,
    output:
        verdict="results/{family}/{job}/verdict.json",
    log:
        "results/{family}/{job}/log",
    resources:
        mem_mb=lambda w, attempt: memory(BATCH[w.family, w.job].file, attempt),
        runtime=lambda w, attempt: minutes(BATCH[w.family, w.job].file, attempt),
    params:
        benchmark="results/{family}/{job}/benchmark",
        result="results/{family}/{job}/result.vtkhdf",
        content=lambda w: content_of_solve(BATCH[w.family, w.job]),
        options=lambda w: options_of(BATCH[w.family, w.job]),
    message:
        "solve {wildcards.job}"
    shell:
        "rm -f {params.result:q}; died=0;"
        " {SOLVER} {params.benchmark:q} solve {input.case:q} {params.options}{MEMORY_CHECK} --verbose"
        " -o {params.result:q} --verdict {output.verdict:q} > {log:q} 2>&1 || died=$?;"
        " test -s {output.verdict:q}"
        " || {PYTHON} -m solver crashed {input.case:q} {params.options} --status $died"
        " --log {log:q} --verdict {output.verdict:q} >> {log:q}"
