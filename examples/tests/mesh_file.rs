//! Mesh files: what goes in comes out, and nothing else does any harm.

#![expect(
    clippy::cast_possible_truncation,
    clippy::float_cmp,
    reason = "single precision is meant where it is used, and equal means equal"
)]

use examples::mesh_file::{MeshFile, MeshFileError, MeshFormat, Place, Problem, VertexNormal};
use ply_rs_bw::{
    parser::Parser,
    ply::{
        Addable as _, DefaultElement, ElementDef, Encoding, Ply, Property, PropertyDef,
        PropertyType, ScalarType,
    },
    writer::Writer,
};
use proptest::{array::uniform3, collection::vec, prelude::*, sample::Index};

const FORMATS: [MeshFormat; 3] = [MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Stl];

fn parse(bytes: &[u8], format: MeshFormat) -> MeshFile {
    MeshFile::parse(bytes, format).unwrap_or_else(|error| panic!("{format}: {error}"))
}

fn obj(text: &str) -> MeshFile {
    parse(text.as_bytes(), MeshFormat::Obj)
}

/// The file as text, in its own format.
fn text(mesh: &MeshFile) -> String {
    let bytes = mesh.encode(mesh.format()).expect("finite");
    String::from_utf8(bytes).expect("text")
}

fn faces(mesh: &MeshFile) -> Vec<Vec<u32>> {
    mesh.faces().map(<[u32]>::to_vec).collect()
}

fn bits(positions: &[[f64; 3]]) -> Vec<[u64; 3]> {
    positions.iter().map(|p| p.map(f64::to_bits)).collect()
}

/// What is wrong with a file.
fn message(bytes: impl AsRef<[u8]>, format: MeshFormat) -> String {
    MeshFile::parse(bytes.as_ref(), format)
        .expect_err("refused")
        .to_string()
}

#[test]
fn formats_are_told_from_names() {
    let format = |name: &str| MeshFormat::from_path(name.as_ref());
    assert_eq!(format("a.obj"), Ok(MeshFormat::Obj));
    assert_eq!(format("b/a.b.PLY"), Ok(MeshFormat::Ply));
    assert_eq!(format("a.Stl"), Ok(MeshFormat::Stl));
    for unknown in ["a.gltf", "obj", ""] {
        let error = format(unknown).expect_err("unknown").to_string();
        assert!(error.contains(".obj, .ply and .stl are known"), "{error}");
    }
}

/// One of everything that an OBJ may have.
const RICH_OBJ: &str = "\u{FEFF}# Latin and beyond: \u{e9}\r
mtllib missing.mtl\r
o thing\r
v 0.10 0 0 1 0 0\r
v +1.0 .0 0e0   # a comment\r
 v\t1 1 \\\r
  0.50 2.0\r
v 0 1 0\r
vt 0 0\r
vt 1 1\r
vn 0 0 2\r
vn 0 0 0\r
vn 1 0 0\r
g side top\r
usemtl red\r
s 1\r
f 1/1/1 2/2/1 3//1 4//-3\r
f -4//2 -3//2 \\\r
 -2//2\r
f 1 2/1 3/\r
p 1\r
l 1 2 3\r
f 1 2\r
call other.obj\r
\r
v 9 9 9";

