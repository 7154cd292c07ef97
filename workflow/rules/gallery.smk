# The pictures are no outputs here: those that are newer than their results stay as they are.
rule gallery:
    input:
        verdicts=[verdict_of(job) for job in RUN.values()],
        sources=REPORT_SOURCES,
    output:
        "results/report/gallery.html",
    log:
        "results/report/gallery.log",
    params:
        shown=[verdict for verdict in SHOWN if Path(verdict).is_file()],
    message:
        "gallery of all results"
    shell:
        "{PYTHON} -m solver gallery {input.verdicts:q} {params.shown:q} -o results/report 2>&1"
        " | tee {log:q}"
