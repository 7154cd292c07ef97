RECIPES = {(j.family, j.case): j for j in BATCH.values() if j.mesh_folder}


def recipe(w):
    return RECIPES[w.family, w.case]


# The mesh of a recipe, one for all directions and variants of a case. If it cannot be made, the
# solve tries again, and its verdict gives the reason.
rule mesh:
    input:
        case=lambda w: recipe(w).file,
    output:
        directory("results/meshes/{family}/{case}"),
    log:
        "results/meshes/{family}/{case}/log",
    priority: lambda w: seconds(recipe(w))
    resources:
        mem_mb=lambda w, attempt: memory(recipe(w), attempt),
        runtime=lambda w, attempt: minutes(recipe(w), attempt),
    params:
        program=MESH_HASH,
    message:
        "mesh {wildcards.case}"
    shell:
        "warm {output:q}/benchmark mesh {input.case:q} -o {output:q}/mesh.vtkhdf"
        " > {log:q} 2>&1 || {{ test $? != 2 || touch {output:q}/refused; }}"
