"""The stages of a solve as every page shows them: order, colours, and times in words."""

from collections.abc import Iterable, Mapping

from markupsafe import Markup

# In the order of the work, in colours that colour-blind readers can distinguish.
COLORS = {
    "read": "#999999",
    "mesh": "#bbbbbb",
    "cut": "#e69f00",
    "pairing": "#56b4e9",
    "assembly": "#009e73",
    "solve": "#0072b2",
    "recovery": "#cc79a7",
    "checks": "#d55e00",
    "write": "#f0e442",
}
_OTHER = "#777777"


def colors(found: Iterable[str]) -> dict[str, str]:
    """The stages found, each once, in the order of the work, with their colours."""
    every = dict.fromkeys(found)
    known = [stage for stage in COLORS if stage in every]
    return {s: COLORS.get(s, _OTHER) for s in [*known, *(s for s in every if s not in COLORS)]}


def in_words(seconds: Mapping[str, float]) -> str:
    """The times of the stages in one line."""
    return ", ".join(f"{stage} {seconds[stage]:.3f} s" for stage in colors(seconds))


def bar(seconds: Mapping[str, float], total: float) -> Markup:
    """The shares of the stages in the total time as a bar, their times under the pointer."""
    parts, end = [], 0.0
    for stage, color in colors(seconds).items():
        end += 100 * seconds[stage] / total
        parts.append(f"{color} 0 {end:.0f}%")
    tag = '<span class=bar title="{}" style="background:linear-gradient(90deg,{},#0000 0)"></span>'
    return Markup(tag).format(in_words(seconds), ",".join(parts))
