"""Start Snakemake; an interrupt while it is not yet at work ends the run without a traceback.

Snakemake limits how many jobs start in a second, and wakes its scheduler once a second for each job
that has started so far. Jobs that run on this machine need no such limit, so it is removed.
"""

import signal
import sys

# Ctrl-C ends this process at once while Python imports and while it exits: a traceback of there
# tells nothing. Snakemake, once at work, stops its jobs. A job in the background ignores Ctrl-C.
at_work = signal.getsignal(signal.SIGINT)
idle = signal.SIG_DFL if at_work is signal.default_int_handler else at_work
signal.signal(signal.SIGINT, idle)

from snakemake.cli import args_to_api, parse_args  # type: ignore[import-untyped]  # noqa: E402
from snakemake.exceptions import print_exception  # type: ignore[import-untyped]  # noqa: E402

status = 1
try:
    parser, given = parse_args(None)
    if given.executor in (None, "local"):
        given.max_jobs_per_timespan = None
    signal.signal(signal.SIGINT, at_work)
    status = 0 if args_to_api(given, parser) else 1
except KeyboardInterrupt:
    status = 130
except Exception as error:  # noqa: BLE001 -- as Snakemake's own command does
    print_exception(error)
signal.signal(signal.SIGINT, idle)
sys.exit(status)
