"""Times Gmsh's test of the Jacobian of curved hexahedra, for comparison.

    pip install -r benches/peers/requirements.txt
    cargo bench -p benches --bench injectivity
    python3 benches/peers/injectivity.py

The cells are those of the criterion benchmark: the same numbers from the same generator,
and, if the benchmark has left target/injectivity.json, the lattices near the limit and
the lone cells with a prescribed least determinant. Each cell becomes a hexahedron of
order 3 with 64 nodes, which represents the tri-cubic map without an error but rounding;
the nodes lie where Gmsh says. Before anything is timed, determinants are compared with
those of the spline, and the benchmark's if there are any.

Everything runs on one thread; figures are medians over several runs, in microseconds a
cell. If criterion has left its estimates under target/criterion, ours and the ratio
follow. What Gmsh computes is an enclosure of the least determinant, wide where that is far
from zero and narrower near zero, in plain doubles; ours is the sign, with proof. It has no
cheaper question to ask.
"""

import json
import os
import statistics
import sys
import time
from pathlib import Path

import gmsh
import numpy as np

RUNS = 5
LONE = 20
MASK = (1 << 64) - 1
REPOSITORY = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target"))


def scattered(count, seed):
    """`scattered` of benches/src/lib.rs: points of the unit cube, by xorshift."""
    state = seed * 0x9E37_79B9_7F4A_7C15 & MASK
    out = np.empty(3 * count)
    for i in range(3 * count):
        state ^= state << 13 & MASK
        state ^= state >> 7
        state ^= state << 17 & MASK
        out[i] = (state >> 11) / (1 << 53)
    return out.reshape(count, 3)


def noise(cells, amplitude, seed):
    """Displacements d[i, j, k, component] of a cubic lattice of cells^3 unit cells."""
    n = cells + 3
    points = amplitude * (2.0 * scattered(n**3, seed) - 1.0)
    # The first axis is the fastest.
    return points.reshape(n, n, n, 3).transpose(2, 1, 0, 3)


def cubic(t):
    """The four cubic basis functions of a cell, and their derivatives."""
    s = 1.0 - t
    values = np.stack(
        [s**3, 3 * t**3 - 6 * t**2 + 4, 3 * s**3 - 6 * s**2 + 4, t**3], axis=-1
    )
    slopes = np.stack(
        [-3 * s**2, 9 * t**2 - 12 * t, -9 * s**2 + 12 * s, 3 * t**2], axis=-1
    )
    return values / 6.0, slopes / 6.0


def images(displacements, cell, local):
    """Images of points with local coordinates from 0 to 1 in a cell."""
    i, j, k = cell
    block = displacements[i : i + 4, j : j + 4, k : k + 4]
    u, v, w = (cubic(local[:, axis])[0] for axis in range(3))
    return local + np.array(cell) + np.einsum("pi,pj,pk,ijkc->pc", u, v, w, block)


def determinants(displacements, cell, local):
    """The determinant of the Jacobian at such points."""
    i, j, k = cell
    block = displacements[i : i + 4, j : j + 4, k : k + 4]
    bases = [cubic(local[:, axis]) for axis in range(3)]
    columns = []
    for axis in range(3):
        u, v, w = (bases[a][int(a == axis)] for a in range(3))
        columns.append(np.einsum("pi,pj,pk,ijkc->pc", u, v, w, block))
    return np.linalg.det(np.stack(columns, axis=-1) + np.eye(3))


