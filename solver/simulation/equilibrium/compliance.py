"""Contact gives way to pressures that scatter (docs/slave-and-master.md#stabilised-contact)."""

import numpy as np
from scipy import sparse

from ...mechanics.linear.compliant import Compliance
from ..scene.scene import Scene


def compliance_of(
    scene: Scene, normal: np.ndarray, pressed: np.ndarray, closed: np.ndarray
) -> Compliance:
    """The compliance of the closed rows (k,), of which those of gaps are `normal` (k,).

    Zones without one have no part of it, and rows of slip do not give way, nor those that are not
    `pressed` (k,). What scatters is counted as forces, pressures times areas: it is rounded beside
    the other forces.
    """
    parts, weight = [], [np.empty(0)]
    for zone in scene.zones:
        mine, recovery = closed[zone.numbers], zone.operator.recovery
        if recovery and recovery.compliance:
            some = mine & pressed[zone.numbers]
            area = zone.operator.area[some]
            among = sparse.eye_array(len(mine), format="csr")[some][:, mine]
            parts.append(sparse.diags(area) @ recovery.compliance.scatter(some) @ among)
            weight.append(recovery.compliance.weight[some] / area**2)
        else:
            parts.append(sparse.csr_matrix((0, int(mine.sum()))))
    parts.append(sparse.csr_matrix((0, int(closed[~normal].sum()))))
    return Compliance(sparse.block_diag(parts, format="csr"), np.concatenate(weight))
