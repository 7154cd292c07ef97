"""Messages that name what may have been meant."""

from solver.system.errors import hint


def test_few_names_are_listed_with_the_nearest():
    assert hint("tubs", ["tubes", "blocks"]) == "did you mean tubes? (allowed: blocks, tubes)"
    assert hint("x", ["tubes", "blocks"]) == "allowed: blocks, tubes"
    assert hint("x", []) == "there is none"


def test_of_many_names_the_nearest_twelve_are_listed():
    """The names differ from the one given in one letter, the others in all."""
    near, far = [f"case-{c}" for c in "abcdefghijkl"], [f"{n:05d}" for n in range(88)]
    said = hint("case-z", [*far, *near])
    assert said.startswith("did you mean case-")
    listed = said.partition("(allowed: ")[2].removesuffix(" and 88 more)").split(", ")
    assert sorted(listed) == near
