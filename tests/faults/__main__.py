"""`python -m tests.faults COUNT [SEED]`: damage so many files and say what came of them."""

import sys
import tempfile
from pathlib import Path

from tests.arguments import whole
from tests.faults.fuzz import fuzz, table

count, seed = [*sys.argv[1:], *["1000", "0"][len(sys.argv) - 1 :]]
folder = Path(tempfile.mkdtemp(prefix="faults-"))
attempts = list(fuzz(folder, whole("COUNT", count), whole("SEED", seed, 0)))
print("\n".join(table(attempts)))
sys.exit(not all(attempt.sound for attempt in attempts))
