//! VTK XML files for `ParaView` and friends: one unstructured grid a frame, and a
//! collection that gives each its time.

use std::fmt::Write as _;

/// An unstructured grid of tetrahedra with the distance each vertex is displaced, as
/// ASCII `.vtu` text.
///
/// `positions` is `#V × 3` in metres, `displacement_m` is `#V` long.
#[must_use]
pub fn grid(positions: &[[f64; 3]], tets: &[[u32; 4]], displacement_m: &[f64]) -> String {
    let mut out = String::new();
    let mut put = |text: std::fmt::Arguments<'_>| {
        let _infallible = out.write_fmt(text);
    };
    put(format_args!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n\
         <UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n\
         <Points>\n<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">\n",
        positions.len(),
        tets.len()
    ));
    for [x, y, z] in positions {
        put(format_args!("{x} {y} {z}\n"));
    }
    put(format_args!(
        "</DataArray>\n</Points>\n<Cells>\n\
         <DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">\n"
    ));
    for [a, b, c, d] in tets {
        put(format_args!("{a} {b} {c} {d}\n"));
    }
    put(format_args!(
        "</DataArray>\n<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">\n"
    ));
    for i in 1..=tets.len() {
        put(format_args!("{}\n", 4 * i));
    }
    put(format_args!(
        "</DataArray>\n<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">\n"
    ));
    for _ in tets {
        put(format_args!("10\n"));
    }
    put(format_args!(
        "</DataArray>\n</Cells>\n<PointData Scalars=\"displacement_m\">\n\
         <DataArray type=\"Float64\" Name=\"displacement_m\" format=\"ascii\">\n"
    ));
    for d in displacement_m {
        put(format_args!("{d}\n"));
    }
    put(format_args!(
        "</DataArray>\n</PointData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n"
    ));
    out
}

/// A collection (`.pvd`) of grids: file name and time in seconds of each.
#[must_use]
pub fn collection(entries: &[(String, f64)]) -> String {
    let mut out = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n",
    );
    for (file, time_s) in entries {
        let _infallible = writeln!(
            out,
            "<DataSet timestep=\"{time_s}\" part=\"0\" file=\"{file}\"/>"
        );
    }
    out.push_str("</Collection>\n</VTKFile>\n");
    out
}
