"""Steps in which nothing acts: what loads and motions of other steps cause is their scale."""

import numpy as np

from ...case.model import Case
from ..scene.scene import Scene
from .iterate import ContactIterate

AT_REST = 1e-12
"""Forces below this share of the loads of all steps are none."""
FAINT = 1e-9
"""The same where coordinates are rounded, so that surfaces in contact do not fit exactly."""
LITTLE = 1e-4
"""Pressures, stresses and motions below this share of those in other steps count as zero."""


def rests(iterate: ContactIterate) -> bool:
    """Whether no force acts, and stresses and motions are nothing beside those of other steps.

    Anything left comes from rounded coordinates.
    """
    scene, moves = iterate.scene, iterate.displacement.total
    work = scene.loads.at_work
    force, moved = float(np.abs(iterate.force).max()), float(np.abs(moves).max())
    if not (work.force or work.motion) or force > FAINT * forces_at_work(scene, moves):
        return False
    caused = max(stress_at_rest(scene, moves), work.total / _section(scene))
    still = moved <= LITTLE * (work.motion or np.inf)
    return still and iterate.sizes.highest <= LITTLE * caused


def forces_of_others(iterate: ContactIterate) -> float:
    """The largest nodal force that loads of other steps or motions cause; 0 where a force acts."""
    scene = iterate.scene
    caused = force_at_rest(scene, iterate.displacement.total)
    in_all = max(scene.loads.at_work.force, caused)
    return in_all if float(np.abs(iterate.force).max()) <= AT_REST * in_all else 0.0


def stress_at_rest(scene: Scene, displacement: np.ndarray) -> float:
    """The stress that a displacement, or what supports impose at load factor 1, would cause."""
    largest = np.array([np.abs(displacement).max(initial=0.0), scene.loads.at_work.motion])
    return stress_of_motion(scene.case, scene.coordinates.length, largest)


def force_at_rest(scene: Scene, displacement: np.ndarray) -> float:
    """That stress on the model's whole extent, a force."""
    return stress_at_rest(scene, displacement) * _section(scene)


def forces_at_work(scene: Scene, displacement: np.ndarray) -> float:
    """The largest nodal force of the loads of all steps, else what motions would cause."""
    return scene.loads.at_work.force or force_at_rest(scene, displacement)


def stress_of_motion(case: Case, length: float, displacement: np.ndarray) -> float:
    """The stress that a displacement (n, dim) would cause as a strain over the model's length."""
    young = max(material.young for material in case.materials.values())
    return young * float(np.abs(displacement).max(initial=0.0)) / length


def _section(scene: Scene) -> float:
    """The area of the model's extent; a length in 2D."""
    return scene.coordinates.length ** (scene.space - 1)
