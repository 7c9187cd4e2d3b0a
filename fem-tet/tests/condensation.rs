//! The condensed maps against a direct solve of the thesis's partitioned system.

#![expect(clippy::float_cmp, reason = "exact values are meant")]

mod common;

use common::{foam, kuhn_box};
use fem_tet::{Contact, ContactSet, ElasticBody, FemError, FreeMotion, Material, TetMesh};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use proptest::prelude::*;

/// Dense stiffness matrix by numerical quadrature-free energy differences:
/// column `j` is the gradient of the elastic energy of unit displacement `j`,
/// each element's energy taken from its strain, so that nothing is shared with
/// the crate's assembly.
fn dense_stiffness(mesh: &TetMesh, material: Material) -> DMatrix<f64> {
    let (e, nu) = (material.youngs_modulus_pa(), material.poissons_ratio());
    let (lambda, mu) = (
        e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
        e / (2.0 * (1.0 + nu)),
    );
    let n = 3 * mesh.positions().len();
    let mut k = DMatrix::zeros(n, n);
    for tet in mesh.tets() {
        let x = tet.map(|v| Vector3::from(mesh.positions()[v as usize]));
        let edges = Matrix3::from_columns(&[x[1] - x[0], x[2] - x[0], x[3] - x[0]]);
        let inverse = edges.try_inverse().expect("not flat");
        let volume = edges.determinant() / 6.0;
        // Strain of a unit displacement of local unknown 3 a + i.
        let strain = |a: usize, i: usize| -> Matrix3<f64> {
            let mut u = Matrix3::zeros();
            if a == 0 {
                u.row_mut(i).fill(-1.0);
            } else {
                u[(i, a - 1)] = 1.0;
            }
            let gradient = u * inverse;
            (gradient + gradient.transpose()) * 0.5
        };
        for a in 0..4 {
            for i in 0..3 {
                let ea = strain(a, i);
                let stress = Matrix3::identity() * (lambda * ea.trace()) + ea * (2.0 * mu);
                for b in 0..4 {
                    for j in 0..3 {
                        let (row, column) = (3 * tet[b] as usize + j, 3 * tet[a] as usize + i);
                        k[(row, column)] += volume * stress.component_mul(&strain(b, j)).sum();
                    }
                }
            }
        }
    }
    k
}

/// `Q_u = −K₁₁⁻¹ K₁₂ Q_k` and `F_u = K₂₁ Q_u + K₂₂ Q_k` by dense LU.
fn thesis_solve(k: &DMatrix<f64>, nodes: &[u32], d: &[[f64; 3]]) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
    let known: Vec<usize> = nodes
        .iter()
        .flat_map(|&n| [0, 1, 2].map(|i| 3 * n as usize + i))
        .collect();
    let unknown: Vec<usize> = (0..k.nrows()).filter(|i| !known.contains(i)).collect();
    let qk = DVector::from_column_slice(d.as_flattened());
    let k11 = k.select_rows(&unknown).select_columns(&unknown);
    let k12 = k.select_rows(&unknown).select_columns(&known);
    let qu = k11.lu().solve(&(-(k12 * &qk))).expect("regular");
    let mut q = DVector::zeros(k.nrows());
    for (slot, &i) in unknown.iter().enumerate() {
        q[i] = qu[slot];
    }
    for (slot, &i) in known.iter().enumerate() {
        q[i] = qk[slot];
    }
    let f = k * &q;
    let triple = |v: &DVector<f64>, i: usize| [v[3 * i], v[3 * i + 1], v[3 * i + 2]];
    (
        (0..k.nrows() / 3).map(|i| triple(&q, i)).collect(),
        nodes.iter().map(|&n| triple(&f, n as usize)).collect(),
    )
}

fn triple() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-1e-3..1e-3_f64)
}

