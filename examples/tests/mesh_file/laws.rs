//! Laws for any mesh, next to the crates that read and write these formats.

use ply_rs_bw::{
    parser::Parser,
    ply::{
        Addable as _, DefaultElement, ElementDef, Encoding, Ply, Property, PropertyDef,
        PropertyType, ScalarType,
    },
    writer::Writer,
};
use proptest::{array::uniform3, collection::vec, prelude::*, sample::Index};

use super::*;
use named::{RICH_OBJ, STL_TEXT, rich_ply, stl_binary};

/// Finite numbers of every magnitude, and simple ones.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f64>().prop_filter("finite", |x| x.is_finite()),
        -100.0..100.0_f64,
        Just(0.0),
        Just(-0.0),
    ]
}

/// Coordinates that single precision has.
fn single() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f32>().prop_filter("finite", |x| x.is_finite()),
        -100.0..100.0_f32,
        Just(-0.0),
    ]
    .prop_map(f64::from)
}

type Mesh = (Vec<[f64; 3]>, Vec<Vec<u32>>);

fn mesh(coordinate: impl Strategy<Value = f64>) -> impl Strategy<Value = Mesh> {
    let positions = vec(uniform3(coordinate), 1..20);
    (positions, vec(vec(any::<Index>(), 3..7), 0..20)).prop_map(|(positions, faces)| {
        let count = positions.len();
        let index = |index: Index| u32::try_from(index.index(count)).expect("few");
        let face = |face: Vec<Index>| face.into_iter().map(index).collect();
        let faces = faces.into_iter().map(face).collect();
        (positions, faces)
    })
}

/// An OBJ by the simplest of writers.
fn plain_obj((positions, faces): &Mesh) -> String {
    let vertices = positions
        .iter()
        .map(|[x, y, z]| format!("v {x:?} {y:?} {z:?}\n"));
    let faces = faces.iter().map(|face| {
        let corners: String = face.iter().map(|c| format!(" {}", c + 1)).collect();
        format!("f{corners}\n")
    });
    vertices.chain(faces).collect()
}

/// A PLY by the crate's own writer.
fn plain_ply((positions, faces): &Mesh, encoding: Encoding, real: &ScalarType) -> Vec<u8> {
    let mut ply = Ply::<DefaultElement>::new();
    ply.header.encoding = encoding;
    let mut vertex = ElementDef::new("vertex".to_owned());
    for name in ["x", "y", "z"] {
        let real = PropertyType::Scalar(real.clone());
        vertex
            .properties
            .add(PropertyDef::new(name.to_owned(), real));
    }
    let mut face = ElementDef::new("face".to_owned());
    let list = PropertyType::List(ScalarType::UShort, ScalarType::UInt);
    face.properties
        .add(PropertyDef::new("vertex_index".to_owned(), list));
    ply.header.elements.add(vertex);
    ply.header.elements.add(face);
    let vertices = positions.iter().map(|position| {
        let values = ["x", "y", "z"].into_iter().zip(position);
        let property = |&value| match real {
            ScalarType::Double => Property::Double(value),
            _ => Property::Float(value as f32),
        };
        values
            .map(|(name, value)| (name.to_owned(), property(value)))
            .collect()
    });
    ply.payload.insert("vertex".to_owned(), vertices.collect());
    let corners = faces.iter().map(|face| {
        let list = Property::ListUInt(face.clone());
        [("vertex_index".to_owned(), list)].into_iter().collect()
    });
    ply.payload.insert("face".to_owned(), corners.collect());
    let mut bytes = Vec::new();
    Writer::new()
        .write_ply(&mut bytes, &mut ply)
        .expect("consistent");
    bytes
}

