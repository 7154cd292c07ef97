"""The bill of materials names every locked package; a case runs without any network."""

import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SPEC = importlib.util.spec_from_file_location("bill", ROOT / "workflow" / "bill.py")
bill = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(bill)

LOCKS = sorted(ROOT.glob("requirements*.txt"))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("bill") / "bill.json"
    bill.main(str(path))
    return json.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("lock", LOCKS, ids=lambda lock: lock.stem)
def test_every_locked_package_is_named_with_version_licence_and_hashes(lock, written):
    text = lock.read_text(encoding="utf-8")
    entries = re.split(r"(?m)^(?=[A-Za-z0-9])", text)
    pinned = [entry for entry in entries if "==" in entry.split("\n")[0]]
    assert len(pinned) == len(re.findall(r"(?m)^[A-Za-z0-9][^ ]*==", text)) > 0
    known = {(c["name"], c["version"]): c for c in written["components"]}
    for entry in pinned:
        name, version = re.match(r"([^=]+)==([^ ;\\]+)", entry).groups()
        component = known[name, version]
        hashes = {h["content"] for h in component["hashes"]}
        assert hashes >= set(re.findall(r"sha256:([0-9a-f]{64})", entry))
        assert hashes
        assert component["licenses"][0]["license"]["name"] not in ("", bill.UNKNOWN), name
        assert lock.name in " ".join(p["value"] for p in component["properties"])


def test_nothing_else_is_in_it(written):
    names = {(c["name"], c["version"]) for c in written["components"]}
    assert len(names) == len(written["components"])
    texts = "\n".join(lock.read_text(encoding="utf-8") for lock in LOCKS)
    assert all(f"{name}=={version}" in texts for name, version in names)


def test_it_is_the_same_every_time(written):
    assert bill.bill() == written
    assert (written["bomFormat"], written["specVersion"]) == ("CycloneDX", "1.5")
    assert written["metadata"]["component"]["licenses"] == [{"expression": "GPL-3.0-or-later"}]


def test_an_unknown_package_is_said_to_be_unknown():
    assert bill.licence("no-such-package-at-all") == bill.UNKNOWN


GUARDED = """\
import socket, sys
def audit(event, details):
    if event in ("socket.connect", "socket.getaddrinfo", "socket.gethostbyname", "socket.bind",
                 "socket.sendto", "urllib.Request"):
        raise SystemExit(f"network: {event} {details}")
sys.addaudithook(audit)
from solver.commands.cli import main
case, result, folder = sys.argv[1:]
assert main(["solve", case, "-o", result, "--verdict", f"{folder}/verdict.json"]) == 0
assert main(["check", result]) == 0
assert main(["report", f"{folder}/verdict.json", "-o", f"{folder}/report"]) == 0
print("no network")
try:
    socket.create_connection(("192.0.2.1", 9), timeout=0.1)
except SystemExit as stopped:
    print(stopped)
"""


def test_a_case_is_solved_checked_and_reported_without_network(tmp_path):
    case = ROOT / "cases" / "ssnp170" / "c.yaml"
    command = [sys.executable, "-c", GUARDED, case, tmp_path / "result.vtkhdf", tmp_path]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    lines = run.stdout.splitlines()
    assert run.returncode == 0, run.stderr
    # The guard works: what follows the batch's commands does ask for the network.
    assert lines[-2] == "no network"
    assert lines[-1].startswith("network: socket.")