/// Three to seven distinct nodes of a mesh of 27.
fn contact_nodes() -> impl Strategy<Value = Vec<u32>> {
    prop::sample::subsequence((0..27_u32).collect::<Vec<_>>(), 3..8).prop_shuffle()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// For every contact set that holds the body, in any order, the condensed
    /// displacements and forces are the thesis's; every other set is refused.
    #[test]
    fn condensed_equals_partitioned(nodes in contact_nodes(), d in prop::collection::vec(triple(), 7)) {
        let body = foam();
        let positions = body.mesh().positions();
        let collinear = nodes.iter().skip(2).all(|&n| {
            let [a, b, c] = [nodes[0], nodes[1], n].map(|n| Vector3::from(positions[n as usize]));
            (b - a).cross(&(c - a)).norm() < 1e-12
        });
        let d = &d[..nodes.len()];
        let set = match ContactSet::at_nodes(&body, &nodes) {
            Ok(set) => set,
            Err(error) => {
                prop_assert!(collinear, "refused {nodes:?}: {error}");
                return Ok(());
            }
        };
        prop_assert!(!collinear, "accepted collinear {nodes:?}");

        let (q, f) = thesis_solve(&dense_stiffness(body.mesh(), body.material()), &nodes, d);
        let mut u = vec![[f64::NAN; 3]; positions.len()];
        set.displacements_into(d, &mut u);
        let mut forces = vec![[f64::NAN; 3]; nodes.len()];
        set.forces_into(d, &mut forces);

        // Three contacts on a short lever can turn the body by 1e-3/0.01; all
        // displacements stay below 1e-1 m. Both solvers lose the condition of the
        // system, below 1e5 here, times ε.
        for (got, want) in u.iter().flatten().zip(q.iter().flatten()) {
            prop_assert!((got - want).abs() <= 0.1 * 1e5 * f64::EPSILON, "{got} {want}");
        }
        // Element stiffness E h = 200 N/m times that error.
        for (got, want) in forces.iter().flatten().zip(f.iter().flatten()) {
            prop_assert!((got - want).abs() <= 1e3 * 0.1 * 1e5 * f64::EPSILON, "{got} {want}");
        }
        for (&node, want) in nodes.iter().zip(d) {
            prop_assert_eq!(u[node as usize], *want);
        }
    }

    /// Contacts at weighted means of nodes: the same as the full constrained system
    /// `[K −E; Eᵀ 0] [u; λ] = [0; d]`, solved by dense LU.
    #[test]
    fn weighted_contacts_equal_the_constrained_system(
        weights in prop::collection::vec(prop::collection::btree_map(0..27_u32, 0.1..1.0_f64, 1..6), 3..6),
        d in prop::collection::vec(triple(), 6),
    ) {
        let body = foam();
        let contacts: Vec<Contact> = weights
            .iter()
            .map(|w| Contact::weighted(&w.iter().map(|(&n, &w)| (n, w)).collect::<Vec<_>>()))
            .collect::<Result<_, _>>()?;
        let Ok(set) = ContactSet::new(&body, contacts.clone()) else { return Ok(()) };
        let k = dense_stiffness(body.mesh(), body.material());
        let (n, m) = (k.nrows(), 3 * contacts.len());
        // In units that make both blocks of order one.
        let stiffness_scale = k.diagonal().max();
        let mut kkt = DMatrix::zeros(n + m, n + m);
        kkt.view_mut((0, 0), (n, n)).copy_from(&(k / stiffness_scale));
        let mut rhs = DVector::zeros(n + m);
        for (c, contact) in contacts.iter().enumerate() {
            for i in 0..3 {
                for &(node, weight) in contact.weights() {
                    kkt[(3 * node as usize + i, n + 3 * c + i)] = -weight;
                    kkt[(n + 3 * c + i, 3 * node as usize + i)] = weight;
                }
                rhs[n + 3 * c + i] = d[c][i];
            }
        }
        let solution = kkt.lu().solve(&rhs).expect("regular");
        let mut u = vec![[f64::NAN; 3]; n / 3];
        set.displacements_into(&d[..contacts.len()], &mut u);
        let size = solution.rows(0, n).amax();
        for (i, got) in u.as_flattened().iter().enumerate() {
            // The condition of the system, below 1e6 for contacts this close together.
            prop_assert!((got - solution[i]).abs() <= 1e6 * f64::EPSILON * (size + 1e-3));
        }
        let mut forces = vec![[f64::NAN; 3]; contacts.len()];
        set.forces_into(&d[..contacts.len()], &mut forces);
        let largest = solution.rows(n, m).amax() * stiffness_scale;
        for (i, got) in forces.as_flattened().iter().enumerate() {
            let want = solution[n + i] * stiffness_scale;
            prop_assert!((got - want).abs() <= 1e6 * f64::EPSILON * (largest + 1.0), "{got} {want}");
        }
    }

    /// Reactions of a free body are in equilibrium: forces and moments vanish.
    #[test]
    fn reactions_sum_to_zero(nodes in contact_nodes(), d in prop::collection::vec(triple(), 7)) {
        let body = foam();
        let Ok(set) = ContactSet::at_nodes(&body, &nodes) else { return Ok(()) };
        let mut forces = vec![[f64::NAN; 3]; nodes.len()];
        set.forces_into(&d[..nodes.len()], &mut forces);
        let (mut sum, mut moment, mut scale) = (Vector3::zeros(), Vector3::zeros(), 0.0_f64);
        for (&n, &f) in nodes.iter().zip(&forces) {
            let f = Vector3::from(f);
            sum += f;
            moment += Vector3::from(body.mesh().positions()[n as usize]).cross(&f);
            scale += f.norm();
        }
        // Stiffness of up to 1e3 N/m times displacements of 1e-3 m cancel in the
        // forces themselves, besides the condition of the system.
        let tolerance = 1e5 * f64::EPSILON * (scale + 1.0);
        prop_assert!(sum.norm() <= tolerance, "{sum}");
        prop_assert!(moment.norm() <= tolerance * 0.02, "{moment}");
    }

    /// Affine displacements of all the surface are reproduced inside (patch test).
    #[test]
    fn patch_test(a in prop::array::uniform3(triple()), b in triple()) {
        let body = foam();
        let affine = |x: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|r| b[r] + (0..3).map(|c| a[r][c] * x[c] * 100.0).sum::<f64>())
        };
        // Vertex 13 is the only inner one of the 3 × 3 × 3.
        let nodes: Vec<u32> = (0..27).filter(|&n| n != 13).collect();
        let set = ContactSet::at_nodes(&body, &nodes).expect("held");
        let positions = body.mesh().positions();
        let d: Vec<_> = nodes.iter().map(|&n| affine(positions[n as usize])).collect();
        let mut u = vec![[f64::NAN; 3]; 27];
        set.displacements_into(&d, &mut u);
        let want = affine(positions[13]);
        for i in 0..3 {
            // 78 unknowns, displacements up to 1e-2 m, condition below 1e3.
            prop_assert!((u[13][i] - want[i]).abs() <= 1e-2 * 1e3 * 78.0 * f64::EPSILON);
        }
    }

    /// Moving all contacts by one rigid motion costs no force, and the body follows.
    #[test]
    fn rigid_motion_is_free(t in triple(), w in triple(), nodes in contact_nodes()) {
        let body = foam();
        let Ok(set) = ContactSet::at_nodes(&body, &nodes) else { return Ok(()) };
        let motion = |x: [f64; 3]| -> [f64; 3] {
            (Vector3::from(t) + Vector3::from(w).cross(&Vector3::from(x))).into()
        };
        let positions = body.mesh().positions();
        let d: Vec<_> = nodes.iter().map(|&n| motion(positions[n as usize])).collect();
        let mut u = vec![[f64::NAN; 3]; positions.len()];
        set.displacements_into(&d, &mut u);
        for (got, &x) in u.iter().zip(positions) {
            let want = motion(x);
            for i in 0..3 {
                prop_assert!((got[i] - want[i]).abs() <= 1e-2 * 1e5 * f64::EPSILON);
            }
        }
    }
}

