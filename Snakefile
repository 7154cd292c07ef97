"""The workflow lies in workflow/Snakefile. Its first target is the one of a plain `snakemake` here."""


include: "workflow/Snakefile"


localrules:
    all,


rule all:
    input:
        rules.all_cases.input,
