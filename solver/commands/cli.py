"""The command line: `python -m solver COMMAND …`, and what several commands share.

Exit status: 0 all checks hold; 1 a check fails or the result is unreliable; 2 the input is refused;
3 the solve failed; 70 an error of the program itself; 130 interrupted. Only the module of the
command that is run is imported, and what it needs when it runs, so that help comes at once.
"""

import argparse
import io
import math
import os
import platform
import signal
import sys
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..lac.errors import SolveError
from ..system.errors import InputError, hint, of_machine
from ..system.package import PROGRAM, PROJECT, project_version

if TYPE_CHECKING:
    from ..verification.verdict import CheckResult, Verdict

# Exit statuses.
PASSED, FAILED, REFUSED, NO_RESULT, BUG, INTERRUPTED = 0, 1, 2, 3, 70, 130


def add_threads(command: argparse.ArgumentParser) -> None:
    """Let a command take `--threads`."""
    text = "number of threads, unless the environment sets it"
    command.add_argument("--threads", type=threads, metavar="N", help=text)


def threads(text: str) -> int:
    """A number of threads, as an option gives it."""
    if not text.isdecimal() or not 1 <= int(text) <= _MOST_THREADS:
        allowed = f"must be a whole number from 1 to {_MOST_THREADS}"
        raise argparse.ArgumentTypeError(f"{allowed}, not {text!r}")
    return int(text)


def positive(text: str) -> float:
    """A limit, as an option gives it."""
    with suppress(ValueError):
        if 0 < float(text) < math.inf:
            return float(text)
    raise argparse.ArgumentTypeError(f"must be a positive number, not {text!r}")


def limit_threads(number: int) -> None:
    """Tell the libraries, which read it when they are loaded; the environment comes first."""
    from ..system.process import THREADS

    for variable in THREADS:
        os.environ.setdefault(variable, str(number))


def print_checks(verdict: "Verdict") -> None:
    """Print a verdict, a line for each check."""
    print(verdict.summary)
    for row in verdict.checks:
        print("  " + _row(row))


def _row(check: "CheckResult") -> str:
    extremes = f"{check.minimum:.10g} … {check.maximum:.10g}"
    error = f"error {check.error:.1e} (allowed {check.tolerance:.0e})"
    word = "ok" if check.passed else "FAILED"
    return f"{word:<7}{check.name + ' ' + (check.zone or ''):<40}{extremes:<36}{error}"


_EXAMPLES = f"""examples:
  {PROGRAM} new my-block -o my-block.yaml
  {PROGRAM} solve my-block.yaml -o my-block.vtkhdf
  {PROGRAM} inspect part.med --gap lower_face upper_face
  {PROGRAM} check-result my-block.yaml other-code.vtu

Exit status: 0 all checks hold; 1 a check fails; 2 the input is refused; 3 there is no solution.
Batches and studies are targets of make: make help."""
# In the order of use: the module of each command, and its purpose. There `add_NAME` adds its
# arguments, and `run_NAME` runs it and returns the exit status.
COMMANDS = {
    "new": ("cases", "write a commented case file to start from"),
    "validate": ("cases", "check whether case files are valid"),
    "mesh": ("cases", "write the mesh of a case, after its transform"),
    "solve": ("solve", "solve a case and check it"),
    "check": ("solve", "run the checks of stored results again"),
    "list": ("look", "list families, or the cases of a family"),
    "inspect": ("look", "show groups, cells and sizes of a mesh file"),
    "plot": ("look", "draw a result: meshes, contact pressure"),
    "check-result": ("codes", "check a result that another code computed"),
    "export": ("codes", "write the input of another code"),
    "run": ("codes", "run another code on a case and check what it finds"),
    "codes": ("codes", "list the codes, and which are installed"),
    "report": ("report", "write the report of a batch"),
    "compare": ("report", "compare with another batch"),
    "accept": ("solve", "store results as the accepted values"),
    "init": ("cases", "make a family in a repository of your own: a case, its page, workflow, CI"),
    "expect": ("studies", "the errors that refined meshes predict: the `expected` of a case"),
    "converge": ("studies", "order, limit and uncertainty of results, by refined meshes"),
}
# Those that the workflow calls; help does not list them.
_OF_WORKFLOW = {
    "crashed": ("solve", "write the verdict of a solve that died"),
    "serve": ("server", "keep a warm process and fork it for each command of a batch"),
    "saved": ("report", "measure the time that a family saves"),
    "measure": ("studies", "measure a group of a study"),
    "study-page": ("studies", "write the page of a study"),
}


