"""Contact gives way to pressures that scatter (docs/slave-and-master.md#stabilised-contact)."""

import numpy as np
from scipy import sparse

from ...mechanics.linear.compliant import Compliance
from ..scene.scene import Scene


def compliance_of(scene: Scene, normal: np.ndarray, closed: np.ndarray) -> Compliance:
    """The compliance of the closed rows (k,), of which those of gaps are `normal` (k,).

    Zones without one have no part of it, and rows of slip do not give way. What scatters is counted
    as forces, pressures times areas: it is rounded beside the other forces.
    """
    parts, weight = [], [np.empty(0)]
    for zone in scene.zones:
        mine, recovery = closed[zone.numbers], zone.operator.recovery
        if recovery and recovery.compliance:
            area = zone.operator.area[mine]
            parts.append(sparse.diags(area) @ recovery.compliance.scatter(mine))
            weight.append(recovery.compliance.weight[mine] / area**2)
        else:
            parts.append(sparse.csr_matrix((0, int(mine.sum()))))
    parts.append(sparse.csr_matrix((0, int(closed[~normal].sum()))))
    return Compliance(sparse.block_diag(parts, format="csr"), np.concatenate(weight))
