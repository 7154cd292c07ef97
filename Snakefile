"""Targets of the batch: `all_cases` (default), `report`, `bench`, `orders`, `study`, `stability`, `scaling`, or the folder of a solve by its path."""

from snakemake.utils import min_version

min_version("9.27")


include: "workflow/rules/warm.smk"
include: "workflow/rules/common.smk"
include: "workflow/rules/start.smk"
include: "workflow/rules/cluster.smk"


rule all_cases:
    input:
        passed="results/report/passed",
        # Missed where they are gone: Snakemake misses only what a target names.
        solves=lambda w: [results_of(job) for job in RUN.values()],
        again=lambda w: sorted({f for job in RUN.values() for f in again_for(job)}),


# Never there when a run begins, so that what it is an input of runs again.
rule again:
    output:
        temp(touch(AGAIN)),


include: "workflow/rules/mesh.smk"
include: "workflow/rules/solve.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/orders.smk"
include: "workflow/rules/study.smk"
include: "workflow/rules/infsup.smk"
include: "workflow/rules/stability.smk"
include: "workflow/rules/scaling.smk"
include: "workflow/rules/codes.smk"


# Pages and gates run where Snakemake does, wherever it sends the other jobs.
localrules:
    all_cases,
    again,
    report,
    gate,
    orders_page,
    orders,
    study,
    infsup_page,
    infsup,
    stability_page,
    stability,
    scaling,
    bench,
