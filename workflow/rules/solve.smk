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
        " > {log:q} 2>&1 || test $? = 2"


# A solve makes a folder: the verdict, also of a solve that is refused, fails or dies; the result, if
# there is one; its output and its cost.
rule solve:
    input:
        files=lambda w: batch(w).inputs,
        mesh=lambda w: batch(w).mesh_folder or [],
    output:
        directory("results/{family}/{job}"),
    log:
        "results/{family}/{job}/log",
    priority: lambda w: seconds(batch(w))
    resources:
        mem_mb=lambda w, attempt: memory(batch(w), attempt),
        runtime=lambda w, attempt: minutes(batch(w), attempt),
    params:
        case=lambda w: batch(w).file,
        mesh=mesh_option,
        options=lambda w: batch(w).options,
        doubted=lambda w: DRY and (batch(w).damaged or batch(w).stale),
        program=SOLVER_HASH,
    message:
        "solve {wildcards.job}"
    shell:
        "died=0; set -- {params.case:q} {params.options} {params.mesh};"
        ' warm {output:q}/benchmark solve "$@" $memory_check --verbose'
        " -o {output:q}/result.vtkhdf --verdict {output:q}/verdict.json"
        " --pictures results/report/pictures > {log:q} 2>&1 || died=$?;"
        # Ctrl-C: no verdict, so that the next run solves it.
        " test $died != 130 || exit 130;"
        " test -s {output:q}/verdict.json"
        ' || program crashed "$@" --status $died'
        " --log {log:q} --verdict {output:q}/verdict.json >> {log:q}"
