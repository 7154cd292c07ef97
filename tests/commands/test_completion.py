"""Shell completion, as the shell itself does it."""

import re
import shutil
import subprocess
import sys

import pytest

from solver.commands.cli import main
from solver.commands.completion import SHELLS

pytest.importorskip("shtab", reason="shtab, which `make` installs, is not there")
ASK = """\
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
eval "$(complete -p mortarcheck | sed 's/.* -F \\([^ ]*\\) .*/\\1/') mortarcheck '${!#}'"
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture
def script(tmp_path, capsys):
    def make(shell):
        assert main(["completion", shell]) == 0
        file = tmp_path / f"script.{shell}"
        file.write_text(capsys.readouterr().out)
        return file

    return make


@pytest.mark.parametrize(
    ("words", "answers"),
    [
        (("so",), {"solve"}),
        (("co",), {"codes", "compare", "converge", "completion"}),
        (("se",), {""}),  # `serve` is a command of the workflow
        (("solve", "--me"), {"--mesh"}),
        (("solve", "--recovery", "li"), {"linear"}),
        (("solve", "blo"), {"block.yaml"}),
        (("list", "--cases", ""), {"folder"}),
        (("completion", ""), set(SHELLS)),
    ],
)
def test_bash_completes_commands_options_values_and_files(script, tmp_path, words, answers):
    (tmp_path / "block.yaml").touch()
    (tmp_path / "folder").mkdir()
    command = ["bash", "--norc", "-c", ASK, "bash", script("bash"), "mortarcheck", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert set(done.stdout.split("\n")[:-1]) == answers, done.stderr


@pytest.mark.parametrize("shell", SHELLS)
def test_every_listed_command_is_in_every_script(script, capsys, shell):
    with pytest.raises(SystemExit):
        main(["--help"])
    listed = re.findall(r"^    ([a-z-]+) ", capsys.readouterr().out, re.MULTILINE)
    assert {"new", "solve", "converge"} <= set(listed)
    text = script(shell).read_text()
    assert all(re.search(rf"\b{name}\b", text) for name in listed)
    if shutil.which(shell):
        assert subprocess.run([shell, "-n", script(shell)]).returncode == 0


def test_the_command_line_does_not_load_what_makes_the_script():
    code = "import sys, solver.commands.cli as c; c.parser(); print('shtab' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "False\n"
