"""Segments against areas and distances known by hand: bent edges, steps, faces behind others."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from solver.lac import operator as operator_module
from solver.lac import segments, threads
from solver.lac.cells.catalogue import BY_NAME
from solver.lac.cells.shape import gauss_rule, shape_functions
from solver.lac.clipping import quadrature
from solver.lac.facets import facets, measured
from solver.lac.operator import LAC, gap_operator
from solver.lac.pairing import face_pairs, hidden_pairs
from solver.lac.regions import Regions, clip_to_face, without_face
from solver.lac.segments import intersect
from solver.mechanics.mortar.treatments import scheme_of

MEASURED = scheme_of("lac", None)
RAW = replace(LAC, closure=False)


def bent_face(kind, amount, seed):
    """Nodes (n, 2) of a face whose mid-edge nodes are moved by up to `amount` of an edge."""
    rng = np.random.default_rng(seed)
    places = BY_NAME[kind].nodes.copy()
    n, edges = BY_NAME[kind].n_vertices, len(BY_NAME[kind].edges)
    places[n : n + edges] += amount * rng.uniform(-1, 1, (edges, 2))
    return places


def is_valid(kind, places):
    ticks = np.linspace(0, 1, 41)
    grid = np.array([(x, y) for x in ticks for y in ticks if kind != "TRIA6" or x + y <= 1])
    slopes = shape_functions(kind).gradients(grid)
    return np.linalg.det(np.einsum("ad,qat->qdt", places, slopes)).min() > 0


def facing(slave, master, height=0.0):
    """A slave face (type, places) seen from below and master faces (type, places) above it."""
    points = np.concatenate([np.pad(places, ((0, 0), (0, 1))) for _, places in [slave, *master]])
    first = len(slave[1])
    points[first:, 2] = height
    lower = facets(points, BY_NAME[slave[0]], np.arange(first)[None], np.array([0]))
    upper = []
    for kind, places in master:
        # Seen from the other side, the face goes round the other way.
        nodes = (first + np.arange(len(places)))[list(BY_NAME[kind].mirror)]
        upper.append(facets(points, BY_NAME[kind], nodes[None], np.array([0])))
        first += len(places)
    return points, [lower], upper


@pytest.mark.parametrize("kind", ["TRIA6", "QUAD8", "QUAD9"])
@pytest.mark.parametrize("amount", [0.05, 0.1, 0.15])
def test_a_bent_face_under_a_large_one_is_covered(kind, amount):
    big = ("QUAD4", np.array([[-3.0, -2.0], [5.0, -3.0], [4.0, 4.0], [-2.0, 5.0]]))
    faces = [bent_face(kind, amount, seed) for seed in range(10)]
    valid = [places for places in faces if is_valid(kind, places)]
    assert len(valid) > 5
    for places in valid:
        points, slave, master = facing((kind, places), [big])
        surface = gap_operator(slave, master, 1, len(points), 9.0, RAW).surface
        assert surface.covered == pytest.approx(surface.area, rel=1e-14)


@pytest.mark.parametrize("kind", ["TRIA6", "QUAD8", "QUAD9"])
@pytest.mark.parametrize("amount", [0.05, 0.1])
def test_bent_master_faces_share_a_bent_slave_face(kind, amount):
    """Four bent faces around an inner node: together they cover it, and linear fields are exact."""
    rng = np.random.default_rng(3)
    corner = np.array([[-2, -2], [2, -2], [2, 2], [-2, 2], [0, -2], [2, 0], [0, 2], [-2, 0.0]])
    corner = np.vstack([corner, [0.4, 0.3]])
    middle = {}

    def quad(*vertices):
        rim = [corner[v] for v in vertices]
        for a, b in zip(vertices, np.roll(vertices, -1), strict=True):
            inner = {a, b} - {0, 1, 2, 3} == {a, b} and 8 in (a, b)
            bend = amount * rng.uniform(-1, 1, 2) * inner
            rim.append(middle.setdefault(frozenset((a, b)), (corner[a] + corner[b]) / 2 + bend))
        return "QUAD8", np.array(rim)

    master = [quad(0, 4, 8, 7), quad(4, 1, 5, 8), quad(8, 5, 2, 6), quad(7, 8, 6, 3)]
    points, slave, masters = facing((kind, bent_face(kind, amount, 1)), master, 0.25)
    operator = gap_operator(slave, masters, 1, len(points), 9.0, RAW)
    area = operator.surface.area
    assert operator.surface.covered == pytest.approx(area, rel=1e-14)
    assert operator.initial == pytest.approx(0.25 * area, rel=1e-14)
    field = np.zeros_like(points)
    field[:, 2] = points @ [0.7, -0.4, 0.0]
    assert operator.matrix @ field.ravel() == pytest.approx(0.0, abs=1e-15)
    assert operator.segments > 4


@pytest.mark.parametrize("kind", ["QUAD4", "TRIA6", "QUAD8", "QUAD9"])
def test_segments_of_a_warped_face_sum_to_it(kind):
    """∫ N n dS of a face that is not flat, whose integrand is a polynomial in its reference face.

    The edges of its four masters cross it; it lies within their outline.
    """
    rng = np.random.default_rng(2)
    places = BY_NAME[kind].nodes + 0.05 * rng.uniform(-1, 1, BY_NAME[kind].nodes.shape)
    rim = np.array([[-2, -2], [3, -2], [3, 3], [-2, 3], [0.4, -2], [3, 0.6], [0.5, 3], [-2, 0.3]])
    corner = np.vstack([rim, [0.45, 0.4]])
    quads = [(0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3)]
    masters = [("QUAD4", corner[list(quad)]) for quad in quads]
    points, _, upper = facing((kind, places), masters, 0.25)
    n = len(places)
    points[:n, 2] = 0.1 * rng.uniform(-1, 1, n)
    lower = facets(points, BY_NAME[kind], np.arange(n)[None], np.array([0]))
    found = intersect([lower], 0, upper, 9.0)
    assert {segments.master.index for segments in found} == {0, 1, 2, 3}
    summed = sum(np.einsum("sq,sqd,sqa->ad", s.weight, s.normal, s.slave.values) for s in found)
    reference, weights = gauss_rule(BY_NAME[kind].skeleton, 8)
    values, [vectors] = measured(lower, reference)
    exact = np.einsum("q,qa,qd->ad", weights, values, vectors)
    assert summed == pytest.approx(exact, abs=1e-13)


def test_half_of_a_bent_face_by_hand():
    """The cap of height ⅕ over a unit square, and the square: the master covers x > ½."""
    places = BY_NAME["QUAD8"].nodes.copy()
    places[6] += [0.0, 0.2]
    half = ("QUAD4", np.array([[0.5, -1.0], [2.0, -1.0], [2.0, 3.0], [0.5, 3.0]]))
    points, slave, master = facing(("QUAD8", places), [half])
    surface = gap_operator(slave, master, 1, len(points), 9.0, RAW).surface
    assert surface.area == pytest.approx([1 + 2 / 3 * 0.2], rel=1e-14)
    assert surface.covered == pytest.approx(surface.area / 2, rel=1e-14)


def test_a_cap_and_a_dent_by_hand():
    """A square less the region 0 ≤ y ≤ 4 h x (1 − x), of area ⅔ h; and what lies in both."""
    square = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
    low = square * [1.0, 0.5]
    bulge = np.zeros((1, 4, 2))
    bulge[0, 0] = [0.0, 0.3]
    region = Regions(start=low, bulge=np.zeros((1, 4, 2)), count=np.array([4]))
    for parts, area in (
        (clip_to_face(region, square, bulge), 0.5 - 0.2),
        (without_face(region, square, bulge), 0.2),
        (clip_to_face(region, square, -bulge), 0.5),
        (without_face(region, square, -bulge), 0.0),
    ):
        weights = [w.sum() for _, part in parts for _, _, w in quadrature(part, 2)]
        assert sum(weights) == pytest.approx(area, abs=1e-15)


def test_points_of_a_sliver_stay_near_it():
    """Between two arcs that differ by round-off, where area and moment are round-off as well."""
    start = np.array([[1.0, 0.0], [0.3, 0.2], [0.0, 0.1], [0.3, 0.2]])
    bulge = np.array([[0.01, 0.1], [0.0, 0.02], [0.0, 0.02], [0.01, 0.1]])
    noise = 1e-16 * np.random.default_rng(1).normal(size=(2000, 4, 2))
    bulge, count = np.tile(bulge, (2000, 1, 1)), np.full(2000, 4)
    for _, points, weights in quadrature(Regions(start=start + noise, bulge=bulge, count=count), 2):
        assert np.abs(weights.sum(axis=1)).max(initial=0.0) < 0.1
        assert ((points > -0.01) & (points < [1.01, 0.31])).all()


def test_the_image_of_a_region_does_not_depend_on_where_its_arcs_are_cut():
    """The unit square under (x e^(y/10), y e^(x/10)), also with a spike of no width.

    With I = ∫ e^(t/10) dt and K = ∫ t e^(t/10) dt over (0, 1), its area is I² − (K/10)².
    """

    def image(_, place, slope):
        (x, y), (dx, dy) = np.moveaxis(place, -1, 0), np.moveaxis(slope, -1, 0)
        a, b = np.exp(x / 10), np.exp(y / 10)
        return (
            np.stack([x * b, y * a], axis=-1),
            np.stack([dx * b + x * b * dy / 10, dy * a + y * a * dx / 10], axis=-1),
        )

    e = np.exp(0.1)
    area = (10 * (e - 1)) ** 2 - ((100 - 90 * e) / 10) ** 2
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    spiked = [(0, 0), (1, 0), (0.5, 0.75), (0.75, 0.375), (1, 0), (1, 0.4), (1, 1), (0, 1)]
    for chain in (square, spiked):
        start = np.array([chain], dtype=float)
        region = Regions(start=start, bulge=0 * start, count=np.array([len(chain)]))
        found = sum(weight.sum() for _, _, weight in quadrature(region, 8, image))
        assert found == pytest.approx(area, rel=1e-14)


def edges(slave, masters):
    """Slave edges on y = 0 between the places `slave`, and master edges (x, x, y) above."""
    points = [(x, 0.0) for x in slave]
    lower = np.array([[i + 1, i] for i in range(len(slave) - 1)])
    upper = len(points) + np.arange(2 * len(masters)).reshape(-1, 2)
    points = np.array([*points, *((x, m[2]) for m in masters for x in m[:2])])
    kind = BY_NAME["SEG2"]
    lower = facets(points, kind, lower, np.arange(len(lower)))
    return points, [lower], [facets(points, kind, upper, np.arange(len(upper)))]


@pytest.mark.parametrize("depth", [0.3, 3.0, 50.0])
def test_the_lower_side_of_a_step_is_not_in_contact(depth):
    """A macro-element that lies 70 % over the upper side sees that side alone."""
    points, slave, master = edges([0, 1, 2], [(0, 1, 0.0), (1, 1.7, 0.0), (1.7, 3, depth)])
    operator = gap_operator(slave, master, 2, len(points), 60.0)
    assert operator.covered == pytest.approx([1.0, 0.7])
    assert operator.initial == pytest.approx([0.0, 0.0], abs=1e-15)


def test_surfaces_far_apart_are_paired():
    """A macro-element that sees one surface alone meets it, however far away."""
    points, slave, master = edges([0, 1, 2, 3], [(0, 2, 0.0), (2, 4, 50.0)])
    operator = gap_operator(slave, master, 3, len(points), 60.0)
    assert operator.covered == pytest.approx([1.0, 1.0, 1.0])
    assert operator.initial == pytest.approx([0.0, 0.0, 50.0])


@pytest.mark.parametrize("parts", [1, 2, 7])
def test_blocks_at_an_angle_stay_whole(parts):
    """A master at 45°, in one body or in parts that share no node; the last edge faces nothing."""
    points = np.array([[x, 0.0] for x in range(6)])
    ends = np.linspace(0, 4, parts + 1)
    above = np.array([[x, x] for pair in pairwise(ends) for x in pair])
    kind, count = BY_NAME["SEG2"], len(points)
    slave = facets(points, kind, np.array([[i + 1, i] for i in range(5)]), np.arange(5))
    points = np.concatenate([points, above])
    pairs = count + np.arange(2 * parts).reshape(-1, 2)
    operator = gap_operator(
        [slave], [facets(points, kind, pairs, np.arange(parts))], 5, len(points)
    )
    assert operator.covered == pytest.approx([1.0, 1.0, 1.0, 1.0, 0.0])
    assert operator.initial == pytest.approx([0.5, 1.5, 2.5, 3.5, 0.0])
    assert operator.surface.lost.tolist() == [0.0] * 5


def skins(width, lower, upper):
    """Two blocks, one on the other, whose whole boundaries are slave (the upper one) and master."""
    corner = np.array([(0, 0), (width, 0), (width, 1), (0, 1)])
    points = np.concatenate([corner * [1, upper], corner * [1, lower] - [0, lower]])
    around, kind = np.array([[0, 1], [1, 2], [2, 3], [3, 0]]), BY_NAME["SEG2"]
    slave = facets(points, kind, around, np.arange(4))
    return points, slave, facets(points, kind, around + 4, np.arange(4))


@pytest.mark.parametrize("width", [0.5, 3.0, 100.0])
def test_a_surface_is_not_seen_through_a_body(width):
    """The upper side of the upper block faces the lower side of the lower one, 3 behind it."""
    points, slave, master = skins(width, 2.0, 1.0)
    operator = gap_operator([slave], [master], 4, len(points))
    assert operator.covered == pytest.approx([width, 0.0, 0.0, 0.0])
    assert operator.surface.lost.tolist() == [0.0] * 4


def test_lost_segments_are_missed(monkeypatch):
    """A fault in the choice of segments: what they covered is opposite the master."""
    points, slave, master = edges([0, 1, 2], [(0, 0.5, 0.0), (0.5, 1.5, 0.2)])

    def lost(fault):
        monkeypatch.setattr(operator_module, "on_one_surface", fault)
        return gap_operator(slave, master, 2, len(points), scheme=MEASURED).surface.lost

    assert lost(lambda found, *_: found) == pytest.approx([0.0, 0.0])
    assert lost(lambda found, *_: [s.of(s.macro == 1) for s in found]) == pytest.approx([1.0, 0.0])
    half = lost(lambda found, *_: [s.of(s.gap.max(axis=1) < 0.1) for s in found])
    assert half[0] == pytest.approx(0.5)
    # The edge of the master is known to one of the points, of weight 0.326.
    assert half[1] == pytest.approx(0.5 - 0.326, abs=1e-3)


def test_the_lower_side_of_a_shallow_step_is_reported():
    points, slave, master = edges([0, 1], [(0, 0.7, 0.0), (0.7, 1.0, 0.3)])
    surface = gap_operator(slave, master, 1, len(points), scheme=MEASURED).surface
    assert surface.covered == pytest.approx([0.7])
    assert surface.lost == pytest.approx([0.3])
    points, slave, master = edges([0, 1], [(0, 0.7, 0.0), (0.7, 1.0, 3.0)])
    surface = gap_operator(slave, master, 1, len(points), scheme=MEASURED).surface
    assert surface.lost == pytest.approx([0.0])


def test_sloping_surfaces_stay_whole():
    """A master surface of slope 0.4 over one macro-element of size 2 is one surface."""
    points = np.array([[0, 0], [1, 0], [2, 0], [0, 0], [1, 0.4], [2, 0.8]])
    kind = BY_NAME["SEG2"]
    slave = facets(points, kind, np.array([[1, 0], [2, 1]]), np.array([0, 0]))
    master = facets(points, kind, np.array([[3, 4], [4, 5]]), np.array([0, 1]))
    operator = gap_operator([slave], [master], 1, len(points), 9.0)
    assert operator.covered == pytest.approx([2.0])
    assert operator.initial == pytest.approx([0.8])


def test_the_nearer_of_two_edges_counts():
    shelves = [(0.2, 0.6, 0.01), (0.0, 0.3, 0.02), (0.5, 0.7, -0.05)]
    points, slave, master = edges([0, 1], shelves)
    operator = gap_operator(slave, master, 1, len(points), 9.0)
    assert operator.covered == pytest.approx([0.7])
    assert operator.initial == pytest.approx([0.4 * 0.01 + 0.2 * 0.02 - 0.1 * 0.05])


@pytest.mark.parametrize("bend", [0.0, 0.05])
def test_the_nearer_of_two_faces_counts(bend):
    """Shelves (x, x, y, y, z) over the unit square, and a floor behind all of them.

    With a bend, the edge of the nearest shelf at x = 0.6 is a cap of ⅔ · 0.5 · bend.
    """
    shelves = [(0.2, 0.6, 0.2, 0.7, 0.01), (0.0, 0.3, 0.0, 0.5, 0.02), (0.5, 0.9, 0.1, 0.9, 0.03),
               (0.0, 1.0, 0.0, 1.0, 0.04)]  # fmt: skip
    square = BY_NAME["QUAD8"].nodes
    points, faces = [np.pad(square, ((0, 0), (0, 1)))], []
    for low, high, left, right, z in shelves:
        place = square * [high - low, right - left] + [low, left]
        place[5, 0] += bend * (z == 0.01)
        faces.append(8 * len(points) + np.array(BY_NAME["QUAD8"].mirror))
        points.append(np.column_stack([place, np.full(8, z)]))
    points = np.concatenate(points)
    slave = facets(points, BY_NAME["QUAD8"], np.arange(8)[None], np.array([0]))
    master = facets(points, BY_NAME["QUAD8"], np.array(faces), np.arange(4))
    operator = gap_operator([slave], [master], 1, len(points), 9.0)
    cap = 2 / 3 * 0.5 * bend
    area = np.array([0.2 + cap, 0.15 - 0.03, 0.32 - 0.05 - cap, 0.0])
    area[3] = 1 - area.sum()
    assert operator.covered == pytest.approx([1.0], rel=1e-14)
    assert operator.initial == pytest.approx([area @ [0.01, 0.02, 0.03, 0.04]], rel=1e-13)


def test_candidates_without_common_area():
    """A bent edge beside a master edge: their balls meet, their normals' lines do not."""
    points = np.array([[1, 0], [0, 0], [0.5, 0.05], [1.1, 0.1], [2, 0.1], [1.5, 0.15]])
    kind = BY_NAME["SEG3"]
    slave = facets(points, kind, np.array([[0, 1, 2]]), np.array([0]))
    master = facets(points, kind, np.array([[3, 4, 5]]), np.array([0]))
    operator = gap_operator([slave], [master], 1, len(points), 1.0)
    assert operator.segments == 0
    assert operator.covered == pytest.approx([0.0])


