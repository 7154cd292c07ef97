"""Solve random cases in several views, COUNT of them from the seed START on: `make views`."""

import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor

import yaml

from solver.lac.threads import cores
from tests.arguments import whole

from .cases import FOUND, drawn, word_of
from .judge import compared


def main(count: int, start: int) -> int:
    """The cases whose views differ, printed as YAML; 1 where there are any.

    First those that differed once.
    """
    started, words, wrong = time.monotonic(), Counter[str](), 0
    cases = [*FOUND.values(), *map(drawn, range(start, start + count))]
    with ProcessPoolExecutor(cores()) as pool:
        for case, (word, found) in zip(cases, pool.map(compared, cases), strict=True):
            words[word] += 1
            if word != (wanted := word_of(case) or word):
                found = [f"{word}, not {wanted}", *found]
            if found:
                wrong += 1
                print(f"{case['name']}: {'; '.join(found)}")
                print(yaml.safe_dump(case, sort_keys=False), flush=True)
    said = ", ".join(f"{number} {word}" for word, number in words.most_common())
    print(f"{words.total()} cases, {wrong} differ, {time.monotonic() - started:.0f} s: {said}")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main(whole("COUNT", sys.argv[1]), whole("SEED", sys.argv[2], 0)))
