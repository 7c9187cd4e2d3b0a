//! PLY from the geometry alone.

use std::io;

use ply_rs_bw::{
    ply::{
        Addable as _, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType,
        ScalarType,
    },
    writer::Writer,
};

use super::super::{
    error::{MeshFileError, Place, Problem, finite},
    geometry::Geometry,
};

/// A vertex or a face, on its way into the file.
#[derive(Default)]
struct Item {
    position: [f64; 3],
    normal: [f64; 3],
    corners: Vec<i32>,
}

impl PropertyAccess for Item {
    fn new() -> Self {
        Self::default()
    }

    fn get_double(&self, name: &str) -> Option<f64> {
        Some(match name {
            "x" => self.position[0],
            "y" => self.position[1],
            "z" => self.position[2],
            "nx" => self.normal[0],
            "ny" => self.normal[1],
            "nz" => self.normal[2],
            _ => return None,
        })
    }

    fn get_list_int(&self, _name: &str) -> Option<&[i32]> {
        Some(&self.corners)
    }
}

/// Writes a binary file in double precision, with normals if there is one for each vertex.
pub(in super::super) fn write(geometry: &Geometry) -> Result<Vec<u8>, MeshFileError> {
    let too_many = |of, count| Place::Header.error(Problem::TooMany { of, count });
    let normals = geometry.vertex_normals();
    let vertex_count = geometry.positions.len();
    // Indices are `int`, which every program reads.
    i32::try_from(vertex_count).map_err(|_| too_many("vertices", vertex_count))?;
    let most_corners = geometry.faces.iter().map(<[_]>::len).max().unwrap_or(0);
    // A list of lengths below 256 is what most programs expect.
    let length = match u8::try_from(most_corners) {
        Ok(_) => ScalarType::UChar,
        Err(_) => ScalarType::UInt,
    };

    let mut vertex = ElementDef::new("vertex".to_owned());
    vertex.count = vertex_count;
    let names = ["x", "y", "z", "nx", "ny", "nz"];
    for name in &names[..if normals.is_some() { 6 } else { 3 }] {
        let double = PropertyType::Scalar(ScalarType::Double);
        vertex
            .properties
            .add(PropertyDef::new((*name).to_owned(), double));
    }
    let mut face = ElementDef::new("face".to_owned());
    face.count = geometry.faces.len();
    let list = PropertyType::List(length, ScalarType::Int);
    face.properties
        .add(PropertyDef::new("vertex_indices".to_owned(), list));

    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.elements.add(vertex.clone());
    header.elements.add(face.clone());

    for (index, value) in geometry.positions.iter().enumerate() {
        for &value in value {
            finite(value).map_err(|problem| Place::item("vertex", index).error(problem))?;
        }
    }
    let mut out = Vec::new();
    let mut write_all = || -> io::Result<()> {
        let writer = Writer::<Item>::new();
        writer.write_header(&mut out, &header)?;
        let mut item = Item::default();
        for (index, position) in geometry.positions.iter().enumerate() {
            item.position = *position;
            item.normal = normals.as_ref().map_or([0.0; 3], |normals| normals[index]);
            writer.write_little_endian_element(&mut out, &item, &vertex)?;
        }
        for corners in geometry.faces.iter() {
            item.corners.clear();
            // They are below the number of vertices.
            let indices = corners
                .iter()
                .map(|&c| i32::try_from(c).unwrap_or_default());
            item.corners.extend(indices);
            writer.write_little_endian_element(&mut out, &item, &face)?;
        }
        Ok(())
    };
    write_all().expect("memory takes everything, and the lists fit their lengths");
    Ok(out)
}
