//! Which triangles does a shape touch?

use std::ops::ControlFlow;

use crate::stack::Stack;
use crate::tree::Contents;
use crate::{Probe, SphereTree};

impl SphereTree {
    /// Whether the shape touches any triangle. Stops at the first one found.
    ///
    /// `positions` are those the tree was last built or refitted with. No
    /// allocation.
    ///
    /// # Panics
    ///
    /// If the number of positions differs from the number of vertices the tree
    /// was built over.
    pub fn any<P: Probe + ?Sized>(&self, positions: &[[f64; 3]], probe: &P) -> bool {
        self.visit_touched(positions, probe, |_| ControlFlow::Break(()))
            .is_break()
    }

    /// Replaces the contents of `out` by the ids of all triangles the shape
    /// touches, in ascending order.
    ///
    /// `positions` are those the tree was last built or refitted with. Nothing
    /// is allocated once `out` has grown to its working size.
    ///
    /// # Panics
    ///
    /// If the number of positions differs from the number of vertices the tree
    /// was built over; `out` is then unchanged.
    ///
    /// # Example
    ///
    /// ```
    /// use spheretree::{Mesh, Sphere, SphereTree};
    ///
    /// // Two triangles one above the other.
    /// let positions = [
    ///     [0., 0., 0.], [1., 0., 0.], [0., 1., 0.],
    ///     [0., 0., 1.], [1., 0., 1.], [0., 1., 1.],
    /// ];
    /// let tree = SphereTree::build(Mesh::new(&positions, &[[0, 1, 2], [3, 4, 5]])?);
    /// let mut touched = Vec::new();
    /// tree.collect(&positions, &Sphere::new([0.2, 0.2, 0.9], 0.2)?, &mut touched);
    /// assert_eq!(touched, [1]);
    /// tree.collect(&positions, &Sphere::new([0.2, 0.2, 0.5], 0.5)?, &mut touched);
    /// assert_eq!(touched, [0, 1]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn collect<P: Probe + ?Sized>(
        &self,
        positions: &[[f64; 3]],
        probe: &P,
        out: &mut Vec<u32>,
    ) {
        self.assert_matches(positions);
        out.clear();
        let _: ControlFlow<()> = self.visit_touched(positions, probe, |id| {
            out.push(id);
            ControlFlow::Continue(())
        });
        out.sort_unstable();
    }

    /// Calls `on_hit` with the id of each touched triangle, in tree order.
    fn visit_touched<P: Probe + ?Sized>(
        &self,
        positions: &[[f64; 3]],
        probe: &P,
        mut on_hit: impl FnMut(u32) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.assert_matches(positions);
        let mut pending = Stack::new();
        if !self.nodes.is_empty() {
            pending.push(0_u32);
        }
        while let Some(index) = pending.pop() {
            let node = &self.nodes[index as usize];
            if !probe.overlaps_sphere(&node.sphere) {
                continue;
            }
            match node.contents {
                Contents::Triangles { start, end } => {
                    for slot in start..end {
                        if probe.intersects_triangle(self.corners(positions, slot)) {
                            on_hit(self.ids[slot as usize])?;
                        }
                    }
                }
                Contents::Children { start, end } => {
                    (start..end).for_each(|child| pending.push(child));
                }
            }
        }
        ControlFlow::Continue(())
    }
}
