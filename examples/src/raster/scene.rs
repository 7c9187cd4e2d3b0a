//! What is in a picture, and how it is drawn.
//!
//! Bands of rows are drawn in parallel. In each, a depth test finds the
//! triangle seen by every sample; then every triangle seen in a pixel is lit
//! once, at the middle of its samples, and the results are averaged as linear
//! light.

use super::camera::{Camera, Viewport};
use super::ground::Ground;
use super::image::{Image, from_linear, to_linear};
use super::light::{Finish, Lights};
use super::scan::Facet;
use super::shadow::ShadowMap;
use super::tessellate::{Mesh, Triangle, mesh_triangles, round_cone};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Pixel rows drawn by one task.
const BAND: usize = 16;

/// Width of a wireframe line on each of the two sides of an edge, in pixels.
const HALF_LINE: f64 = 0.6;
const LINE: DVec3 = DVec3::new(0.02, 0.025, 0.035);
const LINE_OPACITY: f64 = 0.75;

const NOTHING: u32 = u32::MAX;
const GROUND: u32 = u32::MAX - 1;

/// Shapes to draw.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    triangles: Vec<Triangle>,
    ground_y: Option<f64>,
}

impl Scene {
    /// An empty scene.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a mesh; triangles with a corner that is not finite are left away.
    ///
    /// Normals are smoothed except across creases of more than 40°.
    ///
    /// # Panics
    ///
    /// If a triangle refers to a vertex that does not exist, or if there is not
    /// one colour per vertex.
    pub fn add_mesh(&mut self, mesh: &Mesh<'_>) {
        self.triangles.extend(mesh_triangles(mesh));
    }

    /// Adds the convex hull of two spheres: a capsule where the radii agree, a
    /// sphere where the ends do.
    ///
    /// Nothing is added if a number is not finite.
    pub fn add_round_cone(
        &mut self,
        ends: [[f64; 3]; 2],
        radii: [f64; 2],
        colour: [f32; 3],
        finish: Finish,
    ) {
        let finite = ends.iter().flatten().chain(&radii).all(|x| x.is_finite());
        if finite {
            let ends = ends.map(DVec3::from);
            self.triangles
                .extend(round_cone(ends, radii, to_linear(colour), finish));
        }
    }

    /// Lays a floor at height `y`, with a faint grid and the shadow of the scene.
    pub fn set_ground(&mut self, y: f64) {
        self.ground_y = Some(y);
    }

    /// The scene as `camera` sees it.
    ///
    /// `samples` squared samples per pixel smooth the outlines; 2 is good, 3 is
    /// better. Cost grows with pixels and with triangles; the result does not
    /// depend on the number of threads.
    ///
    /// # Panics
    ///
    /// If `samples` is zero, or with 2³² − 2 triangles or more.
    #[must_use]
    pub fn render(&self, camera: &Camera, width: usize, height: usize, samples: usize) -> Image {
        assert!(samples > 0, "a pixel needs at least one sample");
        assert!(self.triangles.len() < GROUND as usize, "too many triangles");
        let mut image = Image::filled(width, height, [0.0; 3]);
        if image.rgb.is_empty() {
            return image;
        }
        let painter = Painter::new(self, camera, width, height, samples);
        image
            .rgb
            .par_chunks_mut(width * BAND)
            .enumerate()
            .for_each(|(band, pixels)| painter.paint(band * BAND, pixels));
        image
    }
}

/// Everything that the bands of one picture share.
struct Painter<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    /// Pixels, while the facets count in samples.
    view: Viewport,
    samples: usize,
    facets: Vec<Option<Facet>>,
    lights: Lights,
    shadow: ShadowMap,
    ground: Option<Ground>,
    /// Inverse depth of the ground as `[per x, per y, constant]` in samples.
    floor: Option<DVec3>,
}

