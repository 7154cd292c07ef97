"""Numbers in the settings of make targets."""

import pytest

from tests.arguments import whole


@pytest.mark.parametrize("given", ["0", "-1", "x", "1.5", "", "9"])
def test_what_would_try_nothing_is_refused_in_one_line(given, capsys):
    assert whole("COUNT", "3", most=8) == 3
    with pytest.raises(SystemExit) as end:
        whole("COUNT", given, most=8)
    assert end.value.code == 2
    assert capsys.readouterr().err == f"COUNT = {given!r}: must be a whole number from 1 to 8\n"