@pytest.mark.parametrize("kind", ["TRIA6", "QUAD8", "QUAD9"])
def test_faces_of_a_sphere_are_covered(kind):
    """Faces bent out of their plane are covered to the accuracy of their area's quadrature."""

    def on_sphere(places, radius):
        x, y = 0.4 * (places - 0.4).T
        return radius * np.stack([np.sin(x), np.cos(x) * np.sin(y), np.cos(x) * np.cos(y)], axis=1)

    square = BY_NAME["QUAD9"]
    above = 3 * square.nodes[list(square.mirror)] - 1
    points = np.concatenate([on_sphere(BY_NAME[kind].nodes, 1.0), on_sphere(above, 1.01)])
    n = BY_NAME[kind].n_nodes
    slave = facets(points, BY_NAME[kind], np.arange(n)[None], np.array([0]))
    master = facets(points, square, np.arange(n, len(points))[None], np.array([0]))
    surface = gap_operator([slave], [master], 1, len(points), 9.0).surface
    assert surface.covered == pytest.approx(surface.area, rel=1e-6)


def wavy(count, height):
    """Points and QUAD4 of a square of edge 1 in count² faces, their height a function of x, y."""
    x, y = np.meshgrid(*[np.linspace(0, 1, count + 1)] * 2, indexing="ij")
    points = np.stack([x, y, height(x, y)], axis=-1).reshape(-1, 3)
    corner = np.arange((count + 1) ** 2).reshape(count + 1, -1)
    ends = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    return points, np.stack([end.ravel() for end in ends], axis=1)


