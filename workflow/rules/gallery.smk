# The pictures are no outputs here: those that are newer than their results stay as they are.
rule gallery:
    input:
        solves=lambda w: [results_of(job) for job in RUN.values()],
    output:
        "results/report/gallery.html",
    log:
        "results/report/gallery.log",
    params:
        verdicts=lambda w: [verdict_of(job) for job in RUN.values()]
        + verdicts_there(OTHERS),
        content=REPORT_CONTENT,
    message:
        "gallery of all results"
    shell:
        "{PYTHON} -m solver gallery {params.verdicts:q} -o results/report 2>&1"
        " | tee {log:q}"
