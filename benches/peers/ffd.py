"""Times free-form deformation in tools that Python users have, for comparison.

    pip install -r benches/peers/requirements.txt
    cargo bench -p benches --bench ffd
    python3 benches/peers/ffd.py

The job is that of the criterion benchmark: one million points, a lattice of 8 x 8 x 8
cells. Everything runs on one thread; each figure is the median over several runs, in
nanoseconds a point, and is checked against the same sum written out before it is timed.
If criterion has left its estimates under target/criterion, the ratio to ours follows.

What is compared:

* SimpleITK evaluates its B-spline transform (order 3, the same polynomials) on a regular
  grid of 100^3 points with the displacement field filter, which spares it Python's calls.
* scipy evaluates the three components of the displacement by map_coordinates (order 3,
  no prefilter: the same polynomials again) at a million scattered points.
* The Bernstein formula is that of Sederberg and Parry's lattice, degree 3 over the whole
  box, in NumPy: 64 control points, all of which act on every point.
"""

import json
import statistics
import sys
import time
from pathlib import Path

import numpy as np

CELLS = 8
POINTS = 1_000_000
RUNS = 5


def median_ns(run):
    """Median time of a call in nanoseconds a point, after one call that does not count."""
    run()
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return statistics.median(times) / POINTS * 1e9


def cubic(t):
    """The four cubic basis functions of a cell."""
    s = 1.0 - t
    return np.stack(
        [s**3, 3 * t**3 - 6 * t**2 + 4, 3 * s**3 - 6 * s**2 + 4, t**3], axis=-1
    ) / 6.0


def definition(coefficients, points):
    """The sum of the definition, for a few points; coefficients[i, j, k, component]."""
    cell = np.minimum(points.astype(int), CELLS - 1)
    weights = [cubic(points[:, a] - cell[:, a]) for a in range(3)]
    out = np.zeros_like(points)
    for i in range(4):
        for j in range(4):
            for k in range(4):
                w = weights[0][:, i] * weights[1][:, j] * weights[2][:, k]
                c = coefficients[cell[:, 0] + i, cell[:, 1] + j, cell[:, 2] + k]
                out += w[:, None] * c
    return out


def simple_itk(coefficients, _points):
    import SimpleITK as sitk

    sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
    transform = sitk.BSplineTransform(3, 3)
    transform.SetTransformDomainOrigin([0.0] * 3)
    transform.SetTransformDomainPhysicalDimensions([float(CELLS)] * 3)
    transform.SetTransformDomainMeshSize([CELLS] * 3)
    # One list a component, first axis fastest.
    flat = [coefficients[..., c].transpose(2, 1, 0).ravel() for c in range(3)]
    transform.SetParameters(np.concatenate(flat).tolist())

    field = sitk.TransformToDisplacementFieldFilter()
    field.SetOutputPixelType(sitk.sitkVectorFloat64)
    field.SetSize([100] * 3)
    spacing = CELLS / 100
    field.SetOutputSpacing([spacing] * 3)
    field.SetOutputOrigin([spacing / 2] * 3)

    some = [(3, 50, 99), (42, 17, 60), (0, 0, 0)]
    out = sitk.GetArrayFromImage(field.Execute(transform))
    found = np.array([out[k, j, i] for i, j, k in some])
    places = (np.array(some) + 0.5) * spacing
    assert np.allclose(found, definition(coefficients, places), atol=1e-12)
    return lambda: field.Execute(transform)


def scipy_spline(coefficients, points):
    from scipy.ndimage import map_coordinates

    components = [np.ascontiguousarray(coefficients[..., c]) for c in range(3)]
    # Coefficient i belongs to coordinate i - 1.
    places = np.ascontiguousarray(points.T + 1.0)

    def run():
        moved = [
            map_coordinates(c, places, order=3, prefilter=False, mode="nearest")
            for c in components
        ]
        return points + np.stack(moved, axis=-1)

    expected = points[:100] + definition(coefficients, points[:100])
    assert np.allclose(run()[:100], expected, atol=1e-12)
    return run


def bernstein(coefficients, points):
    control = coefficients[:4, :4, :4].reshape(64, 3)
    unit = points / CELLS

    def basis(t):
        s = 1.0 - t
        return np.stack([s**3, 3 * s**2 * t, 3 * s * t**2, t**3], axis=-1)

    def run():
        u, v, w = (basis(unit[:, a]) for a in range(3))
        weights = np.einsum("ni,nj,nk->nijk", u, v, w).reshape(len(points), 64)
        return points + weights @ control

    u, v, w = (basis(unit[0, a]) for a in range(3))
    expected = sum(
        u[i] * v[j] * w[k] * coefficients[i, j, k]
        for i in range(4) for j in range(4) for k in range(4)
    )
    assert np.allclose(run()[0], points[0] + expected, atol=1e-12)
    return run


def ours():
    """Criterion's medians in nanoseconds a point, by benchmark."""
    root = Path(__file__).resolve().parents[2] / "target" / "criterion"
    found = {}
    for file in sorted(root.glob("ffd_*/**/new/estimates.json")):
        benchmark = json.loads((file.parent / "benchmark.json").read_text())
        elements = (benchmark.get("throughput") or {}).get("Elements")
        name = benchmark["full_id"]
        evaluates = name.startswith(("ffd_bound", "ffd_any_order")) and "copy alone" not in name
        if elements == POINTS and evaluates:
            median = json.loads(file.read_text())["median"]["point_estimate"]
            found[name] = median / elements
    return found


def main():
    random = np.random.default_rng(1)
    coefficients = random.uniform(-0.2, 0.2, (CELLS + 3,) * 3 + (3,))
    points = random.uniform(0.0, CELLS, (POINTS, 3))
    peers = {
        "SimpleITK displacement field": simple_itk,
        "scipy map_coordinates": scipy_spline,
        "NumPy Bernstein": bernstein,
    }
    results = {}
    for name, build in peers.items():
        try:
            results[name] = median_ns(build(coefficients, points))
        except ImportError as error:
            print(f"{name}: not installed ({error})", file=sys.stderr)
            continue
        print(f"{name:32}{results[name]:10.1f} ns a point")
    for benchmark, ns in ours().items():
        ratios = ", ".join(f"{peer.split()[0]} {t / ns:.1f}x" for peer, t in results.items())
        print(f"{benchmark:44}{ns:8.1f} ns a point; {ratios}")


if __name__ == "__main__":
    main()
