//! Pictures without a window: a small z-buffer renderer on the CPU.
//!
//! Reports and tests want pictures where there is no display and no graphics
//! driver. This module draws meshes, hands made of round cones and a ground
//! with shadows into an [`Image`], puts several of them on a [`ContactSheet`],
//! and writes PNG.
//!
//! * [`Scene`] collects shapes, [`Scene::render`] draws them as a [`Camera`]
//!   sees them.
//! * [`colormap`] turns a number into a colour, [`ColorBar`] explains it.
//! * [`draw_text`] writes labels.
//!
//! # Conventions
//!
//! World coordinates are right-handed with y up, in any unit of length: shadow
//! and grid adapt to the size of the scene. Colours in the interface are sRGB,
//! three numbers in `[0, 1]`; light is added up in linear values inside. Pixel
//! (0, 0) is at the upper left.
//!
//! # Limits
//!
//! Everything is opaque, there are no textures, and one light casts shadows.
//! The picture is the same to the last byte whatever the number of threads,
//! because every pixel goes through the triangles in the order in which they
//! were added.
//!
//! # Example
//!
//! ```
//! use examples::raster::{Camera, Finish, Scene};
//!
//! let mut scene = Scene::new();
//! scene.set_ground(0.0);
//! scene.add_round_cone([[0.0, 0.3, 0.0], [0.0, 1.0, 0.0]], [0.3, 0.2], [0.8, 0.4, 0.2], Finish::Satin);
//! let camera = Camera::look_at([2.0, 1.5, 3.0], [0.0, 0.5, 0.0], [0.0, 1.0, 0.0], 0.6);
//! let image = scene.render(&camera, 64, 48, 2);
//! assert_eq!(image.rgb.len(), 64 * 48);
//! let mut png = Vec::new();
//! image.write_png(&mut png)?;
//! # Ok::<(), png::EncodingError>(())
//! ```

mod camera;
mod colormap;
mod contact;
mod ground;
mod image;
mod light;
mod scan;
mod scene;
mod shadow;
mod sheet;
mod tessellate;
mod text;

pub use camera::Camera;
pub use colormap::colormap;
pub use image::Image;
pub(crate) use image::{from_linear, to_bytes, to_linear};
pub use light::Finish;
pub use scene::Scene;
pub use sheet::{ColorBar, ContactSheet, Panel};
pub use tessellate::{Mesh, Paint};
pub use text::{draw_text, text_size};