def test_parts_and_threads_change_no_segment(monkeypatch):
    """Where an upper part of the master hides the lower one in a few of the parts."""
    below, slave_faces = wavy(6, lambda x, y: 0.02 * np.sin(4 * x) * y)
    above, master_faces = wavy(5, lambda x, y: 0.05 + 0.03 * np.cos(3 * y))
    roof, roof_faces = wavy(3, lambda x, y: 0.2 + 0.01 * x)
    points = np.concatenate([below, above, 0.5 * roof + 0.1])
    kind = BY_NAME["QUAD4"]
    upper = np.concatenate([master_faces, len(above) + roof_faces])[:, ::-1] + len(below)
    slave = facets(points, kind, slave_faces, np.arange(len(slave_faces)))
    master = facets(points, kind, upper, np.arange(len(upper)))

    def found():
        operator = gap_operator([slave], [master], len(slave_faces), len(points), 9.0)
        return operator.segments, operator.matrix.data, operator.initial, operator.covered

    whole = found()
    hidden, _ = hidden_pairs(face_pairs([slave], 0, [master], 9.0))
    assert len(hidden) > 9
    monkeypatch.setattr(segments, "_PAIRS_AT_ONCE", 40)
    parts = []
    for count in (1, 5):
        monkeypatch.setattr(threads, "workers", lambda n=count: n)
        parts.append(found())
    for values in zip(*parts, whole, strict=True):
        np.testing.assert_array_equal(values[1], values[0])
        np.testing.assert_allclose(values[0], values[2], rtol=1e-12, atol=1e-15)