#[test]
fn an_obj_keeps_all_it_has() {
    let mut mesh = obj(RICH_OBJ);
    assert_eq!(text(&mesh), RICH_OBJ);
    assert_eq!(
        faces(&mesh),
        [vec![0, 1, 2, 3], vec![0, 1, 2], vec![0, 1, 2]]
    );
    assert_eq!(mesh.positions()[2], [1.0, 1.0, 0.5]);
    assert_eq!(
        mesh.normals().len(),
        4,
        "those of length zero are not listed"
    );
    assert!(mesh.normals().iter().all(|n| n.normal == [0.0, 0.0, 1.0]));

    let mut positions = mesh.positions().to_vec();
    positions[1][1] = -0.25;
    positions[2][2] = 1e-9;
    positions[4][0] = 0.1 + 0.2;
    mesh.set_positions(positions);
    mesh.set_normals(vec![[0.0, 1.0, 0.0]; 4]);
    let changed = RICH_OBJ
        .replace("+1.0 .0", "+1.0 -0.25")
        .replace("  0.50 2.0", "  1e-9 2.0")
        .replace("v 9 9 9", "v 0.30000000000000004 9 9")
        .replace("vn 0 0 2", "vn 0 1 0");
    assert_eq!(text(&mesh), changed);

    let notes = mesh.notes(MeshFormat::Ply).join("\n");
    assert_eq!(
        notes,
        "not written to PLY: colours or weights of vertices; lines and points; materials; \
         objects and groups; smoothing groups; statements unknown here; texture coordinates"
    );
    assert!(mesh.notes(MeshFormat::Obj).is_empty());
    let notes = mesh.notes(MeshFormat::Stl).join("\n");
    assert!(notes.contains("single precision"), "{notes}");
    assert!(notes.contains("cut into triangles"), "{notes}");
    assert!(
        notes.contains("normals of vertices; vertices of no face"),
        "{notes}"
    );
}

#[test]
fn a_shared_normal_is_split_when_its_vertices_differ() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
                  vn 1 0 0\nvn 0 0 1\n\
                  f 1//2 2//2 3//2\nf 1//-1 3//-1 4//-1\n\
                  vn 0 0 -1\n\
                  f 3//-1 2//-1 1//1\nf 3//3 2//-2 1//-3";
    let mut mesh = obj(square);
    let vertices: Vec<_> = mesh.normals().iter().map(|n| n.vertex).collect();
    assert_eq!(vertices, [0, 0, 1, 2, 3, 1, 2]);
    let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    // All change alike: only the values do.
    mesh.set_normals(vec![y; 7]);
    let alike = square
        .replace("vn 1 0 0", "vn 0 1 0")
        .replace("vn 0 0 1", "vn 0 1 0")
        .replace("vn 0 0 -1", "vn 0 1 0");
    assert_eq!(text(&mesh), alike);

    // The second one becomes three, the third one two.
    mesh.set_normals(vec![x, y, z, y, x, z, y]);
    assert_eq!(
        text(&mesh),
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n\
         vn 1 0 0\nvn 0 1 0\nvn 0 0 1\nvn 1 0 0\n\
         f 1//2 2//3 3//2\nf 1//-3 3//-3 4//-1\n\
         vn 0 0 1\nvn 0 1 0\n\
         f 3//-1 2//-2 1//1\nf 3//6 2//-4 1//-6"
    );
    let again = obj(&text(&mesh));
    assert_eq!(again.normals().len(), 7);
}

