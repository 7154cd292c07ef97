"""The example that collects case files as tests of pytest."""

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WRONG = ("contact_pressure: 25.0", "contact_pressure: 26.0")


def test_case_files_are_collected_and_a_wrong_one_fails(tmp_path):
    shutil.copy(ROOT / "docs/examples/conftest.py", tmp_path)
    (tmp_path / "cases").mkdir()
    text = (ROOT / "cases/ssnp170/a.yaml").read_text()
    (tmp_path / "cases/right.yaml").write_text(text)
    assert text.count(WRONG[0]) == 1
    (tmp_path / "cases/wrong.yaml").write_text(text.replace(*WRONG))
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 1, ended.stdout
    assert "1 failed, 1 passed" in ended.stdout
    assert "wrong: failed: multiplier interface: 25" in ended.stdout