impl<'a> Painter<'a> {
    fn new(
        scene: &'a Scene,
        camera: &'a Camera,
        width: usize,
        height: usize,
        samples: usize,
    ) -> Self {
        let fine = Viewport::new(camera, width * samples, height * samples);
        let facets = scene
            .triangles
            .iter()
            .map(|t| {
                let corners = t.corners.map(|p| camera.to_camera(p));
                Facet::perspective(corners, camera.near, fine)
            })
            .collect();
        let lights = Lights::new(camera);
        let ground = scene
            .ground_y
            .map(|y| Ground::new(y, camera, &scene.triangles));
        let floor = ground.as_ref().map(|ground| {
            let axes = [camera.right, camera.up, camera.forward];
            fine.pull_back(axes.map(|axis| ground.inverse_depth(axis)).into())
        });
        Self {
            scene,
            camera,
            view: Viewport::new(camera, width, height),
            samples,
            facets,
            lights,
            shadow: ShadowMap::new(&scene.triangles, lights.key),
            ground,
            floor,
        }
    }

    /// Draws the rows of `pixels`, the first of which is `first_row`.
    fn paint(&self, first_row: usize, pixels: &mut [[u8; 3]]) {
        let (width, n) = (self.view.width, self.samples);
        let seen = self.seen(first_row, pixels.len() / width);
        let mut ids = Vec::with_capacity(n * n);
        for (row, pixels) in pixels.chunks_exact_mut(width).enumerate() {
            for (column, pixel) in pixels.iter_mut().enumerate() {
                ids.clear();
                for y in n * row..n * (row + 1) {
                    let start = n * (column + width * y);
                    ids.extend_from_slice(&seen[start..start + n]);
                }
                let corner = DVec2::new(column as f64, (first_row + row) as f64);
                *pixel = from_linear(self.pixel(&ids, corner));
            }
        }
    }

    /// The mean light from the surfaces that the samples of a pixel see.
    fn pixel(&self, ids: &[u32], corner: DVec2) -> DVec3 {
        if ids.iter().all(|&id| id == ids[0]) {
            return self.light(ids[0], corner + 0.5);
        }
        let n = self.samples;
        let mut light = DVec3::ZERO;
        for (s, &id) in ids.iter().enumerate() {
            if ids[..s].contains(&id) {
                continue;
            }
            let (mut count, mut sum) = (0.0, DVec2::ZERO);
            for (s, _) in ids.iter().enumerate().filter(|&(_, &other)| other == id) {
                count += 1.0;
                sum += DVec2::new((s % n) as f64, (s / n) as f64) + 0.5;
            }
            light += self.light(id, corner + sum / (count * n as f64)) * count;
        }
        light / ids.len() as f64
    }

    /// The surface seen by each sample of some rows of pixels.
    fn seen(&self, first_row: usize, rows: usize) -> Vec<u32> {
        let width = self.view.width * self.samples;
        let fine_rows = first_row * self.samples..(first_row + rows) * self.samples;
        let mut seen = vec![NOTHING; width * fine_rows.len()];
        let mut nearness = vec![0.0_f64; seen.len()];
        if let Some(floor) = self.floor {
            let rows = seen
                .chunks_exact_mut(width)
                .zip(nearness.chunks_exact_mut(width));
            for ((seen, nearness), row) in rows.zip(fine_rows.clone()) {
                let at_row = floor.y * (row as f64 + 0.5) + floor.z;
                for (x, (id, nearest)) in seen.iter_mut().zip(nearness).enumerate() {
                    let value = floor.x * (x as f64 + 0.5) + at_row;
                    if value > 0.0 && value <= 1.0 / self.camera.near {
                        (*id, *nearest) = (GROUND, value);
                    }
                }
            }
        }
        for (facet, id) in self.facets.iter().zip(0..) {
            let Some(facet) = facet else { continue };
            facet.scan(&fine_rows, |x, y, value| {
                let i = x + width * (y - fine_rows.start);
                if value > nearness[i] {
                    (seen[i], nearness[i]) = (id, value);
                }
            });
        }
        seen
    }

    /// World direction through pixel coordinates `at`, of unit depth.
    fn ray(&self, at: DVec2) -> DVec3 {
        self.camera.ray_to_world(self.view.ray(at.x, at.y))
    }

    /// The light from surface `id` through pixel coordinates `at`.
    fn light(&self, id: u32, at: DVec2) -> DVec3 {
        let background = background(at.y / self.view.height as f64);
        match (id, &self.ground) {
            (NOTHING, _) => background,
            (GROUND, Some(ground)) => {
                let rays = [at, at + DVec2::X, at + DVec2::Y].map(|p| self.ray(p));
                ground.light(rays, background, &self.shadow)
            }
            _ => self.surface_light(id as usize, at),
        }
    }

