"""The bill of materials names every installed package; a case runs without any network."""

import importlib.util
import json
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.skipif(
    importlib.util.find_spec("cyclonedx_py") is None,
    reason="what writes the bill is installed by `make bill`",
)
def test_the_bill_names_every_installed_package(tmp_path):
    path = tmp_path / "bill.json"
    command = ["make", "bill", "INSTALLED=yes", f"BILL={path}"]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["bomFormat"] == "CycloneDX"
    of_ours = content["metadata"]["component"]
    assert of_ours["name"] == "mortarcheck"
    assert of_ours["licenses"][0]["license"]["id"] == "GPL-3.0-or-later"
    listed = {(c["name"].lower(), c["version"]): c for c in content["components"]}
    assert listed.keys() == {(d.name.lower(), d.version) for d in distributions()}
    by_name = {name: c.get("licenses", []) for (name, _), c in listed.items()}
    assert by_name["snakemake"][0]["license"]["id"] == "MIT"
    unstated = {name for name, licences in by_name.items() if not licences}
    assert len(unstated) < len(by_name) / 10, unstated


GUARDED = """\
import socket, sys
def audit(event, details):
    if event in ("socket.connect", "socket.getaddrinfo", "socket.gethostbyname", "socket.bind",
                 "socket.sendto", "urllib.Request"):
        raise SystemExit(f"network: {event} {details}")
sys.addaudithook(audit)
from solver.commands.cli import main
case, result, folder = sys.argv[1:]
assert main(["solve", case, "-o", result, "--verdict", f"{folder}/f/a/verdict.json"]) == 0
assert main(["check", result]) == 0
assert main(["report", folder, "-o", f"{folder}/report"]) == 0
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