/// The positions and faces that the crate reads.
fn read_with_crate(bytes: &[u8]) -> Mesh {
    let ply = Parser::<DefaultElement>::new()
        .read_ply(&mut &*bytes)
        .expect("valid");
    let position = |vertex: &DefaultElement| {
        ["x", "y", "z"].map(|name| match vertex[name] {
            Property::Double(value) => value,
            Property::Float(value) => value.into(),
            ref other => panic!("{other:?}"),
        })
    };
    let face = |face: &DefaultElement| match &face[0] {
        Property::ListUInt(corners) => corners.clone(),
        other => panic!("{other:?}"),
    };
    (
        ply.payload["vertex"].iter().map(position).collect(),
        ply.payload["face"].iter().map(face).collect(),
    )
}

/// Every corner as `tobj` reads it: its position and its normal.
fn corners_with_tobj(text: &str) -> Vec<([f64; 3], [f64; 3])> {
    let (models, _) =
        tobj::load_obj_buf(&mut text.as_bytes(), &tobj::LoadOptions::default(), |_| {
            unreachable!("no materials")
        })
        .expect("valid");
    let mut corners = Vec::new();
    for tobj::Model { mesh, .. } in models {
        let (positions, _) = mesh.positions.as_chunks::<3>();
        let (normals, _) = mesh.normals.as_chunks::<3>();
        let normal = |at: usize| mesh.normal_indices.get(at).map(|&n| normals[n as usize]);
        let corner = |(at, &v)| (positions[v as usize], normal(at).unwrap_or_default());
        corners.extend(mesh.indices.iter().enumerate().map(corner));
    }
    corners
}