    fn surface_light(&self, id: usize, at: DVec2) -> DVec3 {
        let triangle = &self.scene.triangles[id];
        let facet = self.facets[id]
            .as_ref()
            .expect("a triangle that was seen has a facet");
        let samples = self.samples as f64;
        let (weights, distances) = facet.corner_weights(at.x * samples, at.y * samples);
        let blend = |v: &[DVec3; 3]| v[0] * weights[0] + v[1] * weights[1] + v[2] * weights[2];

        let point = blend(&triangle.corners);
        let to_eye = (self.camera.eye - point).normalize();
        let [a, b, c] = triangle.corners;
        // Seen from behind, a surface is lit as if it were turned around.
        let side = (b - a).cross(c - a).dot(to_eye).signum();
        let normal = (blend(&triangle.normals) * side).normalize_or(to_eye);
        let albedo = blend(&triangle.colours);
        let visible = self.shadow.visible(point, normal);
        let light = self
            .lights
            .shade(normal, to_eye, albedo, triangle.finish, visible);
        if triangle.wireframe {
            let nearest = distances.into_iter().fold(f64::INFINITY, f64::min) / samples;
            let opacity = (HALF_LINE + 0.5 - nearest).clamp(0.0, 1.0) * LINE_OPACITY;
            light.lerp(LINE, opacity)
        } else {
            light
        }
    }
}

