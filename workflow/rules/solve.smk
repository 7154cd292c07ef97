def mesh_of(job):
    """The generated mesh, or the user's own where it exists (where not, the solver says so)."""
    if job.mesh is None:
        return [f"results/{job.family}/{job.case}/mesh.vtkhdf"]
    return [str(job.mesh)] if job.mesh.is_file() else []


def accepted_of(job):
    """The accepted values that the solve's checks are held against, if there are any."""
    file = Path(job.file).parent / "regression" / f"{job.name}.json"
    return [str(file)] if file.is_file() else []


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
    benchmark:
        "results/{family}/{job}/benchmark"
    params:
        result="results/{family}/{job}/result.vtkhdf",
        options=lambda w: options_of(BATCH[w.family, w.job]),
    message:
        "solve {wildcards.job}"
    shell:
        "rm -f {params.result:q};"
        " {PYTHON} -m solver solve {input.case:q} {params.options}"
        " -o {params.result:q} --verdict {output.verdict:q} > {log:q} 2>&1"
        " || died=$? && test -s {output.verdict:q}"
        ' || {{ echo "died with exit status $died" >> {log:q};'
        " {PYTHON} -m solver crashed {input.case:q} {params.options}"
        " --log {log:q} --verdict {output.verdict:q}; }};"
        " tail -n 1 {log:q}"
