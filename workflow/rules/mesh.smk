RECIPES = {(j.family, j.case): j for j in BATCH.values() if j.mesh is None}


# The mesh of a recipe, one for all directions and variants of a case. If it cannot be made, the
# solve tries again, and its verdict gives the reason.
rule mesh:
    input:
        case=lambda w: existing(RECIPES[w.family, w.case].file),
    output:
        directory("results/meshes/{family}/{case}"),
    log:
        "results/meshes/{family}/{case}/log",
    priority: lambda w: seconds(RECIPES[w.family, w.case])
    resources:
        mem_mb=lambda w, attempt: memory(RECIPES[w.family, w.case], attempt),
        runtime=lambda w, attempt: minutes(RECIPES[w.family, w.case], attempt),
    params:
        file=lambda w: RECIPES[w.family, w.case].file,
        damaged=lambda w: is_damaged(f"results/meshes/{w.family}/{w.case}"),
        program=MESH_HASH,
    message:
        "mesh {wildcards.case}"
    shell:
        "warm {output:q}/benchmark mesh {params.file:q} -o {output:q}/mesh.vtkhdf"
        " > {log:q} 2>&1 || {{ test $? != 2 || touch {output:q}/refused; }}"