#[test]
fn too_few_contacts_name_the_free_motion() {
    let body = foam();
    let free = |nodes: &[u32]| match ContactSet::at_nodes(&body, nodes) {
        Err(FemError::UnderConstrained { free }) => Some(free),
        _ => None,
    };
    assert_eq!(free(&[]), Some(FreeMotion::Everything));
    assert_eq!(free(&[4]), Some(FreeMotion::AboutContact(0)));
    assert_eq!(free(&[0, 26]), Some(FreeMotion::AboutLine(0, 1)));
    // Three on the diagonal, the middle one named last.
    assert_eq!(free(&[0, 26, 13]), Some(FreeMotion::AboutLine(0, 1)));
    assert_eq!(free(&[0, 26, 1]), None);
    let message = ContactSet::at_nodes(&body, &[3, 5]).expect_err("two contacts");
    assert_eq!(
        message.to_string(),
        "the contacts do not hold the body: rotation about the line through contacts 0 and 1 stays free"
    );
}

#[test]
fn contacts_must_exist_and_differ() {
    let body = foam();
    assert!(matches!(
        ContactSet::at_nodes(&body, &[0, 1, 27]),
        Err(FemError::ContactOutOfRange {
            contact: 2,
            node: 27,
            vertex_count: 27
        })
    ));
    assert!(matches!(
        ContactSet::at_nodes(&body, &[0, 1, 5, 1]),
        Err(FemError::DependentContact { contact: 3 })
    ));
    let refused = |weights: &[(u32, f64)]| Contact::weighted(weights).is_err();
    assert!(refused(&[]) && refused(&[(1, 0.0)]) && refused(&[(1, f64::NAN)]));
    assert!(refused(&[(1, 2.0), (2, -1.0)]) && refused(&[(1, 1.0), (1, 1.0)]));
    assert!(!refused(&[(1, 2.0), (2, 1.0)]));
}

