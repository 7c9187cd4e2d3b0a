//! The object as it is held: its deformer, its deformed surface, its tree.

use std::collections::BTreeMap;

use fem_tet::{Contact, TetMesh, io::ObjectFile, surface_triangles, total_volume};
use glam::DVec3;
use spheretree::{Mesh, MeshError, SphereTree};

use crate::{
    deformer::{Deformer, DeformerError, DeformerKind, Elastic, FreeForm, HoldError, Step},
    scene::Object,
    touch::Surface,
};

/// Share of its rest volume that every element keeps, whatever the fingers do.
/// Linear elasticity means little beyond, and keep shape needs positive volumes.
pub const LEAST_VOLUME_RATIO: f64 = 0.1;

/// A deformable object.
#[derive(Debug, Clone)]
pub struct SoftBody {
    name: String,
    deformer: Deformer,
    display: Vec<[u32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Vertices of the surface with area-weighted normals of the rest shape.
    surface_vertices: Vec<(u32, DVec3)>,
    displacements: Vec<[f64; 3]>,
    positions: Vec<[f64; 3]>,
    tree: SphereTree,
}

/// Why an object cannot be squeezed.
#[derive(Debug, thiserror::Error)]
pub enum SoftBodyError {
    /// What deforms it.
    #[error(transparent)]
    Deformer(#[from] DeformerError),
    /// Its surface.
    #[error(transparent)]
    Surface(#[from] MeshError),
}

impl SoftBody {
    /// Prepares the deformation of an object and builds the tree over its surface.
    ///
    /// # Errors
    ///
    /// [`SoftBodyError`] if the mesh falls apart or is a mechanism.
    pub fn new(object: Object, deformer: DeformerKind) -> Result<Self, SoftBodyError> {
        let ObjectFile { mesh, display } = object.file;
        let triangles = surface_triangles(mesh.tets());
        let positions = mesh.positions().to_vec();
        let tree = SphereTree::build(Mesh::new(&positions, &triangles)?);
        Ok(Self {
            name: object.name,
            deformer: match deformer {
                DeformerKind::Fem => Deformer::Elastic(
                    Elastic::new(mesh, object.material).map_err(DeformerError::from)?,
                ),
                DeformerKind::Ffd => {
                    Deformer::FreeForm(Box::new(FreeForm::new(mesh).map_err(DeformerError::from)?))
                }
            },
            display,
            surface_vertices: surface_vertices(&positions, &triangles),
            triangles,
            displacements: vec![[0.0; 3]; positions.len()],
            positions,
            tree,
        })
    }

    /// Name of the object.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What deforms it.
    #[must_use]
    pub fn deformer(&self) -> &Deformer {
        &self.deformer
    }

    /// The rest shape.
    #[must_use]
    pub fn rest(&self) -> &TetMesh {
        self.deformer.rest()
    }

    /// Deformed positions, `#V × 3`, in the object's frame.
    #[must_use]
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// Displacements from the rest shape, `#V × 3`.
    #[must_use]
    pub fn displacements(&self) -> &[[f64; 3]] {
        &self.displacements
    }

    /// Triangles to draw.
    #[must_use]
    pub fn display(&self) -> &[[u32; 3]] {
        &self.display
    }

    /// Triangles of the surface that fingers touch.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The surface as it stands.
    #[must_use]
    pub fn surface(&self) -> Surface<'_> {
        Surface {
            tree: &self.tree,
            positions: &self.positions,
        }
    }

    /// The object as it stands, deformed, ready to be saved.
    ///
    /// # Errors
    ///
    /// [`fem_tet::MeshError`] if an element is flat, which [`Self::displace`]
    /// prevents.
    pub fn to_file(&self) -> Result<ObjectFile, fem_tet::MeshError> {
        Ok(ObjectFile {
            mesh: fem_tet::TetMesh::new(self.positions.clone(), self.rest().tets().to_vec())?,
            display: self.display.clone(),
        })
    }

    /// The contact of a fingertip that presses on an area.
    ///
    /// On an elastic body: all surface nodes within `radius_m` of the point it touches,
    /// nearer ones more, if the surface there faces the same way (a thin wall has another
    /// side). One node alone, the thesis's choice, would give way like a pin cushion, the
    /// more so the finer the mesh. Where fewer than three nodes are that near, the corners
    /// of the triangle take their place. A lattice spreads a touch by itself: there it is
    /// the touched point, by the corners of its triangle.
    ///
    /// # Panics
    ///
    /// If the contact is not with this object's surface.
    #[must_use]
    pub fn patch(&self, touched: &spheretree::Contact, radius_m: f64) -> Contact {
        let corners = self.triangles[touched.triangle as usize];
        let by_corners: Vec<(u32, f64)> = corners.into_iter().zip(touched.barycentric).collect();
        let weighted = |weights: &[(u32, f64)]| {
            Contact::weighted(weights).expect("weights of distinct nodes, one of them positive")
        };
        if self.deformer.kind() == DeformerKind::Ffd {
            return weighted(&by_corners);
        }
        let rest = self.rest().positions();
        let at = |v: u32| DVec3::from_array(rest[v as usize]);
        let [a, b, c] = corners.map(at);
        let facing = (b - a).cross(c - a);
        let [wa, wb, wc] = touched.barycentric;
        let point = a * wa + b * wb + c * wc;
        let weights: Vec<(u32, f64)> = self
            .surface_vertices
            .iter()
            .filter(|(_, normal)| normal.dot(facing) > 0.0)
            .map(|&(v, _)| {
                let r = at(v).distance(point) / radius_m;
                (v, (1.0 - r * r).max(0.0).powi(2))
            })
            .filter(|&(_, w)| w > 0.0)
            .collect();
        weighted(if weights.len() < 3 {
            &by_corners
        } else {
            &weights
        })
    }

    /// How far the surface under a contact is displaced.
    #[must_use]
    pub fn mean_displacement(&self, contact: &Contact) -> DVec3 {
        contact
            .weights()
            .iter()
            .map(|&(v, w)| DVec3::from_array(self.displacements[v as usize]) * w)
            .sum()
    }

    /// Prepares for displacements of these contacts.
    ///
    /// # Errors
    ///
    /// [`HoldError`] if the contacts do not hold the body, or hardly; it then has none.
    pub fn hold(&mut self, contacts: Vec<Contact>) -> Result<(), HoldError> {
        self.deformer.hold(contacts)
    }

    /// Displaces the contacts, and with them everything, as far as no element loses more
    /// than it may ([`LEAST_VOLUME_RATIO`]) and no lattice folds.
    ///
    /// # Panics
    ///
    /// If no contacts are held or their number differs.
    pub fn displace(&mut self, contact_displacements: &[[f64; 3]]) -> Step {
        let step = self.deformer.displace_into(
            contact_displacements,
            LEAST_VOLUME_RATIO,
            &mut self.displacements,
        );
        let rest = self.deformer.rest();
        for ((x, rest), u) in self
            .positions
            .iter_mut()
            .zip(rest.positions())
            .zip(&self.displacements)
        {
            *x = [rest[0] + u[0], rest[1] + u[1], rest[2] + u[2]];
        }
        step
    }

    /// Brings the tree up to date with the deformed surface.
    ///
    /// # Panics
    ///
    /// Never: positions stay finite.
    pub fn refit(&mut self) {
        self.tree
            .refit(&self.positions)
            .expect("deformed positions are finite");
    }

    /// Lets go: the body springs back to its rest shape.
    pub fn relax(&mut self) {
        self.deformer.let_go();
        self.displacements.fill([0.0; 3]);
        self.positions
            .copy_from_slice(self.deformer.rest().positions());
        self.refit();
    }

    /// Keep shape (\[Ma98\] section 6.1.2): the deformed shape becomes the rest shape,
    /// free of stress, and the tree is rebuilt. Its centre of mass is where the old
    /// one was: fingers that pushed the body aside leave a dent, not a shift.
    ///
    /// # Errors
    ///
    /// [`SoftBodyError`] if the new shape cannot be deformed; nothing is changed then.
    pub fn keep_shape(&mut self) -> Result<(), SoftBodyError> {
        let shift = centre_of_mass(&self.positions, self.rest().tets())
            - centre_of_mass(self.rest().positions(), self.rest().tets());
        self.deformer = self.deformer.keep_shape(&self.displacements, -shift)?;
        self.relax();
        self.surface_vertices = surface_vertices(&self.positions, &self.triangles);
        self.tree
            .rebuild(Mesh::new(&self.positions, &self.triangles)?);
        Ok(())
    }

    /// Volume of the rest shape, cubic metres.
    #[must_use]
    pub fn rest_volume_m3(&self) -> f64 {
        let rest = self.rest();
        total_volume(rest.positions(), rest.tets())
    }

    /// Volume as it stands, cubic metres.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        total_volume(&self.positions, self.rest().tets())
    }

