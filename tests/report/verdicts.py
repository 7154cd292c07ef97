"""Verdicts as the report reads them, made from the few values that a test is about."""

from pathlib import Path

from solver.verification.stored import typed, write_verdict


def record(content):
    """The typed verdict of a mapping; family, job and word are made up where they are missing."""
    base = {"family": "fam", "job": "job", "verdict": "passed"}
    return typed(base | content, Path("verdict.json"))


def put(path, content):
    """Write the verdict of a mapping, its folder made; the path."""
    write_verdict(path, record(content))
    return path