/// The backdrop, from the upper (0) to the lower border (1) of the picture.
fn background(height: f64) -> DVec3 {
    const TOP: DVec3 = DVec3::new(0.66, 0.72, 0.80);
    const BOTTOM: DVec3 = DVec3::new(0.92, 0.925, 0.93);
    TOP.lerp(BOTTOM, height.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::tessellate::Paint;
    use super::*;

    /// One unit of length is ten pixels on the plane z = 0.
    fn front_view() -> Camera {
        let fov = 2.0 * 0.2_f64.atan();
        Camera::look_at([0.0, 0.0, 10.0], [0.0; 3], [0.0, 1.0, 0.0], fov)
    }

    const SIZE: usize = 40;

    /// A right triangle with legs of 2 along x and y, its right angle at
    /// `(-1, -1, z)`.
    fn add_triangle(scene: &mut Scene, z: f64, colour: [f32; 3]) {
        scene.add_mesh(&Mesh {
            positions: &[[-1.0, -1.0, z], [1.0, -1.0, z], [-1.0, 1.0, z]],
            triangles: &[[0, 1, 2]],
            paint: Paint::Uniform(colour),
            wireframe: false,
            finish: Finish::Satin,
        });
    }

    fn varied_scene() -> Scene {
        let mut scene = Scene::new();
        scene.set_ground(-1.0);
        add_triangle(&mut scene, -0.5, [0.2, 0.8, 0.3]);
        for i in 0..5 {
            let x = 0.4 * f64::from(i) - 0.8;
            let ends = [[x, -0.9, 0.2], [0.3 * x, 0.6, -0.3 * x]];
            scene.add_round_cone(ends, [0.2, 0.1], [0.9, 0.7, 0.6], Finish::Skin);
        }
        scene
    }

    #[test]
    fn a_triangle_covers_the_pixels_below_its_diagonal() {
        let empty = Scene::new().render(&front_view(), SIZE, SIZE, 1);
        let mut scene = Scene::new();
        add_triangle(&mut scene, 0.0, [1.0, 0.0, 0.0]);
        let image = scene.render(&front_view(), SIZE, SIZE, 1);
        for row in 0..SIZE {
            for column in 0..SIZE {
                // Legs reach from pixel 10 to pixel 30; the diagonal itself runs
                // through pixel centres, where rounding decides.
                let (x, y) = (column + 1, row + 1);
                let inside = (11..=30).contains(&x) && (11..=30).contains(&y) && x < y;
                let on_diagonal = x == y && (11..=30).contains(&x);
                let i = column + SIZE * row;
                assert!(
                    on_diagonal || (image.rgb[i] != empty.rgb[i]) == inside,
                    "pixel ({column}, {row})"
                );
            }
        }
    }

    #[test]
    fn the_nearer_triangle_wins_in_any_order() {
        let render = |order: [(f64, [f32; 3]); 2]| {
            let mut scene = Scene::new();
            for (z, colour) in order {
                add_triangle(&mut scene, z, colour);
            }
            scene.render(&front_view(), SIZE, SIZE, 2)
        };
        let (near, far) = ((0.1, [0.0, 0.0, 1.0]), (-0.1, [1.0, 0.0, 0.0]));
        let image = render([near, far]);
        assert_eq!(image, render([far, near]));
        let [r, _, b] = image.rgb[15 + SIZE * 25];
        assert!(b > r, "the blue triangle is in front");
    }

    #[test]
    fn shared_edges_have_neither_gaps_nor_overlaps_of_the_backdrop() {
        let mut scene = Scene::new();
        // A fan of slivers around an arbitrary point fills a large square.
        let rim: Vec<[f64; 3]> = (0..=40)
            .map(|i| [0.2 * f64::from(i) - 4.0, 4.0, 0.3])
            .collect();
        let mut positions = vec![[0.123, -0.456, 0.789], [-4.0, -4.0, 0.0], [4.0, -4.0, 0.0]];
        positions.extend(rim);
        let mut triangles = vec![[0, 1, 2], [0, 2, 43], [0, 3, 1]];
        triangles.extend((3..43).map(|i| [0, i + 1, i]));
        scene.add_mesh(&Mesh {
            positions: &positions,
            triangles: &triangles,
            paint: Paint::Uniform([0.0; 3]),
            wireframe: false,
            finish: Finish::Skin,
        });
        let image = scene.render(&front_view(), SIZE, SIZE, 3);
        // Black skin reflects a faint highlight only; the backdrop is far brighter.
        assert!(image.rgb.iter().flatten().all(|&c| c < 120));
    }

    #[test]
    fn triangles_around_and_behind_the_eye_are_drawn_or_left_away() {
        let mut scene = Scene::new();
        scene.set_ground(-1.0);
        scene.add_mesh(&Mesh {
            positions: &[
                [-5.0, -0.5, 20.0],
                [5.0, -0.5, 20.0],
                [0.0, -0.5, -20.0],
                [0.0, 0.0, 10.0],
                [f64::NAN, 0.0, 0.0],
                [f64::INFINITY, 0.0, 0.0],
            ],
            triangles: &[[0, 1, 2], [0, 1, 3], [3, 3, 3], [0, 2, 4], [1, 2, 5]],
            paint: Paint::Uniform([1.0, 0.0, 0.0]),
            wireframe: true,
            finish: Finish::Satin,
        });
        let image = scene.render(&front_view(), SIZE, SIZE, 2);
        let [r, g, _] = image.rgb[SIZE / 2 + SIZE * (SIZE - 1)];
        assert!(r > g, "the floor under the eye reaches the lower border");
        let [r, _, b] = image.rgb[SIZE / 2];
        assert!(b >= r, "the backdrop is left above");
    }

    #[test]
    fn the_picture_does_not_depend_on_threads() {
        let scene = varied_scene();
        let render = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let draw = || scene.render(&front_view(), 90, 70, 2);
            pool.unwrap().install(draw)
        };
        let once = render(1);
        assert_eq!(once, render(1));
        assert_eq!(once, render(2));
    }

    #[test]
    fn objects_darken_the_ground_below_them() {
        let camera = Camera::look_at([0.0, 8.0, 8.0], [0.0; 3], [0.0, 1.0, 0.0], 0.6);
        let brightness = |with_ball: bool| -> u32 {
            let mut scene = Scene::new();
            scene.set_ground(0.0);
            if with_ball {
                scene.add_round_cone([[0.0, 1.0, 0.0]; 2], [1.0; 2], [1.0; 3], Finish::Satin);
            }
            let image = scene.render(&camera, SIZE, SIZE, 1);
            // Just right of the ball, away from the key light at the left.
            u32::from(image.rgb[26 + SIZE * 15][1])
        };
        assert!(brightness(true) + 20 < brightness(false));
    }

    #[test]
    fn an_empty_picture_and_an_empty_scene_are_fine() {
        assert!(varied_scene().render(&front_view(), 0, 5, 2).rgb.is_empty());
        let mut scene = Scene::new();
        scene.set_ground(f64::NAN);
        assert_eq!(scene.render(&front_view(), 3, 2, 2).rgb.len(), 6);
    }
}
