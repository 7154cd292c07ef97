# A solve makes a folder: the verdict, also of a solve that is refused, fails or dies; the result, if
# there is one; its output and its cost.
rule solve:
    input:
        case=lambda w: existing(*files_of(BATCH[w.family, w.job])),
        mesh=lambda w: mesh_folder(BATCH[w.family, w.job]),
    output:
        directory("results/{family}/{job}"),
    log:
        "results/{family}/{job}/log",
    priority: lambda w: seconds(BATCH[w.family, w.job])
    resources:
        mem_mb=lambda w, attempt: memory(BATCH[w.family, w.job], attempt),
        runtime=lambda w, attempt: minutes(BATCH[w.family, w.job], attempt),
    params:
        file=lambda w: BATCH[w.family, w.job].file,
        mesh=lambda w: shlex.quote(mesh_file(BATCH[w.family, w.job])),
        damaged=lambda w: is_damaged(f"results/{w.family}/{w.job}"),
        program=SOLVER_HASH,
        options=lambda w: options_of(BATCH[w.family, w.job]),
        refusal=lambda w: shlex.quote(BATCH[w.family, w.job].refusal),
    message:
        "solve {wildcards.job}"
    shell:
        "died=0; set -- {params.file:q} {params.options};"
        ' if test -e {params.mesh}; then set -- "$@" --mesh {params.mesh}; fi;'
        " if test -z {params.refusal}; then"
        ' warm {output:q}/benchmark solve "$@" $memory_check --verbose'
        " -o {output:q}/result.vtkhdf --verdict {output:q}/verdict.json"
        " --pictures results/report/pictures > {log:q} 2>&1 || died=$?; fi;"
        # Ctrl-C: no verdict, so that the next run solves it.
        " test $died != 130 || exit 130;"
        " test -s {output:q}/verdict.json"
        ' || program crashed "$@" --status $died --refusal {params.refusal}'
        " --log {log:q} --verdict {output:q}/verdict.json >> {log:q}"