    /// Largest displacement from the rest shape, metres.
    #[must_use]
    pub fn largest_displacement_m(&self) -> f64 {
        self.displacements
            .iter()
            .map(|u| u.iter().map(|c| c * c).sum::<f64>())
            .fold(0.0, f64::max)
            .sqrt()
    }
}

/// Centre of mass of a body of even density.
fn centre_of_mass(positions: &[[f64; 3]], tets: &[[u32; 4]]) -> DVec3 {
    let (mut volume, mut moment) = (0.0, DVec3::ZERO);
    for tet in tets {
        let x = tet.map(|v| DVec3::from_array(positions[v as usize]));
        let six_volume = (x[1] - x[0]).dot((x[2] - x[0]).cross(x[3] - x[0]));
        volume += six_volume;
        moment += six_volume * (x[0] + x[1] + x[2] + x[3]) / 4.0;
    }
    moment / volume
}

/// The vertices of a surface, ascending, with area-weighted normals.
fn surface_vertices(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Vec<(u32, DVec3)> {
    let mut normals = BTreeMap::new();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| DVec3::from_array(positions[v as usize]));
        let normal = (b - a).cross(c - a);
        for &v in triangle {
            *normals.entry(v).or_insert(DVec3::ZERO) += normal;
        }
    }
    normals.into_iter().collect()
}
