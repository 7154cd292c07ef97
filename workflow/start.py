"""Start Snakemake; an interrupt while it is not yet at work ends the run without a traceback.

Snakemake limits how many jobs start in a second, and wakes its scheduler once a second for each job
that has started so far. Jobs that run on this machine need no such limit, so it is removed.
"""

import sys

try:
    from snakemake.cli import args_to_api, parse_args  # type: ignore[import-untyped]
    from snakemake.exceptions import print_exception  # type: ignore[import-untyped]

    try:
        parser, given = parse_args(None)
        if given.executor in (None, "local"):
            given.max_jobs_per_timespan = None
        done = args_to_api(given, parser)
    except Exception as error:  # noqa: BLE001 -- as Snakemake's own command does
        print_exception(error)
        done = False
    sys.exit(0 if done else 1)
except KeyboardInterrupt:
    sys.exit(130)
