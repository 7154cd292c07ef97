"""Targets of the batch: `all_cases` (default), `report`, `gallery`, `orders`, `study`, `stability`, `scaling`, or a verdict by its path."""

from snakemake.utils import min_version

min_version("9.0")


include: "workflow/rules/common.smk"
include: "workflow/rules/start.smk"
include: "workflow/rules/cluster.smk"


rule all_cases:
    input:
        "results/report/passed",


include: "workflow/rules/mesh.smk"
include: "workflow/rules/solve.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/gallery.smk"
include: "workflow/rules/orders.smk"
include: "workflow/rules/study.smk"
include: "workflow/rules/infsup.smk"
include: "workflow/rules/stability.smk"
include: "workflow/rules/scaling.smk"


# Pages and gates run where Snakemake does, wherever it sends the other jobs.
localrules:
    all_cases,
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
    gallery,