/// No displacement exceeds what the amplification allows, and nearly collinear
/// contacts show by it.
#[test]
fn amplification_bounds_displacements() {
    let body = foam();
    let spread = ContactSet::at_nodes(&body, &[0, 2, 6, 26]).expect("held");
    let d = [
        [1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.6, 0.8],
        [-1.0, 0.0, 0.0],
    ];
    let mut u = vec![[0.0; 3]; 27];
    spread.displacements_into(&d, &mut u);
    let largest = u
        .iter()
        .map(|u| Vector3::from(*u).norm())
        .fold(0.0, f64::max);
    assert!(largest <= spread.amplification());
    assert!(spread.amplification() < 10.0, "{}", spread.amplification());

    // Two corners, and a mean that lies a hundredth of an edge beside their middle.
    let beside = Contact::weighted(&[(1, 0.99), (4, 0.01)]).expect("a mean");
    let line = vec![Contact::node(0), Contact::node(2), beside];
    let line = ContactSet::new(&body, line).expect("not quite collinear");
    assert!(line.amplification() > 100.0, "{}", line.amplification());
}

/// All two-contact sets, on every choice of nodes, are refused: a plain Cholesky
/// accepts most of them.
#[test]
fn every_pair_of_contacts_is_refused() {
    let body = foam();
    for a in 0..27 {
        for b in 0..a {
            assert!(ContactSet::at_nodes(&body, &[a, b]).is_err(), "{a} {b}");
        }
    }
}

