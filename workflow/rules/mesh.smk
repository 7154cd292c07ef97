RECIPES = {(job.family, job.case): job.file for job in BATCH.values() if not job.mesh}


# The mesh of a recipe, one for all directions and variants of a case. Where meshing fails the file
# holds the reason instead, so that the solve refuses it and the batch goes on.
rule mesh:
    input:
        case=lambda w: RECIPES[w.family, w.case],
        sources=MESH_SOURCES,
    output:
        mesh="results/{family}/{case}/mesh.vtkhdf",
    log:
        "results/{family}/{case}/mesh.log",
    resources:
        mem_mb=lambda w, attempt: memory(RECIPES[w.family, w.case], attempt),
        runtime=lambda w, attempt: minutes(RECIPES[w.family, w.case], attempt),
    params:
        benchmark="results/{family}/{case}/mesh.benchmark",
        content=lambda w: contents(RECIPES[w.family, w.case], *MESH_SOURCES),
    message:
        "mesh {wildcards.case}"
    shell:
        "{SOLVER} {params.benchmark:q} mesh {input.case:q} -o {output.mesh:q} > {log:q} 2>&1 || {{ died=$?;"
        ' test -s {log:q} || echo "meshing died with exit status $died" > {log:q};'
        " tail -n 1 {log:q} > {output.mesh:q}.reason; mv {output.mesh:q}.reason {output.mesh:q}; }}"
