"""Start Snakemake; an interrupt while it is not yet at work ends the run without a traceback."""

import sys

try:
    from snakemake.cli import main  # type: ignore[import-untyped]

    main()
except KeyboardInterrupt:
    sys.exit(130)
