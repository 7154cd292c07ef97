"""The fuzzer sees what it looks for: crash, hang, traceback, a pass of what was changed."""

import pytest

from tests.faults import fuzz
from tests.faults.fuzz import Worker


@pytest.mark.parametrize(
    ("found", "ending"),
    [
        ({"status": 2, "out": "", "err": "c.yaml: name: needed\n"}, "refused"),
        ({"status": 2, "out": "", "err": "one\ntwo\n"}, "not one line"),
        ({"status": 2, "out": "", "err": ""}, "not one line"),
        ({"status": 70, "out": "", "err": "Traceback …"}, "70"),
        ({"status": "hang", "out": "", "err": ""}, "hang"),
        ({"status": 1, "out": "", "err": ""}, "failed"),
        ({"status": 0, "out": '[{"checks": [1]}]', "err": ""}, "read correctly"),
        ({"status": 0, "out": '[{"checks": [2]}]', "err": ""}, "passed, changed"),
    ],
)
def test_endings(found, ending):
    whole = {"status": 0, "out": '[{"checks": [1]}]', "err": ""}
    assert fuzz._judged(found, whole)[0] == ending


@pytest.mark.parametrize(
    ("ending", "deed"),
    [
        ("hang", "while True: pass"),
        ("crash (-11)", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"),
    ],
)
def test_a_worker_that_dies_is_noticed_and_replaced(ending, deed, monkeypatch):
    code = f"import sys; from tests.faults import worker; worker.SECONDS = 0.3\n\
def outcome(arguments):\n    if arguments: exec({deed!r})\n    return {{'status': 0}}\n\
worker.outcome = outcome; worker.serve()"
    start = fuzz.subprocess.Popen
    monkeypatch.setattr(
        fuzz.subprocess, "Popen", lambda command, **how: start([command[0], "-c", code], **how)
    )
    worker = Worker()
    assert worker.run(["deed"])["status"] == ending
    assert worker.run([])["status"] == 0
    worker.close()