#[test]
fn parts_that_swing_or_float_are_refused() {
    let material = Material::new(1e4, 0.3).expect("in range");
    let (mut positions, mut tets) = kuhn_box([1, 1, 1], 1.0).into_parts();
    // A second tetrahedron on the edge (0, 1) only: a hinge.
    positions.extend([[0.5, -1.0, -0.2], [0.5, -1.0, 0.3]]);
    let mut hinged = tets.clone();
    hinged.push([0, 1, 8, 9]);
    let mesh = TetMesh::new(positions.clone(), hinged.clone()).or_else(|_| {
        hinged.last_mut().expect("pushed").swap(2, 3);
        TetMesh::new(positions.clone(), hinged)
    });
    let error = ElasticBody::new(mesh.expect("sound elements"), material).expect_err("a hinge");
    assert!(matches!(error, FemError::Mechanism { .. }), "{error}");

    let (far, far_tets) = kuhn_box([1, 1, 1], 1.0).into_parts();
    let (mut positions, _) = kuhn_box([1, 1, 1], 1.0).into_parts();
    positions.extend(far.iter().map(|p| [p[0] + 5.0, p[1], p[2]]));
    tets.extend(far_tets.iter().map(|t| t.map(|v| v + 8)));
    let mesh = TetMesh::new(positions, tets).expect("sound elements");
    assert!(matches!(
        ElasticBody::new(mesh, material),
        Err(FemError::Disconnected {
            parts: 2,
            vertex: 8
        })
    ));
}

/// Stiffness scales with Young's modulus and the size of the body, displacements
/// with neither.
#[test]
fn units_do_not_matter() {
    let reference = solve_scaled(1.0, 1.0);
    for (length, modulus) in [(1e-6, 1e3), (1e6, 1e-3), (1.0, 1e11)] {
        for (got, want) in solve_scaled(length, modulus).iter().zip(&reference) {
            assert!((got - want).abs() <= 1e-11, "{got} {want}");
        }
    }
}

/// Displacements, over the size of the body, of one fixed problem.
fn solve_scaled(length: f64, modulus: f64) -> Vec<f64> {
    let material = Material::new(modulus, 0.4).expect("in range");
    let body = ElasticBody::new(kuhn_box([2, 2, 1], length), material).expect("a sound body");
    let set = ContactSet::at_nodes(&body, &[0, 2, 8, 13]).expect("held");
    let d = [
        [0.1, 0.0, 0.0],
        [0.0, 0.2, 0.0],
        [0.0, 0.0, 0.1],
        [-0.1, 0.1, 0.0],
    ];
    let mut u = vec![[0.0; 3]; body.mesh().positions().len()];
    set.displacements_into(&d.map(|v| v.map(|c| c * length)), &mut u);
    u.as_flattened().iter().map(|c| c / length).collect()
}

#[test]
fn keep_shape_makes_the_deformed_shape_the_rest_shape() {
    let body = foam();
    let nodes = [0, 2, 6, 26];
    let d = [
        [1e-3, 0.0, 0.0],
        [0.0, 1e-3, 0.0],
        [0.0; 3],
        [0.0, 0.0, -2e-3],
    ];
    let set = ContactSet::at_nodes(&body, &nodes).expect("held");
    let mut u = vec![[0.0; 3]; 27];
    set.displacements_into(&d, &mut u);
    let kept = body.keep_shape(&u).expect("no element inverted");
    for (i, (rest, new)) in body
        .mesh()
        .positions()
        .iter()
        .zip(kept.mesh().positions())
        .enumerate()
    {
        for c in 0..3 {
            assert_eq!(new[c], rest[c] + u[i][c]);
        }
    }
    // Free of stress: zero displacement, zero force.
    let set = ContactSet::at_nodes(&kept, &nodes).expect("held");
    let mut forces = [[1.0; 3]; 4];
    set.forces_into(&[[0.0; 3]; 4], &mut forces);
    assert_eq!(forces, [[0.0; 3]; 4]);

    // Pushing one corner through the body inverts an element, and says which.
    let mut u = vec![[0.0; 3]; 27];
    u[0] = [0.05; 3];
    let error = body.keep_shape(&u).expect_err("inverted");
    assert!(
        matches!(error, FemError::Mesh(ref e) if e.tet().is_some()),
        "{error}"
    );
}