_MOST_THREADS = 1024
# Characters that UTF-8 cannot encode, such as those of an odd file name, are written escaped.
_ESCAPED = "backslashreplace"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command, by default that of this process; the exit status."""
    with _own_process() if arguments is None else nullcontext():
        options = argparse.Namespace()
        try:
            options = _parse(sys.argv[1:] if arguments is None else arguments)
            if options.threads:
                limit_threads(options.threads)
            return options.run(options)
        except InputError as error:
            print(error, file=sys.stderr)
            return REFUSED
        except SolveError as error:
            case = getattr(options, "case", None)
            print(f"{case}: {error}" if case else error, file=sys.stderr)
            return NO_RESULT
        except KeyboardInterrupt:
            return INTERRUPTED
        except Exception as error:  # noqa: BLE001 -- status 1, Python's own, means a failed check
            return _unexpected(error)


@contextmanager
def _own_process() -> Iterator[None]:
    """What holds for a process that is for one command alone."""
    # Each line leaves as it is written, so that the last line of a log is what was said last.
    # Output is UTF-8, as all files are, whatever the terminal uses. A fork inherits this.
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(line_buffering=True)
        if sys.stdout.errors != _ESCAPED:
            sys.stdout.reconfigure(encoding="utf-8", errors=_ESCAPED)
    # An unsound result is refused in one line: earlier warnings of libraries add nothing.
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    # When the reader of its output goes away, as `head` does, the process ends like any program.
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    # Only a command handles Ctrl-C. While Python imports the program or exits, an interrupt would
    # print a traceback.
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)


def _unexpected(error: Exception) -> int:
    """One line for what the machine lacks, a traceback for a bug."""
    if reason := of_machine(error):
        print(reason, file=sys.stderr)
        return REFUSED if isinstance(error, OSError) else NO_RESULT
    traceback.print_exception(error)
    return BUG


def _parse(arguments: Sequence[str]) -> argparse.Namespace:
    """The arguments of the command that is named first; all commands are in the help."""
    parser = _Parser(
        prog=PROGRAM,
        description="Verified contact solves.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--version",
        nargs=0,
        action=_Version,
        help="print the version and end; with --verbose those of packages, for a report of a fault",
    )
    parser.set_defaults(threads=None)
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    asked = next((word for word in arguments if not word.startswith("-")), "")
    for name, (module, purpose) in (COMMANDS | _OF_WORKFLOW).items():
        listed: dict[str, Any] = {"help": purpose} if name in COMMANDS else {}
        text = f"{purpose[0].upper()}{purpose[1:]}."
        command = commands.add_parser(name, description=text, **listed)
        if name == asked:
            part, suffix = import_module(f".{module}", __package__), name.replace("-", "_")
            getattr(part, f"add_{suffix}")(command)
            command.set_defaults(run=getattr(part, f"run_{suffix}"))
    return parser.parse_args(arguments)


class _Parser(argparse.ArgumentParser):
    """Answers an unknown command with those that help lists, the nearest one first."""

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if isinstance(action, argparse._SubParsersAction) and value not in action.choices:
            self.error(f"no such command: {value}; {hint(value, COMMANDS)}")
        super()._check_value(action, value)


class _Version(argparse.Action):
    """Prints the version, which is looked up only then; `--verbose` those of packages too."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(PROJECT, project_version())
        if "--verbose" in sys.argv:
            from ..verification.provenance import versions

            others = {name: found for name, found in versions().items() if name != PROJECT}
            print("\n".join(f"{name} {found}" for name, found in others.items()))
            print(platform.platform())
        parser.exit()