#[test]
fn a_normal_at_the_end_of_a_file_without_newline_can_be_split() {
    let mut mesh = obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1//1 2//1 3//1\nvn 0 0 1");
    mesh.set_normals(vec![[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(
        text(&mesh),
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1//1 2//2 3//1\nvn 0 0 1\nvn 0 1 0"
    );
}

#[test]
fn what_is_wrong_with_an_obj_is_said_with_its_line() {
    let refused = |text: &str| message(text, MeshFormat::Obj);
    let triangle = "v 0 0 0\nv 1 0 0\n\nv 0 1 0\n";
    assert_eq!(refused(""), "there are no vertices in it");
    assert_eq!(
        refused("# v 0 0 0\nvn 0 0 1\n"),
        "there are no vertices in it"
    );
    assert_eq!(refused("v 0 0\n"), "line 1: 2 values where 3 are needed");
    assert_eq!(refused("\nv 0 0 x1\n"), "line 2: \"x1\" is not a number");
    assert_eq!(
        refused("v 0 0 0\rv 0 \\\r\n inf 0"),
        "line 2: the coordinate inf is not finite or does not fit its type"
    );
    assert!(refused("v 0 NaN 0").contains("line 1: the coordinate NaN"));
    assert!(refused("v 0 1e999 0").contains("line 1: the coordinate inf"));
    assert_eq!(
        refused("v 0 0 0\nvn 1 2\n"),
        "line 2: 2 values where 3 are needed"
    );
    let refused = |face: &str| refused(&format!("{triangle}{face}\nvn 0 0 1\n"));
    assert_eq!(refused("f 1 2 3/a"), "line 5: \"3/a\" is not an index");
    assert_eq!(refused("f 1 2 //1"), "line 5: \"//1\" is not an index");
    assert_eq!(
        refused("f 1 2 4"),
        "line 5: refers to vertex 4, but there are 3"
    );
    assert_eq!(
        refused("f 1 2 -4"),
        "line 5: refers to vertex -4, but there are 3"
    );
    assert_eq!(
        refused("f 1 2 0"),
        "line 5: refers to vertex 0, but there are 3"
    );
    assert_eq!(
        refused("f 1//1 2//1 3//2"),
        "line 5: refers to normal 2, but there are 1"
    );
    assert!(refused("f 1 2 99999999999").contains("refers to vertex 99999999999"));
    assert!(refused("f 1 2 99999999999999999999").contains("is not an index"));
    let long = refused(&format!("v \u{1b}[31m{} 0 0", "9".repeat(1000)));
    assert!(long.starts_with("line 5: \"\\u{1b}[31m999"), "{long}");
    assert!(long.len() < 100, "{long}");
}

/// A PLY that few programs would write, without its payload.
fn rich_header(encoding: &str) -> String {
    format!(
        "ply\nformat {encoding} 1.0\ncomment one\nelement other 2\nproperty list uchar double d\n\
         comment two\nelement vertex 3\nproperty float nz\nproperty uchar red\n\
         property float nx\nproperty float ny\nproperty double z\nproperty float x\n\
         property float32 y\nobj_info three\nelement face 2\nproperty uchar flag\n\
         property list uint8 int32 vertex_indices\nelement nothing 4000000000\nend_header\n"
    )
}

fn rich_ply(encoding: &str) -> Vec<u8> {
    let mut bytes = rich_header(encoding).into_bytes();
    if encoding == "ascii" {
        bytes.extend_from_slice(
            b"2 0.50 1\n0\n1.0 7 0 0 0.10 0.20 0.30\n0 8 0 0 1 1 1\r\n\n-2 9 0 0 2 3 4\n\
              1 3 2 1 0\n0 2 0 1",
        );
        return bytes;
    }
    let is_big = encoding == "binary_big_endian";
    let mut add = |mut number: Vec<u8>| {
        if is_big {
            number.reverse();
        }
        bytes.append(&mut number);
    };
    let single = |x: f64| (x as f32).to_le_bytes().to_vec();
    let double = |x: f64| x.to_le_bytes().to_vec();
    add(vec![2]);
    add(double(0.5));
    add(double(f64::NAN));
    add(vec![0]);
    for (red, nz, [x, y, z]) in [
        (7, 1.0, [0.2, 0.3, 0.1]),
        (8, 0.0, [1.0, 1.0, 1.0]),
        (9, -2.0, [3.0, 4.0, 2.0]),
    ] {
        add(single(nz));
        add(vec![red]);
        add(single(0.0));
        add(single(0.0));
        add(double(z));
        add(single(x));
        add(single(y));
    }
    for (flag, corners) in [(1, vec![2_i32, 1, 0]), (0, vec![0, 1])] {
        add(vec![flag]);
        add(vec![u8::try_from(corners.len()).expect("few")]);
        for corner in corners {
            add(corner.to_le_bytes().to_vec());
        }
    }
    bytes.extend_from_slice(b"\nand more");
    bytes
}

#[test]
fn a_ply_keeps_all_it_has() {
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let bytes = rich_ply(encoding);
        let mut mesh = parse(&bytes, MeshFormat::Ply);
        assert_eq!(mesh.encode(MeshFormat::Ply).expect("finite"), bytes);
        assert_eq!(faces(&mesh), [[2, 1, 0]]);
        let x = f64::from(0.2_f32);
        assert_eq!(mesh.positions()[0], [x, f64::from(0.3_f32), 0.1]);
        assert_eq!(mesh.positions()[2], [3.0, 4.0, 2.0]);
        let normals: Vec<_> = mesh
            .normals()
            .iter()
            .map(|n| (n.vertex, n.normal))
            .collect();
        assert_eq!(normals, [(0, [0.0, 0.0, 1.0]), (2, [0.0, 0.0, -1.0])]);

        let mut positions = mesh.positions().to_vec();
        // Too little for single precision: nothing changes.
        positions[0][0] += 1e-12;
        positions[1] = [0.1, 1.0, 0.1];
        mesh.set_positions(positions);
        mesh.set_normals(vec![[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]]);
        let changed = mesh.encode(MeshFormat::Ply).expect("finite");
        if encoding == "ascii" {
            let expected = String::from_utf8(bytes).expect("text");
            let expected = expected
                .replace("0 8 0 0 1 1 1\r\n", "0 8 0 0 0.1 0.1 1\r\n")
                .replace("-2 9 0 0", "0.8 9 0 0.6");
            assert_eq!(String::from_utf8(changed).expect("text"), expected);
        } else {
            assert_eq!(changed.len(), bytes.len());
            let again = parse(&changed, MeshFormat::Ply);
            let single = f64::from(0.1_f32);
            assert_eq!(
                again.positions()[0],
                parse(&bytes, MeshFormat::Ply).positions()[0]
            );
            assert_eq!(again.positions()[1], [single, 1.0, 0.1]);
            let different = changed.iter().zip(&bytes).filter(|(a, b)| a != b).count();
            assert!(different <= 4 + 8 + 2 * 4, "{different}");
        }
        let notes = mesh.notes(MeshFormat::Obj).join("\n");
        assert_eq!(
            notes,
            "not written to OBJ: the element other; red of vertex; flag of face; \
             the element nothing; lines and points; normals of vertices"
        );
        let notes = mesh.notes(MeshFormat::Ply).join("\n");
        assert!(notes.contains("single precision"), "{notes}");
    }
}

#[test]
fn what_is_wrong_with_a_ply_is_said_with_its_element() {
    let refused = |text: &str| message(text, MeshFormat::Ply);
    assert!(refused("").contains("no line \"end_header\""));
    assert!(refused("plyx\nend_header\n").contains("begins with the line \"ply\""));
    let ply = |header: &str, payload: &str| {
        refused(&format!(
            "ply\nformat ascii 1.0\n{header}end_header\n{payload}"
        ))
    };
    let xyz = "property float x\nproperty float y\nproperty double z\n";
    let vertices = |count: u64| format!("element vertex {count}\n{xyz}");
    assert_eq!(ply("", ""), "there are no vertices in it");
    assert_eq!(ply(&vertices(0), ""), "there are no vertices in it");
    assert_eq!(
        ply("element \u{1b}\n", ""),
        "line 3: \"element \\u{1b}\" cannot be understood here"
    );
    assert!(ply("element vertex 99999999999999999999999\n", "").starts_with("line 3: "));
    assert!(ply(&(vertices(1) + "property int x\n"), "0 0 0 0").contains("the same name"));
    assert!(ply(&(vertices(1) + &vertices(1)), "0 0 0\n0 0 0").contains("the same name"));
    assert_eq!(
        ply(
            "element vertex 1\nproperty float x\nproperty int y\n",
            "0 0"
        ),
        "header: vertex needs a property y of type float or double"
    );
    assert_eq!(
        ply(
            &(vertices(1) + "element face 1\nproperty int vertex_index\n"),
            "0 0 0\n0"
        ),
        "header: face needs a property vertex_index of type list of whole numbers"
    );
    assert!(
        ply(&(vertices(1) + "property list float int l\n"), "0 0 0 0")
            .contains("list l is no whole")
    );
    let huge = u64::MAX;
    assert_eq!(
        ply(&vertices(huge), "0 0 0\n"),
        format!("header: {huge} × vertex are declared, more than the file can hold")
    );
    assert!(ply(&vertices(2), "0 0 0\n0 0").contains("2 × vertex are declared"));
    assert_eq!(
        ply(&vertices(2), "0 0 0       \n"),
        "vertex 1: the file ends here"
    );
    assert_eq!(
        ply(&vertices(2), "0 0 0\n0 0.12345\n"),
        "vertex 1: 2 values where 3 are needed"
    );
    assert_eq!(
        ply(&vertices(1), "0 0 0 0\n"),
        "vertex 0: more values than were declared"
    );
    assert_eq!(
        ply(&vertices(1), "0 x 0\n"),
        "vertex 0: \"x\" is not a number"
    );
    assert!(ply(&vertices(1), "0 0 1e999\n").contains("vertex 0: the coordinate inf"));
    assert!(ply(&vertices(1), "0 1e39 0\n").contains("vertex 0: the coordinate inf"));

    let face = |payload: &str| {
        let list = "element face 1\nproperty list int int vertex_index\n";
        ply(&(vertices(1) + list), &format!("0 0 0\n{payload}\n"))
    };
    assert_eq!(
        face("3 0 0 1"),
        "face 0: refers to vertex 1, but there are 1"
    );
    assert_eq!(
        face("3 0 0 -1"),
        "face 0: refers to vertex -1, but there are 1"
    );
    assert_eq!(face("-3 0 0 0"), "face 0: a list of length -3");
    assert_eq!(face("3 0 0"), "face 0: 2 values where 3 are needed");
    assert_eq!(
        face("2000000000 0"),
        "face 0: 1 values where 2000000000 are needed"
    );
    assert_eq!(face("1.5 0"), "face 0: \"1.5\" is not an index");

    let binary = |payload: &[u8]| {
        let header = "ply\nformat binary_little_endian 1.0\nelement other 1\n\
                      property list uint double d\nelement vertex 1\n";
        let mut bytes = format!("{header}{xyz}end_header\n").into_bytes();
        bytes.extend_from_slice(payload);
        message(bytes, MeshFormat::Ply)
    };
    assert!(binary(&[0; 19]).contains("1 × vertex are declared"));
    assert_eq!(binary(&[0xFF; 20]), "other 0: the file ends here");
    let mut nan = [0; 20];
    nan[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(binary(&nan).contains("vertex 0: the coordinate NaN"));
}

const STL_TEXT: &str = "solid a name\r
facet normal nan 0 0\r
 outer loop\r
  vertex 0 0 0.0\r
  vertex 1 0 0\r
  vertex 0 1.0 0\r
 endloop\r
endfacet\r
endsolid a name\r
SOLID
facet normal 0 0 -1
outer loop
vertex 0 0 0
vertex 0 1 0
vertex 1 0 5
endloop
endfacet
endsolid";

/// A binary file of triangles, with a header that looks like text.
fn stl_binary(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = b"solid as a rock".to_vec();
    bytes.resize(80, b'.');
    let count = u32::try_from(triangles.len()).expect("few");
    bytes.extend_from_slice(&count.to_le_bytes());
    for triangle in triangles {
        bytes.extend_from_slice(&[0; 12]);
        for value in triangle.as_flattened() {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        bytes.extend_from_slice(&[0x12, 0x34]);
    }
    bytes
}

#[test]
fn an_stl_keeps_all_it_has() {
    let mut mesh = parse(STL_TEXT.as_bytes(), MeshFormat::Stl);
    assert_eq!(text(&mesh), STL_TEXT);
    assert_eq!(faces(&mesh), [[0, 1, 2], [0, 2, 3]], "both solids");
    let mut positions = mesh.positions().to_vec();
    positions[1] = [2.0, 0.1, 0.0];
    mesh.set_positions(positions);
    let changed = STL_TEXT
        .replace("normal nan 0 0", "normal 0 0 1")
        .replace("vertex 1 0 0\r", "vertex 2 0.1 0\r");
    assert_eq!(text(&mesh), changed);
    assert_eq!(
        mesh.notes(MeshFormat::Obj),
        ["not written to OBJ: names of solids"]
    );

    let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut bytes = stl_binary(&[[a, b, c], [a, a, d]]);
    bytes.extend_from_slice(b"and more");
    let mut mesh = parse(&bytes, MeshFormat::Stl);
    assert_eq!(mesh.encode(MeshFormat::Stl).expect("finite"), bytes);
    let mut positions = mesh.positions().to_vec();
    positions[1] = [0.0, 0.0, 1.0];
    mesh.set_positions(positions);
    let mut changed = stl_binary(&[[a, d, c], [a, a, d]]);
    changed.extend_from_slice(b"and more");
    changed[84..88].copy_from_slice(&(-1.0_f32).to_le_bytes());
    assert_eq!(mesh.encode(MeshFormat::Stl).expect("finite"), changed);
    assert_eq!(
        mesh.notes(MeshFormat::Ply),
        ["not written to PLY: attributes of triangles"]
    );
}

#[test]
fn what_is_wrong_with_an_stl_is_said_with_its_place() {
    let refused = |text: &str| message(text, MeshFormat::Stl);
    assert_eq!(refused(""), "header: the file ends here");
    assert_eq!(refused("solid\nendsolid\n"), "there are no vertices in it");
    assert_eq!(refused("solid x"), "line 1: the file ends here");
    let changed = |from: &str, to: &str| refused(&STL_TEXT.replacen(from, to, 1));
    assert_eq!(changed("0 1.0 0", "0 x 0"), "line 6: \"x\" is not a number");
    assert_eq!(
        changed("0 1.0 0", "0 1"),
        "line 6: 2 values where 3 are needed"
    );
    assert_eq!(
        changed("0 1.0 0", "0 1 0 0"),
        "line 6: more values than were declared"
    );
    assert!(changed("0 1.0 0", "0 1e39 0").contains("line 6: the coordinate inf"));
    assert_eq!(
        changed("  vertex 1 0 0\r\n", ""),
        "line 6: expected \"vertex\", found \"endloop\""
    );
    assert_eq!(
        changed("endsolid a name\r\n", ""),
        "line 9: expected \"facet normal\", found \"SOLID\""
    );
    let mut bytes = stl_binary(&[[[0.0; 3]; 3]; 2]);
    let short = &bytes[..bytes.len() - 1];
    assert_eq!(
        message(short, MeshFormat::Stl),
        "triangle 1: the file ends here"
    );
    bytes[80..84].fill(0xFF);
    assert_eq!(
        message(&bytes, MeshFormat::Stl),
        "triangle 2: the file ends here"
    );
    let nan = stl_binary(&[[[0.0; 3]; 3], [[f32::NAN; 3]; 3]]);
    assert!(message(nan, MeshFormat::Stl).contains("triangle 1: the coordinate NaN"));
}

#[test]
fn what_cannot_be_written_is_refused() {
    let mut mesh = obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2 3\n");
    let mut positions = mesh.positions().to_vec();
    positions[2][1] = 1e39;
    mesh.set_positions(positions.clone());
    for format in FORMATS {
        let result = mesh.encode(format).map_err(|error| error.to_string());
        assert_eq!(result.is_err(), format == MeshFormat::Stl);
    }
    positions[2][1] = f64::NAN;
    mesh.set_positions(positions.clone());
    for format in FORMATS {
        match mesh.encode(format).expect_err("not finite") {
            MeshFileError::At {
                place: Place::Item { name, index: 2 },
                problem: Problem::NotFinite { .. },
            } => assert_eq!(name, "vertex"),
            other => panic!("{other}"),
        }
    }
    positions[2][1] = 1.0;
    mesh.set_positions(positions);
    mesh.set_normals(vec![[f64::INFINITY; 3]]);
    let error = mesh.encode(MeshFormat::Obj).expect_err("not finite");
    assert!(error.to_string().contains("line 4: "), "{error}");

    let points = obj("v 0 0 0");
    assert_eq!(points.encode(MeshFormat::Stl), Err(MeshFileError::NoFaces));
}

#[test]
fn other_formats_get_the_geometry() {
    let smooth = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 9 9 9\nvn 0 0 1\nvn 1 0 0\n\
                  f 1//1 2//1 3//2 4//1\n";
    let mesh = obj(smooth);
    let ply = parse(
        &mesh.encode(MeshFormat::Ply).expect("finite"),
        MeshFormat::Ply,
    );
    assert_eq!(ply.positions(), mesh.positions());
    assert_eq!(faces(&ply), faces(&mesh));
    assert_eq!(ply.normals().len(), 4);
    assert_eq!(ply.normals()[2].normal, [1.0, 0.0, 0.0]);
    assert_eq!(
        String::from_utf8(ply.encode(MeshFormat::Obj).expect("finite")).expect("text"),
        "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 9 9 9\n\
         vn 0 0 1\nvn 0 0 1\nvn 1 0 0\nvn 0 0 1\nvn 0 0 0\n\
         f 1//1 2//2 3//3 4//4\n"
    );
    let stl = parse(
        &mesh.encode(MeshFormat::Stl).expect("finite"),
        MeshFormat::Stl,
    );
    assert_eq!(stl.positions(), &mesh.positions()[..4]);
    assert_eq!(faces(&stl), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(
        String::from_utf8(stl.encode(MeshFormat::Obj).expect("finite")).expect("text"),
        "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3\nf 1 3 4\n"
    );

    // Two normals at a vertex, or none at a corner: no normals.
    for sharp in [
        smooth.to_owned() + "f 1//2 2//1 3//2\n",
        smooth.to_owned() + "f 1 3 5\n",
    ] {
        let mesh = obj(&sharp);
        let ply = parse(
            &mesh.encode(MeshFormat::Ply).expect("finite"),
            MeshFormat::Ply,
        );
        assert!(ply.normals().is_empty());
        assert_eq!(
            mesh.notes(MeshFormat::Ply),
            ["not written to PLY: normals of vertices"]
        );
    }

    // More corners than a byte can count.
    let mut polygon: String = (0..300).map(|i| format!("v {i} 0 0\n")).collect();
    polygon.push('f');
    polygon.extend((1..=300).map(|i| format!(" {i}")));
    let mesh = obj(&polygon);
    let ply = parse(
        &mesh.encode(MeshFormat::Ply).expect("finite"),
        MeshFormat::Ply,
    );
    assert_eq!(faces(&ply), faces(&mesh));
}

#[test]
fn notes_stay_short_whatever_the_header() {
    let mut header = "ply\nformat ascii 1.0\nelement vertex 1\n".to_owned();
    for name in ["x", "y", "z"] {
        header += &format!("property double {name}\n");
    }
    header.extend((0..100).map(|i| format!("property char p{i}\n")));
    header.extend((0..100).map(|i| format!("element e{i} 0\n")));
    let file = header + "end_header\n0 0 0" + &" 1".repeat(100);
    let notes = parse(file.as_bytes(), MeshFormat::Ply).notes(MeshFormat::Obj);
    assert_eq!(
        notes,
        [
            "not written to OBJ: p0, p1, p2, p3, p4, p5, p6, p7 and 92 more of vertex; \
             the element e0; the element e1; the element e2; the element e3; the element e4; \
             the element e5; the element e6; the element e7; the element e8; the element e9; \
             the element e10; 89 more"
        ]
    );
}

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