class Cells:
    """All cells of lattices as hexahedra of Gmsh, each with nodes of its own."""

    def __init__(self, lattices):
        gmsh.clear()
        mesh = gmsh.model.mesh
        self.type = mesh.getElementType("hexahedron", 3)
        _, dimension, order, count, nodes, _ = mesh.getElementProperties(self.type)
        assert (dimension, order, count) == (3, 3, 64)
        # Gmsh's reference cube goes from -1 to 1.
        nodes = (np.array(nodes).reshape(64, 3) + 1.0) / 2.0
        self.places = [
            (lattice, cell)
            for lattice in lattices
            for cell in np.ndindex(*(n - 3 for n in lattice.shape[:3]))
        ]
        positions = np.concatenate([images(*place, nodes) for place in self.places])
        entity = gmsh.model.addDiscreteEntity(3)
        tags = np.arange(1, len(positions) + 1)
        mesh.addNodes(3, entity, tags, positions.ravel())
        self.tags = np.arange(1, len(self.places) + 1)
        mesh.addElementsByType(entity, self.type, self.tags, tags)

    def least(self, tags):
        """Gmsh's lower bound of the determinant in each cell, with respect to our unit cube."""
        found = gmsh.model.mesh.getElementQualities(tags, "minDetJac")
        return 8.0 * np.asarray(found)

    def check(self, samples=6):
        """Compares with determinants of our own."""
        random = np.random.default_rng(1)
        for tag in self.tags[:: max(1, len(self.tags) // samples)]:
            local = random.uniform(0.0, 1.0, (8, 3))
            _, theirs, _ = gmsh.model.mesh.getJacobian(tag, (2.0 * local - 1.0).ravel())
            ours = determinants(*self.places[tag - 1], local)
            assert np.allclose(8.0 * np.asarray(theirs), ours, rtol=0, atol=1e-12)
            net = np.stack(np.meshgrid(*[np.linspace(0, 1, 9)] * 3), -1).reshape(-1, 3)
            sampled = determinants(*self.places[tag - 1], net).min()
            assert self.least([tag])[0] <= sampled + 1e-12


def median_us(run):
    """Median time of a call in microseconds, after one call that does not count."""
    run()
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times) * 1e6


def whole(cells):
    """Microseconds a cell, all at once."""
    return median_us(lambda: cells.least(cells.tags)) / len(cells.tags)


def one_by_one(cells):
    """Microseconds a cell for each cell by itself."""
    return [median_us(lambda tag=tag: cells.least([tag])) for tag in cells.tags]


def plugin(cells):
    """The plugin of Gmsh that does the same for a whole mesh, microseconds a cell."""
    name = "AnalyseMeshQuality"
    for option, value in [
        ("JacobianDeterminant", 1), ("IGEMeasure", 0), ("ICNMeasure", 0),
        ("HidingThreshold", -1), ("Recompute", 1), ("CreateView", 0),
        ("DimensionOfElements", 3),
    ]:
        gmsh.plugin.setNumber(name, option, value)
    return median_us(lambda: gmsh.plugin.run(name)) / len(cells.tags)


def ours():
    """Criterion's medians in microseconds a cell, by benchmark."""
    found = {}
    for file in sorted((TARGET / "criterion").glob("injectivity_*/**/new/estimates.json")):
        benchmark = json.loads((file.parent / "benchmark.json").read_text())
        elements = (benchmark.get("throughput") or {}).get("Elements", 1)
        median = json.loads(file.read_text())["median"]["point_estimate"]
        found[benchmark["full_id"]] = median / elements / 1e3
    return found


def report(job, theirs, benchmark, found):
    line = f"{job:40}{theirs:10.1f} us a cell"
    if benchmark in found:
        mine = found[benchmark]
        line += f"; ours {mine:.3g}, ratio {theirs / mine:.0f}"
    print(line, flush=True)


def main():
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    print(f"Gmsh {gmsh.__version__}, minDetJac")
    found = ours()
    try:
        scales = json.loads((TARGET / "injectivity.json").read_text())
    except OSError:
        scales = {"limit": {}, "min_det": {}, "det": []}
        print("no target/injectivity.json: nothing near the limit", file=sys.stderr)

    lattice = noise(10, 0.2, 1)
    for point, det in scales["det"]:
        cell = np.minimum(np.array(point).astype(int), 9)
        here = determinants(lattice, tuple(cell), (np.array(point) - cell)[None])[0]
        assert abs(here - det) < 1e-12, (point, here, det)

    cells = Cells([noise(1, 0.2, seed) for seed in range(1, LONE + 1)])
    cells.check()
    lone = one_by_one(cells)
    report("lone cell, 0.2", statistics.median(lone), "injectivity_lone_cell/0.2", found)

    cells = Cells([noise(10, 0.2, 1)])
    cells.check()
    report("1000 cells, 0.2", whole(cells), "injectivity_lattice/0.2, 1000 cells", found)
    print(f"{'    by AnalyseMeshQuality':40}{plugin(cells):10.1f} us a cell")

    for count, limit in scales["limit"].items():
        cells = Cells([noise(int(count), 0.999 * limit, 1)])
        cells.check()
        name = f"limit, {int(count) ** 3} cells"
        least = cells.least(cells.tags).min()
        report(name, whole(cells), f"injectivity_lattice/{name}", found)
        print(f"{'    least determinant by Gmsh':40}{least:10.2e}")

    for least, amplitudes in scales["min_det"].items():
        cells = Cells([noise(1, a, seed) for seed, a in enumerate(amplitudes, 1)])
        cells.check()
        theirs = one_by_one(cells)
        prefix = f"injectivity_min_det/{least}/"
        mine = [us for name, us in found.items() if name.startswith(prefix)]
        if mine:
            found[prefix] = statistics.median(mine)
        job = f"lone cell, min det {least}, median"
        report(job, statistics.median(theirs), prefix, found)
        accepted = int((cells.least(cells.tags) > 0).sum())
        print(f"{'    all are regular; Gmsh accepts':40}{accepted:10} of {LONE}")
    gmsh.finalize()


if __name__ == "__main__":
    main()