proptest! {
    /// parse ∘ encode is the identity on positions and faces, to the bit; with the same
    /// positions, encode ∘ parse is the identity on files.
    #[test]
    fn obj_comes_back(before in mesh(coordinate()), moves in vec(uniform3(coordinate()), 20)) {
        let text = plain_obj(&before);
        let mut file = obj(&text);
        prop_assert_eq!(bits(file.positions()), bits(&before.0));
        prop_assert_eq!(&faces(&file), &before.1);
        prop_assert_eq!(file.encode(MeshFormat::Obj).expect("finite"), text.as_bytes());

        let after = moves[..before.0.len()].to_vec();
        file.set_positions(after.clone());
        let bytes = file.encode(MeshFormat::Obj).expect("finite");
        let again = parse(&bytes, MeshFormat::Obj);
        prop_assert_eq!(bits(again.positions()), bits(&after));
        prop_assert_eq!(&faces(&again), &before.1);
        let corners = corners_with_tobj(str::from_utf8(&bytes).expect("text"));
        let expected = before.1.iter().flatten().map(|&v| after[v as usize]);
        let expected: Vec<_> = expected.collect();
        let corners: Vec<_> = corners.into_iter().map(|(position, _)| position).collect();
        prop_assert_eq!(bits(&corners), bits(&expected));
    }

    /// The same for PLY, of what the crate writes and as the crate reads it.
    #[test]
    fn ply_comes_back(before in mesh(single()), moves in vec(uniform3(single()), 20)) {
        let after = moves[..before.0.len()].to_vec();
        for encoding in [Encoding::Ascii, Encoding::BinaryLittleEndian, Encoding::BinaryBigEndian] {
            for real in [ScalarType::Float, ScalarType::Double] {
                let bytes = plain_ply(&before, encoding, &real);
                let mut file = parse(&bytes, MeshFormat::Ply);
                prop_assert_eq!(bits(file.positions()), bits(&before.0));
                prop_assert_eq!(&faces(&file), &before.1);
                prop_assert_eq!(file.encode(MeshFormat::Ply).expect("finite"), bytes);
                file.set_positions(after.clone());
                let (positions, faces) = read_with_crate(&file.encode(MeshFormat::Ply).expect("finite"));
                prop_assert_eq!(bits(&positions), bits(&after));
                prop_assert_eq!(&faces, &before.1);
            }
        }
    }

    /// PLY holds double precision to the bit, from an OBJ and back.
    #[test]
    fn obj_to_ply_and_back_is_exact(before in mesh(coordinate()), move_to in coordinate()) {
        let file = obj(&plain_obj(&before));
        let mut ply = parse(&file.encode(MeshFormat::Ply).expect("finite"), MeshFormat::Ply);
        prop_assert_eq!(bits(ply.positions()), bits(&before.0));
        prop_assert_eq!(&faces(&ply), &before.1);
        let mut positions = before.0.clone();
        positions[0][1] = move_to;
        ply.set_positions(positions.clone());
        let again = parse(&ply.encode(MeshFormat::Ply).expect("finite"), MeshFormat::Ply);
        prop_assert_eq!(bits(again.positions()), bits(&positions));
        let back = parse(&again.encode(MeshFormat::Obj).expect("finite"), MeshFormat::Obj);
        prop_assert_eq!(bits(back.positions()), bits(&positions));
        prop_assert_eq!(&faces(&back), &before.1);
    }

    /// The triangles of an STL come back, as text, binary, and as `stl_io` reads them.
    #[test]
    fn stl_comes_back(
        triangles in vec(uniform3(uniform3(single())), 1..20),
        moves in vec(uniform3(single()), 60),
    ) {
        let narrow = |p: [f64; 3]| p.map(|x| x as f32);
        let binary = stl_binary(&triangles.iter().map(|t| t.map(narrow)).collect::<Vec<_>>());
        let mut text = "solid\n".to_owned();
        for triangle in &triangles {
            text += "facet normal 0 0 0\nouter loop\n";
            for [x, y, z] in triangle.map(narrow) {
                text += &format!("vertex {x:e} {y:e} {z:e}\n");
            }
            text += "endloop\nendfacet\n";
        }
        text += "endsolid\n";
        let soup = |file: &MeshFile| -> Vec<[u64; 3]> {
            let position = |&v: &u32| file.positions()[v as usize].map(f64::to_bits);
            file.faces().flatten().map(position).collect()
        };
        for bytes in [binary.as_slice(), text.as_bytes()] {
            let mut file = parse(bytes, MeshFormat::Stl);
            prop_assert_eq!(soup(&file), bits(triangles.as_flattened()));
            prop_assert_eq!(file.encode(MeshFormat::Stl).expect("finite"), bytes);
            let count = file.positions().len();
            file.set_positions(moves[..count].to_vec());
            let moved = file.encode(MeshFormat::Stl).expect("finite");
            let again = parse(&moved, MeshFormat::Stl);
            prop_assert_eq!(soup(&again), soup(&file));
        }
        let ply = parse(&parse(&binary, MeshFormat::Stl).encode(MeshFormat::Ply).expect("finite"), MeshFormat::Ply);
        let written = ply.encode(MeshFormat::Stl).expect("finite");
        let mesh = stl_io::read_stl(&mut std::io::Cursor::new(&written)).expect("valid");
        let corners = mesh.into_triangle_vec().into_iter().flat_map(|t| t.vertices);
        let corners: Vec<_> = corners.map(|v| v.0.map(f64::from)).collect();
        prop_assert_eq!(bits(&corners), bits(triangles.as_flattened()));
    }

    /// However normals are shared and numbered, each corner gets the one that was set for
    /// its vertex and its `vn`.
    #[test]
    fn every_corner_gets_its_normal(
        corners in vec((0..6_usize, 0..5_usize, any::<bool>()), 3..40),
        chosen in vec(0..4_usize, 30),
        late in any::<bool>(),
    ) {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];
        let mut text = String::new();
        for vertex in 0..6 {
            text += &format!("v {vertex} 0 0\n");
        }
        // Some of the normals come between the faces, and may be used before that.
        let mut given = 3;
        text += "vn 0 0 1\nvn 0 0 -1\nvn 1 0 0\n";
        for (face, three) in corners.as_chunks::<3>().0.iter().enumerate() {
            if face == 2 {
                text += "vn -1 0 0\nvn 0 1 0\n";
                given = 5;
            }
            text += "f";
            for &(vertex, normal, is_relative) in three {
                let normal = if late { normal } else { normal % given };
                text += &match is_relative && normal < given {
                    true => format!(" {}//{}", vertex + 1, normal as i64 - given as i64),
                    false => format!(" {}//{}", vertex + 1, normal + 1),
                };
            }
            text += "\n";
        }
        if given < 5 {
            text += "vn -1 0 0\nvn 0 1 0";
        }
        let mut file = obj(&text);
        let before = corners_with_tobj(&text);
        // What was set, by vertex and old normal.
        let set: Vec<_> = file.normals().iter().zip(&chosen).map(|(old, &new)| (*old, axes[new])).collect();
        prop_assert_eq!(set.len(), file.normals().len());
        file.set_normals(set.iter().map(|&(_, new)| new).collect());
        let bytes = file.encode(MeshFormat::Obj).expect("finite");
        let after = corners_with_tobj(str::from_utf8(&bytes).expect("text"));
        prop_assert_eq!(before.len(), after.len());
        for (before, after) in before.iter().zip(&after) {
            prop_assert_eq!(before.0, after.0);
            let is_it = |old: &VertexNormal| {
                (f64::from(old.vertex), old.normal) == (before.0[0], before.1)
            };
            let expected = set.iter().find(|(old, _)| is_it(old)).expect("listed").1;
            prop_assert_eq!(after.1, expected);
        }
    }

    /// Files may be cut, changed or made up: reading ends in a mesh or an error. A mesh can
    /// be written, and what is read then has as many vertices.
    #[test]
    fn no_file_does_harm(
        sample in 0..7_usize,
        changes in vec((any::<Index>(), any::<u8>()), 0..6),
        pieces in vec((any::<Index>(), any::<Index>(), any::<Index>()), 0..3),
        cut in any::<Index>(),
        is_cut in any::<bool>(),
        noise in vec(any::<u8>(), 0..200),
    ) {
        let mut bytes = match sample {
            0 => RICH_OBJ.as_bytes().to_vec(),
            1 => rich_ply("ascii"),
            2 => rich_ply("binary_little_endian"),
            3 => rich_ply("binary_big_endian"),
            4 => STL_TEXT.as_bytes().to_vec(),
            5 => stl_binary(&[[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]]; 3]),
            _ => noise,
        };
        for (at, byte) in changes {
            if !bytes.is_empty() {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
        }
        // A piece of the file is put elsewhere, so that words meet that should not.
        for (from, length, to) in pieces {
            if !bytes.is_empty() {
                let from = from.index(bytes.len());
                let length = length.index(20).min(bytes.len() - from);
                let piece = bytes[from..from + length].to_vec();
                let to = to.index(bytes.len());
                bytes.splice(to..to, piece);
            }
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len() + 1));
        }
        for format in FORMATS {
            let Ok(mut file) = MeshFile::parse(&bytes, format) else {
                continue;
            };
            let count = file.positions().len();
            prop_assert!(file.faces().flatten().all(|&v| (v as usize) < count));
            prop_assert!(file.faces().all(|face| face.len() >= 3));
            prop_assert_eq!(&file.encode(format).expect("as it was"), &bytes);
            let moved = file.positions().iter().map(|p| p.map(|x| x / 2.0 + 0.1));
            file.set_positions(moved.collect());
            let turned = file.normals().iter().map(|n| [n.normal[1], n.normal[2], f64::from(n.vertex % 3)]);
            file.set_normals(turned.collect());
            for target in FORMATS {
                let notes = file.notes(target);
                prop_assert!(notes.iter().all(|note| !note.contains('\n')));
                match file.encode(target) {
                    Ok(written) => {
                        let again = parse(&written, target);
                        if target != MeshFormat::Stl {
                            prop_assert_eq!(again.positions().len(), count);
                            prop_assert_eq!(faces(&again), faces(&file));
                        }
                    }
                    Err(error) => {
                        let single = target == MeshFormat::Stl || target == format;
                        prop_assert!(single, "{}", error);
                    }
                }
            }
        }
    }
}
