"""What options must be: wrong usage ends with status 2."""

import pytest

from solver.commands.cli import main


def test_wrong_usage_is_2():
    for arguments in ([], ["solve"], ["solves", "c.yaml"], ["solve", "c.yaml", "--hexahedra", "x"]):
        with pytest.raises(SystemExit) as stop:
            main(arguments)
        assert stop.value.code == 2


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            ["solve", "c.yaml", "--threads", "0"],
            "--threads: must be a whole number from 1 to 1024,",
        ),
        (["solve", "c.yaml", "--threads", "-1"], "not '-1'"),
        (["run", "c.yaml", "-o", "x", "--code", "plain", "--seconds", "nan"], "must be a positive"),
        (["run", "c.yaml", "-o", "x", "--code", "plain", "--memory", "0"], "number, not '0'"),
    ],
)
def test_numbers_of_options_are_refused(options, said, capsys):
    with pytest.raises(SystemExit) as stop:
        main(options)
    assert stop.value.code == 2
    assert said in capsys.readouterr().err
