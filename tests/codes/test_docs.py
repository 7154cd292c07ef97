"""The commands of the page on other codes, on a result that is right."""

import re
import shlex

import numpy as np

from solver.commands.cli import main
from tests.codes import results

PAGE = results.ROOT / "docs/codes.md"


def test_every_command_of_the_page_runs(tmp_path, monkeypatch, capsys):
    (tmp_path / "my-results").mkdir()
    for name in ("cases", "docs"):
        (tmp_path / name).symlink_to(results.ROOT / name)
    monkeypatch.chdir(tmp_path)
    answer = results.patch()
    results.write_vtu(answer, tmp_path / "my-results/a.vtu")
    # Metres and pascals, as the map of the page says.
    columns = {"x": answer.points[:, 0] / 1e3, "y": answer.points[:, 1] / 1e3}
    columns |= {"ux": answer.displacement[:, 0] / 1e3, "uy": answer.displacement[:, 1] / 1e3}
    columns |= {f"s{i}": 1e6 * answer.stress[:, i] for i in range(6)}
    columns |= {"lambda_n": -1e6 * answer.pressure}
    table = np.column_stack(list(columns.values()))
    np.savetxt("my-results/a.csv", table, header=" ".join(columns), comments="", fmt="%.12g")
    text = PAGE.read_text(encoding="utf-8")
    commands = re.findall(r"^\.venv/bin/python -m solver (.+)$", text, re.MULTILINE)
    assert len(commands) >= 3
    for command in commands:
        assert main(shlex.split(command)) == 0, command
    assert "ssnp170-a@mycode: passed" in capsys.readouterr().out
    assert (tmp_path / "my-results/a.vtkhdf").is_file()


def test_the_map_of_the_page_is_the_example():
    block = re.search(r"```yaml\n(code: .+?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)[1]
    example = (results.ROOT / "docs/examples/map.yaml").read_text(encoding="utf-8")

    def keys(words):
        return [line.partition("#")[0].rstrip() for line in words.splitlines() if line[0] != "#"]

    assert keys(block) == keys(example)
