//! Which samples a triangle covers, and how near it is there.
//!
//! A sample is a ray `d` from the eye. It meets the triangle `v₀ v₁ v₂` (seen
//! from the eye) where `d` is a combination `Σ λᵢ vᵢ` with `λᵢ ≥ 0`, and by
//! Cramer's rule `λ₀ = d · (v₁ × v₂) / det(v₀, v₁, v₂)`, and so on. These edge
//! functions are linear in `d`, hence in the sample's coordinates, and need no
//! division by depth: a triangle that reaches behind the eye is drawn like any
//! other, without being cut. Their sum is the inverse depth.
//!
//! The shared edge of two triangles has the same edge function in both up to
//! the sign, exactly so in floating point, hence there are no gaps.
//!
//! # References
//!
//! * M. Olano, T. Greer, *Triangle Scan Conversion using 2D Homogeneous
//!   Coordinates*, Graphics Hardware 1997.

use super::camera::Viewport;
use glam::DVec3;
use std::ops::Range;

/// Triangles whose plane passes this close to the eye, relative to their size,
/// are seen edge-on and cover nothing.
const EDGE_ON: f64 = 1e-12;

/// A triangle prepared for one grid of samples.
///
/// Linear functions are kept as `[per x, per y, constant]`.
#[derive(Debug, Clone)]
pub(super) struct Facet {
    /// Positive multiples of the `λᵢ`.
    edges: [DVec3; 3],
    /// Grows towards the viewer.
    nearness: DVec3,
    /// Samples with a larger value are too near to be seen.
    nearest: f64,
    columns: Range<usize>,
    rows: Range<usize>,
}

impl Facet {
    /// A triangle in camera axes; its nearness is the inverse of the depth.
    ///
    /// `None` if no sample can show it.
    pub(super) fn perspective(v: [DVec3; 3], near: f64, view: Viewport) -> Option<Self> {
        let normals = crosses(v);
        let det = usable_determinant(v, normals)?;
        let outline = v.into_iter().zip([v[1], v[2], v[0]]).flat_map(|(a, b)| {
            // The corners in front, and where an edge dips below the near plane.
            let corner = (a.z >= near).then_some(a);
            let crossing = ((a.z < near) != (b.z < near))
                .then(|| a + (b - a) * ((near - a.z) / (b.z - a.z)))
                .map(|p| DVec3::new(p.x, p.y, near));
            [corner, crossing].into_iter().flatten()
        });
        Self {
            edges: normals.map(|n| view.pull_back(n * det.signum())),
            nearness: view.pull_back((normals[0] + normals[1] + normals[2]) / det),
            nearest: 1.0 / near,
            columns: 0..view.width,
            rows: 0..view.height,
        }
        .bounded(outline.map(|p| view.project(p)))
    }

    /// A triangle seen by parallel rays: corners are `(x, y)` in samples and a
    /// nearness.
    pub(super) fn parallel(corners: [DVec3; 3], width: usize, height: usize) -> Option<Self> {
        let v = corners.map(|c| DVec3::new(c.x, c.y, 1.0));
        let normals = crosses(v);
        let det = usable_determinant(v, normals)?;
        Self {
            edges: normals.map(|n| n * det.signum()),
            nearness: (normals[0] * corners[0].z
                + normals[1] * corners[1].z
                + normals[2] * corners[2].z)
                / det,
            nearest: f64::INFINITY,
            columns: 0..width,
            rows: 0..height,
        }
        .bounded(v.into_iter().map(|p| [p.x, p.y]))
    }

    /// Restricts the search to the box around `outline`.
    fn bounded(mut self, outline: impl Iterator<Item = [f64; 2]>) -> Option<Self> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in outline {
            low = [low[0].min(p[0]), low[1].min(p[1])];
            high = [high[0].max(p[0]), high[1].max(p[1])];
        }
        self.columns = samples_between(low[0], high[0], self.columns.end);
        self.rows = samples_between(low[1], high[1], self.rows.end);
        (!self.columns.is_empty() && !self.rows.is_empty()).then_some(self)
    }

    /// Calls `visit(x, y, nearness)` for each covered sample of the given rows.
    pub(super) fn scan(&self, rows: &Range<usize>, mut visit: impl FnMut(usize, usize, f64)) {
        for row in self.rows.start.max(rows.start)..self.rows.end.min(rows.end) {
            let y = row as f64 + 0.5;
            let at_row = self.edges.map(|e| e.y * y + e.z);
            let nearness_at_row = self.nearness.y * y + self.nearness.z;
            for column in self.span(at_row) {
                let x = column as f64 + 0.5;
                let inside = (0..3).all(|i| self.edges[i].x * x + at_row[i] >= 0.0);
                let nearness = self.nearness.x * x + nearness_at_row;
                if inside && nearness <= self.nearest {
                    visit(column, row, nearness);
                }
            }
        }
    }

    /// The columns worth testing in a row, given the edge functions at `x = 0`.
    fn span(&self, at_row: [f64; 3]) -> Range<usize> {
        let (mut low, mut high) = (self.columns.start as f64, self.columns.end as f64);
        for (edge, constant) in self.edges.iter().zip(at_row) {
            let root = -constant / edge.x;
            if edge.x > 0.0 {
                low = low.max(root);
            } else if edge.x < 0.0 {
                high = high.min(root);
            }
        }
        let span = samples_between(low, high, self.columns.end);
        span.start.max(self.columns.start)..span.end
    }

    /// The weights of the corners where the ray through `(x, y)` meets the
    /// triangle, and the distance from each opposite edge in samples.
    pub(super) fn corner_weights(&self, x: f64, y: f64) -> ([f64; 3], [f64; 3]) {
        let e = self.edges.map(|e| (e.x * x + e.y * y + e.z).max(0.0));
        let scale = 1.0 / (e[0] + e[1] + e[2]);
        let distance = std::array::from_fn(|i| e[i] / self.edges[i].truncate().length());
        (e.map(|e| e * scale), distance)
    }
}

/// The edge functions `vⱼ × vₖ` opposite to corners 0, 1 and 2.
fn crosses(v: [DVec3; 3]) -> [DVec3; 3] {
    [v[1].cross(v[2]), v[2].cross(v[0]), v[0].cross(v[1])]
}

fn usable_determinant(v: [DVec3; 3], normals: [DVec3; 3]) -> Option<f64> {
    let det = v[0].dot(normals[0]);
    (det.abs() > EDGE_ON * v[0].length() * normals[0].length()).then_some(det)
}

/// The samples of a row whose centres can lie in `[low, high]`, one to spare.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion saturates, and the end is cut to the row"
)]
fn samples_between(low: f64, high: f64, count: usize) -> Range<usize> {
    (low - 1.0) as usize..((high + 1.0) as usize).min(count)
}
