"""What `family.yaml` tells about a family of cases."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml


@dataclass(frozen=True)
class Family:
    """Title, description, and the reference code's own errors: name, version, error, remark."""

    title: str
    description: str = ""
    reference_code: Sequence[Mapping[str, Any]] = ()


def read_family(name: str, cases: Path = Path("cases")) -> Family:
    """The family's description; its bare name where there is none that can be read."""
    try:
        content = yaml.safe_load((cases / name / "family.yaml").read_text(encoding="utf-8"))
        return Family(
            title=str(content.get("title", name)),
            description=str(content.get("description", "")),
            reference_code=[e for e in content.get("reference_code", ()) if float(e["error"]) > 0],
        )
    except (OSError, yaml.YAMLError, AttributeError, TypeError, ValueError, KeyError):
        return Family(name)
