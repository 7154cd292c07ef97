"""The page of past batches: error and time of each solve by revision, and what is marked."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ..system.files import write_text
from .charts import BLUE, EPSILON, RED, Chart, tooltip, write_script
from .differences import Batch, read_batch
from .html import TEMPLATES, render
from .records import (
    FEWEST,
    FLOOR,
    GROWTH,
    LEAST,
    MOST,
    WIDTH,
    Mark,
    Past,
    add_records,
    marks,
    read_records,
    series,
)
from .rows import natural

PAGE = "history.html"
_TIPS = {"solve": "solve", "revision": "revision", "date": "recorded", "verdict": "verdict"}
_TIPS |= {"error": "largest checked error", "time": "time, s", "mark": "marked"}


@dataclass(frozen=True)
class Course:
    """A solve through all records; `current` where the batch that is recorded has it."""

    name: str
    points: Sequence[Past]
    current: bool

    @cached_property
    def marks(self) -> list[list[Mark]]:
        """The marks of each record, oldest first."""
        return [marks(self.points[: n + 1]) for n in range(len(self.points))]

    @property
    def family(self) -> str:
        """The family's name."""
        return self.name.partition("/")[0]

    @property
    def last(self) -> Past:
        """The last record."""
        return self.points[-1]

    @property
    def bad(self) -> bool:
        """Whether the exit status reports it."""
        return self.current and any(mark.bad for mark in self.marks[-1])

    @property
    def marked(self) -> bool:
        """Whether any record has a mark."""
        return any(self.marks)

    @property
    def earlier(self) -> list[tuple[str, str]]:
        """Marks of earlier records: revision and words."""
        found = zip(self.points[:-1], self.marks[:-1], strict=True)
        return [(point.label, mark.words) for point, of in found for mark in of]

    @property
    def records(self) -> list[dict[str, Any]]:
        """Points of the charts; a logarithm shows an error of zero as round-off."""
        return [
            {
                "solve": self.name,
                "revision": point.label,
                "date": f"{point.batch.time:%Y-%m-%d %H:%M}",
                "verdict": point.solve.verdict,
                "error": None if (error := point.solve.error) is None else max(error, EPSILON),
                "time": point.solve.cpu_seconds,
                "mark": "; ".join(mark.words for mark in of),
                "late": any(mark.kind == "time" for mark in of),
                "off": any(mark.kind != "time" for mark in of),
            }
            for point, of in zip(self.points, self.marks, strict=True)
        ]


def record(base: Path, folder: Path, page: Path | None = None) -> tuple[list[Course], str]:
    """Record what is new in a batch into `folder` and write the page; all solves, and the outcome.

    The page is by default beside the batch's report. Raises `InputError` for what is no batch and
    for a damaged record.
    """
    batch = read_batch(base)
    files = add_records(batch, folder)
    courses = _courses(batch, folder)
    page = page or batch.file.with_name(PAGE)
    write_text(page, to_html(courses))
    write_script(page.parent)
    lines = [
        f"{course.name}: {mark.words}"
        for course in courses
        if course.current
        for mark in course.marks[-1]
    ]
    written = [f"Recorded: {file}" for file in files] or ["Nothing new to record."]
    return courses, "\n".join([*lines, *written, outcome(courses), f"History: {page}"])


def _courses(batch: Batch, folder: Path) -> list[Course]:
    current = {row.anchor for row in batch.rows.values()}
    found = series(read_records(folder))
    return [Course(n, found[n], n in current) for n in sorted(found, key=natural)]


def outcome(courses: Sequence[Course]) -> str:
    """The marks of the last records in one line."""
    kinds = [{mark.kind for mark in course.marks[-1]} for course in courses if course.current]
    changed, errors, times = (
        sum(kind in of for of in kinds) for kind in ("verdict", "error", "time")
    )
    return (
        f"{len(kinds)} solves: verdict changed in {changed}, an error grew tenfold in {errors}, "
        f"time grew beyond its noise in {times}."
    )


def to_html(courses: Sequence[Course]) -> str:
    """The page."""
    families: dict[str, list[Course]] = {}
    for course in courses:
        families.setdefault(course.family, []).append(course)
    return render(
        TEMPLATES / "history.html.jinja",
        title="Past batches",
        charts=True,
        sortable=True,
        good=not any(course.bad for course in courses),
        outcome=outcome(courses),
        families=families,
        draw=draw,
        rule={
            "growth": GROWTH,
            "floor": FLOOR,
            "fewest": FEWEST,
            "most": MOST,
            "width": WIDTH,
            "least": 100 * LEAST,
        },
    )


def draw(name: str, courses: Sequence[Course]) -> Chart | None:
    """Error and time by revision, a row for each solve; None without a solve."""
    records = [record for course in courses for record in course.records]
    points = sorted((p for c in courses for p in c.points), key=lambda point: point.batch.time)
    order = list(dict.fromkeys(point.label for point in points))
    x: dict[str, Any] = {"field": "revision", "type": "nominal", "title": None, "sort": order}
    x |= {"axis": {"labelExpr": "slice(datum.value, 0, 7)", "labelAngle": -60}}
    error = {"scale": {"type": "log", "nice": True}, "axis": {"format": ".0e", "tickCount": 2}}
    time = {"scale": {"zero": True}, "axis": {"tickCount": 3}}
    names = [course.name for course in courses]

    def part(y: str, title: str, style: dict[str, Any], flag: str, labels: bool) -> dict[str, Any]:
        place = {"x": x, "y": {"field": y, "type": "quantitative", "title": None} | style}
        mean = {"y": place["y"] | {"aggregate": "median"}}
        color = {"condition": {"test": f"datum.{flag}", "value": RED}, "value": BLUE}
        dots = place | {"color": color, "tooltip": tooltip(records, _TIPS)}
        line = {"type": "line", "color": BLUE, "strokeWidth": 1}
        header = {"title": None, "labels": labels, "labelAngle": 0, "labelAlign": "left"}
        return {
            "title": title,
            "facet": {"row": {"field": "solve", "sort": names, "header": header}},
            "spec": {
                "width": 260,
                "height": 70,
                "layer": [
                    {"mark": line, "encoding": place | mean},
                    {"mark": {"type": "point", "filled": True, "size": 40}, "encoding": dots},
                ],
            },
            "resolve": {"scale": {"y": "independent"}},
        }

    spec = {
        "data": {"values": records},
        "hconcat": [
            part("error", "largest checked error", error, "off", labels=True),
            part("time", "processor time, s", time, "late", labels=False),
        ],
    }
    return Chart(name, "Error and time by revision", spec, 1000) if records else None
