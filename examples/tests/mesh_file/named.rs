//! Files that have something special, and what is wrong with files.

use super::*;

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
pub(super) const RICH_OBJ: &str = "\u{FEFF}# Latin and beyond: \u{e9}\r
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

pub(super) fn rich_ply(encoding: &str) -> Vec<u8> {
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

pub(super) const STL_TEXT: &str = "solid a name\r
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
pub(super) fn stl_binary(triangles: &[[[f32; 3]; 3]]) -> Vec<u8> {
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
